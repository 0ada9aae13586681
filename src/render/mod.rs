//! Offscreen pictures of the scene: robots, canvas and the ink that was drawn on it.
//!
//! A [`RenderScene`] is data: surfaces with a material and a pose, ribbons of ink, a floor. A [`Renderer`] puts it on
//! whatever adapter there is, a software driver included, and gives the same bytes each time. Light is a studio's: one
//! soft key light, a weak fill, a sky whose visibility comes from shadow layers all round, and near occlusion from the
//! picture's own depth. Limits: no transparency but ink's, no textures, no reflections of one surface in another.

mod error;
mod gpu;
mod light;
mod passes;
mod renderer;
mod ribbon;
mod scene;
mod shape;
mod tools;
mod view;

pub use error::RenderError;
pub use renderer::{PreparedScene, Renderer};
pub use ribbon::Ribbons;
pub use scene::{ArmVisuals, Item, Material, RenderScene};
pub use shape::{DEFAULT_CREASE, Surface};
pub use tools::{dock_items, hand_items, tool_items};
pub use view::{Framing, NAMED_VIEWS, View};

/// A finished picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Rows from the top, red, green, blue, sRGB: `width * height * 3` bytes.
    pub rgb: Vec<u8>,
}
