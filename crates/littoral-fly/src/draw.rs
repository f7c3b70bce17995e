//! What is drawn of a frame, and how: in the light of the data, or plainly; by one method or by two; at once, or more cleanly the longer it rests.

use crate::compare::{Compare, Difference, Shown};
use crate::plain;
use crate::rest::{self, Gathered, Gatherer};
use crate::scene::{Choice, Frame};
use crate::settings::{Settings, Show, Split, Style};
use glam::{Mat4, UVec2, Vec2};
use littoral::field::{HeightField, Sea};
use littoral::lod::Mesh;
use littoral::picture::{Placed, Stage};
use littoral::space::{Datum, View};
use littoral_gpu::{Gpu, Ground, Look, ShapeTexture, Triangles, Waves};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A land and its light, ready to be drawn.
#[derive(Clone, Debug)]
pub struct Scenery {
    /// For pictures in the light of the data; shared with the scene, which brings the sky of other heights.
    full: Option<Arc<Mutex<littoral_gpu::Scenery>>>,
    plain: Arc<plain::Scenery>,
    /// For rays, once they are asked for; nothing if the device has no room.
    shape: Arc<OnceLock<Option<ShapeTexture>>>,
    /// How often it has changed since.
    changes: Arc<AtomicU64>,
}

impl Scenery {
    /// Of a stage, seen from a height (m). What cannot be drawn in full is drawn plainly; the sentence says why.
    pub fn new(gpu: &Gpu, stage: &Stage<'_>, height: f64) -> (Scenery, Option<String>) {
        let full = match stage.land().datum() {
            Datum::Plane { origin, size } => {
                littoral_gpu::Scenery::new(gpu, &stage.tables(), (origin, size), (height, &stage.sky_table(height)))
                    .map_err(|e| format!("{e}; drawn plainly"))
            }
            _ => Err("this land can only be drawn plainly".to_owned()),
        };
        let (full, problem) = match full {
            Ok(scenery) => (Some(Arc::new(Mutex::new(scenery))), None),
            Err(problem) => (None, Some(problem)),
        };
        let plain = Arc::new(plain::Scenery::new(stage));
        (Scenery { full, plain, shape: Arc::default(), changes: Arc::default() }, problem)
    }

    /// Whether it can only be drawn plainly.
    pub fn is_plain(&self) -> bool {
        self.full.is_none()
    }

    /// Which scenery it is, and in which state.
    fn state(&self) -> (usize, u64) {
        (Arc::as_ptr(&self.plain) as usize, self.changes.load(Ordering::Relaxed))
    }

    /// Draws the waves of a sea from now on, or still water. What cannot be drawn lies still; the sentence says why.
    pub fn set_waves(&self, gpu: &Gpu, sea: Option<&Sea>) -> Result<(), String> {
        let Some(full) = &self.full else { return Ok(()) };
        // The lock is held while they are handed over, not while they are made.
        let waves = sea.map(|sea| Waves::new(gpu, sea)).transpose();
        let (waves, problem) = waves.map_or_else(|e| (None, Some(e)), |waves| (waves.flatten(), None));
        full.lock().unwrap_or_else(PoisonError::into_inner).set_waves(waves);
        self.changes.fetch_add(1, Ordering::Relaxed);
        problem.map_or(Ok(()), |e| Err(format!("{e}; natural pictures show still water")))
    }

    /// Goes on to the instant at which the sea of [`Scenery::set_waves`] stands now.
    pub fn follow_waves(&self, gpu: &Gpu, sea: &Sea) {
        if let Some(full) = &self.full {
            full.lock().unwrap_or_else(PoisonError::into_inner).follow_waves(gpu, sea);
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Draws these objects from now on. Where there are too many, those before stay; the sentence says why.
    pub fn set_objects(&self, gpu: &Gpu, placed: &[Placed]) -> Result<(), String> {
        let Some(full) = &self.full else { return Ok(()) };
        self.changes.fetch_add(1, Ordering::Relaxed);
        full.lock().unwrap_or_else(PoisonError::into_inner).set_objects(gpu, placed).map_err(|e| e.to_string())
    }

    /// Makes the ground ready for rays. What cannot be is drawn as triangles; the sentence says why, once.
    pub fn bring_rays(&self, gpu: &Gpu, stage: &Stage<'_>) -> Result<(), String> {
        let mut problem = None;
        self.shape.get_or_init(|| {
            self.changes.fetch_add(1, Ordering::Relaxed);
            ShapeTexture::new(gpu, stage.land()).map_err(|e| problem = Some(format!("{e}; drawn as triangles"))).ok()
        });
        problem.map_or(Ok(()), Err)
    }

    /// Brings what a view needs of a picture that is too large to be on the device as a whole: a few pages at a time, so that the window does not wait for the lock.
    pub fn bring_picture(&self, gpu: &Gpu, stage: &Stage<'_>, view: &View) {
        /// Pages at a time.
        const FEW: usize = 4;
        let Some(full) = &self.full else { return };
        let (_, changed) = full.lock().unwrap_or_else(PoisonError::into_inner).bring_picture(gpu, stage, view, FEW);
        if changed {
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Brings the sky as it is seen from a height (m), if it is another one. The lock is held while it is copied, not while it is made.
    pub fn see_from(&self, gpu: &Gpu, stage: &Stage<'_>, height: f64) {
        let Some(full) = &self.full else { return };
        let locked = || full.lock().unwrap_or_else(PoisonError::into_inner);
        if locked().wants_sky(height) {
            let sky = stage.sky_table(height);
            locked().set_sky(gpu, height, &sky);
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// What is to be seen.
pub struct Seen<'a> {
    /// The land and its light.
    pub scenery: &'a Scenery,
    /// The meshes.
    pub frame: &'a Frame,
    /// How it is shown.
    pub settings: &'a Settings,
    /// The radiance that is shown as middle grey (kcd/m²).
    pub grey: f32,
    /// The eye, and the pixels of the window.
    pub view: View,
    /// Where the second picture begins, as a share of the width.
    pub divider: f32,
}

impl Seen<'_> {
    /// The pictures that are shown.
    fn choices(&self) -> impl Iterator<Item = &Choice> {
        let second = self.frame.second.as_ref().filter(|_| self.settings.split != Split::Off);
        std::iter::once(&self.frame.first).chain(second)
    }

    /// One pixel of light for so many of the window's, each way. Edges are drawn by the window's own.
    fn coarse(&self) -> u32 {
        match (self.settings.style, self.settings.show) {
            (Style::Plain, _) | (_, Show::Wireframe | Show::Both) => 1,
            _ if self.scenery.is_plain() => 1,
            _ => self.settings.coarse.max(1),
        }
    }

    /// How two pictures are shown.
    fn shown(&self) -> Shown {
        match self.settings.split {
            Split::Difference => Shown::Difference(self.settings.gain as f32),
            _ => Shown::Halves((self.divider * self.view.size.x as f32).round()),
        }
    }
}

/// All that a picture depends on; but for the exposure, which settles slowly.
#[derive(Clone, PartialEq)]
struct Pose {
    view: View,
    frame: (u64, u64),
    scenery: (usize, u64),
    settings: Settings,
}

/// A picture at rest.
#[derive(Default)]
struct Rest {
    pose: Option<(Pose, f32)>,
    /// Frames since it rests.
    frames: u32,
    gathered: [Gathered; 2],
}

impl Rest {
    /// How many frames it has been the same picture.
    fn follow(&mut self, seen: &Seen) -> u32 {
        let pose = Pose {
            view: seen.view,
            frame: (seen.frame.serial, seen.frame.number),
            scenery: seen.scenery.state(),
            // Neither the panel nor the gain changes what is looked at.
            settings: Settings { panel: true, gain: 1.0, ..seen.settings.clone() },
        };
        /// An exposure that is this near is the same.
        const ALIKE: f32 = 0.015;
        let same =
            self.pose.as_ref().is_some_and(|(before, grey)| *before == pose && (seen.grey / grey).ln().abs() < ALIKE);
        match same {
            true => self.frames = self.frames.saturating_add(1),
            false => (self.pose, self.frames) = (Some((pose, seen.grey)), 0),
        }
        self.frames
    }
}

/// Draws frames.
pub struct Renderer {
    full: littoral_gpu::Renderer,
    plain: plain::Renderer,
    grounds: [Triangles; 2],
    /// Which frame's grounds those are.
    holds: Option<(u64, u64)>,
    compare: Compare,
    gatherer: Gatherer,
    rest: Rest,
    /// Bytes of meshes brought to the device since [`Renderer::take_uploads`].
    uploads: u64,
}

impl Renderer {
    /// For targets of a format.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Renderer {
        Renderer {
            full: littoral_gpu::Renderer::new(gpu, format),
            plain: plain::Renderer::new(gpu, format),
            grounds: Default::default(),
            holds: None,
            compare: Compare::new(gpu, format),
            gatherer: Gatherer::new(gpu, format),
            rest: Rest::default(),
            uploads: 0,
        }
    }

    /// Bytes of meshes that were brought to the device since this was asked last.
    pub fn take_uploads(&mut self) -> u64 {
        std::mem::take(&mut self.uploads)
    }

    /// How far apart the two pictures were that were shown last.
    pub fn difference(&self) -> Option<Difference> {
        self.compare.difference
    }

    /// Draws the window's picture: quickly while something moves, cleaner with each frame that nothing does. `true` while it rests.
    pub fn show(&mut self, gpu: &Gpu, seen: &Seen, target: &wgpu::TextureView) -> bool {
        self.hold(gpu, seen);
        let frames = self.rest.follow(seen);
        if frames == 0 {
            self.at_once(gpu, seen, seen.coarse(), target);
            return false;
        }
        let (size, coarse) = (seen.view.size, seen.coarse());
        // The first frame of a rest looks through the middle of coarse pixels, as moving pictures do.
        let part = (frames > 1).then(|| rest::part(frames - 1, size, coarse));
        if frames <= 1 + rest::looks(coarse) {
            let view = rest::spread(&seen.view, coarse);
            for (side, choice) in seen.choices().enumerate() {
                let look = self.gatherer.look(gpu, &mut self.rest.gathered[side], view.size);
                let through = part.map_or(Look::default(), |part| part.look);
                self.draw(gpu, seen, (side, choice), &view, through, &look, view.size);
                self.gatherer.gather(gpu, &mut self.rest.gathered[side], part, size, coarse);
            }
        }
        self.gathered(gpu, seen, target);
        true
    }

    /// Draws a picture for good, as sharp as the target: the one that rests, if every pixel of it was looked through.
    pub fn copy(&mut self, gpu: &Gpu, seen: &Seen, target: &wgpu::TextureView) {
        self.hold(gpu, seen);
        match self.rest.frames > seen.coarse().pow(2) {
            true => self.gathered(gpu, seen, target),
            false => self.at_once(gpu, seen, 1, target),
        }
    }

    /// Brings the grounds of a frame to the device.
    fn hold(&mut self, gpu: &Gpu, seen: &Seen) {
        let frame = Some((seen.frame.serial, seen.frame.number));
        if self.holds == frame || seen.settings.style == Style::Plain {
            return;
        }
        let choices = std::iter::once(&seen.frame.first).chain(&seen.frame.second);
        for (ground, choice) in self.grounds.iter_mut().zip(choices) {
            // No budget of the panel's is too large for what WebGPU promises of buffers; if one were, the triangles before stay.
            match ground.set(gpu, &choice.ground.mesh) {
                Ok(()) => self.uploads += bytes(&choice.ground.mesh),
                Err(problem) => eprintln!("littoral-fly: {problem}"),
            }
        }
        self.holds = frame;
    }

    /// Where each of the pictures is to be drawn: alone on the target, or to be compared.
    fn targets(&mut self, gpu: &Gpu, seen: &Seen, target: &wgpu::TextureView) -> Vec<wgpu::TextureView> {
        match seen.choices().count() {
            1 => vec![target.clone()],
            _ => self.compare.pictures(gpu, seen.view.size).into(),
        }
    }

    /// Draws each picture with one look.
    fn at_once(&mut self, gpu: &Gpu, seen: &Seen, coarse: u32, target: &wgpu::TextureView) {
        let size = (seen.view.size / coarse).max(UVec2::ONE);
        let scale = size.y as f32 / seen.view.size.y.max(1) as f32;
        let view = View { size, pixels_per_radian: seen.view.pixels_per_radian * scale, ..seen.view };
        let targets = self.targets(gpu, seen, target);
        for (side, (choice, target)) in seen.choices().zip(&targets).enumerate() {
            self.draw(gpu, seen, (side, choice), &view, Look::default(), target, seen.view.size);
        }
        if targets.len() > 1 {
            self.compare.show(gpu, seen.shown(), target);
        }
    }

    /// Shows what was gathered of each picture.
    fn gathered(&mut self, gpu: &Gpu, seen: &Seen, target: &wgpu::TextureView) {
        let targets = self.targets(gpu, seen, target);
        for (gathered, target) in self.rest.gathered.iter().zip(&targets) {
            self.gatherer.show(gpu, gathered, target);
        }
        if targets.len() > 1 {
            self.compare.show(gpu, seen.shown(), target);
        }
    }

    /// Draws one picture, stretched over a target of some size (pixels).
    #[allow(clippy::too_many_arguments, reason = "what is drawn, how, and onto what")]
    fn draw(
        &mut self,
        gpu: &Gpu,
        seen: &Seen,
        (side, choice): (usize, &Choice),
        view: &View,
        look: Look,
        target: &wgpu::TextureView,
        size: UVec2,
    ) {
        let settings = seen.settings;
        let (surface, wireframe) = (settings.show != Show::Wireframe, settings.show != Show::Textured);
        let full = seen.scenery.full.as_ref().filter(|_| settings.style != Style::Plain);
        let Some(full) = full else {
            let (ground, water) = (&choice.ground.mesh, choice.water.as_ref().map(|water| &water.mesh));
            let drawn = plain::Frame { view: &moved(view, look), ground, water, surface, wireframe };
            self.uploads += bytes(ground) + water.map_or(0, bytes);
            return self.plain.draw(gpu, &seen.scenery.plain, &drawn, target);
        };
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let locked = full.lock().unwrap_or_else(PoisonError::into_inner);
        let ground = &self.grounds[side];
        let shape = seen.scenery.shape.get().and_then(Option::as_ref);
        let source = match shape.filter(|_| choice.detail.shows_rays(settings.style, settings.show)) {
            Some(shape) => Ground::Rays { shape, pixels: 0.0 },
            None => Ground::Triangles(ground),
        };
        self.full.draw(gpu, &mut encoder, &locked, source, view, look);
        match surface {
            true => self.full.show(gpu, &mut encoder, &locked, seen.grey, target, size),
            false => clear(&mut encoder, target, [0.82, 0.84, 0.86]),
        }
        if wireframe {
            self.full.wires(gpu, &mut encoder, ground, target);
        }
        gpu.queue.submit([encoder.finish()]);
    }
}

/// How large a mesh is.
fn bytes(mesh: &Mesh) -> u64 {
    (size_of_val(&mesh.vertices[..]) + size_of_val(&mesh.triangles[..])) as u64
}

/// A view through another part of each pixel.
fn moved(view: &View, look: Look) -> View {
    let shift = Vec2::new(-2.0, 2.0) * look.offset / view.size.max(UVec2::ONE).as_vec2();
    // x + shift · w, whatever is seen.
    let mut sheared = Mat4::IDENTITY;
    sheared.w_axis.x = shift.x;
    sheared.w_axis.y = shift.y;
    View { clip_from_eye: sheared * view.clip_from_eye, ..*view }
}

/// One colour everywhere.
pub fn clear(encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView, [r, g, b]: [f64; 3]) {
    let load = wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 });
    drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("clear"),
        color_attachments: &[Some(onto(target, load))],
        ..Default::default()
    }));
}

/// What a pass draws onto.
pub fn onto(view: &wgpu::TextureView, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_view_moves_by_parts_of_pixels() {
        let view = View::looking_at(DVec3::Z * 50.0, DVec3::new(90.0, 120.0, 10.0), 0.9, UVec2::new(80, 45));
        let place = DVec3::new(80.0, 130.0, 12.0);
        let offset = Vec2::new(0.25, -0.4);
        let seen = moved(&view, Look { offset, number: 1 });
        // What lies in the part that is looked through lies in the middle.
        let by = view.pixel(place).expect("ahead") - seen.pixel(place).expect("ahead");
        assert!(by.distance(offset) < 1e-4, "{by}");
    }
}
