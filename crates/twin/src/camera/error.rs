//! Why a scan gives no canvas.
use crate::reconstruct::ReconstructError;

/// Why a scan gives no canvas. The message goes on from the name of the cloud.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// A setting is out of its range.
    #[error("`{name}` of {value} makes no scan; it must be {right}")]
    BadOption {
        /// The setting.
        name: &'static str,
        /// Its value, SI units.
        value: f64,
        /// What would be right.
        right: &'static str,
    },
    /// A camera's eye and target are one place.
    #[error("camera {camera} stands where it looks at: its eye and its target must differ")]
    BadCamera {
        /// Index of the camera.
        camera: usize,
    },
    /// No surface was found in front of the sheet's centre.
    #[error("the scan found no surface behind the sheet's centre: cameras must see it, from {min_range_mm} mm or more")]
    NothingSeen {
        /// Least range of the camera, mm.
        min_range_mm: f64,
    },
    /// No canvas is made of what was seen.
    #[error(transparent)]
    Reconstruct(#[from] ReconstructError),
}
