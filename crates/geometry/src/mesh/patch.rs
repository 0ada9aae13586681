//! The part of a surface that is flattened: cut out, mended, and opened until it is a disc.
use nalgebra::{Point2, Point3, Vector3};

use super::clip::clip;
use super::grown::grown;
use super::repair::{Repairs, Sheet, nearest_triangle, weld};
use super::seam::cut_to_disc;
use super::topology::{NONE, next, start};
use super::triangle::Triangle;
use super::{SurfacePoint, TriMesh, crease};
use crate::math::Pose;

/// Cosine of the largest angle between the surface's smooth normal and the artist's direction, 85 degrees.
const TURNED_AWAY: f64 = 0.087_155_742_747_658_17;
/// A surface flattened whole keeps boundaries that are at least this long, m; shorter ones are holes.
const BOUNDARY: f64 = 0.15;
/// The least number of triangles that can be told from a speck.
const FEWEST: usize = 2;

/// How much of a surface is flattened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// What lies in the prism over a rectangle of the sheet, half as wide and half as high as given (m), faces the artist
    /// (by at most 85 degrees), and hangs together with the point under the sheet's centre. Cut exactly.
    Prism([f64; 2]),
    /// What is at most this far from that point along the surface (m, measured along edges), whichever way it faces, with all that it
    /// surrounds: for surfaces that overhang, which a prism tears.
    Along(f64),
    /// All that hangs together with that point. What isn't a disc is cut open along a seam far from it.
    Whole,
}

/// Why no patch can be cut out.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PatchError {
    /// There is nothing to flatten.
    #[error("there is no surface under the sheet's centre that faces the artist")]
    NoSurface,
    /// Fewer triangles than can be flattened.
    #[error("the surface under the drawing has only {triangles} triangles: there is nothing to flatten")]
    Speck {
        /// How many.
        triangles: usize,
    },
    /// It can't be cut open to a disc.
    #[error(
        "the surface under the drawing can't be made a disc (Euler characteristic {euler}, {loops} boundaries, after every repair)"
    )]
    NotDisc {
        /// Its Euler characteristic; 1 for a disc.
        euler: i64,
        /// Its boundary loops; 1 for a disc.
        loops: usize,
    },
}

/// A piece of surface without holes, handles, or edges of more than two triangles: topologically a disc.
#[derive(Clone)]
pub struct Patch {
    /// Its surface with smooth and creased normals, for queries. The triangles are those of `triangles`, in order.
    pub mesh: TriMesh,
    /// Vertices, one for each place of the disc (two along a seam), m.
    pub vertices: Vec<Point3<f64>>,
    /// Triangles over `vertices`, wound counter-clockwise as the artist sees them.
    pub triangles: Vec<[u32; 3]>,
    /// The vertices of its boundary, the surface at the left.
    pub boundary: Vec<u32>,
    /// The place of each vertex in `boundary`, or the largest number.
    rim: Vec<u32>,
    /// Whether a triangle fills a hole that the drawing can't cross.
    pub open: Vec<bool>,
    /// The point under the sheet's centre.
    pub anchor: SurfacePoint,
    /// What was mended.
    pub repairs: Repairs,
}

impl Patch {
    /// Cuts a patch out of `mesh` (world frame) round the point that the artist, looking along -z of the sheet, sees at its
    /// centre. Holes up to `bridge` (m) wide are bridged; wider ones are filled for the flattening, but stay open.
    ///
    /// # Errors
    /// See [`PatchError`].
    pub fn cut(mesh: &TriMesh, world_from_sheet: &Pose, extent: Extent, bridge: f64) -> Result<Self, PatchError> {
        let sheet_from_world = world_from_sheet.inverse();
        let outward = world_from_sheet * Vector3::z();
        let anchor = seen_from(mesh, world_from_sheet).ok_or(PatchError::NoSurface)?;
        let mut repairs = Repairs::default();
        let soup = match extent {
            Extent::Whole => weld(mesh.vertices(), mesh.triangles()),
            Extent::Along(radius) => grown(mesh.vertices(), mesh.triangles(), &anchor, radius),
            Extent::Prism(half) => prism(mesh, &sheet_from_world, half),
        };
        let mut sheet = Sheet::new(soup, &anchor, &outward, &mut repairs).ok_or(PatchError::NoSurface)?;
        if let Extent::Prism(_) = extent {
            sheet = facing(sheet, &anchor, &outward, &mut repairs).ok_or(PatchError::NoSurface)?;
        }
        if sheet.triangles.len() < FEWEST {
            return Err(PatchError::Speck { triangles: sheet.triangles.len() });
        }
        let mut open = vec![false; sheet.triangles.len()];
        fill_holes(&mut sheet, extent, bridge, &mut open, &mut repairs);
        let at = nearest_triangle(&sheet.vertices, &sheet.triangles, &anchor);
        let euler = |sheet: &Sheet| sheet.gluing.euler(sheet.gluing.fans(&sheet.triangles).1);
        if euler(&sheet) != 1 {
            let loops = sheet.gluing.loops().len() as i64;
            repairs.handles = usize::try_from((2 - loops - euler(&sheet)) / 2).unwrap_or(0);
            repairs.seam = cut_to_disc(&mut sheet, at);
        }
        let loops = sheet.gluing.loops();
        if euler(&sheet) != 1 || loops.len() != 1 {
            return Err(PatchError::NotDisc { euler: euler(&sheet), loops: loops.len() });
        }
        let boundary: Vec<u32> = loops[0].iter().map(|&h| start(&sheet.triangles, h)).collect();
        let mut rim = vec![NONE; sheet.vertices.len()];
        for (place, &vertex) in boundary.iter().enumerate() {
            rim[vertex as usize] = place as u32;
        }
        let Sheet { vertices, triangles, .. } = sheet;
        let count = triangles.len();
        let mesh = TriMesh::new(vertices.clone(), triangles.clone()).map_err(|_| PatchError::NoSurface)?;
        if mesh.triangles().len() != count {
            // every triangle was seen to have an area, so this is a bug and not a user's mistake; better refused than wrong
            return Err(PatchError::Speck { triangles: mesh.triangles().len() });
        }
        let (barycentric, _) = Triangle::of(&vertices, &triangles[at]).closest(&anchor);
        let anchor = mesh.point_at(at as u32, barycentric);
        Ok(Self { mesh, vertices, triangles, boundary, rim, open, anchor, repairs })
    }

    /// Whether two vertices follow one another on the boundary.
    pub(super) fn is_boundary_edge(&self, i: u32, j: u32) -> bool {
        let (a, b) = (self.rim[i as usize], self.rim[j as usize]);
        let n = self.boundary.len() as u32;
        a != NONE && b != NONE && ((a + 1) % n == b || (b + 1) % n == a)
    }

    /// Length of the boundary edge from `boundary[i]` to the next, m.
    pub(super) fn boundary_length(&self, i: usize) -> f64 {
        let (a, b) = (self.boundary[i], self.boundary[(i + 1) % self.boundary.len()]);
        (self.vertices[b as usize] - self.vertices[a as usize]).norm()
    }

    /// The triangle in a plane of its own, its first corner at 0 and its first edge along x, m.
    pub(super) fn flat_triangle(&self, triangle: usize) -> [Point2<f64>; 3] {
        let Triangle { a, b, c } = Triangle::of(&self.vertices, &self.triangles[triangle]);
        let (u, v) = (b - a, c - a);
        let length = u.norm();
        [Point2::origin(), Point2::new(length, 0.0), Point2::new(u.dot(&v) / length, u.cross(&v).norm() / length)]
    }
}

/// What the artist sees at the sheet's centre.
fn seen_from(mesh: &TriMesh, world_from_sheet: &Pose) -> Option<Point3<f64>> {
    let outward = world_from_sheet * Vector3::z();
    let (low, high) = mesh.bounds();
    let half = (high - low).norm() / 2.0 + 1e-3;
    let height = (nalgebra::center(&low, &high) - world_from_sheet * Point3::origin()).dot(&outward) + half;
    let origin = world_from_sheet * Point3::new(0.0, 0.0, height);
    Some(mesh.cast_ray(&origin, &-outward, 2.0 * half)?.position)
}

/// The part of a mesh in the prism over the rectangle of half sides `half` (m), welded.
fn prism(mesh: &TriMesh, sheet_from_world: &Pose, half: [f64; 2]) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let flat: Vec<Point2<f64>> = mesh.vertices().iter().map(|p| (sheet_from_world * p).xy()).collect();
    let near = |t: &&[u32; 3]| {
        (0..2).all(|axis| {
            let x = t.map(|i| flat[i as usize][axis]);
            x.iter().any(|x| *x > -half[axis]) && x.iter().any(|x| *x < half[axis])
        })
    };
    let chosen: Vec<[u32; 3]> = mesh.triangles().iter().filter(near).copied().collect();
    let (mut vertices, mut triangles) = weld(mesh.vertices(), &chosen);
    for (axis, edge) in half.iter().enumerate().take(2) {
        for sign in [1.0, -1.0] {
            triangles = clip(&mut vertices, &triangles, |_, p| edge - sign * (sheet_from_world * p)[axis]);
        }
    }
    weld(&vertices, &triangles)
}

/// The part whose smooth normals are not turned away from the artist.
fn facing(sheet: Sheet, anchor: &Point3<f64>, outward: &Vector3<f64>, repairs: &mut Repairs) -> Option<Sheet> {
    let normal = |t: &[u32; 3]| Triangle::of(&sheet.vertices, t).unit_normal().unwrap_or(*outward);
    let normals: Vec<Vector3<f64>> = sheet.triangles.iter().map(normal).collect();
    let split = crease::split(&sheet.vertices, &sheet.triangles, &normals);
    let turned = |n: &Vector3<f64>| n.dot(outward) < TURNED_AWAY;
    if !split.normals.iter().any(turned) {
        return Some(sheet);
    }
    let mut vertices = split.vertices;
    let triangles = clip(&mut vertices, &split.triangles, |i, _| split.normals[i].dot(outward) - TURNED_AWAY);
    // what goes here is the far side and the edges, no repair
    let (parts, part_triangles) = (repairs.parts, repairs.part_triangles);
    let sheet = Sheet::new(weld(&vertices, &triangles), anchor, outward, repairs);
    (repairs.parts, repairs.part_triangles) = (parts, part_triangles);
    sheet
}

/// Fills every boundary but the outer one; of a surface taken whole, only short ones.
fn fill_holes(sheet: &mut Sheet, extent: Extent, bridge: f64, open: &mut Vec<bool>, repairs: &mut Repairs) {
    let loops = sheet.gluing.loops();
    let length = |edges: &Vec<u32>| -> f64 {
        let at = |h: u32| sheet.vertices[start(&sheet.triangles, h) as usize];
        edges.iter().map(|&h| (at(next(h)) - at(h)).norm()).sum()
    };
    let lengths: Vec<f64> = loops.iter().map(length).collect();
    let longest = lengths.iter().fold(0.0, |most: f64, l| most.max(*l));
    let mut outer_seen = false;
    for (hole, length) in loops.iter().zip(&lengths) {
        let outer = match extent {
            Extent::Whole => *length == longest || *length >= BOUNDARY,
            Extent::Prism(_) | Extent::Along(_) => *length == longest && !std::mem::replace(&mut outer_seen, true),
        };
        if outer {
            continue;
        }
        let width = width(hole.iter().map(|&h| sheet.vertices[start(&sheet.triangles, h) as usize]));
        let bridged = width <= bridge;
        if bridged { &mut repairs.bridged_holes } else { &mut repairs.open_holes }.push(width);
        let filled = sheet.fill(hole);
        open.extend(std::iter::repeat_n(!bridged, filled));
    }
}

/// Diagonal of the box round some points, m.
fn width(points: impl Iterator<Item = Point3<f64>>) -> f64 {
    let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let (low, high) = points.fold(start, |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)));
    (high - low).norm()
}
