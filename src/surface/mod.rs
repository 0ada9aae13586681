//! Believed canvases, and the mapping of a drawing onto them.

mod canvas;
mod mapped;

pub use canvas::{BelievedCanvas, Canvas, SheetFrame, TrueCanvas};
pub use mapped::{Mapping, SurfaceDrawing, SurfaceLayer, SurfaceStroke, SurfaceTarget};
