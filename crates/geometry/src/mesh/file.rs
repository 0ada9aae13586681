//! Reading and writing mesh files: OBJ, STL and PLY, by the extension.
use crate::files;
use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::{MeshError, TriMesh, obj, ply, stl};

/// Vertices farther apart than this, m, stay apart; nearer than half of it they always become one. (STL repeats each
/// vertex for every triangle.)
const WELD_DISTANCE: f64 = 1e-6;

/// Why a mesh file can't be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// The file can't be read or written at all.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The extension is of no known format.
    #[error("{}: the format of a mesh is known by its ending: .obj, .stl or .ply", file.display())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
    },
    /// The scale is not a positive number.
    #[error("{}: a scale of {scale} makes no mesh; it must be above 0 (0.001 for a file in mm)", file.display())]
    BadScale {
        /// The file.
        file: PathBuf,
        /// The scale asked for.
        scale: f64,
    },
    /// The text or the bytes are wrong.
    #[error("{}{}: {message}", file.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// 1-based line, where the format has lines.
        line: Option<usize>,
        /// What is wrong and what would be right.
        message: String,
    },
    /// The file is well formed, but its mesh can't be used.
    #[error("{}: {source}", file.display())]
    Mesh {
        /// The file.
        file: PathBuf,
        /// Why.
        source: MeshError,
    },
}

/// What a format's parser returns: triangles in the file's own unit, every index checked by the mesh itself later.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    pub vertices: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

/// What is wrong in a file, and on which line.
#[derive(Debug)]
pub(super) struct FormatError {
    pub line: Option<usize>,
    pub message: String,
}

impl FormatError {
    pub fn new(message: impl Into<String>) -> Self {
        Self { line: None, message: message.into() }
    }

    pub fn at(line: usize, message: impl Into<String>) -> Self {
        Self { line: Some(line), message: message.into() }
    }
}

/// The text of a file whose names may be in any encoding: without byte order mark, lines of an old Macintosh parted as others are.
pub(super) fn text_of(bytes: &[u8]) -> String {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = String::from_utf8_lossy(bytes);
    if text.contains('\n') { text.into_owned() } else { text.replace('\r', "\n") }
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Obj,
    Stl,
    Ply,
}

impl Format {
    fn of(file: &Path) -> Result<Self, MeshFileError> {
        let extension = file.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Ok(Self::Obj),
            "stl" => Ok(Self::Stl),
            "ply" => Ok(Self::Ply),
            _ => Err(MeshFileError::UnknownFormat { file: file.to_path_buf() }),
        }
    }
}

/// Reads a mesh from an OBJ, STL (text or binary) or PLY (text or binary) file and multiplies its coordinates by
/// `scale` (m per unit of the file: 1.0 for metres, 0.001 for millimetres).
///
/// Polygons are cut into triangles. Vertices at the same place (to 0.5 um) become one, so that normals are smooth across
/// triangles that a file lists apart; materials, colours, texture coordinates and the file's own normals are not used.
///
/// # Errors
/// [`MeshFileError`] names the file, the line where the format has one, and what would be right.
pub fn read(file: &Path, scale: f64) -> Result<TriMesh, MeshFileError> {
    if !(scale.is_finite() && scale > 0.0) {
        return Err(MeshFileError::BadScale { file: file.to_path_buf(), scale });
    }
    let format = Format::of(file)?;
    let bytes = files::read(file).map_err(|source| MeshFileError::Io { file: file.to_path_buf(), source })?;
    let parsed = match format {
        Format::Obj => obj::parse(&bytes),
        Format::Stl => stl::parse(&bytes),
        Format::Ply => ply::parse(&bytes),
    };
    let RawMesh { mut vertices, mut triangles } =
        parsed.map_err(|e| MeshFileError::Syntax { file: file.to_path_buf(), line: e.line, message: e.message })?;
    vertices.iter_mut().for_each(|v| *v *= scale);
    weld(&mut vertices, &mut triangles);
    TriMesh::new(vertices, triangles).map_err(|source| MeshFileError::Mesh { file: file.to_path_buf(), source })
}

/// Writes a mesh, in metres, as OBJ, binary STL or binary PLY by the file's extension. The file appears whole or not
/// at all.
pub fn write(file: &Path, mesh: &TriMesh) -> Result<(), MeshFileError> {
    let bytes = match Format::of(file)? {
        Format::Obj => obj::format(mesh),
        Format::Stl => stl::format(mesh),
        Format::Ply => ply::format(mesh),
    };
    let mut temporary = file.as_os_str().to_owned();
    temporary.push(".partial");
    let result = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, file));
    result.map_err(|source| {
        // The error that matters is the first one; a leftover that can't be removed adds nothing to it.
        let _ = fs::remove_file(&temporary);
        MeshFileError::Io { file: file.to_path_buf(), source }
    })
}

/// A mesh, in metres, as the bytes of a binary PLY file.
pub fn ply_bytes(mesh: &TriMesh) -> Vec<u8> {
    ply::format(mesh)
}

/// Makes vertices within [`WELD_DISTANCE`] one; the first of them in the file's order stays. A cell is half as wide, so
/// that all points of a cell are near enough to its first.
fn weld(vertices: &mut Vec<Point3<f64>>, triangles: &mut [[u32; 3]]) {
    let cell_of = |v: &Point3<f64>| v.coords.map(|c| (2.0 * c / WELD_DISTANCE).floor() as i64);
    let mut kept: Vec<Point3<f64>> = Vec::new();
    let mut index = Vec::with_capacity(vertices.len());
    let mut first_in_cell: HashMap<[i64; 3], u32> = HashMap::with_capacity(vertices.len());
    for v in vertices.iter() {
        let cell = cell_of(v);
        let near = neighbours(v, [cell.x, cell.y, cell.z])
            .filter_map(|c| first_in_cell.get(&c).copied())
            .find(|&i| (kept[i as usize] - v).norm() <= WELD_DISTANCE);
        index.push(near.unwrap_or_else(|| {
            kept.push(*v);
            let i = kept.len() as u32 - 1;
            first_in_cell.entry([cell.x, cell.y, cell.z]).or_insert(i);
            i
        }));
    }
    // An index out of range stays out of range, for the mesh to report.
    let (old, new) = (vertices.len() as u32, kept.len() as u32);
    for i in triangles.iter_mut().flatten() {
        *i = index.get(*i as usize).copied().unwrap_or_else(|| (*i - old).saturating_add(new));
    }
    *vertices = kept;
}

/// The cell of a point, then the cells next to it.
fn neighbours(v: &Point3<f64>, cell: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    // Points that are not finite weld with nothing.
    let reach = if v.coords.iter().all(|c| c.is_finite()) { 27 } else { 0 };
    let order = [0, -1, 1];
    (0..reach).map(move |k: usize| {
        let offset = [order[k % 3], order[k / 3 % 3], order[k / 9]];
        [0, 1, 2].map(|axis| cell[axis].saturating_add(offset[axis]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn read_bytes(name: &str, bytes: &[u8]) -> Result<TriMesh, MeshFileError> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join(name);
        fs::write(&file, bytes).unwrap();
        read(&file, 1.0)
    }

    fn message(name: &str, text: &str) -> String {
        let e = read_bytes(name, text.as_bytes()).unwrap_err().to_string();
        e.rsplit_once('/').unwrap().1.to_string()
    }

    #[test]
    fn what_is_written_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        for mesh in [shapes::dome(0.1, 0.02).unwrap(), shapes::cuboid(&Vector3::new(0.1, 0.2, 0.3), 0.05).unwrap()] {
            for name in ["a.obj", "a.stl", "a.ply"] {
                let file = dir.path().join(name);
                write(&file, &mesh).unwrap();
                let back = read(&file, 1.0).unwrap();
                assert_eq!(back.triangles().len(), mesh.triangles().len(), "{name}");
                assert_eq!(back.vertices().len(), mesh.vertices().len(), "{name}");
                assert!((back.signed_volume() / mesh.signed_volume() - 1.0).abs() < 1e-6, "{name}");
                let scaled = read(&file, 0.001).unwrap();
                assert!((scaled.bounds().1.z / mesh.bounds().1.z - 0.001).abs() < 1e-9, "{name}");
            }
        }
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3, "temporary files are left over");
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        assert_eq!(
            message("a.obj", &format!("{v}f 1 2 4\n")),
            "a.obj:4: face names vertex 4, but 3 are listed above it"
        );
        assert_eq!(message("a.obj", "v 0 0\n"), "a.obj:1: `v` takes three numbers: v X Y Z");
        assert_eq!(
            message("a.obj", &format!("{v}f 1 2\n")),
            "a.obj:4: a face has at least three corners, this one has 2"
        );
        assert!(message("a.obj", "v 0 0 nan\n").contains("finite"));
        assert!(message("a.obj", v).contains("no triangles"));
        assert!(message("a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n").starts_with("a.stl:4:"));
        assert!(message("a.stl", "solid x\nendsolid x\n").contains("no triangles"));
        let header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
        let faces = "element face 0\nproperty list uchar int vertex_indices\nend_header\n";
        assert!(message("a.ply", &format!("{header}end_header\n0 0 0\n")).contains("no faces"));
        let e = message("a.ply", &format!("{header}{faces}q\n"));
        assert!(e.starts_with("a.ply:10: "), "{e}");
        assert!(message("a.dae", "").contains(".obj, .stl or .ply"));
        assert!(read(Path::new("/nowhere/a.obj"), 1.0).is_err() && read(Path::new("a.obj"), 0.0).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), head in 0..6usize) {
            let heads: [&[u8]; 6] = [
                b"",
                b"solid ",
                b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
                b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 9\nproperty list uint int vertex_indices\nend_header\n",
                b"ply\nformat ascii 1.0\nelement vertex 99999999999\nelement face 1\nproperty list uint int vertex_indices\nend_header\n",
                b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf ",
            ];
            let bytes = [heads[head], &bytes].concat();
            for name in ["a.obj", "a.stl", "a.ply"] {
                let _ = read_bytes(name, &bytes);
            }
        }

        #[test]
        fn a_broken_file_never_panics(cut in 0.0..1.0f64, at in 0.0..1.0f64, with in any::<u8>()) {
            let mesh = shapes::cuboid(&Vector3::new(0.1, 0.2, 0.3), 0.2).unwrap();
            for (name, whole) in [("a.obj", obj::format(&mesh)), ("a.stl", stl::format(&mesh)), ("a.ply", ply::format(&mesh))] {
                let mut bytes = whole.clone();
                bytes[(at * whole.len() as f64) as usize] = with;
                let _ = read_bytes(name, &bytes);
                bytes.truncate((cut * whole.len() as f64) as usize);
                let _ = read_bytes(name, &bytes);
                if name != "a.obj" {
                    prop_assert!(read_bytes(name, &whole[..bytes.len()]).is_err(), "{name} cut to {}", bytes.len());
                }
            }
        }

        #[test]
        fn welding_joins_what_is_near_and_nothing_else(x in -1.0..1.0f64, near in 0.0..0.49e-6f64, far in 2.1e-6..1e-3f64) {
            let mut vertices = [0.0, near, far].map(|d| Point3::new(x + d, x, -x)).to_vec();
            let mut triangles = vec![[0, 1, 2], [2, 1, 7]];
            weld(&mut vertices, &mut triangles);
            prop_assert_eq!(vertices.len(), 2);
            prop_assert_eq!(triangles, vec![[0, 0, 1], [1, 0, 6]]);
        }
    }
}
