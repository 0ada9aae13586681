//! A surface clad in boards: steps between neighbours, gaps, eased edges.
use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::{MeshError, TriMesh};
use crate::math::Pose;

/// How far one sees into a gap, m: the thickness of a board.
const THICKNESS: f64 = 0.03;
/// z of a unit normal from which on a triangle belongs to the clad face; steps that stand upright belong to it too.
const CLAD: f64 = -0.02;
/// z of a unit normal from which on an edge of a board gets an upright face.
const FRONT: f64 = 0.05;

/// Boards side by side along x of the sheet, each as long as the face in y. Metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Boards {
    /// Where the first board begins, x.
    pub start: f64,
    /// From the beginning of a board to that of the next, above 0.
    pub width: f64,
    /// Between two boards, 0 or more.
    pub gap: f64,
    /// Width and depth of the eased (45 degrees) edge along both sides of a board, 0 or more.
    pub bevel: f64,
    /// How far each board stands out.
    pub offsets: Vec<f64>,
}

impl Boards {
    /// Board `i` from its left to its right edge.
    fn span(&self, i: usize) -> [f64; 2] {
        let left = self.start + i as f64 * self.width;
        [left + self.gap / 2.0, left + self.width - self.gap / 2.0]
    }

    /// Width of the eased edges: no more than a third of a board each.
    fn eased(&self) -> f64 {
        self.bevel.clamp(0.0, (self.width - self.gap) / 3.0)
    }

    /// How far board `i` stands out at x.
    fn height(&self, i: usize, x: f64) -> f64 {
        let ([left, right], bevel) = (self.span(i), self.eased());
        self.offsets[i] - (bevel - (x - left)).max(bevel - (right - x)).max(0.0)
    }

    /// How deep the upright face at the edge of board `i` towards board `j` is.
    fn drop(&self, i: usize, j: Option<usize>) -> f64 {
        match j {
            Some(j) if self.gap <= 0.0 => (self.offsets[i] - self.offsets[j]).max(0.0),
            _ => THICKNESS,
        }
    }
}

/// A point of the clad mesh before it is moved: a vertex, or where an edge (lower vertex first) crosses a line of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Vertex(u32),
    Cut(u32, u32, usize),
}

/// Cuts what faces z of the sheet (`sheet_from_mesh`) into boards along x, or along y when `across`, and moves each board along z;
/// upright faces close the steps. What faces away stays as it is, so the result is no closed surface. Boards end where `offsets` do;
/// what lies beyond the first and the last belongs to them.
///
/// # Errors
/// Whatever a mesh can be refused for.
pub fn clad(mesh: &TriMesh, sheet_from_mesh: &Pose, across: bool, boards: &Boards) -> Result<TriMesh, MeshError> {
    if boards.offsets.is_empty() {
        return Ok(mesh.clone());
    }
    // (x, y, z) with x across the boards; a turn about z by -90 degrees keeps the handedness
    let turn = if across { Vector3::z() * -std::f64::consts::FRAC_PI_2 } else { Vector3::zeros() };
    let boards_from_mesh = Pose::rotation(turn) * sheet_from_mesh;
    let mut cladding = Cladding {
        points: mesh.vertices().iter().map(|v| boards_from_mesh * v).collect(),
        boards,
        lines: Vec::new(),
        places: BTreeMap::new(),
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    let normal_z = |n: &Vector3<f64>| (boards_from_mesh * n).z;
    for (t, n) in mesh.triangles().iter().zip(mesh.face_normals()) {
        let z = normal_z(n);
        if z >= CLAD { cladding.clad(t, z >= FRONT) } else { cladding.keep(t) }
    }
    let mesh_from_boards = boards_from_mesh.inverse();
    let vertices = cladding.vertices.iter().map(|v| mesh_from_boards * v).collect();
    TriMesh::new(vertices, cladding.triangles)
}

struct Cladding<'a> {
    points: Vec<Point3<f64>>,
    boards: &'a Boards,
    /// x of the lines along which triangles were cut.
    lines: Vec<f64>,
    /// New vertex of a place on a board (`None`: not clad).
    places: BTreeMap<(Place, Option<usize>), u32>,
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Cladding<'_> {
    fn keep(&mut self, triangle: &[u32; 3]) {
        let t = triangle.map(|v| self.vertex(Place::Vertex(v), None));
        self.triangles.push(t);
    }

    /// Cuts a triangle into its parts on each board.
    fn clad(&mut self, triangle: &[u32; 3], front: bool) {
        let count = self.boards.offsets.len();
        let x = triangle.map(|v| self.points[v as usize].x);
        let (low, high) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
        let board =
            |x: f64| ((x - self.boards.start) / self.boards.width).floor().clamp(0.0, (count - 1) as f64) as usize;
        // a gap is narrower than a board, so that neighbours are enough
        let (first, last) = (board(low).saturating_sub(1), (board(high) + 1).min(count - 1));
        for i in first..=last {
            let ([left, right], bevel) = (self.boards.span(i), self.boards.eased());
            let outer =
                [if i == 0 { f64::NEG_INFINITY } else { left }, if i + 1 == count { f64::INFINITY } else { right }];
            let mut lines = vec![outer[0]];
            if bevel > 0.0 {
                lines.extend([left + bevel, right - bevel].iter().filter(|l| l.is_finite()));
            }
            lines.push(outer[1]);
            for w in lines.windows(2) {
                if high > w[0] && low < w[1] {
                    self.part(triangle, i, [w[0], w[1]], outer, front);
                }
            }
        }
    }

    /// Adds the part of a triangle with x in `range`, moved with board `i`, and the upright face below where it ends at the board's edge.
    fn part(&mut self, triangle: &[u32; 3], i: usize, range: [f64; 2], outer: [f64; 2], front: bool) {
        let mut polygon: Vec<(Place, f64)> = Vec::with_capacity(6);
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            let (xa, xb) = (self.points[a as usize].x, self.points[b as usize].x);
            if (range[0]..=range[1]).contains(&xa) {
                polygon.push((Place::Vertex(a), xa));
            }
            let mut cuts = range;
            if xb < xa {
                cuts.reverse();
            }
            for x in cuts {
                if (xa < x && x < xb) || (xb < x && x < xa) {
                    let line = self.line(x);
                    polygon.push((Place::Cut(a.min(b), a.max(b), line), x));
                }
            }
        }
        if polygon.len() < 3 {
            return;
        }
        let corners: Vec<u32> = polygon.iter().map(|(place, _)| self.vertex(*place, Some(i))).collect();
        for k in 1..corners.len() - 1 {
            self.triangles.push([corners[0], corners[k], corners[k + 1]]);
        }
        if !front {
            return;
        }
        let count = self.boards.offsets.len();
        for k in 0..polygon.len() {
            let next = (k + 1) % polygon.len();
            let (x, other) = (polygon[k].1, polygon[next].1);
            let neighbour = if x != other {
                continue;
            } else if x == outer[0] {
                i.checked_sub(1)
            } else if x == outer[1] {
                Some(i + 1).filter(|j| *j < count)
            } else {
                continue;
            };
            let drop = Vector3::z() * self.boards.drop(i, neighbour);
            if drop.z > 0.0 {
                let (p, q) = (self.vertices[corners[k] as usize], self.vertices[corners[next] as usize]);
                let at = self.vertices.len() as u32;
                self.vertices.extend([p, p - drop, q - drop, q]);
                self.triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
            }
        }
    }

    fn line(&mut self, x: f64) -> usize {
        self.lines.iter().position(|l| *l == x).unwrap_or_else(|| {
            self.lines.push(x);
            self.lines.len() - 1
        })
    }

    fn vertex(&mut self, place: Place, board: Option<usize>) -> u32 {
        if let Some(v) = self.places.get(&(place, board)) {
            return *v;
        }
        let mut p = match place {
            Place::Vertex(v) => self.points[v as usize],
            Place::Cut(a, b, line) => {
                let (a, b, x) = (self.points[a as usize], self.points[b as usize], self.lines[line]);
                let p = a + (b - a) * ((x - a.x) / (b.x - a.x));
                Point3::new(x, p.y, p.z)
            }
        };
        if let Some(i) = board {
            p.z += self.boards.height(i, p.x);
        }
        let v = self.vertices.len() as u32;
        self.vertices.push(p);
        self.places.insert((place, board), v);
        v
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn wall() -> TriMesh {
        shapes::rectangle(0.4, 0.3, 0.0, 0.007).unwrap()
    }

    fn boards(gap: f64, bevel: f64) -> Boards {
        Boards { start: -0.2, width: 0.1, gap, bevel, offsets: vec![0.0, 0.004, -0.002, 0.003] }
    }

    fn height(mesh: &TriMesh, x: f64, y: f64) -> Option<f64> {
        mesh.cast_ray(&Point3::new(x, y, 1.0), &-Vector3::z(), 2.0).map(|s| s.position.z)
    }

    #[test]
    fn boards_stand_where_they_should_and_nothing_is_lost() {
        let clad = clad(&wall(), &Pose::identity(), false, &boards(0.0, 0.0)).unwrap();
        for (x, z) in [(-0.15, 0.0), (-0.101, 0.0), (-0.099, 0.004), (0.05, -0.002), (0.15, 0.003)] {
            assert!((height(&clad, x, 0.0123).unwrap() - z).abs() < 1e-12, "{x}");
        }
        // the face, and upright faces of 4, 6 and 5 mm
        assert!((clad.area() - (0.12 + 0.3 * 0.015)).abs() < 1e-9, "{}", clad.area());
        // an upright face looks at the lower board
        let hit = clad.cast_ray(&Point3::new(-0.15, 0.0, 0.002), &Vector3::x(), 1.0).unwrap();
        assert!((hit.position.x + 0.1).abs() < 1e-12 && (hit.face_normal + Vector3::x()).norm() < 1e-9);
        let hit = clad.cast_ray(&Point3::new(0.05, 0.0, 0.001), &-Vector3::x(), 1.0).unwrap();
        assert!(hit.position.x.abs() < 1e-12 && (hit.face_normal - Vector3::x()).norm() < 1e-9);
    }

    #[test]
    fn a_gap_has_no_surface_and_two_upright_faces() {
        let clad = clad(&wall(), &Pose::identity(), false, &boards(0.005, 0.0)).unwrap();
        assert_eq!(height(&clad, 0.0, 0.01), None);
        assert!(height(&clad, 0.003, 0.01).is_some() && height(&clad, -0.003, 0.01).is_some());
        let hit = clad.cast_ray(&Point3::new(0.0, 0.01, -0.01), &Vector3::x(), 1.0).unwrap();
        assert!((hit.position.x - 0.0025).abs() < 1e-12 && (hit.face_normal + Vector3::x()).norm() < 1e-9);
    }

    #[test]
    fn edges_are_eased_by_45_degrees() {
        let clad = clad(&wall(), &Pose::identity(), false, &boards(0.0, 0.002)).unwrap();
        assert!((height(&clad, -0.05, 0.0).unwrap() - 0.004).abs() < 1e-12);
        assert!((height(&clad, -0.099, 0.0).unwrap() - 0.003).abs() < 1e-9);
        assert!((height(&clad, -0.001, 0.0).unwrap() - 0.003).abs() < 1e-9);
    }

    #[test]
    fn across_and_along_add_up() {
        let along = clad(&wall(), &Pose::identity(), false, &boards(0.0, 0.0)).unwrap();
        let second = Boards { start: -0.15, width: 0.15, gap: 0.0, bevel: 0.0, offsets: vec![0.001, -0.001] };
        let both = clad(&along, &Pose::identity(), true, &second).unwrap();
        for (x, y, z) in [(-0.05, -0.1, 0.005), (-0.05, 0.1, 0.003), (0.05, -0.1, -0.001), (0.05, 0.1, -0.003)] {
            let is = height(&both, x, y).unwrap();
            assert!((is - z).abs() < 1e-9, "{x} {y}: {is}");
        }
    }
}
