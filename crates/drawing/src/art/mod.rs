//! Artwork: from a picture to pen strokes on a sheet.
//!
//! Every generator is a pure function of the picture in inks, the sheet, the pens' widths, its options and a seed, and gives
//! an [`Artwork`]. Sheet coordinates are those of [`crate::drawing`]: m, x right, y up, origin at the centre.

mod brush;
pub mod depth;
mod dots;
mod edges;
mod error;
mod flow;
mod hatch_lines;
mod hatching;
mod ink_order;
mod painterly;
mod placement;
mod screen;
pub mod stipple;
mod stripes;
mod tsp;
mod voronoi;
mod wash;

pub use brush::{BrushFill, PenBrush};
pub use dots::{DotOptions, dot_art};
pub use edges::{EdgeOptions, edges};
pub use error::ArtError;
pub use flow::{Flow, FlowOptions};
pub use hatching::{HatchOptions, hatching};
pub use ink_order::{InkOrder, OrderReport, arrange, shorten_travel};
pub use painterly::{PainterlyOptions, PainterlyStyle, painterly};
pub use placement::Placement;
pub use stipple::{Dot, DotCount, StippleOptions, stipple};
pub use tsp::{TspOptions, tsp_art};

use crate::drawing::Drawing;
use crate::picture::Image;

/// What a generator made.
#[derive(Clone, Debug)]
pub struct Artwork {
    /// The strokes.
    pub drawing: Drawing,
    /// Pictures that show how it came about: separations, segments, frames.
    pub plates: Vec<Plate>,
    /// What a user should read once, such as that a depth map is an estimate.
    pub notes: Vec<String>,
}

/// A picture of a step on the way.
#[derive(Clone, Debug)]
pub struct Plate {
    /// File name without extension: `separation-cyan`.
    pub name: String,
    /// What it shows.
    pub caption: String,
    /// The picture.
    pub image: Image,
}

/// The sheet that a picture is drawn on, and the pen's line on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// Width, m.
    pub width: f64,
    /// Height, m.
    pub height: f64,
}
