//! What is drawn of a frame, and how: in the light of the data, or plainly.

use crate::plain;
use crate::scene::Frame;
use crate::settings::{Settings, Show, Style};
use glam::UVec2;
use littoral::field::HeightField;
use littoral::picture::Stage;
use littoral::space::{Datum, View};
use littoral_gpu::{Gpu, Ground, Look, Triangles};
use std::sync::{Arc, Mutex, PoisonError};

/// A land and its light, ready to be drawn.
#[derive(Clone, Debug)]
pub struct Scenery {
    /// For pictures in the light of the data; shared with the scene, which brings the sky of other heights.
    full: Option<Arc<Mutex<littoral_gpu::Scenery>>>,
    plain: Arc<plain::Scenery>,
}

impl Scenery {
    /// Of a stage, seen from a height (m). What cannot be drawn in full is drawn plainly; the sentence says why.
    pub fn new(gpu: &Gpu, stage: &Stage<'_>, height: f64) -> (Scenery, Option<String>) {
        let full = match (stage.tables(), stage.land().datum()) {
            (Some(tables), Datum::Plane { origin, size }) => {
                littoral_gpu::Scenery::new(gpu, &tables, (origin, size), (height, &stage.sky_table(height)))
                    .map_err(|e| format!("{e}; drawn plainly"))
            }
            _ => Err("this land can only be drawn plainly".to_owned()),
        };
        let (full, problem) = match full {
            Ok(scenery) => (Some(Arc::new(Mutex::new(scenery))), None),
            Err(problem) => (None, Some(problem)),
        };
        (Scenery { full, plain: Arc::new(plain::Scenery::new(stage)) }, problem)
    }

    /// Brings the sky as it is seen from a height (m), if it is another one. The lock is held while it is copied, not while it is made.
    pub fn see_from(&self, gpu: &Gpu, stage: &Stage<'_>, height: f64) {
        let Some(full) = &self.full else { return };
        let locked = || full.lock().unwrap_or_else(PoisonError::into_inner);
        if locked().wants_sky(height) {
            let sky = stage.sky_table(height);
            locked().set_sky(gpu, height, &sky);
        }
    }
}

/// Draws frames.
pub struct Renderer {
    full: littoral_gpu::Renderer,
    plain: plain::Renderer,
    ground: Triangles,
    /// Which frame's ground that is.
    holds: Option<u64>,
}

impl Renderer {
    /// For targets of a format.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Renderer {
        let full = littoral_gpu::Renderer::new(gpu, format);
        Renderer { full, plain: plain::Renderer::new(gpu, format), ground: Triangles::default(), holds: None }
    }

    /// Draws what a camera sees; `view` tells it for a number of pixels. `grey` is the radiance that is shown as middle grey (kcd/m²).
    #[allow(clippy::too_many_arguments, reason = "what is drawn, how, and onto what")]
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        scenery: &Scenery,
        frame: &Frame,
        settings: &Settings,
        grey: f32,
        view: &dyn Fn(UVec2) -> View,
        target: &wgpu::TextureView,
        size: UVec2,
    ) {
        let (surface, wireframe) = (settings.show != Show::Wireframe, settings.show != Show::Textured);
        let full = scenery.full.as_ref().filter(|_| settings.style == Style::Natural);
        let Some(full) = full else {
            let (ground, water) = (&frame.ground, frame.water.as_ref());
            let drawn = plain::Frame { view: &view(size), ground, water, surface, wireframe };
            return self.plain.draw(gpu, &scenery.plain, &drawn, target);
        };
        if self.holds != Some(frame.number) {
            // No budget of the panel's is too large for what WebGPU promises of buffers; if one were, the triangles before stay.
            if let Err(problem) = self.ground.set(gpu, &frame.ground) {
                eprintln!("littoral-fly: {problem}");
            }
            self.holds = Some(frame.number);
        }
        // Edges are drawn by the pixels of the target.
        let coarse = if wireframe { 1 } else { settings.coarse };
        let view = view((size / coarse).max(UVec2::ONE));
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let locked = full.lock().unwrap_or_else(PoisonError::into_inner);
        self.full.draw(gpu, &mut encoder, &locked, Ground::Triangles(&self.ground), &view, Look::default());
        match surface {
            true => self.full.show(gpu, &mut encoder, &locked, grey, target, size),
            false => clear(&mut encoder, target, [0.82, 0.84, 0.86]),
        }
        if wireframe {
            self.full.wires(gpu, &mut encoder, &self.ground, target);
        }
        gpu.queue.submit([encoder.finish()]);
    }
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
