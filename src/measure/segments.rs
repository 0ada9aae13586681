//! Line segments in a uniform grid: which one lies nearest to a point.
use std::collections::HashMap;

use nalgebra::Point3;

/// One segment with the label its owner gave it.
#[derive(Clone, Copy, Debug)]
struct Segment {
    a: Point3<f64>,
    b: Point3<f64>,
    label: u64,
}

/// Segments sorted into cubic cells.
#[derive(Debug)]
pub(crate) struct SegmentGrid {
    cell: f64,
    segments: Vec<Segment>,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl SegmentGrid {
    /// An empty grid with cells of edge `cell`, m.
    pub(crate) fn new(cell: f64) -> Self {
        Self { cell, segments: Vec::new(), cells: HashMap::new() }
    }

    fn key(&self, p: &Point3<f64>) -> [i64; 3] {
        [0, 1, 2].map(|i| (p[i] / self.cell).floor() as i64)
    }

    /// Adds the segment `a`-`b` under a label.
    pub(crate) fn insert(&mut self, a: Point3<f64>, b: Point3<f64>, label: u64) {
        let id = self.segments.len() as u32;
        let (low, high) = (self.key(&a.inf(&b)), self.key(&a.sup(&b)));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    self.cells.entry([x, y, z]).or_default().push(id);
                }
            }
        }
        self.segments.push(Segment { a, b, label });
    }

    /// Distance (m) of `p` from the nearest segment whose label `wanted` accepts, or `None` when none is within `reach`.
    pub(crate) fn distance(&self, p: &Point3<f64>, reach: f64, wanted: impl Fn(u64) -> bool) -> Option<f64> {
        self.nearest(p, reach, wanted).map(|near| near.distance)
    }

    /// The nearest such segment.
    pub(crate) fn nearest(&self, p: &Point3<f64>, reach: f64, wanted: impl Fn(u64) -> bool) -> Option<Near> {
        let home = self.key(p);
        let rings = (reach / self.cell).ceil() as i64;
        let (mut best, mut nearest) = (f64::INFINITY, 0);
        for ring in 0..=rings {
            // everything in this ring or beyond is at least this far away
            if best <= (ring - 1) as f64 * self.cell {
                break;
            }
            for x in -ring..=ring {
                for y in -ring..=ring {
                    let shell = x.abs() == ring || y.abs() == ring;
                    let step = if shell || ring == 0 { 1 } else { 2 * ring };
                    for z in (-ring..=ring).step_by(step as usize) {
                        let Some(ids) = self.cells.get(&[home[0] + x, home[1] + y, home[2] + z]) else { continue };
                        for id in ids.iter().filter(|i| wanted(self.segments[**i as usize].label)) {
                            let s = &self.segments[*id as usize];
                            let distance = distance(p, &s.a, &s.b);
                            // the first of equals, in whatever order cells are looked at
                            if distance < best || (distance == best && *id < nearest) {
                                (best, nearest) = (distance, *id);
                            }
                        }
                    }
                }
            }
        }
        (best <= reach).then(|| {
            let s = &self.segments[nearest as usize];
            Near { distance: best, segment: nearest as usize, share: share(p, &s.a, &s.b) }
        })
    }
}

/// The segment that is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    /// How far it is, m.
    pub distance: f64,
    /// How many segments were inserted before it.
    pub segment: usize,
    /// Where on it, from 0 to 1.
    pub share: f64,
}

/// Share of the segment at which it is nearest to a point.
fn share(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let ab = b - a;
    let length2 = ab.norm_squared();
    if length2 > 0.0 { ((p - a).dot(&ab) / length2).clamp(0.0, 1.0) } else { 0.0 }
}

/// Distance of a point from a segment, m.
fn distance(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    (p - (a + (b - a) * share(p, a, b))).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn grid_agrees_with_trying_all(
            ends in proptest::collection::vec(proptest::array::uniform6(-10.0..10.0f64), 1..20),
            p in proptest::array::uniform3(-12.0..12.0f64),
            reach in 0.1..9.0f64,
        ) {
            let mut grid = SegmentGrid::new(1.3);
            let p = Point3::from(p);
            let mut all = f64::INFINITY;
            for (i, e) in ends.iter().enumerate() {
                let a = Point3::new(e[0], e[1], e[2]);
                let b = a + nalgebra::Vector3::new(e[3], e[4], e[5]) * 0.2;
                grid.insert(a, b, i as u64);
                if i % 2 == 0 {
                    all = all.min(distance(&p, &a, &b));
                }
            }
            let found = grid.distance(&p, reach, |label| label % 2 == 0);
            prop_assert_eq!(found, (all <= reach).then_some(all));
        }
    }
}
