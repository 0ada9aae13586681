//! The pictures of a run: the flat drawing, and views of the scene where a graphics adapter is to be had.
use std::time::Instant;

use nalgebra::{Point3, Vector3};

use super::RunError;
use super::products::Written;
use super::setup::Setup;
use crate::drawing::Drawing;
use crate::ink::{RasterOptions, rasterise};
use crate::measure::RenderMetrics;
use crate::picture::Image;
use crate::progress::Progress;
use crate::render::{ArmVisuals, Framing, Item, Material, RenderError, RenderScene, Renderer, Ribbons, View};
use crate::report::OutputDir;
use crate::robot::{ArmModel, JointVector};
use crate::scenario::{Camera, RenderSettings};
use crate::twin::Record;

/// What a scene has besides what a run begins with.
#[derive(Default)]
pub(super) struct Extra {
    /// The drawing arms as they end, where they aren't as they began.
    pub models: Vec<ArmModel>,
    /// More to see.
    pub items: Vec<Item>,
}

/// Writes `drawing.png` and `view-NAME.png`s; without an adapter the views are absent and the figures say why.
pub(super) fn pictures(
    settings: &RenderSettings,
    setup: &Setup,
    extra: &Extra,
    record: &Record,
    out: &OutputDir,
    written: &mut Written,
    progress: &dyn Progress,
) -> Result<RenderMetrics, RunError> {
    let started = Instant::now();
    let names: Vec<&str> =
        settings.views.iter().map(String::as_str).chain(settings.cameras.iter().map(|c| c.name.as_str())).collect();
    progress.stage("pictures", Some(1 + names.len() as u64));
    let d = &setup.drawing;
    let [width, height] = page(d);
    let options = RasterOptions::with_long_side(width, height, settings.drawing_px);
    let flat = rasterise(&record.ink, &options)?;
    let flat = flat.to_png(Some(options.px_per_mm))?;
    written.picture(out.write("drawing.png", &flat)?, "The drawing, flat, as the pen left it");
    progress.advance(1);
    let mut metrics = RenderMetrics { px_per_mm: Some(options.px_per_mm), ..Default::default() };
    if !names.is_empty() {
        match Renderer::new() {
            Ok(renderer) => {
                metrics.adapter = Some(renderer.adapter().to_string());
                let (scene, framing) = stage(setup, extra, record);
                let scene = renderer.prepare(&scene)?;
                for (i, name) in names.iter().enumerate() {
                    let view = match settings.cameras.iter().find(|c| c.name == *name) {
                        Some(camera) => own_view(camera, settings.view_px),
                        None => framing.view(name, settings.view_px)?,
                    };
                    let pixels = renderer.render_prepared(&scene, &view)?;
                    let png = Image::new(pixels.width, pixels.height, pixels.rgb)?.to_png(None)?;
                    written.picture(out.write(&format!("view-{name}.png"), &png)?, &format!("View: {name}"));
                    metrics.views.push((*name).to_string());
                    progress.advance(2 + i as u64);
                }
            }
            Err(RenderError::NoAdapter) => {
                let why = RenderError::NoAdapter.to_string();
                progress.note(&why);
                metrics.views_absent = Some(why);
            }
            Err(other) => return Err(other.into()),
        }
    }
    metrics.duration_s = Some(started.elapsed().as_secs_f64());
    Ok(metrics)
}

/// Width and height (m) of the page that is shown: the sheet and a border, so that lines on its edge are whole.
pub(super) fn page(drawing: &Drawing) -> [f64; 2] {
    let border = 0.03 * drawing.width.max(drawing.height);
    [drawing.width + 2.0 * border, drawing.height + 2.0 * border]
}

fn own_view(camera: &Camera, [width_px, height_px]: [u32; 2]) -> View {
    let point = |mm: [f64; 3]| Point3::from(mm.map(|x| x * 1e-3));
    View {
        eye: point(camera.eye_mm),
        target: point(camera.target_mm),
        up: Vector3::z(),
        fov_deg: camera.fov_deg,
        width_px,
        height_px,
    }
}

/// Pictures of instants: each with its name, its caption, what is to be seen besides canvas and furniture, and from where.
pub(super) fn stages<'a>(
    setup: &Setup,
    views: impl Iterator<Item = (&'a str, &'a str, &'a Vec<Item>, &'a View)>,
    out: &OutputDir,
    written: &mut Written,
) -> Result<(), RunError> {
    let renderer = match Renderer::new() {
        Ok(renderer) => renderer,
        // the views of the scene say that there is no adapter
        Err(RenderError::NoAdapter) => return Ok(()),
        Err(other) => return Err(other.into()),
    };
    for (name, caption, items, view) in views {
        let mut scene = RenderScene { items: items.clone(), floor: Some(0.0), ..RenderScene::default() };
        scene.items.extend(setup.cell.furniture.iter().map(Item::from_visual));
        scene.items.push(Item::from_mesh(setup.truth.canvas().mesh(), Material::paper(setup.scene.color)));
        for f in &setup.scene.furniture {
            scene.items.push(Item::from_mesh(&f.mesh, Material::furniture(f.color)));
        }
        let back = view.eye - view.target;
        scene.facing = Vector3::new(back.x, back.y, 0.0);
        let pixels = renderer.render_prepared(&renderer.prepare(&scene)?, view)?;
        let png = Image::new(pixels.width, pixels.height, pixels.rgb)?.to_png(None)?;
        written.picture(out.write(&format!("{name}.png"), &png)?, caption);
    }
    Ok(())
}

/// The scene at the end of the run, and what cameras have to frame.
fn stage(setup: &Setup, extra: &Extra, record: &Record) -> (RenderScene, Framing) {
    let scene = &setup.scene;
    let mut scenery = RenderScene::default();
    let mut landmarks = Vec::new();
    for (i, (arm, done)) in setup.cell.arms.iter().zip(&record.arms).enumerate() {
        let stood = match (&arm.base, &done.final_base) {
            (Some(base), Some(pose)) => {
                Some(ArmModel { world_from_base: pose * base.base_from_arm, ..arm.model.clone() })
            }
            _ => None,
        };
        if let (Some(base), Some(pose)) = (&arm.base, &done.final_base) {
            // so is the base that it stands on
            landmarks.extend(base.wheels.iter().map(|w| pose * Point3::new(1.3 * w.hub.x, 1.3 * w.hub.y, 0.0)));
        }
        let arm = stood.as_ref().unwrap_or(&arm.model);
        let model = extra.models.get(i).unwrap_or(arm);
        let q = JointVector::from_fn(|i, _| done.final_q.get(i).copied().unwrap_or(0.0));
        scenery.items.extend(ArmVisuals::new(model).items(model.kinematics(&q).world_from_links()));
        // a close view shows all of the arm from its shoulder on
        let k = arm.kinematics(&q);
        landmarks.extend(k.world_from_links()[1..].iter().map(|p| Point3::from(p.translation.vector)));
    }
    scenery.items.extend(extra.items.iter().cloned());
    for arm in &setup.parked {
        let k = arm.model.kinematics(&arm.service);
        scenery.items.extend(ArmVisuals::new(&arm.model).items(k.world_from_links()));
    }
    scenery.items.extend(setup.cell.furniture.iter().map(Item::from_visual));
    scenery.items.push(Item::from_mesh(setup.truth.canvas().mesh(), Material::paper(scene.color)));
    let (low, high) = scenery.bounds().unwrap_or((Point3::origin(), Point3::origin()));
    for f in &scene.furniture {
        scenery.items.push(Item::from_mesh(&f.mesh, Material::furniture(f.color)));
    }
    scenery.ink = Ribbons::from_trace(&record.ink, None);
    scenery.floor = Some(0.0);
    let framing = Framing {
        bounds: (low, high),
        landmarks,
        world_from_sheet: setup.truth.canvas().sheet().world_from_sheet,
        sheet: [setup.drawing.width, setup.drawing.height],
    };
    scenery.facing = framing.facing();
    (scenery, framing)
}
