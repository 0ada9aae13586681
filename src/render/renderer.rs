//! A scene and a view to a picture.
use nalgebra::{Matrix4, Point3, Vector3};
use wgpu::{BindGroupLayout, BindingResource, BufferUsages, TextureView};

use super::gpu::{BUFFER_LIMIT, Gpu};
use super::light::{self, DOME_LAYERS, DOME_SIZE, KEY_LAYERS, KEY_SIZE, Layer, Lighting};
use super::passes::{DEPTH, Frame, GEOMETRY, HDR, OCCLUSION, PICTURE, Passes, SAMPLES, SHADOW, SurfaceVertex};
use super::view::NEAR;
use super::{Item, Pixels, RenderError, RenderScene, View};

/// How far apart layers lie in their uniform buffer, bytes: the largest alignment that adapters ask for.
const LAYER_STRIDE: usize = 256;
/// Reach of the near occlusion as a share of the scene's diagonal, and its bounds, m.
const NEAR_REACH: f64 = 0.08;
const NEAR_REACH_BOUNDS: (f64, f64) = (0.02, 0.25);

/// Renders scenes offscreen. Making one compiles the shaders, so keep it for many pictures.
pub struct Renderer {
    gpu: Gpu,
    passes: Passes,
}

/// Vertices and indices that fit in one buffer.
struct Chunk {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
}

/// A scene on the device, with its shadows: what all views of it share.
pub struct PreparedScene {
    surfaces: Vec<Chunk>,
    ink: Vec<Chunk>,
    lights: wgpu::Buffer,
    key_map: TextureView,
    dome_map: TextureView,
    lighting: Lighting,
    bounds: (Point3<f64>, Point3<f64>),
    floor: Option<f64>,
}

impl Renderer {
    /// Finds an adapter and makes everything that scenes and views share.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`] where there is none: pictures of the flat drawing can still be made.
    pub fn new() -> Result<Self, RenderError> {
        let gpu = Gpu::new()?;
        let passes = Passes::new(&gpu);
        gpu.check()?;
        Ok(Renderer { gpu, passes })
    }

    /// Name of the adapter, its interface and driver.
    pub fn adapter(&self) -> &str {
        &self.gpu.name
    }

    /// One picture of a scene. For several views of it, [`Renderer::prepare`] once and [`Renderer::render_prepared`].
    pub fn render(&self, scene: &RenderScene, view: &View) -> Result<Pixels, RenderError> {
        self.render_prepared(&self.prepare(scene)?, view)
    }

    /// Uploads a scene and casts its shadows.
    pub fn prepare(&self, scene: &RenderScene) -> Result<PreparedScene, RenderError> {
        let (vertices, triangles) = bake(&scene.items);
        let casters: Vec<Point3<f32>> = vertices.iter().map(|v| Point3::from(v.position)).collect();
        let lighting = Lighting::around(&casters);
        let bounds = casters.iter().fold((Point3::from([f64::MAX; 3]), Point3::from([f64::MIN; 3])), |(lo, hi), p| {
            (lo.inf(&p.cast()), hi.sup(&p.cast()))
        });
        let bounds = if casters.is_empty() { (Point3::origin(), Point3::origin()) } else { bounds };
        let map = |label, size: u32, layers: usize| self.gpu.target(label, [size, size], layers as u32, 1, SHADOW);
        let (key, dome) = (map("key", KEY_SIZE, KEY_LAYERS), map("dome", DOME_SIZE, DOME_LAYERS));
        let array =
            wgpu::TextureViewDescriptor { dimension: Some(wgpu::TextureViewDimension::D2Array), ..Default::default() };
        let prepared = PreparedScene {
            surfaces: self.chunks(&vertices, &triangles),
            ink: self.chunks(&scene.ink.vertices, &scene.ink.triangles),
            lights: self.gpu.buffer("lights", &[lighting.lights], BufferUsages::UNIFORM),
            key_map: key.create_view(&array),
            dome_map: dome.create_view(&array),
            lighting,
            bounds,
            floor: scene.floor,
        };
        self.cast_shadows(&prepared, &key, &dome);
        self.gpu.check()?;
        Ok(prepared)
    }

    fn cast_shadows(&self, scene: &PreparedScene, key: &wgpu::Texture, dome: &wgpu::Texture) {
        let layers = scene.lighting.lights.key.iter().chain(&scene.lighting.lights.dome);
        let mut rows = vec![0u8; LAYER_STRIDE * (KEY_LAYERS + DOME_LAYERS)];
        for (slot, layer) in rows.chunks_exact_mut(LAYER_STRIDE).zip(layers) {
            slot[..size_of::<Layer>()].copy_from_slice(bytemuck::bytes_of(layer));
        }
        let rows = self.gpu.buffer("layers", &rows, BufferUsages::UNIFORM);
        let whole = wgpu::BufferBinding {
            buffer: &rows,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<Layer>() as u64),
        };
        let group = self.group(&self.passes.layer_layout, &[BindingResource::Buffer(whole)]);
        // the shadow stage shares the prelude of the others but reads nothing of the camera
        let frame = self.gpu.buffer("no frame", &[<Frame as bytemuck::Zeroable>::zeroed()], BufferUsages::UNIFORM);
        let frame = self.group(&self.passes.frame_layout, &[frame.as_entire_binding()]);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let of_key = (0..KEY_LAYERS).map(|i| (key, i, i));
        let of_dome = (0..DOME_LAYERS).map(|i| (dome, i, KEY_LAYERS + i));
        for (texture, index, slot) in of_key.chain(of_dome) {
            let view = texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: index as u32,
                array_layer_count: Some(1),
                ..Default::default()
            });
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow"),
                depth_stencil_attachment: Some(depth_attachment(&view, wgpu::LoadOp::Clear(1.0))),
                ..Default::default()
            });
            pass.set_pipeline(&self.passes.shadow);
            pass.set_bind_group(0, &frame, &[]);
            pass.set_bind_group(1, &group, &[(slot * LAYER_STRIDE) as u32]);
            draw(&mut pass, &scene.surfaces);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// One view of a prepared scene. The same scene and view give the same bytes on the same adapter.
    pub fn render_prepared(&self, scene: &PreparedScene, view: &View) -> Result<Pixels, RenderError> {
        let max = self.gpu.device.limits().max_texture_dimension_2d;
        let size = [view.width_px, view.height_px];
        if size.iter().any(|s| !(1..=max).contains(s)) {
            return Err(RenderError::Size { width: size[0], height: size[1], max });
        }
        let frame = self.gpu.buffer("frame", &[frame(scene, view)?], BufferUsages::UNIFORM);
        let p = &self.passes;
        let half = size.map(|s| s.div_ceil(2));
        let texture = |label, size, samples, format| self.gpu.target(label, size, 1, samples, format);
        let seen = |t: &wgpu::Texture| t.create_view(&Default::default());
        let geometry = seen(&texture("geometry", half, 1, GEOMETRY));
        let geometry_depth = seen(&texture("geometry depth", half, 1, DEPTH));
        let noisy = seen(&texture("noisy occlusion", half, 1, OCCLUSION));
        let occlusion = seen(&texture("occlusion", half, 1, OCCLUSION));
        let light = seen(&texture("light", size, SAMPLES, HDR));
        let depth = seen(&texture("depth", size, SAMPLES, DEPTH));
        let picture = texture("picture", size, 1, PICTURE);

        let view_of = |v| BindingResource::TextureView(v);
        let compare = || BindingResource::Sampler(&p.compare);
        let lights = || scene.lights.as_entire_binding();
        let on_frame = self.group(&p.frame_layout, &[frame.as_entire_binding()]);
        let occlusion_group =
            self.group(&p.occlusion_layout, &[view_of(&geometry), lights(), view_of(&scene.dome_map), compare()]);
        let blur_group = self.group(&p.blur_layout, &[view_of(&geometry), view_of(&noisy)]);
        let surface_group = self.group(
            &p.surface_layout,
            &[lights(), view_of(&scene.key_map), compare(), view_of(&geometry), view_of(&occlusion)],
        );
        let develop_group = self.group(&p.develop_layout, &[view_of(&light)]);

        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = begin(&mut encoder, "geometry", Some(&geometry), Some(&geometry_depth));
            pass.set_bind_group(0, &on_frame, &[]);
            pass.set_pipeline(&p.geometry);
            draw(&mut pass, &scene.surfaces);
            if scene.floor.is_some() {
                pass.set_pipeline(&p.geometry_floor);
                pass.draw(0..4, 0..1);
            }
        }
        let screens = [(&p.occlusion, &occlusion_group, &noisy), (&p.blur, &blur_group, &occlusion)];
        for (pipeline, group, target) in screens {
            let mut pass = begin(&mut encoder, "occlusion", Some(target), None);
            screen(&mut pass, pipeline, &on_frame, group);
        }
        {
            let mut pass = begin(&mut encoder, "depth", None, Some(&depth));
            pass.set_bind_group(0, &on_frame, &[]);
            pass.set_pipeline(&p.depth);
            draw(&mut pass, &scene.surfaces);
        }
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("light"),
                color_attachments: &[Some(color_attachment(&light))],
                depth_stencil_attachment: Some(depth_attachment(&depth, wgpu::LoadOp::Load)),
                ..Default::default()
            });
            pass.set_bind_group(0, &on_frame, &[]);
            pass.set_bind_group(1, &surface_group, &[]);
            pass.set_pipeline(&p.surface);
            draw(&mut pass, &scene.surfaces);
            if scene.floor.is_some() {
                pass.set_pipeline(&p.floor);
                pass.draw(0..4, 0..1);
            }
            pass.set_pipeline(&p.sky);
            pass.draw(0..3, 0..1);
            pass.set_pipeline(&p.ink);
            draw(&mut pass, &scene.ink);
        }
        {
            let target = seen(&picture);
            let mut pass = begin(&mut encoder, "develop", Some(&target), None);
            screen(&mut pass, &p.develop, &on_frame, &develop_group);
        }
        self.gpu.read(encoder, &picture)
    }

    fn group(&self, layout: &BindGroupLayout, resources: &[BindingResource]) -> wgpu::BindGroup {
        let entries: Vec<wgpu::BindGroupEntry> = resources
            .iter()
            .zip(0..)
            .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    /// Vertices and triangles as buffers that no adapter refuses.
    fn chunks<V: bytemuck::Pod>(&self, vertices: &[V], triangles: &[[u32; 3]]) -> Vec<Chunk> {
        split(vertices, triangles, BUFFER_LIMIT)
            .iter()
            .map(|(vertices, triangles)| Chunk {
                vertices: self.gpu.buffer("vertices", vertices, BufferUsages::VERTEX),
                indices: self.gpu.buffer("indices", triangles, BufferUsages::INDEX),
                count: triangles.len() as u32 * 3,
            })
            .collect()
    }
}

/// Splits a mesh into ones whose vertex and index arrays are each at most `limit` bytes.
fn split<V: Copy>(vertices: &[V], triangles: &[[u32; 3]], limit: usize) -> Vec<(Vec<V>, Vec<[u32; 3]>)> {
    let most_vertices = limit / size_of::<V>() - 3;
    let most_triangles = limit / size_of::<[u32; 3]>();
    let mut chunks: Vec<(Vec<V>, Vec<[u32; 3]>)> = Vec::new();
    // where each vertex is in the last chunk; the chunk's number tells stale entries
    let mut place = vec![(0usize, 0u32); vertices.len()];
    for triangle in triangles {
        if chunks.last().is_none_or(|(v, t)| v.len() > most_vertices || t.len() >= most_triangles) {
            chunks.push((Vec::new(), Vec::new()));
        }
        let number = chunks.len();
        let Some((v, t)) = chunks.last_mut() else { continue };
        t.push(triangle.map(|i| {
            let known = &mut place[i as usize];
            if known.0 != number {
                *known = (number, v.len() as u32);
                v.push(vertices[i as usize]);
            }
            known.1
        }));
    }
    chunks
}

/// All items' triangles in the world.
fn bake(items: &[Item]) -> (Vec<SurfaceVertex>, Vec<[u32; 3]>) {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for item in items {
        let first = vertices.len() as u32;
        let m = &item.material;
        let share = |x: f64| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        let [r, g, b] = m.color.0;
        let color = [r, g, b, share(m.roughness)];
        let finish = [share(m.metallic), share(m.clearcoat), share(m.matte), 0];
        let count = item.surface.positions.len().min(item.surface.normals.len());
        for (p, n) in item.surface.positions.iter().zip(&item.surface.normals) {
            let p = item.world_from_item * p;
            let n = item.world_from_item.rotation * n;
            vertices.push(SurfaceVertex {
                position: p.coords.cast::<f32>().into(),
                normal: n.cast::<f32>().into(),
                color,
                finish,
            });
        }
        let inside = |t: &&[u32; 3]| t.iter().all(|i| (*i as usize) < count);
        triangles.extend(item.surface.triangles.iter().filter(inside).map(|t| t.map(|i| first + i)));
    }
    (vertices, triangles)
}

fn frame(scene: &PreparedScene, view: &View) -> Result<Frame, RenderError> {
    let view_from_world = view.view_from_world()?;
    let clip_from_world = view.clip_from_view() * view_from_world;
    let f = |m: &Matrix4<f64>| -> [[f32; 4]; 4] { m.cast::<f32>().into() };
    let with = |v: Vector3<f64>, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
    let (lo, hi) = scene.bounds;
    let (middle, diagonal) = (nalgebra::center(&lo, &hi), (hi - lo).norm());
    let (w, h) = (f64::from(view.width_px), f64::from(view.height_px));
    // a hair lower than what stands on it, so that undersides don't flicker through
    let floor = scene.floor.unwrap_or(lo.z) - 0.0005;
    let reach = (NEAR_REACH * diagonal).clamp(NEAR_REACH_BOUNDS.0, NEAR_REACH_BOUNDS.1);
    Ok(Frame {
        clip_from_world: f(&clip_from_world),
        view_from_world: f(&view_from_world),
        eye: with(view.eye.coords, view.tan_half()),
        screen: [w as f32, h as f32, (w / h) as f32, NEAR as f32],
        key: with(light::key_direction(), scene.lighting.key_texel),
        fill: with(light::fill_direction(), scene.lighting.dome_texel),
        ground: [middle.x as f32, middle.y as f32, floor as f32, (8.0 * diagonal).max(4.0) as f32],
        occlusion: [reach as f32, 0.0, 0.0, 0.0],
    })
}

fn color_attachment(view: &TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
    }
}

fn depth_attachment(view: &TextureView, load: wgpu::LoadOp<f32>) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

/// Begins a pass on cleared targets; depth is cleared to far.
fn begin<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &str,
    color: Option<&TextureView>,
    depth: Option<&TextureView>,
) -> wgpu::RenderPass<'e> {
    let colors: Vec<_> = color.into_iter().map(|v| Some(color_attachment(v))).collect();
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &colors,
        depth_stencil_attachment: depth.map(|v| depth_attachment(v, wgpu::LoadOp::Clear(0.0))),
        ..Default::default()
    })
}

fn draw(pass: &mut wgpu::RenderPass, chunks: &[Chunk]) {
    for chunk in chunks {
        pass.set_vertex_buffer(0, chunk.vertices.slice(..));
        pass.set_index_buffer(chunk.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..chunk.count, 0, 0..1);
    }
}

fn screen(
    pass: &mut wgpu::RenderPass,
    pipeline: &wgpu::RenderPipeline,
    frame: &wgpu::BindGroup,
    group: &wgpu::BindGroup,
) {
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, frame, &[]);
    pass.set_bind_group(1, group, &[]);
    pass.draw(0..3, 0..1);
}
