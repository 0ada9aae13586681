//! Believed canvases, and the mapping of a drawing onto them.

mod canvas;
mod mapped;
mod projection;
mod scene;
mod shape;

pub use canvas::{BelievedCanvas, Canvas, SheetFrame, TrueCanvas};
pub use mapped::{Mapping, SurfaceDrawing, SurfaceLayer, SurfaceStroke, SurfaceTarget};
pub use projection::{MapError, MapFailure, MapProblem, MappingKind, Projection, map_drawing};
pub use scene::{Furniture, Scene, SceneError};
