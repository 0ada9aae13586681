//! Orthographic projection of a drawing onto a canvas, and the resampling of strokes on any mapping.
use nalgebra::{Point2, Point3};

use super::canvas::{Canvas, SheetFrame};
use super::mapped::{Mapping, SurfaceDrawing, SurfaceLayer, SurfaceStroke, SurfaceTarget};
use crate::drawing::{Drawing, Stroke};
use crate::mesh::{SurfacePoint, TriMesh};

/// Cosine of the largest angle between the surface's normal and the direction of projection, 80 degrees: past it lines
/// are stretched more than fivefold.
const MIN_COSINE: f64 = 0.173_648_177_666_930_33;
/// A point that lies farther than this, m, behind the visible surface is on its far side.
const HIDDEN_DEPTH: f64 = 0.05;
/// Points nearer on the sheet than this, m, are one point.
pub(super) const SAME_POINT: f64 = 1e-9;
/// Halvings of a piece of stroke before the surface is called torn there.
const MAX_HALVINGS: u32 = 24;
/// Largest number of targets that a drawing may be cut into.
const MAX_TARGETS: f64 = 5e7;

/// Orthographic projection: a sheet point goes along -z of the sheet until it meets the canvas from the artist's side.
/// How far the sheet floats from the canvas makes no difference.
#[derive(Clone)]
pub struct Projection {
    mesh: TriMesh,
    sheet: SheetFrame,
    /// Height over the sheet's plane, m, from which rays start: above all of the mesh.
    start: f64,
    /// Length of the rays, m: past all of the mesh.
    length: f64,
}

impl Projection {
    /// The projection of the canvas's sheet onto its mesh.
    pub fn new(canvas: &Canvas) -> Self {
        let (low, high) = canvas.mesh.bounds();
        let center = canvas.sheet.world_from_sheet.inverse() * nalgebra::center(&low, &high);
        let half = (high - low).norm() / 2.0 + 1e-3;
        Self { mesh: canvas.mesh.clone(), sheet: canvas.sheet.clone(), start: center.z + half, length: 2.0 * half }
    }
}

impl Mapping for Projection {
    /// `None` where the ray misses, or where the surface is turned away from the artist by more than 80 degrees.
    fn to_surface(&self, sheet: &Point2<f64>) -> Option<SurfacePoint> {
        let outward = self.sheet.world_from_sheet.rotation * nalgebra::Vector3::z();
        let origin = self.sheet.world_from_sheet * Point3::new(sheet.x, sheet.y, self.start);
        let hit = self.mesh.cast_ray(&origin, &-outward, self.length)?;
        (hit.normal.dot(&outward) >= MIN_COSINE).then_some(hit)
    }

    /// Drops the height over the sheet. `None` where the sheet has no surface under it, and for points more than 50 mm
    /// behind the surface that the artist sees.
    fn to_sheet(&self, world: &Point3<f64>) -> Option<Point2<f64>> {
        let point = self.sheet.world_from_sheet.inverse_transform_point(world);
        let sheet = point.xy();
        let seen = self.sheet.world_from_sheet.inverse_transform_point(&self.to_surface(&sheet)?.position);
        (point.z > seen.z - HIDDEN_DEPTH).then_some(sheet)
    }

    fn kind(&self) -> &'static str {
        "projection"
    }
}

/// A place of the drawing that can't be laid on the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct MapFailure {
    /// Name of the layer.
    pub layer: String,
    /// Index of the stroke in the layer.
    pub stroke: usize,
    /// Index of the point in the stroke; for a place between two points, of the first of them.
    pub point: usize,
    /// Where on the sheet, m.
    pub sheet: Point2<f64>,
    /// What is wrong there.
    pub problem: MapProblem,
}

/// Why a place can't be laid on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapProblem {
    /// There is no surface, or it is turned too far away.
    NoSurface,
    /// The surface jumps between neighbouring sheet points.
    Jump {
        /// How far, m.
        distance: f64,
    },
}

/// Why a drawing can't be laid on a surface.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// Some of it has no surface under it. Every failed place is listed, in drawing order.
    #[error("{}", describe(failures))]
    OffSurface {
        /// The failed places: at least one.
        failures: Vec<MapFailure>,
    },
    /// The step is not a positive length.
    #[error("a step of {step} m can't be taken along a stroke; it must be above 0")]
    BadStep {
        /// The step asked for, m.
        step: f64,
    },
    /// The step would cut the drawing into too many pieces.
    #[error("a step of {step} m cuts {length:.1} m of strokes into more than {MAX_TARGETS:e} pieces")]
    TooFine {
        /// The step asked for, m.
        step: f64,
        /// Length of the drawing, m.
        length: f64,
    },
}

fn describe(failures: &[MapFailure]) -> String {
    let mut strokes: Vec<(&str, usize)> = failures.iter().map(|f| (f.layer.as_str(), f.stroke)).collect();
    strokes.dedup();
    let places = |f: &MapFailure| {
        let why = match f.problem {
            MapProblem::NoSurface => "has no surface in front of the sheet".to_string(),
            MapProblem::Jump { distance } => {
                format!("is at an edge where the surface jumps by {:.1} mm", distance * 1e3)
            }
        };
        let (x, y) = (f.sheet.x * 1e3, f.sheet.y * 1e3);
        format!("layer `{}` stroke {} point {} at ({x:.1}, {y:.1}) mm {why}", f.layer, f.stroke, f.point)
    };
    let first: Vec<String> = failures.iter().take(3).map(places).collect();
    let more = if failures.len() > first.len() { "; ..." } else { "" };
    format!(
        "{} places of {} strokes don't fit on the canvas (make the drawing smaller or move the sheet): {}{more}",
        failures.len(),
        strokes.len(),
        first.join("; ")
    )
}

/// Lays a drawing on a surface. Strokes are resampled so that neighbouring targets are at most `step` (m) apart on the
/// surface; every point of the artwork stays a target; points repeated one after another become one; a dot stays one target.
/// Widths are interpolated, and stay as they are where the surface stretches the drawing.
///
/// # Errors
/// [`MapError::OffSurface`] with every place that has no surface under it.
pub fn map_drawing(drawing: &Drawing, mapping: &dyn Mapping, step: f64) -> Result<SurfaceDrawing, MapError> {
    check_step(drawing, step)?;
    let mut failures = Vec::new();
    let mut layers = Vec::with_capacity(drawing.layers.len());
    for layer in &drawing.layers {
        let mut strokes = Vec::with_capacity(layer.strokes.len());
        for (index, stroke) in layer.strokes.iter().enumerate() {
            let mut walk = Walk { mapping, step, targets: vec![] };
            for (point, sheet, problem) in walk.stroke(stroke) {
                failures.push(MapFailure { layer: layer.name.clone(), stroke: index, point, sheet, problem });
            }
            if !walk.targets.is_empty() {
                strokes.push(SurfaceStroke { index, targets: walk.targets });
            }
        }
        layers.push(SurfaceLayer { name: layer.name.clone(), color: layer.color, strokes });
    }
    if failures.is_empty() {
        Ok(SurfaceDrawing { layers, order: drawing.order.clone() })
    } else {
        Err(MapError::OffSurface { failures })
    }
}

/// Refuses a step (m) that can't be taken along a drawing.
pub(super) fn check_step(drawing: &Drawing, step: f64) -> Result<(), MapError> {
    if !(step.is_finite() && step > 0.0) {
        return Err(MapError::BadStep { step });
    }
    let length = drawing.length();
    if length / step > MAX_TARGETS {
        return Err(MapError::TooFine { step, length });
    }
    Ok(())
}

/// Walks one stroke over the surface.
struct Walk<'a> {
    mapping: &'a dyn Mapping,
    step: f64,
    targets: Vec<SurfaceTarget>,
}

impl Walk<'_> {
    /// Fills `targets`; returns the places that failed.
    fn stroke(&mut self, stroke: &Stroke) -> Vec<(usize, Point2<f64>, MapProblem)> {
        let mut failed = Vec::new();
        let mut last: Option<SurfaceTarget> = None;
        for (i, sheet) in stroke.points.iter().enumerate() {
            if last.is_some_and(|l| (l.sheet - sheet).norm() < SAME_POINT) {
                continue;
            }
            let target = self.target(sheet, stroke.width_at(i));
            match (last, target) {
                (_, None) => failed.push((i, *sheet, MapProblem::NoSurface)),
                (None, Some(target)) => self.targets.push(target),
                (Some(from), Some(to)) => {
                    // At most one report a piece: its neighbours would say the same.
                    if let Err((sheet, problem)) = self.piece(&from, &to, 0) {
                        failed.push((i - 1, sheet, problem));
                    }
                    self.targets.push(to);
                }
            }
            last = target;
        }
        failed
    }

    /// Appends the targets strictly between two targets.
    fn piece(&mut self, a: &SurfaceTarget, b: &SurfaceTarget, halvings: u32) -> Result<(), (Point2<f64>, MapProblem)> {
        let distance = (b.position - a.position).norm();
        if distance <= self.step && (b.sheet - a.sheet).norm() <= self.step {
            return Ok(());
        }
        let middle = nalgebra::center(&a.sheet, &b.sheet);
        if halvings == MAX_HALVINGS || (b.sheet - a.sheet).norm() < SAME_POINT {
            return Err((middle, MapProblem::Jump { distance }));
        }
        let width = a.width.zip(b.width).map(|(a, b)| 0.5 * (a + b));
        let target = self.target(&middle, width).ok_or((middle, MapProblem::NoSurface))?;
        self.piece(a, &target, halvings + 1)?;
        self.targets.push(target);
        self.piece(&target, b, halvings + 1)
    }

    fn target(&self, sheet: &Point2<f64>, width: Option<f64>) -> Option<SurfaceTarget> {
        let s = self.mapping.to_surface(sheet)?;
        Some(SurfaceTarget { position: s.position, normal: s.normal, sheet: *sheet, width })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::InkLayer;
    use crate::math::{Pose, Rgb};
    use crate::mesh::{TriMesh, shapes};
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use std::sync::LazyLock;

    fn dome() -> Canvas {
        static DOME: LazyLock<TriMesh> = LazyLock::new(|| shapes::dome(0.15, 0.005).unwrap());
        let mesh = DOME.clone();
        let world_from_sheet = Pose::translation(0.0, 0.0, 0.2);
        Canvas { name: "dome".into(), mesh, sheet: SheetFrame { world_from_sheet } }
    }

    fn drawing(strokes: &[&[(f64, f64)]]) -> Drawing {
        let stroke = |s: &&[(f64, f64)]| Stroke::new(s.iter().map(|&(x, y)| Point2::new(x, y)).collect());
        let strokes = strokes.iter().map(stroke).collect();
        let layer = InkLayer { name: "ink".into(), color: Rgb([0; 3]), width_hint: None, strokes };
        Drawing::new(0.4, 0.4, vec![layer])
    }

    proptest! {
        #[test]
        fn projection_comes_back(x in -0.1..0.1f64, y in -0.1..0.1f64, pose in prop::array::uniform6(-3.0..3.0f64)) {
            let canvas = dome();
            let [a, b, c, d, e, f] = pose;
            let moved = Pose::new(Vector3::new(a, b, c), Vector3::new(d, e, f));
            let world_from_sheet = moved * canvas.sheet.world_from_sheet;
            let mesh = canvas.mesh.transformed(&moved);
            let projection = Projection::new(&Canvas { name: canvas.name, mesh, sheet: SheetFrame { world_from_sheet } });
            let sheet = Point2::new(x, y);
            let hit = projection.to_surface(&sheet).unwrap();
            let local = moved.inverse_transform_point(&hit.position);
            prop_assert!((local.coords.norm() - 0.15).abs() < 5e-5 && local.z > 0.0);
            prop_assert!((projection.to_sheet(&hit.position).unwrap() - sheet).norm() < 1e-12);
        }

        #[test]
        fn widths_are_interpolated_along_the_stroke(step in 5e-4..2e-2f64, a in 2e-4..2e-3f64, b in 2e-4..2e-3f64) {
            let mut d = drawing(&[&[(-0.05, 0.02), (0.05, -0.01)]]);
            d.layers[0].strokes[0].widths = vec![a, b];
            let mapped = map_drawing(&d, &Projection::new(&dome()), step).unwrap();
            for t in &mapped.layers[0].strokes[0].targets {
                let u = (t.sheet.x + 0.05) / 0.1;
                prop_assert!((t.width.unwrap() - (a + (b - a) * u)).abs() < 1e-9);
            }
        }

        #[test]
        fn targets_are_at_most_a_step_apart_and_keep_corners(
            corners in prop::collection::vec((-0.1..0.1f64, -0.1..0.1f64), 2..8), step in 0.0005..0.02f64,
        ) {
            let art = drawing(&[&corners]);
            let mapped = map_drawing(&art, &Projection::new(&dome()), step).unwrap();
            let targets = &mapped.layers[0].strokes[0].targets;
            for w in targets.windows(2) {
                prop_assert!((w[1].position - w[0].position).norm() <= step);
            }
            let mut rest = targets.iter();
            for p in &art.layers[0].strokes[0].points {
                prop_assert!(rest.any(|t| t.sheet == *p), "corner {p} is lost");
            }
            prop_assert!(rest.next().is_none());
        }
    }

    #[test]
    fn dots_stay_dots_and_repeats_go() {
        let art = drawing(&[&[(0.01, 0.0)], &[(0.0, 0.0), (0.0, 0.0)], &[(0.0, 0.0), (0.0, 0.0), (0.001, 0.0)], &[]]);
        let mapped = map_drawing(&art, &Projection::new(&dome()), 0.002).unwrap();
        let lengths: Vec<_> = mapped.layers[0].strokes.iter().map(|s| (s.index, s.targets.len())).collect();
        assert_eq!(lengths, [(0, 1), (1, 1), (2, 2)]);
    }

    #[test]
    fn every_place_off_the_surface_is_reported() {
        let on = (0.0, 0.0);
        let art = drawing(&[&[on, (0.05, 0.0)], &[on, (0.2, 0.0), (0.0, 0.05)], &[(0.0, 0.3)]]);
        let e = map_drawing(&art, &Projection::new(&dome()), 0.002).unwrap_err();
        let MapError::OffSurface { failures } = &e else { panic!("{e}") };
        assert_eq!(failures.iter().map(|f| (f.stroke, f.point)).collect::<Vec<_>>(), [(1, 1), (2, 0)]);
        assert!(e.to_string().contains("stroke 1 point 1 at (200.0, 0.0) mm"), "{e}");
        // Round the rim the surface is there, but too steep.
        assert!(map_drawing(&drawing(&[&[(0.1495, 0.0)]]), &Projection::new(&dome()), 0.002).is_err());
        assert!(matches!(map_drawing(&art, &Projection::new(&dome()), 0.0), Err(MapError::BadStep { .. })));
    }

    #[test]
    fn a_jump_of_the_surface_is_reported() {
        // A box on a larger slab, seen from above.
        let slab = shapes::cuboid(&Vector3::new(0.3, 0.3, 0.02), 0.05).unwrap();
        let top = shapes::cuboid(&Vector3::new(0.1, 0.1, 0.1), 0.05).unwrap();
        let n = slab.vertices().len() as u32;
        let vertices = [slab.vertices(), top.vertices()].concat();
        let triangles =
            slab.triangles().iter().copied().chain(top.triangles().iter().map(|t| t.map(|i| i + n))).collect();
        let mesh = TriMesh::new(vertices, triangles).unwrap();
        let canvas = Canvas { mesh, ..dome() };
        let e = map_drawing(&drawing(&[&[(0.0, 0.0), (0.1, 0.01)]]), &Projection::new(&canvas), 0.002).unwrap_err();
        let MapError::OffSurface { failures } = &e else { panic!("{e}") };
        assert!(matches!(failures[0].problem, MapProblem::Jump { distance } if (distance - 0.04).abs() < 1e-6), "{e}");
    }

    #[test]
    fn the_far_side_is_outside_the_chart() {
        let canvas = dome();
        let projection = Projection::new(&canvas);
        assert!(projection.to_sheet(&Point3::new(0.0, 0.0, 0.149)).is_some());
        assert!(projection.to_sheet(&Point3::new(0.0, 0.0, 0.0)).is_none());
        assert!(projection.to_sheet(&Point3::new(0.2, 0.0, 0.0)).is_none());
    }
}
