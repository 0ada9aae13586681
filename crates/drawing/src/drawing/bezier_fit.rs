//! Piecewise cubic Bezier splines of varying width through dense points.
//!
//! Position: least-squares cubics with given end tangents, split where the error is largest (Schneider, "An Algorithm for
//! Automatically Fitting Digitized Curves", Graphics Gems, 1990), with breaks at corners. Width: a cubic in the same
//! parameter, so that a piece is one cubic Bezier curve in x, y and width: a curve of varying offset.
use kurbo::{CubicBez, ParamCurve, ParamCurveDeriv, Point, Vec2};

/// What a fit must keep. Lengths in the unit of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FitOptions {
    /// Largest distance of a point from the spline.
    pub tolerance: f64,
    /// Largest error of the width at a point.
    pub width_tolerance: f64,
    /// A turn above this is a corner, rad.
    pub corner: f64,
}

/// A cubic piece of a line whose width is a cubic too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bezier {
    /// The centre line.
    pub curve: CubicBez,
    /// Bernstein coefficients of the width.
    pub width: [f64; 4],
}

/// Steps of Newton's method that improve the points' parameters before a piece is split.
const REPARAMETRIZATIONS: usize = 6;
/// Turns are looked at over this many tolerances to both sides.
const CORNER_REACH: f64 = 8.0;
/// Tangents are taken over this many tolerances.
const TANGENT_REACH: f64 = 10.0;
/// Halvings of a piece when it is flattened.
const MAX_HALVINGS: u32 = 12;

/// The spline through `points` (at least two, no two neighbours equal) with the widths there.
pub(super) fn fit(points: &[Point], widths: &[f64], options: &FitOptions) -> Vec<Bezier> {
    let mut length = vec![0.0; points.len()];
    for i in 1..points.len() {
        length[i] = length[i - 1] + points[i].distance(points[i - 1]);
    }
    let line = Line { points, widths, length: &length, options };
    let mut breaks = vec![0];
    breaks.extend(line.corners());
    breaks.push(points.len() - 1);
    let mut pieces = Vec::new();
    for w in breaks.windows(2) {
        line.fit_between(w[0], w[1], &mut pieces);
    }
    pieces
}

/// Points and widths of the line so closely that neither strays from the spline by more than these tolerances between
/// two points.
pub(super) fn flatten(pieces: &[Bezier], tolerance: f64, width_tolerance: f64) -> (Vec<Point>, Vec<f64>) {
    let (mut points, mut widths) = (Vec::new(), Vec::new());
    if let Some(first) = pieces.first() {
        points.push(first.curve.p0);
        widths.push(first.width[0]);
    }
    for piece in pieces {
        let mut open = vec![(0.0, 1.0, 0)];
        while let Some((a, b, halvings)) = open.pop() {
            let middle = 0.5 * (a + b);
            if halvings < MAX_HALVINGS && piece.strays(a, b, tolerance, width_tolerance) {
                open.extend([(middle, b, halvings + 1), (a, middle, halvings + 1)]);
                continue;
            }
            points.push(piece.curve.eval(b));
            widths.push(piece.width_at(b));
        }
    }
    (points, widths)
}

impl Bezier {
    /// Width at the parameter `u`.
    pub(super) fn width_at(&self, u: f64) -> f64 {
        bernstein(u).iter().zip(&self.width).map(|(b, w)| b * w).sum()
    }

    /// Whether the straight line between two parameters is too far from the curve, or its width from the width.
    fn strays(&self, a: f64, b: f64, tolerance: f64, width_tolerance: f64) -> bool {
        let (p, q) = (self.curve.eval(a), self.curve.eval(b));
        let (v, w) = (self.width_at(a), self.width_at(b));
        let chord = q - p;
        [0.25, 0.5, 0.75].iter().any(|share| {
            let u = a + share * (b - a);
            let offset = self.curve.eval(u) - p;
            let along = (offset.dot(chord) / chord.hypot2().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            (offset - chord * along).hypot() > tolerance
                || (v + (w - v) * along - self.width_at(u)).abs() > width_tolerance
        })
    }
}

/// Bernstein polynomials of degree 3.
fn bernstein(u: f64) -> [f64; 4] {
    let v = 1.0 - u;
    [v * v * v, 3.0 * u * v * v, 3.0 * u * u * v, u * u * u]
}

/// The points with the length of the way to each.
struct Line<'a> {
    points: &'a [Point],
    widths: &'a [f64],
    length: &'a [f64],
    options: &'a FitOptions,
}

impl Line<'_> {
    /// The index at least `reach` before (or after) `i`, but not past `first` and `last`.
    fn back(&self, i: usize, reach: f64, first: usize) -> usize {
        (first..i).rev().find(|k| self.length[i] - self.length[*k] >= reach).unwrap_or(first)
    }
    fn ahead(&self, i: usize, reach: f64, last: usize) -> usize {
        (i + 1..=last).find(|k| self.length[*k] - self.length[i] >= reach).unwrap_or(last)
    }

    /// Inner points where the line turns sharply: of each such stretch the sharpest.
    fn corners(&self) -> Vec<usize> {
        let (last, reach) = (self.points.len() - 1, CORNER_REACH * self.options.tolerance);
        let turn = |i: usize| {
            let (a, b) = (self.back(i, reach, 0), self.ahead(i, reach, last));
            let (u, v) = (self.points[i] - self.points[a], self.points[b] - self.points[i]);
            u.cross(v).abs().atan2(u.dot(v))
        };
        let mut corners: Vec<(usize, f64)> = Vec::new();
        for i in 1..last {
            let sharp = turn(i);
            if sharp <= self.options.corner {
                continue;
            }
            match corners.last_mut() {
                Some(before) if self.length[i] - self.length[before.0] < reach => {
                    if sharp > before.1 {
                        *before = (i, sharp);
                    }
                }
                _ => corners.push((i, sharp)),
            }
        }
        corners.into_iter().map(|(i, _)| i).collect()
    }

    /// Unit tangent at `i`, from the points around it between `first` and `last`.
    fn tangent(&self, i: usize, first: usize, last: usize) -> Vec2 {
        let reach = TANGENT_REACH * self.options.tolerance;
        let (a, b) = (self.back(i, reach, first), self.ahead(i, reach, last));
        let d = self.points[b] - self.points[a];
        // a line that returns on itself within the reach has no tangent there; any direction will do
        if d.hypot() > 0.0 { d.normalize() } else { Vec2::new(1.0, 0.0) }
    }

    /// Appends pieces from point `first` to point `last`.
    fn fit_between(&self, first: usize, last: usize, pieces: &mut Vec<Bezier>) {
        let mut open = vec![(first, last, self.tangent(first, first, last), self.tangent(last, first, last))];
        while let Some((a, b, start, end)) = open.pop() {
            match self.piece(a, b, start, end) {
                Ok(piece) => pieces.push(piece),
                Err(split) => {
                    let across = self.tangent(split, a, b);
                    open.extend([(split, b, across, end), (a, split, start, across)]);
                }
            }
        }
    }

    /// One piece from point `a` to point `b` with unit tangents `start` and `end`, both along the line; or where to
    /// split.
    fn piece(&self, a: usize, b: usize, start: Vec2, end: Vec2) -> Result<Bezier, usize> {
        let (p, q) = (self.points[a], self.points[b]);
        if b == a + 1 {
            let third = p.distance(q) / 3.0;
            let (w, x) = (self.widths[a], self.widths[b]);
            let width = [w, w + (x - w) / 3.0, x - (x - w) / 3.0, x];
            return Ok(Bezier { curve: CubicBez::new(p, p + start * third, q - end * third, q), width });
        }
        let whole = self.length[b] - self.length[a];
        let mut u: Vec<f64> = (a..=b).map(|i| (self.length[i] - self.length[a]) / whole).collect();
        let mut worst = (f64::INFINITY, a + 1);
        for _ in 0..=REPARAMETRIZATIONS {
            let curve = self.least_squares(a, &u, start, end);
            worst = self.farthest(a, &u, &curve);
            if worst.0 <= self.options.tolerance {
                let (width, error) = self.width(a, &u);
                return if error.0 <= self.options.width_tolerance {
                    Ok(Bezier { curve, width })
                } else {
                    Err(error.1)
                };
            }
            if worst.0 > 6.0 * self.options.tolerance {
                break;
            }
            improve(&curve, &self.points[a..=b], &mut u);
        }
        Err(worst.1)
    }

    /// The cubic with these end tangents that is nearest to the points at their parameters.
    fn least_squares(&self, a: usize, u: &[f64], start: Vec2, end: Vec2) -> CubicBez {
        let points = &self.points[a..a + u.len()];
        let (p, q) = (points[0], points[u.len() - 1]);
        let (mut c00, mut c01, mut c11, mut x0, mut x1) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (point, u) in points.iter().zip(u) {
            let [b0, b1, b2, b3] = bernstein(*u);
            let (a0, a1) = (start * b1, end * -b2);
            let rest = point.to_vec2() - p.to_vec2() * (b0 + b1) - q.to_vec2() * (b2 + b3);
            c00 += a0.hypot2();
            c01 += a0.dot(a1);
            c11 += a1.hypot2();
            x0 += a0.dot(rest);
            x1 += a1.dot(rest);
        }
        let determinant = c00 * c11 - c01 * c01;
        let whole = self.length[a + u.len() - 1] - self.length[a];
        let (mut alpha, mut beta) = ((x0 * c11 - x1 * c01) / determinant, (c00 * x1 - c01 * x0) / determinant);
        let sound = |x: f64| x.is_finite() && x > 1e-3 * whole && x < whole;
        if !(sound(alpha) && sound(beta)) {
            // arms that turn back or reach too far make loops: thirds of the way don't
            (alpha, beta) = (whole / 3.0, whole / 3.0);
        }
        CubicBez::new(p, p + start * alpha, q - end * beta, q)
    }

    /// Largest distance of an inner point from the curve at its parameter, and its index.
    fn farthest(&self, a: usize, u: &[f64], curve: &CubicBez) -> (f64, usize) {
        let inner = (1..u.len() - 1).map(|k| (self.points[a + k].distance(curve.eval(u[k])), a + k));
        inner.fold((0.0, a + u.len() / 2), |worst, here| if here.0 > worst.0 { here } else { worst })
    }

    /// Width coefficients by least squares with the ends given, and the largest error with its index.
    fn width(&self, a: usize, u: &[f64]) -> ([f64; 4], (f64, usize)) {
        let widths = &self.widths[a..a + u.len()];
        let (w, x) = (widths[0], widths[u.len() - 1]);
        let (mut c00, mut c01, mut c11, mut x0, mut x1) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (width, u) in widths.iter().zip(u) {
            let [b0, b1, b2, b3] = bernstein(*u);
            let rest = width - w * b0 - x * b3;
            c00 += b1 * b1;
            c01 += b1 * b2;
            c11 += b2 * b2;
            x0 += b1 * rest;
            x1 += b2 * rest;
        }
        let determinant = c00 * c11 - c01 * c01;
        let (low, high) = widths.iter().fold((w, w), |(l, h), w| (l.min(*w), h.max(*w)));
        let inner = |value: f64, share: f64| {
            if value.is_finite() && determinant > 1e-12 { value.clamp(low, high) } else { w + (x - w) * share }
        };
        let (y, z) = ((x0 * c11 - x1 * c01) / determinant, (c00 * x1 - c01 * x0) / determinant);
        let width = [w, inner(y, 1.0 / 3.0), inner(z, 2.0 / 3.0), x];
        let mut worst = (0.0, a + u.len() / 2);
        for k in 1..u.len() - 1 {
            let error = (bernstein(u[k]).iter().zip(&width).map(|(b, w)| b * w).sum::<f64>() - widths[k]).abs();
            if error > worst.0 {
                worst = (error, a + k);
            }
        }
        (width, worst)
    }
}

/// Moves each parameter towards the foot of its point on the curve by a step of Newton's method; they keep their order.
fn improve(curve: &CubicBez, points: &[Point], u: &mut [f64]) {
    let d1 = curve.deriv();
    let d2 = d1.deriv();
    for k in 1..u.len() - 1 {
        let offset = curve.eval(u[k]) - points[k];
        let (v, a) = (d1.eval(u[k]).to_vec2(), d2.eval(u[k]).to_vec2());
        let slope = v.hypot2() + offset.dot(a);
        if slope > 0.0 {
            u[k] = (u[k] - offset.dot(v) / slope).clamp(u[k - 1], 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const OPTIONS: FitOptions = FitOptions { tolerance: 0.05, width_tolerance: 0.02, corner: 0.8 };

    fn distance(p: Point, line: &[Point]) -> f64 {
        line.windows(2)
            .map(|w| {
                let d = w[1] - w[0];
                let t = ((p - w[0]).dot(d) / d.hypot2()).clamp(0.0, 1.0);
                (p - (w[0] + d * t)).hypot()
            })
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn no_point_is_farther_from_the_spline_than_the_tolerance(
            seed in proptest::collection::vec((-20.0..20.0f64, -20.0..20.0f64, 0.5..2.0f64), 2..40),
        ) {
            let points: Vec<Point> = seed.iter().map(|(x, y, _)| Point::new(*x, *y)).collect();
            let widths: Vec<f64> = seed.iter().map(|s| s.2).collect();
            prop_assume!(points.windows(2).all(|w| w[0].distance(w[1]) > 1e-6));
            let pieces = fit(&points, &widths, &OPTIONS);
            for w in pieces.windows(2) {
                prop_assert_eq!((w[0].curve.p3, w[0].width[3]), (w[1].curve.p0, w[1].width[0]));
            }
            let (line, drawn) = flatten(&pieces, 0.005, 0.005);
            prop_assert!(drawn.iter().all(|w| (0.5..=2.0).contains(w)));
            for p in &points {
                prop_assert!(distance(*p, &line) <= 0.05 + 0.006, "{}", distance(*p, &line));
            }
        }
    }

    #[test]
    fn a_spiral_that_swells_takes_few_pieces() {
        let at = |u: f64| Point::new((4.0 + 20.0 * u) * (9.0 * u).cos(), (4.0 + 20.0 * u) * (9.0 * u).sin());
        let width = |u: f64| 1.0 + 0.7 * (5.0 * u).sin();
        let points: Vec<Point> = (0..=600).map(|i| at(f64::from(i) / 600.0)).collect();
        let widths: Vec<f64> = (0..=600).map(|i| width(f64::from(i) / 600.0)).collect();
        let pieces = fit(&points, &widths, &OPTIONS);
        assert!(pieces.len() <= 12, "{} pieces", pieces.len());
        let (line, drawn) = flatten(&pieces, 0.01, 0.01);
        assert!(points.iter().all(|p| distance(*p, &line) < 0.06));
        let nearest =
            |p: Point| (0..points.len()).min_by(|a, b| points[*a].distance(p).total_cmp(&points[*b].distance(p)));
        for (p, w) in line.iter().zip(&drawn) {
            assert!((w - widths[nearest(*p).unwrap()]).abs() < 0.05);
        }
    }

    #[test]
    fn a_corner_stays_a_corner() {
        let side = |i: i32| {
            if i <= 50 { Point::new(0.2 * f64::from(i), 0.0) } else { Point::new(10.0, 0.2 * f64::from(i - 50)) }
        };
        let points: Vec<Point> = (0..=100).map(side).collect();
        let pieces = fit(&points, &[1.0; 101], &OPTIONS);
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0].curve.p3, Point::new(10.0, 0.0));
    }
}
