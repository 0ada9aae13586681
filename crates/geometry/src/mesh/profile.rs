//! Plane curves from which walls are pulled upwards.
use nalgebra::{Point2, Vector2};

/// Largest turn between two neighbouring points of a rounded piece, rad.
const TURN: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// A curve that turns back more sharply than this at a point has no sides, rad.
const REVERSAL: f64 = 170.0 * std::f64::consts::PI / 180.0;
/// Points nearer than this are one, m.
const SAME: f64 = 1e-7;
/// Most points that a curve is sampled at.
const MOST_POINTS: usize = 20_000;

/// Why a curve can't be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// Fewer than two points that differ.
    #[error("a profile needs two points that differ, and has {count}")]
    TooShort {
        /// How many there are.
        count: usize,
    },
    /// A number is not finite, or absurdly large.
    #[error("point {index} of the profile must be finite and within 1 km")]
    NotFinite {
        /// Which, from 1.
        index: usize,
    },
    /// A radius or a step is not a positive length.
    #[error("{name} of {value} m makes no profile: it must be above 0")]
    BadSize {
        /// What it is of.
        name: &'static str,
        /// What it is, m.
        value: f64,
    },
    /// A rounding is longer than the sides that it joins.
    #[error(
        "a fillet of {:.1} mm doesn't fit at point {index} of the profile: at most {:.1} mm do", radius * 1e3, most * 1e3
    )]
    Fillet {
        /// Which point, from 1.
        index: usize,
        /// The radius asked for, m.
        radius: f64,
        /// The largest that fits, m.
        most: f64,
    },
    /// The curve turns back on itself.
    #[error("the profile turns back on itself at ({:.1}, {:.1}) mm", at.x * 1e3, at.y * 1e3)]
    Reversal {
        /// Where, m.
        at: Point2<f64>,
    },
    /// Two parts of the curve meet.
    #[error(
        "the profile crosses itself at ({:.1}, {:.1}) mm, {:.0} and {:.0} mm along it: move its points apart",
        at.x * 1e3, at.y * 1e3, first * 1e3, second * 1e3
    )]
    Crossing {
        /// Where, m.
        at: Point2<f64>,
        /// Arc length there the first time, m.
        first: f64,
        /// Arc length there the second time, m.
        second: f64,
    },
    /// The step asks for too many points.
    #[error("the triangle size cuts the profile into more than {MOST_POINTS} pieces")]
    TooFine,
}

/// What a curve is made of, m.
#[derive(Clone, Debug, PartialEq)]
pub enum ProfileShape {
    /// Straight pieces, with corners rounded by a radius (0: sharp).
    Polyline {
        /// The corners in order.
        points: Vec<Point2<f64>>,
        /// Radius of the rounding, m.
        fillet: f64,
    },
    /// A natural cubic spline through points, over the lengths of its chords.
    Spline {
        /// The points in order.
        points: Vec<Point2<f64>>,
    },
    /// A piece of a circle.
    Arc {
        /// Its centre.
        center: Point2<f64>,
        /// Its radius, m.
        radius: f64,
        /// Angle of the first point, rad.
        from: f64,
        /// Angle of the last point, rad.
        to: f64,
    },
}

/// A plane curve without crossings, as points along it, m.
///
/// It runs from left to right as an artist before it sees it, so that its normals point to the right of its direction.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileCurve {
    points: Vec<Point2<f64>>,
    along: Vec<f64>,
}

impl ProfileCurve {
    /// Samples a curve at steps of at most `step` (m), and of 4 degrees where it is round.
    ///
    /// # Errors
    /// See [`ProfileError`]; the first is the one told.
    pub fn new(shape: &ProfileShape, step: f64) -> Result<Self, ProfileError> {
        positive("a triangle size", step)?;
        let points = match shape {
            ProfileShape::Polyline { points, fillet } => rounded(&distinct(points)?, *fillet, step)?,
            ProfileShape::Spline { points } => spline(&distinct(points)?, step),
            ProfileShape::Arc { center, radius, from, to } => {
                positive("a radius", *radius)?;
                check(&[*center, center + Vector2::new(*radius, 0.0)])?;
                if !(from.is_finite()
                    && to.is_finite()
                    && (to - from).abs() > 1e-6
                    && (to - from).abs() < std::f64::consts::TAU - 1e-3)
                {
                    return Err(ProfileError::BadSize { name: "a turn", value: (to - from) * radius });
                }
                let n = ((to - from).abs() / TURN.min(step / radius)).ceil().clamp(1.0, MOST_POINTS as f64) as usize;
                let at = |i: usize| from + (to - from) * i as f64 / n as f64;
                (0..=n).map(|i| center + Vector2::new(at(i).cos(), at(i).sin()) * *radius).collect()
            }
        };
        Self::through(points)
    }

    /// The curve of straight pieces between these points.
    pub fn through(points: Vec<Point2<f64>>) -> Result<Self, ProfileError> {
        let points = distinct(&points)?;
        if points.len() > MOST_POINTS {
            return Err(ProfileError::TooFine);
        }
        let mut along = vec![0.0];
        for w in points.windows(2) {
            along.push(along[along.len() - 1] + (w[1] - w[0]).norm());
        }
        let curve = Self { points, along };
        curve.refuse_crossings()?;
        Ok(curve)
    }

    /// Its points, m.
    pub fn points(&self) -> &[Point2<f64>] {
        &self.points
    }

    /// Arc length at each of its points, m.
    pub fn along(&self) -> &[f64] {
        &self.along
    }

    /// Its length, m.
    pub fn length(&self) -> f64 {
        self.along[self.along.len() - 1]
    }

    /// The piece in which arc length `s` lies, and the share of it that is passed there.
    fn piece(&self, s: f64) -> (usize, f64) {
        let i = self.along.partition_point(|a| *a <= s).clamp(1, self.along.len() - 1) - 1;
        (i, (s - self.along[i]) / (self.along[i + 1] - self.along[i]))
    }

    /// The point at arc length `s` (m); beyond its ends the curve goes straight on.
    pub fn at(&self, s: f64) -> Point2<f64> {
        let (i, u) = self.piece(s);
        self.points[i] + (self.points[i + 1] - self.points[i]) * u
    }

    /// The smooth unit normal at arc length `s` (m), towards the artist.
    pub fn normal(&self, s: f64) -> Vector2<f64> {
        let (i, u) = self.piece(s);
        let (a, b) = (self.normal_at(i), self.normal_at(i + 1));
        let own = self.piece_normal(i);
        // at a crease each side keeps its own normal
        let near = |n: Vector2<f64>| if n.dot(&own) > 0.94 { n } else { own };
        (near(a) * (1.0 - u.clamp(0.0, 1.0)) + near(b) * u.clamp(0.0, 1.0)).normalize()
    }

    fn piece_normal(&self, i: usize) -> Vector2<f64> {
        let d = (self.points[i + 1] - self.points[i]).normalize();
        Vector2::new(d.y, -d.x)
    }

    fn normal_at(&self, i: usize) -> Vector2<f64> {
        let before = self.piece_normal(i.saturating_sub(1).min(self.points.len() - 2));
        let after = self.piece_normal(i.min(self.points.len() - 2));
        (before + after).normalize()
    }

    /// Arc length of the point of the curve nearest to `p`, and its distance, m.
    pub fn nearest(&self, p: &Point2<f64>) -> (f64, f64) {
        let mut best = (0.0, f64::INFINITY);
        for (i, w) in self.points.windows(2).enumerate() {
            let d = w[1] - w[0];
            let u = ((p - w[0]).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
            let distance = (w[0] + d * u - p).norm();
            if distance < best.1 {
                best = (self.along[i] + u * d.norm(), distance);
            }
        }
        best
    }

    /// The curve turned and moved.
    pub fn transformed(&self, pose: &nalgebra::Isometry2<f64>) -> Self {
        Self { points: self.points.iter().map(|p| pose * p).collect(), along: self.along.clone() }
    }

    fn refuse_crossings(&self) -> Result<(), ProfileError> {
        for (i, w) in self.points.windows(3).enumerate() {
            if (w[1] - w[0]).angle(&(w[2] - w[1])) > REVERSAL {
                return Err(ProfileError::Reversal { at: self.points[i + 1] });
            }
        }
        let n = self.points.len() - 1;
        for i in 0..n {
            for j in i + 2..n {
                let (a, b) = ([self.points[i], self.points[i + 1]], [self.points[j], self.points[j + 1]]);
                if let Some((u, v)) = crossing(&a, &b) {
                    let at = |k: usize, u: f64| self.along[k] + u * (self.along[k + 1] - self.along[k]);
                    let (first, second) = (at(i, u), at(j, v));
                    return Err(ProfileError::Crossing { at: a[0] + (a[1] - a[0]) * u, first, second });
                }
            }
        }
        Ok(())
    }
}

/// Where two straight pieces meet, as shares of both.
fn crossing(a: &[Point2<f64>; 2], b: &[Point2<f64>; 2]) -> Option<(f64, f64)> {
    let apart = |d: usize| {
        a[0][d].max(a[1][d]) < b[0][d].min(b[1][d]) - SAME || b[0][d].max(b[1][d]) < a[0][d].min(a[1][d]) - SAME
    };
    if apart(0) || apart(1) {
        return None;
    }
    let (d, e, r) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let area = d.perp(&e);
    if area.abs() < 1e-12 {
        // along one line: their boxes overlap, so they do
        return (d.perp(&r).abs() < SAME * d.norm()).then_some((0.5, 0.5));
    }
    let (u, v) = (r.perp(&e) / area, r.perp(&d) / area);
    ((-1e-9..=1.0 + 1e-9).contains(&u) && (-1e-9..=1.0 + 1e-9).contains(&v)).then_some((u, v))
}

fn positive(name: &'static str, value: f64) -> Result<(), ProfileError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(ProfileError::BadSize { name, value }) }
}

fn check(points: &[Point2<f64>]) -> Result<(), ProfileError> {
    match points.iter().position(|p| !p.coords.iter().all(|c| c.is_finite() && c.abs() < 1e3)) {
        Some(i) => Err(ProfileError::NotFinite { index: i + 1 }),
        None => Ok(()),
    }
}

/// The points without repetitions.
fn distinct(points: &[Point2<f64>]) -> Result<Vec<Point2<f64>>, ProfileError> {
    check(points)?;
    let mut kept: Vec<Point2<f64>> = Vec::with_capacity(points.len());
    for p in points {
        if kept.last().is_none_or(|k| (p - k).norm() > SAME) {
            kept.push(*p);
        }
    }
    if kept.len() < 2 { Err(ProfileError::TooShort { count: kept.len() }) } else { Ok(kept) }
}

/// Straight pieces with rounded corners, sampled.
fn rounded(corners: &[Point2<f64>], fillet: f64, step: f64) -> Result<Vec<Point2<f64>>, ProfileError> {
    if !(fillet.is_finite() && fillet >= 0.0) {
        return Err(ProfileError::BadSize { name: "a fillet", value: fillet });
    }
    let mut knots = vec![corners[0]];
    for (i, w) in corners.windows(3).enumerate() {
        let (d, e) = ((w[1] - w[0]).normalize(), (w[2] - w[1]).normalize());
        let turn = d.angle(&e);
        if turn > REVERSAL {
            return Err(ProfileError::Reversal { at: w[1] });
        }
        if fillet == 0.0 || turn < 1e-6 {
            knots.push(w[1]);
            continue;
        }
        // a side between two roundings is shared by both
        let share = |length: f64, outer: bool| if outer { length } else { 0.5 * length };
        let room = share((w[1] - w[0]).norm(), i == 0).min(share((w[2] - w[1]).norm(), i + 3 == corners.len()));
        let tangent = (0.5 * turn).tan();
        if fillet * tangent > room + 1e-12 {
            return Err(ProfileError::Fillet { index: i + 2, radius: fillet, most: room / tangent });
        }
        let side = d.perp(&e).signum();
        let center = w[1] - d * (fillet * tangent) + Vector2::new(-d.y, d.x) * (side * fillet);
        let n = (turn / TURN.min(step / fillet)).ceil().clamp(1.0, 1000.0) as usize;
        let start = Vector2::new(d.y, -d.x) * (side * fillet);
        knots.extend((0..=n).map(|k| center + nalgebra::Rotation2::new(side * turn * k as f64 / n as f64) * start));
    }
    knots.push(corners[corners.len() - 1]);
    let mut points = vec![knots[0]];
    for w in knots.windows(2) {
        let n = ((w[1] - w[0]).norm() / step - 1e-9).ceil().clamp(1.0, MOST_POINTS as f64) as usize;
        points.extend((1..=n).map(|k| w[0] + (w[1] - w[0]) * (k as f64 / n as f64)));
    }
    Ok(points)
}

/// A natural cubic spline, sampled.
fn spline(points: &[Point2<f64>], step: f64) -> Vec<Point2<f64>> {
    let n = points.len();
    let h: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
    // second derivatives, by the tridiagonal rule
    let mut second = vec![Vector2::zeros(); n];
    let (mut c, mut d) = (vec![0.0; n], vec![Vector2::zeros(); n]);
    for i in 1..n - 1 {
        let right = ((points[i + 1] - points[i]) / h[i] - (points[i] - points[i - 1]) / h[i - 1]) * 6.0;
        let pivot = 2.0 * (h[i - 1] + h[i]) - h[i - 1] * c[i - 1];
        c[i] = h[i] / pivot;
        d[i] = (right - d[i - 1] * h[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        second[i] = d[i] - second[i + 1] * c[i];
    }
    let at = |i: usize, t: f64| {
        let (a, b) = (1.0 - t, t);
        let bend = second[i] * (a * a * a - a) + second[i + 1] * (b * b * b - b);
        points[i] + (points[i + 1] - points[i]) * b + bend * (h[i] * h[i] / 6.0)
    };
    let mut sampled = vec![points[0]];
    for i in 0..n - 1 {
        let bend = second[i].norm().max(second[i + 1].norm());
        let by_turn = h[i] * bend / TURN;
        let parts = (h[i] / step).max(by_turn).ceil().clamp(1.0, 2000.0) as usize;
        sampled.extend((1..=parts).map(|k| at(i, k as f64 / parts as f64)));
    }
    sampled
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn polyline(points: &[[f64; 2]], fillet: f64) -> Result<ProfileCurve, ProfileError> {
        let points = points.iter().map(|p| Point2::new(p[0], p[1])).collect();
        ProfileCurve::new(&ProfileShape::Polyline { points, fillet }, 0.01)
    }

    #[test]
    fn a_rounded_corner_has_its_radius_and_length() {
        let curve = polyline(&[[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], 0.2).unwrap();
        let length = 1.6 + 0.2 * std::f64::consts::FRAC_PI_2;
        assert!((curve.length() - length).abs() < 2e-4, "{}", curve.length());
        let middle = curve.at(0.5 * curve.length());
        assert!(((middle - Point2::new(0.2, 0.2)).norm() - 0.2).abs() < 1e-4);
        // the artist stands to the right of the curve's direction
        assert!((curve.normal(0.1) - Vector2::new(-1.0, 0.0)).norm() < 1e-9);
        assert!((curve.normal(0.5 * curve.length()) - Vector2::new(-1.0, -1.0).normalize()).norm() < 1e-2);
    }

    #[test]
    fn arcs_and_splines_pass_through_what_they_are_made_of() {
        let arc = ProfileShape::Arc { center: Point2::new(6.0, 0.0), radius: 3.0, from: 2.8, to: 3.5 };
        let arc = ProfileCurve::new(&arc, 0.01).unwrap();
        assert!((arc.length() - 2.1).abs() < 1e-3);
        assert!((arc.normal(1.05) - Vector2::new(3.15f64.cos(), 3.15f64.sin())).norm() < 1e-3);
        let through = vec![Point2::new(0.0, 0.0), Point2::new(1.0, 0.3), Point2::new(2.0, -0.2), Point2::new(3.0, 0.0)];
        let spline = ProfileCurve::new(&ProfileShape::Spline { points: through.clone() }, 0.01).unwrap();
        for p in &through {
            assert!(spline.nearest(p).1 < 1e-9, "{p}");
        }
        let turns = spline.points().windows(3).map(|w| (w[1] - w[0]).angle(&(w[2] - w[1])));
        assert!(turns.fold(0.0, f64::max) < 1.5 * TURN);
    }

    #[test]
    fn curves_that_cross_turn_back_or_are_too_tight_are_refused() {
        let cross = polyline(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, -0.5]], 0.0).unwrap_err();
        assert!(matches!(cross, ProfileError::Crossing { .. }));
        assert!(cross.to_string().starts_with("the profile crosses itself at (666.7, 0.0) mm"), "{cross}");
        assert!(matches!(polyline(&[[0.0, 0.0], [1.0, 0.0], [0.2, 0.0]], 0.0), Err(ProfileError::Reversal { .. })));
        let tight = polyline(&[[0.0, 1.0], [0.0, 0.0], [0.1, 0.0]], 0.2).unwrap_err();
        assert_eq!(
            tight,
            ProfileError::Fillet { index: 2, radius: 0.2, most: 0.1 / (0.25 * std::f64::consts::PI).tan() }
        );
        assert!(matches!(polyline(&[[0.0, 0.0], [0.0, 0.0]], 0.0), Err(ProfileError::TooShort { count: 1 })));
        assert!(matches!(polyline(&[[0.0, 0.0], [f64::NAN, 0.0]], 0.0), Err(ProfileError::NotFinite { index: 2 })));
    }

    proptest! {
        #[test]
        fn any_points_make_a_curve_or_an_error(
            points in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64), 0..8), fillet in -0.1..0.5f64, round in any::<bool>()
        ) {
            let points: Vec<Point2<f64>> = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
            let shape = if round { ProfileShape::Spline { points } } else { ProfileShape::Polyline { points, fillet } };
            if let Ok(curve) = ProfileCurve::new(&shape, 0.1) {
                for k in 0..20 {
                    let s = curve.length() * f64::from(k) / 19.0;
                    prop_assert!((curve.normal(s).norm() - 1.0).abs() < 1e-9);
                    prop_assert!(curve.nearest(&curve.at(s)).1 < 1e-9);
                }
            }
        }
    }
}
