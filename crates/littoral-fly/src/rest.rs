//! A picture that rests gets clean: every frame it is looked at anew, through another part of each pixel, and all looks are averaged.
//!
//! Pictures that are drawn coarsely become sharp as well: of a coarse look's pixels each belongs to one pixel of the window, and the looks go through all of
//! them in turn, first once, then again, each time through another part of them.

use crate::compare::{canvas, everywhere};
use crate::draw::onto;
use glam::{Mat4, UVec2, Vec2};
use littoral::space::View;
use littoral_gpu::{Gpu, Look};

/// So many looks go through each pixel.
const ROUNDS: u32 = 16;

/// A look through one part of each pixel of a coarse picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Which of a coarse pixel's parts, right and down.
    pub part: UVec2,
    /// How it is looked through.
    pub look: Look,
}

/// What is looked at, one pixel for `coarse` of the window's, each way. Its pixels end where the window's do: it reaches beyond where those are no whole
/// number. It is seen as finely as the window's own pixels are.
pub fn spread(view: &View, coarse: u32) -> View {
    let size = view.size.as_vec2();
    let cells = view.size.map(|side| side.div_ceil(coarse));
    let scale = size / (cells * coarse).as_vec2();
    let clip_from_eye = Mat4::from_scale(scale.extend(1.0)) * view.clip_from_eye;
    View { clip_from_eye, size: cells, ..*view }
}

/// By how many of the window's pixels a spread picture reaches beyond the left and upper edge: whole ones, and the rest.
fn margin(size: UVec2, coarse: u32) -> (UVec2, Vec2) {
    let more = size.map(|side| side.div_ceil(coarse)) * coarse - size;
    (more / 2, (more % 2).as_vec2() * 0.5)
}

/// The look of a number, from 1, at a picture of a size.
pub fn part(number: u32, size: UVec2, coarse: u32) -> Part {
    let parts = coarse * coarse;
    let (round, turn) = ((number - 1) / parts, (number - 1) % parts);
    // Neighbours in time are no neighbours in the pixel: a stride near the golden section that meets every part.
    let stride = [1, 1, 3, 5, 7, 16, 23, 31, 39][coarse.min(8) as usize];
    let turn = turn * stride % parts;
    let part = UVec2::new(turn % coarse, turn / coarse);
    // All rounds together evenly over the pixel (M. Roberts's R2 sequence, 2018), the first through the middle.
    let within = (Vec2::new(0.754_877_7, 0.569_840_3) * round as f32 + 0.5).fract();
    let offset = (part.as_vec2() + margin(size, coarse).1 + within) / coarse as f32 - 0.5;
    Part { part, look: Look { offset, number } }
}

/// How many looks there are at a picture before it is clean.
pub fn looks(coarse: u32) -> u32 {
    ROUNDS * coarse * coarse
}

/// Gathers looks at a picture.
pub struct Gatherer {
    gathers: wgpu::RenderPipeline,
    settles: wgpu::RenderPipeline,
    how: wgpu::Buffer,
    format: wgpu::TextureFormat,
}

/// The looks at one picture so far.
#[derive(Default)]
pub struct Gathered {
    look: Option<wgpu::Texture>,
    /// Those so far, and those with the next.
    sums: Option<[wgpu::Texture; 2]>,
}

/// Sums of light, and a count: nobody blends into them, so every device can draw them.
const SUMS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

impl Gatherer {
    /// For pictures in a format of targets, whose values are encoded as sRGB.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Gatherer {
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("rest"),
            source: wgpu::ShaderSource::Wgsl(include_str!("shaders/rest.wgsl").into()),
        });
        let how = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gathering"),
            size: 32,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let gathers = everywhere(gpu, &module, "gather", SUMS);
        Gatherer { gathers, settles: everywhere(gpu, &module, "settle", format), how, format }
    }

    /// Where the next look at a picture is to be drawn, by as many pixels as it has.
    pub fn look(&self, gpu: &Gpu, gathered: &mut Gathered, size: UVec2) -> wgpu::TextureView {
        let kept = gathered.look.take().filter(|look| (look.width(), look.height()) == size.into());
        let look = gathered.look.insert(kept.unwrap_or_else(|| canvas(gpu, "look", self.format, size)));
        look.create_view(&Default::default())
    }

    /// Takes the look that was drawn to those before: `None` begins with a look through the middle of the coarse pixels. `size` is the whole picture's.
    pub fn gather(&self, gpu: &Gpu, gathered: &mut Gathered, part: Option<Part>, size: UVec2, coarse: u32) {
        let kept = gathered.sums.take().filter(|[sums, _]| (sums.width(), sums.height()) == size.into());
        let [before, after] = kept.unwrap_or_else(|| [(); 2].map(|()| canvas(gpu, "sums", SUMS, size)));
        let shift = margin(size, coarse).0;
        let through = part.map_or(UVec2::ZERO, |part| part.part);
        let how = [through.x, through.y, shift.x, shift.y, coarse, part.is_none().into(), 0, 0];
        gpu.queue.write_buffer(&self.how, 0, bytemuck::cast_slice(&how));
        if let Some(look) = &gathered.look {
            let entries = [(0, look), (1, &before)];
            self.pass(gpu, &self.gathers, &entries, true, &after.create_view(&Default::default()));
        }
        gathered.sums = Some([after, before]);
    }

    /// Shows what was gathered.
    pub fn show(&self, gpu: &Gpu, gathered: &Gathered, target: &wgpu::TextureView) {
        if let Some([sums, _]) = &gathered.sums {
            self.pass(gpu, &self.settles, &[(1, sums)], false, target);
        }
    }

    fn pass(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::RenderPipeline,
        textures: &[(u32, &wgpu::Texture)],
        told: bool,
        target: &wgpu::TextureView,
    ) {
        let views: Vec<_> =
            textures.iter().map(|(i, texture)| (*i, texture.create_view(&Default::default()))).collect();
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let mut entries: Vec<_> =
            views.iter().map(|(i, view)| entry(*i, wgpu::BindingResource::TextureView(view))).collect();
        if told {
            entries.push(entry(2, self.how.as_entire_binding()));
        }
        let bound = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("rest"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("rest"),
            color_attachments: &[Some(onto(target, wgpu::LoadOp::Clear(wgpu::Color::BLACK)))],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bound, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::tests::{FORMAT, device, fill};
    use crate::paint::pixels;
    use glam::DVec3;

    #[test]
    fn looks_go_through_every_pixel_of_the_window() {
        for (coarse, size) in [
            (1, UVec2::new(64, 36)),
            (2, UVec2::new(65, 37)),
            (3, UVec2::new(80, 45)),
            (4, UVec2::new(79, 46)),
            (8, UVec2::new(50, 33)),
        ] {
            let view = View::looking_at(DVec3::Z * 100.0, DVec3::new(300.0, 400.0, 0.0), 0.8, size);
            let coarsely = spread(&view, coarse);
            let (shift, _) = margin(size, coarse);
            let (corner, right, down) = coarsely.frame();
            let mut seen = std::collections::HashSet::new();
            for number in 1..=coarse * coarse {
                let Part { part, look } = part(number, size, coarse);
                for pixel in [UVec2::ZERO, UVec2::new(11, 7), size - 1] {
                    let at = pixel + shift;
                    if at % coarse != part {
                        continue;
                    }
                    seen.insert(pixel);
                    // The first round looks through the middle of the window's own pixels.
                    let through = (at / coarse).as_vec2() + 0.5 + look.offset;
                    let direction = (corner + right * through.x + down * through.y).normalize();
                    let own = view.direction(pixel.as_vec2() + 0.5);
                    assert!(direction.distance(own) < 2e-5, "{coarse}: {pixel}: {direction} for {own}");
                }
            }
            assert_eq!(seen.len(), 3, "{coarse}: each of them once a round");
        }
    }

    #[test]
    fn coarse_looks_become_a_sharp_picture() {
        let Some(gpu) = device() else { return };
        let gatherer = Gatherer::new(&gpu, FORMAT);
        for (coarse, size) in [(1, UVec2::new(17, 9)), (4, UVec2::new(43, 22))] {
            // Every pixel of the window has its own colour.
            let scene = |at: UVec2| [(at.x * 5) as u8, (at.y * 11) as u8, ((at.x + at.y) % 2 * 200) as u8];
            let (shift, cells) = (margin(size, coarse).0, size.map(|side| side.div_ceil(coarse)));
            let mut gathered = Gathered::default();
            let target = canvas(&gpu, "target", FORMAT, size);
            let view = target.create_view(&Default::default());
            for number in 0..=coarse * coarse {
                let part = (number > 0).then(|| part(number, size, coarse));
                let through = part.map_or(UVec2::ZERO, |part| part.part);
                let _ = gatherer.look(&gpu, &mut gathered, cells);
                let seen = |cell: UVec2| scene((cell * coarse + through).max(shift) - shift);
                fill(&gpu, gathered.look.as_ref().expect("made"), seen);
                gatherer.gather(&gpu, &mut gathered, part, size, coarse);
            }
            gatherer.show(&gpu, &gathered, &view);
            let shown = pixels(&gpu, &target).expect("read");
            for (i, shown) in shown.iter().enumerate() {
                let at = UVec2::new(i as u32 % size.x, i as u32 / size.x);
                let off = (0..3).map(|c| shown[c].abs_diff(scene(at)[c])).max();
                assert!(off <= Some(1), "{coarse}: {at}: {shown:?} for {:?}", scene(at));
            }
        }
    }

    #[test]
    fn rounds_go_through_other_parts_of_each_pixel() {
        let size = UVec2::new(64, 36);
        let offsets: Vec<_> = (1..=looks(2)).map(|number| part(number, size, 2)).collect();
        assert_eq!(offsets.len(), 64);
        let of_one: Vec<_> = offsets.iter().filter(|p| p.part == UVec2::ZERO).map(|p| p.look.offset).collect();
        assert_eq!(of_one.len() as u32, ROUNDS);
        for (i, a) in of_one.iter().enumerate() {
            assert!(a.cmpge(Vec2::splat(-0.5)).all() && a.cmple(Vec2::ZERO).all(), "{a} within the part");
            assert!(of_one[..i].iter().all(|b| a.distance(*b) > 0.03), "{a} twice");
        }
    }
}
