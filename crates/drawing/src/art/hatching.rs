//! Cross-hatching that follows the flow of a picture.
//!
//! A tone is a sum of layers of lines, one direction each: the first alone draws the light tones, the second joins it
//! where that gets too dense, then the third. Lines of width `w` at a spacing `d` cover `a = w / d` of the paper, and
//! layers that cross cover `1 - (1 - a)(1 - b)...`, so in optical depths, `-ln(1 - a)`, layers simply add up to the desired
//! tone. A layer's lines stand evenly at the density of the surroundings ([`super::stripes`]); what is lighter than these
//! is drawn by a part of the lines, each having its own tone at which it begins, so that tones end in tapers of lines
//! of many lengths and not in a wall.
use nalgebra::Point2;
use rayon::prelude::*;

use super::edges::edge_lines;
use super::hatch_lines::{Layer, lines};
use super::{ArtError, Artwork, EdgeOptions, Flow, FlowOptions, Placement, Sheet};
use crate::drawing::stroke_order::order_strokes;
use crate::drawing::{Drawing, InkLayer, Stroke};
use crate::picture::{Picture, Plane, Tone};

/// Tones, as coverage, at which the second, third and fourth direction join.
const JOINS: [f64; 4] = [0.31, 0.57, 0.73, 0.84];
/// Depths past its turn up to which the last direction goes on alone, and from which on the next one has taken over all
/// of it: a direction of a few stray lines is worse than none.
const TAKEOVER: [f64; 2] = [0.08, 0.24];
/// Grid points a line spacing where lines are densest.
const POINTS_A_SPACING: f64 = 3.6;
/// Share of the lines from which on all are drawn.
const NEARLY_ALL: f32 = 0.87;
/// How much the second and further directions stray from the flow, against 1 for the flow: where the flow has no direction
/// lines end, and not all directions' lines are to end in one place.
const STRAY: f64 = 0.2;
/// Coverage under which paper stays white.
const WHITE: f32 = 0.015;
/// Steps of the search for less pen-up travel, for each direction of an ink.
const ORDER_EFFORT: u64 = 3_000_000;

/// How a picture is hatched. Angles are rad, counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct HatchOptions {
    /// Directions of lines, 1..=4.
    pub directions: usize,
    /// Angle of each direction to the flow.
    pub angles: [f64; 4],
    /// The flow where the picture has none, and everywhere when `follow` is 0.
    pub angle: f64,
    /// How far lines follow the flow of the picture, 0 (straight) to 1.
    pub follow: f64,
    /// Size of the details that turn the flow, m on the sheet.
    pub flow_scale: f64,
    /// Least spacing of lines in one direction, in line widths.
    pub min_spacing: f64,
    /// Largest spacing of lines, in line widths; lighter tones are drawn by fewer and shorter lines.
    pub max_spacing: f64,
    /// How far round a place its tone decides on the spacing of lines, m: larger gives more even lines, whose tone comes
    /// more from where they end.
    pub evenness: f64,
    /// Least length of a line of the first direction, m; the others' lines are at least 1.5, 2 and 2.5 times as long.
    pub min_length: f64,
    /// Edge lines in the darkest ink, drawn last.
    pub edges: Option<EdgeOptions>,
}

impl Default for HatchOptions {
    fn default() -> Self {
        Self {
            directions: 3,
            angles: [0.0, 90.0, 45.0, 135.0].map(f64::to_radians),
            angle: 45f64.to_radians(),
            follow: 1.0,
            flow_scale: 2e-3,
            min_spacing: 1.6,
            max_spacing: 10.0,
            evenness: 1.5e-3,
            min_length: 2e-3,
            edges: Some(EdgeOptions::default()),
        }
    }
}

impl HatchOptions {
    fn check(&self) -> Result<(), ArtError> {
        let within = ArtError::within;
        within("directions", self.directions as f64, 1.0, 4.0, "one to four directions can be drawn")?;
        within("follow", self.follow, 0.0, 1.0, "0 draws straight lines, 1 follows the picture")?;
        within("flow_scale", self.flow_scale, 1e-4, 1.0, "a size on the sheet between 0.1 mm and 1 m")?;
        within("min_spacing", self.min_spacing, 1.1, 50.0, "line widths from line to line, at least 1.1")?;
        within("max_spacing", self.max_spacing, self.min_spacing, 200.0, "at least the least spacing, at most 200")?;
        within("evenness", self.evenness, 0.0, 1.0, "a size on the sheet up to 1 m")?;
        within("min_length", self.min_length, 0.0, 1.0, "a length up to 1 m")?;
        for angle in self.angles.into_iter().chain([self.angle]) {
            within("angle", angle, -100.0, 100.0, "an angle in radians")?;
        }
        Ok(())
    }
}

/// Hatches a picture: each tone in lines of its width (m), all along the flow of `picture`, whose pixels the tones
/// share. One layer an ink; within it one direction after another, edges last.
///
/// # Errors
/// [`ArtError::BadOption`] for options, widths or a sheet that make no sense, or a tone of another size than the
/// picture; [`ArtError::NothingToDraw`] when all is white.
pub fn hatching(
    tones: &[(Tone, f64)],
    picture: &Picture,
    sheet: Sheet,
    options: &HatchOptions,
    seed: u64,
) -> Result<Artwork, ArtError> {
    options.check()?;
    let placement = Placement::checked(picture, sheet)?;
    for (tone, width) in tones {
        if !(*width > 0.0 && *width < 0.5 * sheet.width.min(sheet.height)) {
            let message = "a line width must be positive, m, and small against the sheet".to_string();
            return Err(ArtError::BadOption { name: "line_width", value: *width, message });
        }
        if (tone.coverage.width(), tone.coverage.height()) != (picture.width(), picture.height()) {
            let message =
                format!("the tone of {} must have the picture's {} columns and rows", tone.ink.name, picture.width());
            return Err(ArtError::BadOption { name: "tone", value: tone.coverage.width() as f64, message });
        }
    }
    let flow = sheet_flow(picture, &placement, options);
    let drawn = tones.par_iter().enumerate().map(|(ink, (tone, width))| {
        let strokes = hatch_ink(&tone.coverage, *width, ink, &flow, &placement, options, seed);
        InkLayer { name: tone.ink.name.clone(), color: tone.ink.color, width_hint: Some(*width), strokes }
    });
    let mut layers: Vec<InkLayer> = drawn.collect();
    let darkness = |l: &InkLayer| l.color.0.iter().map(|v| u32::from(*v)).sum::<u32>();
    if let Some(edges) = &options.edges
        && let Some(darkest) = layers.iter_mut().min_by_key(|l| darkness(l))
    {
        let width = darkest.width_hint.unwrap_or(edges.scale);
        darkest.strokes.extend(edge_lines(picture, &placement, width, edges)?);
    }
    layers.retain(|l| !l.strokes.is_empty());
    if layers.is_empty() {
        return Err(ArtError::NothingToDraw { reason: "no ink is desired anywhere, or only in specks".to_string() });
    }
    Ok(Artwork { drawing: Drawing::new(sheet.width, sheet.height, layers), plates: Vec::new(), notes: Vec::new() })
}

/// The flow on a grid that is just fine enough for its scale.
fn sheet_flow(picture: &Picture, placement: &Placement, options: &HatchOptions) -> Flow {
    let mut lightness = picture.luminance();
    lightness.values.iter_mut().for_each(|v| *v = v.max(0.0).cbrt());
    let shrink = (options.flow_scale / 4.0 / placement.pixel()).max(1.0);
    let small = |n: usize| (n as f64 / shrink).ceil().max(1.0) as usize;
    let lightness = lightness.resized(small(picture.width()), small(picture.height()));
    let pixel = placement.size()[0] / lightness.width() as f64;
    let scale = options.flow_scale / pixel;
    // Shading that goes from black to white over 20 scales counts half as much as an edge.
    let flow = FlowOptions { scale, contrast: 0.05 / scale.max(1.0), fallback: options.angle };
    Flow::of(&lightness, &flow)
}

/// The lines of one ink.
fn hatch_ink(
    coverage: &Plane,
    width: f64,
    ink: usize,
    flow: &Flow,
    placement: &Placement,
    options: &HatchOptions,
    seed: u64,
) -> Vec<Stroke> {
    let [sheet_w, sheet_h] = placement.size();
    let cell = width * options.min_spacing / POINTS_A_SPACING;
    // The outermost grid points lie half a line inside the picture, so that lines along the border end with it.
    let count = |side: f64| (((side - width) / cell).floor().max(0.0) as usize) + 1;
    let (columns, rows) = (count(sheet_w), count(sheet_h));
    if columns < 2 || rows < 2 || coverage.values.iter().all(|v| *v < WHITE) {
        return Vec::new();
    }
    let tone = coverage.resized(columns, rows);
    let shares = layer_shares(&tone, options, cell);
    let (fx, fy) = (flow.width() as f64 / columns as f64, flow.height() as f64 / rows as f64);
    // The flow at each point, doubled angle, blended with the straight direction.
    let straight = 2.0 * options.angle;
    let stray = |k: usize| if k == 0 { 0.0 } else { STRAY * options.follow };
    let along = |k: usize| {
        let lean = straight + std::f64::consts::TAU / 3.0 * k as f64;
        let cos = (1.0 - options.follow) * straight.cos() + stray(k) * lean.cos();
        let sin = (1.0 - options.follow) * straight.sin() + stray(k) * lean.sin();
        move |i: usize| {
            let d = flow.doubled(((i % columns) as f64 + 0.5) * fx, ((i / columns) as f64 + 0.5) * fy);
            // Angles turn the other way on the grid, whose y is down.
            0.5 * (options.follow * d[1] - sin).atan2(options.follow * d[0] + cos)
        }
    };
    let step = |side: f64, count: usize| (side - width) / (count - 1) as f64;
    let (step_x, step_y) = (step(sheet_w, columns), step(sheet_h, rows));
    let layers = shares.into_par_iter().enumerate().map(|(k, share)| {
        let turn = options.angles[k];
        let along = along(k);
        let normal = (0..columns * rows).into_par_iter().map(|i| {
            // A quarter turn from the line.
            let (sin, cos) = (along(i) - turn + std::f64::consts::FRAC_PI_2).sin_cos();
            [cos as f32, sin as f32]
        });
        let layer = Layer {
            columns,
            rows,
            normal: normal.collect(),
            share: &share.drawn,
            base: &share.base,
            tone: &tone.values,
            white: WHITE,
            width: width / cell,
            // Patches of few short lines across others look like noise.
            min_length: options.min_length * (1.0 + 0.5 * k as f64) / cell,
        };
        let place = |p: &Point2<f64>| {
            let half = |side: f64| 0.5 * (side - width);
            let (x, y) = (p.x * step_x - half(sheet_w), half(sheet_h) - p.y * step_y);
            Point2::new(x, y)
        };
        let name = (ink * 4 + k) as u64;
        let strokes = lines(&layer, seed, name).iter().map(|l| Stroke::new(l.iter().map(place).collect())).collect();
        order_strokes(strokes, ORDER_EFFORT)
    });
    layers.collect::<Vec<_>>().concat()
}

/// One direction's part of a tone, at each grid point.
struct Share {
    /// Coverage that its lines is to draw.
    drawn: Vec<f32>,
    /// Coverage of its lines if all are drawn: what they are spaced for.
    base: Vec<f32>,
}

/// The tone shared between directions.
fn layer_shares(tone: &Plane, options: &HatchOptions, cell: f64) -> Vec<Share> {
    let depth = |coverage: f64| -(1.0 - coverage.min(0.9999)).ln();
    let high = 1.0 / options.min_spacing;
    let n = options.directions;
    // Depth that each direction takes before the next one joins, and the most it can.
    let mut caps = [0.0; 4];
    for k in 0..n {
        let below: f64 = caps[..k].iter().sum();
        caps[k] = (depth(JOINS[k]) - below).clamp(0.0, depth(high));
    }
    let most = depth(high);
    let desired = |tone: f64| {
        let mut rest = depth(tone);
        let mut parts = [0.0; 4];
        for (part, cap) in parts.iter_mut().zip(&caps[..n]) {
            *part = rest.min(*cap);
            rest -= *part;
        }
        let [alone, over] = TAKEOVER;
        for k in 1..n {
            let kept = parts[k].min(alone).min(alone * (over - parts[k]).max(0.0) / (over - alone));
            parts[k - 1] += kept;
            parts[k] -= kept;
        }
        // Past the last one's turn all grow denser together.
        for (k, part) in parts[..n].iter_mut().enumerate() {
            let more = (rest / (n - k) as f64).min(most - *part).max(0.0);
            *part += more;
            rest -= more;
        }
        parts
    };
    let parts: Vec<[f64; 4]> = tone.values.iter().map(|t| desired(f64::from(*t))).collect();
    // Depth owed to the tone by the directions so far.
    let mut owed = vec![0.0f64; parts.len()];
    let mut shares = Vec::new();
    for k in 0..n {
        let coverage: Vec<f64> =
            parts.iter().zip(&owed).map(|(p, o)| 1.0 - (-(p[k] + o).clamp(0.0, most)).exp()).collect();
        // A mean that leans to the dark side: what is lighter can be drawn by fewer lines, but not what is darker.
        let fourth =
            Plane::from_values(tone.width(), tone.height(), coverage.iter().map(|a| a.powi(4) as f32).collect());
        let mean = fourth.unwrap_or_default().blurred((options.evenness / cell) as f32);
        // Only the first direction is alone on the paper; lines across it stand closer, or not at all.
        let low = if k == 0 { 1.0 / options.max_spacing } else { (1.0 / options.max_spacing).max(high / 3.0) };
        let base: Vec<f32> =
            mean.values.iter().map(|m| f64::from(m.max(0.0)).powf(0.25).clamp(low, high) as f32).collect();
        // Nearly all lines are all lines: single gaps would look like mistakes.
        let drawn: Vec<f32> = coverage.iter().zip(&base).map(|(a, b)| (*a as f32 / NEARLY_ALL).min(*b)).collect();
        for (i, owed) in owed.iter_mut().enumerate() {
            *owed += parts[i][k] - depth(f64::from(drawn[i]));
        }
        shares.push(Share { drawn, base });
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::picture::Ink;

    const SHEET: Sheet = Sheet { width: 0.12, height: 0.06 };
    const WIDTH: f64 = 0.4e-3;

    /// A grey picture of this coverage at each pixel, and its tone.
    fn picture(width: usize, height: usize, f: impl Fn(usize, usize) -> f32) -> (Picture, Vec<(Tone, f64)>) {
        let coverage = Plane::from_fn(width, height, f);
        let pixels = coverage.values.iter().map(|c| [1.0 - c; 3]).collect();
        let ink = Ink { name: "black".into(), color: Rgb([0; 3]) };
        (Picture::from_pixels(width, height, pixels).unwrap(), vec![(Tone { ink, coverage }, WIDTH)])
    }

    fn without_edges() -> HatchOptions {
        HatchOptions { edges: None, ..HatchOptions::default() }
    }

    /// Share of each of `parts` vertical strips of the sheet that lines of the width cover, at 16 samples a mm.
    fn covered(drawing: &Drawing, parts: usize) -> Vec<f64> {
        let (w, h) = ((drawing.width * 16e3) as usize, (drawing.height * 16e3) as usize);
        let mut ink = vec![false; w * h];
        let radius = 0.5 * WIDTH;
        let place = |i: usize, side: f64| (i as f64 + 0.5) / 16e3 - 0.5 * side;
        let range = |a: f64, b: f64, side: f64, n: usize| {
            let cell = |v: f64| ((v + 0.5 * side) * 16e3).max(0.0) as usize;
            cell(a.min(b) - radius)..(cell(a.max(b) + radius) + 1).min(n)
        };
        for p in drawing.layers.iter().flat_map(|l| &l.strokes).flat_map(|s| s.points.windows(2)) {
            let d = p[1] - p[0];
            for y in range(p[0].y, p[1].y, drawing.height, h) {
                for x in range(p[0].x, p[1].x, drawing.width, w) {
                    let q = Point2::new(place(x, drawing.width), place(y, drawing.height));
                    let t = ((q - p[0]).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
                    ink[y * w + x] |= (q - (p[0] + d * t)).norm() <= radius;
                }
            }
        }
        let part = |k: usize| {
            let columns = w * k / parts..w * (k + 1) / parts;
            let count = columns.clone().map(|x| (0..h).filter(|y| ink[y * w + x]).count()).sum::<usize>();
            count as f64 / (columns.len() * h) as f64
        };
        (0..parts).map(part).collect()
    }

    #[test]
    fn a_ramp_is_drawn_as_dark_as_desired() {
        let (picture, tones) = picture(480, 240, |x, _| (x as f32 + 0.5) / 480.0);
        for (directions, darkest) in [(2, 0.8), (3, 0.87), (4, 0.9)] {
            let options = HatchOptions { directions, ..without_edges() };
            let drawn = hatching(&tones, &picture, SHEET, &options, 3).unwrap().drawing;
            let parts = covered(&drawn, 20);
            for (k, got) in parts.iter().enumerate() {
                let desired = (k as f64 + 0.5) / 20.0;
                if (0.05..darkest).contains(&desired) {
                    // A strip of 6 mm has only a few lines where they stand 4 mm apart.
                    assert!((got - desired).abs() < 0.045, "{got} for {desired} with {directions} directions");
                }
            }
            let sum = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
            let mean = sum(&parts[1..16]);
            assert!((mean - 0.425).abs() < 0.015, "{mean} for 0.425 with {directions} directions");
        }
    }

    #[test]
    fn flat_tones_are_as_dark_as_desired_and_lines_stay_inside_and_long() {
        for tone in [0.06f32, 0.15, 0.3, 0.45, 0.6, 0.75, 0.85] {
            let (picture, tones) = picture(60, 30, |_, _| tone);
            let drawn = hatching(&tones, &picture, SHEET, &without_edges(), 3).unwrap().drawing;
            let got = covered(&drawn, 1)[0];
            assert!((got - f64::from(tone)).abs() < 0.025, "{got} for {tone}");
            for stroke in &drawn.layers[0].strokes {
                assert!(stroke.length() >= 1.9e-3, "a crumb of {} m", stroke.length());
                let inside =
                    |p: &Point2<f64>| p.x.abs() <= 0.06 - 0.5 * WIDTH + 1e-9 && p.y.abs() <= 0.03 - 0.5 * WIDTH + 1e-9;
                assert!(stroke.points.iter().all(inside));
            }
        }
    }

    #[test]
    fn white_stays_white_beside_black() {
        let (picture, tones) = picture(240, 120, |x, y| if (x / 40 + y / 40) % 2 == 0 { 0.7 } else { 0.0 });
        let options = HatchOptions { edges: Some(EdgeOptions::default()), ..HatchOptions::default() };
        let drawn = hatching(&tones, &picture, SHEET, &options, 3).unwrap().drawing;
        assert!(drawn.stroke_count() > 100);
        for p in drawn.layers[0].strokes.iter().flat_map(|s| &s.points) {
            // One line width into a white square of 20 mm.
            let from_edge = |v: f64, side: f64| ((v + 0.5 * side) / 0.02).floor() as i64;
            let depth = |v: f64, side: f64| {
                let t = ((v + 0.5 * side) / 0.02).rem_euclid(1.0);
                t.min(1.0 - t) * 0.02
            };
            let white = (from_edge(p.x, 0.12) + from_edge(-p.y, 0.06)) % 2 != 0;
            let deep = depth(p.x, 0.12).min(depth(p.y, 0.06));
            assert!(!white || deep < WIDTH, "ink {deep} m inside white at {p}");
        }
    }

    #[test]
    fn drawings_are_the_same_at_any_thread_count() {
        let (picture, tones) = picture(200, 100, |x, y| {
            let (x, y) = (x as f32 / 200.0, y as f32 / 100.0);
            0.5 + 0.4 * (9.0 * x + 4.0 * (3.0 * y).sin()).sin()
        });
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| hatching(&tones, &picture, SHEET, &HatchOptions::default(), 11).unwrap().drawing)
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_ne!(one, hatching(&tones, &picture, SHEET, &HatchOptions::default(), 12).unwrap().drawing);
    }

    #[test]
    fn nothing_odd_comes_of_odd_pictures() {
        let hatch = |w, h, tone: f32| {
            let (picture, tones) = picture(w, h, |_, _| tone);
            hatching(&tones, &picture, SHEET, &HatchOptions::default(), 1)
        };
        assert!(matches!(hatch(50, 50, 0.0), Err(ArtError::NothingToDraw { .. })));
        assert!(matches!(hatch(0, 0, 0.0), Err(ArtError::NothingToDraw { .. })));
        for (w, h) in [(1, 1), (50, 25), (1, 40)] {
            let black = hatch(w, h, 1.0).unwrap().drawing;
            let finite =
                black.layers[0].strokes.iter().flat_map(|s| &s.points).all(|p| p.x.is_finite() && p.y.is_finite());
            assert!(finite && black.stroke_count() > 0);
        }
        let share = covered(&hatch(50, 25, 1.0).unwrap().drawing, 1)[0];
        assert!(share > 0.9, "black covers {share}");
    }

    #[test]
    fn bad_options_are_named() {
        let (picture, tones) = picture(10, 10, |_, _| 0.5);
        let named =
            |options: &HatchOptions, tones: &[(Tone, f64)], sheet| match hatching(tones, &picture, sheet, options, 1) {
                Err(ArtError::BadOption { name, .. }) => name,
                other => panic!("{other:?}"),
            };
        let good = HatchOptions::default();
        assert_eq!(named(&HatchOptions { directions: 5, ..good.clone() }, &tones, SHEET), "directions");
        assert_eq!(named(&HatchOptions { follow: f64::NAN, ..good.clone() }, &tones, SHEET), "follow");
        assert_eq!(named(&good, &[(tones[0].0.clone(), 0.0)], SHEET), "line_width");
        assert_eq!(named(&good, &tones, Sheet { width: -1.0, height: 1.0 }), "sheet_width");
        let mut other = tones.clone();
        other[0].0.coverage = Plane::filled(3, 3, 0.5);
        assert_eq!(named(&good, &other, SHEET), "tone");
    }
}
