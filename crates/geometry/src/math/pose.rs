//! Rigid poses and the logarithm of a rotation.
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

/// A rigid pose, metres and a unit quaternion. `world_from_pen` maps pen coordinates to world coordinates.
pub type Pose = Isometry3<f64>;

/// The rotation vector (axis times angle, rad, angle in `[0, pi]`) of a rotation.
///
/// Computed as `2 atan2(|v|, w) v / |v|` on the quaternion with `w >= 0`, which is accurate at both ends: the usual
/// arc-cosine form loses all digits near the identity.
pub fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    let (v, w) = if q.w < 0.0 { (-q.imag(), -q.w) } else { (q.imag(), q.w) };
    let n = v.norm();
    if n < 1e-12 { v * 2.0 } else { v * (2.0 * n.atan2(w) / n) }
}

/// The orientation whose z axis is `z` (unit) and whose x axis lies as near to `x_hint` as orthogonality lets it.
///
/// When `x_hint` is parallel to `z` another hint is taken, so the result is always a rotation.
pub fn frame_from_axes(z: &Vector3<f64>, x_hint: &Vector3<f64>) -> UnitQuaternion<f64> {
    let mut x = x_hint - z * z.dot(x_hint);
    if x.norm() < 1e-9 {
        let other = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        x = other - z * z.dot(&other);
    }
    let x = x.normalize();
    let y = z.cross(&x);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, *z])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rotation_vector_inverts_the_exponential(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, e in -9.0..0.4f64) {
            let v = Vector3::new(x, y, z);
            prop_assume!(v.norm() > 1e-3);
            let v = v.normalize() * 10f64.powf(e);
            let back = rotation_vector(&UnitQuaternion::from_scaled_axis(v));
            prop_assert!((back - v).norm() < 1e-12 * (1.0 + v.norm()));
        }

        #[test]
        fn frame_has_the_asked_z(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64) {
            let n = Vector3::new(x, y, z);
            prop_assume!(n.norm() > 1e-3);
            let n = n.normalize();
            for hint in [Vector3::x(), n, Vector3::new(0.1, -2.0, 0.4)] {
                let r = frame_from_axes(&n, &hint);
                prop_assert!((r * Vector3::z() - n).norm() < 1e-12);
            }
        }
    }
}
