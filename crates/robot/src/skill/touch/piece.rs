//! Pieces of strokes on the canvas as it is believed by now, and what drawing them teaches.
use std::time::Instant;

use nalgebra::{Point3, Vector3};

use super::TouchStrokes;
use super::job::StrokeTouches;
use super::phase::{Line, Phase};
use crate::drawing::{Drawing, InkLayer};
use crate::plan::{Descent, Obstruction, Segment, SegmentKind, Unreachable};
use crate::skill::{Felt, Move, PolicyError, Task};
use crate::surface::{Projection, SurfaceTarget, map_drawing};

/// Touches of a rest that are averaged.
const AVERAGED: usize = 6;
/// How often a piece of a stroke is begun anew before its rest is given up.
const MOST_TRIES: u32 = 6;

impl TouchStrokes {
    pub(super) fn begin_piece(&mut self) -> Result<(), PolicyError> {
        let targets = self.mapped_piece()?;
        let s = &mut self.state.stroke;
        s.whole = length(&targets);
        s.targets = targets;
        (s.first, s.tries, s.why) = (0, 0, None);
        self.state.phase = Phase::Piece;
        Ok(())
    }

    /// The rest of a piece: more than once where the arm has to lift the pen within it.
    pub(super) fn piece(&mut self) -> Result<Option<Task>, PolicyError> {
        let s = &mut self.state.stroke;
        let n = s.targets.len();
        if !(s.first + 1 < n || (n == 1 && s.first == 0)) {
            self.state.phase = Phase::PieceDone;
            return Ok(None);
        }
        s.tries += 1;
        if s.tries > MOST_TRIES {
            s.why = s.why.take().or(Some(Obstruction::NoApproach));
            self.state.phase = Phase::PieceDone;
            return Ok(None);
        }
        let (down, rest, layer, at) = (s.down, s.targets[s.first..].to_vec(), self.state.layer, self.state.last.q);
        self.planner()?;
        let started = Instant::now();
        let canvas = self.believed()?;
        if !down {
            let clear = self.clear()?;
            let descent = Descent {
                high: self.options.hover,
                slow_from: self.touch.clearance,
                low: -self.touch.seek,
                speed: self.options.landing_speed,
            };
            let planner = self.planner()?;
            let way = planner
                .posture(&canvas, &rest, layer)
                .and_then(|q| planner.approach(&canvas, &clear, &rest[0], Some(&q), &at, &descent));
            self.state.planning += started.elapsed().as_secs_f64();
            return Ok(match way {
                Ok([over, down]) => {
                    self.state.phase = Phase::Approaching(down);
                    Some(self.alone(SegmentKind::Travel, over))
                }
                Err(reason) => {
                    self.state.stroke.why = Some(reason);
                    self.state.phase = Phase::PieceDone;
                    None
                }
            });
        }
        let planned = self.planner()?.piece(&canvas, &rest, layer, &at);
        self.state.planning += started.elapsed().as_secs_f64();
        match planned {
            Ok(Some(drawn)) => {
                let stroke = self.stroke_index();
                let segment =
                    |kind, start, trajectory, depth| Segment { kind, layer, stroke, start, trajectory, depth };
                let enter = segment(SegmentKind::Press, 0.0, drawn.enter, Default::default());
                let draw = segment(SegmentKind::Draw, enter.end(), drawn.draw, drawn.depth);
                let line = Line { segment: draw, reached: drawn.reached, stopped: drawn.stopped };
                self.state.phase = Phase::Entering(Box::new(line));
                Ok(Some(Task::Press(Move { segment: enter, begins: true, ends: false, planned: None, visit: None })))
            }
            other => {
                self.state.stroke.down = false;
                if let Err(reason) = other {
                    self.state.stroke.why = Some(reason);
                }
                self.lift(self.off_the_canvas(), Phase::LeavingPiece).map(Some)
            }
        }
    }

    pub(super) fn learn_line(&mut self, felt: &[Felt]) {
        for f in felt.iter().filter(|f| f.kind == SegmentKind::Draw) {
            let point = self.surface_point(f);
            self.state.stroke.met.push(point);
            self.state.canvas.learn(&point);
        }
    }

    /// Learns the place where the pen rests on the canvas. False when it feels nothing there.
    pub(super) fn learn_landing(&mut self, felt: &[Felt]) -> bool {
        let points: Vec<Point3<f64>> = felt.iter().rev().take(AVERAGED).map(|f| self.surface_point(f)).collect();
        if points.is_empty() {
            return false;
        }
        let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
        self.state.canvas.learn(&Point3::from(sum / points.len() as f64));
        true
    }

    /// The point of the surface that a touch tells of: the nib gives way by its spring.
    pub(super) fn surface_point(&self, felt: &Felt) -> Point3<f64> {
        felt.tip - felt.axis * (felt.force / self.springs[self.state.layer])
    }

    /// Books a piece that is drawn up to target `first`.
    pub(super) fn book(&mut self) {
        let place = self.order[self.state.done];
        let layer = &self.drawing.layers[place.layer];
        let (s, reach) = (&mut self.state.stroke, &mut self.state.reach);
        let missing = if s.first >= s.targets.len() { 0.0 } else { length(&s.targets[s.first..]) };
        reach.length += s.whole;
        reach.reachable_length += (s.whole - missing).max(0.0);
        if s.first < s.targets.len() {
            reach.unreachable.push(Unreachable {
                layer: place.layer,
                layer_name: layer.name.clone(),
                stroke: place.stroke,
                first: s.first,
                last: s.targets.len() - 1,
                sheet: s.targets[s.first].sheet,
                length: missing,
                reason: s.why.take().unwrap_or(Obstruction::NoApproach),
            });
        }
    }

    pub(super) fn end_stroke(&mut self) {
        let place = self.order[self.state.done];
        let Some(before) = self.state.stroke.before.take() else { return };
        let surface = before.surface();
        let frame = before.sheet().world_from_sheet;
        let error = |p: &Point3<f64>| {
            let p = frame.inverse_transform_point(p);
            surface.height(&p.xy()) - p.z
        };
        self.state.touches.push(StrokeTouches {
            layer: place.layer,
            stroke: place.stroke,
            time: self.state.time,
            known: before.touches(),
            errors: self.state.stroke.met.iter().map(error).collect(),
        });
    }

    /// The present piece of the stroke on the canvas as it is believed now.
    pub(super) fn mapped_piece(&self) -> Result<Vec<SurfaceTarget>, PolicyError> {
        let layer = &self.drawing.layers[self.order[self.state.done].layer];
        let piece = self.state.stroke.pieces[self.state.stroke.piece].clone();
        let alone = InkLayer { strokes: vec![piece], ..layer.clone() };
        let alone = Drawing::new(self.drawing.width, self.drawing.height, vec![alone]);
        let believed = self.believed()?;
        let mut mapped = map_drawing(&alone, &Projection::new(&believed), self.touch.step)?;
        Ok(mapped.layers.remove(0).strokes.into_iter().next().map(|s| s.targets).unwrap_or_default())
    }
}

/// Length of the line through targets, m.
fn length(targets: &[SurfaceTarget]) -> f64 {
    targets.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum()
}
