//! How near arms came to each other.
use super::Done;
use crate::plan::{ArmPlan, Motion, Nearest, Plan, SegmentKind, nearest};
use crate::robot::{ArmModel, JointVector};
use crate::twin::grasp::ChangeRecord;

/// Time between looks at how near arms are, s.
const LOOK: f64 = 0.01;

/// How near any two arms come: as planned, and as simulated.
#[derive(Clone, Copy, Debug, Default)]
pub struct Distances {
    /// As planned.
    pub planned: Option<Nearest>,
    /// As simulated.
    pub simulated: Option<Nearest>,
}

impl Distances {
    /// The least distances of all pairs of arms, whose models are `models` and whose motion was `plan` as desired.
    pub fn of<P>(models: &[ArmModel], plan: &Plan, done: &[Done<P>]) -> Self {
        let planned: Vec<Way> = plan.arms.iter().zip(done).map(|(arm, d)| desired_way(arm, d)).collect();
        let simulated: Vec<Way> =
            done.iter().map(|d| d.log.samples.iter().map(|s| (s.time, joints(&s.q))).collect()).collect();
        Self { planned: least(models, &planned), simulated: least(models, &simulated) }
    }

    /// Where the plan brings two arms nearer than `margin` (m).
    pub fn planned_within(&self, margin: f64) -> Option<Nearest> {
        self.planned.filter(|n| n.distance < margin)
    }
}

type Way = Vec<(f64, JointVector)>;

fn joints(q: &[f64]) -> JointVector {
    JointVector::from_fn(|i, _| q.get(i).copied().unwrap_or(0.0))
}

fn least(models: &[ArmModel], ways: &[Way]) -> Option<Nearest> {
    let motion = |i: usize| Motion { arm: &models[i], way: ways[i].clone() };
    let pairs = (0..ways.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let near = pairs.filter_map(|(a, b)| nearest(&motion(b), &motion(a), LOOK));
    near.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// An arm's joints over the time of the run: as desired where it travels and draws, as they were in tool changes.
fn desired_way<P>(arm: &ArmPlan, done: &Done<P>) -> Way {
    let mut way = Vec::new();
    let mut changes = done.log.changes.iter();
    for segment in &arm.segments {
        if segment.kind == SegmentKind::ChangeTool {
            let motion = changes.next().map_or(&[][..], |c| &c.motion);
            way.extend(motion.iter().enumerate().map(|(i, m)| (segment.start + i as f64 * ChangeRecord::PERIOD, m.q)));
            continue;
        }
        let (mut cursor, count) = (0, (segment.trajectory.duration() / LOOK).ceil() as usize);
        for i in 0..=count {
            let t = (i as f64 * LOOK).min(segment.trajectory.duration());
            way.push((segment.start + t, segment.trajectory.sample(t, &mut cursor).q));
        }
    }
    way
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_too_near_below_the_margin_alone() {
        let planned = |distance| Distances { planned: Some(Nearest { distance, time: 12.5 }), simulated: None };
        assert_eq!(planned(0.0299).planned_within(0.03).map(|n| n.time), Some(12.5));
        assert!(planned(0.03).planned_within(0.03).is_none() && Distances::default().planned_within(0.03).is_none());
    }
}
