//! An arm with a hand on its flange, empty or with a tool in it, as one rigid arm: what planners and the drawing law work with.
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{HandModel, PALM_FACE};
use crate::math::{Pose, Rgb};
use crate::mesh::MeshError;
use crate::robot::{ArmModel, Capsule, SpatialInertia, Visual, VisualShape};
use crate::tool::{ConvexPart, ToolSet, mesh_of};

/// Colour of palm and knuckles.
const DARK: Rgb = Rgb([52, 54, 58]);
/// Colour of the phalanges.
const STEEL: Rgb = Rgb([150, 153, 158]);
/// Colour of a tool's body.
const SHELL: Rgb = Rgb([226, 224, 218]);

/// The grip frame of a hand on the tip frame of `arm` (z out of the flange), seen from its last link. The hand's z points up where
/// the flange's y does.
pub fn last_from_grip(arm: &ArmModel, hand: &HandModel) -> Pose {
    // columns: where x, y, z of the grip frame point in the flange's
    let turn = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    arm.last_from_tip * Isometry3::from_parts(Vector3::new(0.0, 0.0, hand.mount).into(), turn)
}

/// Pose of a perfectly held tool in the grip frame: back on the palm, plates on the fingers.
pub fn grip_from_held(set: &ToolSet) -> Pose {
    Pose::translation(PALM_FACE, 0.0, -set.tool.plates.map_or(0.0, |p| p.gap))
}

/// The pen's tip frame in a tool's: z out of the nib, which is downwards.
pub fn tool_from_pen(set: &ToolSet) -> Pose {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Isometry3::from_parts(Translation3::from(set.tool.pen_tip().coords), down)
}

/// `arm` with a hand whose fingers stand at `joints` (rad); its tip is the grip frame.
pub fn with_hand(arm: &ArmModel, hand: &HandModel, joints: &[[f64; 3]; 3]) -> ArmModel {
    with_hand_at(arm, hand, &Pose::identity(), joints)
}

/// The same with the grip frame at `error` in the designed one.
pub fn with_hand_at(arm: &ArmModel, hand: &HandModel, error: &Pose, joints: &[[f64; 3]; 3]) -> ArmModel {
    let last_from_grip = last_from_grip(arm, hand) * error;
    let mut arm = arm.clone();
    arm.last_from_tip = last_from_grip;
    let Some(last) = arm.links.last_mut() else { return arm };
    last.inertia = last.inertia.joined(&hand.inertia(joints).seen_from(&last_from_grip));
    for (i, (pose, half)) in hand.boxes(joints).into_iter().enumerate() {
        let link_from_visual = last_from_grip * pose;
        last.capsules.push(enclosing(&half).seen_from(&link_from_visual));
        let color = if hand.is_phalanx(i) { STEEL } else { DARK };
        last.visuals.push(Visual { link_from_visual, shape: VisualShape::Cuboid { size: half * 2.0 }, color });
    }
    arm
}

/// `arm` with a hand whose fingers stand at `joints` (rad), round a tool at `grip_from_tool`, with a pen of the given colour. Its tip
/// is the pen's: z out of the nib.
///
/// # Errors
/// None of a design that was read from a file.
pub fn holding(
    arm: &ArmModel,
    hand: &HandModel,
    joints: &[[f64; 3]; 3],
    set: &ToolSet,
    grip_from_tool: &Pose,
    pen: Rgb,
) -> Result<ArmModel, MeshError> {
    let arm = with_hand(arm, hand, joints);
    let last_from_tool = arm.last_from_tip * grip_from_tool;
    holding_at(arm, set, &last_from_tool, pen)
}

/// An arm with a hand, and in it a tool at `last_from_tool` in the frame of the last link, with a pen of the given colour.
///
/// # Errors
/// None of a design that was read from a file.
pub fn holding_at(mut arm: ArmModel, set: &ToolSet, last_from_tool: &Pose, pen: Rgb) -> Result<ArmModel, MeshError> {
    arm.last_from_tip = last_from_tool * tool_from_pen(set);
    let Some(last) = arm.links.last_mut() else { return Ok(arm) };
    last.inertia = last.inertia.joined(&tool_inertia(set).seen_from(last_from_tool));
    last.capsules.extend(tool_capsules(set).iter().map(|c| c.seen_from(last_from_tool)));
    last.visuals.extend(tool_visuals(set, pen)?.into_iter().map(|mut v| {
        v.link_from_visual = last_from_tool * v.link_from_visual;
        v
    }));
    Ok(arm)
}

/// A tool as one sees it: body, and a pen of the given colour. Tool frame.
///
/// # Errors
/// None of a design that was read from a file.
pub fn tool_visuals(set: &ToolSet, pen: Rgb) -> Result<Vec<Visual>, MeshError> {
    let seen = |parts: &[ConvexPart], color| {
        let mesh = mesh_of(parts)?;
        let shape = VisualShape::Mesh {
            vertices: mesh.vertices().to_vec().into(),
            triangles: mesh.triangles().to_vec().into(),
        };
        Ok(Visual { link_from_visual: Pose::identity(), shape, color })
    };
    let parts = set.tool.parts();
    // a collar of the pen's colour under the body tells which pen it is from afar
    let (body, nose) = parts.split_at(parts.len() - 2);
    Ok(vec![seen(body, SHELL)?, seen(nose, pen)?, seen(&[set.tool.pen()], pen)?])
}

/// Mass properties of the solids of a tool, tool frame.
fn tool_inertia(set: &ToolSet) -> SpatialInertia {
    let density = set.tool.density();
    let mut sum = SpatialInertia::massless();
    for part in set.tool.parts() {
        let (volume, first, second) = part.moments();
        let (mass, com) = (density * volume, first / volume);
        // about the centre of mass: I = tr(C) 1 - C of the central second moment C
        let central = second * density - com * com.transpose() * mass;
        let inertia = Matrix3::identity() * central.trace() - central;
        sum = sum.joined(&SpatialInertia { mass, com: Point3::from(com), inertia });
    }
    sum
}

/// The smallest capsule along the longest side of a box, with a twentieth to spare, box frame.
fn enclosing(half: &Vector3<f64>) -> Capsule {
    let long = half.imax();
    let (mut across, mut axis) = (*half, Vector3::zeros());
    across[long] = 0.0;
    let radius = 1.05 * across.norm();
    // as far out as the corners need
    axis[long] = (half[long] - (radius * radius - across.norm_squared()).sqrt()).max(0.0);
    Capsule { a: Point3::from(-axis), b: Point3::from(axis), radius }
}

/// Capsules round a tool, tool frame; the last is the pen's and ends at the nib.
fn tool_capsules(set: &ToolSet) -> Vec<Capsule> {
    let t = &set.tool;
    let front = t.bevel.map_or(t.flat + 0.3 * t.width, |b| t.flat + 0.5 * (t.width - b.front_width) / b.angle.tan());
    let body = Vector3::new(0.5 * front, 0.5 * t.width, 0.5 * t.height);
    let mut capsules = vec![enclosing(&body).seen_from(&Pose::translation(0.5 * front, 0.0, 0.0))];
    if let Some(p) = &t.plates {
        let half = Vector3::new(0.5 * (t.flat - t.back_chamfer), 0.5 * p.reach, 0.5 * p.thickness);
        for (side, top) in [(1.0, p.finger_top), (-1.0, p.thumb_top)] {
            let middle =
                [0.5 * (t.flat + t.back_chamfer), side * 0.5 * (t.width + p.reach), top + p.gap + 0.5 * p.thickness];
            let pose = Pose::translation(middle[0], middle[1], middle[2]);
            capsules.push(enclosing(&half).seen_from(&pose));
        }
    }
    let (n, low) = (&t.nose, t.nose_end());
    let along = |top: f64, bottom: f64, radius: f64| Capsule {
        a: Point3::new(n.axis, 0.0, top),
        b: Point3::new(n.axis, 0.0, bottom + radius),
        radius,
    };
    let seat = low + n.cone;
    capsules.push(along(-0.5 * t.height, seat, n.stem_radius));
    capsules.push(along(seat, low, 0.5 * (n.stem_radius + n.tip_radius)));
    capsules.push(along(low, t.pen_tip().z, n.pen_radius));
    capsules
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{UrdfOptions, urdf};
    use std::path::Path;

    fn ur5e() -> ArmModel {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/ur5e.urdf");
        let options = UrdfOptions {
            base_link: Some("base_link".into()),
            tip_link: Some("tool0".into()),
            ..UrdfOptions::default()
        };
        urdf::load(&file, &options).unwrap()
    }

    #[test]
    fn the_pen_hangs_under_the_hand() {
        let (set, hand) = (ToolSet::pen_tool().unwrap(), HandModel::robotiq_3f());
        let arm = ur5e();
        let held =
            holding(&arm, &hand, &[[0.5, 0.0, -0.5]; 3], &set, &grip_from_held(&set), Rgb([200, 30, 30])).unwrap();
        let grip = last_from_grip(&arm, &hand);
        let tip = grip.inverse() * held.last_from_tip;
        let z = tip.rotation * Vector3::z();
        assert!((z + Vector3::z()).norm() < 1e-12, "{z}");
        let p = tip.translation.vector;
        assert!((p.x - PALM_FACE - set.tool.nose.axis).abs() < 1e-12 && p.y.abs() < 1e-12 && p.z < -0.12, "{p}");
        // hand and tool weigh what they weigh
        let [bare, full] = [&arm, &held].map(|a| a.links.last().unwrap().inertia.mass);
        assert!((full - bare - 2.3 - 0.25).abs() < 0.01, "{}", full - bare);
        assert!(held.links.last().unwrap().inertia.defect().is_none());
        // the last capsule ends at the nib, and nothing else comes near it
        let nib = Point3::from(held.last_from_tip.translation.vector);
        let capsules = &held.links.last().unwrap().capsules;
        let gap = |c: &Capsule| crate::robot::segment_distance(&c.a, &c.b, &nib, &nib) - c.radius;
        assert!(gap(capsules.last().unwrap()).abs() < 1e-9);
        assert!(capsules.iter().rev().skip(1).all(|c| gap(c) > 0.013));
    }

    #[test]
    fn a_box_has_the_inertia_of_a_box() {
        let part = ConvexPart::prism(&[[0.1, 0.0], [0.5, 0.0], [0.5, 0.2], [0.1, 0.2]], -0.1, 0.5);
        let (volume, first, second) = part.moments();
        assert!((volume - 0.048).abs() < 1e-12);
        let com = first / volume;
        assert!((com - Vector3::new(0.3, 0.1, 0.2)).norm() < 1e-12);
        let central = second / volume - com * com.transpose();
        let wanted = Matrix3::from_diagonal(&(Vector3::new(0.16, 0.04, 0.36) / 12.0));
        assert!((central - wanted).norm() < 1e-12);
    }

    #[test]
    fn capsules_enclose_their_boxes() {
        for half in [Vector3::new(0.05, 0.02, 0.01), Vector3::new(0.01, 0.01, 0.01), Vector3::new(0.02, 0.03, 0.025)] {
            let c = enclosing(&half);
            let corner = Point3::from(half);
            let distance = crate::robot::segment_distance(&c.a, &c.b, &corner, &corner);
            assert!(distance <= c.radius + 1e-12, "{half}");
        }
    }
}
