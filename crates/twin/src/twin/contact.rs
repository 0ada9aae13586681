//! The compliant nib on the true canvas.
//!
//! A felt or fibre tip gives way, so its force follows from how deep it is pressed, and curved triangle meshes need no
//! rigid contact solver: normals are interpolated over the facets, and the force is continuous across their edges.
use nalgebra::{Point3, Vector3};

use crate::mesh::{SurfacePoint, TriMesh};
use crate::pen::NibSpring;

/// How near to the canvas the nib must be for its foot point to be looked for, m; a nib that is under the surface already is looked for
/// so much farther than it was deep.
const REACH: f64 = 0.004;
/// A nib deeper than this that finds itself at the far side of a thin canvas is still under the side that it came from, m.
const THIN: f64 = 0.002;
/// A nib farther than this from its foot point across the normal hangs over the canvas's edge, m.
const OVERHANG: f64 = 5e-4;
/// Cosine between a smooth normal and the line to the ball's centre from which on the ball is on a face (8 degrees) ...
const FACE: f64 = 0.990;
/// ... and below which it is on an edge (20 degrees).
const EDGE_FULL: f64 = 0.940;

/// A nib that touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Where it touches the surface.
    pub at: SurfacePoint,
    /// Where the force acts on the pen, m, world.
    pub point: Point3<f64>,
    /// Normal force, N, above 0.
    pub normal_force: f64,
    /// Force of the canvas on the pen, N, world: normal and friction.
    pub force: Vector3<f64>,
    /// Velocity of the nib along the surface, m/s, world.
    pub slip: Vector3<f64>,
}

/// A nib in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touching {
    /// Its tip, m, world.
    pub tip: Point3<f64>,
    /// Where the pen points, unit, world.
    pub axis: Vector3<f64>,
    /// Velocity of the tip, m/s, world.
    pub velocity: Vector3<f64>,
    /// Least mass that the nib may be felt to have, kg.
    pub mass: f64,
    /// Time since the last step, s.
    pub dt: f64,
}

/// Largest share by which the loss raises the nib's force as it is pressed.
const LARGEST_LOSS: f64 = 0.2;

/// What a nib remembers from step to step: how far its bristles are bent and how deep it was pressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Nib {
    stretch: Vector3<f64>,
    /// How deep it was, m, and the surface's normal there.
    depth: Option<(f64, Vector3<f64>)>,
}

impl Nib {
    /// The contact of a nib in the step after the last call; `None` off the canvas.
    ///
    /// - Normal: `F = k d (1 + c v)` with depth `d` that grows at `v`, the change since the last step (Hunt and Crossley 1975,
    ///   doi:10.1115/1.3423596). The loss is bounded, `0 <= F <= 1.2 k d`: fibres that are lossy under the
    ///   small motions of drawing don't turn hard in a fast landing, and give most of it back as they are let go.
    /// - Friction: bristles of stiffness `k_t` stretch with the slip until they hold `mu F`, then follow (Dahl's model,
    ///   Coulomb limit; Canudas de Wit et al. 1995, doi:10.1109/9.376053), with damping while they stick.
    pub fn touch(&mut self, spring: &NibSpring, friction: f64, canvas: &TriMesh, nib: &Touching) -> Option<Contact> {
        let Touching { tip, axis, velocity, mass, dt } = *nib;
        let before = std::mem::take(self);
        let Press { at, normal: n, depth, point } = if spring.radius > 0.0 {
            ball(canvas, &(tip - axis * spring.radius), spring.radius, before.depth)?
        } else {
            point(canvas, &tip, before.depth)?
        };
        let separation = velocity.dot(&n);
        // the smooth normal leans against the facet, so that the nib's velocity along it isn't how fast it is pressed
        let pressing = before.depth.map_or(-separation, |(last, _)| (depth - last) / dt);
        self.depth = Some((depth, n));
        // semi-implicit: what damping takes from the speed in this step is no longer there to be damped
        let held_back = 1.0 + spring.stiffness * depth * spring.damping * dt / mass;
        let loss = (spring.damping * pressing / held_back).clamp(-1.0, LARGEST_LOSS);
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
        Some(Contact { at, point, normal_force, force: n * normal_force + hold, slip })
    }
}

/// How a nib is pressed into the surface.
struct Press {
    at: SurfacePoint,
    /// Direction in which the surface pushes the nib, unit, world.
    normal: Vector3<f64>,
    /// How deep the nib is in, m, above 0.
    depth: f64,
    /// Where the push acts on the pen, m, world.
    point: Point3<f64>,
}

/// A pointed nib: pressed as deep as its tip lies under the surface.
fn point(canvas: &TriMesh, tip: &Point3<f64>, before: Option<(f64, Vector3<f64>)>) -> Option<Press> {
    let at = foot(canvas, tip, before)?;
    let normal = at.normal;
    let offset = tip - at.position;
    let depth = -offset.dot(&normal);
    let over = depth <= 0.0 || (offset + normal * depth).norm() > OVERHANG + depth;
    (!over).then_some(Press { at, normal, depth, point: *tip })
}

/// A nib that ends in a ball: pressed as deep as the ball's nearest surface point lies within the ball.
fn ball(canvas: &TriMesh, center: &Point3<f64>, radius: f64, before: Option<(f64, Vector3<f64>)>) -> Option<Press> {
    let deep = before.map_or(0.0, |(depth, _)| depth);
    // a centre that was under the surface looks as far as it may have sunk since
    let at = canvas.closest_point_within(center, radius.max(deep - radius + REACH))?;
    let offset = center - at.position;
    let distance = offset.norm();
    let along = offset.dot(&at.normal);
    let inside = along < 0.0;
    if inside && before.is_none() {
        // never met: behind the canvas or over its open edge
        return None;
    }
    let depth = radius - if inside { -distance } else { distance };
    // On a face the smooth normal keeps the force steady over facets; over an edge the push turns with the line to the centre.
    let normal = if inside || distance < 0.25 * radius {
        at.normal
    } else {
        let line = offset / distance;
        let share = ((line.dot(&at.normal) - EDGE_FULL) / (FACE - EDGE_FULL)).clamp(0.0, 1.0);
        let share = share * share * (3.0 - 2.0 * share);
        (line * (1.0 - share) + at.normal * share).normalize()
    };
    (depth > 0.0).then_some(Press { at, normal, depth, point: at.position })
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
        NibSpring {
            stiffness: 1.75e4,
            damping: 5.0,
            lateral_stiffness: 5e4,
            lateral_damping: 20.0,
            friction: 0.3,
            radius: 0.0,
        }
    }

    /// A nib at `tip` that points down.
    fn down(tip: Point3<f64>, velocity: Vector3<f64>) -> Touching {
        Touching { tip, axis: -Vector3::z(), velocity, mass: f64::INFINITY, dt: 1e-3 }
    }

    /// Normal forces of a nib that moves down from the surface by `step` (m) each millisecond.
    fn pressed(canvas: &TriMesh, step: f64, count: u32) -> Vec<f64> {
        let mut nib = Nib::default();
        let velocity = Vector3::new(0.0, 0.0, -step / 1e-3);
        let at = |i: u32| Point3::new(0.001, 0.002, -step * f64::from(i));
        (1..=count)
            .map(|i| nib.touch(&spring(), 0.3, canvas, &down(at(i), velocity)).map_or(0.0, |c| c.normal_force))
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
        assert_eq!(Nib::default().touch(&spring(), 0.3, &block, &down(at, Vector3::zeros())), None);
    }

    const BALL: f64 = 2.5e-3;

    /// Contact of a ball-ended nib with its tip at (x, 0, z) over `canvas`, `None` where it touches nothing.
    fn rolled(canvas: &TriMesh, x: f64, z: f64) -> Option<Contact> {
        let round = NibSpring { radius: BALL, ..spring() };
        let tip = Point3::new(x, 0.0, z);
        Nib::default().touch(&round, 0.0, canvas, &down(tip, Vector3::zeros()))
    }

    /// Two blocks with their tops at z = 0 and a gap in x between them.
    fn split(gap: f64) -> TriMesh {
        let block = shapes::rectangle(0.1, 0.1, 0.03, 0.02).unwrap();
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for x in [-0.05 - gap / 2.0, 0.05 + gap / 2.0] {
            let first = vertices.len() as u32;
            vertices.extend(block.vertices().iter().map(|v| v + Vector3::x() * x));
            triangles.extend(block.triangles().iter().map(|t| t.map(|v| v + first)));
        }
        TriMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn a_ball_on_a_face_is_pressed_as_deep_as_its_tip() {
        let block = shapes::rectangle(0.3, 0.3, 0.1, 0.02).unwrap();
        let contact = rolled(&block, 0.003, -1e-4).unwrap();
        assert!((contact.normal_force / (1.75e4 * 1e-4) - 1.0).abs() < 1e-9, "{} N", contact.normal_force);
        assert!((contact.at.position.x - 0.003).abs() < 1e-12 && (contact.force.normalize().z - 1.0).abs() < 1e-12);
        assert_eq!(rolled(&block, 0.003, 1e-6), None);
    }

    #[test]
    fn a_ball_sinks_into_a_gap_by_what_its_radius_tells() {
        // r - sqrt(r^2 - (g / 2)^2)
        let (gap, sunk) = (3e-3, BALL - (BALL * BALL - 1.5e-3_f64.powi(2)).sqrt());
        let canvas = split(gap);
        assert_eq!(rolled(&canvas, 0.0, -sunk + 1e-6), None);
        let held = rolled(&canvas, 1e-9, -sunk - 1e-5).unwrap();
        assert!((held.at.position.x - gap / 2.0).abs() < 1e-9);
        // the push is from the edge to the centre, leaning inward
        let lean = held.force.normalize();
        assert!((lean.x + 1.5e-3 / BALL).abs() < 0.02 && lean.z > 0.7, "{lean}");
    }

    #[test]
    fn the_push_on_a_ball_that_passes_an_edge_never_jumps() {
        let canvas = split(4e-3);
        let pushes: Vec<Vector3<f64>> = (0..600)
            .map(|i| rolled(&canvas, -6e-3 + 1e-5 * f64::from(i), -2e-5).map_or(Vector3::zeros(), |c| c.force))
            .collect();
        let jump = pushes.windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max);
        assert!(pushes[0].z > 0.3 && pushes[599].norm() < 1e-9 && jump < 0.05, "{jump} N");
    }
}
