//! From pen contact, one physics step after another, to inked lines.
use nalgebra::{Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::drawing::StrokeId;
use crate::ink::{InkPoint, InkStroke, InkTrace, TraceInk};
use crate::pen::PenModel;

/// Largest distance between the points of a line, m; broad lines take an eighth of their width where that is more.
const SPACING: f64 = 0.15e-3;
/// Motion within this distance of the last point, m, is rest: the point grows instead of the line.
const REST: f64 = 0.02e-3;
/// Relative change of width or density that earns a point of its own.
const CHANGE: f64 = 0.02;

/// The nib on the canvas in one physics step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NibContact {
    /// Contact point on the true surface, m, world.
    pub position: Point3<f64>,
    /// Smooth unit normal of the surface there.
    pub normal: Vector3<f64>,
    /// Normal force, N, at least 0.
    pub normal_force: f64,
    /// Speed at which the nib slips over the surface, m/s, at least 0.
    pub slip_speed: f64,
}

/// What changes in a pen as it draws.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PenState {
    /// Ink left, m^3.
    pub left: f64,
    /// How long the paper under the nib has been wet, s; see [`PenState::step`].
    pub wetting_time: f64,
    /// Ink in the spot under the nib, m^3.
    pub spot: f64,
    /// Where the nib was in the last step, m, world; `None` when it was not on the canvas.
    pub position: Option<Point3<f64>>,
    /// How long the nib has dried in the open, s; drawing makes it less.
    pub open: f64,
}

impl PenState {
    /// A full pen off the canvas.
    pub fn full(pen: &PenModel) -> Self {
        Self { left: pen.volume, wetting_time: 0.0, spot: 0.0, position: None, open: 0.0 }
    }

    /// One physics step of `dt`, s: the width, m, and density of what the nib leaves, or `None` where it leaves nothing
    /// (no contact, too little force, or dry).
    ///
    /// The wetting time obeys `dt_w/dt = 1 - (v t_w / w)^2`: it is `w/v` in steady motion, grows with the clock at rest, and
    /// is forgotten within half a width once the nib has left the spot. A nib arrives wet, so a line starts at the nominal
    /// wetting time. The equation is stepped semi-implicitly, which keeps it positive and its steady state exact.
    ///
    /// Ink is conserved: a step takes `film D w ds` for the newly covered strip, and at rest whatever the spot under the
    /// nib has grown by, out of what is left.
    pub fn step(&mut self, pen: &PenModel, dt: f64, contact: Option<&NibContact>) -> Option<(f64, f64)> {
        let Some(contact) = contact.filter(|c| c.normal_force >= pen.force_min && c.normal_force > 0.0) else {
            self.position = None;
            self.open += dt;
            return None;
        };
        let width = pen.contact_width(contact.normal_force);
        let (touched, before) = match self.position {
            Some(_) => (false, self.wetting_time),
            None => (true, pen.wetting_time_nominal()),
        };
        let rate = contact.slip_speed / width;
        self.wetting_time = (before + dt) / (1.0 + rate * rate * before * dt);
        let density = pen.density(self.wetting_time, contact.slip_speed, width)
            * pen.fade(self.left)
            * pen.drying.map_or(1.0, |d| d.share(self.open));
        let travelled = self.position.map_or(0.0, |last| (contact.position - last).norm());
        self.position = Some(contact.position);
        if let Some(d) = &pen.drying {
            // what lies beyond the open time has dried, and comes back with the line; a nib that draws wet begins anew
            let dried = (self.open - d.open).max(0.0) * (-travelled / d.recovery).exp();
            self.open = if dried > 1e-9 { d.open + dried } else { 0.0 };
        }
        if density < pen.density_min {
            self.spot = 0.0;
            return None;
        }
        let width = width + pen.spread(self.wetting_time);
        let spot = std::f64::consts::FRAC_PI_4 * width * width * density * pen.film();
        let mut taken = travelled * width * density * pen.film();
        if touched {
            taken += spot;
            self.spot = spot;
        } else if self.wetting_time > before {
            taken += (spot - self.spot).max(0.0);
            self.spot = self.spot.max(spot);
        } else {
            self.spot = spot;
        }
        self.left -= taken.min(self.left);
        Some((width, density))
    }
}

/// Time for which ink stays wet enough to take more without a seam, s.
const WET: f64 = 1.0;
/// How far from the end of a line its wet ink reaches, in widths of the line.
const WET_REACH: f64 = 0.25;

/// Records the lines of one pen in one arm's hand.
///
/// Points are placed only as close as the line needs: at most 0.15 mm apart, or an eighth of the width of broad
/// lines, and nearer where width or density changes by 2 %.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct InkRecorder {
    pen: PenModel,
    state: PenState,
    ink: u32,
    arm: u32,
    strokes: Vec<InkStroke>,
    /// Whether the last stroke is still being drawn.
    drawing: bool,
    /// The latest deposit, which may lie beyond the last point.
    latest: Option<Deposit>,
}

/// A deposit that may become a point.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Deposit {
    position: Point3<f64>,
    normal: Vector3<f64>,
    width: f64,
    density: f64,
    time: f64,
}

impl InkRecorder {
    /// A full pen with the ink of index `ink` in [`InkTrace::inks`], held by arm `arm`.
    pub fn new(pen: PenModel, ink: u32, arm: u32) -> Self {
        let state = PenState::full(&pen);
        Self { pen, state, ink, arm, strokes: Vec::new(), drawing: false, latest: None }
    }

    /// Caps the pen, or stands it in a dock whose seal closes: its nib is wet again.
    pub fn cap(&mut self) {
        self.state.open = 0.0;
    }

    /// Leaves the nib in the open for `time` s.
    pub fn advance_drying(&mut self, time: f64) {
        self.state.open += time;
    }

    /// Lines that no step can go on with, taken out; the last one stays, as wet ink may join it.
    pub fn take_ended(&mut self) -> Vec<InkStroke> {
        let last = self.strokes.len().saturating_sub(1);
        self.strokes.drain(..last).collect()
    }

    /// Lines that are still here.
    pub fn lines(&self) -> &[InkStroke] {
        &self.strokes
    }

    /// The pen.
    pub fn pen(&self) -> &PenModel {
        &self.pen
    }

    /// Its state.
    pub fn state(&self) -> &PenState {
        &self.state
    }

    /// Whether ink flowed in the last step.
    pub fn inking(&self) -> bool {
        self.drawing
    }

    /// One physics step of `dt`, s, that ends at `time`, s: leaves ink where `contact` is, and none without it.
    ///
    /// A line ends when ink stops flowing or `stroke` changes. `to_sheet` maps a surface point (m, world) to the sheet (m) and
    /// is called only for the few points that are kept; where it knows none, the line is broken.
    pub fn step(
        &mut self,
        dt: f64,
        time: f64,
        contact: Option<&NibContact>,
        stroke: Option<StrokeId>,
        to_sheet: impl Fn(&Point3<f64>) -> Option<Point2<f64>>,
    ) {
        let flow = self.state.step(&self.pen, dt, contact);
        let (Some(contact), Some((width, density))) = (contact, flow) else {
            self.finish_line(&to_sheet);
            return;
        };
        let now = Deposit { position: contact.position, normal: contact.normal, width, density, time };
        if self.drawing && self.strokes.last().is_some_and(|s| s.stroke != stroke) {
            self.latest = Some(now);
            self.finish_line(&to_sheet);
        }
        if !self.drawing && self.is_wet(&now, stroke) {
            self.drawing = true;
        }
        if !self.drawing {
            if let Some(point) = now.on_sheet(&to_sheet) {
                self.strokes.push(InkStroke { ink: self.ink, stroke, arm: self.arm, points: vec![point] });
                self.drawing = true;
                self.latest = None;
            }
            return;
        }
        let Some(last) = self.strokes.last_mut().and_then(|s| s.points.last_mut()) else { return };
        let moved = (now.position - last.position).norm_squared();
        if moved < REST * REST {
            last.width = last.width.max(width);
            last.density = last.density.max(density);
            self.latest = None;
            return;
        }
        let spacing = SPACING.max(width / 8.0);
        let changed =
            (width - last.width).abs() > CHANGE * last.width || (density - last.density).abs() > CHANGE * last.density;
        self.latest = Some(now);
        if moved >= spacing * spacing || changed {
            self.keep_latest(&to_sheet);
        }
    }

    /// Whether a deposit falls on the still wet end of the last line of the same stroke: a nib that bounces as it lands
    /// goes on with that line, and doesn't lay a second one over it.
    fn is_wet(&self, now: &Deposit, stroke: Option<StrokeId>) -> bool {
        let Some(line) = self.strokes.last().filter(|line| line.stroke == stroke) else { return false };
        let Some(end) = line.points.last() else { return false };
        now.time - end.time < WET && (now.position - end.position).norm() < WET_REACH * end.width
    }

    /// Makes the latest deposit a point of the line; ends the line where the sheet ends.
    fn keep_latest(&mut self, to_sheet: &impl Fn(&Point3<f64>) -> Option<Point2<f64>>) {
        let (Some(latest), Some(line)) = (self.latest.take(), self.strokes.last_mut()) else { return };
        match latest.on_sheet(to_sheet) {
            Some(point) => line.points.push(point),
            None => self.drawing = false,
        }
    }

    /// Ends the line that is being drawn, if any, at the latest deposit.
    fn finish_line(&mut self, to_sheet: &impl Fn(&Point3<f64>) -> Option<Point2<f64>>) {
        if self.drawing {
            self.keep_latest(to_sheet);
            self.drawing = false;
        }
        self.latest = None;
    }
}

impl Deposit {
    fn on_sheet(&self, to_sheet: &impl Fn(&Point3<f64>) -> Option<Point2<f64>>) -> Option<InkPoint> {
        let Self { position, normal, width, density, time } = *self;
        Some(InkPoint { position, normal, sheet: to_sheet(&position)?, width, density, time })
    }
}

impl InkTrace {
    /// The trace of all recorders, lines in the order in which they were begun; lines begun at the same time in the
    /// order of the recorders. A line still being drawn ends at its last point; a [step](InkRecorder::step) without contact
    /// ends it where the nib is.
    pub fn merged(inks: Vec<TraceInk>, recorders: impl IntoIterator<Item = InkRecorder>) -> Self {
        let mut strokes: Vec<InkStroke> = recorders.into_iter().flat_map(|r| r.strokes).collect();
        let begun = |s: &InkStroke| s.points.first().map_or(0.0, |p| p.time);
        strokes.sort_by(|a, b| begun(a).total_cmp(&begun(b)));
        Self { inks, strokes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT: f64 = 1e-3;
    const STROKE: Option<StrokeId> = Some(StrokeId { layer: 0, index: 0 });

    fn recorder(pen: &str) -> InkRecorder {
        InkRecorder::new(PenModel::named(pen).unwrap(), 0, 0)
    }

    fn contact(x: f64, force: f64, speed: f64) -> NibContact {
        NibContact { position: Point3::new(x, 0.0, 0.0), normal: Vector3::z(), normal_force: force, slip_speed: speed }
    }

    fn flat(p: &Point3<f64>) -> Option<Point2<f64>> {
        Some(p.coords.xy().into())
    }

    /// Draws straight on at a constant force and speed, and lifts.
    fn line(recorder: &mut InkRecorder, steps: usize, force: f64, speed: f64) {
        for i in 0..steps {
            let c = contact(i as f64 * DT * speed, force, speed);
            recorder.step(DT, i as f64 * DT, Some(&c), STROKE, flat);
        }
        recorder.step(DT, steps as f64 * DT, None, STROKE, flat);
    }

    /// Ink on the paper as the trace tells it, m^3: trapezia between the points and a disc at the start.
    fn volume(strokes: &[InkStroke], pen: &PenModel) -> f64 {
        let spot = |p: &InkPoint| std::f64::consts::FRAC_PI_4 * p.width * p.width * p.density;
        let strip = |w: &[InkPoint]| {
            (w[1].position - w[0].position).norm() * (w[0].width * w[0].density + w[1].width * w[1].density) / 2.0
        };
        let area = |s: &InkStroke| spot(&s.points[0]) + s.points.windows(2).map(strip).sum::<f64>();
        pen.film() * strokes.iter().map(area).sum::<f64>()
    }

    #[test]
    fn the_papers_pen_draws_its_nominal_line() {
        let mut r = recorder("fineliner_08");
        line(&mut r, 2000, 1.05, 0.04);
        let [stroke] = &r.strokes[..] else { panic!("{} strokes", r.strokes.len()) };
        for p in &stroke.points[1..] {
            assert!((p.width - 0.8e-3).abs() < 4e-6 && (p.density - 1.0).abs() < 0.02, "{p:?}");
        }
        assert!((stroke.length() - 1999.0 * DT * 0.04).abs() < 1e-12, "the line ends where the pen lifts");
        let longest = stroke.points.windows(2).map(|w| (w[1].position - w[0].position).norm()).fold(0.0, f64::max);
        assert!(longest < SPACING + 0.04 * DT && stroke.points.len() < 600, "{longest}, {}", stroke.points.len());
    }

    #[test]
    fn no_contact_and_a_hovering_nib_leave_no_ink() {
        let mut r = recorder("marker");
        for i in 0..100 {
            let hover = contact(i as f64 * 1e-4, r.pen.force_min * 0.9, 0.1);
            r.step(DT, i as f64 * DT, (i % 2 == 0).then_some(&hover), STROKE, flat);
        }
        assert!(r.strokes.is_empty() && r.state.left == r.pen.volume);
    }

    #[test]
    fn lost_contact_and_a_new_stroke_break_the_line() {
        let mut r = recorder("fineliner_04");
        for i in 0..900 {
            let c = contact(i as f64 * DT * 0.04, 1.0, 0.04);
            let id = StrokeId { layer: 0, index: u32::from(i >= 600) };
            r.step(DT, i as f64 * DT, (!(300..310).contains(&i)).then_some(&c), Some(id), flat);
        }
        r.step(DT, 0.9, None, None, flat);
        let ends: Vec<(f64, f64)> =
            r.strokes.iter().map(|s| (s.points[0].position.x, s.points[s.points.len() - 1].position.x)).collect();
        let at = |i: f64| i * DT * 0.04;
        assert_eq!(ends, [(at(0.0), at(299.0)), (at(310.0), at(600.0)), (at(600.0), at(899.0))]);
    }

    #[test]
    fn the_line_breaks_where_the_sheet_ends() {
        let mut r = recorder("fineliner_04");
        for i in 0..1000 {
            let c = contact(i as f64 * DT * 0.04, 1.0, 0.04);
            let off_sheet = |p: &Point3<f64>| flat(p).filter(|q| !(0.01..0.02).contains(&q.x));
            r.step(DT, i as f64 * DT, Some(&c), STROKE, off_sheet);
        }
        assert_eq!(r.strokes.len(), 2);
        assert!(r.strokes.iter().flat_map(|s| &s.points).all(|p| !(0.01..0.02).contains(&p.sheet.x)));
    }

    #[test]
    fn ink_on_paper_and_ink_left_make_the_pen_full() {
        for pen in PenModel::known() {
            for (force, speed) in [(1.05, 0.04), (0.3, 0.01), (2.0, 0.2), (1.05, 0.6)] {
                let mut r = recorder(pen);
                line(&mut r, 3000, force, speed);
                let (drawn, gone) = (volume(&r.strokes, &r.pen), r.pen.volume - r.state.left);
                assert!((drawn / gone - 1.0).abs() < 0.03, "{pen} at {force} N, {speed} m/s: {drawn} of {gone}");
            }
        }
    }

    #[test]
    fn a_pen_left_in_the_open_fades_draws_itself_wet_and_is_fresh_after_its_cap() {
        let drying = crate::pen::Drying { open: 1.0, fade: 1.0, recovery: 5e-3 };
        let density_of = |open: u32, waited: f64, cap: bool| {
            let mut r = recorder("fineliner_08");
            r.pen.drying = Some(drying);
            for i in 0..open {
                r.step(DT, f64::from(i) * DT, None, STROKE, flat);
            }
            r.advance_drying(waited);
            if cap {
                r.cap();
            }
            let began = f64::from(open) * DT;
            for i in 0..1000 {
                let c = contact(f64::from(i) * 4e-5, 1.0, 0.04);
                r.step(DT, began + f64::from(i) * DT, Some(&c), STROKE, flat);
            }
            let points = &r.strokes[0].points;
            [points[3].density, points[points.len() - 1].density]
        };
        let density_after = |open: u32, cap: bool| density_of(open, 0.0, cap);
        let [fresh, steady] = density_after(0, false);
        assert_eq!(density_after(900, false), [fresh, steady]);
        assert_eq!(density_after(3000, true), [fresh, steady]);
        let [dry, recovered] = density_after(3000, false);
        // while its arm stands waiting it dries as well
        assert!((density_of(1000, 2.0, false)[0] / dry - 1.0).abs() < 1e-9);
        // two seconds beyond its time: 1/e^2, but for the first half millimetre of line
        assert!((0.1..0.25).contains(&(dry / fresh)), "{dry} of {fresh}");
        assert!(recovered > 0.99 * steady, "{recovered} of {steady}");
    }

    #[test]
    fn a_pen_near_its_end_fades_and_then_is_dry() {
        let mut r = recorder("fineliner_08");
        r.pen.fade_share = 2e-4; // the last 0.12 m of line
        r.state.left = r.pen.fade_share * r.pen.volume;
        line(&mut r, 20_000, 1.05, 0.04);
        let densities: Vec<f64> = r.strokes.iter().flat_map(|s| &s.points).map(|p| p.density).collect();
        assert!(densities.windows(2).skip(1).all(|d| d[1] <= d[0] * (1.0 + 1e-9)), "density only falls");
        let last = densities[densities.len() - 1];
        assert!((r.pen.density_min..1.05 * r.pen.density_min).contains(&last), "{last}");
        assert!(!r.drawing && r.strokes.len() == 1);
    }

    #[test]
    fn a_resting_nib_blots_with_the_root_of_time_up_to_a_bound() {
        let mut r = recorder("felt_tip");
        let rest = contact(0.0, 1.05, 0.0);
        let mut widths = Vec::new();
        for i in 0..100_000 {
            r.step(DT, i as f64 * DT, Some(&rest), STROKE, flat);
            if [1000, 4000, 99_999].contains(&i) {
                widths.push(r.strokes[0].points[0].width - r.pen.width_nominal);
            }
        }
        assert_eq!(r.strokes[0].points.len(), 1);
        let offset = r.pen.blot_rate * r.pen.wetting_time_nominal().sqrt();
        assert!(((widths[1] + offset) / (widths[0] + offset) - 2.0).abs() < 0.05, "{widths:?}");
        assert!((widths[2] - r.pen.blot_max).abs() < 1e-12, "{widths:?}");
        assert!(r.strokes[0].points[0].density == r.pen.density_max);
    }

    #[test]
    fn a_blot_is_left_behind_within_a_width() {
        let mut r = recorder("felt_tip");
        for i in 0..3000 {
            let (x, v) = if i < 2000 { (0.0, 0.0) } else { (f64::from(i - 2000) * DT * 0.04, 0.04) };
            r.step(DT, f64::from(i) * DT, Some(&contact(x, 1.05, v)), STROKE, flat);
        }
        let width_at = |x: f64| r.strokes[0].points.iter().find(|p| p.position.x >= x).unwrap().width;
        assert!(width_at(0.0) > 1.75e-3 && width_at(1.5e-3) < 1.54e-3, "{} {}", width_at(0.0), width_at(1.5e-3));
    }

    #[test]
    fn merged_lines_stand_in_the_order_they_were_begun() {
        let (mut a, mut b) = (recorder("marker"), InkRecorder::new(PenModel::named("felt_tip").unwrap(), 1, 1));
        for i in 0..100 {
            // each line at a place of its own
            let c = contact(i as f64 * 4e-5 + (i / 10) as f64 * 2e-2, 1.0, 0.04);
            a.step(DT, i as f64 * DT, ((i / 10) % 2 == 0).then_some(&c), STROKE, flat);
            b.step(DT, i as f64 * DT, ((i / 10) % 2 == 1).then_some(&c), STROKE, flat);
        }
        let trace = InkTrace::merged(Vec::new(), [b, a]);
        let arms: Vec<u32> = trace.strokes.iter().map(|s| s.arm).collect();
        assert_eq!(arms, [0, 1, 0, 1, 0, 1, 0, 1, 0, 1]);
    }

    proptest! {
        #[test]
        fn points_are_always_finite_and_ink_never_appears_from_nothing(
            steps in proptest::collection::vec((0.0..6.0f64, 0.0..1.0f64, any::<bool>()), 1..400),
        ) {
            let mut r = recorder("felt_tip");
            let (mut x, mut left) = (0.0, r.state.left);
            for (i, (force, speed, down)) in steps.iter().enumerate() {
                x += speed * DT;
                r.step(DT, i as f64 * DT, down.then_some(&contact(x, *force, *speed)), STROKE, flat);
                prop_assert!(r.state.left <= left && r.state.left >= 0.0);
                left = r.state.left;
            }
            for p in r.strokes.iter().flat_map(|s| &s.points) {
                prop_assert!(p.width > 0.0 && p.width <= r.pen.width_max + r.pen.blot_max);
                prop_assert!(p.density > 0.0 && p.density <= r.pen.density_max);
            }
        }
    }

    #[test]
    fn a_nib_that_bounces_on_the_spot_draws_one_line() {
        let pen = PenModel::named("fineliner_08").unwrap();
        let bounce = |shift: f64, pause: usize| {
            let mut recorder = InkRecorder::new(pen.clone(), 0, 0);
            let at = |x: f64| NibContact {
                position: Point3::new(x, 0.0, 0.0),
                normal: Vector3::z(),
                normal_force: 1.05,
                slip_speed: 0.0,
            };
            let sheet = |p: &Point3<f64>| Some(Point2::new(p.x, p.y));
            for i in 0..20 + pause + 20 {
                let contact = (i < 20 || i >= 20 + pause).then(|| at(if i < 20 { 0.0 } else { shift }));
                recorder.step(1e-3, i as f64 * 1e-3, contact.as_ref(), None, sheet);
            }
            InkTrace::merged(Vec::new(), [recorder]).strokes.len()
        };
        assert_eq!(bounce(0.0, 15), 1);
        assert_eq!(bounce(5e-4, 15), 2, "a new place is a new line");
        assert_eq!(bounce(0.0, 1500), 2, "dry ink takes another layer");
    }
}
