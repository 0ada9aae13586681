//! What takes part in a run: the robot, the scene, the drawing and its pens, loaded from the files that a scenario names.
use nalgebra::{Translation3, UnitQuaternion, Vector3};

use crate::drawing::Drawing;
use crate::math::Pose;
use crate::measure::TruthMetrics;
use crate::mesh::TriMesh;
use crate::pen::LayerPen;
use crate::robot::{Arm, Cell};
use crate::run::RunError;
use crate::run::scan::Scan;
use crate::run::standing;
use crate::scenario::Scenario;
use crate::surface::{BelievedCanvas, Canvas, Mapping, Scene};
use crate::truth::{TrueCanvas, perturb, unshaped};
use crate::twin::Surroundings;

/// The robot, the scene in truth and in belief, the drawing and its pens.
pub(super) struct Cast {
    /// The robot, of its arms those alone that draw: one, or all with a gripper that fetch pens.
    pub cell: Cell,
    /// Its other arms: they stand still in their service poses.
    pub standing: Vec<Arm>,
    pub scene: Scene,
    pub truth: TrueCanvas,
    /// The nominal canvas in the true one's place, where that has another shape.
    pub unshaped: Option<Canvas>,
    /// How the true canvas differs; `None` where it doesn't.
    pub truth_metrics: Option<TruthMetrics>,
    pub belief: BelievedCanvas,
    /// The scan that the belief came from, if it did.
    pub scan: Option<Scan>,
    pub drawing: Drawing,
    pub pens: Vec<LayerPen>,
}

impl Cast {
    /// All that the scenario names, with what the robot believes of the canvas.
    pub(super) fn load(scenario: &Scenario, drawing: Drawing, pens: Vec<LayerPen>) -> Result<Self, RunError> {
        let mut cast = Self::nominal(scenario, drawing, pens)?;
        if let Some(settings) = &scenario.scan {
            let furniture: Vec<TriMesh> = cast.scene.furniture.iter().map(|f| f.mesh.clone()).collect();
            let size = [cast.drawing.width, cast.drawing.height];
            let (belief, scan) = Scan::make(settings, &cast.truth, &furniture, size, scenario.seed)?;
            (cast.belief, cast.scan) = (belief, Some(scan));
        }
        Ok(cast)
    }

    /// The same with the nominal canvas in belief's place: for whoever needs the true side alone.
    pub(super) fn nominal(scenario: &Scenario, drawing: Drawing, pens: Vec<LayerPen>) -> Result<Self, RunError> {
        let mut cell = Cell::load(&scenario.robot)?;
        let standing: Vec<Arm> = if scenario.tools.is_some() && scenario.arm.is_none() {
            let (draw, stand) = cell.arms.drain(..).partition(|a| a.gripper.is_some());
            cell.arms = draw;
            stand
        } else {
            let drawing_arm = standing::arm_index(&cell, scenario.arm.as_deref())?;
            let drawing_arm = cell.arms.remove(drawing_arm);
            if drawing_arm.gripper.is_some() && scenario.tools.is_none() {
                return Err(RunError::EmptyHand { arm: drawing_arm.model.name });
            }
            std::mem::replace(&mut cell.arms, vec![drawing_arm])
        };
        let mut scene = Scene::read(&scenario.canvas.scene)?;
        // the drawing lies on the sheet as it is; the sheet is moved and turned
        let [x, y] = scenario.canvas.offset_mm.map(|mm| mm * 1e-3);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), scenario.drawing.rotate_deg.to_radians());
        scene.canvas.sheet.world_from_sheet *= Pose::from_parts(Translation3::new(x, y, 0.0), turn);
        let (truth, report) = perturb(&scene.canvas, &scenario.truth.options(), scenario.seed)?;
        let unshaped = unshaped(&scene.canvas, &scenario.truth.options(), scenario.seed)?;
        let truth_metrics = (!scenario.truth.is_nominal()).then(|| TruthMetrics::of(&report));
        let belief = BelievedCanvas(scene.canvas.clone());
        Ok(Self { cell, standing, scene, truth, unshaped, truth_metrics, belief, scan: None, drawing, pens })
    }

    /// What surrounds the arms in truth; `mapping` leads from the true canvas to the sheet.
    pub(super) fn surroundings<'a>(&'a self, scenario: &Scenario, mapping: &'a dyn Mapping) -> Surroundings<'a> {
        Surroundings {
            canvas: &self.truth,
            friction: self.scene.friction,
            compliance: scenario.truth.compliance_mm_n * 1e-3,
            mapping,
            pens: &self.pens,
        }
    }

    /// What the planner keeps clear of besides the canvas: the scene's furniture, then the robot's and its other arms, then what
    /// may lie beyond a scan.
    pub(super) fn obstacles(&self) -> Result<Vec<TriMesh>, RunError> {
        let mut obstacles: Vec<TriMesh> = self.scene.furniture.iter().map(|f| f.mesh.clone()).collect();
        obstacles.extend(standing::solids(&self.cell, &self.standing)?);
        obstacles.extend(self.scan.as_ref().and_then(Scan::skirt).cloned());
        Ok(obstacles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_pedestal_is_in_the_planners_way() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/grid_plane.toml");
        let scenario = Scenario::read(&file, &[]).unwrap();
        let cast = Cast::load(&scenario, Drawing::new(0.1, 0.1, vec![]), vec![]).unwrap();
        let obstacles = cast.obstacles().unwrap();
        let ours = &obstacles[cast.scene.furniture.len()..];
        assert_eq!(ours.len(), cast.cell.furniture.len());
        // the plate on the pedestal ends where the arm's base begins
        let top = ours.iter().map(|m| m.bounds().1.z).fold(0.0, f64::max);
        assert!((top - cast.cell.arms[0].model.world_from_base.translation.z).abs() < 1e-9, "{top} m");
    }
}
