//! How long a robot that drives takes for a drawing.
use crate::artwork::{estimated_time, pen_change_time};
use crate::drawing::Drawing;
use crate::plan::cover::{BasePose as Stand, Coverage, turned_round};
use crate::robot::{Arm, BasePose};
use crate::scenario::{Scenario, Sketch};

/// Time of a robot's work, s, by rules of thumb.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorkTime {
    /// Lines, presses, lifts and travels.
    pub drawing: f64,
    /// From where it starts to its places in turn.
    pub driving: f64,
    /// Changes of pen by hand.
    pub changing: f64,
}

impl WorkTime {
    /// The time for `drawing` as `coverage` shares it out: at each place the inks follow each other, the pen in the holder first where
    /// it is one of the ends.
    pub fn of(scenario: &Scenario, arm: &Arm, drawing: &Drawing, coverage: &Coverage) -> Self {
        let sketch = Sketch::from(scenario);
        let mut time = Self::default();
        let mut pen = None;
        let mut changes = 0;
        for k in 0..coverage.places.len() {
            let part = coverage.part(drawing, k);
            let used: Vec<usize> = (0..part.layers.len()).filter(|l| !part.layers[*l].strokes.is_empty()).collect();
            let (Some(first), Some(last)) = (used.first(), used.last()) else { continue };
            let (begins, ends) = if turned_round(&used, pen) { (*last, *first) } else { (*first, *last) };
            changes += used.len() - 1 + usize::from(pen.is_some_and(|p| p != begins));
            pen = Some(ends);
            time.drawing += estimated_time(&part, &sketch) - (used.len() - 1) as f64 * pen_change_time(&sketch);
        }
        time.changing = changes as f64 * pen_change_time(&sketch);
        let options = scenario.drive.clone().unwrap_or_default().options();
        let options = arm.base.as_ref().map_or_else(|| options.clone(), |b| options.within(&b.limits));
        let stand = |p: &Stand| BasePose { x: p.x, y: p.y, yaw: p.heading };
        for way in std::iter::once(&coverage.way_in).chain(&coverage.drives) {
            let stops: Vec<BasePose> = way.iter().map(stand).collect();
            if let Some((from, stops)) = stops.split_first() {
                time.driving += options.duration(from, stops);
            }
        }
        time
    }

    /// All of it.
    pub fn total(&self) -> f64 {
        self.drawing + self.driving + self.changing
    }
}
