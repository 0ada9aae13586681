//! Artwork files to drawings, by the file's extension; and what can go wrong on the way.
use std::path::{Path, PathBuf};

use super::{Drawing, StylusOptions, SvgOptions, stroke_text, stylus, svg};

/// A drawing and what of its artwork could not be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The drawing.
    pub drawing: Drawing,
    /// What was left out or changed, in a fixed order; empty when everything is drawn as the artwork shows it.
    pub warnings: Vec<Warning>,
}

/// Something of the artwork that is not drawn, or not as the artwork shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// 1-based line of the first such place, where one is known.
    pub line: Option<usize>,
    /// What, how often, and what to do about it.
    pub message: String,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}

/// Artwork that can't become a drawing.
#[derive(Debug, thiserror::Error)]
pub enum DrawingError {
    /// The file can't be read at all.
    #[error("{}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its content is wrong.
    #[error("{}:{line}: {message}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// 1-based line.
        line: usize,
        /// What is wrong and what would be right.
        message: String,
    },
    /// It is sound, but there is nothing to draw.
    #[error("{}: holds no strokes: {reason}", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
        /// Why nothing is left.
        reason: String,
    },
    /// The extension says nothing about the format.
    #[error("{}: unknown kind of artwork: known are .svg, .jsonl (a stylus) and .txt (stroke text, one file per ink: name_k.txt)", file.display())]
    UnknownKind {
        /// The file.
        file: PathBuf,
    },
    /// An option or parameter is out of range.
    #[error("{name} = {value}: {message}")]
    BadOption {
        /// Name of the option.
        name: &'static str,
        /// The value given.
        value: f64,
        /// What would be right.
        message: String,
    },
}

/// Wished size of the sheet; artwork is scaled uniformly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Size {
    /// As the file says: units as written, 96 px = 25.4 mm.
    #[default]
    Natural,
    /// This width, m.
    Width(f64),
    /// This height, m.
    Height(f64),
    /// As large as fits into this width and height, m.
    Fit(f64, f64),
}

/// Sides of a sheet beyond which a size is taken for a mistake, m.
const SIDE: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

impl Size {
    /// Width and height of the sheet, m, for artwork of this natural width and height, m.
    ///
    /// # Errors
    /// `BadOption` where a wished or resulting side is not between 0.1 mm and 1 km.
    pub fn resolve(&self, width: f64, height: f64) -> Result<(f64, f64), DrawingError> {
        let check = |name, value: f64| match SIDE.contains(&value) {
            true => Ok(value),
            false => Err(DrawingError::BadOption {
                name,
                value,
                message: "a sheet's side must lie between 0.0001 and 1000 m".into(),
            }),
        };
        let factor = match *self {
            Size::Natural => 1.0,
            Size::Width(w) => check("width", w)? / width,
            Size::Height(h) => check("height", h)? / height,
            Size::Fit(w, h) => (check("width", w)? / width).min(check("height", h)? / height),
        };
        Ok((check("width", width * factor)?, check("height", height * factor)?))
    }
}

/// Reads artwork by its extension: `.svg`, `.jsonl` for a recording of a stylus, or `.txt` for stroke text (with its
/// sibling inks). Stroke text heeds the size alone.
///
/// # Errors
/// See [`DrawingError`].
pub fn load(file: &Path, options: &SvgOptions, stylus: &StylusOptions) -> Result<Loaded, DrawingError> {
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match extension.as_str() {
        "svg" => svg::read(file, options),
        "jsonl" => stylus::read(file, options.size, stylus),
        "txt" => Ok(Loaded { drawing: stroke_text::read(file, options.size)?, warnings: Vec::new() }),
        _ => Err(DrawingError::UnknownKind { file: file.to_path_buf() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_chooses_the_reader() {
        let folder = tempfile::tempdir().unwrap();
        let options = SvgOptions { size: Size::Fit(0.1, 0.1), ..Default::default() };
        let load = |file: &Path| load(file, &options, &StylusOptions::default());
        let file = |name: &str, text: &str| {
            let file = folder.path().join(name);
            std::fs::write(&file, text).unwrap();
            file
        };
        let svg = file(
            "a.SVG",
            "<svg xmlns='http://www.w3.org/2000/svg' width='4' height='2'><path d='M0 0H4' stroke='red'/></svg>",
        );
        let text = file("a_k.txt", "400 200\n0 0.5\n1 0.5\nEnd\n");
        let line = |x: f64| format!("{{\"x\":{x},\"y\":50,\"pressure\":0.5,\"t\":{}}}\n", 0.01 * x);
        let samples: String = (0..=200).map(|x| line(f64::from(x))).collect();
        let stylus = file("a.jsonl", &format!("{{\"width\":200,\"height\":100,\"unit\":\"px\"}}\n{samples}"));
        for file in [svg, text, stylus] {
            let d = load(&file).unwrap().drawing;
            assert!((d.width - 0.1).abs() < 1e-8 && (d.height - 0.05).abs() < 1e-8 && (d.length() - 0.1).abs() < 1e-7);
        }
        assert!(matches!(load(&file("a.doc", "")), Err(DrawingError::UnknownKind { .. })));
        assert!(matches!(load(&folder.path().join("none.svg")), Err(DrawingError::Unreadable { .. })));
    }

    #[test]
    fn sizes_that_are_no_sheet_are_refused() {
        for size in [Size::Width(0.0), Size::Height(f64::NAN), Size::Fit(1.0, f64::INFINITY), Size::Width(1e4)] {
            assert!(matches!(size.resolve(0.2, 0.1), Err(DrawingError::BadOption { .. })), "{size:?}");
        }
    }
}
