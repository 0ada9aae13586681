//! Probes and landings: where the canvas is met.
use std::time::Instant;

use nalgebra::Point3;

use super::phase::Phase;
use super::{StrokeState, TouchStrokes, UNDER};
use crate::plan::{Descent, Obstruction, SegmentKind};
use crate::skill::probing::pieces;
use crate::skill::{PolicyError, Task};

impl TouchStrokes {
    pub(super) fn begin_stroke(&mut self) -> Result<(), PolicyError> {
        let place = self.order[self.state.done];
        let stroke = &self.drawing.layers[place.layer].strokes[place.stroke];
        self.state.stroke = StrokeState {
            before: Some(self.state.canvas.clone()),
            pieces: pieces(stroke, self.touch.piece),
            ..StrokeState::default()
        };
        self.begin_piece()
    }

    /// Guarded moves at places of the drawing spread over a grid.
    pub(super) fn probe(&mut self, i: usize) -> Result<Option<Task>, PolicyError> {
        let [low, high] = self.touch.range;
        let middle = 0.5 * (low + high);
        let Some(place) = self.places.get(i).copied() else {
            if self.state.met_probes == 0 {
                return Err(PolicyError::NothingMet {
                    probes: self.places.len(),
                    range_mm: self.touch.range.map(|m| m * 1e3),
                });
            }
            self.state.probed = Some(self.state.canvas.clone());
            self.planner = None;
            self.state.phase = Phase::NextStroke;
            return Ok(None);
        };
        // the air ends at the top of the range
        let (clear, under) = (self.flat(high)?, self.flat(low - UNDER)?);
        let top = high + self.options.hover - middle;
        let descent = Descent { high: top, slow_from: top, low: low - middle, speed: self.touch.probe_speed };
        let at = self.state.last.q;
        self.planner()?;
        let started = Instant::now();
        let way = self.planner()?.approach(&under, &clear, &place, None, &at, &descent);
        self.state.planning += started.elapsed().as_secs_f64();
        Ok(match way {
            Ok([over, down]) => {
                self.state.phase = Phase::Approaching(down);
                self.state.stroke.piece = i;
                Some(self.alone(SegmentKind::Travel, over))
            }
            Err(_) => {
                self.state.phase = Phase::Probing(i + 1);
                None
            }
        })
    }

    /// After a landing, met or not.
    pub(super) fn landed(&mut self, met: bool) -> Result<Option<Task>, PolicyError> {
        if self.state.probed.is_none() {
            self.state.met_probes += usize::from(met);
            // back up to where the surface can't be
            let frame = self.state.canvas.sheet().world_from_sheet;
            let tip = self.arm.kinematics(&self.state.last.q).world_from_tip().translation.vector;
            let over = frame.inverse_transform_point(&Point3::from(tip)).z;
            let i = self.state.stroke.piece;
            let height = self.touch.range[1] + self.options.hover - over;
            return self.lift(height, Phase::LeavingProbe(i)).map(Some);
        }
        if !met {
            self.state.stroke.why = Some(Obstruction::NothingMet);
            return self.lift(self.options.hover + self.touch.seek, Phase::LeavingGap).map(Some);
        }
        self.state.stroke.down = true;
        // where it touched tells more of the surface
        self.state.stroke.targets = self.mapped_piece()?;
        self.state.phase = Phase::Piece;
        Ok(None)
    }

    pub(super) fn next_stroke(&mut self) -> Result<Option<Task>, PolicyError> {
        let Some(place) = self.order.get(self.state.done).copied() else {
            return self.travel_to_service(Phase::GoingHome).map(Some);
        };
        if place.layer == self.state.layer {
            self.state.phase = Phase::StrokeBegins;
            return Ok(None);
        }
        self.travel_to_service(Phase::ToService).map(Some)
    }
}
