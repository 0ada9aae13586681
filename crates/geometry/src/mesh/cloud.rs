//! Point clouds and their files.
use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::{MeshFileError, ply};
use crate::files;
use crate::math::Rgb;

/// Largest coordinate a cloud may have, m: beyond it a scale is wrong.
const MAX_COORDINATE: f64 = 1e6;

/// Points in space, m, with or without normals and colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Positions, m.
    pub points: Vec<Point3<f64>>,
    /// Outward normals, one a point, or none at all; zero where a point's isn't known.
    pub normals: Vec<Vector3<f64>>,
    /// Colours, one a point, or none at all.
    pub colors: Vec<Rgb>,
}

impl PointCloud {
    /// The cloud as the bytes of a binary PLY file, in metres. Normals are written in single precision.
    pub fn to_ply(&self) -> Vec<u8> {
        ply::format_cloud(self)
    }
}

/// Reads a cloud from a PLY file, text or binary of either byte order, and multiplies its coordinates by `scale` (m per unit of the
/// file). Normals (nx, ny, nz) and colours (red, green, blue) are kept when every point has them, a normal that is not finite as zero;
/// faces are passed over.
///
/// # Errors
/// [`MeshFileError`] names the file, the line where the file is text, and what would be right. Every coordinate must be finite.
pub fn read_cloud(file: &Path, scale: f64) -> Result<PointCloud, MeshFileError> {
    if !(scale.is_finite() && scale > 0.0) {
        return Err(MeshFileError::BadScale { file: file.to_path_buf(), scale });
    }
    let wrong = |line, message: String| MeshFileError::Syntax { file: file.to_path_buf(), line, message };
    if !file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
        return Err(wrong(None, "a point cloud is read from a .ply file".into()));
    }
    let bytes = files::read(file).map_err(|source| MeshFileError::Io { file: file.to_path_buf(), source })?;
    let mut cloud = ply::parse_cloud(&bytes).map_err(|e| wrong(e.line, e.message))?;
    cloud.points.iter_mut().for_each(|p| *p *= scale);
    if let Some(i) = cloud.points.iter().position(|p| p.coords.amax() > MAX_COORDINATE) {
        return Err(wrong(None, format!("point {i} is farther than 1e6 m away, so a scale may be wrong")));
    }
    for normal in cloud.normals.iter_mut().filter(|n| !n.iter().all(|c| c.is_finite())) {
        *normal = Vector3::zeros();
    }
    Ok(cloud)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read_bytes(bytes: &[u8]) -> Result<PointCloud, MeshFileError> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.ply");
        std::fs::write(&file, bytes).unwrap();
        read_cloud(&file, 1.0)
    }

    fn message(text: &str) -> String {
        read_bytes(text.as_bytes()).unwrap_err().to_string().rsplit_once('/').unwrap().1.to_string()
    }

    const HEADER: &str =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n";

    #[test]
    fn mistakes_are_named() {
        let hole = PointCloud { points: vec![Point3::origin(), Point3::new(0.0, f64::NAN, 0.0)], ..Default::default() };
        let refused = read_bytes(&hole.to_ply()).unwrap_err().to_string();
        assert!(refused.contains("a.ply: point 1 is not finite"), "{refused}");
        assert!(message(&format!("{HEADER}0 0 0\n0 nan 0\n")).starts_with("a.ply:9: point 1 is not finite"));
        let normals =
            HEADER.replace("end_header", "property float nx\nproperty float ny\nproperty float nz\nend_header");
        let cloud = read_bytes(format!("{normals}0 0 0 nan nan nan\n0 1 0 0 0 1\n").as_bytes()).unwrap();
        assert_eq!(cloud.normals, [Vector3::zeros(), Vector3::z()]);
        assert!(message(&format!("{HEADER}0 0 0\n0 1e9 0\n")).contains("a scale may be wrong"));
        assert!(message(&HEADER.replace("float y", "float q")).contains("no property y"));
        assert!(message(&HEADER.replace("vertex 2", "vertex 99999999999")).contains("more than the file can hold"));
        assert!(message(&format!("{HEADER}0 0 0\n")).starts_with("a.ply"));
        assert!(read_cloud(Path::new("a.xyz"), 1.0).unwrap_err().to_string().contains(".ply"));
        assert!(read_cloud(Path::new("/nowhere/a.ply"), 1.0).is_err() && read_cloud(Path::new("a.ply"), -1.0).is_err());
    }

    #[test]
    fn a_big_endian_file_with_faces_and_extras_is_read() {
        let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
            property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float confidence\nelement face 1\n\
            property list uchar int vertex_indices\nend_header\n"
            .to_vec();
        for i in 0..2u8 {
            [f32::from(i), 2.0, 3.0].iter().for_each(|c| bytes.extend(c.to_be_bytes()));
            bytes.extend([7, 8, 9 + i]);
            bytes.extend(0.5f32.to_be_bytes());
        }
        bytes.extend([3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]);
        let cloud = read_bytes(&bytes).unwrap();
        assert_eq!(cloud.points[1], Point3::new(1.0, 2.0, 3.0));
        assert_eq!(cloud.colors[1], Rgb([7, 8, 10]));
        assert!(cloud.normals.is_empty());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn what_is_written_is_read_back(
            raw in prop::collection::vec((-1e3..1e3f64, -1.0..1.0f32, any::<u8>()), 1..40), normals: bool, colors: bool,
        ) {
            let normal = |n: f32| Vector3::new(f64::from(n), 1.0, -0.5);
            let cloud = PointCloud {
                points: raw.iter().map(|r| Point3::new(r.0, -2.0 * r.0, 1.0)).collect(),
                normals: if normals { raw.iter().map(|r| normal(r.1)).collect() } else { vec![] },
                colors: if colors { raw.iter().map(|r| Rgb([r.2, 0, 255])).collect() } else { vec![] },
            };
            let bytes = cloud.to_ply();
            prop_assert_eq!(read_bytes(&bytes).unwrap(), cloud);
            let mut text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty double z\nproperty double y\nproperty double x\nend_header\n".to_string();
            text.push_str(&format!("{} {} {}\n", raw[0].0, 1.5, 2.5));
            prop_assert_eq!(read_bytes(text.as_bytes()).unwrap().points[0], Point3::new(2.5, 1.5, raw[0].0));
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300), head in 0..3usize, cut in 0.0..1.0f64) {
            let heads: [&[u8]; 3] = [
                b"",
                b"ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty double x\nproperty float y\nproperty char z\nproperty list uchar float nx\nend_header\n",
                HEADER.as_bytes(),
            ];
            let _ = read_bytes(&[heads[head], &bytes].concat());
            let whole = PointCloud { points: vec![Point3::origin(); 30], ..Default::default() }.to_ply();
            let short = &whole[..(cut * (whole.len() - 1) as f64) as usize];
            prop_assert!(read_bytes(short).is_err());
        }
    }
}
