//! A serial arm as data: joints, links, inertias, shapes.
use std::sync::Arc;

use nalgebra::{Matrix3, Point3, SVector, Vector3};

use crate::math::{Pose, Rgb};

/// Largest number of joints in a chain: a driven base (3) and a seven-joint arm.
pub const MAX_DOF: usize = 10;

/// A vector over a chain's joints (rad or m, rad/s, N m, ...). Entries past the chain's `dof()` are zero, so that all
/// joint-space algebra is fixed-size and free of allocation.
pub type JointVector = SVector<f64, MAX_DOF>;

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum JointKind {
    /// Turns about its axis (continuous joints have infinite limits).
    Revolute,
    /// Slides along its axis.
    Prismatic,
}

/// One actuated joint.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct JointModel {
    /// URDF name.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Unit axis in the joint's own frame.
    pub axis: Vector3<f64>,
    /// Pose of the joint frame (at q = 0, the frame of the link it moves) in the frame of the link before it.
    pub parent_from_joint: Pose,
    /// Lower limit, rad or m.
    pub lower: f64,
    /// Upper limit, rad or m.
    pub upper: f64,
    /// Speed limit, rad/s or m/s.
    pub velocity: f64,
    /// Torque or force limit, N m or N.
    pub effort: f64,
    /// Viscous friction, N m s/rad.
    pub damping: f64,
    /// Coulomb friction, N m.
    pub friction: f64,
    /// Rotor inertia felt at the joint, kg m2.
    pub armature: f64,
}

/// Mass, centre of mass and inertia of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SpatialInertia {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m, in the link frame.
    pub com: Point3<f64>,
    /// Inertia about the centre of mass, kg m2, axes of the link frame.
    pub inertia: Matrix3<f64>,
}

/// A capsule: all points within `radius` of the segment `a`-`b`, m, in the link frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Capsule {
    /// One end of the axis.
    pub a: Point3<f64>,
    /// The other end.
    pub b: Point3<f64>,
    /// Radius, m.
    pub radius: f64,
}

/// The shape of a visual.
#[derive(Clone, Debug)]
pub enum VisualShape {
    /// Triangles, m, in the visual's frame, shaded by `normals` (one a vertex).
    Mesh {
        /// Vertices.
        vertices: Arc<Vec<Point3<f64>>>,
        /// Triangles, counter-clockwise from outside.
        triangles: Arc<Vec<[u32; 3]>>,
    },
    /// A cylinder along z, centred.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Length, m.
        length: f64,
    },
    /// A sphere, centred.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A box, centred.
    Cuboid {
        /// Edge lengths, m.
        size: Vector3<f64>,
    },
}

/// Something to see on a link.
#[derive(Clone, Debug)]
pub struct Visual {
    /// Pose in the link frame.
    pub link_from_visual: Pose,
    /// Shape.
    pub shape: VisualShape,
    /// Colour.
    pub color: Rgb,
}

/// One rigid link: everything that moves with one joint (links behind fixed joints are merged into it).
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct LinkModel {
    /// URDF name of the first of the merged links.
    pub name: String,
    /// Mass, centre of mass and inertia, in the link frame.
    pub inertia: SpatialInertia,
    /// Collision capsules, in the link frame.
    pub capsules: Vec<Capsule>,
    /// Visuals, in the link frame. They are no part of a saved state.
    #[serde(skip)]
    pub visuals: Vec<Visual>,
}

/// A serial arm with whatever is mounted on its flange.
///
/// Link 0 is the base; joint `i` (0-based) moves link `i + 1`. The tip frame is the pen's: z along the pen axis, out of
/// the nib, towards the canvas.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ArmModel {
    /// Name, as in events and files.
    pub name: String,
    /// Pose of link 0 in the world.
    pub world_from_base: Pose,
    /// Joints from base to tip; at most [`MAX_DOF`].
    pub joints: Vec<JointModel>,
    /// `joints.len() + 1` links.
    pub links: Vec<LinkModel>,
    /// Pose of the tip in the frame of the last link.
    pub last_from_tip: Pose,
}

impl ArmModel {
    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Largest distance of any point of the arm's capsules and tip from each joint's axis, m; 1 of joints that slide. What lies
    /// behind a sliding joint may be as far out as it slides.
    pub fn reach(&self) -> JointVector {
        // a track without ends is taken for a hall
        const HALL: f64 = 100.0;
        let mut reach = JointVector::zeros();
        let mut beyond = self.last_from_tip.translation.vector.norm();
        for i in (0..self.dof()).rev() {
            for c in &self.links[i + 1].capsules {
                beyond = beyond.max(c.radius + c.a.coords.norm().max(c.b.coords.norm()));
            }
            let joint = &self.joints[i];
            reach[i] = match joint.kind {
                JointKind::Revolute => beyond,
                JointKind::Prismatic => {
                    beyond += joint.lower.abs().max(joint.upper.abs()).min(HALL);
                    1.0
                }
            };
            beyond += joint.parent_from_joint.translation.vector.norm();
        }
        reach
    }
}
