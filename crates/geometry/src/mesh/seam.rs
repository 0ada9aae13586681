//! Cutting a surface open until it is a disc.
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::repair::Sheet;
use super::topology::{NONE, next, start};
use super::triangle::Triangle;

/// The seam of a closed surface stays farther from the anchor than this share of the way to its farthest vertex.
const SEAM_REACH: f64 = 0.6;

#[derive(PartialEq)]
struct Reached {
    distance: f64,
    triangle: u32,
    by: u32,
}

impl Eq for Reached {}
impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        // nearest first; ties by number, so that the order never depends on the heap
        other.distance.total_cmp(&self.distance).then(other.by.cmp(&self.by))
    }
}
impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Cuts the surface open along a seam that stays as far as it can from the triangle `anchor`, until it is a disc; returns
/// the length of the seam, m.
///
/// Triangles are reached from the anchor by shortest ways; the edges that no way crosses are the cut locus of the anchor,
/// and hold everything that makes the surface other than a disc (tree and cotree, D. Eppstein, Dynamic generators of
/// topologically embedded graphs, SODA 2003). Its dead ends are trimmed off. On a surface without boundary and handles
/// that is all of it: there the longest path among the places that are far from the anchor stays.
pub(super) fn cut_to_disc(sheet: &mut Sheet, anchor: usize) -> f64 {
    let (edges, distance) = cut_locus(sheet, anchor);
    let vertices = sheet.vertices.len();
    let ends = |h: u32| (start(&sheet.triangles, h) as usize, start(&sheet.triangles, next(h)) as usize);
    let length = |h: u32| {
        let (a, b) = ends(h);
        (sheet.vertices[b] - sheet.vertices[a]).norm()
    };
    let mut rim = vec![false; vertices];
    for (h, &o) in sheet.gluing.opposite.iter().enumerate() {
        if o == NONE {
            let (a, b) = ends(h as u32);
            rim[a] = true;
            rim[b] = true;
        }
    }
    let mut at: Vec<Vec<u32>> = vec![Vec::new(); vertices];
    for (i, &h) in edges.iter().enumerate() {
        let (a, b) = ends(h);
        at[a].push(i as u32);
        at[b].push(i as u32);
    }
    // trim the dead ends
    let mut kept = vec![true; edges.len()];
    let mut degree: Vec<usize> = at.iter().map(Vec::len).collect();
    let mut dead: Vec<usize> = (0..vertices).filter(|&v| degree[v] == 1 && !rim[v]).collect();
    while let Some(v) = dead.pop() {
        let Some(&edge) = at[v].iter().find(|&&e| kept[e as usize]) else { continue };
        kept[edge as usize] = false;
        let (a, b) = ends(edges[edge as usize]);
        let other = if a == v { b } else { a };
        degree[v] -= 1;
        degree[other] -= 1;
        if degree[other] == 1 && !rim[other] {
            dead.push(other);
        }
    }
    let mut seam: Vec<u32> = edges.iter().zip(&kept).filter(|(_, k)| **k).map(|(h, _)| *h).collect();
    if seam.is_empty() && !rim.contains(&true) {
        // the longest way through the tree round the farthest vertex: from any to the farthest, and from that again
        let farthest = (0..vertices).max_by(|&a, &b| distance[a].total_cmp(&distance[b])).unwrap_or(0);
        let limit = SEAM_REACH * distance[farthest];
        let far = |from: usize| {
            let mut way: Vec<Option<(f64, u32)>> = vec![None; vertices];
            way[from] = Some((0.0, NONE));
            let mut stack = vec![from];
            let mut farthest = (0.0, from);
            while let Some(v) = stack.pop() {
                let reached = way[v].map_or(0.0, |w| w.0);
                if reached > farthest.0 {
                    farthest = (reached, v);
                }
                for &e in &at[v] {
                    let (a, b) = ends(edges[e as usize]);
                    let other = if a == v { b } else { a };
                    if way[other].is_none() && distance[other] >= limit {
                        way[other] = Some((reached + length(edges[e as usize]), e));
                        stack.push(other);
                    }
                }
            }
            (farthest.1, way)
        };
        let (one, _) = far(farthest);
        let (mut v, way) = far(one);
        while let Some((_, e)) = way[v] {
            if e == NONE {
                break;
            }
            seam.push(edges[e as usize]);
            let (a, b) = ends(edges[e as usize]);
            v = if a == v { b } else { a };
        }
    }
    let total = seam.iter().map(|h| length(*h)).sum();
    for h in seam {
        let o = sheet.gluing.opposite[h as usize];
        sheet.gluing.opposite[h as usize] = NONE;
        sheet.gluing.opposite[o as usize] = NONE;
    }
    sheet.renumber();
    total
}

/// One half-edge of each glued edge that no shortest way from the anchor crosses; and about how far each vertex is from it, m.
fn cut_locus(sheet: &Sheet, anchor: usize) -> (Vec<u32>, Vec<f64>) {
    let count = sheet.triangles.len();
    let centers: Vec<_> = sheet.triangles.iter().map(|t| Triangle::of(&sheet.vertices, t).at([1.0 / 3.0; 3])).collect();
    let mut reached = vec![false; count];
    let mut crossed = vec![false; 3 * count];
    let mut far = vec![f64::INFINITY; sheet.vertices.len()];
    let mut heap = BinaryHeap::from([Reached { distance: 0.0, triangle: anchor as u32, by: NONE }]);
    while let Some(Reached { distance, triangle, by }) = heap.pop() {
        let t = triangle as usize;
        if reached[t] {
            continue;
        }
        reached[t] = true;
        for i in sheet.triangles[t] {
            far[i as usize] = far[i as usize].min(distance);
        }
        if by != NONE {
            crossed[by as usize] = true;
            crossed[sheet.gluing.opposite[by as usize] as usize] = true;
        }
        for h in 3 * triangle..3 * triangle + 3 {
            let o = sheet.gluing.opposite[h as usize];
            if o != NONE && !reached[o as usize / 3] {
                let step = (centers[o as usize / 3] - centers[t]).norm();
                heap.push(Reached { distance: distance + step, triangle: o / 3, by: h });
            }
        }
    }
    let uncrossed = (0..3 * count as u32)
        .filter(|&h| {
            let o = sheet.gluing.opposite[h as usize];
            o != NONE && h < o && !crossed[h as usize]
        })
        .collect();
    (uncrossed, far)
}
