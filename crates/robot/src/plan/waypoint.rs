//! The desired line of a stroke as evenly spaced pen targets.
use nalgebra::{Point3, Vector3};

use crate::plan::depth::limit_slope;
use crate::plan::{PenTarget, PlanOptions};
use crate::surface::SurfaceTarget;

/// A pose that the pen is to pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Set point of the tip (pressed in by the press depth) and of the pen's axis.
    pub target: PenTarget,
    /// The press depth, m.
    pub depth: f64,
    /// Place among the stroke's targets: 2.5 is half-way from the third to the fourth.
    pub source: f64,
    /// The pen stops here: the line turns.
    pub corner: bool,
}

/// Position, normal, place among the targets, and whether the line turns.
type Place = (Point3<f64>, Vector3<f64>, f64, bool);

/// Targets nearer to each other than this share of the step are merged.
const MERGE_SHARE: f64 = 0.3;
/// Half width of the window over which normals are averaged, in waypoints.
const NORMAL_WINDOW: usize = 3;
/// Largest change of a normal by that average, rad.
const NORMAL_TOLERANCE: f64 = 8e-4;

/// Set points along the `targets` of a stroke of a layer, none farther apart than the step; targets much nearer than that are merged
/// unless the line turns there.
///
/// Normals are averaged over a few millimetres, by no more than 0.05 degrees: on a triangle mesh they kink at every
/// edge, which the arm would feel as jerk.
pub fn waypoints(targets: &[SurfaceTarget], layer: usize, options: &PlanOptions) -> Vec<Waypoint> {
    let kept = merge(targets, options);
    let mut points: Vec<Place> = Vec::new();
    for (k, (i, corner)) in kept.iter().enumerate() {
        let b = &targets[*i];
        if k > 0 {
            let h = kept[k - 1].0;
            let a = &targets[h];
            let parts = ((b.position - a.position).norm() / options.step - 1e-9).ceil().max(1.0) as usize;
            for part in 1..parts {
                let u = part as f64 / parts as f64;
                let normal = (a.normal * (1.0 - u) + b.normal * u).normalize();
                points.push((a.position + (b.position - a.position) * u, normal, h as f64 + u * (i - h) as f64, false));
            }
        }
        points.push((b.position, b.normal, *i as f64, *corner));
    }
    let count = points.len();
    let depths = depths(targets, &points, layer, options);
    (0..count)
        .map(|i| {
            let (position, raw, source, corner) = points[i];
            let half = NORMAL_WINDOW.min(i).min(count - 1 - i);
            let mean: Vector3<f64> = points[i - half..=i + half].iter().map(|p| p.1).sum();
            let normal = near(&raw, &mean.normalize(), NORMAL_TOLERANCE);
            let target = PenTarget { position: position - normal * depths[i], axis: -normal };
            Waypoint { target, depth: depths[i], source, corner }
        })
        .collect()
}

/// Press depths of all places: those of the desired widths, where they change not too fast along the line, rounded over
/// neighbours. A constant depth stays exactly what it is.
fn depths(targets: &[SurfaceTarget], places: &[Place], layer: usize, options: &PlanOptions) -> Vec<f64> {
    let desired = |(_, _, source, _): &Place| {
        let (a, u) = (source.floor() as usize, source.fract());
        let width = |i: usize| targets[i.min(targets.len() - 1)].width;
        let width = width(a).map(|w| w + u * (width(a + 1).unwrap_or(w) - w));
        options.press.of(layer, width)
    };
    let mut depths: Vec<f64> = places.iter().map(desired).collect();
    if depths.windows(2).all(|w| w[0] == w[1]) {
        return depths;
    }
    let mut s = vec![0.0; places.len()];
    for i in 1..s.len() {
        s[i] = s[i - 1] + (places[i].0 - places[i - 1].0).norm();
    }
    limit_slope(&s, &mut depths, options.press_slope);
    let last = depths.len() - 1;
    let round = |i: usize| match i {
        _ if i == 0 || i == last => depths[i],
        _ => 0.25 * (depths[i - 1] + 2.0 * depths[i] + depths[i + 1]),
    };
    (0..=last).map(round).collect()
}

/// Indices of the targets to keep, and whether the line turns there.
fn merge(targets: &[SurfaceTarget], options: &PlanOptions) -> Vec<(usize, bool)> {
    let mut kept: Vec<usize> = Vec::new();
    for i in 0..targets.len() {
        let last = i + 1 == targets.len();
        if let Some(k) = kept.last().copied() {
            let gap = (targets[i].position - targets[k].position).norm();
            if gap < 1e-6 {
                continue;
            }
            if gap < MERGE_SHARE * options.step {
                // a near target replaces none, unless it ends the stroke
                let straight = i + 1 < targets.len()
                    && angle(targets, k, i, i + 1) < options.corner_angle
                    && (targets[i + 1].position - targets[k].position).norm() < options.step;
                if straight {
                    continue;
                }
                if last && kept.len() > 1 {
                    kept.pop();
                }
            }
        }
        kept.push(i);
    }
    let n = kept.len();
    (0..n)
        .map(|k| {
            let corner = k > 0 && k + 1 < n && angle(targets, kept[k - 1], kept[k], kept[k + 1]) > options.corner_angle;
            (kept[k], corner)
        })
        .collect()
}

/// Change of direction at `b` on the way from `a` to `c`, rad.
fn angle(targets: &[SurfaceTarget], a: usize, b: usize, c: usize) -> f64 {
    let (u, v) = (targets[b].position - targets[a].position, targets[c].position - targets[b].position);
    u.cross(&v).norm().atan2(u.dot(&v))
}

/// `desired`, or the unit vector on the way to it that is `most` (rad) from `raw`.
fn near(raw: &Vector3<f64>, desired: &Vector3<f64>, most: f64) -> Vector3<f64> {
    let turn = raw.cross(desired).norm().atan2(raw.dot(desired));
    if turn <= most { *desired } else { (raw + (desired - raw) * (most / turn)).normalize() }
}

/// The pose half-way between two.
pub fn midway(a: &PenTarget, b: &PenTarget) -> PenTarget {
    between(a, b, 0.5)
}

/// The pose at share `u` of the way from `a` to `b`.
pub fn between(a: &PenTarget, b: &PenTarget, u: f64) -> PenTarget {
    let sum = a.axis * (1.0 - u) + b.axis * u;
    let axis = if sum.norm() > 1e-6 { sum.normalize() } else { a.axis };
    PenTarget { position: a.position + (b.position - a.position) * u, axis }
}

/// How far apart two poses are for an arm: distance (m) and `0.2 m` times angle.
pub fn separation(a: &PenTarget, b: &PenTarget) -> f64 {
    (b.position - a.position).norm() + 0.2 * a.axis.cross(&b.axis).norm().atan2(a.axis.dot(&b.axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::PressDepths;
    use nalgebra::Point2;

    fn line(points: &[(f64, f64)]) -> Vec<SurfaceTarget> {
        points
            .iter()
            .map(|(x, y)| SurfaceTarget {
                position: Point3::new(*x, *y, 0.0),
                normal: Vector3::z(),
                sheet: Point2::new(*x, *y),
                width: None,
            })
            .collect()
    }

    #[test]
    fn a_square_has_two_corners_inside_and_steps_below_the_step() {
        let w = waypoints(&line(&[(0.0, 0.0), (0.01, 0.0), (0.01, 0.0105), (0.0, 0.0105)]), 0, &PlanOptions::default());
        assert_eq!(w.iter().filter(|w| w.corner).count(), 2);
        assert!(w.windows(2).all(|w| (w[1].target.position - w[0].target.position).norm() < 0.001 + 1e-9));
        assert_eq!(w.len(), 1 + 10 + 11 + 10);
        assert!(w.iter().all(|w| (w.target.position.z + 0.003).abs() < 1e-12));
        assert_eq!(w[31].source, 3.0);
    }

    #[test]
    fn a_swelling_line_is_pressed_deeper_and_a_sudden_swell_is_spread() {
        let press = PressDepths { default: 3e-3, layers: vec![vec![(5e-4, 1e-3), (2e-3, 7e-3)]] };
        let options = PlanOptions { press, press_slope: 0.4, ..Default::default() };
        let with = |width: &dyn Fn(f64) -> f64| {
            let mut targets = line(&(0..=100).map(|i| (f64::from(i) * 1e-3, 0.0)).collect::<Vec<_>>());
            targets.iter_mut().for_each(|t| t.width = Some(width(t.position.x)));
            waypoints(&targets, 0, &options)
        };
        for w in with(&|x| 5e-4 + 0.015 * x) {
            let desired = 1e-3 + 0.06 * w.target.position.x;
            assert!((w.depth - desired).abs() < 1e-12 && (w.target.position.z + desired).abs() < 1e-12);
        }
        let sudden = with(&|x| if x < 0.05 { 5e-4 } else { 2e-3 });
        let steepest = sudden.windows(2).map(|w| (w[1].depth - w[0].depth).abs() / 1e-3).fold(0.0, f64::max);
        assert!(steepest <= options.press_slope + 1e-9 && steepest > 0.9 * options.press_slope, "{steepest}");
        assert_eq!((sudden[0].depth, sudden[100].depth), (1e-3, 7e-3));
        // targets without a width are pressed exactly as deep as all others
        assert!(waypoints(&line(&[(0.0, 0.0), (0.0317, 0.0)]), 0, &options).iter().all(|w| w.depth == 3e-3));
    }

    #[test]
    fn dense_points_are_thinned_but_ends_and_corners_stay() {
        let mut p: Vec<(f64, f64)> = (0..=1000).map(|i| (f64::from(i) * 1e-5, 0.0)).collect();
        p.extend((1..=100).map(|i| (0.01, f64::from(i) * 1e-5)));
        let w = waypoints(&line(&p), 0, &PlanOptions::default());
        assert!(w.len() > 10 && w.len() < 60, "{}", w.len());
        assert_eq!(w.iter().filter(|w| w.corner).count(), 1);
        assert!((w[w.len() - 1].target.position - Point3::new(0.01, 0.001, -0.003)).norm() < 1e-12);
        let repeated = waypoints(&line(&[(0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]), 0, &PlanOptions::default());
        assert_eq!(repeated.len(), 1);
    }
}
