//! How near two arms come to each other in time.
use crate::robot::{ArmModel, JointVector};

/// The least distance between two arms, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// No two points of the arms are ever nearer than this, m: distances at the samples, less what the arms can move until the next.
    pub distance: f64,
    /// When, s.
    pub time: f64,
}

/// Joints of an arm over time, between which it moves straight.
pub struct Motion<'a> {
    /// The arm.
    pub arm: &'a ArmModel,
    /// Times (s, rising) and joints.
    pub way: Vec<(f64, JointVector)>,
}

impl Motion<'_> {
    fn at(&self, time: f64, cursor: &mut usize) -> JointVector {
        while *cursor + 1 < self.way.len() && self.way[*cursor + 1].0 <= time {
            *cursor += 1;
        }
        let (t, q) = self.way[*cursor];
        match self.way.get(*cursor + 1) {
            Some((next, to)) if time > t => q + (to - q) * ((time - t) / (next - t)),
            _ => q,
        }
    }
}

/// Distance between two arms but for their bases, m.
fn distance(a: (&ArmModel, &JointVector), b: (&ArmModel, &JointVector)) -> f64 {
    let capsules = |(arm, q): (&ArmModel, &JointVector)| arm.capsules(&arm.kinematics(q), 1).collect::<Vec<_>>();
    let (a, b) = (capsules(a), capsules(b));
    a.iter().flat_map(|c| b.iter().map(|d| c.distance(d))).fold(f64::INFINITY, f64::min)
}

/// The least distance between two arms while either moves, looked at every `period` (s). Instants at which they can't be nearer than
/// before, by how far they have moved since the last look, are passed over.
pub fn nearest(a: &Motion, b: &Motion, period: f64) -> Option<Nearest> {
    let end = a.way.last()?.0.max(b.way.last()?.0);
    let count = (end / period).ceil() as usize + 1;
    let (mut ca, mut cb) = (0, 0);
    let mut joints: Vec<(JointVector, JointVector)> = Vec::with_capacity(count);
    for i in 0..count {
        let t = i as f64 * period;
        joints.push((a.at(t, &mut ca), b.at(t, &mut cb)));
    }
    let (ra, rb) = (a.arm.reach(), b.arm.reach());
    // how far all points of both arms together have moved at most
    let mut moved = vec![0.0; count];
    for i in 1..count {
        let d = |now: &JointVector, last: &JointVector, reach: &JointVector| (now - last).abs().dot(reach);
        moved[i] = moved[i - 1] + d(&joints[i].0, &joints[i - 1].0, &ra) + d(&joints[i].1, &joints[i - 1].1, &rb);
    }
    let mut least = Nearest { distance: f64::INFINITY, time: 0.0 };
    let mut i = 0;
    while i < count {
        let d = distance((a.arm, &joints[i].0), (b.arm, &joints[i].1));
        let until_next = moved[(i + 1).min(count - 1)] - moved[i];
        if d - until_next < least.distance {
            least = Nearest { distance: d - until_next, time: i as f64 * period };
        }
        // not before the arms have moved by what is missing can they be nearer
        let room = d - least.distance;
        let from = moved[i];
        i += 1;
        while i < count && moved[(i + 1).min(count - 1)] - from <= room {
            i += 1;
        }
    }
    Some(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Cell;
    use std::path::Path;

    #[test]
    fn nothing_is_passed_over() {
        let cell = Cell::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/dual_ur5e.toml")).unwrap();
        let [a, b] = [&cell.arms[0], &cell.arms[1]];
        let way = |home: &JointVector, swing: f64| -> Vec<(f64, JointVector)> {
            let mut q = *home;
            q[0] += swing;
            vec![(0.0, *home), (1.0, *home), (2.0, q), (2.5, *home), (4.0, *home)]
        };
        let a = Motion { arm: &a.model, way: way(&a.home, 0.5) };
        let b = Motion { arm: &b.model, way: way(&b.home, 0.3) };
        let period = 0.01;
        let found = nearest(&a, &b, period).unwrap();
        let (mut ca, mut cb) = (0, 0);
        let mut least = f64::INFINITY;
        for i in 0..=4000 {
            let t = f64::from(i) * 1e-3;
            least = least.min(distance((a.arm, &a.at(t, &mut ca)), (b.arm, &b.at(t, &mut cb))));
        }
        assert!(found.distance <= least && found.distance > least - 0.04, "{} m, {least} m", found.distance);
    }
}
