//! The canvas as it is.
use crate::mesh::TriMesh;
use crate::surface::{Canvas, SheetFrame};

/// The canvas as it is. Only the physics, the ink and the measurements may see it.
#[derive(Clone)]
pub struct TrueCanvas(Canvas);

impl TrueCanvas {
    pub(super) fn new(canvas: Canvas) -> Self {
        Self(canvas)
    }

    /// A canvas that is as somebody made it.
    pub fn nominal(canvas: Canvas) -> Self {
        Self(canvas)
    }

    /// Its surface, m, world.
    pub fn mesh(&self) -> &TriMesh {
        &self.0.mesh
    }

    /// Where the sheet is on it.
    pub fn sheet(&self) -> &SheetFrame {
        &self.0.sheet
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// The same as a plain canvas, for who measures on it.
    pub fn reveal(&self) -> &Canvas {
        &self.0
    }
}
