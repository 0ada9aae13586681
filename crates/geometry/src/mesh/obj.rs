//! Wavefront OBJ: vertices and faces; everything else in a file is passed over.
use std::fmt::Write as _;

use nalgebra::Point3;

use super::TriMesh;
use super::file::{FormatError, RawMesh, text_of};
use super::polygon::triangulate;

/// Statements that end in a name, whose backslash may be part of a path: they don't go on in the next line.
const NAMES: [&str; 4] = ["o", "g", "usemtl", "mtllib"];

/// Parses `v` and `f` lines; a line that ends in a backslash goes on in the next one. Negative indices count back from the last vertex above them.
pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, FormatError> {
    // Names and comments may be in any encoding; the lines that matter are ASCII.
    let text = text_of(bytes);
    let mut mesh = RawMesh::default();
    let mut lines = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim()).enumerate();
    while let Some((i, first)) = lines.next() {
        let line_number = i + 1;
        let mut line = first.to_string();
        while line.ends_with('\\') && !first.split_whitespace().next().is_some_and(|w| NAMES.contains(&w)) {
            line.pop();
            let Some((_, next)) = lines.next() else { break };
            line.push(' ');
            line.push_str(next);
        }
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => mesh.vertices.push(vertex(words, line_number)?),
            Some("f") => {
                let corners = face(words, mesh.vertices.len(), line_number)?;
                mesh.triangles.extend(
                    triangulate(&corners, &mesh.vertices).ok_or_else(|| {
                        FormatError::at(line_number, "face has too many corners: cut it into triangles")
                    })?,
                );
            }
            _ => {}
        }
    }
    Ok(mesh)
}

fn vertex<'a>(mut words: impl Iterator<Item = &'a str>, line: usize) -> Result<Point3<f64>, FormatError> {
    let mut number = || words.next().and_then(|w| w.parse::<f64>().ok());
    // A fourth number is a weight or the first of a colour.
    let (Some(x), Some(y), Some(z)) = (number(), number(), number()) else {
        return Err(FormatError::at(line, "`v` takes three numbers: v X Y Z"));
    };
    if [x, y, z].iter().all(|c| c.is_finite()) {
        Ok(Point3::new(x, y, z))
    } else {
        Err(FormatError::at(line, "coordinates must be finite"))
    }
}

/// Corners of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn` each.
fn face<'a>(words: impl Iterator<Item = &'a str>, count: usize, line: usize) -> Result<Vec<u32>, FormatError> {
    let corner = |word: &str| {
        let index: i64 = word.split('/').next().unwrap_or_default().parse().map_err(|_| {
            FormatError::at(line, format!("`{word}` is no face corner: write V, V/VT, V//VN or V/VT/VN"))
        })?;
        let from_zero = if index < 0 { index.saturating_add(count as i64) } else { index - 1 };
        u32::try_from(from_zero)
            .ok()
            .filter(|&i| (i as usize) < count)
            .ok_or_else(|| FormatError::at(line, format!("face names vertex {index}, but {count} are listed above it")))
    };
    let corners = words.map(corner).collect::<Result<Vec<u32>, _>>()?;
    if corners.len() < 3 {
        let n = corners.len();
        return Err(FormatError::at(line, format!("a face has at least three corners, this one has {n}")));
    }
    Ok(corners)
}

/// The mesh as OBJ text, coordinates exact to the last bit.
pub(super) fn format(mesh: &TriMesh) -> Vec<u8> {
    let mut text = String::new();
    // Writing to a String can't fail.
    for v in mesh.vertices() {
        let _ = writeln!(text, "v {} {} {}", v.x, v.y, v.z);
    }
    for [a, b, c] in mesh.triangles() {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_on_after_a_backslash() {
        let text = "\u{feff}v 0 0 \\\r\n 0\r\nv 1 \\\r\n 0 \\\r\n 0\r\nv 0 1 0 # C:\\\r\n\
                    mtllib C:\\\r\nf 1 2 \\\r\n3\r\nf 1 2 9";
        let short = &text[..text.len() - 7];
        let mesh = parse(short.as_bytes()).unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles), (3, vec![[0, 1, 2]]));
        // a fault is on the line on which its statement begins
        assert_eq!(parse(text.as_bytes()).unwrap_err().line, Some(10));
        assert_eq!(parse(b"v 0 0 0\\").unwrap().vertices.len(), 1);
    }

    #[test]
    fn every_way_to_write_a_corner_is_read() {
        let text = b"o x\nv 0 0 0 # a\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1/1 3//1 -1\ns off\n";
        let mesh = parse(text).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        for bad in ["f 1 2 0", "f 1 2 -9", "f 1 2 x", "f 1 2 99999999999999999999", "f 1 2 -9223372036854775808"] {
            assert!(parse(format!("v 0 0 0\nv 1 0 0\nv 1 1 0\n{bad}").as_bytes()).is_err(), "{bad}");
        }
    }
}
