//! Recordings of a stylus, as JSON lines: strokes whose width follows the pressure.
//!
//! ```text
//! {"width": 2000, "height": 900, "unit": "px"}        optional: the sheet; "px" (96 an inch) or "mm"
//! {"x": 310.5, "y": 402, "pressure": 0.31, "t": 0.008}
//! {"x": 312.0, "y": 401, "pressure": 0.35, "t": 0.016}
//! {"up": true}                                         or a sample of pressure 0: the pen lifts
//! ```
//!
//! `y` goes down, `pressure` from 0 to 1, `t` is in seconds and rises. Other keys, such as a tilt, are passed over. Without
//! a first line that gives the sheet, it is what the samples cover and a margin of 5 %.
//!
//! Samples are cleaned of disorder, spikes, tremor and hooks. Then each stroke becomes a spline of cubic Bezier
//! curves of varying offset (section IV.A of the dissertation), of which the drawing holds a polyline with widths.
use std::path::Path;

use kurbo::Point;
use nalgebra::Point2;
use serde_json::Value;

use super::bezier_fit::{FitOptions, fit, flatten};
use super::encoding;
use super::stylus_clean::{CleanOptions, Repairs, Sample, clean};
use super::{Drawing, InkLayer, Stroke};
use super::{DrawingError, Loaded, Size, Warning};
use crate::files;
use crate::math::Rgb;

/// Name of the one layer of a recording.
pub const LAYER: &str = "stylus";
/// Colour of its ink.
pub const INK: Rgb = Rgb([26, 26, 30]);
/// Millimetres per pixel: 96 an inch.
const MM_PER_PX: f64 = 25.4 / 96.0;
/// Margin around the samples where no sheet is given, as a share of their larger extent.
const MARGIN: f64 = 0.05;
/// A coordinate beyond this is a mistake.
const FARTHEST: f64 = 1e6;
/// Samples may come this late without being a mistake, s: systems hand them over in bundles.
const LATE: f64 = 0.1;
/// A hook is no longer than this share of the sheet's diagonal.
const HOOK_SHARE: f64 = 0.01;
/// A stroke that stays within this share of its width is a dot.
const DOT_SHARE: f64 = 0.4;
/// Samples nearer to each other than this share of the fit's tolerance are in one place.
const SAME_PLACE_SHARE: f64 = 0.02;
/// Share of the fit's tolerance by which the polyline may leave the spline.
const FLATTENING_SHARE: f64 = 0.2;

/// How a recording becomes strokes. Lengths on the sheet, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StylusOptions {
    /// Width of the line at no and at full pressure.
    pub width: [f64; 2],
    /// Exponent of the pressure: above 1, light strokes are finer.
    pub gamma: f64,
    /// Largest distance of the splines from the cleaned samples.
    pub tolerance: f64,
    /// Largest error of their width.
    pub width_tolerance: f64,
    /// A turn above this is a corner, rad.
    pub corner: f64,
}

impl Default for StylusOptions {
    fn default() -> Self {
        Self { width: [0.4e-3, 1.6e-3], gamma: 1.0, tolerance: 5e-5, width_tolerance: 2e-5, corner: 0.9 }
    }
}

impl StylusOptions {
    /// Width at a pressure: `min + (max - min) pressure^gamma`, m.
    pub fn width_at(&self, pressure: f64) -> f64 {
        let [min, max] = self.width;
        min + (max - min) * pressure.clamp(0.0, 1.0).powf(self.gamma)
    }

    fn check(&self) -> Result<(), DrawingError> {
        let wrong =
            |name, value: f64, message: &str| Err(DrawingError::BadOption { name, value, message: message.into() });
        let [min, max] = self.width;
        if !(min > 0.0 && min <= 1.0) {
            return wrong("stylus width", min, "the smallest width must lie between 0 and 1 m");
        }
        if !(max >= min && max <= 1.0) {
            return wrong("stylus width", max, "the largest width must lie between the smallest and 1 m");
        }
        let positive = [
            ("stylus gamma", self.gamma),
            ("stylus tolerance", self.tolerance),
            ("stylus width tolerance", self.width_tolerance),
            ("stylus corner", self.corner),
        ];
        match positive.iter().find(|(_, x)| !(*x > 0.0 && x.is_finite())) {
            Some((name, x)) => wrong(name, *x, "must be a positive number"),
            None => Ok(()),
        }
    }
}

/// Reads a recording.
///
/// # Errors
/// As [`parse`], and where the file can't be read.
pub fn read(file: &Path, size: Size, options: &StylusOptions) -> Result<Loaded, DrawingError> {
    let bytes = files::read(file).map_err(|source| DrawingError::Unreadable { file: file.to_path_buf(), source })?;
    parse(&bytes, file, size, options)
}

/// Makes a drawing of a recording's bytes; `file` is named in errors.
///
/// # Errors
/// `Invalid` with the line that is wrong and what would be right; `Empty` without a stroke; `BadOption` for a size or an
/// option out of range.
pub fn parse(bytes: &[u8], file: &Path, size: Size, options: &StylusOptions) -> Result<Loaded, DrawingError> {
    options.check()?;
    let recording = Recording::parse(bytes, file)?;
    if recording.strokes.is_empty() {
        let reason = "no sample has a pressure above 0".into();
        return Err(DrawingError::Empty { file: file.to_path_buf(), reason });
    }
    let sheet = recording.sheet.unwrap_or_else(|| Sheet::around(recording.strokes.iter().flatten()));
    let natural = |side: f64| side * sheet.mm_per_unit * 1e-3;
    let (width, height) = size.resolve(natural(sheet.width), natural(sheet.height))?;
    // from units of the file to millimetres on the sheet, y still down
    let scale = width * 1e3 / sheet.width;
    let on_sheet = |s: &Sample| Sample { point: ((s.point - sheet.corner) * scale).to_point(), ..*s };
    let clean_options =
        CleanOptions { tolerance: options.tolerance * 1e3, hook: HOOK_SHARE * (width * 1e3).hypot(height * 1e3) };
    let mut repairs = Repairs::default();
    let strokes: Vec<Stroke> = recording
        .strokes
        .iter()
        .map(|samples| clean(samples.iter().map(on_sheet).collect(), &clean_options, &mut repairs))
        .map(|samples| stroke(&samples, (width, height), options))
        .collect();
    let outside = |s: &&Sample| {
        let p = s.point - sheet.corner;
        !((0.0..=sheet.width).contains(&p.x) && (0.0..=sheet.height).contains(&p.y))
    };
    let outside = recording.strokes.iter().flatten().filter(outside).count();
    let width_hint = Some(options.width_at(0.5));
    let layer = InkLayer { name: LAYER.into(), color: INK, width_hint, strokes };
    Ok(Loaded { drawing: Drawing::new(width, height, vec![layer]), warnings: warnings(&repairs, outside) })
}

/// What was put right, in one sentence, and what lies off the sheet.
fn warnings(repairs: &Repairs, outside: usize) -> Vec<Warning> {
    let counted = [
        (repairs.duplicates, "samples at the time of another left out"),
        (repairs.disordered, "samples put in order of time"),
        (repairs.spikes, "samples far off their neighbours left out"),
        (repairs.hooks, "strokes freed of a hook at an end"),
        (outside, "samples outside the sheet that the first line gives"),
    ];
    let told: Vec<String> = counted.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    if told.is_empty() { Vec::new() } else { vec![Warning { line: None, message: told.join(", ") }] }
}

/// The stroke of cleaned samples (mm, y down) on a sheet of this width and height, m.
fn stroke(samples: &[Sample], (width, height): (f64, f64), options: &StylusOptions) -> Stroke {
    let place = |p: &Point| Point2::new(1e-3 * p.x - 0.5 * width, 0.5 * height - 1e-3 * p.y);
    let mm = |pressure: f64| 1e3 * options.width_at(pressure);
    let tolerance = 1e3 * options.tolerance;
    let hardest = samples.iter().map(|s| s.pressure).fold(0.0, f64::max);
    let (mut points, mut widths): (Vec<Point>, Vec<f64>) = (Vec::new(), Vec::new());
    for s in samples {
        // neighbours in one place say nothing of the line's direction
        if points.last().is_none_or(|p| p.distance(s.point) > SAME_PLACE_SHARE * tolerance) {
            points.push(s.point);
            widths.push(mm(s.pressure));
        }
    }
    let (low, high) = points.iter().fold((points[0], points[0]), |(l, h), p| {
        (Point::new(l.x.min(p.x), l.y.min(p.y)), Point::new(h.x.max(p.x), h.y.max(p.y)))
    });
    if points.len() < 2 || low.distance(high) < DOT_SHARE * mm(hardest) {
        let middle = low.midpoint(high);
        return Stroke { points: vec![place(&middle)], widths: vec![1e-3 * mm(hardest)] };
    }
    let width_tolerance = 1e3 * options.width_tolerance;
    let spline = fit(&points, &widths, &FitOptions { tolerance, width_tolerance, corner: options.corner });
    let (points, widths) = flatten(&spline, FLATTENING_SHARE * tolerance, width_tolerance);
    Stroke { points: points.iter().map(place).collect(), widths: widths.iter().map(|w| 1e-3 * w).collect() }
}

/// The sheet in units of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sheet {
    /// Upper left corner.
    corner: Point,
    width: f64,
    height: f64,
    mm_per_unit: f64,
}

impl Sheet {
    /// What samples cover, and a margin.
    fn around<'a>(samples: impl Iterator<Item = &'a Sample>) -> Self {
        let (mut low, mut high) =
            (Point::new(f64::INFINITY, f64::INFINITY), Point::new(-f64::INFINITY, -f64::INFINITY));
        for Sample { point: p, .. } in samples {
            low = Point::new(low.x.min(p.x), low.y.min(p.y));
            high = Point::new(high.x.max(p.x), high.y.max(p.y));
        }
        let covered = high - low;
        let margin = (MARGIN * covered.x.max(covered.y)).max(1.0);
        let (width, height) = (covered.x + 2.0 * margin, covered.y + 2.0 * margin);
        Self { corner: low - kurbo::Vec2::new(margin, margin), width, height, mm_per_unit: MM_PER_PX }
    }
}

/// A recording as it stands in its file.
#[derive(Default)]
struct Recording {
    sheet: Option<Sheet>,
    strokes: Vec<Vec<Sample>>,
}

impl Recording {
    fn parse(bytes: &[u8], file: &Path) -> Result<Self, DrawingError> {
        let invalid = |line: usize, message: String| DrawingError::Invalid { file: file.to_path_buf(), line, message };
        let mut recording = Self::default();
        let (mut down, mut latest, mut begun) = (Vec::new(), f64::NEG_INFINITY, false);
        let whole = encoding::text(bytes)
            .map_err(|line| invalid(line, "isn't text in UTF-8: a recording holds a JSON object a line".into()))?;
        for (i, line) in whole.split('\n').enumerate() {
            let number = i + 1;
            let text = line.trim();
            if text.is_empty() {
                continue;
            }
            let entry = Entry::parse(text).map_err(|message| invalid(number, message))?;
            let first = !std::mem::replace(&mut begun, true);
            match entry {
                Entry::Sheet(sheet) if first => recording.sheet = Some(sheet),
                Entry::Sheet(_) => {
                    let message =
                        "the sheet can only be given by the first line; a sample has `x`, `y`, `pressure`, `t`";
                    return Err(invalid(number, message.into()));
                }
                Entry::Up => recording.lift(&mut down),
                Entry::Sample(sample) => {
                    if sample.time < latest - LATE {
                        let message = format!("`t` falls from {latest} to {}: it should rise, in seconds", sample.time);
                        return Err(invalid(number, message));
                    }
                    latest = latest.max(sample.time);
                    if sample.pressure > 0.0 { down.push(sample) } else { recording.lift(&mut down) }
                }
            }
        }
        recording.lift(&mut down);
        Ok(recording)
    }

    /// Ends a stroke.
    fn lift(&mut self, down: &mut Vec<Sample>) {
        if !down.is_empty() {
            self.strokes.push(std::mem::take(down));
        }
    }
}

/// What a line says.
enum Entry {
    Sheet(Sheet),
    Sample(Sample),
    Up,
}

impl Entry {
    fn parse(text: &str) -> Result<Self, String> {
        const RIGHT: &str = r#"a sample is {"x": 310.5, "y": 402, "pressure": 0.31, "t": 0.008}"#;
        let value: Value = serde_json::from_str(text)
            // the line's own number says where; serde_json counts lines within it
            .map_err(|e| format!("isn't JSON, from column {} on: {RIGHT}", e.column()))?;
        let Some(object) = value.as_object() else { return Err(format!("isn't an object: {RIGHT}")) };
        if object.contains_key("width") || object.contains_key("height") {
            return Self::sheet(object);
        }
        if object.get("up").and_then(Value::as_bool) == Some(true) {
            return Ok(Self::Up);
        }
        let number = |key: &str| match object.get(key) {
            None => Err(format!("has no `{key}`: {RIGHT}")),
            Some(value) => match value.as_f64().filter(|x| x.is_finite()) {
                Some(x) => Ok(x),
                None => Err(format!("`{key}` is {value}, but should be a number")),
            },
        };
        let pressure = number("pressure")?;
        if !(0.0..=1.0).contains(&pressure) {
            return Err(format!("`pressure` is {pressure}, but should lie between 0 and 1"));
        }
        let [x, y, time] = [number("x")?, number("y")?, number("t")?];
        for (key, value) in [("x", x), ("y", y)] {
            if value.abs() > FARTHEST {
                return Err(format!("`{key}` is {value}, but should lie between {} and {FARTHEST}", -FARTHEST));
            }
        }
        Ok(Self::Sample(Sample { point: Point::new(x, y), pressure, time }))
    }

    fn sheet(object: &serde_json::Map<String, Value>) -> Result<Self, String> {
        const RIGHT: &str = r#"a sheet is {"width": 2000, "height": 900, "unit": "px"}"#;
        let side = |key: &str| match object.get(key).and_then(Value::as_f64) {
            Some(x) if (1e-3..=FARTHEST).contains(&x) => Ok(x),
            Some(x) => Err(format!("`{key}` is {x}, but should lie between 0.001 and {FARTHEST}: {RIGHT}")),
            None => Err(format!("the sheet has no number `{key}`: {RIGHT}")),
        };
        let mm_per_unit = match object.get("unit").map(Value::as_str) {
            None | Some(Some("px")) => MM_PER_PX,
            Some(Some("mm")) => 1.0,
            _ => return Err(format!("`unit` should be \"px\" or \"mm\": {RIGHT}")),
        };
        let (width, height) = (side("width")?, side("height")?);
        Ok(Self::Sheet(Sheet { corner: Point::ORIGIN, width, height, mm_per_unit }))
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use proptest::prelude::*;

    use super::*;

    fn read_text(text: &str) -> Result<Loaded, DrawingError> {
        parse(text.as_bytes(), Path::new("a.jsonl"), Size::Natural, &StylusOptions::default())
    }

    /// A looping line of varying pressure, 1000 px wide, at 240 samples a second; u in [0, 1].
    fn loops(u: f64) -> ([f64; 2], f64) {
        let a = 30.0 * u;
        ([100.0 + 800.0 * u + 60.0 * a.sin(), 250.0 + 120.0 * a.cos() * (1.0 - 0.5 * u)], 0.5 + 0.4 * (17.0 * u).sin())
    }

    fn recorded(noise: f64, seed: u64) -> String {
        use rand::RngExt as _;
        let mut rng = crate::math::stream(seed, "stylus", 0);
        let mut normal = move || noise * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
        let mut text = String::from("{\"width\": 1000, \"height\": 500, \"unit\": \"px\"}\n");
        for i in 0..=1500 {
            let ([x, y], pressure) = loops(f64::from(i) / 1500.0);
            let (x, y, t) = (x + normal(), y + normal(), f64::from(i) / 240.0);
            let _ = writeln!(text, "{{\"x\":{x},\"y\":{y},\"pressure\":{pressure},\"t\":{t},\"tilt\":0.3}}");
        }
        text
    }

    /// Distance of a point from the noiseless line, px, and the pressure there.
    fn nearest(p: [f64; 2]) -> (f64, f64) {
        let at = |i: i32| loops(f64::from(i) / 60_000.0);
        let off = |i: i32| {
            let (q, pressure) = at(i);
            ((p[0] - q[0]).hypot(p[1] - q[1]), pressure)
        };
        (0..=60_000).map(off).fold((f64::INFINITY, 0.0), |best, here| if here.0 < best.0 { here } else { best })
    }

    #[test]
    fn a_noisy_curve_comes_back_within_the_error_bound() {
        // a sheet of 1000 px on 100 mm: the bound of 0.05 mm is half a pixel
        let options = StylusOptions { width: [0.5e-3, 2e-3], ..Default::default() };
        for (noise, seed) in [(0.0, 1), (0.15, 2), (0.3, 3)] {
            let text = recorded(noise, seed);
            let loaded = parse(text.as_bytes(), Path::new("a.jsonl"), Size::Width(0.1), &options).unwrap();
            let stroke = &loaded.drawing.layers[0].strokes[0];
            assert_eq!(stroke.points.len(), stroke.widths.len());
            assert!(stroke.points.len() < 900, "{} points", stroke.points.len());
            let (mut farthest, mut wrong) = (0.0f64, 0.0f64);
            for (p, w) in stroke.points.iter().zip(&stroke.widths).step_by(5) {
                let (distance, pressure) = nearest([(p.x + 0.05) * 1e4, (0.025 - p.y) * 1e4]);
                farthest = farthest.max(distance);
                wrong = wrong.max((w - options.width_at(pressure)).abs());
            }
            assert!(farthest <= 0.5, "noise {noise} px: {farthest} px off");
            assert!(wrong < 4e-5, "noise {noise} px: {wrong} m off in width");
        }
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&bytes, Path::new("a.jsonl"), Size::Natural, &StylusOptions::default());
        }

        #[test]
        fn arbitrary_samples_make_strokes_or_an_error(
            samples in proptest::collection::vec((-1e7..1e7f64, prop_oneof![-1e7..1e7f64, 0.0..3.0f64], -0.1..1.2f64, -0.05..0.2f64), 0..60),
            sheet in any::<bool>(), text in "[-0-9a-z.:,{}\"\\[\\] ]{0,30}", at in 0usize..60,
        ) {
            let mut lines: Vec<String> = Vec::new();
            if sheet {
                lines.push("{\"width\":10,\"height\":2e3}".into());
            }
            let mut t = 0.0;
            for (x, y, p, dt) in samples {
                t += dt;
                let p = p.clamp(0.0, 1.0);
                lines.push(format!("{{\"x\":{},\"y\":{y},\"pressure\":{p},\"t\":{t}}}", x.clamp(-1e6, 1e6)));
            }
            if at < lines.len() / 2 {
                lines.insert(at, text);
            }
            if let Ok(loaded) = parse(lines.join("\n").as_bytes(), Path::new("a.jsonl"), Size::Width(0.2), &StylusOptions::default()) {
                for s in &loaded.drawing.layers[0].strokes {
                    prop_assert_eq!(s.points.len(), s.widths.len());
                    prop_assert!(!s.points.is_empty() && s.points.iter().all(|p| p.x.is_finite() && p.y.is_finite()));
                    prop_assert!(s.widths.iter().all(|w| (0.39e-3..=1.61e-3).contains(w)));
                }
            }
        }
    }

    #[test]
    fn mistakes_are_told_with_their_line_and_what_would_be_right() {
        let good = "{\"x\":1,\"y\":1,\"pressure\":0.5,\"t\":1}\n";
        for (line, wanted) in [
            ("{\"x\":1,\"y\":1,\"t\":2}", "a.jsonl:2: has no `pressure`: a sample is"),
            (
                "{\"x\":1,\"y\":1,\"pressure\":1.5,\"t\":2}",
                "a.jsonl:2: `pressure` is 1.5, but should lie between 0 and 1",
            ),
            ("{\"x\":null,\"y\":1,\"pressure\":1,\"t\":2}", "a.jsonl:2: `x` is null, but should be a number"),
            ("{\"x\":NaN,\"y\":1,\"pressure\":1,\"t\":2}", "a.jsonl:2: isn't JSON, from column 6 on: a sample is"),
            (
                "{\"x\":1,\"y\":1,\"pressure\":1,\"t\":0.5}",
                "a.jsonl:2: `t` falls from 1 to 0.5: it should rise, in seconds",
            ),
            ("{\"width\":1,\"height\":1}", "a.jsonl:2: the sheet can only be given by the first line"),
            ("[1, 2]", "a.jsonl:2: isn't an object"),
        ] {
            let error = read_text(&format!("{good}{line}\n")).unwrap_err().to_string();
            assert!(error.starts_with(wanted), "{error}");
        }
        let error = read_text("{\"width\":1,\"height\":1,\"unit\":\"in\"}\n").unwrap_err().to_string();
        assert!(error.starts_with("a.jsonl:1: `unit` should be \"px\" or \"mm\""), "{error}");
        let empty = read_text("{\"x\":1,\"y\":1,\"pressure\":0,\"t\":1}").unwrap_err();
        assert!(matches!(empty, DrawingError::Empty { .. }), "{empty}");
    }

    #[test]
    fn byte_order_marks_and_windows_line_ends_are_read() {
        let text: String = (0..50)
            .map(|x| format!("{{\"x\":{x},\"y\":5,\"pressure\":0.5,\"t\":{}}}\r\n", 0.01 * f64::from(x)))
            .collect();
        let marked = format!("\u{feff}{text}");
        let read =
            |t: &str| parse(t.as_bytes(), Path::new("a.jsonl"), Size::Width(0.1), &StylusOptions::default()).unwrap();
        assert_eq!(read(&marked), read(&text));
    }

    #[test]
    fn a_tap_is_a_dot_and_up_ends_a_stroke() {
        let mut text = String::from("{\"width\":100,\"height\":100,\"unit\":\"mm\"}\n");
        for i in 0..20 {
            let _ = writeln!(text, "{{\"x\":{},\"y\":10,\"pressure\":0.5,\"t\":{}}}", 10 + i, 0.01 * f64::from(i));
        }
        text += "{\"up\":true}\n{\"x\":50,\"y\":75,\"pressure\":0.2,\"t\":0.5}\n{\"x\":50.1,\"y\":75,\"pressure\":1,\"t\":0.51}\n";
        let loaded = read_text(&text).unwrap();
        let strokes = &loaded.drawing.layers[0].strokes;
        assert_eq!((strokes.len(), strokes[1].points.len(), loaded.drawing.width), (2, 1, 0.1));
        assert!((strokes[1].points[0] - Point2::new(50e-6, -0.025)).norm() < 1e-9);
        assert!((strokes[1].widths[0] - 1.6e-3).abs() < 1e-12);
        assert!((strokes[0].widths[1] - 1e-3).abs() < 1e-6 && strokes[0].points.len() < 8);
        assert!((strokes[0].length() - 0.019).abs() < 1e-6);
    }

    #[test]
    fn without_a_sheet_the_samples_make_one() {
        let text: String = (0..=10)
            .map(|i| format!("{{\"x\":{},\"y\":{},\"pressure\":0.5,\"t\":{}}}\n", 1000 + 96 * i, 500 - 10 * i, i))
            .collect();
        let drawing = read_text(&text).unwrap().drawing;
        assert!((drawing.width - 1.1 * 0.254).abs() < 1e-9, "{}", drawing.width);
        assert!((drawing.height - (100.0 + 96.0) / 960.0 * 0.254).abs() < 1e-9, "{}", drawing.height);
        let stroke = &drawing.layers[0].strokes[0];
        assert!((stroke.points[0].x + 0.127).abs() < 1e-6 && stroke.points[0].y < 0.0);
    }
}
