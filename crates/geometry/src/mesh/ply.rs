//! PLY (Stanford polygon format), text and binary of either byte order.
use std::borrow::Cow;
use std::io::Cursor;

use nalgebra::{Point3, Vector3};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult};

use super::TriMesh;
use super::cloud::PointCloud;
use super::file::{FormatError, RawMesh};
use super::polygon::triangulate;
use crate::math::Rgb;

/// Parses the elements `vertex` (x, y, z), `face` (a list `vertex_indices` or `vertex_index`) and `tristrips`.
pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, FormatError> {
    let bytes = &plain_numbers(bytes)[..];
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(explain)?;
    check_header(&header, bytes.len())?;
    let strips = STRIPS.iter().find(|name| FACE_LISTS.iter().any(|list| has(&header, name, list)));
    if strips.is_none() && !FACE_LISTS.iter().any(|list| has(&header, "face", list)) {
        return Err(FormatError::new(
            "header has no faces: a mesh needs an element face (or tristrips) with a list vertex_indices",
        ));
    }
    let mut mesh = RawMesh::default();
    let mut faces = Vec::new();
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                let parsed = elements::<Vertex>(&mut reader, element, &header)?;
                mesh.vertices = parsed.iter().map(|v| Point3::from(v.at)).collect();
            }
            name if strips.is_some_and(|s| *s == name) => {
                for strip in elements::<Face>(&mut reader, element, &header)? {
                    strip.into_triangles(&mut faces);
                }
            }
            "face" => faces.extend(elements::<Face>(&mut reader, element, &header)?),
            _ => drop(elements::<Skipped>(&mut reader, element, &header)?),
        }
    }
    if let Some(i) = mesh.vertices.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
        return Err(not_finite(bytes, &header, "vertex", i));
    }
    let count = mesh.vertices.len();
    for (i, Face { corners }) in faces.iter().enumerate() {
        let in_range = |c: &i64| (0..count as i64).contains(c);
        if let Some(wrong) = corners.iter().find(|c| !in_range(c)) {
            return Err(FormatError::new(format!(
                "face {i} names vertex {wrong}, but there are {count} (0 is the first)"
            )));
        }
        if corners.len() < 3 {
            let n = corners.len();
            return Err(FormatError::new(format!("a face has at least three corners, face {i} has {n}")));
        }
        let corners: Vec<u32> = corners.iter().map(|&c| c as u32).collect();
        mesh.triangles.extend(
            triangulate(&corners, &mesh.vertices)
                .ok_or_else(|| FormatError::new(format!("face {i} has too many corners: cut it into triangles")))?,
        );
    }
    Ok(mesh)
}

/// A text file with every number as the parser takes it: digits on both sides of a point, and 1e999, which is read as infinite, for
/// what is not finite. Other files as they are.
fn plain_numbers(bytes: &[u8]) -> Cow<'_, [u8]> {
    const END: &[u8] = b"end_header";
    let Some(end) = bytes.windows(END.len()).position(|w| w == END).map(|at| at + END.len()) else {
        return bytes.into();
    };
    let (header, body) = bytes.split_at(end);
    let is_text = header.split(|b| *b == b'\n').any(|l| l.trim_ascii().starts_with(b"format ascii"));
    let Some(body) = is_text.then(|| std::str::from_utf8(body).ok()).flatten() else { return bytes.into() };
    let mut plain = header.to_vec();
    plain.reserve(body.len());
    for piece in body.split_inclusive(char::is_whitespace) {
        let word = piece.trim_end();
        match odd_number(word) {
            Some(number) => {
                plain.extend(number.as_bytes());
                plain.extend(&piece.as_bytes()[word.len()..]);
            }
            None => plain.extend(piece.as_bytes()),
        }
    }
    plain.into()
}

/// A number that is not finite, or has no digit on one side of its point, in the parser's spelling; `None` for any other word.
fn odd_number(word: &str) -> Option<String> {
    let digits = word.trim_start_matches(['+', '-']);
    let lower = digits.to_ascii_lowercase();
    // Microsoft's libraries write 1.#QNAN, 1.#INF and 1.#IND
    if lower.starts_with("nan") || lower.starts_with("inf") || lower.starts_with("1.#") {
        return Some("1e999".into());
    }
    let (whole, rest) = digits.split_once('.')?;
    let fraction = rest.split(['e', 'E']).next().unwrap_or_default();
    (whole.is_empty() || fraction.is_empty()).then(|| word.parse::<f64>().ok())?.map(|v| format!("{v:e}"))
}

/// Says which vertex or point is not finite, and on which line of a text file.
fn not_finite(bytes: &[u8], header: &Header, what: &str, index: usize) -> FormatError {
    let first = header.elements.values().next().is_some_and(|e| e.name == "vertex");
    let lines = (bytes.split(|b| *b == b'\n')).position(|l| l.trim_ascii() == b"end_header").map(|l| l + 1);
    let line = lines.filter(|_| first && header.encoding == Encoding::Ascii).map(|above| above + index + 1);
    FormatError { line, message: format!("{what} {index} is not finite: leave out the pixels that saw nothing") }
}

/// Refuses a header that promises more than the file can hold, before anything is made for it.
fn check_header(header: &Header, bytes: usize) -> Result<(), FormatError> {
    for ElementDef { name, count, properties } in header.elements.values() {
        // An element takes at least a byte: a line in a text file, a value in a binary one.
        if *count > 0 && (*count > bytes || properties.is_empty()) {
            return Err(FormatError::new(format!("header promises {count} of `{name}`, more than the file can hold")));
        }
    }
    for axis in ["x", "y", "z"] {
        if !has(header, "vertex", axis) {
            return Err(FormatError::new(format!("header has no property {axis} of element vertex")));
        }
    }
    Ok(())
}

fn has(header: &Header, element: &str, property: &str) -> bool {
    header.elements.get(element).is_some_and(|e| e.properties.contains_key(property))
}

/// Parses the points of the element `vertex`: x, y, z, and if they are there nx, ny, nz and red, green, blue (0 to 255). Faces are
/// passed over.
pub(super) fn parse_cloud(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    let bytes = &plain_numbers(bytes)[..];
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(explain)?;
    check_header(&header, bytes.len())?;
    let all = |names: [&str; 3]| names.iter().all(|n| has(&header, "vertex", n));
    let (normals, colors) = (all(NORMAL), all(COLOR));
    let mut cloud = PointCloud::default();
    for element in header.elements.values() {
        if element.name != "vertex" {
            elements::<Skipped>(&mut reader, element, &header)?;
            continue;
        }
        for Vertex { at, normal, color } in elements::<Vertex>(&mut reader, element, &header)? {
            cloud.points.push(Point3::from(at));
            if normals {
                cloud.normals.push(Vector3::from(normal));
            }
            if colors {
                cloud.colors.push(Rgb(color.map(|c| c.clamp(0.0, 255.0) as u8)));
            }
        }
    }
    match cloud.points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        Some(i) => Err(not_finite(bytes, &header, "point", i)),
        None => Ok(cloud),
    }
}

fn elements<E: PropertyAccess>(
    reader: &mut Reader<Cursor<&[u8]>>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, FormatError> {
    Parser::<E>::new().read_payload_for_element(reader, element, header).map_err(explain)
}

/// The parser's message, which spans several lines and quotes the file, as one line of bounded length.
fn explain(e: ParseError) -> FormatError {
    let text = e.to_string();
    let text = text.strip_prefix("Line ").and_then(|t| t.split_once(": ")).map_or(text.as_str(), |(_, m)| m);
    let words: Vec<&str> = text.split_whitespace().collect();
    FormatError { line: e.line(), message: words.join(" ").chars().take(200).collect() }
}

const FACE_LISTS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Elements that hold triangle strips, parted by -1.
const STRIPS: [&str; 2] = ["tristrips", "tristrip"];

const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const COLOR: [&str; 3] = ["red", "green", "blue"];

struct Vertex {
    at: [f64; 3],
    normal: [f64; 3],
    color: [f64; 3],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { at: [f64::NAN; 3], normal: [f64::NAN; 3], color: [0.0; 3] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let place = |names: [&str; 3]| names.iter().position(|n| *n == name);
        let number = if let Some(i) = place(["x", "y", "z"]) {
            &mut self.at[i]
        } else if let Some(i) = place(NORMAL) {
            &mut self.normal[i]
        } else if let Some(i) = place(COLOR) {
            &mut self.color[i]
        } else {
            return PropertyAccessResult::Ignored;
        };
        *number = match property {
            Property::Float(v) => v.into(),
            Property::Double(v) => v,
            Property::Char(v) => v.into(),
            Property::UChar(v) => v.into(),
            Property::Short(v) => v.into(),
            Property::UShort(v) => v.into(),
            Property::Int(v) => v.into(),
            Property::UInt(v) => v.into(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

struct Face {
    corners: Vec<i64>,
}

impl Face {
    /// The triangles of a strip: each corner makes one with the two before it, every other one the other way round.
    fn into_triangles(self, faces: &mut Vec<Self>) {
        for strip in self.corners.split(|c| *c == -1) {
            let turned = strip
                .windows(3)
                .enumerate()
                .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
            // a corner given twice turns the strip, and makes a triangle without area
            let whole = turned.filter(|[a, b, c]| a != b && b != c && c != a);
            faces.extend(whole.map(|t| Self { corners: t.to_vec() }));
        }
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self { corners: vec![] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !FACE_LISTS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match property {
            Property::ListChar(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUChar(v) => v.into_iter().map(i64::from).collect(),
            Property::ListShort(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUShort(v) => v.into_iter().map(i64::from).collect(),
            Property::ListInt(v) => v.into_iter().map(i64::from).collect(),
            Property::ListUInt(v) => v.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

/// The mesh as binary little-endian PLY with double coordinates.
pub(super) fn format(mesh: &TriMesh) -> Vec<u8> {
    let (vertices, triangles) = (mesh.vertices(), mesh.triangles());
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    );
    let mut bytes = header.into_bytes();
    bytes.extend(vertices.iter().flat_map(|v| [v.x, v.y, v.z]).flat_map(f64::to_le_bytes));
    for t in triangles {
        bytes.push(3);
        bytes.extend(t.iter().flat_map(|i| i.to_le_bytes()));
    }
    bytes
}

/// The cloud as binary little-endian PLY: doubles for places, floats for normals, bytes for colours.
pub(super) fn format_cloud(cloud: &PointCloud) -> Vec<u8> {
    let has_normals = cloud.normals.len() == cloud.points.len() && !cloud.points.is_empty();
    let has_colors = cloud.colors.len() == cloud.points.len() && !cloud.points.is_empty();
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
        cloud.points.len()
    );
    let mut properties = |names: [&str; 3], kind: &str| {
        names.iter().for_each(|n| header.push_str(&format!("property {kind} {n}\n")));
    };
    if has_normals {
        properties(NORMAL, "float");
    }
    if has_colors {
        properties(COLOR, "uchar");
    }
    header.push_str("end_header\n");
    let mut bytes = header.into_bytes();
    for (i, p) in cloud.points.iter().enumerate() {
        bytes.extend(p.iter().flat_map(|c| c.to_le_bytes()));
        if has_normals {
            bytes.extend(cloud.normals[i].iter().flat_map(|c| (*c as f32).to_le_bytes()));
        }
        if has_colors {
            bytes.extend(cloud.colors[i].0);
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_index\nend_header\n";

    #[test]
    fn a_text_file_with_quads_and_colours_is_read() {
        let text = format!("{HEADER}0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3\n");
        let mesh = parse(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.vertices[2], Point3::new(1.0, 1.0, 0.0));
    }

    #[test]
    fn strips_are_taken_apart_and_face_one_way() {
        let text = HEADER.replace("element face", "element tristrips");
        let mesh =
            parse(format!("{text}0 0 0 9\n1. 0 0 9\n0 +1. .0 9\n1 1 -.0e0 9\n6 0 1 2 3 -1 1\n").as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(mesh.vertices[2], Point3::new(0.0, 1.0, 0.0));
        let out = parse(format!("{text}0 0 0 9\n1 0 0 9\n0 1 0 9\n1 1 0 9\n3 0 1 7\n").as_bytes()).unwrap_err();
        assert!(out.message.contains("vertex 7"), "{}", out.message);
    }

    #[test]
    fn only_a_number_that_is_needed_has_to_be_finite() {
        let text = HEADER.replace("uchar red", "float nx");
        let whole = format!("{text}0 0 0 nan\n1 0 0 -nan(ind)\n1 1 0 1.#QNAN\n0 1 0 -inf\n4 0 1 2 3\n");
        assert_eq!(parse(whole.as_bytes()).unwrap().triangles.len(), 2);
        for word in ["nan", "-inf", "1e999", "1.#IND"] {
            let text = whole.replacen("1 1 0", &format!("1 {word} 0"), 1);
            let refused = parse(text.as_bytes()).unwrap_err();
            assert!(
                refused.line == Some(14) && refused.message.starts_with("vertex 2 is not finite"),
                "{}",
                refused.message
            );
        }
    }

    #[test]
    fn mistakes_name_the_line_or_the_face() {
        let short = format!("{HEADER}0 0 0 9\n1 0 0 9\n1 1 x 9\n");
        assert_eq!(parse(short.as_bytes()).unwrap_err().line, Some(14));
        let out = format!("{HEADER}0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 -3\n");
        assert!(parse(out.as_bytes()).unwrap_err().message.contains("face 0 names vertex -3"));
        let lie = HEADER.replace("vertex 4", "vertex 4000000000");
        assert!(parse(lie.as_bytes()).unwrap_err().message.contains("4000000000"));
        let cloud = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
        assert!(parse(cloud.as_bytes()).unwrap_err().message.contains("no faces"));
    }
}
