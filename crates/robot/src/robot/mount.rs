//! How a parked base gives way: stiffness of wheels and floor, what of it shows at the pen, and how it sways.
use nalgebra::{Matrix2, Matrix3, Matrix6, Point3, Vector2, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::{BaseModel, Rocker, WHEELS};

/// Stiffness of a roller's bearing before it turns, N/m.
const PRESLIDING: f64 = 2e5;

/// A place at which a base stands on a spring: a wheel, or the pivot of an axle that turns freely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Where, m, base frame.
    pub place: Point3<f64>,
    /// Upright stiffness, N/m.
    pub stiffness: f64,
    /// The wheels that carry it.
    pub wheels: [bool; WHEELS],
}

/// A parked base as a spring of six coordinates, calibrated for one posture of its arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MountModel {
    /// Stiffness about the origin of the base's frame, linear part first; the weight's tipping is in it.
    pub stiffness: Matrix6<f64>,
    /// Share of the true sag that the model knows, 1 without an error of calibration.
    pub share: f64,
}

impl MountModel {
    /// The springs under a base.
    pub fn feet(base: &BaseModel) -> Vec<Foot> {
        let k = base.springs.stiffness;
        let one = |i: usize| {
            let mut wheels = [false; WHEELS];
            wheels[i] = true;
            Foot { place: base.wheels[i].hub, stiffness: k, wheels }
        };
        let axle = |a: usize, b: usize| {
            let mut wheels = [false; WHEELS];
            (wheels[a], wheels[b]) = (true, true);
            let place = nalgebra::center(&base.wheels[a].hub, &base.wheels[b].hub);
            Foot { place, stiffness: 2.0 * k, wheels }
        };
        match base.springs.rocker {
            Rocker::Front => vec![axle(0, 1), one(2), one(3)],
            Rocker::Rear => vec![one(0), one(1), axle(2, 3)],
            Rocker::None => (0..WHEELS).map(one).collect(),
        }
    }

    /// The spring of a parked base with `whole`, the inertia of base and arm about the origin of the base's frame. Upright each foot
    /// gives way; in the plane each wheel does, along its roller by the contact and by the loop that holds the motor.
    pub fn new(base: &BaseModel, whole: &Matrix6<f64>) -> Self {
        let mut k = Matrix6::zeros();
        let mut add = |at: &Point3<f64>, s: Matrix3<f64>| {
            let cross = -at.coords.cross_matrix();
            let mut j = nalgebra::Matrix3x6::zeros();
            j.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
            j.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross);
            k += j.transpose() * s * j;
        };
        let feet = Self::feet(base);
        for f in &feet {
            add(&f.place, Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, f.stiffness)));
        }
        for w in &base.wheels {
            let plane = wheel_stiffness(base, &w.roller);
            let mut s = Matrix3::zeros();
            s.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
            add(&Point3::new(w.hub.x, w.hub.y, 0.0), s);
        }
        // a tilted base's weight tips it on; the feet's forces, which move with it, hold against that from their height
        let (weight, moment) = (whole[(0, 0)] * super::GRAVITY, whole[(4, 0)] * super::GRAVITY);
        let height = feet.iter().map(|f| f.place.z).sum::<f64>() / feet.len() as f64;
        let tipping = moment - weight * height;
        k[(3, 3)] -= tipping;
        k[(4, 4)] -= tipping;
        Self { stiffness: k, share: 1.0 }
    }

    /// The same with an error of calibration: it foretells this share of the sag.
    pub fn knowing(self, share: f64) -> Self {
        Self { share, ..self }
    }

    /// Motion of the base's frame under a change of the wrench on it (N and N m about its origin, its axes), m and rad. `None` where
    /// the base would tip over.
    pub fn give(&self, change: &Vector6<f64>) -> Option<Vector6<f64>> {
        Some(self.stiffness.cholesky()?.solve(change) * self.share)
    }

    /// Frequencies of base and arm as one rigid body on this spring, Hz, lowest first; `whole` is its inertia about the origin of the
    /// base's frame. Empty where the base would tip over.
    pub fn frequencies(&self, whole: &Matrix6<f64>) -> Vec<f64> {
        let Some(factor) = whole.cholesky() else { return Vec::new() };
        let lower = factor.l();
        let Some(inverse) = lower.try_inverse() else { return Vec::new() };
        let squares = (inverse * self.stiffness * inverse.transpose()).symmetric_eigenvalues();
        if squares.min() <= 0.0 {
            return Vec::new();
        }
        let mut hertz: Vec<f64> = squares.iter().map(|w| w.sqrt() / std::f64::consts::TAU).collect();
        hertz.sort_by(f64::total_cmp);
        hertz
    }

    /// Damping by stiffness that gives the first mode this damping ratio, s.
    pub fn damping_by_stiffness(&self, whole: &Matrix6<f64>, ratio: f64) -> f64 {
        self.frequencies(whole).first().map_or(0.0, |f| 2.0 * ratio / (std::f64::consts::TAU * f))
    }
}

/// Stiffness of one parked wheel in the plane, N/m: bristles and bearing in series with the wheel's held motor.
fn wheel_stiffness(base: &BaseModel, roller: &Vector2<f64>) -> Matrix2<f64> {
    let across = Vector2::new(-roller.y, roller.x);
    let bearing = if base.tyre.rolling_resistance > 0.0 { PRESLIDING } else { 0.0 };
    let contact = roller * roller.transpose() * base.tyre.stiffness + across * across.transpose() * bearing;
    let rim: Vector2<f64> = contact.column(0) * base.radius;
    let whole = base.motor.hold_gain + base.radius * rim.x;
    contact - rim * rim.transpose() / whole
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::robot::{Cell, JointVector};

    #[test]
    fn stiffness_is_that_of_the_published_estimate() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/iiwa_ridgeback.toml");
        let arm = Cell::load(&file).expect("loads").arms.remove(0);
        let base = arm.base.expect("has a base");
        let whole = arm.model.whole_momentum(&arm.model.kinematics(&arm.home), &JointVector::zeros()).whole;
        let mount = MountModel::new(&base, &whole);
        let k = base.springs.stiffness;
        // the rear wheels alone hold against rolling; all against pitching
        let tipping = 2.0 * k * 0.2755f64.powi(2) - mount.stiffness[(3, 3)];
        assert!((mount.stiffness[(2, 2)] - 4.0 * k).abs() < 1e-3);
        assert!((4.0 * k * 0.319f64.powi(2) - tipping - mount.stiffness[(4, 4)]).abs() < 1e-6);
        assert!((300.0..1500.0).contains(&tipping), "m g h over the axles: {tipping}");
        let hertz = mount.frequencies(&whole);
        assert!(hertz.len() == 6 && (3.0..8.0).contains(&hertz[0]), "{hertz:?}");
        let half = mount.clone().knowing(0.5).give(&Vector6::repeat(1.0)).expect("stands");
        assert!((half * 2.0 - mount.give(&Vector6::repeat(1.0)).expect("stands")).norm() < 1e-15);
    }
}
