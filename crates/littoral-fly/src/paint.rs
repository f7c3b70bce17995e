//! The window's surface: the picture, the panel over it, and copies of both.

use crate::cockpit::Cockpit;
use crate::compare::Difference;
use crate::draw::{self, Seen};
use glam::UVec2;
use littoral_gpu::Gpu;
use std::sync::Arc;
use winit::window::Window;

/// What egui wants to be painted.
pub struct Gui {
    /// The triangles.
    pub primitives: Vec<egui::ClippedPrimitive>,
    /// Textures that changed.
    pub textures: egui::TexturesDelta,
    /// Pixels a point.
    pub scale: f32,
}

/// What paints a window.
pub struct Paint {
    /// The device.
    pub gpu: Gpu,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    renderer: draw::Renderer,
    gui: egui_wgpu::Renderer,
}

/// Why a picture did not get to the window.
pub enum Missed {
    /// This time; the next one will.
    Frame,
    /// For good.
    Lost(String),
}

impl Paint {
    /// For a window; `timed` frames do not wait for the screen.
    pub fn new(window: &Arc<Window>, timed: bool) -> Result<Paint, String> {
        let descriptor = wgpu::InstanceDescriptor::new_with_display_handle_from_env(Box::new(window.clone()));
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance.create_surface(window.clone()).map_err(|e| {
            format!("expected a window that can be drawn into, got an error: {e}; update the graphics driver")
        })?;
        let gpu = Gpu::of(&instance, Some(&surface)).map_err(|e| e.to_string())?;
        let limit = gpu.device.limits().max_texture_dimension_2d;
        // The same choice that the device was made from, asked what it can show.
        let adapter = wgpu::util::initialize_adapter_from_env_or_default(&instance, Some(&surface));
        let adapter = pollster::block_on(adapter).map_err(|e| e.to_string())?;
        let size = window.inner_size();
        let mut configuration = surface
            .get_default_config(&adapter, size.width.clamp(1, limit), size.height.clamp(1, limit))
            .ok_or_else(|| {
                let name = &gpu.adapter.name;
                format!("expected {name} to show pictures in this window, got a device that cannot; choose another with WGPU_ADAPTER_NAME")
            })?;
        // Colours come encoded, as egui mixes them.
        configuration.format = configuration.format.remove_srgb_suffix();
        let modes = surface.get_capabilities(&adapter).present_modes;
        configuration.present_mode = match timed && modes.contains(&wgpu::PresentMode::Immediate) {
            true => wgpu::PresentMode::Immediate,
            false => wgpu::PresentMode::Fifo,
        };
        surface.configure(&gpu.device, &configuration);
        let renderer = draw::Renderer::new(&gpu, configuration.format);
        let gui = egui_wgpu::Renderer::new(&gpu.device, configuration.format, egui_wgpu::RendererOptions::default());
        Ok(Paint { gpu, surface, configuration, renderer, gui })
    }

    /// Pixels of the window.
    pub fn size(&self) -> UVec2 {
        UVec2::new(self.configuration.width, self.configuration.height)
    }

    /// The window's size changed.
    pub fn resize(&mut self, size: UVec2) {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        if size.min_element() > 0 && size != self.size() {
            let size = size.min(UVec2::splat(limit));
            (self.configuration.width, self.configuration.height) = (size.x, size.y);
            self.surface.configure(&self.gpu.device, &self.configuration);
        }
    }

    /// Paints the window. `true` where its picture rests.
    pub fn show(&mut self, cockpit: &Cockpit, gui: &Gui) -> Result<bool, Missed> {
        use wgpu::CurrentSurfaceTexture as Current;
        self.gpu.check().map_err(|e| Missed::Lost(e.to_string()))?;
        let texture = match self.surface.get_current_texture() {
            Current::Success(texture) | Current::Suboptimal(texture) => texture,
            Current::Timeout | Current::Occluded => return Err(Missed::Frame),
            Current::Outdated | Current::Lost => {
                self.surface.configure(&self.gpu.device, &self.configuration);
                return Err(Missed::Frame);
            }
            Current::Validation => {
                return Err(Missed::Lost("the window can no longer be drawn into; start again".into()));
            }
        };
        let target = texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let rests = match self.seen(cockpit) {
            Some(seen) => self.renderer.show(&self.gpu, &seen, &target),
            None => self.nothing(&target),
        };
        self.over(gui, &target);
        self.gpu.queue.present(texture);
        Ok(rests)
    }

    /// How far apart the two pictures were that were shown last.
    pub fn difference(&self) -> Option<Difference> {
        self.renderer.difference()
    }

    /// Bytes of meshes that were brought to the device since this was asked last.
    pub fn take_uploads(&mut self) -> u64 {
        self.renderer.take_uploads()
    }

    /// Takes what changed of egui's textures: once for each run of it, painted or not.
    pub fn take_textures(&mut self, gui: &mut Gui) {
        for (id, deltas) in &gui.textures.set {
            for delta in deltas {
                self.gui.update_texture(&self.gpu.device, &self.gpu.queue, *id, delta);
            }
        }
        for id in &gui.textures.free {
            self.gui.free_texture(id);
        }
        gui.textures.clear();
    }

    /// The picture as it is seen now, as sharp as can be, red, green and blue, with the panel if that is given.
    pub fn copy(&mut self, cockpit: &Cockpit, gui: Option<&Gui>) -> Result<Vec<[u8; 3]>, String> {
        let size = self.size();
        let texture = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("copy"),
            size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.configuration.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let target = texture.create_view(&wgpu::TextureViewDescriptor::default());
        match self.seen(cockpit) {
            Some(seen) => self.renderer.copy(&self.gpu, &seen, &target),
            None => _ = self.nothing(&target),
        }
        if let Some(gui) = gui {
            self.over(gui, &target);
        }
        pixels(&self.gpu, &texture)
    }

    /// What is to be seen, as soon as there is something.
    fn seen<'a>(&self, cockpit: &'a Cockpit) -> Option<Seen<'a>> {
        Some(Seen {
            scenery: cockpit.scenery.as_ref()?,
            frame: cockpit.frame.as_ref()?,
            settings: &cockpit.settings,
            grey: cockpit.grey(),
            view: cockpit.view(self.size()),
            divider: cockpit.divider,
        })
    }

    /// Nothing to see yet.
    fn nothing(&self, target: &wgpu::TextureView) -> bool {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        draw::clear(&mut encoder, target, [0.16, 0.20, 0.24]);
        self.gpu.queue.submit([encoder.finish()]);
        false
    }

    /// Paints the panel.
    fn over(&mut self, gui: &Gui, target: &wgpu::TextureView) {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let screen =
            egui_wgpu::ScreenDescriptor { size_in_pixels: self.size().to_array(), pixels_per_point: gui.scale };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut commands = self.gui.update_buffers(device, queue, &mut encoder, &gui.primitives, &screen);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panel"),
            color_attachments: &[Some(draw::onto(target, wgpu::LoadOp::Load))],
            ..Default::default()
        });
        self.gui.render(&mut pass.forget_lifetime(), &gui.primitives, &screen);
        commands.push(encoder.finish());
        queue.submit(commands);
    }
}

/// What a texture holds: red, green and blue, row by row.
pub fn pixels(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<[u8; 3]>, String> {
    let size = texture.size();
    let row = (4 * size.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("copy"),
        size: u64::from(row) * u64::from(size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(size.height) };
    let into = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), into, size);
    gpu.queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    let problem = |e: &dyn std::fmt::Display| format!("the picture could not be read back from the graphics card: {e}");
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| problem(&e))?;
    let bytes = buffer.slice(..).get_mapped_range().map_err(|e| problem(&e))?;
    let blue_first = matches!(texture.format(), wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb);
    let colour = |p: &[u8]| if blue_first { [p[2], p[1], p[0]] } else { [p[0], p[1], p[2]] };
    let lines = bytes.chunks_exact(row as usize);
    Ok(lines.flat_map(|line| line[..4 * size.width as usize].chunks_exact(4).map(colour)).collect())
}
