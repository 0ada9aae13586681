//! The plain stroke text format: one file per ink.
//!
//! ```text
//! 1200 800          width and height of the sheet: their ratio counts
//! 0.25 0.5          a point: x right and y down, as shares of the width and of the height, 0..1
//! 0.75 0.5
//! End               the pen lifts
//! ```
//!
//! The ink stands in the file's name: `name_k.txt`, `name_c.txt`, `name_m.txt`, `name_y.txt`, or a CSS colour's name
//! (`name_crimson.txt`). Reading one of these reads its siblings too, in the order c, m, y, k, then others by name.
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nalgebra::Point2;

use super::encoding;
use super::{Drawing, InkLayer, Stroke};
use super::{DrawingError, Size};
use crate::files;
use crate::math::Rgb;

/// Metres per unit of the first line where the size is left as the file says: pixels of 96 per inch.
const METRES_PER_UNIT: f64 = 0.0254 / 96.0;

/// Colours of the four process inks as they print on white paper.
const PROCESS_INKS: [(&str, &str, Rgb); 4] = [
    ("c", "cyan", Rgb([0, 174, 239])),
    ("m", "magenta", Rgb([236, 0, 140])),
    ("y", "yellow", Rgb([255, 242, 0])),
    ("k", "black", Rgb([0, 0, 0])),
];

/// Reads a stroke text file and the files of its sibling inks.
///
/// # Errors
/// `Invalid` with the line that is wrong, or where a sibling's sheet has another shape; `Empty` without strokes;
/// `Unreadable`; `BadOption` for a size out of range.
pub fn read(file: &Path, size: Size) -> Result<Drawing, DrawingError> {
    let unreadable = |source| DrawingError::Unreadable { file: file.to_path_buf(), source };
    let mut sheet: Option<(f64, f64)> = None;
    let mut layers = Vec::new();
    for (path, (name, color)) in inks_of(file).map_err(unreadable)? {
        let bytes = files::read(&path).map_err(|source| DrawingError::Unreadable { file: path.clone(), source })?;
        let text = encoding::text(&bytes).map_err(|line| DrawingError::Invalid {
            file: path.clone(),
            line,
            message: "isn't text in UTF-8: lines of two numbers".into(),
        })?;
        let (width, height, strokes) = parse(&text, &path)?;
        let (w, h) = *sheet.get_or_insert((width, height));
        if (width * h - w * height).abs() > 1e-6 * w * height {
            return Err(DrawingError::Invalid {
                file: path,
                line: 1,
                message: format!(
                    "the sheet is {width} x {height}, but that of a sibling ink {w} x {h}: they must agree"
                ),
            });
        }
        layers.push(InkLayer { name, color, width_hint: None, strokes });
    }
    layers.retain(|l| !l.strokes.is_empty());
    let (w, h) = match sheet {
        Some(sheet) if !layers.is_empty() => sheet,
        _ => {
            return Err(DrawingError::Empty {
                file: file.to_path_buf(),
                reason: "no line of points ends in `End`".into(),
            });
        }
    };
    let (width, height) = size.resolve(w * METRES_PER_UNIT, h * METRES_PER_UNIT)?;
    for p in layers.iter_mut().flat_map(|l| &mut l.strokes).flat_map(|s| &mut s.points) {
        *p = Point2::new((p.x - 0.5) * width, (0.5 - p.y) * height);
    }
    Ok(Drawing::new(width, height, layers))
}

/// Name and colour of the ink that a file's suffix stands for.
fn ink_of(suffix: &str) -> Option<(String, Rgb)> {
    let suffix = &*suffix.to_ascii_lowercase();
    let process = PROCESS_INKS.iter().find(|(s, ..)| *s == suffix).map(|(_, name, color)| (name.to_string(), *color));
    process.or_else(|| {
        let named = suffix.bytes().all(|b| b.is_ascii_lowercase());
        let color: svgtypes::Color = suffix.parse().ok().filter(|_| named)?;
        Some((suffix.to_string(), Rgb([color.red, color.green, color.blue])))
    })
}

/// Stem and suffix of `stem_suffix.txt`.
fn split_name(file: &Path) -> Option<(&str, &str)> {
    file.file_stem()?.to_str()?.rsplit_once('_')
}

/// The files of a drawing with their inks, in drawing order.
pub(super) fn inks_of(file: &Path) -> std::io::Result<Vec<(PathBuf, (String, Rgb))>> {
    let black = Rgb([0, 0, 0]);
    let Some((stem, suffix)) = split_name(file) else {
        return Ok(vec![(file.to_path_buf(), ("black".to_string(), black))]);
    };
    if ink_of(suffix).is_none() {
        return Ok(vec![(file.to_path_buf(), (suffix.to_string(), black))]);
    }
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut found = BTreeMap::new();
    for path in files::folder(folder)? {
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("txt")) {
            continue;
        }
        if let Some((s, suffix)) = split_name(&path)
            && s == stem
            && let Some(ink) = ink_of(suffix)
        {
            let suffix = suffix.to_ascii_lowercase();
            let rank = PROCESS_INKS.iter().position(|(s, ..)| *s == suffix).unwrap_or(PROCESS_INKS.len());
            // Of two files of one ink the one named goes before.
            if path == file || !found.contains_key(&(rank, suffix.clone())) {
                found.insert((rank, suffix), (path, ink));
            }
        }
    }
    if found.is_empty() {
        return Err(std::io::ErrorKind::NotFound.into());
    }
    Ok(found.into_values().collect())
}

/// Parses one file: width and height as written, and strokes as written (0..1, y down).
///
/// # Errors
/// `Invalid` with the line that is wrong.
pub fn parse(text: &str, file: &Path) -> Result<(f64, f64, Vec<Stroke>), DrawingError> {
    let invalid = |line: usize, message: String| DrawingError::Invalid { file: file.to_path_buf(), line, message };
    let mut lines = text.lines().enumerate().map(|(i, l)| (i + 1, l.trim())).filter(|(_, l)| !l.is_empty());
    let Some((line, first)) = lines.next() else {
        return Err(invalid(1, "empty: the first line gives `width height`".into()));
    };
    let [width, height] = pair(first).ok_or_else(|| {
        invalid(line, format!("`{}`: the first line gives `width height`, two numbers", shorten(first)))
    })?;
    if !(width > 0.0 && height > 0.0 && (1e-4..=1e4).contains(&(width / height))) {
        return Err(invalid(
            line,
            format!("a sheet of {width} x {height}: both sides must be positive and in proportion"),
        ));
    }
    let (mut strokes, mut points, mut last) = (Vec::new(), Vec::new(), line);
    for (line, text) in lines {
        last = line;
        if text == "End" {
            if points.is_empty() {
                return Err(invalid(line, "`End` without a point before it: each stroke holds at least one".into()));
            }
            strokes.push(Stroke::new(std::mem::take(&mut points)));
            continue;
        }
        let Some([x, y]) = pair(text) else {
            return Err(invalid(
                line,
                format!("`{}`: a line holds `x y`, two numbers in 0..1, or `End`", shorten(text)),
            ));
        };
        if !(0.0..=1.0).contains(&x) || !(0.0..=1.0).contains(&y) {
            return Err(invalid(
                line,
                format!("point {x} {y} lies outside the sheet: x and y are shares of its sides, 0..1"),
            ));
        }
        points.push(Point2::new(x, y));
    }
    if !points.is_empty() {
        return Err(invalid(last, "the last stroke has no end: a line `End` must follow it".into()));
    }
    Ok((width, height, strokes))
}

/// Exactly two finite numbers.
fn pair(text: &str) -> Option<[f64; 2]> {
    let mut words = text.split_whitespace().map(|w| w.parse::<f64>().ok().filter(|x| x.is_finite()));
    match (words.next(), words.next(), words.next()) {
        (Some(Some(a)), Some(Some(b)), None) => Some([a, b]),
        _ => None,
    }
}

fn shorten(text: &str) -> String {
    text.chars().take(40).collect()
}

/// The text of one layer. The first line gives the sheet in units of 1/96 inch; points outside the sheet are moved to
/// its edge, since the format knows none.
pub fn write(drawing: &Drawing, layer: &InkLayer) -> String {
    let mut text = format!("{} {}\n", drawing.width / METRES_PER_UNIT, drawing.height / METRES_PER_UNIT);
    for stroke in layer.strokes.iter().filter(|s| !s.points.is_empty()) {
        for p in &stroke.points {
            let x = (p.x / drawing.width + 0.5).clamp(0.0, 1.0);
            let y = (0.5 - p.y / drawing.height).clamp(0.0, 1.0);
            // Writing to a string does not fail.
            let _ = writeln!(text, "{x} {y}");
        }
        text.push_str("End\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn error(text: &str) -> String {
        parse(text, Path::new("a_k.txt")).unwrap_err().to_string()
    }

    #[test]
    fn mistakes_are_named_with_file_and_line() {
        let cases = [
            ("", "a_k.txt:1: empty"),
            ("100\n", "a_k.txt:1: `100`: the first line"),
            ("100 0\n", "a_k.txt:1: a sheet of 100 x 0"),
            ("100 50\n0.1 0.2 0.3\nEnd\n", "a_k.txt:2: `0.1 0.2 0.3`: a line holds"),
            ("100 50\n0.1 nan\nEnd\n", "a_k.txt:2: `0.1 nan`"),
            ("100 50\n0.1 0.2\n\n0.1 1.2\nEnd\n", "a_k.txt:4: point 0.1 1.2 lies outside"),
            ("100 50\n0.1 0.2\nEnd\nEnd\n", "a_k.txt:4: `End` without"),
            ("100 50\n0.1 0.2\n", "a_k.txt:2: the last stroke has no end"),
        ];
        for (text, start) in cases {
            let e = error(text);
            assert!(e.starts_with(start), "{e}");
        }
    }

    #[test]
    fn one_ink_reads_its_siblings_in_order() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [
            ("a_k.txt", "200 100\n0 0\n1 1\nEnd\n"),
            ("a_c.txt", "400 200\n0.5 0.5\nEnd\n"),
            ("a_crimson.txt", "200 100\n0 0\n1 0\nEnd\n"),
            ("a_y.txt", "200 100\n"),
            ("a_notes.txt", "nothing to draw"),
            ("b_m.txt", "200 100\n0 0\nEnd\n"),
        ] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let d = read(&folder.path().join("a_k.txt"), Size::Width(0.2)).unwrap();
        assert!((d.width - 0.2).abs() < 1e-12 && (d.height - 0.1).abs() < 1e-12);
        let names: Vec<&str> = d.layers.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["cyan", "black", "crimson"]);
        assert_eq!(d.layers[0].strokes[0].points, [Point2::new(0.0, 0.0)]);
        assert!((d.layers[1].strokes[0].points[0] - Point2::new(-0.1, 0.05)).norm() < 1e-12, "top left first");
        assert!(matches!(read(&folder.path().join("c_k.txt"), Size::Natural), Err(DrawingError::Unreadable { .. })));

        std::fs::write(folder.path().join("a_m.txt"), "100 100\n0 0\nEnd\n").unwrap();
        let e = read(&folder.path().join("a_k.txt"), Size::Natural).unwrap_err().to_string();
        assert!(e.contains("a_m.txt:1: the sheet is 100 x 100"), "{e}");
    }

    #[test]
    fn inks_are_found_whatever_the_case_of_their_names() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a_k.txt", "a_C.txt", "a_m.TXT"] {
            std::fs::write(folder.path().join(name), "\u{feff}200 100\r\n0 0\r\n1 0\r\nEnd\r\n").unwrap();
        }
        let d = read(&folder.path().join("a_k.txt"), Size::Natural).unwrap();
        let names: Vec<&str> = d.layers.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["cyan", "magenta", "black"]);
    }

    proptest! {
        #[test]
        fn arbitrary_text_never_panics(text in "([0-9. End\n-]{0,60}|\\PC{0,40})") {
            let _ = parse(&text, Path::new("a_k.txt"));
        }

        #[test]
        fn what_is_written_reads_back(
            strokes in proptest::collection::vec(proptest::collection::vec((-0.15..0.15f64, -0.1..0.1f64), 1..9), 1..6),
        ) {
            let strokes: Vec<Stroke> = strokes
                .into_iter()
                .map(|s| Stroke::new(s.into_iter().map(|(x, y)| Point2::new(x, y)).collect()))
                .collect();
            let layer = InkLayer { name: "black".into(), color: Rgb([0, 0, 0]), width_hint: None, strokes };
            let drawing = Drawing::new(0.3, 0.2, vec![layer]);
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("a_k.txt");
            std::fs::write(&file, write(&drawing, &drawing.layers[0])).unwrap();
            let read = read(&file, Size::Natural).unwrap();
            prop_assert!((read.width - 0.3).abs() < 1e-12 && (read.height - 0.2).abs() < 1e-12);
            prop_assert_eq!(read.layers.len(), 1);
            for (s, t) in read.layers[0].strokes.iter().zip(&drawing.layers[0].strokes) {
                prop_assert_eq!(s.points.len(), t.points.len());
                prop_assert!(s.points.iter().zip(&t.points).all(|(p, q)| (p - q).norm() < 1e-12));
            }
            prop_assert_eq!(read.stroke_count(), drawing.stroke_count());
        }
    }
}
