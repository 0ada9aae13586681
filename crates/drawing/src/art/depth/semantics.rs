//! What a picture shows where, and how near it is.
use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use crate::art::depth::SemanticsError;
use crate::picture::{Labels, Plane};

/// Most segments a picture may have; more are no semantics but noise.
pub const MAX_SEGMENTS: usize = 4096;
/// By how much the proportions of maps of the same picture may differ.
const SAME_SHAPE: f64 = 0.01;

/// What a segment is, in the words of panoptic segmentation (Kirillov et al. 2019, doi:10.1109/CVPR.2019.00963).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// An object that can be counted: a person, a sheep.
    Thing {
        /// How sure one is that it is there, 0..=1.
        confidence: f64,
    },
    /// Something without a shape of its own: grass, sky.
    Stuff {
        /// Its place among the stuff: what has the smallest is drawn first.
        order: i64,
    },
}

/// A part of the picture that means something.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Name: `sheep`, `grass`.
    pub name: String,
    /// What it is.
    pub kind: Kind,
}

/// What a picture shows where, and how near it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Semantics {
    width: usize,
    height: usize,
    segments: Vec<Segment>,
    labels: Vec<u16>,
    depth: Plane,
    /// What a user should read once, such as that all this is an estimate.
    pub notes: Vec<String>,
}

impl Semantics {
    /// Segments, for each pixel (row by row, `width` columns) the index of its segment, and its depth, 0 (far) ..= 1
    /// (near).
    ///
    /// # Errors
    /// [`SemanticsError::Size`] when the maps are empty or differ in size, [`SemanticsError::UnknownSegment`] when a label
    /// names no segment, [`SemanticsError::TooManyLabels`], and [`SemanticsError::Depth`] for a depth outside 0..=1.
    pub fn new(segments: Vec<Segment>, labels: Vec<u16>, depth: Plane) -> Result<Self, SemanticsError> {
        let (width, height) = (depth.width(), depth.height());
        if labels.len() != width * height || labels.is_empty() {
            return Err(SemanticsError::Size { what: "label map", width, height, values: labels.len() });
        }
        if segments.len() > MAX_SEGMENTS {
            return Err(SemanticsError::TooManyLabels { labels: segments.len(), max: MAX_SEGMENTS });
        }
        if let Some(&label) = labels.iter().find(|l| usize::from(**l) >= segments.len()) {
            return Err(SemanticsError::UnknownSegment { label, segments: segments.len() });
        }
        if let Some((pixel, &value)) = depth.values.iter().enumerate().find(|(_, v)| !(0.0..=1.0).contains(*v)) {
            return Err(SemanticsError::Depth { value, pixel });
        }
        Ok(Self { width, height, segments, labels, depth, notes: Vec::new() })
    }

    /// The semantics of a label image, a table of labels as JSON text
    /// and a depth map, which is resampled to the label image's size where it differs. A label that the table doesn't
    /// have becomes stuff that is drawn last. `table_file` is named in errors.
    ///
    /// The table is a list with one entry a label, or an object that holds it as `segments`:
    ///
    /// ```json
    /// [{"label": 1, "name": "sheep", "kind": "thing", "confidence": 0.97},
    ///  {"label": 2, "name": "grass", "kind": "stuff", "order": 1}]
    /// ```
    ///
    /// `confidence` is 1 where it is missing, and stuff without an `order` comes after all that has one, in the table's
    /// order. `kind` may also be called `class`.
    ///
    /// # Errors
    /// [`SemanticsError::Table`] with the line of the mistake; [`SemanticsError::Shape`] when the depth map is a map of
    /// another picture; and those of [`new`](Self::new).
    pub fn from_labels(labels: &Labels, table: &str, table_file: &Path, depth: &Plane) -> Result<Self, SemanticsError> {
        let entries = parse_table(table, table_file)?;
        let Labels { width, height, ids: values } = labels;
        let (width, height) = (*width, *height);
        if values.is_empty() || width * height != values.len() {
            return Err(SemanticsError::Size { what: "label image", width, height, values: values.len() });
        }
        let depth = same_shape("depth map", depth.width(), depth.height(), width, height)
            .map(|()| resample(depth, width, height))?;
        let last = entries.iter().filter_map(|e| e.order).max().unwrap_or(0);
        let mut known: BTreeMap<u16, Segment> = BTreeMap::new();
        for (i, e) in entries.into_iter().enumerate() {
            let kind = match e.kind {
                Word::Thing => Kind::Thing { confidence: e.confidence.unwrap_or(1.0) },
                Word::Stuff => Kind::Stuff { order: e.order.unwrap_or(last.saturating_add(1 + i as i64)) },
            };
            known.insert(e.label, Segment { name: e.name, kind });
        }
        let mut index: BTreeMap<u16, u16> = BTreeMap::new();
        for value in values {
            let next = index.len();
            if !index.contains_key(value) {
                index.insert(*value, next.min(usize::from(u16::MAX)) as u16);
            }
        }
        if index.len() > MAX_SEGMENTS {
            return Err(SemanticsError::TooManyLabels { labels: index.len(), max: MAX_SEGMENTS });
        }
        let mut segments = vec![Segment { name: String::new(), kind: Kind::Stuff { order: i64::MAX } }; index.len()];
        let mut notes = Vec::new();
        for (value, at) in &index {
            segments[usize::from(*at)] = known.remove(value).unwrap_or_else(|| {
                notes.push(format!("label {value} isn't in {}: it is drawn last", table_file.display()));
                Segment { name: format!("label {value}"), kind: Kind::Stuff { order: i64::MAX } }
            });
        }
        notes.extend(known.values().map(|s| format!("there is no `{}` in the label image", s.name)));
        let labels = values.iter().map(|v| index[v]).collect();
        Ok(Self { notes, ..Self::new(segments, labels, depth)? })
    }

    /// The same segments with another depth map, which is resampled to their size where it differs.
    ///
    /// # Errors
    /// [`SemanticsError::Shape`] when it is a map of another picture, and those of [`new`](Self::new).
    pub fn with_depth(&self, depth: &Plane) -> Result<Self, SemanticsError> {
        let (width, height) = (self.width, self.height);
        same_shape("depth map", depth.width(), depth.height(), width, height)?;
        let depth = resample(depth, width, height);
        Ok(Self { notes: self.notes.clone(), ..Self::new(self.segments.clone(), self.labels.clone(), depth)? })
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The segments.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// For each pixel, row by row, the index of its segment.
    pub fn labels(&self) -> &[u16] {
        &self.labels
    }

    /// How near each pixel is, 0 (far) ..= 1 (near).
    pub fn depth(&self) -> &Plane {
        &self.depth
    }

    /// Number of pixels of each segment.
    pub fn areas(&self) -> Vec<usize> {
        let mut areas = vec![0; self.segments.len()];
        self.labels.iter().for_each(|l| areas[usize::from(*l)] += 1);
        areas
    }

    /// The weight of each segment that is a thing: its share of the picture times the confidence in it; 0 of stuff.
    pub fn weights(&self) -> Vec<f64> {
        let all = self.labels.len() as f64;
        let weight = |(area, s): (usize, &Segment)| match s.kind {
            Kind::Thing { confidence } => area as f64 / all * confidence,
            Kind::Stuff { .. } => 0.0,
        };
        self.areas().into_iter().zip(&self.segments).map(weight).collect()
    }

    /// The segments that have pixels, in the order in which they are drawn: things, the heaviest first, then stuff by its
    /// order.
    pub fn drawing_order(&self) -> Vec<usize> {
        let (areas, weights) = (self.areas(), self.weights());
        let mut order: Vec<usize> = (0..self.segments.len()).filter(|i| areas[*i] > 0).collect();
        let rank = |i: usize| match self.segments[i].kind {
            Kind::Thing { .. } => (0, 0),
            Kind::Stuff { order } => (1, order),
        };
        order.sort_by(|a, b| rank(*a).cmp(&rank(*b)).then(weights[*b].total_cmp(&weights[*a])).then(a.cmp(b)));
        order
    }

    /// The same semantics for a picture of another size: labels by the nearest pixel, depth between pixels.
    ///
    /// # Errors
    /// [`SemanticsError::Shape`] when the sides are in another proportion, and [`SemanticsError::Size`] for no pixels.
    pub fn resized(&self, width: usize, height: usize) -> Result<Self, SemanticsError> {
        if (width, height) == (self.width, self.height) {
            return Ok(self.clone());
        }
        if width == 0 || height == 0 {
            return Err(SemanticsError::Size { what: "picture", width, height, values: 0 });
        }
        same_shape("label map", self.width, self.height, width, height)?;
        let nearest = |i: usize, from: usize, to: usize| ((2 * i + 1) * from / (2 * to)).min(from - 1);
        let mut labels = Vec::with_capacity(width * height);
        for row in 0..height {
            let from = nearest(row, self.height, height) * self.width;
            labels.extend((0..width).map(|column| self.labels[from + nearest(column, self.width, width)]));
        }
        let depth = resample(&self.depth, width, height);
        Ok(Self { notes: self.notes.clone(), ..Self::new(self.segments.clone(), labels, depth)? })
    }
}

/// Whether two maps may be maps of one picture.
fn same_shape(
    what: &'static str,
    width: usize,
    height: usize,
    picture_width: usize,
    picture_height: usize,
) -> Result<(), SemanticsError> {
    let (a, b) = (width as f64 * picture_height as f64, picture_width as f64 * height as f64);
    // a thumbnail can't meet a proportion better than its pixels allow
    let pixel = 0.5 / width.min(height).min(picture_width).min(picture_height).max(1) as f64;
    if a > 0.0 && b > 0.0 && (a - b).abs() <= (SAME_SHAPE + pixel.min(0.5)) * a.max(b) {
        return Ok(());
    }
    Err(SemanticsError::Shape { what, width, height, picture_width, picture_height })
}

/// A depth map at another size.
fn resample(depth: &Plane, width: usize, height: usize) -> Plane {
    if (width, height) == (depth.width(), depth.height()) {
        return depth.clone();
    }
    let (sx, sy) = (depth.width() as f64 / width as f64, depth.height() as f64 / height as f64);
    Plane::from_fn(width, height, |x, y| depth.sample((x as f64 + 0.5) * sx, (y as f64 + 0.5) * sy))
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Word {
    Thing,
    Stuff,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    label: u16,
    name: String,
    #[serde(alias = "class")]
    kind: Word,
    confidence: Option<f64>,
    order: Option<i64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    segments: Vec<Entry>,
}

impl Entry {
    /// What is wrong with it, after these.
    fn mistake(&self, before: &[Entry]) -> Option<String> {
        let label = self.label;
        if let Some(first) = before.iter().find(|e| e.label == label) {
            return Some(format!("label {label} is `{}` already", first.name));
        }
        match (self.kind, self.confidence, self.order) {
            (Word::Thing, _, Some(_)) => {
                Some(format!("label {label} is a thing: things are ordered by size and `confidence`, not by `order`"))
            }
            (Word::Stuff, Some(_), _) => {
                Some(format!("label {label} is stuff: stuff is ordered by `order`, not by `confidence`"))
            }
            (_, Some(c), _) if !(0.0..=1.0).contains(&c) => {
                Some(format!("label {label} has a confidence of {c}: it must lie in 0..=1"))
            }
            _ => None,
        }
    }
}

fn parse_table(text: &str, file: &Path) -> Result<Vec<Entry>, SemanticsError> {
    let invalid = |line: usize, message: String| {
        Err(SemanticsError::Table { file: file.to_path_buf(), line: line.max(1), message })
    };
    let parsed = match text.trim_start().chars().next() {
        Some('{') => serde_json::from_str(text).map(|t: Table| t.segments),
        Some('[') => serde_json::from_str(text),
        _ => {
            let right = r#"[{"label": 1, "name": "sheep", "kind": "thing"}]"#;
            return invalid(1, format!("a table of segments is a list such as {right}"));
        }
    };
    let entries: Vec<Entry> = match parsed {
        Ok(entries) => entries,
        Err(e) => {
            let message = e.to_string();
            let end = message.rfind(" at line ").unwrap_or(message.len());
            return invalid(e.line(), message[..end].to_string());
        }
    };
    if entries.len() > MAX_SEGMENTS {
        return invalid(1, format!("{} entries, but there can be at most {MAX_SEGMENTS} segments", entries.len()));
    }
    for (i, entry) in entries.iter().enumerate() {
        if let Some(message) = entry.mistake(&entries[..i]) {
            return invalid(line_of_entry(text, i), message);
        }
    }
    Ok(entries)
}

/// The 1-based line on which an entry has its label. Every entry has one key `"label"`; a name that reads so is followed by
/// no colon.
fn line_of_entry(text: &str, index: usize) -> usize {
    let key = |(at, word): &(usize, &str)| text[at + word.len()..].trim_start().starts_with(':');
    let at = text.match_indices("\"label\"").filter(key).nth(index).map_or(0, |(at, _)| at);
    text.as_bytes()[..at].iter().filter(|b| **b == b'\n').count() + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TABLE: &str = r#"[
        {"label": 1, "name": "sheep", "kind": "thing", "confidence": 0.5},
        {"label": 2, "name": "dog", "kind": "thing"},
        {"label": 300, "name": "grass", "kind": "stuff", "order": 2},
        {"label": 4, "name": "roof", "kind": "stuff"},
        {"label": 5, "name": "house", "kind": "stuff", "order": 1}
    ]"#;

    fn semantics(values: &[u16], width: usize) -> Result<Semantics, SemanticsError> {
        let depth = Plane::filled(width, values.len() / width, 0.5);
        Semantics::from_labels(&labels(values, width), TABLE, Path::new("table.json"), &depth)
    }

    fn labels(values: &[u16], width: usize) -> Labels {
        Labels { width, height: values.len() / width, ids: values.to_vec() }
    }

    fn names(s: &Semantics) -> Vec<&str> {
        s.drawing_order().into_iter().map(|i| s.segments()[i].name.as_str()).collect()
    }

    #[test]
    fn things_come_by_weight_and_stuff_by_order() {
        // three pixels of a half-sure sheep weigh less than two of a sure dog
        let s = semantics(&[7, 300, 300, 4, 5, 5, 1, 1, 1, 2, 2, 300], 4).unwrap();
        assert_eq!(names(&s), ["dog", "sheep", "house", "grass", "roof", "label 7"]);
        assert_eq!(s.notes, ["label 7 isn't in table.json: it is drawn last"]);
        assert!((s.weights().iter().sum::<f64>() - 3.5 / 12.0).abs() < 1e-12);
    }

    #[test]
    fn a_mistake_in_the_table_is_shown_with_its_line() {
        let error = |text: &str| parse_table(text, Path::new("t.json")).unwrap_err().to_string();
        let one = r#"{"label": 1, "name": "a", "kind": "thing"}"#;
        assert_eq!(error(&format!("[{one},\n{one}\n]")), "t.json:2: label 1 is `a` already");
        let e = error("[\n\n{\"label\": 1, \"name\": \"a\", \"kind\": \"thing\", \"confidence\": 2}]");
        assert_eq!(e, "t.json:3: label 1 has a confidence of 2: it must lie in 0..=1");
        let e = error(&format!("[{one},\n {{\"label\": 2, \"name\": \"b\", \"kind\": \"thing\", \"order\": 2}}]"));
        assert!(e.starts_with("t.json:2: label 2 is a thing"), "{e}");
        assert!(error("[{\"label\": 1}]").contains("missing field `name`"));
        assert!(error("{}").contains("missing field `segments`"));
        assert!(error("7").contains("is a list such as"));
        let wrapped = format!(r#"{{"segments": {}}}"#, TABLE.replace("kind", "class"));
        assert_eq!(parse_table(&wrapped, Path::new("t")).unwrap().len(), 5);
    }

    #[test]
    fn maps_of_other_pictures_are_refused_and_other_sizes_resampled() {
        let values = [1, 1, 2, 2, 1, 1, 2, 2];
        let depth = Plane::from_fn(400, 200, |x, _| x as f32 / 399.0);
        let s = Semantics::from_labels(&labels(&values, 4), TABLE, Path::new("t"), &depth).unwrap();
        assert!((s.depth().at(2, 0) - 0.625).abs() < 0.01);
        let large = s.resized(100, 50).unwrap();
        assert_eq!(large.labels()[49], s.labels()[0]);
        assert_eq!(large.labels()[50], s.labels()[2]);
        let e = s.resized(300, 300).unwrap_err().to_string();
        assert!(e.contains("4 x 2") && e.contains("300 x 300"), "{e}");
        let e = Semantics::from_labels(&labels(&values, 4), TABLE, Path::new("t"), &Plane::filled(50, 50, 0.0))
            .unwrap_err();
        assert!(matches!(e, SemanticsError::Shape { what: "depth map", .. }));
    }

    proptest! {
        #[test]
        fn arbitrary_tables_never_panic(text in "\\PC{0,80}", at in 0usize..300, put in any::<char>()) {
            let _ = parse_table(&text, Path::new("t"));
            let mut chars: Vec<char> = TABLE.chars().collect();
            let at = at % chars.len();
            chars[at] = put;
            let _ = parse_table(&chars.into_iter().collect::<String>(), Path::new("t"));
        }

        #[test]
        fn every_pixel_keeps_its_label(values in proptest::collection::vec(any::<u16>(), 1..60)) {
            let s = semantics(&values, values.len()).unwrap();
            for (i, v) in values.iter().enumerate() {
                for (j, w) in values.iter().enumerate() {
                    prop_assert_eq!(v == w, s.labels()[i] == s.labels()[j]);
                }
            }
            prop_assert_eq!(s.areas().iter().sum::<usize>(), values.len());
        }
    }
}
