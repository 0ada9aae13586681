//! Solids as signed distances (mm, negative inside), blended with fillets.
use nalgebra::{Point3, Vector3};

/// Distance to a solid; need not be exact away from its surface.
pub type Solid = Box<dyn Fn(&Point3<f64>) -> f64>;

/// A point from three coordinates, mm.
pub fn at(x: f64, y: f64, z: f64) -> Point3<f64> {
    Point3::new(x, y, z)
}

/// A cylinder from `a` to `b` whose rims are rounded by `round`.
pub fn cylinder(a: Point3<f64>, b: Point3<f64>, radius: f64, round: f64) -> Solid {
    let middle = nalgebra::center(&a, &b);
    let (axis, half) = ((b - a).normalize(), (b - a).norm() * 0.5);
    Box::new(move |p| {
        let d = p - middle;
        let along = d.dot(&axis);
        let out = (d - axis * along).norm() - (radius - round);
        let over = along.abs() - (half - round);
        out.max(0.0).hypot(over.max(0.0)) + out.max(over).min(0.0) - round
    })
}

/// A ball-ended rod whose radius goes from `ra` at `a` to `rb` at `b`.
pub fn rod(a: Point3<f64>, ra: f64, b: Point3<f64>, rb: f64) -> Solid {
    let ab = b - a;
    Box::new(move |p| {
        let t = ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0);
        let s = t * t * (3.0 - 2.0 * t);
        (p - (a + ab * t)).norm() - (ra + (rb - ra) * s)
    })
}

/// A box with rounded edges.
pub fn block(centre: Point3<f64>, size: Vector3<f64>, round: f64) -> Solid {
    Box::new(move |p| {
        let q = (p - centre).abs() - size * 0.5 + Vector3::repeat(round);
        q.sup(&Vector3::zeros()).norm() + q.max().min(0.0) - round
    })
}

/// Everything on the side of the plane through `p0` that `normal` (unit) points away from.
pub fn behind(p0: Point3<f64>, normal: Vector3<f64>) -> Solid {
    Box::new(move |p| (p - p0).dot(&normal))
}

/// Both solids, with a fillet of about `blend` between them.
pub fn join(a: Solid, b: Solid, blend: f64) -> Solid {
    Box::new(move |p| smooth_min(a(p), b(p), blend))
}

/// What is in both solids, edges rounded by about `blend`.
pub fn common(a: Solid, b: Solid, blend: f64) -> Solid {
    Box::new(move |p| -smooth_min(-a(p), -b(p), blend))
}

/// `a` without `b`, edges rounded by about `blend`.
pub fn cut(a: Solid, b: Solid, blend: f64) -> Solid {
    Box::new(move |p| -smooth_min(-a(p), b(p), blend))
}

/// The quadratic smooth minimum.
fn smooth_min(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}
