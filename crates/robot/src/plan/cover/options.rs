//! What is asked of a cover.
use nalgebra::{Isometry2, Point2, Vector2};
use serde::{Deserialize, Serialize};

/// Where a base stands on the floor: its centre, m, world, and where its front points, rad from the x axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BasePose {
    /// Centre, m.
    pub x: f64,
    /// Centre, m.
    pub y: f64,
    /// Direction of its front, rad.
    pub heading: f64,
}

impl BasePose {
    /// As a motion of the plane.
    pub fn isometry(&self) -> Isometry2<f64> {
        Isometry2::new(Vector2::new(self.x, self.y), self.heading)
    }

    /// Its centre.
    pub fn center(&self) -> Point2<f64> {
        Point2::new(self.x, self.y)
    }
}

/// How places are found.
#[derive(Clone, Debug, PartialEq)]
pub enum CoverMethod {
    /// Over the arm's reach in space; exact over the candidates.
    Map,
    /// Circles and a greedy choice: algorithm 1 of the dissertation.
    Circles {
        /// Radius of a circle that the arm covers, m.
        radius: f64,
        /// Distance of its centre from the base's, m.
        offset: f64,
        /// Radius of the circle round the base that must be free of wall, m.
        base: f64,
    },
    /// By hand, in the order of drawing.
    Poses(Vec<BasePose>),
}

/// What is asked of a cover. Lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverOptions {
    /// How places are found.
    pub method: CoverMethod,
    /// Straight seams at these arc lengths of the wall, in place of free ones: one fewer than places.
    pub borders: Vec<f64>,
    /// How far the drawing may be moved down and up its wall for the fewest places; where it lies when absent. For the map alone.
    pub raise: Option<[f64; 2]>,
    /// Length and width of the base.
    pub footprint: [f64; 2],
    /// Where the arm's base frame stands on the base: forward, to the left, over the floor.
    pub mount: [f64; 3],
    /// How far from where it should stand the base may be and still reach everything.
    pub margin: f64,
    /// Distance between the points of the map of reach.
    pub map_spacing: f64,
    /// Distance between places that are tried.
    pub candidate_spacing: f64,
    /// Plan what is drawn from each place before it is taken.
    pub verify: bool,
}
