//! Tool changes of a simulated arm: from the plant into the world of the grasp and back, without a jump.
use super::simulation::{Simulation, TwinError};
use crate::math::Pose;
use crate::plan::SegmentKind;
use crate::robot::JointVector;
use crate::skill::{PenPlace, grip_from_held};
use crate::twin::arm::TwinArm;
use crate::twin::grasp::{ChangeRecord, Handover, Held, LEFT, Snapshot};
use crate::twin::{ArmPlant, ArmSample, Event, EventKind};

/// How a pen is held while it draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Holding {
    /// As one body with the hand, at the pose in which the grasp left it.
    Rigid,
    /// By contact and friction all the time; with a time (s) after which the fingers open by mistake.
    Friction(Option<f64>),
}

/// Where the tool of an arm that stopped is.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ToolEnding {
    /// The pen and its dock.
    pub place: PenPlace,
    /// The tool, world.
    pub world_from_tool: Pose,
    /// Whether it is neither in its dock nor in the hand.
    pub dropped: bool,
}

/// How long a lost pen is followed, s.
const FALL: f64 = 1.0;

impl Simulation {
    /// Fetches a pen from its dock. The record says whether the robot thinks that it went well; if so, the arm goes on with the pen in
    /// its hand.
    ///
    /// # Errors
    /// The arm has no gripper or its hand is full; the physics broke.
    pub fn fetch(&mut self, place: PenPlace, holding: Holding) -> Result<ChangeRecord, TwinError> {
        let gripper = self.gripper.clone().filter(|_| self.state.held.is_none()).ok_or_else(|| self.no_tool())?;
        let joints = self.joints();
        let desired = self.desired().q;
        let dock = self.state.docks.get(place.dock).copied().ok_or_else(|| self.no_tool())?;
        let (mut held, handover) =
            Held::begin(&gripper, place, &dock, &joints, &desired, self.time()).map_err(|e| self.broke(e))?;
        let mut record = held.fetch(&gripper).map_err(|e| self.broke(e))?;
        record.handover = handover;
        self.state.docks[place.dock].fetches += 1;
        if record.succeeded {
            record.tip_error = Some(held.tip_error(&grip_from_held(&gripper.kit().set)));
        }
        self.note(&mut record, EventKind::PenFetched { ink: self.scene.pens[place.layer].ink.clone() });
        let after = *held.world().state();
        if !record.succeeded {
            // the arm stands where the attempt left it, its hand empty or not
            let bare = gripper.bare();
            self.state.plant = self.plant_of(&bare, &after)?;
            self.put_in_hand(bare, gripper.kit().bare.clone(), held.world().desired(), place.layer);
            self.state.held = Some(held);
            return Ok(record);
        }
        let color = self.colors[place.layer];
        let fingers = held.world().fingers();
        let truly = gripper.holding(place.dock, &held.world().last_from_tool(), &fingers, color);
        let truly = truly.map_err(TwinError::Tool)?;
        let believed = gripper.kit().holding(color).map_err(TwinError::Tool)?;
        self.state.plant = match holding {
            Holding::Rigid => self.plant_of(&truly, &after)?,
            Holding::Friction(opens_after) => {
                held.hold_by_friction(opens_after);
                ArmPlant::Grasp
            }
        };
        let desired = held.world().desired();
        self.put_in_hand(truly, believed, desired, place.layer);
        self.state.held = Some(held);
        let jump = Handover::between(&after, &self.joints());
        if let Some(logged) = self.log.changes.last_mut() {
            logged.handover = logged.handover.worst(&jump);
        }
        record.handover = record.handover.worst(&jump);
        Ok(record)
    }

    /// Puts the pen in the hand back into its dock; the arm goes on with an empty hand.
    ///
    /// # Errors
    /// The hand holds no pen of this layer; the physics broke.
    pub fn bring_back(&mut self, place: PenPlace) -> Result<ChangeRecord, TwinError> {
        let gripper = self.gripper.clone().ok_or_else(|| self.no_tool())?;
        let mut held = self.state.held.clone().filter(|h| h.place() == place).ok_or_else(|| self.no_tool())?;
        let (joints, desired) = (self.joints(), self.desired().q);
        let handover = held.meet(&joints, &desired, matches!(self.state.plant, ArmPlant::Grasp));
        let mut record = held.bring_back(&gripper).map_err(|e| self.broke(e))?;
        record.handover = handover;
        if record.succeeded {
            record.seat_gap = Some(held.distance_from_seat(&gripper));
        }
        self.note(&mut record, EventKind::PenReturned { ink: self.scene.pens[place.layer].ink.clone() });
        self.state.docks[place.dock].world_from_tool = Some(held.world().world_from_tool());
        let after = *held.world().state();
        let bare = gripper.bare();
        self.state.plant = self.plant_of(&bare, &after)?;
        self.put_in_hand(bare, gripper.kit().bare.clone(), held.world().desired(), place.layer);
        let jump = Handover::between(&after, &self.joints());
        if let Some(logged) = self.log.changes.last_mut() {
            logged.handover = logged.handover.worst(&jump);
        }
        self.state.held = (!record.succeeded).then_some(held);
        Ok(record)
    }

    /// After the pen in the hand was lost: the arm stands still, and the pen falls on what lies under it.
    ///
    /// # Errors
    /// The physics broke.
    pub fn let_fall(&mut self, ground: &[crate::mesh::TriMesh]) -> Result<(), TwinError> {
        let desired = self.desired().q;
        let (time, arm) = (self.time(), self.state.arm.model.name.clone());
        let Some(gripper) = self.gripper.clone() else { return Ok(()) };
        let broken = |source| TwinError::Grasp { arm: arm.clone(), source };
        let Some(held) = &mut self.state.held else { return Ok(()) };
        held.world_mut().restart_at(desired);
        held.fall(ground, FALL).map_err(broken)?;
        let ink = self.scene.pens[held.place().layer].ink.clone();
        let snapshot: Snapshot = held.lost(&gripper, held.since_fetch(time) + FALL);
        self.log.lost.push(snapshot);
        let arm = self.state.arm.index();
        self.log.events.push(Event { time, arm, stroke: None, kind: EventKind::PenLost { ink } });
        Ok(())
    }

    /// Where the tool is that the hand holds or last had to do with.
    pub fn tool_ending(&self) -> Option<ToolEnding> {
        let (held, gripper) = (self.state.held.as_ref()?, self.gripper.as_ref()?);
        let dropped = held.distance_from_seat(gripper) > LEFT && held.in_hand(gripper) > LEFT;
        Some(ToolEnding { place: held.place(), world_from_tool: held.world().world_from_tool(), dropped })
    }

    fn put_in_hand(
        &mut self,
        model: crate::robot::ArmModel,
        believed: crate::robot::ArmModel,
        desired: JointVector,
        layer: usize,
    ) {
        let controller = self.law.controller(believed);
        self.state.arm.take_in_hand(TwinArm { model, controller }, desired, layer, &self.scene.pens);
        let q = self.joints().q;
        self.state.arm.moved_to(q);
        self.refresh();
    }

    /// Writes a tool change into the log, and lets its time pass.
    fn note(&mut self, record: &mut ChangeRecord, done: EventKind) {
        let (time, arm) = (self.time(), self.state.arm.index());
        let stroke = None;
        record.start = time;
        let kind = SegmentKind::ChangeTool;
        self.log.events.push(Event { time, arm, stroke, kind: EventKind::Segment { kind } });
        let (n, model) = (self.state.arm.model.dof(), &self.state.arm.model);
        for (i, m) in record.motion.iter().enumerate() {
            let tip = *model.kinematics(&m.q).world_from_tip();
            self.log.samples.push(ArmSample {
                time: time + i as f64 * ChangeRecord::PERIOD,
                segment: kind,
                q: m.q.as_slice()[..n].to_vec(),
                qd: m.qd.as_slice()[..n].to_vec(),
                torque: Some(m.torque.as_slice()[..n].to_vec()),
                tip: tip.translation.vector.into(),
                tip_desired: None,
                force: None,
                normal_force: None,
            });
        }
        self.state.step += record.steps;
        self.state.arm.totals.steps += record.steps;
        let time = self.time();
        if record.succeeded {
            self.log.events.push(Event { time, arm, stroke, kind: done });
        }
        self.log.changes.push(record.clone());
    }

    fn no_tool(&self) -> TwinError {
        TwinError::NoTool { arm: self.state.arm.model.name.clone() }
    }

    fn broke(&self, source: crate::twin::grasp::GraspError) -> TwinError {
        TwinError::Grasp { arm: self.state.arm.model.name.clone(), source }
    }
}
