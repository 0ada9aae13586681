//! Distances between the capsules of an arm.
use nalgebra::Point3;

use crate::math::Pose;
use crate::robot::{ArmModel, Capsule, JointVector, Kinematics};

impl ArmModel {
    /// The capsules of an arm's links from link `first` on (0 is the base), in the posture `k`: m, world.
    pub fn capsules<'a>(&'a self, k: &'a Kinematics, first: usize) -> impl Iterator<Item = Capsule> + 'a {
        let links = self.links.iter().zip(k.world_from_links()).skip(first);
        links.flat_map(|(link, world_from_link)| link.capsules.iter().map(|c| c.transformed(world_from_link)))
    }
}

impl Capsule {
    /// The capsule given in frame `b`, in frame `a`.
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        Self { a: a_from_b * self.a, b: a_from_b * self.b, radius: self.radius }
    }

    /// Distance to another capsule in the same frame, m: negative when their axes are nearer than the radii add up to.
    pub fn distance(&self, other: &Capsule) -> f64 {
        segment_distance(&self.a, &self.b, &other.a, &other.b) - self.radius - other.radius
    }
}

/// Distance between the segments `p0`-`p1` and `q0`-`q1`; either may be a point. (Ericson, Real-Time Collision
/// Detection, 2005, section 5.1.9.)
pub fn segment_distance(p0: &Point3<f64>, p1: &Point3<f64>, q0: &Point3<f64>, q1: &Point3<f64>) -> f64 {
    let (d1, d2, r) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let tiny = 1e-18;
    let (s, t) = if a <= tiny && e <= tiny {
        (0.0, 0.0)
    } else if a <= tiny {
        (0.0, (f / e).clamp(0.0, 1.0))
    } else {
        let c = d1.dot(&r);
        if e <= tiny {
            ((-c / a).clamp(0.0, 1.0), 0.0)
        } else {
            let b = d1.dot(&d2);
            let denominator = a * e - b * b;
            let s = if denominator > tiny { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
            let t = (b * s + f) / e;
            if t < 0.0 {
                ((-c / a).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((b - c) / a).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    ((p0 + d1 * s) - (q0 + d2 * t)).norm()
}

/// The nearest pair of links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfClearance {
    /// Distance, m; negative where capsules overlap.
    pub distance: f64,
    /// Indices of the two links, the lower one first; `None` when the arm has no pair to check.
    pub links: Option<(usize, usize)>,
}

/// The pairs of links of an arm that may meet: not neighbours, and apart when all joints stand in the middle.
#[derive(Clone, Debug)]
pub struct LinkPairs {
    pairs: Vec<(usize, usize)>,
}

impl LinkPairs {
    /// Pairs that come nearer than this in the neutral posture are left out: loose capsules of links that can't meet.
    pub const NEUTRAL_DISTANCE: f64 = 0.01;

    /// Finds the pairs of `arm`.
    pub fn new(arm: &ArmModel) -> Self {
        let k = arm.kinematics(&arm.neutral());
        let n = arm.links.len();
        let pairs = (0..n)
            .flat_map(|i| (i + 2..n).map(move |j| (i, j)))
            .filter(|(i, j)| link_distance(arm, &k, *i, *j) > Self::NEUTRAL_DISTANCE)
            .collect();
        Self { pairs }
    }

    /// The pairs, lower index first.
    pub fn pairs(&self) -> &[(usize, usize)] {
        &self.pairs
    }

    /// The least distance over all pairs of `arm` at `k`; no allocation.
    pub fn clearance(&self, arm: &ArmModel, k: &Kinematics) -> SelfClearance {
        let mut nearest = SelfClearance { distance: f64::INFINITY, links: None };
        for (i, j) in &self.pairs {
            let distance = link_distance(arm, k, *i, *j);
            if distance < nearest.distance {
                nearest = SelfClearance { distance, links: Some((*i, *j)) };
            }
        }
        nearest
    }
}

impl ArmModel {
    /// The middle of every joint's range, 0 where the range is unbounded.
    pub fn neutral(&self) -> JointVector {
        JointVector::from_fn(|i, _| match self.joints.get(i) {
            Some(j) if j.lower.is_finite() && j.upper.is_finite() => 0.5 * (j.lower + j.upper),
            _ => 0.0,
        })
    }
}

/// Least distance between the capsules of links `i` and `j`, m.
fn link_distance(arm: &ArmModel, k: &Kinematics, i: usize, j: usize) -> f64 {
    let mut least = f64::INFINITY;
    for c in &arm.links[i].capsules {
        let c = c.transformed(k.world_from_link(i));
        for d in &arm.links[j].capsules {
            least = least.min(c.distance(&d.transformed(k.world_from_link(j))));
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(|p| Point3::new(p[0], p[1], p[2]))
    }

    proptest! {
        #[test]
        fn segment_distance_is_the_least_over_both_segments(p0 in point(), p1 in point(), q0 in point(), q1 in point()) {
            let d = segment_distance(&p0, &p1, &q0, &q1);
            let n = 40;
            let mut least = f64::INFINITY;
            for i in 0..=n {
                for j in 0..=n {
                    let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                    least = least.min(((p0 + (p1 - p0) * s) - (q0 + (q1 - q0) * t)).norm());
                }
            }
            prop_assert!(d <= least + 1e-12 && d > least - 0.1);
            prop_assert!((d - segment_distance(&q1, &q0, &p1, &p0)).abs() < 1e-9);
        }
    }

    #[test]
    fn degenerate_and_parallel_segments() {
        let p = |x, y| Point3::new(x, y, 0.0);
        assert_eq!(segment_distance(&p(0.0, 0.0), &p(0.0, 0.0), &p(3.0, 4.0), &p(3.0, 4.0)), 5.0);
        assert_eq!(segment_distance(&p(0.0, 0.0), &p(2.0, 0.0), &p(1.0, 1.0), &p(3.0, 1.0)), 1.0);
        assert_eq!(segment_distance(&p(0.0, 0.0), &p(1.0, 0.0), &p(3.0, 0.0), &p(4.0, 0.0)), 2.0);
        assert_eq!(segment_distance(&p(0.0, 0.0), &p(2.0, 0.0), &p(1.0, -1.0), &p(1.0, 1.0)), 0.0);
    }
}
