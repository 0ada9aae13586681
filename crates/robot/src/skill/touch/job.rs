//! What is to be drawn by touch, and how.
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::drawing::Drawing;
use crate::mesh::TriMesh;
use crate::plan::PlanOptions;
use crate::robot::{ArmModel, JointVector};
use crate::surface::TouchedCanvas;

/// Settings of drawing by touch.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchOptions {
    /// Where the canvas is sought, m over the sheet's plane: lowest and highest.
    pub range: [f64; 2],
    /// Probes along each side of the drawing.
    pub probes: usize,
    /// Speed of a probe, m/s.
    pub probe_speed: f64,
    /// Force along the pen that means contact, N.
    pub contact_force: f64,
    /// Longest piece of a stroke that is planned at once, m.
    pub piece: f64,
    /// Room between travels and the surface as it is believed, m.
    pub clearance: f64,
    /// How far below the believed surface a landing seeks it, m.
    pub seek: f64,
    /// Spacing of the points of a mapped stroke, m.
    pub step: f64,
}

/// How far from where it was expected a stroke met the canvas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrokeTouches {
    /// Index of the layer.
    pub layer: usize,
    /// Index of the stroke.
    pub stroke: usize,
    /// When the stroke ended, s.
    pub time: f64,
    /// Touches known before it.
    pub known: usize,
    /// Predicted less met height, m, touch by touch.
    pub errors: Vec<f64>,
}

/// What is to be drawn by touch, and with what.
pub struct TouchJob {
    /// The drawing.
    pub drawing: Drawing,
    /// What is known of the canvas: where its sheet nominally lies, and nothing of its heights.
    pub canvas: TouchedCanvas,
    /// The arm, as it believes itself to be.
    pub arm: Arc<ArmModel>,
    /// Where it begins at rest, rad.
    pub home: JointVector,
    /// Where pens are changed, and where it ends, rad.
    pub service: JointVector,
    /// What is kept clear of besides the canvas, world.
    pub obstacles: Arc<Vec<TriMesh>>,
    /// Settings of the planner.
    pub options: Arc<PlanOptions>,
    /// Settings of touching.
    pub touch: TouchOptions,
    /// Stiffness of each layer's nib, N/m, as the robot knows its pens.
    pub springs: Vec<f64>,
    /// Whether a person puts in each layer's pen; else whoever carries the tasks out has it fetched.
    pub by_hand: bool,
}
