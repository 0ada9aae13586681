//! Files of the TSPLIB format (Reinelt, "TSPLIB - A Traveling Salesman Problem Library", 1991): points in the plane.
//!
//! ```text
//! NAME : three
//! TYPE : TSP
//! DIMENSION : 3
//! EDGE_WEIGHT_TYPE : EUC_2D
//! NODE_COORD_SECTION
//! 1 0 0
//! 2 3.5 0
//! 3 0 4e1
//! EOF
//! ```
use crate::files;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nalgebra::Point2;
use thiserror::Error;

/// A travelling-salesman problem in the plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Problem {
    /// Its name.
    pub name: String,
    /// Its points, in the file's units.
    pub points: Vec<Point2<f64>>,
}

/// Why a file can't be read.
#[derive(Debug, Error)]
pub enum TsplibError {
    /// The file can't be opened or isn't text.
    #[error("{}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A line that is wrong.
    #[error("{}:{line}: {message}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong, and what would be right.
        message: String,
    },
}

/// Reads a file.
///
/// # Errors
/// `Unreadable`, or as [`parse`].
pub fn read(file: &Path) -> Result<Problem, TsplibError> {
    let text = files::read_text(file).map_err(|source| TsplibError::Unreadable { file: file.to_path_buf(), source })?;
    parse(&text, file)
}

/// Reads the text of a file; `file` is named in errors.
///
/// # Errors
/// `Invalid` with the first line that is wrong: distances other than `EUC_2D`, a problem that isn't symmetric, a point
/// that isn't `number x y` with the next number, or other than `DIMENSION` points.
pub fn parse(text: &str, file: &Path) -> Result<Problem, TsplibError> {
    let invalid = |line: usize, message: String| TsplibError::Invalid { file: file.to_path_buf(), line, message };
    let mut problem = Problem::default();
    let (mut dimension, mut distances, mut in_section) = (None, None, false);
    let mut last = 1;
    for (line, text) in (1..).zip(text.lines()).map(|(i, t)| (i, t.trim())).filter(|(_, t)| !t.is_empty()) {
        last = line;
        if text == "EOF" {
            break;
        }
        if in_section && text.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+' || c == '.') {
            let number = problem.points.len() + 1;
            let point = point(text, number).ok_or_else(|| {
                let text = shorten(text);
                invalid(line, format!("`{text}`: `{number} x y` is due here, with two finite coordinates"))
            })?;
            problem.points.push(point);
            continue;
        }
        let (key, value) = text.split_once(':').map_or((text, ""), |(k, v)| (k.trim(), v.trim()));
        in_section = false;
        match key {
            "NAME" => problem.name = value.to_string(),
            "COMMENT" | "DISPLAY_DATA_TYPE" | "NODE_COORD_TYPE" => {}
            "TYPE" if value.split_whitespace().next() == Some("TSP") => {}
            "TYPE" => return Err(invalid(line, format!("a problem of type `{}`: TSP is read", shorten(value)))),
            "EDGE_WEIGHT_TYPE" if value == "EUC_2D" => distances = Some(line),
            "EDGE_WEIGHT_TYPE" => {
                return Err(invalid(line, format!("distances `{}`: EUC_2D is read", shorten(value))));
            }
            "DIMENSION" => {
                let count = value.parse::<usize>().map_err(|_| {
                    invalid(line, format!("DIMENSION `{}`: a number of points is due here", shorten(value)))
                })?;
                dimension = Some((line, count));
            }
            "NODE_COORD_SECTION" => in_section = true,
            _ => {
                let message = format!(
                    "`{}`: NAME, TYPE, COMMENT, DIMENSION, EDGE_WEIGHT_TYPE, NODE_COORD_SECTION or EOF is due here",
                    shorten(key)
                );
                return Err(invalid(line, message));
            }
        }
    }
    let Some((line, count)) = dimension else {
        return Err(invalid(last, "the file ends without a line `DIMENSION : points`".into()));
    };
    if distances.is_none() {
        return Err(invalid(last, "the file ends without a line `EDGE_WEIGHT_TYPE : EUC_2D`".into()));
    }
    if problem.points.len() != count {
        return Err(invalid(line, format!("{count} points are announced, {} follow", problem.points.len())));
    }
    Ok(problem)
}

/// The point of a line `number x y`.
fn point(text: &str, number: usize) -> Option<Point2<f64>> {
    let mut words = text.split_whitespace();
    let first: usize = words.next()?.parse().ok()?;
    let mut coordinate = || words.next()?.parse::<f64>().ok().filter(|v| v.is_finite());
    let point = Point2::new(coordinate()?, coordinate()?);
    (first == number && words.next().is_none()).then_some(point)
}

/// The start of a text that may be long.
fn shorten(text: &str) -> String {
    const MOST: usize = 40;
    if text.chars().count() <= MOST { text.to_string() } else { text.chars().take(MOST).chain("...".chars()).collect() }
}

/// The text of a file.
pub fn write(problem: &Problem) -> String {
    let name = problem.name.replace(['\n', '\r'], " ");
    let mut text = format!("NAME : {}\nTYPE : TSP\nDIMENSION : {}\n", name.trim(), problem.points.len());
    text.push_str("EDGE_WEIGHT_TYPE : EUC_2D\nNODE_COORD_SECTION\n");
    for (i, p) in (1..).zip(&problem.points) {
        // writing to a string can't fail
        let _ = writeln!(text, "{i} {} {}", p.x, p.y);
    }
    text.push_str("EOF\n");
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn parse(text: &str) -> Result<Problem, String> {
        super::parse(text, Path::new("a.tsp")).map_err(|e| e.to_string())
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let head = "NAME: a\nTYPE : TSP\nDIMENSION : 2\nEDGE_WEIGHT_TYPE : EUC_2D\nNODE_COORD_SECTION\n";
        let cases = [
            (format!("{head}1 0 0\n3 1 1\nEOF\n"), "a.tsp:7: `3 1 1`: `2 x y` is due here"),
            (format!("{head}1 0 0\n2 1\nEOF\n"), "a.tsp:7: `2 1`"),
            (format!("{head}1 0 0\n2 1 1e999\nEOF\n"), "a.tsp:7: "),
            (format!("{head}1 0 0\nEOF\n"), "a.tsp:3: 2 points are announced, 1 follow"),
            (head.replace("EUC_2D", "GEO"), "a.tsp:4: distances `GEO`: EUC_2D is read"),
            (head.replace(": TSP", ": ATSP"), "a.tsp:2: a problem of type `ATSP`"),
            (head.replace("DIMENSION : 2", "DIMENSION : two"), "a.tsp:3: DIMENSION `two`"),
            (head.replace("DIMENSION : 2\n", ""), "a.tsp:4: the file ends without a line `DIMENSION"),
            (head.replace("NAME", "TITLE"), "a.tsp:1: `TITLE`: NAME, TYPE"),
            (String::new(), "a.tsp:1: "),
        ];
        for (text, expected) in cases {
            let error = parse(&text).unwrap_err();
            assert!(error.starts_with(expected), "{error}\nis not\n{expected}");
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(
            points in prop::collection::vec((-1e300..1e300f64, -1e3..1e3f64), 0..20),
            name in "[a-z ]{0,8}",
        ) {
            let points = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
            let problem = Problem { name: name.trim().into(), points };
            prop_assert_eq!(parse(&write(&problem)).unwrap(), problem);
        }

        #[test]
        fn any_text_is_read_or_refused(
            head in "(NAME: x\n)?(DIMENSION ?: ?[0-9]{1,3}\n)?(EDGE_WEIGHT_TYPE: EUC_2D\n)?(NODE_COORD_SECTION\n)?",
            rest in "\\PC*|([0-9]{1,2} [0-9.e-]{1,4} [0-9.e-]{1,4}\n){0,5}(EOF)?",
        ) {
            if let Ok(problem) = parse(&format!("{head}{rest}")) {
                prop_assert!(problem.points.iter().all(|p| p.x.is_finite() && p.y.is_finite()));
            }
        }
    }
}
