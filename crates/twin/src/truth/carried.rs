//! The desired line on a canvas that isn't as it was meant: carried onto it from the one that was.
use nalgebra::{Point2, Point3};

use super::TrueCanvas;
use crate::mesh::{SurfacePoint, TriMesh};
use crate::surface::{Canvas, Mapping};

/// A mapping of the canvas as it was meant, carried onto the reshaped one along the normals of the first: a desired point keeps its place on
/// the object, and moves in or out with the surface.
pub struct Carried {
    meant: Box<dyn Mapping>,
    meant_mesh: TriMesh,
    truth: TriMesh,
    reach: f64,
}

impl Carried {
    /// Carries `meant`, a mapping of `canvas`, onto `truth`, of which no point is looked for farther than `reach` (m) from `canvas`.
    pub fn new(meant: Box<dyn Mapping>, canvas: &Canvas, truth: &TrueCanvas, reach: f64) -> Self {
        Self { meant, meant_mesh: canvas.mesh.clone(), truth: truth.mesh().clone(), reach }
    }
}

impl Mapping for Carried {
    fn to_surface(&self, sheet: &Point2<f64>) -> Option<SurfacePoint> {
        let meant = self.meant.to_surface(sheet)?;
        let from = meant.position + meant.normal * self.reach;
        self.truth.cast_ray(&from, &-meant.normal, 2.0 * self.reach)
    }

    fn to_sheet(&self, world: &Point3<f64>) -> Option<Point2<f64>> {
        let foot = self.meant_mesh.closest_point_within(world, 2.0 * self.reach)?.position;
        let sheet = self.meant.to_sheet(&foot)?;
        // the nearest point of a facet isn't quite the one whose smooth normal leads here: once more, from where that leads
        let Some(there) = self.to_surface(&sheet) else { return Some(sheet) };
        let nearer = self.meant_mesh.closest_point_within(&(foot + (world - there.position)), 2.0 * self.reach);
        nearer.and_then(|n| self.meant.to_sheet(&n.position)).or(Some(sheet))
    }

    fn kind(&self) -> &'static str {
        self.meant.kind()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use crate::mesh::shapes;
    use crate::surface::{Projection, SheetFrame};
    use nalgebra::Translation3;

    #[test]
    fn a_point_moves_along_the_normal_and_finds_back() {
        let canvas = |radius: f64| Canvas {
            name: "dome".into(),
            mesh: shapes::dome(radius, 0.003).unwrap(),
            sheet: SheetFrame {
                world_from_sheet: Pose::from_parts(Translation3::new(0.0, 0.0, 0.3), Default::default()),
            },
        };
        let (meant, truth) = (canvas(0.15), TrueCanvas::new(canvas(0.16)));
        let carried = Carried::new(Box::new(Projection::new(&meant)), &meant, &truth, 0.02);
        for (x, y) in [(0.0, 0.0), (0.06, 0.02), (-0.05, 0.07)] {
            let sheet = Point2::new(x, y);
            let at = carried.to_surface(&sheet).unwrap().position;
            // a larger ball about the same centre: all in proportion, but for the facets
            let desired = Point3::new(x, y, (0.15f64.powi(2) - x * x - y * y).sqrt()).coords * (0.16 / 0.15);
            assert!((at.coords - desired).norm() < 5e-5, "{at} {desired}");
            assert!((carried.to_sheet(&at).unwrap() - sheet).norm() < 5e-5);
        }
        assert!(carried.to_surface(&Point2::new(0.3, 0.0)).is_none());
    }
}
