//! Believed canvases, and the mapping of a drawing onto them.

mod canvas;
mod heights;
mod mapped;
mod projection;
mod scene;
mod shape;
mod touched;

pub use canvas::{BelievedCanvas, Canvas, SheetFrame, TrueCanvas};
pub use heights::{HeightTree, Touch, TouchedSurface};
pub use mapped::{Mapping, SurfaceDrawing, SurfaceLayer, SurfaceStroke, SurfaceTarget};
pub use projection::{MapError, MapFailure, MapProblem, MappingKind, Projection, map_drawing};
pub use scene::{Furniture, Scene, SceneError};
pub use touched::TouchedCanvas;
