//! What takes part in a run: the robot, the scene, the drawing and its pens, loaded from the files that a scenario names.
use std::sync::Arc;

use super::RunError;
use crate::canvas::scene_of;
use crate::drawing::Drawing;
use crate::measure::TruthMetrics;
use crate::mesh::TriMesh;
use crate::pen::LayerPen;
use crate::robot::{Arm, Cell};
use crate::scenario::{BeliefKind, Scenario, options};
use crate::skill::GripperKit;
use crate::surface::Scene;
use crate::truth::Truth;

/// The robot, the nominal scene and the true one, the drawing and its pens.
pub(super) struct Setup {
    /// The robot, of its arms those alone that draw: one, or all with a gripper that fetch pens.
    pub cell: Cell,
    /// Its other arms: they stand still in their service poses.
    pub parked: Vec<Arm>,
    /// What each drawing arm knows of its hand and its docks; `None` of an arm that doesn't fetch pens.
    pub kits: Vec<Option<Arc<GripperKit>>>,
    /// The scene as the robot believes it to be, and has drawn it.
    pub scene: Scene,
    pub truth: Truth,
    /// How the true canvas differs; `None` where it doesn't.
    pub truth_metrics: Option<TruthMetrics>,
    pub drawing: Drawing,
    pub pens: Vec<LayerPen>,
}

impl Setup {
    /// All that the scenario names.
    pub(super) fn load(scenario: &Scenario, drawing: Drawing, pens: Vec<LayerPen>) -> Result<Self, RunError> {
        let mut cell = Cell::load_changed(&scenario.robot, &scenario.change.robot)?;
        let parked = park(&mut cell, scenario)?;
        let kits = kits(&cell, scenario)?;
        let scene = scene_of(scenario)?;
        let truth = Truth::new(&scene.canvas, &kits, &options::truth_spec(scenario, scene.friction))?;
        let truth_metrics = (!scenario.truth.is_nominal()).then(|| TruthMetrics::of(truth.report()));
        Ok(Self { cell, parked, kits, scene, truth, truth_metrics, drawing, pens })
    }

    /// Whether pens are fetched.
    pub(super) fn fetches(&self) -> bool {
        self.kits.iter().any(Option::is_some)
    }

    /// What the planner keeps clear of besides the canvas: the scene's furniture, then the robot's and its other arms.
    pub(super) fn obstacles(&self) -> Result<Vec<TriMesh>, RunError> {
        let mut obstacles: Vec<TriMesh> = self.scene.furniture.iter().map(|f| f.mesh.clone()).collect();
        obstacles.extend(self.cell.solids(&self.parked)?);
        Ok(obstacles)
    }
}

/// Takes the arms that don't draw out of the cell.
fn park(cell: &mut Cell, scenario: &Scenario) -> Result<Vec<Arm>, RunError> {
    if scenario.tools.is_some() && scenario.arm.is_none() {
        let (draw, parked): (Vec<Arm>, Vec<Arm>) = cell.arms.drain(..).partition(|a| a.gripper.is_some());
        cell.arms = draw;
        if cell.arms.is_empty() {
            return Err(RunError::NoGripper { robot: cell.name.clone() });
        }
        if cell.arms.len() > 1 && scenario.canvas.belief == BeliefKind::Touch {
            // what one arm learns by touch another doesn't know
            cell.arm_index(None)?;
        }
        return Ok(parked);
    }
    let index = cell.arm_index(scenario.arm.as_deref())?;
    let arm = cell.arms.remove(index);
    if arm.gripper.is_some() && scenario.tools.is_none() {
        return Err(RunError::EmptyHand { arm: arm.model.name });
    }
    if arm.gripper.is_none() && scenario.tools.is_some() {
        return Err(RunError::NoGripper { robot: cell.name.clone() });
    }
    Ok(std::mem::replace(&mut cell.arms, vec![arm]))
}

fn kits(cell: &Cell, scenario: &Scenario) -> Result<Vec<Option<Arc<GripperKit>>>, RunError> {
    let Some(tools) = &scenario.tools else { return Ok(vec![None; cell.arms.len()]) };
    let options = options::gripper_options(tools);
    let kit = |(i, arm)| Ok(GripperKit::new(i, arm, &options)?.map(Arc::new));
    cell.arms.iter().enumerate().map(kit).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_pedestal_is_in_the_planners_way() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/grid_plane.toml");
        let scenario = Scenario::read(&file, &[]).unwrap();
        let setup = Setup::load(&scenario, Drawing::new(0.1, 0.1, vec![]), vec![]).unwrap();
        let obstacles = setup.obstacles().unwrap();
        let ours = &obstacles[setup.scene.furniture.len()..];
        assert_eq!(ours.len(), setup.cell.furniture.len());
        // the plate on the pedestal ends where the arm's base begins
        let top = ours.iter().map(|m| m.bounds().1.z).fold(0.0, f64::max);
        assert!((top - setup.cell.arms[0].model.world_from_base.translation.z).abs() < 1e-9, "{top} m");
    }
}
