//! How far the surface that the robot believes in is from the true one.
use nalgebra::Point2;

use crate::math::{rotation_vector, stats};
use crate::measure::BeliefMetrics;
use crate::surface::{BelievedCanvas, Mapping, Projection};
use crate::truth::TrueCanvas;

/// Places compared along each side of the sheet.
const PLACES: u32 = 100;

impl BeliefMetrics {
    /// Figures of a believed surface: its distance from the true one at places all over a sheet of `size` (m), and how far the sheet is
    /// from the true one. `kind` is the name of the belief. Places where no surface is believed in are left out.
    pub fn of(kind: &str, truth: &TrueCanvas, belief: &BelievedCanvas, size: [f64; 2]) -> Self {
        let projection = Projection::new(belief);
        let place = |i: u32| (f64::from(i) + 0.5) / f64::from(PLACES) - 0.5;
        let distances: Vec<f64> = (0..PLACES * PLACES)
            .map(|k| Point2::new(place(k % PLACES) * size[0], place(k / PLACES) * size[1]))
            .filter_map(|p| projection.to_surface(&p))
            .map(|s| (truth.mesh().closest_point(&s.position).position - s.position).norm() * 1e3)
            .collect();
        let [true_sheet, sheet] = [truth.sheet(), &belief.sheet].map(|s| s.world_from_sheet);
        let turn = rotation_vector(&(sheet.rotation * true_sheet.rotation.inverse())).norm();
        Self {
            kind: kind.into(),
            vertices: Some(belief.mesh.vertices().len()),
            triangles: Some(belief.mesh.triangles().len()),
            error_mean_mm: stats::mean(&distances),
            error_p95_mm: stats::quantile(&distances, 0.95),
            error_max_mm: stats::quantile(&distances, 1.0),
            sheet_offset_mm: Some((sheet.translation.vector - true_sheet.translation.vector).norm() * 1e3),
            sheet_turn_deg: Some(turn.to_degrees()),
            ..Default::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;
    use crate::math::Pose;
    use crate::mesh::shapes;
    use crate::surface::{Canvas, SheetFrame};

    #[test]
    fn a_wall_that_is_believed_two_millimetres_nearer_is_off_by_that() {
        let slab = shapes::rectangle(0.3, 0.3, 0.02, 0.01).unwrap();
        let sheet = SheetFrame { world_from_sheet: Pose::translation(0.0, 0.0, 0.5) };
        let canvas = |z: f64| Canvas {
            name: "slab".into(),
            mesh: slab.transformed(&Pose::translation(0.0, 0.0, z)),
            sheet: sheet.clone(),
        };
        let metrics =
            BeliefMetrics::of("scan", &TrueCanvas::nominal(canvas(0.0)), &BelievedCanvas(canvas(0.002)), [0.2, 0.1]);
        for error in [metrics.error_mean_mm, metrics.error_p95_mm, metrics.error_max_mm] {
            assert!((error.unwrap() - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_sheet_that_is_believed_elsewhere_is_off_by_that() {
        let mesh = shapes::rectangle(0.3, 0.3, 0.02, 0.01).unwrap();
        let canvas = |x: f64, turn: f64| {
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, turn));
            let world_from_sheet = Pose::from_parts(Translation3::new(x, 0.0, 0.5), rotation);
            Canvas { name: "slab".into(), mesh: mesh.clone(), sheet: SheetFrame { world_from_sheet } }
        };
        let (truth, belief) = (TrueCanvas::nominal(canvas(0.003, 0.0)), BelievedCanvas(canvas(0.0, 0.02)));
        let metrics = BeliefMetrics::of("scan", &truth, &belief, [0.1, 0.1]);
        assert!((metrics.sheet_offset_mm.unwrap() - 3.0).abs() < 1e-9);
        assert!((metrics.sheet_turn_deg.unwrap() - 0.02f64.to_degrees()).abs() < 1e-9);
    }
}
