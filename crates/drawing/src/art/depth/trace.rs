//! Where single strokes run: along an outline, or from a seed along the form.
use nalgebra::{Point2, Vector2};

use crate::art::depth::Semantics;
use crate::art::depth::contour::{Outline, outlines};
use crate::art::depth::form::Form;
use crate::picture::Flat;

/// Smoothing of outlines along the curve, px.
const SMOOTHING: f64 = 2.0;
/// Half the window in which the commonest ink along an outline is taken, px.
const WINDOW: usize = 7;
/// Shortest stroke of an outline, px.
const SHORTEST: usize = 6;
/// Longest stroke of an outline, as a share of the picture's height and width together.
const LONGEST: f64 = 0.25;

/// How a stroke behaves.
pub(super) struct Habit {
    /// Radius of the brush, px.
    pub radius: f64,
    /// Longest stroke, px.
    pub longest: f64,
    /// 1 follows the form, 0 goes straight on.
    pub curvature: f64,
}

/// The spine of a stroke from a seed along the form, both ways, as far as pixels are welcome.
pub(super) fn grow(
    form: &Form,
    seed: Point2<f64>,
    width: usize,
    height: usize,
    habit: &Habit,
    welcome: impl Fn(usize) -> bool,
) -> Vec<Point2<f64>> {
    let step = (0.4 * habit.radius).clamp(1.0, 4.0);
    let first = form.direction(&seed, &Vector2::x()).unwrap_or(Vector2::x());
    let inside = |p: &Point2<f64>| {
        let on = p.x >= 0.0 && p.y >= 0.0 && p.x < width as f64 && p.y < height as f64;
        on && welcome(p.y as usize * width + p.x as usize)
    };
    let arm = |way: Vector2<f64>| {
        let (mut points, mut p, mut way) = (Vec::new(), seed, way);
        // each way may take half the length
        for _ in 0..(0.5 * habit.longest / step) as usize {
            let desired = form.direction(&p, &way).unwrap_or(way);
            way = (habit.curvature * desired + (1.0 - habit.curvature) * way).try_normalize(1e-9).unwrap_or(way);
            p += step * way;
            // the brush is round: its end reaches beyond its middle
            let end = p + 0.6 * habit.radius * way;
            if !inside(&p) || !inside(&end) {
                break;
            }
            points.push(p);
        }
        points
    };
    let mut spine = arm(-first);
    spine.reverse();
    spine.push(seed);
    spine.extend(arm(first));
    spine
}

/// The outline strokes of a segment: for each its ink and the pen's way, px. Each runs just inside the segment in the ink
/// found there or, where that is bare paper, just outside it in the neighbour's ink.
pub(super) fn outline_strokes(
    flat: &Flat,
    semantics: &Semantics,
    segment: usize,
    lines: &[f64],
) -> Vec<(usize, Vec<Point2<f64>>)> {
    let (width, height) = (flat.width(), flat.height());
    let inside = |x: usize, y: usize| usize::from(semantics.labels()[y * width + x]) == segment;
    let mut strokes = Vec::new();
    for outline in outlines(width, height, inside, SMOOTHING) {
        let intent = intents(&outline, flat, lines);
        let longest = (LONGEST * (width + height) as f64) as usize;
        for (intent, run) in runs(&intent, outline.closed, longest) {
            if let Some((ink, outwards)) = intent.filter(|_| run.len() >= SHORTEST) {
                let shift = 0.5 * lines[ink] * if outwards { -1.0 } else { 1.0 };
                let line: Vec<Point2<f64>> =
                    run.iter().map(|i| outline.points[*i] + shift * outline.inward[*i]).collect();
                strokes.push((ink, thinned(&line)));
            }
        }
    }
    strokes
}

/// An ink, and whether it lies outside the outline.
type Intent = Option<(usize, bool)>;

/// What ink each point of an outline wants: the commonest in its surroundings along the outline.
fn intents(outline: &Outline, flat: &Flat, lines: &[f64]) -> Vec<Intent> {
    let look = |i: usize, side: f64| {
        let found = [1.0, 2.0, 3.0].into_iter().find_map(|depth| {
            let p = outline.points[i] + side * depth * outline.inward[i];
            let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < flat.width() as f64 && p.y < flat.height() as f64;
            let ink = usize::from(*flat.labels.get(p.y as usize * flat.width() + p.x as usize).filter(|_| inside)?);
            Some(ink).filter(|ink| Some(*ink) != flat.paper && *ink < lines.len())
        });
        found.map(|ink| (ink, side < 0.0))
    };
    let raw: Vec<Intent> = (0..outline.points.len()).map(|i| look(i, 1.0).or_else(|| look(i, -1.0))).collect();
    let n = raw.len();
    let around = |i: usize| {
        let at = |k: usize| {
            let j = i + n + k;
            if outline.closed {
                Some(raw[(j - WINDOW % n.max(1)) % n])
            } else {
                raw.get((i + k).checked_sub(WINDOW)?).copied()
            }
        };
        let mut votes: Vec<(Intent, usize)> = Vec::new();
        for w in (0..=2 * WINDOW).filter_map(at) {
            match votes.iter_mut().find(|v| v.0 == w) {
                Some(v) => v.1 += 1,
                None => votes.push((w, 1)),
            }
        }
        votes.into_iter().max_by_key(|(w, votes)| (*votes, std::cmp::Reverse(*w))).and_then(|v| v.0)
    };
    (0..n).map(around).collect()
}

/// Runs of points of one intent, each at most so long.
fn runs(intent: &[Intent], closed: bool, longest: usize) -> Vec<(Intent, Vec<usize>)> {
    let n = intent.len();
    // a closed outline is cut where the intent changes
    let cut = if closed { (0..n).find(|i| intent[*i] != intent[(i + n - 1) % n]) } else { Some(0) };
    let whole = cut.is_none();
    let cut = cut.unwrap_or(0);
    let mut runs: Vec<(Intent, Vec<usize>)> = Vec::new();
    for k in 0..n {
        let i = (cut + k) % n;
        match runs.last_mut() {
            Some((w, run)) if *w == intent[i] && run.len() < longest.max(2) => run.push(i),
            // pieces of one ink share the point where they meet
            Some((w, run)) if *w == intent[i] => {
                let joint = run[run.len() - 1];
                runs.push((intent[i], vec![joint, i]));
            }
            _ => runs.push((intent[i], vec![i])),
        }
    }
    if whole && let Some((_, run)) = runs.last_mut() {
        run.push(cut);
    }
    runs
}

/// A curve with fewer points, off by at most a tenth of a pixel (Douglas and Peucker 1973).
fn thinned(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    const OFF: f64 = 0.1;
    let n = points.len();
    if n < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; n];
    (keep[0], keep[n - 1]) = (true, true);
    let mut todo = vec![(0, n - 1)];
    while let Some((a, b)) = todo.pop() {
        let chord = points[b] - points[a];
        let off = |i: usize| {
            let d = points[i] - points[a];
            let t = (d.dot(&chord) / chord.norm_squared().max(1e-12)).clamp(0.0, 1.0);
            (d - t * chord).norm()
        };
        if let Some(far) = (a + 1..b).max_by(|i, j| off(*i).total_cmp(&off(*j))).filter(|i| off(*i) > OFF) {
            keep[far] = true;
            todo.push((a, far));
            todo.push((far, b));
        }
    }
    points.iter().zip(keep).filter(|(_, k)| *k).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_cover_an_outline_once_and_close_a_loop_of_one_ink() {
        let (a, b) = (Some((0, false)), Some((1, false)));
        let found = runs(&[a, a, b, b, b, a], true, 100);
        assert_eq!(found, [(b, vec![2, 3, 4]), (a, vec![5, 0, 1])]);
        assert_eq!(runs(&[a, a, a], true, 100), [(a, vec![0, 1, 2, 0])]);
        assert_eq!(runs(&[a, a, a, a], false, 2), [(a, vec![0, 1]), (a, vec![1, 2]), (a, vec![2, 3])]);
    }

    #[test]
    fn thinning_keeps_the_curve() {
        let arc: Vec<Point2<f64>> =
            (0..=100).map(|i| f64::from(i) * 0.02).map(|a| Point2::new(40.0 * a.cos(), 40.0 * a.sin())).collect();
        let few = thinned(&arc);
        assert!(few.len() < 25, "{}", few.len());
        assert!(few.windows(2).all(|w| (nalgebra::center(&w[0], &w[1]).coords.norm() - 40.0).abs() < 0.12));
    }
}
