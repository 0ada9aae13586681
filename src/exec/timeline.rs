//! What an arm did as a plan, in the time of the run.
use super::{Done, Made, cut};
use crate::plan::{ArmPlan, Segment, SegmentKind, Trajectory};
use crate::robot::JointVector;

/// A pause longer than this is a wait, s: motions settle for a step or two between them.
const PAUSE: f64 = 3e-3;

impl<P> Done<P> {
    /// All motion of arm `arm` that was carried out, with the waits between; `planned` are the segments that were planned ahead, `home`
    /// the joints (rad) at the beginning.
    pub fn plan(&self, arm: usize, planned: &[&Segment], home: &JointVector) -> ArmPlan {
        let mut segments: Vec<Segment> = Vec::new();
        for made in &self.made {
            let segment = match made {
                Made::Own(segment) => segment.clone(),
                Made::Planned { index, start, until } => {
                    cut(Segment { start: *start, ..planned[*index].clone() }, *until)
                }
            };
            let end = segments.last().map_or(0.0, Segment::end);
            if segment.start - end > PAUSE {
                let at = segments.last().and_then(|s| s.trajectory.knots().last()).map_or(*home, |k| k.q);
                let trajectory = Trajectory::rest(at, segment.start - end);
                let (kind, depth) = (SegmentKind::Wait, Default::default());
                segments.push(Segment { kind, layer: segment.layer, stroke: None, start: end, trajectory, depth });
            }
            segments.push(segment);
        }
        ArmPlan { arm, segments }
    }
}
