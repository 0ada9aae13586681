//! Believed canvases, and the mapping of a drawing onto them.

mod canvas;
mod conformal;
mod heights;
mod laid;
mod mapped;
mod projection;
mod random_profile;
mod scene;
mod shape;
mod torn;
mod touched;
mod wall;

pub use canvas::{BelievedCanvas, Canvas, SheetFrame};
pub use conformal::{ConformalMap, FlattenError, FlattenMethod, FlattenOptions, FlattenReport, PatchKind};
pub use heights::{HeightTree, Touch, TouchedSurface};
pub use laid::{MappingKind, StretchField, mapping_of};
pub use mapped::{Mapping, SurfaceDrawing, SurfaceLayer, SurfaceStroke, SurfaceTarget};
pub use projection::{MapError, MapFailure, MapProblem, Projection, map_drawing};
pub use scene::{Furniture, Scene, SceneError};
pub use torn::map_what_fits;
pub use touched::TouchedCanvas;
pub use wall::Wall;
