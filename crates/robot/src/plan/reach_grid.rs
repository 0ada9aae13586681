//! A lattice of points before an arm, in the frame of a canvas: right, up, and along the pen.
use nalgebra::{Point3, Vector3};

use crate::robot::{ArmModel, JointKind};

/// Most nodes that a lattice may have: an hour's work rather than a day's.
pub const MOST_NODES: usize = 20_000_000;
/// A track longer than this is taken to be this long, m.
const LONGEST_TRACK: f64 = 3.0;

/// Why there is no lattice.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// The spacing is no length.
    #[error("a spacing of {} mm between points must be positive", spacing * 1e3)]
    Spacing {
        /// What it is, m.
        spacing: f64,
    },
    /// The pen's axis has no direction.
    #[error("the pen's axis ({x}, {y}, {z}) has no direction")]
    Axis {
        /// Along x.
        x: f64,
        /// Along y.
        y: f64,
        /// Along z.
        z: f64,
    },
    /// It would be too fine.
    #[error("a spacing of {} mm makes {nodes} points, more than {MOST_NODES}: take a wider one", spacing * 1e3)]
    TooFine {
        /// The spacing, m.
        spacing: f64,
        /// Points that it would make.
        nodes: usize,
    },
}

/// Points `origin + spacing (i right + j up + k axis)` for whole numbers from `first` on, `size` of them each way.
///
/// A slice of equal `k` is a canvas that the pen meets squarely. Nodes of lattices with one origin, frame and spacing
/// coincide, so that those of two arms can be compared.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachGrid {
    /// Where all three counts are 0, m, world.
    pub origin: Point3<f64>,
    /// To the right on the canvas as its artist sees it, unit, world.
    pub right: Vector3<f64>,
    /// Up on the canvas, unit, world.
    pub up: Vector3<f64>,
    /// The pen's z axis, into the canvas, unit, world.
    pub axis: Vector3<f64>,
    /// Distance between neighbours, m.
    pub spacing: f64,
    /// Counts of the first node, right, up and along the axis.
    pub first: [i32; 3],
    /// Nodes each way.
    pub size: [usize; 3],
}

impl ReachGrid {
    /// The lattice that holds all that any of `arms` could reach, with the first one's base as its origin.
    ///
    /// Up is the world's z, or x when the pen stands upright: the edge of a table that is far from the robot.
    pub fn around(arms: &[&ArmModel], axis: &Vector3<f64>, spacing: f64) -> Result<Self, GridError> {
        if !(spacing > 0.0 && spacing.is_finite()) {
            return Err(GridError::Spacing { spacing });
        }
        let length = axis.norm();
        if !(length > 1e-9 && length.is_finite()) {
            return Err(GridError::Axis { x: axis.x, y: axis.y, z: axis.z });
        }
        let axis = axis / length;
        let hint = if axis.z.abs() > 0.9 { Vector3::x() } else { Vector3::z() };
        let up = (hint - axis * axis.dot(&hint)).normalize();
        let right = axis.cross(&up);
        let origin = arms.first().map_or(Point3::origin(), |a| a.world_from_base.translation.vector.into());
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for arm in arms {
            let (center, radius) = span(arm);
            for (d, direction) in [right, up, axis].iter().enumerate() {
                let at = direction.dot(&(center - origin));
                low[d] = low[d].min(at - radius);
                high[d] = high[d].max(at + radius);
            }
        }
        let first = low.map(|x| (x / spacing).ceil());
        let size: [f64; 3] = std::array::from_fn(|d| ((high[d] / spacing).floor() - first[d] + 1.0).max(1.0));
        let nodes = size.iter().product::<f64>();
        if nodes > MOST_NODES as f64 {
            return Err(GridError::TooFine { spacing, nodes: nodes as usize });
        }
        let (first, size) = (first.map(|x| x as i32), size.map(|x| x as usize));
        Ok(Self { origin, right, up, axis, spacing, first, size })
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.size.iter().product()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The place of node `[i, j, k]`, counted from the first, in a list of all: `k` runs fastest.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * self.size[1] + j) * self.size[2] + k
    }

    /// The node at a place of the list.
    pub fn node(&self, index: usize) -> [usize; 3] {
        let (ij, k) = (index / self.size[2], index % self.size[2]);
        [ij / self.size[1], ij % self.size[1], k]
    }

    /// Coordinate of the `n`th node along direction `d` (0 right, 1 up, 2 axis), m from the origin.
    pub fn coordinate(&self, d: usize, n: usize) -> f64 {
        (f64::from(self.first[d]) + n as f64) * self.spacing
    }

    /// Where coordinates (right, up, axis; m from the origin) lie in the world, m.
    pub fn point(&self, [u, v, w]: [f64; 3]) -> Point3<f64> {
        self.origin + self.right * u + self.up * v + self.axis * w
    }

    /// Where node `index` lies in the world, m.
    pub fn position(&self, index: usize) -> Point3<f64> {
        let n = self.node(index);
        self.point(std::array::from_fn(|d| self.coordinate(d, n[d])))
    }

    /// The nodes beside `index` along the three directions, at most six.
    pub fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let node = self.node(index);
        (0..3).flat_map(move |d| {
            let shifted = |n: usize| {
                let mut other = node;
                other[d] = n;
                self.index(other)
            };
            let before = node[d].checked_sub(1).map(shifted);
            let after = Some(node[d] + 1).filter(|n| *n < self.size[d]).map(shifted);
            before.into_iter().chain(after)
        })
    }

    /// Whether `arm` could come there at all: no farther from its first joint than all its links in a row are long.
    pub fn is_within(&self, arm: &ArmModel, index: usize) -> bool {
        let (center, radius) = span(arm);
        (self.position(index) - center).norm() <= radius
    }
}

/// A ball that the tip of `arm` never leaves: centre (m, world) and radius (m).
fn span(arm: &ArmModel) -> (Point3<f64>, f64) {
    let base_from_first = arm.joints.first().map_or(Vector3::zeros(), |j| j.parent_from_joint.translation.vector);
    let center = arm.world_from_base * Point3::from(base_from_first);
    let links = arm.joints.iter().skip(1).map(|j| j.parent_from_joint.translation.vector.norm()).sum::<f64>();
    let slides = arm.joints.iter().filter(|j| j.kind == JointKind::Prismatic);
    let slides = slides.map(|j| j.lower.abs().max(j.upper.abs()).min(LONGEST_TRACK)).sum::<f64>();
    (center, links + slides + arm.last_from_tip.translation.vector.norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::arms;

    #[test]
    fn nodes_are_numbered_and_lie_within_the_arms_span() {
        let arm = arms::ur5e();
        let grid = ReachGrid::around(&[&arm], &Vector3::new(0.0, 0.0, -2.0), 0.1).unwrap();
        assert_eq!((grid.axis, grid.up, grid.right), (-Vector3::z(), Vector3::x(), -Vector3::y()));
        for index in [0, 17, grid.len() / 2, grid.len() - 1] {
            assert_eq!(grid.index(grid.node(index)), index);
            assert!(grid.neighbours(index).all(|n| (grid.position(n) - grid.position(index)).norm() < 0.1 + 1e-12));
        }
        assert_eq!(grid.neighbours(0).count(), 3);
        // stretched out to the side, the tip is near the end of the ball and inside the box
        let mut q = arms::ur5e_home();
        for turn in 0..8 {
            (q[0], q[1], q[2], q[3]) = (0.8 * f64::from(turn), 0.0, 0.0, 0.0);
            let tip = arm.kinematics(&q).world_from_tip().translation.vector;
            let n: [f64; 3] =
                std::array::from_fn(|d| [grid.right, grid.up, grid.axis][d].dot(&(tip - grid.origin.coords)));
            for (d, n) in n.iter().enumerate() {
                let (low, high) = (grid.coordinate(d, 0) - 0.1, grid.coordinate(d, grid.size[d] - 1) + 0.1);
                assert!((low..=high).contains(n), "{tip}");
            }
        }
    }

    #[test]
    fn lattices_of_two_arms_have_one_origin() {
        let left = arms::ur5e();
        let mut right = arms::ur5e();
        right.world_from_base.translation.vector.y = -0.7;
        let both = ReachGrid::around(&[&left, &right], &Vector3::x(), 0.05).unwrap();
        let one = ReachGrid::around(&[&left], &Vector3::x(), 0.05).unwrap();
        assert_eq!(both.origin, one.origin);
        assert_eq!(both.right, -Vector3::y());
        assert!(both.size[0] >= one.size[0] + 13 && both.size[1] == one.size[1]);
    }

    #[test]
    fn senseless_lattices_are_refused_with_their_numbers() {
        let arm = arms::ur5e();
        let refused = |axis: Vector3<f64>, spacing| ReachGrid::around(&[&arm], &axis, spacing).unwrap_err().to_string();
        assert!(refused(Vector3::x(), 0.0).contains("0 mm"));
        assert!(refused(Vector3::x(), f64::NAN).contains("NaN"));
        assert!(refused(Vector3::zeros(), 0.05).contains("(0, 0, 0)"));
        assert!(refused(Vector3::x(), 1e-3).contains("more than 20000000"));
    }
}
