//! What of the desired line a round nib can touch: gaps and corners narrower than its ball stay white whoever draws.
use nalgebra::{Point3, Vector3};

use super::segments::SegmentGrid;
use crate::mesh::TriMesh;
use crate::surface::{Mapping, SurfaceDrawing};

/// A ball nearer to the surface than this rests on it, m.
const RESTS: f64 = 1e-6;
/// Steps after which a ball that glides along a face is where it will be.
const STEPS: usize = 200;

/// Where the ball of each layer's nib would touch the surface if its pen followed the desired line without error.
#[derive(Debug)]
pub struct Touchable {
    touched: SegmentGrid,
    /// How near to a touched place a point counts as touched, m, by layer.
    within: Vec<f64>,
    /// Layers whose nib is no ball, and touches all.
    pointed: Vec<bool>,
}

impl Touchable {
    /// Lowers the ball of each layer's nib (`balls`: radius, m, 0 for a pointed nib; `widths`: of its line, m) onto `surface` at every
    /// desired place. `meant` is the mapping onto the object as it was meant, with the normal that the pen is held
    /// along, and no point of `surface` lies farther than `reach` (m) from there.
    pub fn of(
        desired: &SurfaceDrawing,
        surface: &TriMesh,
        [balls, widths]: [&[f64]; 2],
        meant: &dyn Mapping,
        reach: f64,
    ) -> Self {
        let mut touched = SegmentGrid::new(1e-3);
        for (layer, l) in desired.layers.iter().enumerate() {
            let radius = balls.get(layer).copied().unwrap_or(0.0);
            if radius <= 0.0 {
                continue;
            }
            for target in l.strokes.iter().flat_map(|s| &s.targets) {
                let place = meant
                    .to_surface(&target.sheet)
                    .and_then(|m| lowered(surface, &m.position, &m.normal, radius, reach));
                if let Some(at) = place {
                    touched.insert(at, at, layer as u64);
                }
            }
        }
        Self { touched, within: widths.to_vec(), pointed: balls.iter().map(|r| *r <= 0.0).collect() }
    }

    /// Whether a nib of this layer can leave ink within a line's width of a desired place.
    pub fn holds(&self, layer: usize, place: &Point3<f64>) -> bool {
        if self.pointed.get(layer).copied().unwrap_or(true) {
            return true;
        }
        let within = self.within.get(layer).copied().unwrap_or(0.0);
        self.touched.distance(place, within, |l| l == layer as u64).is_some()
    }
}

/// Where a ball that comes down along `-normal` over `place` meets the surface first; `None` where it passes it by.
fn lowered(
    surface: &TriMesh,
    place: &Point3<f64>,
    normal: &Vector3<f64>,
    radius: f64,
    reach: f64,
) -> Option<Point3<f64>> {
    let mut height = reach + radius;
    for _ in 0..STEPS {
        let center = place + normal * height;
        let nearest = surface.closest_point(&center).position;
        let free = (center - nearest).norm() - radius;
        if free < RESTS {
            return Some(nearest);
        }
        height -= free;
        if height < -reach - radius {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use crate::mesh::{Boards, clad, shapes};

    /// Boards 60 mm wide with gaps of 2 mm and edges eased by 4 mm, their faces at z = 0.
    fn boards() -> TriMesh {
        let block = shapes::rectangle(0.3, 0.3, 0.05, 0.01).unwrap();
        let boards = Boards { start: -0.15, width: 0.06, gap: 0.002, bevel: 0.004, offsets: vec![0.0; 5] };
        clad(&block, &Pose::identity(), false, &boards).unwrap()
    }

    fn rests(x: f64, radius: f64) -> Option<Point3<f64>> {
        lowered(&boards(), &Point3::new(x, 0.01, 0.0), &Vector3::z(), radius, 0.05)
    }

    #[test]
    fn a_ball_rests_on_faces_and_eased_edges_and_over_gaps() {
        let ball = 2.5e-3;
        // on the middle of a board right below itself
        assert!((rests(0.0, ball).unwrap() - Point3::new(0.0, 0.01, 0.0)).norm() < 1e-5);
        // on an eased edge beside itself: the face leans by 45 degrees
        let (x, edge) = (0.027, rests(0.027, ball).unwrap());
        assert!((edge.x - x - ball * std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-5 || edge.x < x, "{edge}");
        // over a gap it hangs between two edges, and comes no deeper than they let it
        let held = rests(0.03, ball).unwrap();
        assert!(held.z > -0.006 && (held.x - 0.03).abs() > 5e-4, "{held}");
        // a ball that is small enough falls through, as the boards' backs are open
        assert!(rests(0.03, 0.5e-3).is_none_or(|p| p.z < -0.02));
    }
}
