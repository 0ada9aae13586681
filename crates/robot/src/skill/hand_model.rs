//! The Robotiq 3-finger gripper as numbers: joints, limits, phalanges.
//!
//! Frames and limits are Robotiq's published "articulated" model (ros-industrial/robotiq, BSD); `robots/robotiq_3f.urdf` has the
//! same numbers, and a test holds the two together. Grip frame: x out of the palm, y across from the thumb to the fingers, z
//! up; its origin is the palm's. Published finger inertias are infeasible: those here follow from shape and mass.
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::math::Pose;
use crate::robot::SpatialInertia;

/// A box, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxShape {
    /// Pose of its centre in the frame of its link.
    pub link_from_box: Pose,
    /// Half its edges, m.
    pub half: Vector3<f64>,
}

impl BoxShape {
    /// The box between two corners of a frame that is turned by `turn` (rad) about z of the link.
    fn between(low: [f64; 3], high: [f64; 3], turn: f64) -> Self {
        let (low, high) = (Vector3::from(low), Vector3::from(high));
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let centre = turn * ((low + high) * 0.5);
        Self { link_from_box: Isometry3::from_parts(Translation3::from(centre), turn), half: (high - low) * 0.5 }
    }

    /// Inertia of a solid box of this mass (kg), link frame: `m / 3 (b^2 + c^2)` about each axis, with half edges b and c.
    pub fn inertia(&self, mass: f64) -> SpatialInertia {
        let s = self.half.component_mul(&self.half);
        let own = Matrix3::from_diagonal(&(Vector3::new(s.y + s.z, s.x + s.z, s.x + s.y) * (mass / 3.0)));
        let r: Rotation3<f64> = self.link_from_box.rotation.to_rotation_matrix();
        let com = Point3::from(self.link_from_box.translation.vector);
        SpatialInertia { mass, com, inertia: r.matrix() * own * r.matrix().transpose() }
    }
}

/// One link of a finger and the joint that moves it. The joint turns about z of its frame but for the scissor's, which
/// turns about y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phalanx {
    /// Pose of the joint's frame in the link before, at 0.
    pub parent_from_joint: Pose,
    /// Lower and upper limit, rad.
    pub limits: [f64; 2],
    /// Mass, kg.
    pub mass: f64,
    /// Its shape: what collides, and what its inertia is made of.
    pub shape: BoxShape,
}

/// A finger: the link that the scissor turns (it stands still on the thumb) and three phalanges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerModel {
    /// The knuckle; its joint is the scissor, or stands still when its limits are both 0.
    pub knuckle: Phalanx,
    /// Proximal, medial and distal phalanx.
    pub phalanges: [Phalanx; 3],
    /// Sign of the scissor angle that spreads this finger outwards; 0 of the thumb.
    pub spread: f64,
    /// Torque of this finger in units of a finger's: the thumb balances two.
    pub strength: f64,
}

/// The gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct HandModel {
    /// Upper finger, lower finger, thumb.
    pub fingers: [FingerModel; 3],
    /// Mass of the palm, kg.
    pub palm_mass: f64,
    /// Shape of the palm; its face at positive x touches the tool.
    pub palm: BoxShape,
    /// From the mounting face to the palm's origin, m.
    pub mount: f64,
}

/// Names of the URDF's fingers, in the order of [`HandModel::fingers`].
pub const FINGER_NAMES: [&str; 3] = ["finger_1", "finger_2", "finger_middle"];

/// From the line between joints to the face that grips, m.
pub(crate) const PAD: f64 = 7.9e-3;
/// Half the width of a phalanx, m.
pub(crate) const HALF_WIDTH: f64 = 15.4e-3;
/// Thickness of a phalanx behind the line between joints, m.
const BACK: f64 = 11e-3;
/// Angle of the line from the first joint to the second in the frame of the proximal phalanx, rad: `atan(28 / 50)`.
pub(crate) const PROXIMAL_ANGLE: f64 = 0.510_488_3;
/// Turn of the medial phalanx against the proximal one, and of the distal pad against its link, rad, as published.
const MEDIAL_ANGLE: f64 = 0.52;
/// Length of the line from the first joint to the second, m.
pub(crate) const PROXIMAL_LENGTH: f64 = 0.057_306_2;
/// From the second joint to the third, m.
const MEDIAL_LENGTH: f64 = 0.039;
/// From the third joint to the end of the pad, m.
const DISTAL_LENGTH: f64 = 0.038;
/// Published masses of the parts sum to 2.128 kg, the data sheet says 2.3 kg: every part is scaled alike.
const MASS_SCALE: f64 = 2.3 / 2.128;

fn pose(xyz: [f64; 3], rotation: UnitQuaternion<f64>) -> Pose {
    Isometry3::from_parts(Translation3::from(Vector3::from(xyz)), rotation)
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

impl HandModel {
    /// The Robotiq 3-finger adaptive gripper.
    // a limit is what was published, not a quarter of a turn
    #[allow(clippy::approx_constant)]
    pub fn robotiq_3f() -> Self {
        // x along the approach, y inwards: the thumb stands at -y of the grip frame, the fingers at +y
        let inwards = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let finger = |y: f64, z: f64, scissor: [f64; 2], spread: f64, strength: f64| {
            let turn = if y > 0.0 { inwards } else { UnitQuaternion::identity() };
            FingerModel {
                knuckle: Phalanx {
                    parent_from_joint: pose([0.0214, y, z], turn),
                    limits: scissor,
                    mass: 0.1 * MASS_SCALE,
                    shape: BoxShape::between([-0.0168, -0.0143, -HALF_WIDTH], [0.0263, 0.02, HALF_WIDTH], 0.0),
                },
                phalanges: [
                    Phalanx {
                        parent_from_joint: pose([0.02, 0.0, 0.0], UnitQuaternion::identity()),
                        limits: [0.0495, 1.2218],
                        mass: 0.0888 * MASS_SCALE,
                        shape: BoxShape::between(
                            [0.004, -BACK, -HALF_WIDTH],
                            [PROXIMAL_LENGTH - 0.004, PAD, HALF_WIDTH],
                            -PROXIMAL_ANGLE,
                        ),
                    },
                    Phalanx {
                        parent_from_joint: pose([0.05, -0.028, 0.0], about_z(-MEDIAL_ANGLE)),
                        limits: [0.0, 1.5708],
                        mass: 0.0501 * MASS_SCALE,
                        shape: BoxShape::between([0.0036, -BACK, -HALF_WIDTH], [MEDIAL_LENGTH, PAD, HALF_WIDTH], 0.0),
                    },
                    Phalanx {
                        parent_from_joint: pose([MEDIAL_LENGTH, 0.0, 0.0], UnitQuaternion::identity()),
                        limits: [-1.2217, -0.0523],
                        mass: 0.0371 * MASS_SCALE,
                        shape: BoxShape::between(
                            [0.0, -BACK, -HALF_WIDTH],
                            [DISTAL_LENGTH, PAD, HALF_WIDTH],
                            MEDIAL_ANGLE,
                        ),
                    },
                ],
                spread,
                strength,
            }
        };
        Self {
            fingers: [
                finger(0.0455, 0.036, [-0.192, 0.192], 1.0, 1.0),
                finger(0.0455, -0.036, [-0.192, 0.192], -1.0, 1.0),
                finger(-0.0455, 0.0, [0.0, 0.0], 0.0, 2.0),
            ],
            palm_mass: 1.3 * MASS_SCALE,
            palm: BoxShape::between([-0.054, -0.036, -0.053], [PALM_FACE, 0.036, 0.053], 0.0),
            mount: 0.054,
        }
    }

    /// Angle of the first joints, rad, at which the pads of fingers and thumb stand `gap` m apart, the medial phalanges straight
    /// on: `gap = 2 (base - pad - l1 sin(q1 - q_flat))`, with the base's distance from the middle and `l1` to the second joint.
    pub fn close_angle(&self, gap: f64) -> f64 {
        let base = self.fingers[0].knuckle.parent_from_joint.translation.vector.y;
        PROXIMAL_ANGLE + ((base - PAD - 0.5 * gap) / PROXIMAL_LENGTH).clamp(-0.9, 0.9).asin()
    }

    /// Between the pads of the open hand, m: a wider tool doesn't go in.
    pub fn widest(&self) -> f64 {
        let base = self.fingers[0].knuckle.parent_from_joint.translation.vector.y;
        2.0 * (base - PAD - PROXIMAL_LENGTH * (super::OPEN - PROXIMAL_ANGLE).sin())
    }

    /// Centre pose in the grip frame and half edges (m) of every box of the hand with its fingers at `joints` (rad): the palm, then
    /// each finger's knuckle and phalanges.
    pub fn boxes(&self, joints: &[[f64; 3]; 3]) -> Vec<(Pose, Vector3<f64>)> {
        let mut boxes = vec![(self.palm.link_from_box, self.palm.half)];
        for (finger, q) in self.fingers.iter().zip(joints) {
            let mut at = finger.knuckle.parent_from_joint;
            boxes.push((at * finger.knuckle.shape.link_from_box, finger.knuckle.shape.half));
            for (phalanx, angle) in finger.phalanges.iter().zip(q) {
                at = at * phalanx.parent_from_joint * Isometry3::from_parts(Translation3::identity(), about_z(*angle));
                boxes.push((at * phalanx.shape.link_from_box, phalanx.shape.half));
            }
        }
        boxes
    }

    /// Whether box `i` of [`boxes`](Self::boxes) is a phalanx: not the palm or a knuckle.
    pub fn is_phalanx(&self, i: usize) -> bool {
        i > 0 && !(i - 1).is_multiple_of(4)
    }

    /// The palm and the knuckles that stand still on it as one body in the grip frame: what fingers move against.
    pub fn base_inertia(&self) -> SpatialInertia {
        let fixed = self.fingers.iter().filter(|f| f.spread == 0.0).map(|f| &f.knuckle);
        fixed.fold(self.palm.inertia(self.palm_mass), |sum, k| {
            sum.joined(&k.shape.inertia(k.mass).seen_from(&k.parent_from_joint))
        })
    }

    /// The whole hand as one body in the grip frame with its fingers at the given joint angles (rad): what an arm's controller
    /// knows of it.
    pub fn inertia(&self, joints: &[[f64; 3]; 3]) -> SpatialInertia {
        let mut sum = self.palm.inertia(self.palm_mass);
        for (finger, q) in self.fingers.iter().zip(joints) {
            let mut at = finger.knuckle.parent_from_joint;
            sum = sum.joined(&finger.knuckle.shape.inertia(finger.knuckle.mass).seen_from(&at));
            for (phalanx, angle) in finger.phalanges.iter().zip(q) {
                at = at * phalanx.parent_from_joint * Isometry3::from_parts(Translation3::identity(), about_z(*angle));
                sum = sum.joined(&phalanx.shape.inertia(phalanx.mass).seen_from(&at));
            }
        }
        sum
    }
}

/// Height of the palm's face over its origin, m.
pub const PALM_FACE: f64 = 0.0508;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_weighs_what_its_data_sheet_says() {
        let hand = HandModel::robotiq_3f();
        let body = hand.inertia(&[[0.0495, 0.0, -0.0523]; 3]);
        assert!((body.mass - 2.3).abs() < 0.01, "{}", body.mass);
        assert!(body.defect().is_none());
    }

    #[test]
    fn palm_and_moving_parts_weigh_as_much_as_the_hand() {
        let hand = HandModel::robotiq_3f();
        let moving: f64 = hand
            .fingers
            .iter()
            .map(|f| {
                let knuckle = if f.spread == 0.0 { 0.0 } else { f.knuckle.mass };
                knuckle + f.phalanges.iter().map(|p| p.mass).sum::<f64>()
            })
            .sum();
        let whole = hand.inertia(&[[0.0495, 0.0, -0.0523]; 3]).mass;
        assert!((hand.base_inertia().mass + moving - whole).abs() < 1e-12);
    }

    #[test]
    fn the_flat_tool_is_closed_on_where_the_phalanges_lie_in_one_plane() {
        let hand = HandModel::robotiq_3f();
        assert!((hand.close_angle(0.0752) - PROXIMAL_ANGLE).abs() < 1e-9);
        assert!(hand.close_angle(0.076) < PROXIMAL_ANGLE);
    }
}
