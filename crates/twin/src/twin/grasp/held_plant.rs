//! Drawing with a pen that is held by contact and friction all the time.
use std::cell::RefCell;
use std::rc::Rc;

use super::{DT, GraspWorld};
use crate::control::MeasuredState;
use crate::robot::{JointVector, Kinematics};
use crate::skill::HandCommand;
use crate::twin::{Plant, TipForce, TipState};

/// Fingers that have moved by more than this since the pen was fetched, rad, hold it no longer: 10 mm at the second joint. A pen that
/// draws moves them by a hundredth of it.
const MOVED: f64 = 0.2;

/// The one arm of a grasp's world as a plant: fingers hold on as they were last told to, and the pen is where the tool is.
pub struct HeldPlant {
    world: Rc<RefCell<GraspWorld>>,
    state: MeasuredState,
    /// Finger joints when the pen began to be led, rad, as sensed.
    fingers: [[f64; 3]; 3],
    lost: bool,
    /// Steps until the fingers open by mistake.
    opens_in: Option<u64>,
}

impl HeldPlant {
    /// The world as it is. With `opens_after` (s) the fingers open by mistake so long from now.
    pub fn new(world: Rc<RefCell<GraspWorld>>, opens_after: Option<f64>) -> Self {
        let (state, fingers) = (*world.borrow().state(), world.borrow().senses().hand.q);
        let opens_in = opens_after.map(|s| (s / DT).round() as u64);
        Self { world, state, fingers, lost: false, opens_in }
    }
}

impl Plant for HeldPlant {
    fn state(&self, _arm: usize) -> &MeasuredState {
        &self.state
    }

    fn step(&mut self, torques: &[JointVector], forces: &[TipForce], kinematics: &[Kinematics]) -> Result<(), usize> {
        let mut world = self.world.borrow_mut();
        self.opens_in = match self.opens_in {
            Some(0) => {
                world.command(&HandCommand::open());
                None
            }
            other => other.map(|steps| steps - 1),
        };
        world.drive(&torques[0], &forces[0], &kinematics[0]).map_err(|_| 0usize)?;
        self.state = *world.state();
        let now = world.sensed_fingers();
        let moved = now.iter().flatten().zip(self.fingers.iter().flatten()).map(|(a, b)| (a - b).abs());
        self.lost |= moved.fold(0.0, f64::max) > MOVED;
        Ok(())
    }

    fn tip(&self, _arm: usize, _kinematics: &Kinematics, _qd: &JointVector) -> TipState {
        let world = self.world.borrow();
        let (velocity, mass) = (world.tool_tip_velocity(), world.tool_mass());
        TipState { pose: world.world_from_pen(), velocity, mass }
    }

    fn has_lost(&self, _arm: usize) -> bool {
        self.lost
    }
}
