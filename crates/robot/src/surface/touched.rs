//! A canvas known by touch alone: a sheet in space, and heights over it where a pen has met something.
use nalgebra::{Point2, Point3};

use super::canvas::{BelievedCanvas, Canvas, SheetFrame};
use super::heights::{HeightTree, Touch, TouchedSurface};
use crate::mesh::{MeshError, TriMesh};

/// Squares of the believed mesh are about as wide as this, m.
const MESH_STEP: f64 = 0.005;
/// Most squares a side.
const MOST_SQUARES: usize = 120;
/// Passes of a binomial filter over the mesh's heights, which keep normals from turning from touch to touch.
const SMOOTHING: usize = 1;

/// What a robot knows of a canvas that it has only touched.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct TouchedCanvas {
    name: String,
    sheet: SheetFrame,
    /// Lower left and upper right corner of the extent on the sheet, m.
    extent: [Point2<f64>; 2],
    tree: HeightTree,
}

impl TouchedCanvas {
    /// Nothing known but the sheet's frame and the `extent` (lower left and upper right corner on the sheet, m) that matters.
    /// Touches are kept `spacing` (m) apart.
    pub fn new(sheet: SheetFrame, extent: [Point2<f64>; 2], spacing: f64) -> Self {
        let center = nalgebra::center(&extent[0], &extent[1]);
        let half = 0.5 * (extent[1] - extent[0]).amax();
        Self { name: "touched".into(), sheet, extent, tree: HeightTree::new(center, half, spacing) }
    }

    /// The sheet.
    pub fn sheet(&self) -> &SheetFrame {
        &self.sheet
    }

    /// Lower left and upper right corner of the extent on the sheet, m.
    pub fn extent(&self) -> [Point2<f64>; 2] {
        self.extent
    }

    /// Touches kept.
    pub fn touches(&self) -> usize {
        self.tree.len()
    }

    /// Learns that there is surface at a point, m, world. Returns false when that adds nothing.
    pub fn learn(&mut self, world: &Point3<f64>) -> bool {
        let p = self.sheet.world_from_sheet.inverse_transform_point(world);
        self.tree.insert(Touch { at: p.xy(), height: p.z })
    }

    /// The surface as the touches suggest it.
    pub fn surface(&self) -> TouchedSurface<'_> {
        self.tree.surface()
    }

    /// A believed canvas over the extent, `raise` (m) higher than believed: 0 to draw on it, more to keep clear of it.
    ///
    /// # Errors
    /// Those of meshes: an extent without area.
    pub fn believed(&self, raise: f64) -> Result<BelievedCanvas, MeshError> {
        let surface = self.surface();
        self.mesh(|p| surface.height(p) + raise)
    }

    /// A flat canvas at a height over the sheet, m: what is believed before anything is touched.
    ///
    /// # Errors
    /// Those of meshes: an extent without area.
    pub fn flat(&self, height: f64) -> Result<BelievedCanvas, MeshError> {
        self.mesh(|_| height)
    }

    fn mesh(&self, height: impl Fn(&Point2<f64>) -> f64) -> Result<BelievedCanvas, MeshError> {
        let [low, high] = self.extent;
        let squares = |length: f64| ((length / MESH_STEP).ceil() as usize).clamp(2, MOST_SQUARES);
        let (nx, ny) = (squares(high.x - low.x), squares(high.y - low.y));
        let place = |k: usize| {
            let (i, j) = (k % (nx + 1), k / (nx + 1));
            let share = |i: usize, n: usize| i as f64 / n as f64;
            Point2::new(low.x + (high.x - low.x) * share(i, nx), low.y + (high.y - low.y) * share(j, ny))
        };
        let count = (nx + 1) * (ny + 1);
        let mut heights: Vec<f64> = (0..count).map(|k| height(&place(k))).collect();
        for _ in 0..SMOOTHING {
            smooth(&mut heights, nx + 1, 1);
            smooth(&mut heights, nx + 1, nx + 1);
        }
        let world = |k: usize| self.sheet.world_from_sheet * Point3::new(place(k).x, place(k).y, heights[k]);
        let vertices = (0..count).map(world).collect();
        let mut triangles = Vec::with_capacity(2 * nx * ny);
        for j in 0..ny {
            for i in 0..nx {
                let a = (j * (nx + 1) + i) as u32;
                let (b, d) = (a + 1, a + nx as u32 + 1);
                // diagonals alternate, so that normals lean to no side
                let pair = if (i + j) % 2 == 0 { [[a, b, d + 1], [a, d + 1, d]] } else { [[a, b, d], [b, d + 1, d]] };
                triangles.extend(pair);
            }
        }
        let mesh = TriMesh::new(vertices, triangles)?;
        Ok(BelievedCanvas(Canvas { name: self.name.clone(), mesh, sheet: self.sheet.clone() }))
    }
}

/// (1, 2, 1)/4 over neighbours `stride` apart in rows of `width`; ends keep the line through their neighbours, so that planes
/// stay planes.
fn smooth(heights: &mut [f64], width: usize, stride: usize) {
    let before = heights.to_vec();
    for (k, h) in heights.iter_mut().enumerate() {
        let inner = if stride == 1 {
            k % width != 0 && k % width + 1 != width
        } else {
            k >= stride && k + stride < before.len()
        };
        if inner {
            *h = 0.25 * (before[k - stride] + before[k + stride]) + 0.5 * before[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use nalgebra::{Vector2, Vector3};

    fn canvas() -> TouchedCanvas {
        let world_from_sheet = Pose::new(Vector3::new(0.6, 0.1, 0.5), Vector3::new(0.3, -1.2, 0.4));
        let half = Vector2::new(0.08, 0.12);
        TouchedCanvas::new(SheetFrame { world_from_sheet }, [Point2::from(-half), Point2::from(half)], 1e-3)
    }

    #[test]
    fn a_bucket_is_learned_from_touches_and_its_normals_are_smooth() {
        let mut canvas = canvas();
        let wall = |p: &Point2<f64>| {
            let r = 0.13 + 0.1 * p.y;
            (r * r - p.x * p.x).sqrt() - 0.18
        };
        let pose = canvas.sheet().world_from_sheet;
        for k in 0..2000 {
            let p = Point2::new(0.07 * (0.07 * f64::from(k)).sin(), 0.11 * (0.031 * f64::from(k)).cos());
            canvas.learn(&(pose * Point3::new(p.x, p.y, wall(&p))));
        }
        let believed = canvas.believed(0.0).unwrap();
        let outward = pose.rotation * Vector3::z();
        for k in 0..200 {
            let p = Point2::new(0.06 * (0.7 * f64::from(k)).sin(), 0.1 * (0.31 * f64::from(k)).cos());
            let hit = believed.mesh.cast_ray(&(pose * Point3::new(p.x, p.y, 0.2)), &-outward, 1.0).unwrap();
            let height = pose.inverse_transform_point(&hit.position).z;
            assert!((height - wall(&p)).abs() < 3e-4, "{} at {p}", height - wall(&p));
            let local = pose.rotation.inverse() * hit.normal;
            let slope = |h: Vector2<f64>| (wall(&(p + h)) - wall(&(p - h))) / (2.0 * h.norm());
            let wanted =
                Vector3::new(-slope(Vector2::new(1e-5, 0.0)), -slope(Vector2::new(0.0, 1e-5)), 1.0).normalize();
            assert!(local.angle(&wanted) < 0.03, "{} rad at {p}", local.angle(&wanted));
        }
    }

    #[test]
    fn an_untouched_canvas_is_as_flat_as_it_is_told_to_be() {
        let canvas = canvas();
        let pose = canvas.sheet().world_from_sheet;
        let flat = canvas.flat(-0.03).unwrap();
        assert!(flat.mesh.vertices().iter().all(|v| (pose.inverse_transform_point(v).z + 0.03).abs() < 1e-12));
        assert_eq!(canvas.touches(), 0);
    }
}
