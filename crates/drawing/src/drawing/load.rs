//! Artwork files to drawings, by the file's extension.
use std::path::{Path, PathBuf};

use super::{DrawingError, Loaded, StylusOptions, SvgOptions, stroke_text, stylus, svg};

/// Reads artwork by its extension: `.svg` or `.svgz`, `.jsonl` for a recording of a stylus, or `.txt` for stroke text (with its
/// sibling inks). Stroke text heeds the size alone.
///
/// # Errors
/// See [`DrawingError`].
pub fn load(file: &Path, options: &SvgOptions, stylus: &StylusOptions) -> Result<Loaded, DrawingError> {
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match extension.as_str() {
        "svg" | "svgz" => svg::read(file, options),
        "jsonl" => stylus::read(file, options.size, stylus),
        "txt" => Ok(Loaded { drawing: stroke_text::read(file, options.size)?, warnings: Vec::new() }),
        _ => Err(DrawingError::UnknownKind { file: file.to_path_buf() }),
    }
}

/// The files of which [`load`] makes a drawing: the file itself, of stroke text with its sibling inks.
///
/// # Errors
/// The folder of stroke text can't be listed.
pub fn sources(file: &Path) -> std::io::Result<Vec<PathBuf>> {
    if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("txt")) {
        return Ok(stroke_text::inks_of(file)?.into_iter().map(|(path, _)| path).collect());
    }
    Ok(vec![file.to_path_buf()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::Size;

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
}
