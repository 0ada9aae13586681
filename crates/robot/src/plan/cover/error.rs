//! Why a wall can't be covered.
use crate::mesh::MeshError;

/// Why a wall can't be covered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CoverError {
    /// There is no ink.
    #[error("the drawing has no strokes: there is nothing to stand for")]
    NoInk,
    /// A part of the drawing isn't on the wall.
    #[error(
        "layer `{layer}` stroke {stroke} at ({:.1}, {:.1}) mm has no wall behind it: make the drawing smaller or move the sheet",
        at[0] * 1e3, at[1] * 1e3
    )]
    OffWall {
        /// Name of the layer.
        layer: String,
        /// Index of the stroke.
        stroke: usize,
        /// Where on the sheet, m.
        at: [f64; 2],
    },
    /// No place reaches a part of the ink.
    #[error(
        "no place reaches the ink from {:.0} to {:.0} mm along the wall, {:.0} to {:.0} mm over the floor: {missing}",
        along[0] * 1e3, along[1] * 1e3, heights[0] * 1e3, heights[1] * 1e3
    )]
    NoPlace {
        /// Arc lengths of the wall, m.
        along: [f64; 2],
        /// Heights of the ink there, m.
        heights: [f64; 2],
        /// By how much.
        missing: String,
    },
    /// A place by hand collides.
    #[error(
        "the base at place {place} ({:.0}, {:.0} mm, {:.1} deg) meets {what}: move it {:.0} mm away",
        pose[0] * 1e3, pose[1] * 1e3, pose[2].to_degrees(), missing * 1e3
    )]
    Collides {
        /// Which place, from 1.
        place: usize,
        /// Its pose, m and rad.
        pose: [f64; 3],
        /// What it meets.
        what: String,
        /// Room that is missing, m.
        missing: f64,
    },
    /// No way from one place to the next.
    #[error("a base {:.0} mm wide can't drive from place {from} to place {to}{why}", width * 1e3)]
    NoWay {
        /// Which place, from 1.
        from: usize,
        /// Which place, from 1.
        to: usize,
        /// Width of the base with its margins, m.
        width: f64,
        /// What is too narrow.
        why: String,
    },
    /// No way from where the base starts.
    #[error(
        "a base {:.0} mm wide can't drive from where it starts to its first place{why}; start it elsewhere by `base.pose` of the robot",
        width * 1e3
    )]
    NoWayIn {
        /// Width of the base with its margins, m.
        width: f64,
        /// What is too narrow.
        why: String,
    },
    /// Borders don't go with the places.
    #[error("{places} places have {} borders between them, and {borders} are given; they must fall or rise with the places", places.saturating_sub(1))]
    Borders {
        /// Places.
        places: usize,
        /// Borders.
        borders: usize,
    },
    /// What is drawn from a place by hand can't be planned there.
    #[error("from place {place} {length_mm:.0} mm of line can't be drawn: {reason}")]
    NotDrawn {
        /// Which place, from 1.
        place: usize,
        /// Length that can't be drawn, mm.
        length_mm: f64,
        /// Why.
        reason: String,
    },
    /// No cover could be planned.
    #[error(
        "{rounds} covers were tried, and of the last of them {:.0} mm of line between {:.0} and {:.0} mm along the wall can't be drawn: {reason}",
        length * 1e3, along[0] * 1e3, along[1] * 1e3
    )]
    Unplanned {
        /// Covers that were planned.
        rounds: usize,
        /// Arc lengths of the wall between which it lies, m.
        along: [f64; 2],
        /// Length that can't be drawn, m.
        length: f64,
        /// Why.
        reason: String,
    },
    /// A shape can't be made.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}
