//! Records of arms that were simulated apart, as one.
use crate::math::Digest;
use crate::twin::{ArmRecord, Record};

impl Record {
    /// One record of `parts`, each of one arm, whose own times (s) `when` turns into those of the whole. What happened after
    /// `until` (s, of the whole) is left out. Events are in time order, lines in the order in which they were begun.
    pub fn joined(parts: Vec<Record>, when: &dyn Fn(usize, f64) -> f64, until: f64) -> Record {
        let mut parts = parts.into_iter();
        let Some(mut whole) = parts.next() else {
            return Record::default();
        };
        retimed(&mut whole, 0, when, until);
        for (i, mut part) in parts.enumerate() {
            retimed(&mut part, i + 1, when, until);
            whole.arms.append(&mut part.arms);
            whole.events.append(&mut part.events);
            whole.ink.strokes.append(&mut part.ink.strokes);
            whole.steps += part.steps;
            whole.wall += part.wall;
        }
        whole.events.sort_by(|a, b| a.time.total_cmp(&b.time));
        let begun = |s: &crate::ink::InkStroke| s.points.first().map_or(0.0, |p| p.time);
        whole.ink.strokes.sort_by(|a, b| begun(a).total_cmp(&begun(b)));
        let last = |a: &ArmRecord| a.samples.last().map_or(0.0, |s| s.time);
        whole.simulated = whole.arms.iter().map(last).fold(0.0, f64::max);
        let mut digest = Digest::new();
        for r in &whole.arms {
            digest.numbers(&r.final_q).numbers(&r.final_qd).numbers([&r.max_force]);
        }
        whole.ink.digest(&mut digest);
        whole.digest = digest.hex();
        whole
    }
}

fn retimed(part: &mut Record, arm: usize, when: &dyn Fn(usize, f64) -> f64, until: f64) {
    for a in &mut part.arms {
        a.samples.iter_mut().for_each(|s| s.time = when(arm, s.time));
        a.samples.retain(|s| s.time <= until);
        for s in &mut a.strokes {
            (s.start, s.end) = (when(arm, s.start), when(arm, s.end));
        }
        a.strokes.retain(|s| s.start <= until);
    }
    for e in &mut part.events {
        (e.arm, e.time) = (arm, when(arm, e.time));
    }
    part.events.retain(|e| e.time <= until);
    for line in &mut part.ink.strokes {
        line.arm = arm as u32;
        line.points.iter_mut().for_each(|p| p.time = when(arm, p.time));
        line.points.retain(|p| p.time <= until);
    }
    part.ink.strokes.retain(|line| !line.points.is_empty());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ink::{InkPoint, InkStroke};
    use crate::math::Rgb;
    use nalgebra::{Point2, Point3, Vector3};

    fn line(times: &[f64]) -> Record {
        let point = |time: f64| InkPoint {
            position: Point3::origin(),
            normal: Vector3::z(),
            sheet: Point2::new(time, 0.0),
            width: 1e-3,
            density: 1.0,
            time,
        };
        let points = times.iter().map(|t| point(*t)).collect();
        let mut record = Record::default();
        record.ink.inks = vec![crate::ink::TraceInk { name: "black".into(), color: Rgb([0, 0, 0]) }];
        record.ink.strokes = vec![InkStroke { ink: 0, stroke: None, arm: 0, points }];
        record
    }

    #[test]
    fn lines_stand_in_the_order_of_the_whole_and_what_comes_too_late_is_left_out() {
        let late = |arm: usize, t: f64| if arm == 0 { t + 10.0 } else { t };
        let joined = Record::joined(vec![line(&[1.0, 2.0]), line(&[3.0, 12.5])], &late, 11.5);
        let seen: Vec<_> = joined.ink.strokes.iter().map(|s| (s.arm, s.points.len(), s.points[0].time)).collect();
        assert_eq!(seen, [(1, 1, 3.0), (0, 1, 11.0)]);
    }
}
