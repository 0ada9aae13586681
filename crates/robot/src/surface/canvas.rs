//! A canvas: a mesh in the world and the place on it where the sheet is laid.
use std::ops::Deref;

use crate::math::Pose;
use crate::mesh::TriMesh;

/// Where the sheet floats in front of a canvas: `world_from_sheet` has x right and y up along the sheet, and z out of
/// the canvas towards the artist; orthographic projection goes along -z.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SheetFrame {
    /// World pose of the sheet's centre.
    pub world_from_sheet: Pose,
}

/// A canvas in the world frame.
#[derive(Clone)]
pub struct Canvas {
    /// Name of the scene it came from.
    pub name: String,
    /// Surface, m, world frame.
    pub mesh: TriMesh,
    /// Where the drawing goes.
    pub sheet: SheetFrame,
}

/// The canvas as the robot believes it to be. Planning sees this one alone.
#[derive(Clone)]
pub struct BelievedCanvas(pub Canvas);

impl Deref for BelievedCanvas {
    type Target = Canvas;
    fn deref(&self) -> &Canvas {
        &self.0
    }
}
