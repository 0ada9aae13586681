//! A scene and a view to a picture.
use nalgebra::{Matrix4, Point3, Vector3};
use wgpu::{BindGroupLayout, BindingResource, BufferUsages, TextureView};

use super::gpu::{BUFFER_LIMIT, Gpu};
use super::light::{DOME_LAYERS, DOME_SIZE, KEY_LAYERS, KEY_SIZE, Layer, Lighting, Studio};
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
    dome: wgpu::Buffer,
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
        let lighting = Lighting::around(&casters, Studio::facing(&scene.facing));
        let bounds = casters.iter().fold((Point3::from([f64::MAX; 3]), Point3::from([f64::MIN; 3])), |(lo, hi), p| {
            (lo.inf(&p.cast()), hi.sup(&p.cast()))
        });
        let bounds = if casters.is_empty() { (Point3::origin(), Point3::origin()) } else { bounds };
        let map = |label, size: u32, layers: usize| self.gpu.target(label, [size, size], layers as u32, 1, SHADOW);
        let (key, sky) = (map("key", KEY_SIZE, KEY_LAYERS), map("dome", DOME_SIZE, DOME_LAYERS));
        let array =
            wgpu::TextureViewDescriptor { dimension: Some(wgpu::TextureViewDimension::D2Array), ..Default::default() };
        let prepared = PreparedScene {
            surfaces: self.chunks(&vertices, &triangles),
            ink: self.chunks(&scene.ink.vertices, &scene.ink.triangles),
            dome: self.gpu.buffer("dome", &lighting.dome, BufferUsages::UNIFORM),
            key_map: key.create_view(&array),
            dome_map: sky.create_view(&array),
            lighting,
            bounds,
            floor: scene.floor,
        };
        self.cast_shadows(&prepared, &key, &sky);
        self.gpu.check()?;
        Ok(prepared)
    }

    fn cast_shadows(&self, scene: &PreparedScene, key: &wgpu::Texture, dome: &wgpu::Texture) {
        let layers = scene.lighting.key.iter().chain(&scene.lighting.dome);
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
        let coarse = seen(&texture("coarse occlusion", half, 1, OCCLUSION));
        let occlusion = seen(&texture("occlusion", half, 1, OCCLUSION));
        let light = seen(&texture("light", size, SAMPLES, HDR));
        let depth = seen(&texture("depth", size, SAMPLES, DEPTH));
        let picture = texture("picture", size, 1, PICTURE);

        let view_of = |v| BindingResource::TextureView(v);
        let compare = || BindingResource::Sampler(&p.compare);
        let on_frame = self.group(&p.frame_layout, &[frame.as_entire_binding()]);
        let occlusion_group = self.group(
            &p.occlusion_layout,
            &[
                view_of(&scene.key_map),
                compare(),
                view_of(&geometry),
                scene.dome.as_entire_binding(),
                view_of(&scene.dome_map),
            ],
        );
        let tile_group = self.group(&p.blur_layout, &[view_of(&geometry), view_of(&noisy)]);
        let wide_group = self.group(&p.blur_layout, &[view_of(&geometry), view_of(&coarse)]);
        let surface_group = self
            .group(&p.surface_layout, &[view_of(&scene.key_map), compare(), view_of(&geometry), view_of(&occlusion)]);
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
        let screens = [
            (&p.occlusion, &occlusion_group, &noisy),
            (&p.tile_blur, &tile_group, &coarse),
            (&p.wide_blur, &wide_group, &occlusion),
        ];
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
    let shear = scene.lighting.key_shear;
    Ok(Frame {
        clip_from_world: f(&clip_from_world),
        view_from_world: f(&view_from_world),
        eye: with(view.eye.coords, view.tan_half()),
        screen: [w as f32, h as f32, (w / h) as f32, NEAR as f32],
        key: with(scene.lighting.studio.key, scene.lighting.key_texel),
        fill: with(scene.lighting.studio.fill, scene.lighting.dome_texel),
        ground: [middle.x as f32, middle.y as f32, floor as f32, (8.0 * diagonal).max(4.0) as f32],
        occlusion: [reach, scene.lighting.penumbra, shear[0], shear[1]].map(|c| c as f32),
        key_u: scene.lighting.key_middle.u,
        key_v: scene.lighting.key_middle.v,
        key_depth: scene.lighting.key_middle.depth,
        layers: [KEY_LAYERS as u32, 0, 0, 0],
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ink::InkPoint;
    use crate::math::{Pose, Rgb};
    use crate::render::{Material, Ribbons, Surface};
    use nalgebra::Point2;
    use std::io::Write;
    use std::sync::Arc;

    /// A renderer, or `None` with a note on a machine without any driver; there such a test fails where one has to be, as `CI` or
    /// `CALAMUS_REQUIRE_GPU` say.
    fn renderer() -> Option<Renderer> {
        let required = ["CI", "CALAMUS_REQUIRE_GPU"].iter().any(|v| std::env::var_os(v).is_some());
        match Renderer::new() {
            Ok(r) => Some(r),
            Err(RenderError::NoAdapter) if !required => {
                let test = std::thread::current().name().unwrap_or("a test").to_string();
                // straight to the terminal: what a passing test prints is not shown
                writeln!(std::io::stderr(), "skipped {test}: {}", RenderError::NoAdapter).unwrap();
                None
            }
            Err(e) => panic!("{e}"),
        }
    }

    fn line(from: [f64; 2], to: [f64; 2], width: f64) -> Vec<InkPoint> {
        let at = |i: u32| {
            let s = f64::from(i) / 200.0;
            let p = Point2::new(from[0] + (to[0] - from[0]) * s, from[1] + (to[1] - from[1]) * s);
            InkPoint {
                position: Point3::new(p.x, p.y, 0.101),
                normal: Vector3::z(),
                sheet: p,
                width,
                density: 1.0,
                time: s,
            }
        };
        (0..=200).map(at).collect()
    }

    /// A white slab with a line on it, and a ball beside it on the floor.
    fn scene() -> RenderScene {
        let item = |surface, x: f64, y: f64, z: f64, material| Item {
            surface: Arc::new(surface),
            world_from_item: Pose::translation(x, y, z),
            material,
        };
        let mut ink = Ribbons::default();
        ink.add(&line([-0.15, 0.0], [0.15, 0.0], 0.01), Rgb([20, 20, 30]));
        ink.add(&line([-0.15, 0.08], [0.15, 0.08], 0.0008), Rgb([20, 20, 30]));
        ink.add(&line([-0.1, -0.05], [-0.1, 0.05], 0.01), Rgb([20, 20, 30]));
        RenderScene {
            items: vec![
                item(
                    Surface::cuboid(Vector3::new(0.4, 0.4, 0.001)),
                    0.0,
                    0.0,
                    0.1005,
                    Material::paper(Rgb([245, 245, 240])),
                ),
                item(Surface::sphere(0.1), 0.0, -0.5, 0.1, Material::painted(Rgb([230, 120, 30]))),
            ],
            ink,
            floor: Some(0.0),
            facing: Vector3::x(),
        }
    }

    fn above(width_px: u32, height_px: u32) -> View {
        View {
            eye: Point3::new(0.4, -0.3, 2.2),
            target: Point3::new(0.0, -0.2, 0.0),
            up: Vector3::y(),
            fov_deg: 40.0,
            width_px,
            height_px,
        }
    }

    /// Mean of the three channels where a world point lands.
    fn brightness(picture: &Pixels, view: &View, p: [f64; 3]) -> f64 {
        let [x, y] = view.pixel_of(&Point3::from(p)).expect("before the camera");
        let at = (y as usize * picture.width as usize + x as usize) * 3;
        picture.rgb[at..at + 3].iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0
    }

    #[test]
    fn a_picture_shows_shadow_ink_and_background_and_is_the_same_twice() {
        let Some(renderer) = renderer() else { return };
        let scene = scene();
        // a width whose rows need padding to be read back
        let view = above(403, 300);
        let picture = renderer.render(&scene, &view).unwrap();
        assert_eq!(picture.rgb.len(), 403 * 300 * 3);
        assert_eq!(picture, renderer.render(&scene, &view).unwrap());

        let at = |p| brightness(&picture, &view, p);
        let light = Studio::facing(&scene.facing).key;
        let shaded = Vector3::new(0.0, -0.5, 0.1) - light * (0.1 / light.z);
        let (shadow, floor) = (at([shaded.x, shaded.y, 0.0]), at([0.45, 0.3, 0.0]));
        assert!(shadow < floor - 25.0, "shadow {shadow}, floor {floor}");
        // the slab floats above the floor and shades it too, but its own top is lit
        let (paper, ink) = (at([0.05, 0.14, 0.101]), at([0.05, 0.0, 0.101]));
        assert!(paper > 215.0 && ink < 0.35 * paper, "paper {paper}, ink {ink}");
        let crossing = at([-0.1, 0.0, 0.101]);
        assert!(crossing <= ink, "crossing {crossing}, ink {ink}");
        // the thin line is a seventh of a pixel wide here: it is seen, but faintly
        let thin = (-12..=12).map(|k| at([0.05, 0.08 + f64::from(k) * 0.0005, 0.101])).fold(f64::MAX, f64::min);
        assert!(thin < paper - 4.0 && thin > paper - 90.0, "thin {thin}, paper {paper}");
        let corner = picture.rgb[..3].iter().all(|c| (205..=245).contains(c));
        assert!(corner, "background {:?}", &picture.rgb[..3]);
    }

    #[test]
    fn an_empty_scene_is_plain_background() {
        let Some(renderer) = renderer() else { return };
        let picture = renderer.render(&RenderScene::default(), &above(64, 48)).unwrap();
        let (lo, hi) = picture.rgb.iter().fold((255, 0), |(lo, hi), c| (lo.min(*c), hi.max(*c)));
        assert!(lo > 200 && hi < 250, "{lo} {hi}");
    }

    #[test]
    fn impossible_sizes_are_refused() {
        let Some(renderer) = renderer() else { return };
        for size in [[0, 10], [10, 1_000_000]] {
            let refused = renderer.render(&RenderScene::default(), &above(size[0], size[1]));
            assert!(matches!(refused, Err(RenderError::Size { .. })), "{refused:?}");
        }
    }

    #[test]
    fn splitting_keeps_every_triangle() {
        let vertices: Vec<u32> = (0..1000).collect();
        let triangles: Vec<[u32; 3]> = (0..998).map(|i| [i, i + 1, i + 2]).collect();
        let chunks = split(&vertices, &triangles, 400);
        assert!(chunks.len() > 10);
        assert!(chunks.iter().all(|(v, t)| v.len() * 4 <= 400 && t.len() * 12 <= 400));
        let back: Vec<[u32; 3]> = chunks.iter().flat_map(|(v, t)| t.iter().map(|t| t.map(|i| v[i as usize]))).collect();
        assert_eq!(back, triangles);
    }

    #[test]
    fn without_an_adapter_the_message_names_the_package() {
        let message = RenderError::NoAdapter.to_string();
        assert!(message.contains("mesa-vulkan-drivers") && !message.contains('\n'));
    }
}
