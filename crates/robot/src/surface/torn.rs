//! As much of a drawing as there is surface for: how a desired line lies on a true canvas that has gaps and steps.
use nalgebra::Point2;

use super::mapped::{Mapping, SurfaceDrawing, SurfaceLayer, SurfaceStroke, SurfaceTarget};
use super::projection::{MapError, SAME_POINT, check_step};
use crate::drawing::{Drawing, Stroke};

/// Where the surface begins, ends or jumps is found to within this on the sheet, m.
const EDGE: f64 = 1e-5;

/// Lays on a surface what of a drawing lies on it, as [`map_drawing`](super::map_drawing) does, and leaves out the rest: a stroke is
/// parted where the surface has a gap or jumps, and its parts keep its index. Pieces of surface narrower than `step` (m) may be missed.
///
/// # Errors
/// A step that is no length, or too short.
pub fn map_what_fits(drawing: &Drawing, mapping: &dyn Mapping, step: f64) -> Result<SurfaceDrawing, MapError> {
    check_step(drawing, step)?;
    let layers = drawing.layers.iter().map(|layer| {
        let parts = layer.strokes.iter().enumerate().flat_map(|(index, stroke)| {
            let parts = Walk { mapping, step, parts: vec![vec![]] }.stroke(stroke);
            parts.into_iter().map(move |targets| SurfaceStroke { index, targets })
        });
        SurfaceLayer { name: layer.name.clone(), color: layer.color, strokes: parts.collect() }
    });
    Ok(SurfaceDrawing { layers: layers.collect(), order: drawing.order.clone() })
}

/// A place on the sheet, and what is there.
#[derive(Clone, Copy)]
struct Spot {
    sheet: Point2<f64>,
    width: Option<f64>,
    target: Option<SurfaceTarget>,
}

struct Walk<'a> {
    mapping: &'a dyn Mapping,
    step: f64,
    /// Unbroken parts; the last is still growing.
    parts: Vec<Vec<SurfaceTarget>>,
}

impl Walk<'_> {
    fn stroke(mut self, stroke: &Stroke) -> Vec<Vec<SurfaceTarget>> {
        let mut last: Option<Spot> = None;
        for (i, sheet) in stroke.points.iter().enumerate() {
            if last.is_some_and(|l| (l.sheet - sheet).norm() < SAME_POINT) {
                continue;
            }
            let spot = self.spot(*sheet, stroke.width_at(i));
            if let Some(last) = last {
                self.between(&last, &spot);
            }
            self.add(&spot);
            last = Some(spot);
        }
        self.parts.retain(|p| !p.is_empty());
        self.parts
    }

    /// Adds what lies strictly between two places.
    fn between(&mut self, a: &Spot, b: &Spot) {
        let apart = (b.sheet - a.sheet).norm();
        match (&a.target, &b.target) {
            (Some(p), Some(q)) if (q.position - p.position).norm() <= self.step && apart <= self.step => return,
            (None, None) if apart <= self.step => return,
            _ if apart <= EDGE => return self.part(),
            _ => {}
        }
        let width = a.width.zip(b.width).map(|(a, b)| 0.5 * (a + b));
        let middle = self.spot(nalgebra::center(&a.sheet, &b.sheet), width);
        self.between(a, &middle);
        self.add(&middle);
        self.between(&middle, b);
    }

    fn add(&mut self, spot: &Spot) {
        match (spot.target, self.parts.last_mut()) {
            (Some(target), Some(part)) => part.push(target),
            _ => self.part(),
        }
    }

    /// Ends a part.
    fn part(&mut self) {
        if self.parts.last().is_none_or(|p| !p.is_empty()) {
            self.parts.push(vec![]);
        }
    }

    fn spot(&self, sheet: Point2<f64>, width: Option<f64>) -> Spot {
        let at = self.mapping.to_surface(&sheet);
        let target = at.map(|s| SurfaceTarget { position: s.position, normal: s.normal, sheet, width });
        Spot { sheet, width, target }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::InkLayer;
    use crate::math::{Pose, Rgb};
    use crate::mesh::{Boards, clad, shapes};
    use crate::surface::{Canvas, Projection, SheetFrame, map_drawing};

    fn line(length: f64) -> Drawing {
        let stroke = Stroke::new(vec![Point2::new(-length / 2.0, 0.011), Point2::new(length / 2.0, 0.012)]);
        let layer = InkLayer { name: "k".into(), color: Rgb([0; 3]), width_hint: None, strokes: vec![stroke] };
        Drawing::new(0.4, 0.4, vec![layer])
    }

    fn canvas(mesh: crate::mesh::TriMesh) -> Canvas {
        Canvas { name: "c".into(), mesh, sheet: SheetFrame { world_from_sheet: Pose::identity() } }
    }

    #[test]
    fn on_a_whole_surface_it_is_the_same_line_to_the_last_bit() {
        let mapping = Projection::new(&canvas(shapes::dome(0.15, 0.005).unwrap()));
        let d = line(0.2);
        assert_eq!(map_what_fits(&d, &mapping, 1e-3).unwrap(), map_drawing(&d, &mapping, 1e-3).unwrap());
    }

    #[test]
    fn gaps_and_steps_part_the_line_and_the_rest_is_kept() {
        let wall = shapes::rectangle(0.4, 0.3, 0.0, 0.007).unwrap();
        let boards = Boards { start: -0.2, width: 0.1, gap: 0.004, bevel: 0.0, offsets: vec![0.0, 0.005, -0.002, 0.0] };
        let mapping = Projection::new(&canvas(clad(&wall, &Pose::identity(), false, &boards).unwrap()));
        let d = line(0.3);
        assert!(map_drawing(&d, &mapping, 1e-3).is_err());
        let fits = map_what_fits(&d, &mapping, 1e-3).unwrap();
        let strokes = &fits.layers[0].strokes;
        assert_eq!(strokes.len(), 4);
        assert!(strokes.iter().all(|s| s.index == 0));
        let length: f64 =
            strokes.iter().flat_map(|s| s.targets.windows(2)).map(|w| (w[1].position - w[0].position).norm()).sum();
        assert!((length - 0.288).abs() < 1e-4, "{length}");
        // without gaps a step parts it too
        let boards = Boards { gap: 0.0, ..boards };
        let mapping = Projection::new(&canvas(clad(&wall, &Pose::identity(), false, &boards).unwrap()));
        assert_eq!(map_what_fits(&d, &mapping, 1e-3).unwrap().layers[0].strokes.len(), 4);
    }

    #[test]
    fn what_hangs_over_the_edge_is_left_out() {
        let mapping = Projection::new(&canvas(shapes::rectangle(0.2, 0.2, 0.0, 0.01).unwrap()));
        let fits = map_what_fits(&line(0.4), &mapping, 1e-3).unwrap();
        let targets = &fits.layers[0].strokes[0].targets;
        assert_eq!(fits.layers[0].strokes.len(), 1);
        assert!(
            (targets[0].position.x + 0.1).abs() < 2e-5 && (targets[targets.len() - 1].position.x - 0.1).abs() < 2e-5
        );
    }
}
