//! The picture of how a canvas stretches a drawing.
use nalgebra::Point2;

use crate::drawing::Drawing;
use crate::math::Rgb;
use crate::mesh::Stretch;
use crate::picture::{Image, lettering};
use crate::surface::StretchField;

/// Longest side of a panel, px.
const PANEL: u32 = 760;
/// White round and between the panels, px.
const GAP: u32 = 40;
/// Height of a legend under its panel, px.
const LEGEND: u32 = 96;
/// Pixels of the legend's bar.
const BAR: u32 = 22;
/// How large letters are, px for each of theirs.
const LETTER: u32 = 2;
/// Least ends of the scales: below them a canvas may be said to keep areas, and angles.
const LEAST_LOG_AREA: f64 = 0.02;
const LEAST_ANGLE_DEG: f64 = 0.1;
/// Points a pixel along a line.
const LINE_STEPS: f64 = 2.0;

const BLUE: [f64; 3] = [33.0, 102.0, 172.0];
const WHITE: [f64; 3] = [247.0, 247.0, 247.0];
const RED: [f64; 3] = [178.0, 24.0, 43.0];
const VIOLET: [f64; 3] = [84.0, 39.0, 143.0];
const NOTHING: Rgb = Rgb([150, 150, 150]);

struct Page {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

/// Two panels side by side, the sheet as it lies before the artist: area on the canvas by area on the sheet, and the most
/// that right angles change; the drawing's lines on both, a legend under each. Grey: no surface.
pub fn distortion_picture(field: &StretchField, drawing: &Drawing) -> Result<Image, crate::picture::PictureError> {
    let figures = field.distortion().unwrap_or_default();
    let log_area = figures.area_ratio_p95.max(1e-9).ln().abs().max(figures.area_ratio_p05.max(1e-9).ln().abs());
    let log_area = if log_area.is_finite() { log_area.clamp(LEAST_LOG_AREA, 3.0) } else { LEAST_LOG_AREA };
    let angle = figures.angle_error_p95.max(LEAST_ANGLE_DEG);

    let longest = drawing.width.max(drawing.height);
    let px = f64::from(PANEL) / longest;
    let side = |length: f64| ((length * px).round() as u32).max(1);
    let (w, h) = (side(drawing.width), side(drawing.height));
    let (width, height) = (2 * w.max(360) + 3 * GAP, h + 2 * GAP + LEGEND);
    let mut page = Page { width, height, rgb: vec![255; 3 * width as usize * height as usize] };

    let area_color = |s: &Stretch| diverging(s.area_ratio.ln() / log_area);
    let angle_color = |s: &Stretch| mix(WHITE, VIOLET, s.angle_error_deg() / angle);
    let right = 2 * GAP + w.max(360);
    page.panel(GAP, [w, h], field, drawing, area_color);
    page.panel(right, [w, h], field, drawing, angle_color);
    let top = GAP + h + 18;
    let bar = w.max(360);
    page.legend(
        [GAP, top],
        bar,
        "area on the canvas by area on the sheet",
        |t| diverging(2.0 * t - 1.0),
        |t| format!("{:.2}", ((2.0 * t - 1.0) * log_area).exp()),
    );
    let digits = if angle < 1.0 { 2 } else { 1 };
    page.legend(
        [right, top],
        bar,
        "largest change of right angles, degrees",
        |t| mix(WHITE, VIOLET, t),
        |t| format!("{:.digits$}", t * angle),
    );
    Image::new(width, height, page.rgb)
}

impl Page {
    fn put(&mut self, x: u32, y: u32, Rgb(color): Rgb, cover: f64) {
        if x < self.width && y < self.height {
            let at = 3 * (y as usize * self.width as usize + x as usize);
            for (old, new) in self.rgb[at..at + 3].iter_mut().zip(color) {
                *old = (f64::from(*old) + cover * (f64::from(new) - f64::from(*old))).round() as u8;
            }
        }
    }

    /// One panel with its upper left corner at (`left`, `GAP`), `size` px large.
    fn panel(
        &mut self,
        left: u32,
        [w, h]: [u32; 2],
        field: &StretchField,
        drawing: &Drawing,
        color: impl Fn(&Stretch) -> Rgb,
    ) {
        for y in 0..h {
            for x in 0..w {
                let column = (x as usize * field.columns / w as usize).min(field.columns - 1);
                let row = ((h - 1 - y) as usize * field.rows / h as usize).min(field.rows - 1);
                let cell = field.cells[row * field.columns + column].as_ref().map_or(NOTHING, &color);
                self.put(left + x, GAP + y, cell, 1.0);
            }
        }
        let mut inked = vec![false; w as usize * h as usize];
        let place =
            |p: &Point2<f64>| ((p.x / drawing.width + 0.5) * f64::from(w), (0.5 - p.y / drawing.height) * f64::from(h));
        for stroke in drawing.layers.iter().flat_map(|l| &l.strokes) {
            for pair in stroke.points.windows(2) {
                let ((ax, ay), (bx, by)) = (place(&pair[0]), place(&pair[1]));
                let steps = ((bx - ax).hypot(by - ay) * LINE_STEPS).ceil().max(1.0);
                for i in 0..=steps as usize {
                    let t = i as f64 / steps;
                    let (x, y) = ((ax + t * (bx - ax)).floor(), (ay + t * (by - ay)).floor());
                    if (0.0..f64::from(w)).contains(&x) && (0.0..f64::from(h)).contains(&y) {
                        inked[y as usize * w as usize + x as usize] = true;
                    }
                }
            }
        }
        for (at, _) in inked.iter().enumerate().filter(|(_, inked)| **inked) {
            self.put(left + at as u32 % w, GAP + at as u32 / w, Rgb([20, 20, 20]), 0.75);
        }
    }

    fn legend(
        &mut self,
        [left, top]: [u32; 2],
        width: u32,
        title: &str,
        color: impl Fn(f64) -> Rgb,
        figure: impl Fn(f64) -> String,
    ) {
        for x in 0..width {
            for y in 0..BAR {
                self.put(left + x, top + y, color(f64::from(x) / f64::from(width - 1)), 1.0);
            }
        }
        for tick in 0..=4 {
            let share = f64::from(tick) / 4.0;
            let text = figure(share);
            let long = LETTER * lettering::ADVANCE * text.len() as u32;
            let x = left + (share * f64::from(width - 1)) as u32;
            for y in 0..5 {
                self.put(x, top + BAR + y, Rgb([0; 3]), 1.0);
            }
            let at = (x - (long / 2).min(x)).clamp(left, left + width - long.min(width));
            self.text([at, top + BAR + 9], &text);
        }
        self.text([left, top + BAR + 36], title);
    }

    fn text(&mut self, [left, top]: [u32; 2], text: &str) {
        for (x, y) in lettering::letters(text) {
            for (dx, dy) in (0..LETTER).flat_map(|dx| (0..LETTER).map(move |dy| (dx, dy))) {
                self.put(left + LETTER * x + dx, top + LETTER * y + dy, Rgb([30, 30, 30]), 1.0);
            }
        }
    }
}

/// Blue at -1, white at 0, red at 1.
fn diverging(t: f64) -> Rgb {
    if t < 0.0 { mix(WHITE, BLUE, -t) } else { mix(WHITE, RED, t) }
}

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> Rgb {
    let t = t.clamp(0.0, 1.0);
    Rgb([0, 1, 2].map(|k| (a[k] + t * (b[k] - a[k])).round() as u8))
}
