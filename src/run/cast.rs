//! What takes part in a run: the robot, the scene, the drawing and its pens, loaded from the files that a scenario names.
use std::path::Path;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use crate::drawing::pattern::{Figure, Pattern};
use crate::drawing::tidy::{TidyOptions, tidy};
use crate::drawing::{self, Drawing, InkLayer, Size, StylusOptions, SvgOptions, stylus};
use crate::ink::PenModel;
use crate::math::{Pose, Rgb};
use crate::mesh::{TriMesh, shapes};
use crate::robot::{Cell, VisualShape};
use crate::run::{Progress, RunError};
use crate::scenario::{self, Artwork, DrawingSpec, PenSpec, Scenario};
use crate::surface::{BelievedCanvas, Scene, TrueCanvas};
use crate::twin::LayerPen;

/// Curves become polylines this near to them, m: well below what can be seen of the corners.
const FLATTENING: f64 = 1e-5;
/// The pen of a recording that is drawn without a scenario.
const DEFAULT_PEN: &str = "fineliner_08";
/// Ink of generated patterns.
const BLACK: Rgb = Rgb([26, 26, 30]);

/// The robot, the scene in truth and in belief, the drawing and its pens.
pub(super) struct Cast {
    pub cell: Cell,
    pub scene: Scene,
    pub truth: TrueCanvas,
    pub belief: BelievedCanvas,
    pub drawing: Drawing,
    pub pens: Vec<LayerPen>,
}

impl Cast {
    pub(super) fn load(scenario: &Scenario, drawing: Drawing) -> Result<Self, RunError> {
        let cell = Cell::load(&scenario.robot)?;
        if cell.arms.len() != 1 {
            return Err(RunError::ArmCount { robot: cell.name, arms: cell.arms.len() });
        }
        let mut scene = Scene::read(&scenario.canvas.scene)?;
        // the drawing lies on the sheet as it is; the sheet is moved and turned
        let [x, y] = scenario.canvas.offset_mm.map(|mm| mm * 1e-3);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), scenario.drawing.rotate_deg.to_radians());
        scene.canvas.sheet.world_from_sheet *= Pose::from_parts(Translation3::new(x, y, 0.0), turn);
        let truth = TrueCanvas(scene.canvas.clone());
        let belief = BelievedCanvas(scene.canvas.clone());
        let pens =
            drawing.layers.iter().map(|layer| layer_pen(layer, &scenario.pen)).collect::<Result<Vec<_>, RunError>>()?;
        Ok(Self { cell, scene, truth, belief, drawing, pens })
    }

    /// What the planner keeps clear of besides the canvas: the scene's furniture, then the robot's.
    pub(super) fn obstacles(&self) -> Result<Vec<TriMesh>, RunError> {
        let mut obstacles: Vec<TriMesh> = self.scene.furniture.iter().map(|f| f.mesh.clone()).collect();
        for (index, thing) in self.cell.furniture.iter().enumerate() {
            // a robot file knows no other furniture than boxes
            let VisualShape::Cuboid { size } = &thing.shape else { continue };
            let mesh = shapes::cuboid(size, size.max()).map_err(|source| RunError::Furniture {
                robot: self.cell.name.clone(),
                index,
                source,
            })?;
            obstacles.push(mesh.transformed(&thing.link_from_visual));
        }
        Ok(obstacles)
    }
}

/// The pen of a layer: by its name, else by its colour, else the scenario's one.
fn layer_pen(layer: &InkLayer, spec: &PenSpec) -> Result<LayerPen, RunError> {
    Ok(LayerPen { pen: PenModel::read(pen_file(&layer.name, layer.color, spec))?, ink: layer.name.clone() })
}

fn pen_file<'a>(name: &str, Rgb([r, g, b]): Rgb, spec: &'a PenSpec) -> &'a Path {
    let by_color = || spec.inks.get(&format!("#{r:02x}{g:02x}{b:02x}"));
    spec.inks.get(name).or_else(by_color).map_or(&spec.kind, |file| file)
}

/// How a recording of a stylus is read: its lines are as wide as asked for, else as the pen can draw them.
fn stylus_options(
    spec: &DrawingSpec,
    pen: Option<&PenSpec>,
    progress: &dyn Progress,
) -> Result<StylusOptions, RunError> {
    let pen = match pen {
        Some(pen) => Some(PenModel::read(pen_file(stylus::LAYER, stylus::INK, pen))?),
        None => PenModel::named(DEFAULT_PEN),
    };
    let range = pen.as_ref().map(PenModel::width_range);
    let mut options = StylusOptions { gamma: spec.stylus_gamma, ..Default::default() };
    options.width = spec.stylus_width_mm.map(|w| w.map(|mm| mm * 1e-3)).or(range).unwrap_or(options.width);
    if let (Some(pen), Some([narrow, wide])) = (&pen, range)
        && (options.width[0] < 0.98 * narrow || options.width[1] > 1.02 * wide)
    {
        let [a, b, c, d] = [options.width[0], options.width[1], narrow, wide].map(|w| w * 1e3);
        let name = &pen.name;
        progress.note(&format!("lines from {a:.2} to {b:.2} mm are wished, but a {name} draws {c:.2} to {d:.2} mm"));
    }
    Ok(options)
}

/// Reads, or makes, and tidies a drawing, which `pen` is for.
pub(super) fn draw(spec: &DrawingSpec, pen: Option<&PenSpec>, progress: &dyn Progress) -> Result<Drawing, RunError> {
    let mm = |x: Option<f64>| x.map(|x| x * 1e-3);
    let (width, height) = (mm(spec.width_mm), mm(spec.height_mm));
    let mut drawing = match &spec.artwork {
        Artwork::File(file) => {
            let size = match (width, height) {
                (None, None) => Size::Natural,
                (Some(w), None) => Size::Width(w),
                (None, Some(h)) => Size::Height(h),
                (Some(w), Some(h)) => Size::Fit(w, h),
            };
            let fill = match spec.fill {
                scenario::Fill::Outline => drawing::Fill::Outline,
                scenario::Fill::Ignore => drawing::Fill::Ignore,
                scenario::Fill::Hatch => drawing::Fill::Hatch {
                    spacing: spec.hatch_spacing_mm * 1e-3,
                    angle: spec.hatch_angle_deg.to_radians(),
                },
            };
            let svg = SvgOptions { size, fill, tolerance: FLATTENING, ..Default::default() };
            let recorded = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("jsonl"));
            let stylus = if recorded { stylus_options(spec, pen, progress)? } else { StylusOptions::default() };
            let loaded = drawing::load(file, &svg, &stylus)?;
            for warning in &loaded.warnings {
                progress.note(&format!("{}: {warning}", file.display()));
            }
            loaded.drawing
        }
        Artwork::Pattern(pattern) => {
            let side = match (width, height) {
                (Some(w), Some(h)) => w.min(h),
                (Some(one), None) | (None, Some(one)) => one,
                (None, None) => 0.15,
            };
            generated(pattern).draw(side)?
        }
    };
    if spec.tidy {
        let positive = |mm: f64| (mm > 0.0).then_some(mm * 1e-3);
        let options = TidyOptions {
            merge: positive(spec.merge_mm),
            simplify: positive(spec.simplify_mm),
            order: true,
            ..Default::default()
        };
        tidy(&mut drawing, &options);
    }
    Ok(drawing)
}

fn generated(pattern: &scenario::Pattern) -> Pattern {
    let color = BLACK;
    match *pattern {
        scenario::Pattern::Grid { n } => Pattern::Grid { cells: n, color },
        scenario::Pattern::Hilbert { order } => Pattern::Hilbert { order, color },
        scenario::Pattern::Arrowhead { order } => Pattern::Arrowhead { order, color },
        scenario::Pattern::Snowflake { order } => Pattern::Snowflake { order, color },
        scenario::Pattern::Target => Pattern::Target { figure: Figure::default(), color },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pedestal_is_in_the_planners_way() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/grid_plane.toml");
        let scenario = Scenario::read(&file, &[]).unwrap();
        let cast = Cast::load(&scenario, Drawing::new(0.1, 0.1, vec![])).unwrap();
        let obstacles = cast.obstacles().unwrap();
        let ours = &obstacles[cast.scene.furniture.len()..];
        assert_eq!(ours.len(), cast.cell.furniture.len());
        // the plate on the pedestal ends where the arm's base begins
        let top = ours.iter().map(|m| m.bounds().1.z).fold(0.0, f64::max);
        assert!((top - cast.cell.arms[0].model.world_from_base.translation.z).abs() < 1e-9, "{top} m");
    }
}
