//! Why no canvas is made of points.

/// Why no canvas is made of points. The message goes on from the name of the cloud.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReconstructError {
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
    /// A point or a normal is NaN or infinite.
    #[error("point {index} is not finite")]
    NotFinite {
        /// Index of the first such point.
        index: usize,
    },
    /// There are as good as no points where the sheet is.
    #[error("{found} of {all} points lie within the sheet and its margin; at least {needed} are needed there")]
    TooFewPoints {
        /// Points round the sheet.
        found: usize,
        /// Points of the cloud.
        all: usize,
        /// Fewest that are needed.
        needed: usize,
    },
    /// The points span no surface.
    #[error("the points span {extent_mm:.3} mm x {across_mm:.3} mm: that is no surface of {triangle_mm} mm triangles")]
    NoExtent {
        /// Largest extent of the cloud, mm.
        extent_mm: f64,
        /// Extent at right angles to it, mm.
        across_mm: f64,
        /// Desired edge of a triangle, mm.
        triangle_mm: f64,
    },
    /// The points are too many for the triangles, or the triangles too small for the room.
    #[error(
        "triangles of {triangle_mm} mm over the cloud ask for a grid of more than {max} cells; make triangle_mm larger"
    )]
    TooFine {
        /// Desired edge of a triangle, mm.
        triangle_mm: f64,
        /// The limit.
        max: usize,
    },
    /// The points lie so that no surface goes through them.
    #[error("no surface goes through the points behind the sheet's centre: they are too sparse, or too scattered")]
    NoSurface,
}
