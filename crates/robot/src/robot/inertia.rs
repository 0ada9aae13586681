//! Moving, joining and checking the inertia of rigid bodies.
use nalgebra::{Matrix3, Point3, Vector3};

use super::SpatialInertia;
use crate::math::Pose;

/// How far an inertia may break the triangle inequality, as a share of its trace: published tensors are rounded, and a
/// thin disc lies on the boundary.
const TRIANGLE_TOLERANCE: f64 = 0.005;

/// Largest mass (kg) and moment (kg m2) believed to be meant: more is a wrong unit.
const LARGEST: f64 = 1e6;

impl SpatialInertia {
    /// A body without mass, at the origin.
    pub fn massless() -> Self {
        Self { mass: 0.0, com: Point3::origin(), inertia: Matrix3::zeros() }
    }

    /// The same body seen from frame a: `com_a = a_from_b com_b`, `I_a = R I_b R^T`.
    pub fn seen_from(&self, a_from_b: &Pose) -> Self {
        let r = a_from_b.rotation.to_rotation_matrix();
        let inertia = r.matrix() * self.inertia * r.matrix().transpose();
        Self { mass: self.mass, com: a_from_b * self.com, inertia: (inertia + inertia.transpose()) * 0.5 }
    }

    /// Two bodies of one frame, rigidly joined: masses add, each inertia is shifted to the common centre of mass by the
    /// parallel-axis theorem `I + m (|d|^2 1 - d d^T)`.
    pub fn joined(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return Self::massless();
        }
        let com = Point3::from((self.com.coords * self.mass + other.com.coords * other.mass) / mass);
        let shifted = |body: &Self| {
            let d: Vector3<f64> = body.com - com;
            body.inertia + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * body.mass
        };
        Self { mass, com, inertia: shifted(self) + shifted(other) }
    }

    /// What no rigid body can have, if this has it: a mass that is not positive, an inertia that is not positive
    /// definite, or principal moments of which one exceeds the sum of the others.
    ///
    /// The last holds exactly when `tr(I)/2 1 - I`, the second moment of the mass, is positive semidefinite, so no
    /// eigenvalues are needed.
    pub fn defect(&self) -> Option<String> {
        let numbers = self.inertia.iter().chain(self.com.coords.iter()).chain(std::iter::once(&self.mass));
        if let Some(x) = numbers.clone().find(|x| !x.is_finite() || x.abs() > LARGEST) {
            return Some(format!("{x} can't be a mass, centre of mass or inertia; give kg, m and kg m2"));
        }
        if self.mass <= 0.0 {
            return Some(format!("mass {} kg must be positive", self.mass));
        }
        let trace = self.inertia.trace();
        if trace <= 0.0 || self.inertia.cholesky().is_none() {
            return Some("inertia is not positive definite".to_string());
        }
        let second_moment = Matrix3::identity() * (trace * (0.5 + TRIANGLE_TOLERANCE)) - self.inertia;
        if second_moment.cholesky().is_none() {
            let d = self.inertia.diagonal();
            return Some(format!(
                "inertia breaks the triangle inequality (no principal moment may exceed the sum of the other two): \
                 ixx {}, iyy {}, izz {}",
                d.x, d.y, d.z
            ));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Point masses, and their inertia from the definition.
    fn of_points(points: &[(f64, Point3<f64>)]) -> SpatialInertia {
        points.iter().fold(SpatialInertia::massless(), |sum, (mass, p)| {
            sum.joined(&SpatialInertia { mass: *mass, com: *p, inertia: Matrix3::zeros() })
        })
    }

    proptest! {
        #[test]
        fn joining_then_moving_is_moving_then_joining(
            v in proptest::collection::vec((0.1..2.0f64, -1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64), 5),
            t in proptest::array::uniform6(-3.0..3.0f64),
        ) {
            let points: Vec<_> = v.iter().map(|(m, x, y, z)| (*m, Point3::new(*x, *y, *z))).collect();
            let pose = Pose::new(Vector3::new(t[0], t[1], t[2]), Vector3::new(t[3], t[4], t[5]));
            let moved: Vec<_> = points.iter().map(|(m, p)| (*m, pose * p)).collect();
            let (a, b) = (of_points(&points).seen_from(&pose), of_points(&moved));
            prop_assert!((a.com - b.com).norm() < 1e-12);
            prop_assert!((a.inertia - b.inertia).norm() < 1e-11);
            prop_assert!(a.defect().is_none());
        }
    }

    #[test]
    fn impossible_bodies_are_named() {
        let body = |ixx, iyy, izz| SpatialInertia {
            mass: 1.0,
            com: Point3::origin(),
            inertia: Matrix3::from_diagonal(&Vector3::new(ixx, iyy, izz)),
        };
        assert!(body(1.0, 1.0, 2.0).defect().is_none(), "a thin disc is possible");
        assert!(body(1.0, 1.0, 2.1).defect().is_some_and(|d| d.contains("triangle")));
        assert!(body(1.0, 1.0, -0.1).defect().is_some_and(|d| d.contains("positive definite")));
        assert!(body(f64::NAN, 1.0, 1.0).defect().is_some());
        assert!(SpatialInertia { mass: 0.0, ..body(1.0, 1.0, 1.0) }.defect().is_some_and(|d| d.contains("mass")));
    }
}
