//! STL, text and binary.
use nalgebra::Point3;

use super::TriMesh;
use super::file::{FormatError, RawMesh, text_of};

const HEADER: usize = 80;
const RECORD: usize = 50;

/// Bytes at a file's start by which text is told from numbers.
const LOOKED_AT: usize = 4096;

/// Parses either form. A file whose length is the one that its binary count asks for is binary, even when it starts
/// with `solid`, as some programs write; so is one whose first bytes are no text.
pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, FormatError> {
    let Some((count, records)) = binary_parts(bytes) else {
        return if is_text(bytes) {
            parse_text(&text_of(bytes))
        } else {
            Err(FormatError::new("neither text STL (`solid ...`) nor binary STL: shorter than its header of 84 bytes"))
        };
    };
    if records.len() as u64 == count * RECORD as u64 {
        return parse_binary(records);
    }
    if is_text(bytes) {
        return parse_text(&text_of(bytes));
    }
    // Bytes after the last triangle are harmless; missing ones are not.
    match records.get(..usize::try_from(count * RECORD as u64).unwrap_or(usize::MAX)) {
        Some(records) => parse_binary(records),
        None => Err(FormatError::new(format!(
            "binary STL of {count} triangles must have {} bytes, but the file ends after {}",
            HEADER as u64 + 4 + count * RECORD as u64,
            bytes.len()
        ))),
    }
}

/// Whether a file starts with `solid` and goes on as text, which has no zero bytes or other control characters.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let named = start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let control = |b: &u8| b.is_ascii_control() && !b.is_ascii_whitespace();
    named && !start[..start.len().min(LOOKED_AT)].iter().any(control)
}

fn binary_parts(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let (count, records) = bytes.get(HEADER..)?.split_first_chunk::<4>()?;
    Some((u64::from(u32::from_le_bytes(*count)), records))
}

fn parse_binary(records: &[u8]) -> Result<RawMesh, FormatError> {
    let mut mesh = RawMesh::default();
    for (i, record) in records.chunks_exact(RECORD).enumerate() {
        // The first three of twelve numbers are a normal, which the winding gives as well.
        let mut numbers =
            record.chunks_exact(4).skip(3).map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
        let mut next = || numbers.next().unwrap_or(f64::NAN);
        let corners = [(); 3].map(|()| Point3::new(next(), next(), next()));
        if !corners.iter().all(|p| p.iter().all(|c| c.is_finite())) {
            return Err(FormatError::new(format!("binary STL: a corner of triangle {i} (from 0) is not finite")));
        }
        push(&mut mesh, corners);
    }
    Ok(mesh)
}

fn push(mesh: &mut RawMesh, corners: [Point3<f64>; 3]) {
    let i = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners);
    mesh.triangles.push([i, i + 1, i + 2]);
}

fn parse_text(text: &str) -> Result<RawMesh, FormatError> {
    let mut mesh = RawMesh::default();
    let mut corners: Vec<Point3<f64>> = Vec::with_capacity(3);
    let (mut ended, mut last_line) = (false, 1);
    for (i, line) in text.lines().enumerate() {
        let number = i + 1;
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else { continue };
        last_line = number;
        let mut keyword = keyword.to_ascii_lowercase();
        if keyword == "end" {
            keyword.extend(words.next().map(str::to_ascii_lowercase));
        }
        match keyword.as_str() {
            "vertex" => corners.push(vertex(words, number)?),
            "endloop" => {
                let triangle: [Point3<f64>; 3] = corners.as_slice().try_into().map_err(|_| {
                    FormatError::at(number, format!("a loop has three vertices, this one has {}", corners.len()))
                })?;
                push(&mut mesh, triangle);
                corners.clear();
            }
            "solid" => ended = false,
            "endsolid" => ended = true,
            "facet" | "outer" | "endfacet" => {}
            other => {
                let message =
                    format!("unknown word `{other}`: expected facet, outer loop, vertex, endloop or endsolid");
                return Err(FormatError::at(number, message));
            }
        }
    }
    if ended && corners.is_empty() {
        Ok(mesh)
    } else {
        Err(FormatError::at(last_line, "the file ends here, but `endsolid` should close it"))
    }
}

fn vertex<'a>(words: impl Iterator<Item = &'a str>, line: usize) -> Result<Point3<f64>, FormatError> {
    let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).take(3).collect();
    match numbers[..] {
        [x, y, z] if numbers.iter().all(|c| c.is_finite()) => Ok(Point3::new(x, y, z)),
        [_, _, _] => Err(FormatError::at(line, "coordinates must be finite")),
        _ => Err(FormatError::at(line, "`vertex` takes three numbers: vertex X Y Z")),
    }
}

/// The mesh as binary STL; coordinates are rounded to `f32`, as the format has it.
pub(super) fn format(mesh: &TriMesh) -> Vec<u8> {
    let count = mesh.triangles().len();
    let mut bytes = Vec::with_capacity(HEADER + 4 + count * RECORD);
    bytes.resize(HEADER, b' ');
    bytes.extend((count as u32).to_le_bytes());
    for (t, normal) in mesh.triangles().iter().zip(mesh.face_normals()) {
        let corners = t.map(|i| mesh.vertices()[i as usize].coords);
        for v in [normal, &corners[0], &corners[1], &corners[2]] {
            bytes.extend(v.iter().flat_map(|c| (*c as f32).to_le_bytes()));
        }
        bytes.extend([0, 0]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn text_and_binary_agree() {
        let text = "solid two words\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1e0 0\n  \
                    endloop\n endfacet\nendsolid two words\n";
        let mesh = parse(text.as_bytes()).unwrap();
        let binary = format(&TriMesh::new(mesh.vertices.clone(), mesh.triangles.clone()).unwrap());
        assert_eq!(parse(&binary).unwrap().vertices, mesh.vertices);
        let truncated = &text[..text.find("endloop").unwrap()];
        assert_eq!(parse(truncated.as_bytes()).unwrap_err().line, Some(6));
    }

    #[test]
    fn a_binary_file_that_starts_with_solid_is_still_binary() {
        let mut bytes = format(&shapes::dome(0.1, 0.05).unwrap());
        let triangles = parse(&bytes).unwrap().triangles.len();
        bytes[..6].copy_from_slice(b"solid ");
        assert_eq!(parse(&bytes).unwrap().triangles.len(), triangles);
    }

    #[test]
    fn bytes_behind_the_last_triangle_dont_make_text_of_it() {
        let mut bytes = format(&shapes::dome(0.1, 0.05).unwrap());
        let triangles = parse(&bytes).unwrap().triangles.len();
        bytes[..6].copy_from_slice(b"solid ");
        bytes.extend(b"COLOR=1234");
        assert_eq!(parse(&bytes).unwrap().triangles.len(), triangles);
        // and a short one is called by its name
        let short = parse(&bytes[..bytes.len() / 2]).unwrap_err();
        assert!(short.line.is_none() && short.message.contains("binary STL"), "{}", short.message);
        bytes[HEADER + 4 + RECORD + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(parse(&bytes).unwrap_err().message.contains("triangle 1 (from 0) is not finite"));
    }

    #[test]
    fn words_may_be_written_large_or_apart() {
        let text = "\u{feff}\rSOLID a\rFACET NORMAL 0 0 1\rOuter Loop\rVERTEX 0 0 0\rvertex 1 0 0\rvertex 0 1 0\r\
                    end loop\rEndFacet\rEND SOLID a";
        assert_eq!(parse(text.as_bytes()).unwrap().triangles.len(), 1);
    }

    #[test]
    fn a_count_that_lies_is_refused() {
        let mut bytes = format(&shapes::dome(0.1, 0.05).unwrap());
        bytes[HEADER..HEADER + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(parse(&bytes).unwrap_err().message.contains("4294967295 triangles"));
    }
}
