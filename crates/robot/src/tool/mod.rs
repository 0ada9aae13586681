//! Pen tools and docks: parameters to shapes.
//!
//! The tool is the pen holder of the dissertation (section VII.B.1, figure 7.5), which a three-finger gripper finds by its shape
//! alone: flat sides turn it, plates over the fingers level it, front bevels push its flat back against the palm, and its cone nose
//! slides to the bottom of a rounded concave dock, where a seal keeps the pen from drying.
//!
//! Tool frame: x out of the palm, y across from thumb to fingers, z up; the pen points along -z. The origin lies in the
//! flat back, at the height of the gripper's middle. A dock's frame is that of a tool seated in it.

mod convex;
mod design;
mod dock;
mod pen_tool;

pub use convex::{ConvexPart, mesh_of};
pub use design::{Bevel, DockDesign, Nose, Plates, Seal, ToolDesign, ToolSet};
