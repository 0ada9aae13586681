//! Clean edge lines.
//!
//! The flow-based difference of Gaussians (Kang et al. 2007, doi:10.1145/1274871.1274878; Winnemöller 2011): across the flow
//! of the picture it is large in dark lines and on the dark side of edges, and its mean along the flow joins what noise
//! has broken. Its crests, to a fraction of a pixel and by two thresholds, are linked into lines (Steger 1998,
//! doi:10.1109/34.659930) that go on straight through junctions.
use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use super::{ArtError, Artwork, Flow, FlowOptions, Placement, Sheet};
use crate::drawing::stroke_order::order_strokes;
use crate::drawing::tidy::{resample, simplify};
use crate::drawing::{Drawing, InkLayer, Stroke};
use crate::picture::{Ink, Picture, Plane};

/// Ratio of the two Gaussians (Marr and Hildreth's 1.6, nearly a Laplacian).
const RATIO: f64 = 1.6;
/// Response to a step of lightness 1: the largest difference of the two Gaussians' integrals.
const STEP_RESPONSE: f64 = 0.1119;
/// Standard deviation of the mean along the flow, in those across it.
const ALONG: f64 = 3.0;
/// Standard deviation of the finer Gaussian, px, to which larger pictures are shrunk, and below which pixels would show.
const SIGMA_PX: [f64; 2] = [0.9, 1.6];
/// Steps of the search for less pen-up travel.
const ORDER_EFFORT: u64 = 3_000_000;

/// Which edges are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeOptions {
    /// Size of the finest details, m on the sheet: standard deviation of the finer Gaussian. A line stands 1.24 of it
    /// inside the darker side of an edge, and in the middle of a dark line.
    pub scale: f64,
    /// Contrast of lightness (0..=1, the cube root of luminance) at which an edge begins a line.
    pub contrast: f64,
    /// Contrast down to which a line goes on, as a share of `contrast`.
    pub continuation: f64,
    /// Least length of a line, m.
    pub min_length: f64,
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self { scale: 0.3e-3, contrast: 0.12, continuation: 0.4, min_length: 4e-3 }
    }
}

impl EdgeOptions {
    fn check(&self) -> Result<(), ArtError> {
        let within = ArtError::within;
        within("scale", self.scale, 1e-6, 1.0, "a size on the sheet between 1 um and 1 m")?;
        within("contrast", self.contrast, 1e-3, 10.0, "a contrast of lightness, above 0")?;
        within("continuation", self.continuation, 0.01, 1.0, "a share of the contrast between 0.01 and 1")?;
        within("min_length", self.min_length, 0.0, 1.0, "a length up to 1 m")
    }
}

/// The edges of a picture as lines of one ink.
///
/// # Errors
/// [`ArtError::BadOption`] for options, a width or a sheet that make no sense; [`ArtError::NothingToDraw`] when there is no
/// edge.
pub fn edges(
    picture: &Picture,
    sheet: Sheet,
    line_width: f64,
    ink: &Ink,
    options: &EdgeOptions,
) -> Result<Artwork, ArtError> {
    if !(line_width > 0.0 && line_width < 0.5 * sheet.width.min(sheet.height)) {
        let message = "a line width must be positive, m, and small against the sheet".to_string();
        return Err(ArtError::BadOption { name: "line_width", value: line_width, message });
    }
    let strokes = edge_lines(picture, &Placement::checked(picture, sheet)?, line_width, options)?;
    if strokes.is_empty() {
        return Err(ArtError::NothingToDraw {
            reason: "no edge has the contrast and the length asked for".to_string(),
        });
    }
    let layer = InkLayer { name: ink.name.clone(), color: ink.color, width_hint: Some(line_width), strokes };
    let drawing = Drawing::new(sheet.width, sheet.height, vec![layer]);
    Ok(Artwork { drawing, plates: Vec::new(), notes: Vec::new() })
}

/// The edges' lines on the sheet, none of them within half a line of the picture's border.
pub(super) fn edge_lines(
    picture: &Picture,
    placement: &Placement,
    line_width: f64,
    options: &EdgeOptions,
) -> Result<Vec<Stroke>, ArtError> {
    options.check()?;
    let mut lightness = picture.luminance();
    lightness.values.iter_mut().for_each(|v| *v = v.max(0.0).cbrt());
    let shrink = (options.scale / placement.pixel() / SIGMA_PX[1]).max(1.0);
    let small = |n: usize| (n as f64 / shrink).ceil().max(1.0) as usize;
    let lightness = lightness.resized(small(picture.width()), small(picture.height()));
    let (w, h) = (lightness.width(), lightness.height());
    let pixel = placement.size()[0] / w as f64;
    let sigma = (options.scale / pixel).max(SIGMA_PX[0]);
    let flow = Flow::of(&lightness, &FlowOptions { scale: 2.0 * sigma, contrast: 0.01, fallback: 0.0 });
    let tangent: Vec<Vector2<f32>> = (0..w * h)
        .into_par_iter()
        .map(|i| flow.direction((i % w) as f64 + 0.5, (i / w) as f64 + 0.5))
        .map(|d| Vector2::new(d[0] as f32, d[1] as f32))
        .collect();
    let response = mean_along(&across(&lightness, &tangent, sigma), &tangent, ALONG * sigma);
    let crests = Crests::of(&response, tangent, options.contrast * options.continuation);
    let [sheet_w, sheet_h] = placement.size();
    let inset =
        |v: f64, side: f64| v.clamp(0.5 * line_width.min(side) - 0.5 * side, 0.5 * (side - line_width).max(0.0));
    let on_sheet = |p: &Point2<f64>| {
        let (x, y) = (p.x / w as f64 * sheet_w - 0.5 * sheet_w, 0.5 * sheet_h - p.y / h as f64 * sheet_h);
        Point2::new(inset(x, sheet_w), inset(y, sheet_h))
    };
    let strokes = crests.lines(options.contrast).into_iter().map(|line| {
        let line = smoothed(&line);
        simplify(&Stroke::new(line.iter().map(on_sheet).collect()), 0.02 * line_width)
    });
    let strokes = strokes.filter(|s| s.length() >= options.min_length.max(1e-9)).collect();
    Ok(order_strokes(strokes, ORDER_EFFORT))
}

/// The difference of Gaussians across the flow, positive where it is darker than around, 1 at a step from 0 to 1.
fn across(lightness: &Plane, tangent: &[Vector2<f32>], sigma: f64) -> Plane {
    let (w, h) = (lightness.width(), lightness.height());
    let reach = (2.5 * RATIO * sigma).ceil() as i32;
    let gauss = |s: f64| {
        let weights: Vec<f64> = (-reach..=reach).map(|t| (-0.5 * (f64::from(t) / s).powi(2)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(move |v| v / sum)
    };
    let kernel: Vec<f64> =
        gauss(RATIO * sigma).zip(gauss(sigma)).map(|(wide, fine)| (wide - fine) / STEP_RESPONSE).collect();
    let at = |i: usize| {
        let (x, y) = ((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        let t = tangent[i];
        let sum = kernel.iter().zip(-reach..=reach).map(|(k, s)| {
            let s = f64::from(s);
            k * f64::from(lightness.sample(x - s * f64::from(t.y), y + s * f64::from(t.x)))
        });
        sum.sum::<f64>() as f32
    };
    Plane::from_values(w, h, (0..w * h).into_par_iter().map(at).collect()).unwrap_or_default()
}

/// The Gaussian mean of a plane along the flow.
fn mean_along(plane: &Plane, tangent: &[Vector2<f32>], sigma: f64) -> Plane {
    let (w, h) = (plane.width(), plane.height());
    let reach = (2.0 * sigma).ceil() as usize;
    let weights: Vec<f32> = (0..=reach).map(|s| (-0.5 * (s as f64 / sigma).powi(2)).exp() as f32).collect();
    let at = |i: usize| {
        let (mut sum, mut total) = (plane.values[i], 1.0);
        for sense in [-1.0f32, 1.0] {
            let (mut x, mut y) = ((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
            let mut heading = tangent[i] * sense;
            for weight in &weights[1..] {
                (x, y) = (x + heading.x, y + heading.y);
                if !(x >= 0.0 && y >= 0.0 && x < w as f32 && y < h as f32) {
                    break;
                }
                let t = tangent[y as usize * w + x as usize];
                // Past a sharp turn it is another edge.
                let turn = t.dot(&heading);
                if turn.abs() < 0.5 {
                    break;
                }
                heading = if turn < 0.0 { -t } else { t };
                sum += weight * plane.sample(f64::from(x), f64::from(y));
                total += weight;
            }
        }
        sum / total
    };
    Plane::from_values(w, h, (0..w * h).into_par_iter().map(at).collect()).unwrap_or_default()
}

/// Owner of a pixel that no line has.
const NOBODY: u32 = u32::MAX;

/// The crests of a response, pixel by pixel.
struct Crests {
    width: usize,
    height: usize,
    tangent: Vec<Vector2<f32>>,
    /// Where in the pixel the crest runs (px from the picture's corner) and how high; `None` beside crests.
    crest: Vec<Option<(Point2<f64>, f32)>>,
}

impl Crests {
    /// Pixels at least `low` high that are not lower than what lies across the flow on either side.
    fn of(response: &Plane, tangent: Vec<Vector2<f32>>, low: f64) -> Self {
        let (w, h) = (response.width(), response.height());
        let at = |i: usize| {
            let middle = f64::from(response.values[i]);
            if middle < low {
                return None;
            }
            let centre = Point2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            let normal = Vector2::new(-f64::from(tangent[i].y), f64::from(tangent[i].x));
            let side = |s: f64| f64::from(response.sample(centre.x + s * normal.x, centre.y + s * normal.y));
            let (before, after) = (side(-1.0), side(1.0));
            let bend = before - 2.0 * middle + after;
            if bend >= 0.0 {
                return None;
            }
            // The top of the parabola through the three.
            let off = 0.5 * (before - after) / bend;
            (off.abs() <= 0.75).then(|| (centre + normal * off, middle as f32))
        };
        let crest = (0..w * h).into_par_iter().map(at).collect();
        Self { width: w, height: h, tangent, crest }
    }

    /// Lines through the crests, each from one at least `high`; the highest first.
    fn lines(&self, high: f64) -> Vec<Vec<Point2<f64>>> {
        let mut starts: Vec<(f32, usize)> =
            self.crest.iter().enumerate().filter_map(|(i, c)| c.map(|c| (c.1, i))).collect();
        starts.retain(|s| f64::from(s.0) >= high);
        starts.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut owner = vec![NOBODY; self.crest.len()];
        let mut lines = Vec::new();
        for (_, start) in starts {
            if owner[start] != NOBODY {
                continue;
            }
            let heading = self.tangent[start].cast::<f64>();
            let own = lines.len() as u32;
            self.take(start, own, &mut owner);
            let mut line = self.walk(start, -heading, own, &mut owner);
            line.reverse();
            line.extend(self.crest[start].map(|c| c.0));
            line.extend(self.walk(start, heading, own, &mut owner));
            // A line that comes back to its start is closed.
            if let [first, .., last] = line[..]
                && line.len() > 8
                && (last - first).norm() < 2.0
            {
                line.push(first);
            }
            lines.push(line);
        }
        lines
    }

    /// Gives a crest pixel to a line, with those beside it, which belong to the same crest.
    fn take(&self, i: usize, own: u32, owner: &mut [u32]) {
        owner[i] = own;
        let Some((p, _)) = self.crest[i] else { return };
        for n in self.around(i) {
            if owner[n] == NOBODY
                && let Some((q, _)) = self.crest[n]
                && (q - p).dot(&self.tangent[i].cast()).abs() < 0.5
                && (q - p).norm() < 1.2
            {
                owner[n] = own;
            }
        }
    }

    fn around(&self, i: usize) -> impl Iterator<Item = usize> + use<> {
        let (w, h) = (self.width, self.height);
        let (x, y) = (i % w, i / w);
        let near = move |v: usize, n: usize| v.saturating_sub(1)..=(v + 1).min(n - 1);
        near(y, h).flat_map(move |row| near(x, w).map(move |column| row * w + column)).filter(move |n| *n != i)
    }

    /// The points of a crest onwards from a pixel, until it ends or meets another line, which it then touches.
    fn walk(&self, start: usize, mut heading: Vector2<f64>, own: u32, owner: &mut [u32]) -> Vec<Point2<f64>> {
        let mut line = Vec::new();
        let mut here = start;
        while let Some((p, _)) = self.crest[here] {
            let mut best: Option<(f64, usize, Vector2<f64>)> = None;
            for n in self.around(here) {
                let Some((q, _)) = self.crest[n].filter(|_| owner[n] != own) else { continue };
                let step = q - p;
                let (length, ahead) = (step.norm(), step.dot(&heading));
                if ahead < 0.4 * length || length < 0.2 {
                    continue;
                }
                let t = self.tangent[n].cast::<f64>();
                let onward = if t.dot(&heading) < 0.0 { -t } else { t };
                let cost = length + (1.0 - ahead / length) + 2.0 * (1.0 - onward.dot(&heading));
                if best.is_none_or(|b| cost < b.0) {
                    best = Some((cost, n, onward));
                }
            }
            let Some((_, next, onward)) = best else { break };
            line.extend(self.crest[next].map(|c| c.0));
            if owner[next] != NOBODY {
                break;
            }
            self.take(next, own, owner);
            (here, heading) = (next, onward);
        }
        line
    }
}

/// A line of even steps without the pixels' waves; ends stay, and a closed line stays closed.
fn smoothed(line: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut points = resample(&Stroke::new(line.to_vec()), 0.7).points;
    let closed = points.len() > 8 && points.first() == points.last();
    let last = points.len().saturating_sub(1);
    for _ in 0..8 {
        let before = points.clone();
        for i in 1..last {
            points[i] = Point2::from((before[i - 1].coords + 2.0 * before[i].coords + before[i + 1].coords) / 4.0);
        }
        if closed {
            points[0] = Point2::from((before[last - 1].coords + 2.0 * before[0].coords + before[1].coords) / 4.0);
            points[last] = points[0];
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    const SHEET: Sheet = Sheet { width: 0.1, height: 0.1 };
    /// A pixel of the test pictures on the sheet, m.
    const PIXEL: f64 = 0.5e-3;

    /// A picture of 200 x 200 px of this lightness at places in px, each pixel a mean of 5 x 5 samples.
    fn picture(lightness: impl Fn(f64, f64) -> f64) -> Picture {
        let pixel = |i: usize| {
            let samples = (0..25).map(|s| {
                let (x, y) =
                    ((i % 200) as f64 + (s % 5) as f64 / 5.0 + 0.1, (i / 200) as f64 + (s / 5) as f64 / 5.0 + 0.1);
                lightness(x, y)
            });
            [(samples.sum::<f64>() / 25.0).powi(3) as f32; 3]
        };
        Picture::from_pixels(200, 200, (0..40_000).map(pixel).collect()).unwrap()
    }

    fn lines(picture: &Picture, options: &EdgeOptions) -> Result<Drawing, ArtError> {
        let ink = Ink { name: "black".into(), color: Rgb([0; 3]) };
        edges(picture, SHEET, 0.4e-3, &ink, options).map(|a| a.drawing)
    }

    /// Distances of all points from the sheet's centre, px.
    fn radii(drawing: &Drawing) -> Vec<f64> {
        drawing.layers[0].strokes.iter().flat_map(|s| &s.points).map(|p| p.coords.norm() / PIXEL).collect()
    }

    const OPTIONS: EdgeOptions = EdgeOptions { scale: 0.6e-3, contrast: 0.16, continuation: 0.4, min_length: 4e-3 };

    #[test]
    fn a_dark_line_is_one_line_in_its_middle() {
        let ring = picture(|x, y| if ((x - 100.0).hypot(y - 100.0) - 61.3).abs() < 0.9 { 0.2 } else { 0.9 });
        let drawing = lines(&ring, &OPTIONS).unwrap();
        assert_eq!(drawing.stroke_count(), 1);
        let off = radii(&drawing).into_iter().map(|r| (r - 61.3).abs()).fold(0.0, f64::max);
        assert!(off < 0.12, "{off} px off");
        let length = drawing.length() / PIXEL;
        assert!((length / (std::f64::consts::TAU * 61.3) - 1.0).abs() < 0.01, "{length} px");
        let stroke = &drawing.layers[0].strokes[0];
        assert_eq!(stroke.points.first(), stroke.points.last());
    }

    #[test]
    fn the_edge_of_a_disc_has_its_line_just_inside() {
        let disc = picture(|x, y| if (x - 100.0).hypot(y - 100.0) < 50.0 { 0.3 } else { 0.8 });
        let drawing = lines(&disc, &OPTIONS).unwrap();
        assert_eq!(drawing.stroke_count(), 1);
        let inside = 50.0 - 1.24 * OPTIONS.scale / PIXEL;
        let off = radii(&drawing).into_iter().map(|r| (r - inside).abs()).fold(0.0, f64::max);
        assert!(off < 0.3, "{off} px off");
    }

    #[test]
    fn lines_cross_and_end_on_each_other() {
        let bar = |v: f64| (v - 100.0).abs() < 1.0;
        let cross = picture(|x, y| if bar(x) || (bar(y) && x > 40.0) { 0.1 } else { 1.0 });
        let drawing = lines(&cross, &OPTIONS).unwrap();
        assert!(drawing.stroke_count() <= 3, "{} strokes", drawing.stroke_count());
        let desired = (200.0 + 160.0) * PIXEL;
        assert!((drawing.length() / desired - 1.0).abs() < 0.06, "{} m for {desired} m", drawing.length());
    }

    #[test]
    fn specks_and_flat_pictures_have_no_lines() {
        let specks = picture(|x, y| if (x % 40.0).hypot(y % 40.0) < 1.5 { 0.0 } else { 1.0 });
        assert!(matches!(lines(&specks, &OPTIONS), Err(ArtError::NothingToDraw { .. })));
        assert!(matches!(lines(&picture(|_, _| 0.5), &OPTIONS), Err(ArtError::NothingToDraw { .. })));
        let one = Picture::from_pixels(1, 1, vec![[0.0; 3]]).unwrap();
        assert!(matches!(lines(&one, &OPTIONS), Err(ArtError::NothingToDraw { .. })));
        let bad = EdgeOptions { contrast: f64::NAN, ..OPTIONS };
        assert!(matches!(lines(&one, &bad), Err(ArtError::BadOption { name: "contrast", .. })));
    }
}
