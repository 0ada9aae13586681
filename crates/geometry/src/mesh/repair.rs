//! Making a manifold of the triangles that a scan or a modelling program left.
use std::collections::{HashMap, HashSet};

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::topology::{Gluing, NONE, next, start};
use super::triangle::Triangle;

/// What had to be mended before a surface could be flattened.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Repairs {
    /// Triangles without area, left out.
    pub empty_triangles: usize,
    /// Triangles that were there twice, left out.
    pub double_triangles: usize,
    /// Edges at which more than two triangles met, parted.
    pub crowded_edges: usize,
    /// Vertices at which parts of the surface touched only in a point (or along parted edges), split.
    pub split_vertices: usize,
    /// Triangles that faced the other way, turned over.
    pub flipped_triangles: usize,
    /// Edges cut because no way of turning the triangles made both sides face alike.
    pub one_sided_edges: usize,
    /// Parts of the surface that don't hang together with the one under the drawing, left out.
    pub parts: usize,
    /// Triangles of those.
    pub part_triangles: usize,
    /// Widths of the holes that were bridged so that the drawing may cross them, m.
    pub bridged_holes: Vec<f64>,
    /// Widths of the holes that stay holes for the drawing, m.
    pub open_holes: Vec<f64>,
    /// Handles (as on a cup) that were cut open.
    pub handles: usize,
    /// Length of the seam that was cut, m; 0 for none.
    pub seam: f64,
    /// Flat triangles that came out turned over, and were smoothed out.
    pub mended_flips: usize,
}

impl Repairs {
    /// One sentence a repair, for a person; none when nothing was mended.
    pub fn sentences(&self) -> Vec<String> {
        let mut said = Vec::new();
        let mut say = |count: usize, one: &str, many: &str| match count {
            0 => {}
            1 => said.push(format!("1 {one}")),
            n => said.push(format!("{n} {many}")),
        };
        say(self.empty_triangles, "triangle without area left out", "triangles without area left out");
        say(self.double_triangles, "triangle was there twice", "triangles were there twice");
        say(self.crowded_edges, "edge of more than two triangles parted", "edges of more than two triangles parted");
        say(self.split_vertices, "vertex split where parts only touched", "vertices split where parts only touched");
        say(self.flipped_triangles, "triangle faced the other way: turned", "triangles faced the other way: turned");
        say(self.one_sided_edges, "edge of a one-sided band cut", "edges of a one-sided band cut");
        if self.parts > 0 {
            said.push(format!(
                "{} loose part{} of {} triangles left out",
                self.parts,
                if self.parts == 1 { "" } else { "s" },
                self.part_triangles
            ));
        }
        let widest = |holes: &[f64]| 1e3 * holes.iter().fold(0.0, |most: f64, w| most.max(*w));
        let mut holes = |holes: &[f64], what: &str| match holes.len() {
            0 => {}
            1 => said.push(format!("1 hole of {:.1} mm {what}", widest(holes))),
            n => said.push(format!("{n} holes of up to {:.1} mm {what}", widest(holes))),
        };
        holes(&self.bridged_holes, "bridged: the drawing may cross");
        holes(&self.open_holes, "left open: the drawing can't cross");
        if self.handles > 0 {
            said.push(format!("{} handle{} cut open", self.handles, if self.handles == 1 { "" } else { "s" }));
        }
        if self.seam > 0.0 {
            said.push(format!("a seam of {:.0} mm cut", 1e3 * self.seam));
        }
        if self.mended_flips > 0 {
            said.push(format!("{} triangles turned over in the plane: smoothed out", self.mended_flips));
        }
        said
    }
}

/// The mesh with one vertex for each place: vertices of the same coordinates become one, and unused ones go.
pub(super) fn weld(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let mut places: HashMap<[u64; 3], u32> = HashMap::new();
    let mut number = vec![NONE; vertices.len()];
    let mut welded = Vec::new();
    let triangles = triangles.iter().map(|t| {
        t.map(|i| {
            let slot = &mut number[i as usize];
            if *slot == NONE {
                let p = vertices[i as usize];
                // adding 0 makes -0 the same as 0
                let key = [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
                *slot = *places.entry(key).or_insert_with(|| {
                    welded.push(p);
                    welded.len() as u32 - 1
                });
            }
            *slot
        })
    });
    let triangles = triangles.collect();
    (welded, triangles)
}

/// Leaves out triangles without area and copies of triangles.
pub(super) fn drop_bad(vertices: &[Point3<f64>], triangles: &mut Vec<[u32; 3]>, repairs: &mut Repairs) {
    let before = triangles.len();
    triangles.retain(|t| Triangle::of(vertices, t).unit_normal().is_some());
    repairs.empty_triangles += before - triangles.len();
    let before = triangles.len();
    let mut seen = HashSet::with_capacity(before);
    triangles.retain(|t| {
        let mut corners = *t;
        corners.sort_unstable();
        seen.insert(corners)
    });
    repairs.double_triangles += before - triangles.len();
}

/// A surface that is being mended.
pub(super) struct Sheet {
    pub vertices: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
    pub gluing: Gluing,
}

impl Sheet {
    /// Glues the triangles, winds them alike, parts what only touches, and keeps the part that comes nearest to `anchor`,
    /// facing along `outward` there. `None` when there are no triangles.
    pub fn new(
        (vertices, mut triangles): (Vec<Point3<f64>>, Vec<[u32; 3]>),
        anchor: &Point3<f64>,
        outward: &Vector3<f64>,
        repairs: &mut Repairs,
    ) -> Option<Self> {
        drop_bad(&vertices, &mut triangles, repairs);
        if triangles.is_empty() {
            return None;
        }
        let mut gluing = Gluing::new(&vertices, &triangles);
        let (component, components) = gluing.components();
        let nearest = nearest_triangle(&vertices, &triangles, anchor);
        let chosen = component[nearest];
        // only what is kept counts as mended
        let kept: Vec<[u32; 3]> =
            triangles.iter().zip(&component).filter(|(_, c)| **c == chosen).map(|(t, _)| *t).collect();
        let anchor_triangle = component[..nearest].iter().filter(|c| **c == chosen).count();
        // the far side of a canvas is no loose part: only what faces the artist is told
        let mut faces = vec![0; components];
        for (t, &c) in triangles.iter().zip(&component) {
            if c != chosen && Triangle::of(&vertices, t).area_vector().dot(outward) > 0.0 {
                faces[c as usize] += 1;
            }
        }
        repairs.parts += faces.iter().filter(|n| **n > 0).count();
        repairs.part_triangles += faces.iter().sum::<usize>();
        if components > 1 {
            gluing = Gluing::new(&vertices, &kept);
        }
        repairs.crowded_edges += gluing.crowded_edges;
        let mut sheet = Self { vertices, triangles: kept, gluing };
        sheet.wind_alike(anchor_triangle, outward, repairs);
        sheet.split(repairs);
        Some(sheet)
    }

    /// Turns triangles over until neighbours agree with the one at the anchor.
    fn wind_alike(&mut self, anchor: usize, outward: &Vector3<f64>, repairs: &mut Repairs) {
        let count = self.triangles.len();
        let mut turn: Vec<Option<bool>> = vec![None; count];
        let normal = Triangle::of(&self.vertices, &self.triangles[anchor]).area_vector();
        turn[anchor] = Some(normal.dot(outward) < 0.0);
        let mut cut = 0;
        let mut queue = std::collections::VecDeque::from([anchor]);
        while let Some(t) = queue.pop_front() {
            let turned = turn[t].unwrap_or(false);
            for h in 3 * t as u32..3 * t as u32 + 3 {
                let o = self.gluing.opposite[h as usize];
                if o == NONE {
                    continue;
                }
                let same_way = start(&self.triangles, h) == start(&self.triangles, o);
                let other = o as usize / 3;
                match turn[other] {
                    None => {
                        turn[other] = Some(turned ^ same_way);
                        queue.push_back(other);
                    }
                    Some(is) if is != turned ^ same_way => {
                        self.gluing.opposite[h as usize] = NONE;
                        self.gluing.opposite[o as usize] = NONE;
                        cut += 1;
                    }
                    Some(_) => {}
                }
            }
        }
        repairs.one_sided_edges += cut;
        let flipped = turn.iter().filter(|t| **t == Some(true)).count();
        repairs.flipped_triangles += flipped;
        if flipped == 0 {
            return;
        }
        // corners 1 and 2 change places: half-edges 0, 1, 2 become 2, 1, 0
        let moved = |h: u32| match turn[h as usize / 3] {
            Some(true) => h - h % 3 + (2 - h % 3),
            _ => h,
        };
        let old = self.gluing.opposite.clone();
        for (h, &o) in old.iter().enumerate() {
            self.gluing.opposite[moved(h as u32) as usize] = if o == NONE { NONE } else { moved(o) };
        }
        for (t, turn) in self.triangles.iter_mut().zip(&turn) {
            if *turn == Some(true) {
                t.swap(1, 2);
            }
        }
    }

    /// Gives each fan of triangles a vertex of its own, and drops the vertices that nothing uses.
    pub fn split(&mut self, repairs: &mut Repairs) {
        let used: HashSet<u32> = self.triangles.iter().flatten().copied().collect();
        let fans = self.renumber();
        repairs.split_vertices += fans.saturating_sub(used.len());
    }

    /// As [`Sheet::split`]; returns the number of vertices.
    pub fn renumber(&mut self) -> usize {
        let (fans, count) = self.gluing.fans(&self.triangles);
        let mut vertices = vec![Point3::origin(); count];
        for (corner, fan) in fans.iter().enumerate() {
            let slot = &mut self.triangles[corner / 3][corner % 3];
            vertices[*fan as usize] = self.vertices[*slot as usize];
            *slot = *fan;
        }
        self.vertices = vertices;
        count
    }

    /// Closes a hole, a boundary loop, with a fan of triangles round a new vertex; returns the number of triangles.
    pub fn fill(&mut self, hole: &[u32]) -> usize {
        let rim: Vec<u32> = hole.iter().map(|&h| start(&self.triangles, h)).collect();
        let at = |i: u32| self.vertices[i as usize];
        let n = rim.len() as u32;
        let mut center = Point3::from(rim.iter().map(|&i| at(i).coords).sum::<Vector3<f64>>() / f64::from(n));
        // a crack without width can't be closed in its own line: the new vertex is lifted out of it
        let round: f64 = (0..rim.len()).map(|i| (at(rim[(i + 1) % rim.len()]) - at(rim[i])).norm()).sum();
        let flat = |center: &Point3<f64>| {
            (0..rim.len()).any(|i| {
                let (a, b) = (at(rim[i]), at(rim[(i + 1) % rim.len()]));
                let longest = (b - a).norm().max((center - a).norm()).max((center - b).norm());
                (b - a).cross(&(center - a)).norm() < 1e-3 * longest * longest
            })
        };
        if flat(&center) {
            let normal: Vector3<f64> = hole
                .iter()
                .filter_map(|&h| Triangle::of(&self.vertices, &self.triangles[h as usize / 3]).unit_normal())
                .sum();
            center += normal.try_normalize(1e-9).unwrap_or_else(Vector3::z) * (0.02 * round);
        }
        let apex = self.vertices.len() as u32;
        self.vertices.push(center);
        let first = 3 * self.triangles.len() as u32;
        for (i, &h) in hole.iter().enumerate() {
            // the hole's triangle runs against the half-edge of the rim
            let (a, b) = (rim[i], start(&self.triangles, next(h)));
            self.triangles.push([b, a, apex]);
            let base = first + 3 * i as u32;
            let (before, after) = ((i as u32 + n - 1) % n, (i as u32 + 1) % n);
            self.gluing.opposite[h as usize] = base;
            // a -> apex meets the triangle before it, apex -> b the one after
            self.gluing.opposite.extend([h, first + 3 * before + 2, first + 3 * after + 1]);
        }
        hole.len()
    }
}

/// The triangle whose nearest point is nearest to `p`.
pub(super) fn nearest_triangle(vertices: &[Point3<f64>], triangles: &[[u32; 3]], p: &Point3<f64>) -> usize {
    let distance = |t: &[u32; 3]| Triangle::of(vertices, t).closest(p).1;
    let mut best = (f64::INFINITY, 0);
    for (i, t) in triangles.iter().enumerate() {
        let d = distance(t);
        if d < best.0 {
            best = (d, i);
        }
    }
    best.1
}
