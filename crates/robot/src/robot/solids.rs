//! A robot's furniture and arms that stand still, as solids that a drawing arm keeps clear of.
use nalgebra::{Translation3, Vector3};

use crate::math::{Pose, frame_from_axes};
use crate::mesh::{TriMesh, shapes};
use crate::robot::{Arm, ArmModel, Capsule, Cell, JointVector, RobotError, VisualShape};

/// Edge of the triangles of a standing arm's capsules, m.
const TRIANGLE: f64 = 0.05;

impl Cell {
    /// Index of the arm called `name`; without a name that of a robot's only arm.
    ///
    /// # Errors
    /// There is no arm of that name, or there are several and none is named.
    pub fn arm_index(&self, name: Option<&str>) -> Result<usize, RobotError> {
        let names = || self.arms.iter().map(|a| a.model.name.as_str()).collect::<Vec<_>>().join(", ");
        match name {
            None if self.arms.len() == 1 => Ok(0),
            None => Err(RobotError::WhichArm { robot: self.name.clone(), arms: names() }),
            Some(name) => self.arms.iter().position(|a| a.model.name == name).ok_or_else(|| RobotError::NoSuchArm {
                robot: self.name.clone(),
                name: name.to_string(),
                arms: names(),
            }),
        }
    }

    /// The robot's furniture, and the arms of `parked`, each in its service pose, as solids, m, world.
    ///
    /// # Errors
    /// A shape that makes no solid.
    pub fn solids<'a>(&self, parked: impl IntoIterator<Item = &'a Arm>) -> Result<Vec<TriMesh>, RobotError> {
        let mut solids = Vec::new();
        for (index, thing) in self.furniture.iter().enumerate() {
            // a robot file knows no other furniture than boxes
            let VisualShape::Cuboid { size } = &thing.shape else { continue };
            let mesh = shapes::cuboid(size, size.max()).map_err(|source| RobotError::Furniture {
                robot: self.name.clone(),
                index,
                source,
            })?;
            solids.push(mesh.transformed(&thing.link_from_visual));
        }
        for arm in parked {
            solids.extend(arm.model.solids_at(&arm.service)?);
        }
        Ok(solids)
    }
}

impl ArmModel {
    /// The arm at joints `q` (rad) as solids, m, world.
    ///
    /// # Errors
    /// A capsule that makes no solid.
    pub fn solids_at(&self, q: &JointVector) -> Result<Vec<TriMesh>, RobotError> {
        let unfit = |source| RobotError::StandingArm { arm: self.name.clone(), source };
        let solid = |c: Capsule| {
            let along = c.b - c.a;
            let axis = along.try_normalize(1e-9).unwrap_or_else(Vector3::z);
            let middle = Translation3::from(c.a.coords + 0.5 * along);
            let pose = Pose::from_parts(middle, frame_from_axes(&axis, &Vector3::x()));
            Ok(shapes::capsule(c.radius, along.norm(), TRIANGLE.min(c.radius)).map_err(unfit)?.transformed(&pose))
        };
        self.capsules(&self.kinematics(q), 0).map(solid).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn an_arm_of_several_must_be_named() {
        let cell = Cell::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/dual_ur5e.toml")).unwrap();
        assert_eq!(cell.arm_index(Some("right")).unwrap(), 1);
        let say = |name| cell.arm_index(name).unwrap_err().to_string();
        assert!(say(None).contains("left, right") && say(Some("middle")).contains("middle"));
    }
}
