//! Cutting a polygon into triangles.
use nalgebra::{Point2, Point3, Vector3};

/// A polygon with a dent is cut corner by corner, which takes the square of its size: past this it is refused.
const MAX_DENTED: usize = 2000;

/// Cuts the polygon with the given corners (indices into `vertices`, all in range, counter-clockwise) into triangles:
/// as a fan where it is convex, else by cutting off ears (Meisters, doi:10.2307/2319703). `None` for a polygon with a dent and
/// more than 2000 corners.
pub(super) fn triangulate(corners: &[u32], vertices: &[Point3<f64>]) -> Option<Vec<[u32; 3]>> {
    let fan = || corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]]).collect();
    if corners.len() <= 3 {
        return Some(fan());
    }
    let flat = flatten(corners, vertices);
    let n = flat.len();
    if (0..n).all(|i| turn(&flat[i], &flat[(i + 1) % n], &flat[(i + 2) % n]) >= 0.0) {
        return Some(fan());
    }
    (n <= MAX_DENTED).then(|| ears(&flat).into_iter().map(|t| t.map(|i| corners[i])).collect())
}

/// The corners in the plane of the polygon, seen from the side its winding faces (normal by Newell's method).
fn flatten(corners: &[u32], vertices: &[Point3<f64>]) -> Vec<Point2<f64>> {
    let points: Vec<Point3<f64>> = corners.iter().map(|&c| vertices[c as usize]).collect();
    let origin = points[0];
    let next = points.iter().cycle().skip(1);
    let normal: Vector3<f64> = points.iter().zip(next).map(|(a, b)| (a - origin).cross(&(b - origin))).sum();
    let axis = normal.iamax();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mirror = if normal[axis] < 0.0 { -1.0 } else { 1.0 };
    points.iter().map(|p| Point2::new(p[u] * mirror, p[v])).collect()
}

/// Twice the area of the triangle, positive when it turns left.
fn turn(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

fn ears(points: &[Point2<f64>]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut triangles = Vec::with_capacity(points.len() - 2);
    while left.len() > 3 {
        let n = left.len();
        let corner = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
        let is_ear = |i: &usize| {
            let [a, b, c] = corner(*i).map(|k| points[k]);
            let inside = |p: &Point2<f64>| turn(&a, &b, p) > 0.0 && turn(&b, &c, p) > 0.0 && turn(&c, &a, p) > 0.0;
            turn(&a, &b, &c) > 0.0 && !left.iter().any(|&k| inside(&points[k]))
        };
        // A polygon that crosses itself may have no ear: any corner then does.
        let ear = (0..n).find(is_ear).unwrap_or(0);
        triangles.push(corner(ear));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dented_polygon_is_covered_once() {
        // An arrow head, in a tilted plane, wound either way.
        let flat = [(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.8, 1.0)];
        let vertices: Vec<_> = flat.iter().map(|&(x, y)| Point3::new(x, y, 0.5 * x - y)).collect();
        for corners in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 3, 0, 1]] {
            let triangles = triangulate(&corners, &vertices).unwrap();
            let area = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| vertices[i as usize]);
                (b - a).cross(&(c - a))
            };
            let normal: Vector3<f64> = triangles.iter().map(area).sum();
            let covered: f64 = triangles.iter().map(|t| area(t).norm()).sum();
            assert_eq!(triangles.len(), 2);
            assert!((covered - normal.norm()).abs() < 1e-12);
            assert_eq!(normal.z > 0.0, corners[0] != 3);
        }
    }
}
