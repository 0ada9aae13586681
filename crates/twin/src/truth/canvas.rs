//! The canvas as it is.
use std::ops::Deref;

use crate::surface::Canvas;

/// The canvas as it is. Only the physics, the ink and the measurements may see it.
#[derive(Clone)]
pub struct TrueCanvas(pub Canvas);

impl Deref for TrueCanvas {
    type Target = Canvas;
    fn deref(&self) -> &Canvas {
        &self.0
    }
}
