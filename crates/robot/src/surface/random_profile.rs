//! Profiles of walls drawn at random: waves, arcs, corners, bumps.
use std::f64::consts::{PI, TAU};

use nalgebra::Point2;
use serde::Deserialize;

use super::shape::ShapeError;
use super::wall::wrong;
use crate::math::{stream, unit};
use crate::mesh::ProfileShape;

/// Distance between the points of a profile that is no corner, m.
const POINTS: f64 = 0.04;
/// A corner lies in this share of the wall round its middle.
const MIDDLE: f64 = 0.5;
/// Most bumps.
const BUMPS: f64 = 3.0;

/// What a random profile is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum RandomKind {
    /// A sine along the whole wall.
    Wave,
    /// A piece of a circle, to the robot or away from it.
    Arc,
    /// Two straight pieces with a rounded corner, to the robot or away from it.
    Corner,
    /// One to three bumps or hollows on a straight wall.
    Bump,
}

/// `profile = { random = { ... } }` in a scene file: a wall along y whose profile a seed draws from these ranges.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RandomFile {
    seed: u64,
    /// Extent along y, centred.
    width_mm: f64,
    /// x of what of it is nearest to the robot, which stands at less.
    x_mm: f64,
    #[serde(default = "all_kinds")]
    kinds: Vec<RandomKind>,
    /// Distance along x of its nearest and its farthest point.
    depth_mm: [f64; 2],
    /// Period of a wave, width of a bump, twice the radius of a corner.
    feature_mm: [f64; 2],
}

fn all_kinds() -> Vec<RandomKind> {
    vec![RandomKind::Wave, RandomKind::Arc, RandomKind::Corner, RandomKind::Bump]
}

impl RandomFile {
    /// The profile that the seed draws, m, from left to right as an artist at less x sees it.
    pub(super) fn shape(&self) -> Result<ProfileShape, ShapeError> {
        self.check()?;
        let mut rng = stream(self.seed, "wall profile", 0);
        let mut share = || unit(&mut rng);
        let width = self.width_mm * 1e-3;
        let between = |[low, high]: [f64; 2], u: f64| (low + (high - low) * u) * 1e-3;
        let kind = self.kinds[((share() * self.kinds.len() as f64) as usize).min(self.kinds.len() - 1)];
        let (depth, feature) = (between(self.depth_mm, share()), between(self.feature_mm, share()));
        let sign = if share() < 0.5 { -1.0 } else { 1.0 };
        let curve: Vec<(f64, f64)> = match kind {
            RandomKind::Corner => {
                let at = (share() - 0.5) * MIDDLE * width;
                let corner = [(0.5 * width, 0.5 * width - at), (at, 0.0), (-0.5 * width, 0.5 * width + at)];
                corner.map(|(y, x)| (y, sign * x)).to_vec()
            }
            RandomKind::Wave => {
                let phase = share() * TAU;
                sampled(width, |y| (TAU * y / feature + phase).sin())
            }
            RandomKind::Arc => {
                // the circle through both ends whose height over the chord is the depth
                let radius = (0.25 * width * width + depth * depth) / (2.0 * depth);
                sampled(width, |y| sign * (radius * radius - y * y).max(0.0).sqrt())
            }
            RandomKind::Bump => {
                let count = 1 + (share() * BUMPS) as usize;
                let mut bump = || ((share() - 0.5) * width, if share() < 0.5 { -1.0 } else { 1.0 });
                let bumps: Vec<(f64, f64)> = (0..count).map(|_| bump()).collect();
                let height = |d: f64| if d.abs() < 0.5 * feature { 0.5 + 0.5 * (TAU * d / feature).cos() } else { 0.0 };
                let all = |y: f64| bumps.iter().map(|(at, sign)| sign * height(y - at)).sum::<f64>();
                sampled(width, all)
            }
        };
        let (low, high) = curve.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |b, c| (b.0.min(c.1), b.1.max(c.1)));
        let scale = if high - low > 1e-9 { depth / (high - low) } else { 0.0 };
        let points: Vec<Point2<f64>> =
            curve.iter().map(|(y, x)| Point2::new(self.x_mm * 1e-3 + (x - low) * scale, *y)).collect();
        if kind != RandomKind::Corner {
            return Ok(ProfileShape::Spline { points });
        }
        // no more rounded than its sides are long
        let (a, b) = (points[1] - points[0], points[2] - points[1]);
        let most = 0.9 * a.norm().min(b.norm()) / (0.5 * a.angle(&b)).tan().max(1e-6);
        Ok(ProfileShape::Polyline { points, fillet: (0.5 * feature).min(most) })
    }

    fn check(&self) -> Result<(), ShapeError> {
        let key = "profile.random";
        let positive = |name: &str, x: f64, most: f64| {
            if x.is_finite() && x > 0.0 && x <= most {
                return Ok(());
            }
            Err(wrong(key, format!("{name} of a random profile must be above 0 and at most {most}, not {x}")))
        };
        positive("width_mm", self.width_mm, 1e5)?;
        for (name, range) in [("depth_mm", self.depth_mm), ("feature_mm", self.feature_mm)] {
            positive(name, range[0], 1e5)?;
            positive(name, range[1], 1e5)?;
            if range[0] > range[1] {
                return Err(wrong(key, format!("{name} goes from low to high, not from {} to {}", range[0], range[1])));
            }
        }
        if !(self.x_mm.is_finite() && self.x_mm.abs() < 1e6) {
            return Err(wrong(key, "x_mm must be finite and within 1 km"));
        }
        // a longer profile than that is no wave any more, and an arc no arc
        if self.depth_mm[1] * PI > self.feature_mm[0].min(self.width_mm) * 1.5 {
            let (most, least) = (self.depth_mm[1], self.feature_mm[0].min(self.width_mm));
            let message =
                format!("depth_mm up to {most} is too steep for features of {least} mm: at most 0.47 of them");
            return Err(wrong(key, message));
        }
        if self.kinds.is_empty() {
            return Err(wrong(key, "kinds must name at least one of wave, arc, corner and bump"));
        }
        Ok(())
    }
}

/// (y, x) along a wall from its left end.
fn sampled(width: f64, x: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let n = (width / POINTS).ceil().max(2.0) as usize;
    let y = |k: usize| width * (0.5 - k as f64 / n as f64);
    (0..=n).map(|k| (y(k), x(y(k)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ProfileCurve;

    fn random(seed: u64, kinds: Vec<RandomKind>) -> RandomFile {
        RandomFile { seed, width_mm: 3000.0, x_mm: 2900.0, kinds, depth_mm: [60.0, 240.0], feature_mm: [700.0, 1600.0] }
    }

    #[test]
    fn a_seed_draws_one_wall_of_the_depth_asked_for() {
        for kind in all_kinds() {
            for seed in 0..40 {
                let file = random(seed, vec![kind]);
                let shape = file.shape().unwrap();
                assert_eq!(shape, file.shape().unwrap());
                assert_ne!(shape, random(seed + 1, vec![kind]).shape().unwrap());
                let curve = ProfileCurve::new(&shape, 0.02).unwrap_or_else(|e| panic!("{kind:?} {seed}: {e}"));
                let fold = |f: fn(f64, f64) -> f64, x: f64| curve.points().iter().map(|p| p.x).fold(x, f);
                let depth = fold(f64::max, -9.0) - fold(f64::min, 9.0);
                // a rounded corner is less deep than a sharp one
                let least = if kind == RandomKind::Corner { 0.01 } else { 0.059 };
                assert!((least..=0.245).contains(&depth), "{kind:?} {seed}: {depth}");
                assert!((curve.at(0.0).y - 1.5).abs() < 1e-9 && curve.normal(0.5 * curve.length()).x < -0.3);
            }
        }
    }

    #[test]
    fn ranges_that_make_no_wall_are_refused() {
        let told = |file: RandomFile| match file.shape() {
            Err(ShapeError::Key { message, .. }) => message,
            _ => String::new(),
        };
        let base = || random(1, all_kinds());
        assert!(told(RandomFile { depth_mm: [5.0, 1.0], ..base() }).contains("from low to high"));
        assert!(told(RandomFile { depth_mm: [5.0, 900.0], ..base() }).contains("too steep"));
        assert!(told(RandomFile { width_mm: -1.0, ..base() }).contains("above 0"));
        assert!(told(RandomFile { kinds: vec![], ..base() }).contains("at least one"));
    }
}
