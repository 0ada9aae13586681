//! The plan as data: what each arm does, segment after segment.
use crate::plan::{DepthProfile, Trajectory};

/// What an arm does in a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SegmentKind {
    /// Moves freely, pen off the canvas.
    Travel,
    /// From the hover height straight down until the pen is pressed to its depth.
    Press,
    /// Draws a stroke at the press depth.
    Draw,
    /// Straight up from the canvas to the hover height.
    Lift,
    /// Stands at the service pose while a person changes the pen for the segment's ink.
    ChangePen,
    /// Takes a pen tool from its dock, or puts it back.
    ChangeTool,
    /// Stands clear until the canvas is free.
    Wait,
}

impl SegmentKind {
    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Travel => "a travel",
            Self::Press => "a press",
            Self::Draw => "a line",
            Self::Lift => "a lift",
            Self::ChangePen => "a change of the pen",
            Self::ChangeTool => "a tool change",
            Self::Wait => "a wait",
        }
    }
}

/// One piece of motion.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Segment {
    /// What is done.
    pub kind: SegmentKind,
    /// Index of the layer (ink) that it belongs to.
    pub layer: usize,
    /// Index of the stroke within the layer, for `Press`, `Draw` and `Lift`.
    pub stroke: Option<usize>,
    /// Start, s from the start of the plan.
    pub start: f64,
    /// Joint motion; its own time starts at 0.
    pub trajectory: Trajectory,
    /// Press depth in the same time, of `Draw`; empty otherwise.
    pub depth: DepthProfile,
}

/// The segments of one arm, one after another in time without gaps.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ArmPlan {
    /// Index of the arm in the cell.
    pub arm: usize,
    /// Segments in order.
    pub segments: Vec<Segment>,
}

impl ArmPlan {
    /// The segments cut where the pen is changed: each piece begins and ends at rest in the waiting pose, its time at 0.
    pub fn visits(&self) -> Vec<Vec<Segment>> {
        let mut pieces: Vec<Vec<Segment>> = vec![Vec::new()];
        for segment in self.segments.clone() {
            match (segment.kind, pieces.last_mut()) {
                (SegmentKind::ChangePen, _) => pieces.push(Vec::new()),
                (_, Some(piece)) => piece.push(segment),
                _ => {}
            }
        }
        pieces.retain(|p| !p.is_empty());
        for piece in &mut pieces {
            // the way to the next pen is still made with this one
            let (began, layer) = (piece[0].start, piece[0].layer);
            for segment in piece {
                segment.start -= began;
                segment.layer = layer;
            }
        }
        pieces
    }
}

/// What every arm does. Times are common to all arms.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// One entry an arm.
    pub arms: Vec<ArmPlan>,
}

impl Segment {
    /// End, s from the start of the plan.
    pub fn end(&self) -> f64 {
        self.start + self.trajectory.duration()
    }
}

impl ArmPlan {
    /// What is done of it by `time` (s): the segment under way then ends there, those after it are left out.
    pub fn until(mut self, time: f64) -> Self {
        self.segments.retain(|s| s.start < time);
        if let Some(last) = self.segments.last_mut().filter(|s| s.end() > time) {
            last.trajectory = last.trajectory.until(time - last.start);
        }
        self
    }
}

impl Plan {
    /// Time until the last arm is done, s.
    pub fn duration(&self) -> f64 {
        self.arms.iter().filter_map(|a| a.segments.last()).map(Segment::end).fold(0.0, f64::max)
    }
}
