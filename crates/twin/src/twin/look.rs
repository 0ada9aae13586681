//! Pictures among the tasks of a simulation.
use crate::camera::{HandCamera, Sight};
use crate::ink::InkStroke;
use crate::skill::Picture;
use crate::twin::simulation::{Simulation, TwinError, standing};
use crate::twin::{Event, EventKind};

impl Simulation {
    /// Puts a camera on the hand.
    pub fn see_with(&mut self, camera: HandCamera) {
        self.state.eye = Some(camera);
    }

    /// Stands for `settle` (s), in at most `most` steps a call, and takes a picture: `None` while it stands. `earlier` is the ink that was
    /// taken from the log before.
    ///
    /// # Errors
    /// The arm has no camera; the physics blew up.
    pub fn look<'a>(
        &mut self,
        settle: f64,
        most: u64,
        earlier: impl Iterator<Item = &'a InkStroke>,
    ) -> Result<Option<Picture>, TwinError> {
        if self.state.eye.is_none() {
            return Err(TwinError::NoCamera { arm: self.name().to_string() });
        }
        let stand = standing(self.desired().q, self.state.arm.layer(), settle);
        if self.execute(&stand, None, most, None)?.is_none() {
            return Ok(None);
        }
        let joints = self.joints();
        // ink that is still wet at the pen counts, too
        let wet = self.state.arm.ending(self.time(), &joints).ink;
        let world_from_last = *self.kinematics().world_from_link(self.state.arm.model.dof());
        let (time, arm) = (self.time(), self.index());
        let mut ink: Vec<&InkStroke> = Vec::new();
        for stroke in earlier {
            ink.push(stroke);
        }
        ink.extend(self.log.ink.iter().chain(&wet));
        let sight = Sight { canvas: self.scene.canvas.mesh(), colors: &self.colors, ink };
        let Some(eye) = &mut self.state.eye else { return Ok(None) };
        let pixels = eye.take(&sight, &world_from_last);
        let size_px = eye.size_px();
        self.log.events.push(Event { time, arm, stroke: None, kind: EventKind::Picture });
        Ok(Some(Picture { size_px, pixels, q: joints.q }))
    }
}
