//! One triangle: nearest point, ray hit and distance to a segment.
use nalgebra::{Point3, Vector3};

/// A triangle whose height is below this share of its longest edge has no usable normal and counts as having no area.
const MIN_ASPECT: f64 = 1e-9;
/// How far outside a triangle, in barycentric coordinates, a ray still hits it: rays through an edge that two
/// triangles share must not slip between them by rounding.
const HIT_TOLERANCE: f64 = 1e-9;

/// The corners of a triangle, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub a: Point3<f64>,
    pub b: Point3<f64>,
    pub c: Point3<f64>,
}

impl Triangle {
    /// The triangle with corners `indices` into `vertices`.
    #[inline]
    pub fn of(vertices: &[Point3<f64>], indices: &[u32; 3]) -> Self {
        let [a, b, c] = indices.map(|i| vertices[i as usize]);
        Self { a, b, c }
    }

    /// Normal whose length is twice the area, m2.
    pub fn area_vector(&self) -> Vector3<f64> {
        (self.b - self.a).cross(&(self.c - self.a))
    }

    /// Unit normal, `None` for a triangle without area.
    pub fn unit_normal(&self) -> Option<Vector3<f64>> {
        let n = self.area_vector();
        let longest2 = self.edges().iter().map(Vector3::norm_squared).fold(0.0, f64::max);
        // A subnormal or zero norm can't be divided by.
        let norm = n.norm();
        (norm > MIN_ASPECT * longest2 && norm > f64::MIN_POSITIVE).then(|| n / norm)
    }

    fn edges(&self) -> [Vector3<f64>; 3] {
        [self.b - self.a, self.c - self.b, self.a - self.c]
    }

    /// Interior angles at the three corners, rad.
    pub fn angles(&self) -> [f64; 3] {
        let [ab, bc, ca] = self.edges();
        let angle = |u: Vector3<f64>, v: Vector3<f64>| u.cross(&v).norm().atan2(u.dot(&v));
        [angle(ab, -ca), angle(bc, -ab), angle(ca, -bc)]
    }

    /// The point with the given barycentric coordinates.
    #[inline]
    pub fn at(&self, [u, v, w]: [f64; 3]) -> Point3<f64> {
        Point3::from(self.a.coords * u + self.b.coords * v + self.c.coords * w)
    }

    /// Barycentric coordinates of the point nearest to `p`, and its squared distance (m2). By Voronoi regions
    /// (C. Ericson, Real-Time Collision Detection, section 5.1.5).
    #[inline]
    pub fn closest(&self, p: &Point3<f64>) -> ([f64; 3], f64) {
        let barycentric = self.closest_barycentric(p);
        (barycentric, (self.at(barycentric) - p).norm_squared())
    }

    #[inline]
    fn closest_barycentric(&self, p: &Point3<f64>) -> [f64; 3] {
        let (ab, ac, ap) = (self.b - self.a, self.c - self.a, p - self.a);
        let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return [1.0, 0.0, 0.0];
        }
        let bp = p - self.b;
        let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
        if d3 >= 0.0 && d4 <= d3 {
            return [0.0, 1.0, 0.0];
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            let v = d1 / (d1 - d3);
            return [1.0 - v, v, 0.0];
        }
        let cp = p - self.c;
        let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
        if d6 >= 0.0 && d5 <= d6 {
            return [0.0, 0.0, 1.0];
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            let w = d2 / (d2 - d6);
            return [1.0 - w, 0.0, w];
        }
        let va = d3 * d6 - d5 * d4;
        let (e, f) = (d4 - d3, d5 - d6);
        if va <= 0.0 && e >= 0.0 && f >= 0.0 {
            let w = e / (e + f);
            return [0.0, 1.0 - w, w];
        }
        let sum = va + vb + vc;
        let (v, w) = (vb / sum, vc / sum);
        [1.0 - v - w, v, w]
    }

    /// Distance along the ray (in lengths of `direction`) and barycentric coordinates where it meets the triangle, from either side
    /// (Moeller and Trumbore, doi:10.1080/10867651.1997.10487468).
    #[inline]
    pub fn hit(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<(f64, [f64; 3])> {
        let (ab, ac) = (self.b - self.a, self.c - self.a);
        let h = direction.cross(&ac);
        let det = ab.dot(&h);
        // Parallel within rounding: the ray meets the plane nowhere or everywhere.
        if det * det <= 1e-24 * ab.norm_squared() * ac.norm_squared() * direction.norm_squared() {
            return None;
        }
        let s = origin - self.a;
        let v = s.dot(&h) / det;
        let q = s.cross(&ab);
        let w = direction.dot(&q) / det;
        let t = ac.dot(&q) / det;
        let inside = v >= -HIT_TOLERANCE && w >= -HIT_TOLERANCE && v + w <= 1.0 + HIT_TOLERANCE;
        if !inside || t < 0.0 {
            return None;
        }
        let (v, w) = (v.clamp(0.0, 1.0), w.clamp(0.0, 1.0));
        let sum = (v + w).max(1.0);
        let (v, w) = (v / sum, w / sum);
        Some((t, [1.0 - v - w, v, w]))
    }

    /// Squared distance (m2) to the segment `p`-`q`; 0 where it crosses.
    pub fn squared_distance_to_segment(&self, p: &Point3<f64>, q: &Point3<f64>) -> f64 {
        let along = q - p;
        if let Some((t, _)) = self.hit(p, &along)
            && t <= 1.0
        {
            return 0.0;
        }
        let ends = self.closest(p).1.min(self.closest(q).1);
        [(self.a, self.b), (self.b, self.c), (self.c, self.a)]
            .iter()
            .map(|(a, b)| squared_distance_of_segments(p, q, a, b))
            .fold(ends, f64::min)
    }
}

/// Squared distance (m2) between segments `p1`-`q1` and `p2`-`q2` (C. Ericson, Real-Time Collision Detection, section
/// 5.1.9).
fn squared_distance_of_segments(p1: &Point3<f64>, q1: &Point3<f64>, p2: &Point3<f64>, q2: &Point3<f64>) -> f64 {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let (c, b) = (d1.dot(&r), d1.dot(&d2));
    let clamp = |num: f64, den: f64| if den > 0.0 { (num / den).clamp(0.0, 1.0) } else { 0.0 };
    let mut s = clamp(b * f - c * e, a * e - b * b);
    let mut t = if e > 0.0 { (b * s + f) / e } else { 0.0 };
    if t < 0.0 {
        t = 0.0;
        s = clamp(-c, a);
    } else if t > 1.0 {
        t = 1.0;
        s = clamp(b - c, a);
    } else if e == 0.0 {
        s = clamp(-c, a);
    }
    ((p1 + d1 * s) - (p2 + d2 * t)).norm_squared()
}
