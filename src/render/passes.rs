//! The passes: shader modules, bind-group layouts and pipelines, made once.
use std::num::NonZeroU64;

use wgpu::{
    BindGroupLayout, BindingType, CompareFunction, RenderPipeline, ShaderStages, TextureFormat, TextureSampleType,
    TextureViewDimension,
};

use super::gpu::Gpu;
use super::light::{Dome, Layer};

/// The shaders, each with what it needs put before it: (name, text).
pub(super) const SHADERS: [(&str, &str); 7] = [
    ("shadow", concat!(include_str!("../../shaders/frame.wgsl"), include_str!("../../shaders/shadow.wgsl"))),
    ("geometry", concat!(include_str!("../../shaders/frame.wgsl"), include_str!("../../shaders/geometry.wgsl"))),
    (
        "occlusion",
        concat!(
            include_str!("../../shaders/frame.wgsl"),
            include_str!("../../shaders/key.wgsl"),
            include_str!("../../shaders/occlusion.wgsl")
        ),
    ),
    ("blur", concat!(include_str!("../../shaders/frame.wgsl"), include_str!("../../shaders/blur.wgsl"))),
    (
        "surface",
        concat!(
            include_str!("../../shaders/frame.wgsl"),
            include_str!("../../shaders/key.wgsl"),
            include_str!("../../shaders/surface.wgsl")
        ),
    ),
    ("ink", concat!(include_str!("../../shaders/frame.wgsl"), include_str!("../../shaders/ink.wgsl"))),
    ("develop", concat!(include_str!("../../shaders/frame.wgsl"), include_str!("../../shaders/develop.wgsl"))),
];

/// Linear light.
pub(super) const HDR: TextureFormat = TextureFormat::Rgba16Float;
/// Normal and distance.
pub(super) const GEOMETRY: TextureFormat = TextureFormat::Rgba32Float;
/// Visibility of the sky.
pub(super) const OCCLUSION: TextureFormat = TextureFormat::Rgba16Float;
/// Depth of the camera's passes.
pub(super) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// Depth of shadow layers.
pub(super) const SHADOW: TextureFormat = TextureFormat::Depth16Unorm;
/// The finished picture.
pub(super) const PICTURE: TextureFormat = TextureFormat::Rgba8Unorm;
/// Samples a pixel.
pub(super) const SAMPLES: u32 = 4;

/// The camera and all that hangs on it, as `shaders/frame.wgsl` reads it.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    pub clip_from_world: [[f32; 4]; 4],
    pub view_from_world: [[f32; 4]; 4],
    pub eye: [f32; 4],
    pub screen: [f32; 4],
    pub key: [f32; 4],
    pub fill: [f32; 4],
    pub ground: [f32; 4],
    pub occlusion: [f32; 4],
    pub key_u: [f32; 4],
    pub key_v: [f32; 4],
    pub key_depth: [f32; 4],
    pub layers: [u32; 4],
}

/// A surface's vertex in the world.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct SurfaceVertex {
    pub position: [f32; 3],
    pub normal: [f32; 3],
    /// sRGB colour and roughness.
    pub color: [u8; 4],
    /// Metallic, clear coat, matte.
    pub finish: [u8; 4],
}

/// Everything that doesn't depend on scene or view.
pub(super) struct Passes {
    pub frame_layout: BindGroupLayout,
    pub layer_layout: BindGroupLayout,
    pub occlusion_layout: BindGroupLayout,
    pub blur_layout: BindGroupLayout,
    pub surface_layout: BindGroupLayout,
    pub develop_layout: BindGroupLayout,
    pub compare: wgpu::Sampler,
    pub shadow: RenderPipeline,
    pub geometry: RenderPipeline,
    pub geometry_floor: RenderPipeline,
    pub occlusion: RenderPipeline,
    pub tile_blur: RenderPipeline,
    pub wide_blur: RenderPipeline,
    pub depth: RenderPipeline,
    pub surface: RenderPipeline,
    pub floor: RenderPipeline,
    pub sky: RenderPipeline,
    pub ink: RenderPipeline,
    pub develop: RenderPipeline,
}

const SURFACE_VERTEX: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<SurfaceVertex>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4, 3 => Unorm8x4],
};

const INK_VERTEX: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<super::ribbon::InkVertex>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![
        0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Float32x3, 4 => Float32x3, 5 => Float32x3
    ],
};

/// The blend of ink: what is there times what the ink lets through.
const MULTIPLY: wgpu::BlendState = wgpu::BlendState {
    color: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::Dst,
        dst_factor: wgpu::BlendFactor::Zero,
        operation: wgpu::BlendOperation::Add,
    },
    alpha: wgpu::BlendComponent::REPLACE,
};

fn uniform<T>(dynamic: bool) -> BindingType {
    BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: dynamic,
        min_binding_size: NonZeroU64::new(size_of::<T>() as u64),
    }
}

fn texture(sample_type: TextureSampleType, view_dimension: TextureViewDimension, multisampled: bool) -> BindingType {
    BindingType::Texture { sample_type, view_dimension, multisampled }
}

/// What one pipeline differs in from another.
struct Recipe<'a> {
    shader: usize,
    vertex: &'a str,
    fragment: Option<(&'a str, TextureFormat)>,
    groups: &'a [&'a BindGroupLayout],
    buffer: Option<wgpu::VertexBufferLayout<'static>>,
    /// Format, comparison and whether it is written.
    depth: Option<(TextureFormat, CompareFunction, bool)>,
    samples: u32,
    blend: Option<wgpu::BlendState>,
    strip: bool,
}

impl Passes {
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let modules: Vec<wgpu::ShaderModule> = SHADERS
            .iter()
            .map(|(name, text)| {
                device.create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: Some(name),
                    source: wgpu::ShaderSource::Wgsl((*text).into()),
                })
            })
            .collect();
        let group = |label: &str, entries: &[BindingType]| {
            let entries: Vec<wgpu::BindGroupLayoutEntry> = entries
                .iter()
                .zip(0..)
                .map(|(ty, binding)| wgpu::BindGroupLayoutEntry {
                    binding,
                    visibility: ShaderStages::VERTEX_FRAGMENT,
                    ty: *ty,
                    count: None,
                })
                .collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
        };
        let plain = texture(TextureSampleType::Float { filterable: false }, TextureViewDimension::D2, false);
        let layers = texture(TextureSampleType::Depth, TextureViewDimension::D2Array, false);
        let comparison = BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let samples = texture(TextureSampleType::Float { filterable: false }, TextureViewDimension::D2, true);

        let frame_layout = group("frame", &[uniform::<Frame>(false)]);
        let layer_layout = group("layer", &[uniform::<Layer>(true)]);
        let occlusion_layout = group("occlusion", &[layers, comparison, plain, uniform::<Dome>(false), layers]);
        let blur_layout = group("blur", &[plain, plain]);
        let surface_layout = group("surface", &[layers, comparison, plain, plain]);
        let develop_layout = group("develop", &[samples]);
        let compare = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(CompareFunction::LessEqual),
            ..Default::default()
        });

        let pipeline = |label: &str, r: Recipe| {
            let groups: Vec<Option<&BindGroupLayout>> = r.groups.iter().map(|g| Some(*g)).collect();
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: &groups,
                immediate_size: 0,
            });
            let target = r.fragment.map(|(_, format)| {
                [Some(wgpu::ColorTargetState { format, blend: r.blend, write_mask: wgpu::ColorWrites::ALL })]
            });
            let buffers = if r.buffer.is_some() { std::slice::from_ref(&r.buffer) } else { &[] };
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(label),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &modules[r.shader],
                    entry_point: Some(r.vertex),
                    compilation_options: Default::default(),
                    buffers,
                },
                primitive: wgpu::PrimitiveState {
                    topology: if r.strip {
                        wgpu::PrimitiveTopology::TriangleStrip
                    } else {
                        wgpu::PrimitiveTopology::TriangleList
                    },
                    ..Default::default()
                },
                depth_stencil: r.depth.map(|(format, compare, write)| wgpu::DepthStencilState {
                    format,
                    depth_write_enabled: Some(write),
                    depth_compare: Some(compare),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: wgpu::MultisampleState { count: r.samples, ..Default::default() },
                fragment: r.fragment.zip(target.as_ref()).map(|((entry, _), targets)| wgpu::FragmentState {
                    module: &modules[r.shader],
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    targets,
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let base = |shader, vertex| Recipe {
            shader,
            vertex,
            fragment: None,
            groups: &[],
            buffer: None,
            depth: None,
            samples: 1,
            blend: None,
            strip: false,
        };
        // near is 1 and far is 0, so nearer means greater
        let (nearer, not_farther) = (CompareFunction::Greater, CompareFunction::GreaterEqual);
        let on_frame: &[&BindGroupLayout] = &[&frame_layout];
        let lit: &[&BindGroupLayout] = &[&frame_layout, &surface_layout];
        let shadow = pipeline(
            "shadow",
            Recipe {
                groups: &[&frame_layout, &layer_layout],
                buffer: Some(SURFACE_VERTEX),
                depth: Some((SHADOW, CompareFunction::Less, true)),
                ..base(0, "vertex")
            },
        );
        let geometry = pipeline(
            "geometry",
            Recipe {
                fragment: Some(("fragment", GEOMETRY)),
                groups: on_frame,
                buffer: Some(SURFACE_VERTEX),
                depth: Some((DEPTH, nearer, true)),
                ..base(1, "vertex")
            },
        );
        let geometry_floor = pipeline(
            "floor geometry",
            Recipe {
                fragment: Some(("fragment", GEOMETRY)),
                groups: on_frame,
                depth: Some((DEPTH, nearer, true)),
                strip: true,
                ..base(1, "floor_vertex")
            },
        );
        let occlusion = pipeline(
            "occlusion",
            Recipe {
                fragment: Some(("fragment", OCCLUSION)),
                groups: &[&frame_layout, &occlusion_layout],
                ..base(2, "vertex")
            },
        );
        let tile_blur = pipeline(
            "tile blur",
            Recipe {
                fragment: Some(("tile_fragment", OCCLUSION)),
                groups: &[&frame_layout, &blur_layout],
                ..base(3, "vertex")
            },
        );
        let wide_blur = pipeline(
            "wide blur",
            Recipe {
                fragment: Some(("wide_fragment", OCCLUSION)),
                groups: &[&frame_layout, &blur_layout],
                ..base(3, "vertex")
            },
        );
        let depth = pipeline(
            "depth",
            Recipe {
                groups: on_frame,
                buffer: Some(SURFACE_VERTEX),
                depth: Some((DEPTH, nearer, true)),
                samples: SAMPLES,
                ..base(1, "vertex")
            },
        );
        let surface = pipeline(
            "surface",
            Recipe {
                fragment: Some(("fragment", HDR)),
                groups: lit,
                buffer: Some(SURFACE_VERTEX),
                depth: Some((DEPTH, not_farther, false)),
                samples: SAMPLES,
                ..base(4, "vertex")
            },
        );
        let floor = pipeline(
            "floor",
            Recipe {
                fragment: Some(("floor_fragment", HDR)),
                groups: lit,
                depth: Some((DEPTH, nearer, true)),
                samples: SAMPLES,
                strip: true,
                ..base(4, "floor_vertex")
            },
        );
        let sky = pipeline(
            "sky",
            Recipe {
                fragment: Some(("sky_fragment", HDR)),
                groups: lit,
                depth: Some((DEPTH, not_farther, false)),
                samples: SAMPLES,
                ..base(4, "sky_vertex")
            },
        );
        let ink = pipeline(
            "ink",
            Recipe {
                fragment: Some(("fragment", HDR)),
                groups: on_frame,
                buffer: Some(INK_VERTEX),
                depth: Some((DEPTH, nearer, false)),
                samples: SAMPLES,
                blend: Some(MULTIPLY),
                ..base(5, "vertex")
            },
        );
        let develop = pipeline(
            "develop",
            Recipe {
                fragment: Some(("fragment", PICTURE)),
                groups: &[&frame_layout, &develop_layout],
                ..base(6, "vertex")
            },
        );
        Passes {
            frame_layout,
            layer_layout,
            occlusion_layout,
            blur_layout,
            surface_layout,
            develop_layout,
            compare,
            shadow,
            geometry,
            geometry_floor,
            occlusion,
            tile_blur,
            wide_blur,
            depth,
            surface,
            floor,
            sky,
            ink,
            develop,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    #[test]
    fn shaders_are_valid() {
        for (name, text) in SHADERS {
            let module =
                naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
            Validator::new(ValidationFlags::all(), Capabilities::empty())
                .validate(&module)
                .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        }
    }
}
