//! The compliant nib on the true canvas.
//!
//! A felt or fibre tip gives way, so its force follows from how deep it is pressed, and curved triangle meshes need no
//! rigid contact solver: normals are interpolated over the facets, and the force is continuous across their edges.
use nalgebra::{Point3, Vector3};

use crate::ink::NibSpring;
use crate::mesh::{SurfacePoint, TriMesh};

/// How near to the canvas the nib must be for its foot point to be looked for, m; a nib that is under the surface already is looked for
/// so much farther than it was deep.
const REACH: f64 = 0.004;
/// A nib deeper than this that finds itself at the far side of a thin canvas is still under the side that it came from, m.
const THIN: f64 = 0.002;
/// A nib farther than this from its foot point across the normal hangs over the canvas's edge, m.
const OVERHANG: f64 = 5e-4;

/// A nib that touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Where it touches the surface.
    pub at: SurfacePoint,
    /// Normal force, N, above 0.
    pub normal_force: f64,
    /// Force of the canvas on the pen, N, world: normal and friction.
    pub force: Vector3<f64>,
    /// Velocity of the nib along the surface, m/s, world.
    pub slip: Vector3<f64>,
}

/// Largest share by which the loss raises the nib's force as it is pressed.
const LARGEST_LOSS: f64 = 0.2;

/// What a nib remembers from step to step: how far its bristles are bent and how deep it was pressed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nib {
    stretch: Vector3<f64>,
    /// How deep it was, m, and the surface's normal there.
    depth: Option<(f64, Vector3<f64>)>,
}

impl Nib {
    /// The contact of a nib at `tip` (m, world) that moves at `velocity` (m/s), `dt` s after the last call; `None` off
    /// the canvas.
    ///
    /// - Normal: `F = k d (1 + c v)` with depth `d` that grows at `v`, the change since the last step (Hunt and Crossley 1975,
    ///   doi:10.1115/1.3423596). The loss is bounded, `0 <= F <= 1.2 k d`: fibres that are lossy under the
    ///   small motions of drawing don't turn hard in a fast landing, and give most of it back as they are let go.
    /// - Friction: bristles of stiffness `k_t` stretch with the slip until they hold `mu F`, then follow (Dahl's model,
    ///   Coulomb limit; Canudas de Wit et al. 1995, doi:10.1109/9.376053), with damping while they stick.
    pub fn touch(
        &mut self,
        spring: &NibSpring,
        friction: f64,
        canvas: &TriMesh,
        tip: &Point3<f64>,
        velocity: &Vector3<f64>,
        dt: f64,
    ) -> Option<Contact> {
        let before = std::mem::take(self);
        let at = foot(canvas, tip, before.depth)?;
        let n = at.normal;
        let offset = tip - at.position;
        let depth = -offset.dot(&n);
        if depth <= 0.0 || (offset + n * depth).norm() > OVERHANG + depth {
            return None;
        }
        let separation = velocity.dot(&n);
        // the smooth normal leans against the facet, so that the nib's velocity along it isn't how fast it is pressed
        let pressing = before.depth.map_or(-separation, |(last, _)| (depth - last) / dt);
        self.depth = Some((depth, n));
        let loss = (spring.damping * pressing).clamp(-1.0, LARGEST_LOSS);
        let normal_force = spring.stiffness * depth * (1.0 + loss);
        if normal_force <= 0.0 {
            // the fibres come back more slowly than the pen leaves
            return None;
        }
        let slip = velocity - n * separation;
        // the bristles turn with the surface, then stretch with the slip
        let mut stretch = before.stretch - n * before.stretch.dot(&n) + slip * dt;
        let limit = friction * normal_force;
        let mut hold = stretch * -spring.lateral_stiffness;
        let pull = hold.norm();
        if pull > limit {
            stretch *= limit / pull;
            hold *= limit / pull;
        } else {
            let damped = hold - slip * spring.lateral_damping;
            let size = damped.norm();
            hold = if size > limit { damped * (limit / size) } else { damped };
        }
        self.stretch = stretch;
        Some(Contact { at, normal_force, force: n * normal_force + hold, slip })
    }
}

/// The surface point that a nib at `tip` touches, if it is near enough; `before` is how deep it was a step ago, and the normal there.
fn foot(canvas: &TriMesh, tip: &Point3<f64>, before: Option<(f64, Vector3<f64>)>) -> Option<SurfacePoint> {
    let Some((depth, normal)) = before else { return canvas.closest_point_within(tip, REACH) };
    let nearest = canvas.closest_point_within(tip, depth + REACH)?;
    if depth > THIN && nearest.normal.dot(&normal) < 0.0 {
        // the far side is nearer than the one that the nib was pushed through; it comes out where it went in
        let through = canvas.cast_ray(tip, &normal, depth + REACH);
        return through.filter(|s| s.normal.dot(&normal) > 0.0).or(Some(nearest));
    }
    Some(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn spring() -> NibSpring {
        NibSpring { stiffness: 1.75e4, damping: 5.0, lateral_stiffness: 5e4, lateral_damping: 20.0, friction: 0.3 }
    }

    /// Normal forces of a nib that moves down from the surface by `step` (m) each millisecond.
    fn pressed(canvas: &TriMesh, step: f64, count: u32) -> Vec<f64> {
        let mut nib = Nib::default();
        let velocity = Vector3::new(0.0, 0.0, -step / 1e-3);
        let at = |i: u32| Point3::new(0.001, 0.002, -step * f64::from(i));
        (1..=count)
            .map(|i| nib.touch(&spring(), 0.3, canvas, &at(i), &velocity, 1e-3).map_or(0.0, |c| c.normal_force))
            .collect()
    }

    #[test]
    fn force_keeps_rising_with_depth() {
        let block = shapes::rectangle(0.3, 0.3, 0.1, 0.02).unwrap();
        let forces = pressed(&block, 2e-5, 1000);
        assert!(forces.windows(2).all(|w| w[1] > w[0]));
        let last = forces[forces.len() - 1];
        assert!((last / (1.75e4 * 0.02) - 1.0).abs() < 0.15, "{last} N at 20 mm");
    }

    #[test]
    fn a_nib_does_not_come_out_at_the_far_side_of_a_thin_canvas() {
        let board = shapes::rectangle(0.3, 0.3, 0.01, 0.02).unwrap();
        let forces = pressed(&board, 2e-5, 450);
        assert!(forces.windows(2).all(|w| w[1] > w[0]), "{forces:?}");
    }

    #[test]
    fn a_nib_far_under_a_surface_that_it_never_met_touches_nothing() {
        let block = shapes::rectangle(0.3, 0.3, 0.1, 0.02).unwrap();
        let at = Point3::new(0.0, 0.0, -0.01);
        assert_eq!(Nib::default().touch(&spring(), 0.3, &block, &at, &Vector3::zeros(), 1e-3), None);
    }
}
