//! A device for those who have none.

use crate::times::PassTimes;
use std::fmt::Write;
use std::sync::{Arc, OnceLock};

/// A device and its queue.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// Makes resources.
    pub device: wgpu::Device,
    /// Takes work.
    pub queue: wgpu::Queue,
    /// What does the work.
    pub adapter: wgpu::AdapterInfo,
    /// Where passes leave how long they took.
    pub times: Option<Arc<PassTimes>>,
    /// What went wrong first.
    fault: Arc<OnceLock<String>>,
}

/// Why there is no device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// Nothing that could draw was found.
    #[error(
        "expected a graphics adapter, found none ({tried}); install the driver of the graphics card, or Mesa's software Vulkan (Debian: mesa-vulkan-drivers)"
    )]
    NoAdapter {
        /// What was tried, and how it failed.
        tried: String,
    },
    /// The adapter lacks what is needed.
    #[error(
        "expected {wanted}, but {adapter} offers {offered}; choose another adapter (WGPU_ADAPTER_NAME), or draw on the processor"
    )]
    TooLittle {
        /// The adapter's name.
        adapter: String,
        /// What is needed.
        wanted: String,
        /// What there is.
        offered: String,
    },
    /// The device went away.
    #[error("{adapter} was lost: {reason}; begin again, or draw on the processor")]
    Lost {
        /// The adapter's name.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// The adapter gave no device.
    #[error("{adapter} gave no device: {reason}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// What it said.
        reason: String,
    },
}

/// What is done with textures that not every adapter can do.
const FORMATS: [(wgpu::TextureFormat, wgpu::TextureUsages, &str); 3] = [
    (crate::renderer::RADIANCE, wgpu::TextureUsages::RENDER_ATTACHMENT, "drawing into"),
    (wgpu::TextureFormat::Rgba32Float, wgpu::TextureUsages::STORAGE_BINDING, "writing to"),
    (wgpu::TextureFormat::R32Float, wgpu::TextureUsages::STORAGE_BINDING, "writing to"),
];

impl Gpu {
    /// The best adapter there is, without a window. The usual variables of wgpu choose another: `WGPU_BACKEND`, `WGPU_ADAPTER_NAME`.
    pub fn headless() -> Result<Gpu, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        Gpu::of(&instance, None)
    }

    /// The best adapter of an instance; one that can draw to a window's surface, if that is given.
    pub fn of(instance: &wgpu::Instance, surface: Option<&wgpu::Surface>) -> Result<Gpu, GpuError> {
        let adapter = pollster::block_on(wgpu::util::initialize_adapter_from_env_or_default(instance, surface))
            .map_err(|e| GpuError::NoAdapter { tried: one_line(&e) })?;
        let info = adapter.get_info();
        let limits = adapter.limits();
        let wanted = wgpu::Limits::default();
        let mut lacks = String::new();
        wanted.check_limits_with_fail_fn(&limits, false, |name, wanted, offered| {
            let _ = write!(lacks, "{}{name} {offered} of {wanted}", if lacks.is_empty() { "" } else { ", " });
        });
        // Some drivers of OpenGL keep the limits, but cannot draw into every kind of texture. The adapter of tests tells of none.
        for (format, usage, verb) in FORMATS {
            if info.backend != wgpu::Backend::Noop
                && !adapter.get_texture_format_features(format).allowed_usages.contains(usage)
            {
                let _ = write!(lacks, "{}no {verb} {format:?} textures", if lacks.is_empty() { "" } else { ", " });
            }
        }
        if !lacks.is_empty() {
            if info.backend == wgpu::Backend::Gl {
                lacks.push_str(" (a driver for Vulkan, Metal or Direct3D 12 may do better)");
            }
            return Err(GpuError::TooLittle {
                adapter: format!("{} ({})", info.name, info.backend),
                wanted: "what WebGPU promises".into(),
                offered: lacks,
            });
        }
        // Large rasters want large textures; nothing else goes beyond what every WebGPU device has.
        let limits = wgpu::Limits {
            max_texture_dimension_2d: limits.max_texture_dimension_2d,
            max_buffer_size: limits.max_buffer_size,
            max_storage_buffer_binding_size: limits.max_storage_buffer_binding_size,
            ..wanted
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("littoral"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::NoDevice { adapter: info.name.clone(), reason: one_line(&e) })?;
        // Without memory, or without a device, what is drawn is drawn nowhere: the one who waits for it is told.
        let fault = Arc::new(OnceLock::new());
        let (first, lost) = (fault.clone(), fault.clone());
        device.on_uncaptured_error(Arc::new(move |error| drop(first.set(one_line(&error)))));
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                drop(lost.set(format!("device lost ({message})")));
            }
        });
        Ok(Gpu { device, queue, adapter: info, times: None, fault })
    }

    /// The same device; what is made and recorded with this one tells how long its passes take, if the adapter has a clock for them.
    pub fn timed(self) -> Gpu {
        Gpu { times: PassTimes::new(&self).map(Arc::new), ..self }
    }

    /// What a compute pass of this name ([`PassTimes::PASSES`]) is told to write.
    pub(crate) fn compute_times(&self, pass: &str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.times.as_ref().and_then(|times| times.of_compute(pass))
    }

    /// What a render pass of this name is told to write.
    pub(crate) fn render_times(&self, pass: &str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.times.as_ref().and_then(|times| times.of_render(pass))
    }

    /// Whether all that was asked for was done so far.
    ///
    /// # Errors
    /// If memory ran out, the device was lost, or it was asked for something that it cannot do.
    pub fn check(&self) -> Result<(), GpuError> {
        match self.fault.get() {
            None => Ok(()),
            Some(reason) => Err(GpuError::Lost { adapter: self.adapter.name.clone(), reason: reason.clone() }),
        }
    }

    /// Whether the adapter is a processor that does a GPU's work. That of tests, which does none, is taken for a graphics card.
    pub fn is_software(&self) -> bool {
        self.adapter.device_type == wgpu::DeviceType::Cpu && self.adapter.backend != wgpu::Backend::Noop
    }
}

/// An error in one line.
fn one_line(error: &dyn std::error::Error) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
