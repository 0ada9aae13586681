//! The arm's reach in the pen's own frame.
//!
//! On an upright wall whether a point can be drawn depends on where the arm's first axis stands against it: how far along the pen,
//! how far across, how much lower. One map with the pen along x tells all of them.
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};

use super::options::CoverOptions;
use crate::mesh::{MeshError, TriMesh, shapes};
use crate::plan::{Reach, ReachGrid, ReachMap};
use crate::robot::ArmModel;

/// Nearest and farthest wall, along the pen from the first axis, m.
const DEPTHS: [f64; 2] = [0.40, 1.10];
/// Farthest to the side, m.
const SIDE: f64 = 0.95;
/// The map's band ends at multiples of this, m, so that like drawings share maps.
const BAND: f64 = 0.1;
/// Room between the arm's base and what carries it, m.
const UNDER: f64 = 0.01;

/// Where the pen draws from a first axis at the origin; m.
#[derive(Clone, Debug)]
pub struct PenReach {
    grid: ReachGrid,
    /// Free nodes before each corner, so that boxes are counted in eight look-ups.
    sums: Vec<u32>,
    size: [usize; 3],
    free: Vec<[f64; 3]>,
}

impl PenReach {
    /// The arm as it is asked: its base frame over the origin at the mount's height, facing x.
    pub fn arm(arm: &ArmModel, options: &CoverOptions) -> ArmModel {
        ArmModel { world_from_base: Isometry3::translation(0.0, 0.0, options.mount[2]), ..arm.clone() }
    }

    /// What carries the arm, round it as [`PenReach::arm`] stands: a block on the whole footprint up to its base.
    pub fn body(options: &CoverOptions) -> Result<TriMesh, MeshError> {
        let [length, width] = options.footprint;
        let top = (options.mount[2] - UNDER).max(0.01);
        let block = shapes::cuboid(&Vector3::new(length, width, top), 1.0)?;
        Ok(block.transformed(&Isometry3::translation(-options.mount[0], -options.mount[1], 0.5 * top)))
    }

    /// The points to ask about for ink between heights `band` (m, world): one side alone, for the arm is alike on both.
    pub fn grid(options: &CoverOptions, band: [f64; 2]) -> ReachGrid {
        let spacing = options.map_spacing;
        let count = |x: f64| (x / spacing).round() as i32;
        let low = count(((band[0] - options.mount[2]) / BAND).floor() * BAND) - 1;
        let high = count(((band[1] - options.mount[2]) / BAND).ceil() * BAND) + 1;
        let (near, far) = (count(DEPTHS[0]), count(DEPTHS[1]));
        ReachGrid {
            origin: Point3::new(0.0, 0.0, options.mount[2]),
            right: -Vector3::y(),
            up: Vector3::z(),
            axis: Vector3::x(),
            spacing,
            first: [0, low, near],
            size: [count(SIDE) as usize + 1, (high - low + 1) as usize, (far - near + 1) as usize],
        }
    }

    /// The reach that a map over [`PenReach::grid`] tells.
    pub fn new(map: &ReachMap) -> Self {
        let [n, m, k] = map.grid.size;
        let size = [2 * n - 1, m, k];
        let at = |i: usize, j: usize, l: usize| map.nodes[map.grid.index([i.abs_diff(n - 1), j, l])] == Reach::Free;
        let mut sums = vec![0_u32; (size[0] + 1) * (m + 1) * (k + 1)];
        let place = |i: usize, j: usize, l: usize| (i * (m + 1) + j) * (k + 1) + l;
        let mut free = Vec::new();
        for i in 0..size[0] {
            for j in 0..m {
                let mut row = 0;
                for l in 0..k {
                    row += u32::from(at(i, j, l));
                    let before = sums[place(i, j + 1, l + 1)] + sums[place(i + 1, j, l + 1)] - sums[place(i, j, l + 1)];
                    sums[place(i + 1, j + 1, l + 1)] = before + row;
                    if at(i, j, l) {
                        let across = (i as f64 - (n - 1) as f64) * map.grid.spacing;
                        free.push([across, map.grid.coordinate(1, j), map.grid.coordinate(2, l)]);
                    }
                }
            }
        }
        Self { grid: map.grid.clone(), sums, size, free }
    }

    /// Whether all points between `low` and `high` (across, up, along; m from the first axis at the arm's base frame) can be drawn.
    /// Between nodes the nearest tell.
    pub fn holds(&self, low: [f64; 3], high: [f64; 3]) -> bool {
        let first = [-(self.size[0] as i32 / 2), self.grid.first[1], self.grid.first[2]];
        let (mut from, mut to) = ([0_usize; 3], [0_usize; 3]);
        for d in 0..3 {
            let a = (low[d] / self.grid.spacing).round() as i32 - first[d];
            let b = (high[d] / self.grid.spacing).round() as i32 - first[d];
            if a < 0 || b >= self.size[d] as i32 || b < a {
                return false;
            }
            (from[d], to[d]) = (a as usize, b as usize + 1);
        }
        let [_, m, k] = self.size;
        let sum = |i: usize, j: usize, l: usize| i64::from(self.sums[(i * (m + 1) + j) * (k + 1) + l]);
        let layer = |i: usize| {
            sum(i, to[1], to[2]) - sum(i, from[1], to[2]) - sum(i, to[1], from[2]) + sum(i, from[1], from[2])
        };
        let nodes = (to[0] - from[0]) * (to[1] - from[1]) * (to[2] - from[2]);
        layer(to[0]) - layer(from[0]) == nodes as i64
    }

    /// How far a point (across, up, along) is from the nearest that can be drawn, m; infinite of an arm that draws nowhere.
    pub fn distance(&self, at: [f64; 3]) -> f64 {
        let gap = |p: &[f64; 3]| (0..3).map(|d| (p[d] - at[d]).powi(2)).sum::<f64>();
        self.free.iter().map(gap).fold(f64::INFINITY, f64::min).sqrt()
    }

    /// The tallest upright line that is held with a margin (m) about it, pressed by as much as `press` (m): its ends, m over the arm's
    /// base frame.
    pub fn tallest(&self, margin: f64, press: f64) -> Option<[f64; 2]> {
        let mut best: Option<[f64; 2]> = None;
        for l in 0..self.size[2] {
            let along = self.grid.coordinate(2, l);
            let mut from = None;
            for j in 0..self.size[1] {
                let z = self.grid.coordinate(1, j);
                if !self.holds([-margin, z, along - margin], [margin, z, along + margin + press]) {
                    from = None;
                    continue;
                }
                let low = *from.get_or_insert(z);
                if best.is_none_or(|b| z - low > b[1] - b[0]) {
                    best = Some([low, z]);
                }
            }
        }
        best
    }

    /// Whether a height (m over the arm's base frame) is between the map's ends.
    pub fn is_inside(&self, z: f64) -> bool {
        let half = 0.5 * self.grid.spacing;
        z > self.grid.coordinate(1, 0) + half && z < self.grid.coordinate(1, self.size[1] - 1) - half
    }

    /// Lowest and highest that can be drawn at all, m over the arm's base frame.
    pub fn heights(&self) -> Option<[f64; 2]> {
        let fold = |f: fn(f64, f64) -> f64, start: f64| self.free.iter().map(|p| p[1]).fold(start, f);
        (!self.free.is_empty()).then(|| [fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY)])
    }
}

/// Where a wall point lies in the frame of a pen square to the wall (`normal` towards the artist), from a first axis at `axis`:
/// across (to the right) and along, m.
pub(super) fn in_pen_frame(point: &Point2<f64>, normal: &Vector2<f64>, axis: &Point2<f64>) -> [f64; 2] {
    let (way, pen) = (point - axis, -normal);
    [way.dot(&Vector2::new(pen.y, -pen.x)), way.dot(&pen)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::cover::CoverMethod;

    #[test]
    fn boxes_are_counted_as_their_nodes_are() {
        let options = CoverOptions {
            method: CoverMethod::Map,
            borders: vec![],
            raise: None,
            footprint: [0.96, 0.793],
            mount: [0.12, 0.0, 0.731],
            margin: 0.0,
            map_spacing: 0.1,
            candidate_spacing: 0.05,
            verify: false,
        };
        let grid = PenReach::grid(&options, [1.0, 1.4]);
        let free = |i: usize| {
            let p = grid.position(i) - Point3::new(0.0, 0.0, 0.731);
            (0.5..0.8).contains(&p.norm())
        };
        let nodes = (0..grid.len()).map(|i| if free(i) { Reach::Free } else { Reach::Out }).collect();
        let reach = PenReach::new(&ReachMap { grid, nodes });
        assert!(reach.holds([-0.1, 0.3, 0.6], [0.1, 0.4, 0.6]) && reach.holds([0.0, 0.3, 0.5], [0.0, 0.3, 0.7]));
        // the same to the left and to the right, and nothing past the shell
        assert!(reach.holds([0.5, 0.3, 0.4], [0.5, 0.3, 0.4]) && reach.holds([-0.5, 0.3, 0.4], [-0.5, 0.3, 0.4]));
        assert!(!reach.holds([0.0, 0.3, 0.8], [0.0, 0.3, 0.8]) && !reach.holds([-0.7, 0.3, 0.5], [0.0, 0.3, 0.5]));
        assert!((reach.distance([0.0, 0.3, 0.8]) - 0.1).abs() < 1e-9);
        // a line before the middle, 0.5 away, is in the shell up to 0.6; nearer ones begin higher
        let [low, high] = reach.tallest(0.0, 0.0).unwrap();
        assert!(low < 0.3 && high >= 0.6, "{low} {high}");
        assert!(reach.tallest(0.4, 0.0).is_none());
    }

    #[test]
    fn to_the_right_is_as_the_artist_sees_it() {
        // the wall faces -x, so that the artist's right is -y
        let [across, along] = in_pen_frame(&Point2::new(1.0, -0.3), &-Vector2::x(), &Point2::origin());
        assert!((across - 0.3).abs() < 1e-12 && (along - 1.0).abs() < 1e-12);
    }
}
