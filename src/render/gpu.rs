//! The graphics device: found without a window, fed with buffers, read back by rows.
use std::sync::{Arc, Mutex, mpsc};

use super::passes::{DEPTH, GEOMETRY, HDR, OCCLUSION, PICTURE};
use super::{Pixels, RenderError};

/// Largest buffer that every adapter takes, bytes.
pub(super) const BUFFER_LIMIT: usize = 128 << 20;

/// A device, its queue, and the first thing that went wrong on it.
pub(super) struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// Name of the adapter and its driver.
    pub name: String,
    failure: Arc<Mutex<Option<String>>>,
}

/// What is rendered into. A driver that can't, as an old GL one without float targets, is as good as none.
const TARGETS: [wgpu::TextureFormat; 5] = [HDR, GEOMETRY, OCCLUSION, DEPTH, PICTURE];

/// The best adapter of some interfaces, if it can render what the passes need.
fn adapter_of(backends: wgpu::Backends) -> Option<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        // the driver's own debugging layers are for those who debug drivers
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let options =
        wgpu::RequestAdapterOptions { power_preference: wgpu::PowerPreference::HighPerformance, ..Default::default() };
    let adapter = pollster::block_on(instance.request_adapter(&options)).ok()?;
    let renders = |format| {
        let usages = adapter.get_texture_format_features(format).allowed_usages;
        usages.contains(wgpu::TextureUsages::RENDER_ATTACHMENT)
    };
    TARGETS.into_iter().all(renders).then_some(adapter)
}

impl Gpu {
    /// The best adapter there is; a software driver when there is no other.
    pub fn new() -> Result<Self, RenderError> {
        // Vulkan first: merely asking GL for its adapters makes Mesa complain where there is no display
        let adapter = [wgpu::Backends::VULKAN, wgpu::Backends::GL]
            .into_iter()
            .find_map(adapter_of)
            .ok_or(RenderError::NoAdapter)?;
        let info = adapter.get_info();
        let limits = wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits());
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("calamus"),
            required_limits: limits,
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| RenderError::Device(e.to_string()))?;
        let failure = Arc::new(Mutex::new(None));
        let seen = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            if let Ok(mut first) = seen.lock() {
                first.get_or_insert_with(|| e.to_string());
            }
        }));
        let name = format!("{} ({} {})", info.name, info.backend, info.driver_info);
        Ok(Gpu { device, queue, name, failure })
    }

    /// The first failure since the last call, if there was one.
    pub fn check(&self) -> Result<(), RenderError> {
        match self.failure.lock().ok().and_then(|mut f| f.take()) {
            Some(message) => Err(RenderError::Device(message)),
            None => Ok(()),
        }
    }

    /// A buffer with these contents.
    pub fn buffer<T: bytemuck::Pod>(&self, label: &str, data: &[T], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.len().max(4).next_multiple_of(4) as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    /// A texture to render into and to read in later passes.
    pub fn target(
        &self,
        label: &str,
        size: [u32; 2],
        layers: u32,
        samples: u32,
        format: wgpu::TextureFormat,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: layers },
            mip_level_count: 1,
            sample_count: samples,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | if format == wgpu::TextureFormat::Rgba8Unorm {
                    wgpu::TextureUsages::COPY_SRC
                } else {
                    wgpu::TextureUsages::empty()
                },
            view_formats: &[],
        })
    }

    /// Submits the commands after adding the copy of an RGBA8 texture, waits, and drops padding and alpha.
    pub fn read(&self, mut encoder: wgpu::CommandEncoder, texture: &wgpu::Texture) -> Result<Pixels, RenderError> {
        let (width, height) = (texture.width(), texture.height());
        let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        let (send, receive) = mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // the receiver is gone only when the wait below has failed already
            let _ = send.send(result);
        });
        let failed = |e: &dyn std::fmt::Display| RenderError::Device(e.to_string());
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(&e))?;
        self.check()?;
        receive.recv().map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
        let mapped = buffer.get_mapped_range(..).map_err(|e| failed(&e))?;
        let rows = mapped.chunks_exact(row as usize).map(|r| &r[..width as usize * 4]);
        let rgb = rows.flat_map(|r| r.chunks_exact(4)).flat_map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Pixels { width, height, rgb })
    }
}
