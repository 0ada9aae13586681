//! The smallest capsule found around a set of points.
use nalgebra::{Matrix3, Point3, Vector2, Vector3};

use super::Capsule;

/// Directions tried for the axis before refinement.
const DIRECTIONS: usize = 160;

/// Rounds of refinement about the best axis, each with half the spread of the one before.
const ROUNDS: usize = 8;

/// Points kept for the search (the extreme ones along as many directions); the radius is then set from all points.
const SUPPORT_DIRECTIONS: usize = 600;

/// A capsule that contains every point, and so their convex hull.
///
/// Axes tried: the principal axes of the points, a spiral of 160 directions over the half sphere, and shrinking spirals
/// about the best of them. For each axis the capsule follows from the smallest circle around the points' shadows; the
/// one of least volume is kept. It is a conservative stand-in for a mesh: never too small, up to a few percent larger
/// than the optimum, and loose around bent shapes. `None` without points.
pub fn enclosing_capsule(points: &[Point3<f64>]) -> Option<Capsule> {
    let first = points.first()?;
    let support = extreme_points(points);
    let mut best: Option<(f64, Vector3<f64>, Capsule)> = None;
    let try_axis = |axis: Vector3<f64>, best: &mut Option<(f64, Vector3<f64>, Capsule)>| {
        let capsule = about_axis(&support, &axis);
        let v = volume(&capsule);
        if best.as_ref().is_none_or(|(least, ..)| v < *least) {
            *best = Some((v, axis, capsule));
        }
    };
    for axis in principal_axes(&support).into_iter().chain(half_sphere(DIRECTIONS)) {
        try_axis(axis, &mut best);
    }
    let mut spread = 0.2;
    for _ in 0..ROUNDS {
        let centre = best.as_ref().map_or(Vector3::z(), |(_, axis, _)| *axis);
        for d in half_sphere(12).flat_map(|d| [d, -d]) {
            try_axis((centre + d * spread).normalize(), &mut best);
        }
        spread *= 0.5;
    }
    let mut capsule = best.map_or(Capsule { a: *first, b: *first, radius: 0.0 }, |(_, _, capsule)| capsule);
    let reach = points.iter().map(|p| distance_to_segment(p, &capsule.a, &capsule.b)).fold(0.0, f64::max);
    capsule.radius = reach * (1.0 + 1e-12) + 1e-12;
    Some(capsule)
}

/// The enclosing capsule, along z, of a cylinder about z centred at the origin: the end points are drawn in by the
/// amount that makes the volume least while the rims stay inside.
pub fn around_cylinder(radius: f64, length: f64) -> Capsule {
    let half = length * 0.5;
    let at = |inset: f64| {
        let end = half - inset;
        Capsule { a: Point3::new(0.0, 0.0, -end), b: Point3::new(0.0, 0.0, end), radius: radius.hypot(inset) }
    };
    (0..=64).map(|i| at(half * f64::from(i) / 64.0)).min_by(|a, b| volume(a).total_cmp(&volume(b))).unwrap_or(at(0.0))
}

/// Distance of `p` from the segment `a`-`b`, m.
fn distance_to_segment(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let ab = b - a;
    let length2 = ab.norm_squared();
    let t = if length2 > 0.0 { ((p - a).dot(&ab) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + ab * t)).norm()
}

fn volume(c: &Capsule) -> f64 {
    std::f64::consts::PI * c.radius.powi(2) * ((c.b - c.a).norm() + 4.0 / 3.0 * c.radius)
}

/// The smallest capsule along `axis` (unit) whose radius is that of the shadow's smallest circle.
fn about_axis(points: &[Point3<f64>], axis: &Vector3<f64>) -> Capsule {
    let x = if axis.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let x = (x - axis * axis.dot(&x)).normalize();
    let y = axis.cross(&x);
    let shadow: Vec<Vector2<f64>> = points.iter().map(|p| Vector2::new(p.coords.dot(&x), p.coords.dot(&y))).collect();
    let (centre, radius) = enclosing_circle(&shadow);
    // Each point must lie within `radius` of the segment: heights that the ends have to reach.
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (p, s) in points.iter().zip(&shadow) {
        let h = p.coords.dot(axis);
        let cap = (radius * radius - (s - centre).norm_squared()).max(0.0).sqrt();
        low = low.min(h + cap);
        high = high.max(h - cap);
    }
    if low > high {
        (low, high) = (0.5 * (low + high), 0.5 * (low + high));
    }
    let foot = x * centre.x + y * centre.y;
    Capsule { a: Point3::from(foot + axis * low), b: Point3::from(foot + axis * high), radius }
}

/// A circle around all points, within 1 % of the smallest (Badoiu and Clarkson 2003: step towards the farthest point by
/// 1/(i+1)).
fn enclosing_circle(points: &[Vector2<f64>]) -> (Vector2<f64>, f64) {
    let farthest = |c: &Vector2<f64>| {
        points.iter().map(|p| ((p - c).norm(), *p)).fold((0.0, *c), |a, b| if b.0 > a.0 { b } else { a })
    };
    let mut centre = points.iter().sum::<Vector2<f64>>() / points.len().max(1) as f64;
    for i in 1..=100 {
        let (_, p) = farthest(&centre);
        centre += (p - centre) / f64::from(i + 1);
    }
    (centre, farthest(&centre).0)
}

/// The points farthest along each of a fixed set of directions, in order of first use.
fn extreme_points(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    if points.len() <= SUPPORT_DIRECTIONS {
        return points.to_vec();
    }
    let mut chosen: Vec<usize> = half_sphere(SUPPORT_DIRECTIONS / 2)
        .flat_map(|d| [d, -d])
        .filter_map(|d| {
            (0..points.len()).max_by(|i, j| points[*i].coords.dot(&d).total_cmp(&points[*j].coords.dot(&d)))
        })
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|i| points[i]).collect()
}

/// `count` directions spread evenly over the upper half sphere (Fibonacci spiral).
fn half_sphere(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |i| {
        let z = (i as f64 + 0.5) / count as f64;
        let (s, c) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * c, r * s, z)
    })
}

/// Directions of greatest, middle and least spread.
fn principal_axes(points: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let spread: Matrix3<f64> = points.iter().map(|p| (p.coords - mean) * (p.coords - mean).transpose()).sum();
    let eigen = spread.try_symmetric_eigen(1e-12, 200);
    eigen.map_or_else(Vec::new, |e| e.eigenvectors.column_iter().map(|c| c.into_owned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn every_point_is_inside(
            v in proptest::collection::vec((-1.0..1.0f64, -0.3..0.3f64, -0.1..0.1f64), 1..700),
        ) {
            let points: Vec<_> = v.iter().map(|(x, y, z)| Point3::new(*x, *y, *z)).collect();
            let c = enclosing_capsule(&points).expect("there are points");
            for p in &points {
                prop_assert!(distance_to_segment(p, &c.a, &c.b) <= c.radius);
            }
        }

        #[test]
        fn a_capsule_is_found_again(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, r in 0.02..0.2f64) {
            prop_assume!(Vector3::new(x, y, z).norm() > 0.3);
            let (a, b) = (Point3::new(-x, -y, -z) * 0.3, Point3::new(x, y, z) * 0.3);
            let points: Vec<_> = half_sphere(200).flat_map(|d| [a + d * r, a - d * r, b + d * r, b - d * r]).collect();
            let c = enclosing_capsule(&points).expect("there are points");
            prop_assert!(c.radius < 1.05 * r, "{} for {r}", c.radius);
            let exact = Capsule { a, b, radius: r };
            prop_assert!(volume(&c) < 1.12 * volume(&exact));
        }

        #[test]
        fn a_cylinder_is_inside_its_capsule(r in 0.01..1.0f64, l in 0.01..1.0f64) {
            let c = around_cylinder(r, l);
            prop_assert!(distance_to_segment(&Point3::new(r, 0.0, l * 0.5), &c.a, &c.b) <= c.radius * (1.0 + 1e-12));
            prop_assert!(c.radius >= r);
        }
    }
}
