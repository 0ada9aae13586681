//! Arms of a robot that stand still while others draw, and what a drawing arm keeps clear of.
use nalgebra::{Translation3, Vector3};

use crate::math::{Pose, frame_from_axes};
use crate::mesh::{TriMesh, shapes};
use crate::robot::{Arm, ArmModel, Capsule, Cell, JointVector, VisualShape};
use crate::run::RunError;

/// Edge of the triangles of a standing arm's capsules, m.
const TRIANGLE: f64 = 0.05;

/// Index of the arm called `name`; without a name that of a robot's only arm.
pub(crate) fn arm_index(cell: &Cell, name: Option<&str>) -> Result<usize, RunError> {
    let names = || cell.arms.iter().map(|a| a.model.name.as_str()).collect::<Vec<_>>().join(", ");
    match name {
        None if cell.arms.len() == 1 => Ok(0),
        None => Err(RunError::WhichArm { robot: cell.name.clone(), arms: names() }),
        Some(name) => cell.arms.iter().position(|a| a.model.name == name).ok_or_else(|| RunError::NoSuchArm {
            robot: cell.name.clone(),
            name: name.to_string(),
            arms: names(),
        }),
    }
}

/// The robot's furniture, and the arms of `standing`, each in its service pose, as solids (m, world).
pub(crate) fn solids<'a>(cell: &Cell, standing: impl IntoIterator<Item = &'a Arm>) -> Result<Vec<TriMesh>, RunError> {
    let mut solids = Vec::new();
    for (index, thing) in cell.furniture.iter().enumerate() {
        // a robot file knows no other furniture than boxes
        let VisualShape::Cuboid { size } = &thing.shape else { continue };
        let mesh = shapes::cuboid(size, size.max()).map_err(|source| RunError::Furniture {
            robot: cell.name.clone(),
            index,
            source,
        })?;
        solids.push(mesh.transformed(&thing.link_from_visual));
    }
    for arm in standing {
        solids.extend(at_rest(&arm.model, &arm.service)?);
    }
    Ok(solids)
}

/// `arm` at joints `q` as solids, world.
pub(super) fn at_rest(arm: &ArmModel, q: &JointVector) -> Result<Vec<TriMesh>, RunError> {
    let unfit = |source| RunError::StandingArm { arm: arm.name.clone(), source };
    let solid = |c: Capsule| {
        let along = c.b - c.a;
        let axis = along.try_normalize(1e-9).unwrap_or_else(Vector3::z);
        let middle = Translation3::from(c.a.coords + 0.5 * along);
        let pose = Pose::from_parts(middle, frame_from_axes(&axis, &Vector3::x()));
        Ok(shapes::capsule(c.radius, along.norm(), TRIANGLE.min(c.radius)).map_err(unfit)?.transformed(&pose))
    };
    arm.capsules(&arm.kinematics(q), 0).map(solid).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{PenUse, PlanOptions, Surroundings};
    use std::path::Path;

    #[test]
    fn two_arms_are_clear_of_each_other_of_themselves_and_of_their_stand() {
        let cell = Cell::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("robots/dual_ur5e.toml")).unwrap();
        assert_eq!(cell.arms.len(), 2);
        let far = shapes::rectangle(0.1, 0.1, 0.0, 0.1).unwrap().transformed(&Pose::translation(0.0, 0.0, -5.0));
        let tips: Vec<_> = cell.arms.iter().map(|a| *a.model.kinematics(&a.home).world_from_tip()).collect();
        for (i, tip) in tips.iter().enumerate() {
            let (arm, other) = (&cell.arms[i], &cell.arms[1 - i]);
            let solids = solids(&cell, [other]).unwrap();
            let around = Surroundings::new(&arm.model, &far, &solids, &PlanOptions::default());
            for (pose, q) in [("home", &arm.home), ("service", &arm.service)] {
                let clearance = around.clearance(&arm.model.kinematics(q), PenUse::Travelling);
                assert!(clearance.is_clear(), "{} {pose}: {clearance:?}", arm.model.name);
            }
            // both look at one canvas ahead
            assert!((tip * Vector3::z() - Vector3::x()).norm() < 0.01, "{}", tip);
            assert!((tip.translation.x - 0.6).abs() < 0.005, "{}", tip);
            let parked = arm.model.kinematics(&arm.service).world_from_tip().translation.vector;
            assert!(parked.y.abs() > 0.7, "{parked}");
        }
        assert!((tips[0].translation.y + tips[1].translation.y).abs() < 1e-3, "they are mirror images");
        // at home the two don't meet either
        let [left, right] = [0, 1].map(|i| {
            let arm = &cell.arms[i];
            arm.model.capsules(&arm.model.kinematics(&arm.home), 0).collect::<Vec<_>>()
        });
        for (a, b) in left.iter().flat_map(|a| right.iter().map(move |b| (a, b))) {
            assert!(a.distance(b) > 0.1);
        }
    }

    #[test]
    fn an_arm_of_several_must_be_named() {
        let cell = Cell::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("robots/dual_ur5e.toml")).unwrap();
        assert_eq!(arm_index(&cell, Some("right")).unwrap(), 1);
        let say = |name| arm_index(&cell, name).unwrap_err().to_string();
        assert!(say(None).contains("left, right") && say(Some("middle")).contains("middle"));
    }
}
