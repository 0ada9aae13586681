//! Drawing with a pen that is held by contact and friction all the time.
use std::cell::RefCell;
use std::rc::Rc;

use super::GraspWorld;
use crate::control::MeasuredState;
use crate::robot::{JointVector, Kinematics};
use crate::twin::{Plant, TipForce, TipState};

/// The one arm of a grasp's world as a plant: fingers hold on as they were last told to, and the pen is where the tool is.
pub struct HeldPlant {
    world: Rc<RefCell<GraspWorld>>,
    state: MeasuredState,
}

impl HeldPlant {
    /// The world as it is.
    pub fn new(world: Rc<RefCell<GraspWorld>>) -> Self {
        let state = *world.borrow().state();
        Self { world, state }
    }
}

impl Plant for HeldPlant {
    fn state(&self, _arm: usize) -> &MeasuredState {
        &self.state
    }

    fn step(&mut self, torques: &[JointVector], forces: &[TipForce], kinematics: &[Kinematics]) -> Result<(), usize> {
        let mut world = self.world.borrow_mut();
        world.drive(&torques[0], &forces[0], &kinematics[0]).map_err(|_| 0usize)?;
        self.state = *world.state();
        Ok(())
    }

    fn tip(&self, _arm: usize, _kinematics: &Kinematics, _qd: &JointVector) -> TipState {
        let world = self.world.borrow();
        let (velocity, mass) = (world.tool_tip_velocity(), world.tool_mass());
        TipState { pose: world.world_from_pen(), velocity, mass }
    }
}
