//! The drawing as it is desired: every stroke at its pen's real width, without robot.
use nalgebra::{Point3, Vector3};

use super::ArtworkError;
use crate::drawing::Drawing;
use crate::drawing::StrokeId;
use crate::ink::{InkPoint, InkStroke, InkTrace, RasterOptions, TraceInk, rasterise};
use crate::math::Rgb;
use crate::measure::ImageMetrics;
use crate::pen::LayerPen;
use crate::picture::{Likeness, Picture, likeness};
use crate::scenario::Sketch;

/// How far pictures are blurred before they are compared, in widths of the pen's line.
const BLUR_WIDTHS: f64 = 3.0;
/// The same in pixels of the compared pictures: their resolution follows from it.
const BLUR_PX: f32 = 4.5;
/// Largest side of compared pictures, px.
const MOST_PX: u32 = 2000;
/// A turn of the line above this is a corner, where the pen stops, rad.
const CORNER: f64 = 0.35;
/// Shares of the rule of thumb for times, fitted to plans of this program's scenarios.
const SMOOTH: f64 = 1.5;
const PRESS_REST: f64 = 0.65;
const LIFT_REST: f64 = 0.3;
const TRAVEL_START: f64 = 0.4;
const CHANGE_WAY: f64 = 5.0;

/// The ink that a perfect robot would leave: full density, and the width that is desired or that the pen has.
pub(crate) fn desired_trace(drawing: &Drawing, pens: &[LayerPen]) -> InkTrace {
    let mut time = 0.0;
    let mut stroke = |r: &crate::drawing::StrokeRef| {
        let desired = &drawing.layers[r.layer].strokes[r.stroke];
        let own = pens[r.layer].pen.width_nominal;
        let points = desired.points.iter().enumerate().map(|(i, p)| {
            time += 1.0;
            let width = desired.widths.get(i).copied().unwrap_or(own);
            let position = Point3::new(p.x, p.y, 0.0);
            InkPoint { position, normal: Vector3::z(), sheet: *p, width, density: 1.0, time }
        });
        let id = StrokeId { layer: r.layer as u32, index: r.stroke as u32 };
        InkStroke { ink: r.layer as u32, stroke: Some(id), arm: 0, points: points.collect() }
    };
    let strokes = drawing.sequence().iter().map(&mut stroke).collect();
    let inks = drawing.layers.iter().map(|l| TraceInk { name: l.name.clone(), color: l.color }).collect();
    InkTrace { inks, strokes }
}

/// What pictures of a drawing are compared with.
pub(crate) struct Likenesses {
    reference: Picture,
    options: RasterOptions,
    preview: Option<Likeness>,
    tone_error: Option<f64>,
}

impl Likenesses {
    /// To compare with `artwork`, or else with the lines as desired.
    pub(crate) fn new(drawing: &Drawing, pens: &[LayerPen], artwork: Option<&Picture>) -> Result<Self, ArtworkError> {
        let width = mean_width(drawing, pens);
        let most = f64::from(MOST_PX) / (1e3 * drawing.width.max(drawing.height));
        let px_per_mm = (f64::from(BLUR_PX) / (BLUR_WIDTHS * 1e3 * width)).min(most);
        let options =
            RasterOptions { width: drawing.width, height: drawing.height, px_per_mm, paper: Rgb([255, 255, 255]) };
        let desired = Picture::from_image(&rasterise(&desired_trace(drawing, pens), &options)?);
        let Some(artwork) = artwork else {
            return Ok(Self { reference: desired, options, preview: None, tone_error: None });
        };
        let reference = artwork.resized(desired.width(), desired.height());
        let preview = likeness(&desired, &reference, BLUR_PX);
        let (a, b) = (desired.luminance().blurred(BLUR_PX), reference.luminance().blurred(BLUR_PX));
        let differences = a.values.iter().zip(&b.values).map(|(a, b)| f64::from((a - b).abs()));
        let tone_error = Some(differences.sum::<f64>() / a.values.len().max(1) as f64);
        Ok(Self { reference, options, preview, tone_error })
    }

    /// The figures, with those of what was drawn if something was.
    pub(crate) fn metrics(&self, drawn: Option<&InkTrace>) -> Result<ImageMetrics, ArtworkError> {
        let drawn = match drawn {
            Some(trace) => {
                let picture = Picture::from_image(&rasterise(trace, &self.options)?);
                likeness(&picture, &self.reference, BLUR_PX)
            }
            None => None,
        };
        Ok(ImageMetrics {
            ssim: drawn.map(|d| d.ssim),
            psnr_db: drawn.map(|d| d.psnr_db),
            preview_ssim: self.preview.map(|p| p.ssim),
            preview_psnr_db: self.preview.map(|p| p.psnr_db),
            preview_tone_error: self.tone_error,
        })
    }
}

/// Mean width of the drawing's lines, m, by their length.
fn mean_width(drawing: &Drawing, pens: &[LayerPen]) -> f64 {
    let lengths = drawing.layers.iter().map(|l| l.strokes.iter().map(|s| s.length() + 1e-4).sum::<f64>());
    let (sum, total) = lengths
        .zip(pens)
        .fold((0.0, 0.0), |(sum, total), (length, p)| (sum + length * p.pen.width_nominal, total + length));
    if total > 0.0 { sum / total } else { 1e-3 }
}

/// How long a robot takes, s, by a rule of thumb: the line from corner to corner at the pen's speed and acceleration, a press,
/// a lift and a travel for each stroke, and the changes of pen.
pub(crate) fn estimated_time(drawing: &Drawing, sketch: &Sketch) -> f64 {
    let Sketch { pen, control, plan, .. } = sketch;
    let (speed, acceleration) = (control.speed_mm_s * 1e-3, plan.acceleration_mm_s2 * 1e-3);
    let (travel, landing) = (control.travel_speed_mm_s, control.landing_speed_mm_s);
    // from rest to rest; smooth motion takes longer than the trapezium of speed
    let piece = |length: f64| match speed * speed / acceleration {
        ramp if length > ramp => length / speed + SMOOTH * speed / acceleration,
        _ => (1.0 + SMOOTH) * (length / acceleration).sqrt(),
    };
    // down fast to 1.5 mm, slowly until it touches, twice that until it is pressed, and some rest
    let press = (plan.hover_mm - 1.5).max(0.0) / travel
        + 1.8 / landing
        + (pen.press_depth_mm - 0.3).max(0.0) / (2.0 * landing)
        + PRESS_REST;
    let lift = (pen.press_depth_mm + 1.5) / control.speed_mm_s + plan.hover_mm / travel + LIFT_REST;
    let mut seconds = 0.0;
    let mut at = None;
    for r in drawing.sequence() {
        let points = &drawing.layers[r.layer].strokes[r.stroke].points;
        let (Some(first), Some(last)) = (points.first(), points.last()) else { continue };
        let mut length = 0.0;
        for (i, w) in points.windows(2).enumerate() {
            length += (w[1] - w[0]).norm();
            let corner = points.get(i + 2).is_none_or(|next| {
                let (a, b) = (w[1] - w[0], next - w[1]);
                a.perp(&b).atan2(a.dot(&b)).abs() > CORNER
            });
            if corner {
                seconds += piece(length);
                length = 0.0;
            }
        }
        seconds += press + lift;
        if let Some(from) = at.replace(*last) {
            let way: f64 = (first - from).norm();
            seconds += way * 1e3 / travel + TRAVEL_START;
        }
    }
    seconds + drawing.ink_changes() as f64 * pen_change_time(sketch)
}

/// How long a change of pen by hand takes, the way there and back included, s.
pub(crate) fn pen_change_time(sketch: &Sketch) -> f64 {
    sketch.pen.change_s + CHANGE_WAY
}
