//! What the arm must not touch: the believed canvas, the furniture and itself.
use nalgebra::Point3;

use crate::math::Pose;
use crate::mesh::TriMesh;
use crate::plan::PlanOptions;
use crate::robot::{ArmModel, Capsule, JointVector, Kinematics, LinkPairs, MAX_DOF};

/// Whether the nib may be on the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PenUse {
    /// The pen must stay off the canvas like any other part.
    Travelling,
    /// The last millimetres of the pen may touch the canvas.
    Drawing,
}

/// Two things that are near each other. Links count from the base, 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CollisionPair {
    /// A link and the canvas.
    Canvas {
        /// Index of the link.
        link: usize,
    },
    /// A link and a piece of furniture.
    Obstacle {
        /// Index of the link.
        link: usize,
        /// Index of the obstacle.
        obstacle: usize,
    },
    /// Two links.
    Links {
        /// The one nearer to the base.
        first: usize,
        /// The other.
        second: usize,
    },
}

/// How much room there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Least distance less the margin that is to be kept there, m; negative where a margin is entered. Never above
    /// [`Clearance::HORIZON`], beyond which nothing is looked at.
    pub excess: f64,
    /// What is nearest, if anything is within the horizon.
    pub contact: Option<CollisionPair>,
}

impl Clearance {
    /// Distance beyond the margin that counts as far, m.
    pub const HORIZON: f64 = 0.1;

    /// All margins are kept.
    pub fn is_clear(&self) -> bool {
        self.excess >= 0.0
    }
}

/// An arm in its surroundings, as far as they are believed.
pub struct Surroundings<'a> {
    arm: &'a ArmModel,
    canvas: &'a TriMesh,
    obstacles: &'a [TriMesh],
    pairs: LinkPairs,
    canvas_margin: f64,
    self_margin: f64,
    press_depth: f64,
    /// Index of the pen's capsule among those of the last link.
    pen: Option<usize>,
    /// The bare nib, from the pen's capsule (or the last link's origin) to the tip, in the last link's frame.
    nib: Capsule,
    /// Largest distance of any point of the arm from each joint's axis, m (1 for sliding joints).
    reach: JointVector,
}

/// Distance kept between the travelling nib and everything, m; a lifted pen hovers higher.
const NIB_MARGIN: f64 = 0.002;
/// Extra length at the nib that is not looked at while it draws, m.
const NIB_SLACK: f64 = 0.003;

impl<'a> Surroundings<'a> {
    /// Puts `arm` among a canvas and obstacles (world frame).
    pub fn new(arm: &'a ArmModel, canvas: &'a TriMesh, obstacles: &'a [TriMesh], options: &PlanOptions) -> Self {
        let tip = Point3::from(arm.last_from_tip.translation.vector);
        let gap = |c: &Capsule| crate::robot::segment_distance(&c.a, &c.b, &tip, &tip) - c.radius;
        let last = arm.links.last().map_or(&[][..], |l| &l.capsules);
        let pen =
            (0..last.len()).filter(|i| gap(&last[*i]) < 0.02).min_by(|a, b| gap(&last[*a]).total_cmp(&gap(&last[*b])));
        let root = pen.map_or(Point3::origin(), |i| {
            let (a, b) = (last[i].a, last[i].b);
            if (a - tip).norm() < (b - tip).norm() { a } else { b }
        });
        Self {
            arm,
            canvas,
            obstacles,
            pairs: LinkPairs::new(arm),
            canvas_margin: options.canvas_margin,
            self_margin: options.self_margin,
            press_depth: options.press.largest(),
            pen,
            nib: Capsule { a: root, b: tip, radius: 0.0 },
            reach: arm.reach(),
        }
    }

    /// The arm.
    pub fn arm(&self) -> &'a ArmModel {
        self.arm
    }

    /// No point of the arm moves farther than this when the joints move by `dq`, m.
    pub fn motion_bound(&self, dq: &JointVector) -> f64 {
        (0..MAX_DOF).map(|i| dq[i].abs() * self.reach[i]).sum()
    }

    /// Clearance of the arm at `k`; no allocation. The base, link 0, may stand on whatever it stands on.
    pub fn clearance(&self, k: &Kinematics, pen_use: PenUse) -> Clearance {
        self.clearance_with_canvas(k, pen_use, None)
    }

    /// The same with the canvas elsewhere: `canvas_from_world` leads into the frame of its mesh.
    pub fn clearance_with_canvas(
        &self,
        k: &Kinematics,
        pen_use: PenUse,
        canvas_from_world: Option<&Pose>,
    ) -> Clearance {
        let itself = self.pairs.clearance(self.arm, k);
        let mut clearance = Clearance { excess: Clearance::HORIZON, contact: None };
        if let Some((first, second)) = itself.links
            && itself.distance - self.self_margin < clearance.excess
        {
            clearance = Clearance {
                excess: itself.distance - self.self_margin,
                contact: Some(CollisionPair::Links { first, second }),
            };
        }
        let last = self.arm.links.len() - 1;
        for (link, model) in self.arm.links.iter().enumerate().skip(1) {
            for (i, capsule) in model.capsules.iter().enumerate() {
                let is_pen = link == last && self.pen == Some(i);
                // where the canvas lies on a table, the nib is as near to the one as to the other
                let looked_at = if is_pen { self.trim(capsule, pen_use) } else { Some(*capsule) };
                let Some(c) = looked_at.map(|c| c.transformed(k.world_from_link(link))) else { continue };
                let margin = c.radius + self.canvas_margin;
                let seen = canvas_from_world.map_or(c, |pose| c.transformed(pose));
                nearer(self.canvas, &seen.a, &seen.b, margin, CollisionPair::Canvas { link }, &mut clearance);
                for (obstacle, mesh) in self.obstacles.iter().enumerate() {
                    nearer(mesh, &c.a, &c.b, margin, CollisionPair::Obstacle { link, obstacle }, &mut clearance);
                }
            }
        }
        if pen_use == PenUse::Travelling {
            let c = self.nib.transformed(k.world_from_link(last));
            let seen = canvas_from_world.map_or(c, |pose| c.transformed(pose));
            nearer(self.canvas, &seen.a, &seen.b, NIB_MARGIN, CollisionPair::Canvas { link: last }, &mut clearance);
            for (obstacle, mesh) in self.obstacles.iter().enumerate() {
                nearer(mesh, &c.a, &c.b, NIB_MARGIN, CollisionPair::Obstacle { link: last, obstacle }, &mut clearance);
            }
        }
        clearance
    }

    /// The pen's capsule, in the last link's frame, cut back so that it ends at the tip, or short of it by as much as may touch the canvas.
    fn trim(&self, capsule: &Capsule, pen_use: PenUse) -> Option<Capsule> {
        let axis = self.arm.last_from_tip.rotation * nalgebra::Vector3::z();
        let tip = self.arm.last_from_tip.translation.vector;
        let allowed = match pen_use {
            PenUse::Travelling => 0.0,
            PenUse::Drawing => -(self.press_depth + self.canvas_margin + NIB_SLACK),
        };
        // heights of the two ends over the tip, along the pen; the ball round an end reaches `radius` farther
        let level = |p: &Point3<f64>| axis.dot(&(p.coords - tip)) + capsule.radius - allowed;
        let (la, lb) = (level(&capsule.a), level(&capsule.b));
        if la <= 0.0 && lb <= 0.0 {
            return Some(*capsule);
        }
        if la > 0.0 && lb > 0.0 {
            return None;
        }
        let cut = capsule.a + (capsule.b - capsule.a) * (la / (la - lb));
        Some(if la > 0.0 { Capsule { a: cut, ..*capsule } } else { Capsule { b: cut, ..*capsule } })
    }

    /// What is first too near on the straight joint motion from `a` to `b`, or `None` when all of it is clear.
    ///
    /// Each look says how far the arm may move before it could enter a margin; the next look is no farther on than
    /// that, so nothing slips between two looks. Where there is hardly any room it looks every 2 mm.
    pub fn obstruction(&self, a: &JointVector, b: &JointVector, pen_use: PenUse) -> Option<(f64, Clearance)> {
        let whole = self.motion_bound(&(b - a));
        let mut u = 0.0;
        loop {
            let clearance = self.clearance(&self.arm.kinematics(&(a + (b - a) * u)), pen_use);
            if !clearance.is_clear() {
                return Some((u, clearance));
            }
            if u >= 1.0 {
                return None;
            }
            u = (u + clearance.excess.max(FINEST) / whole.max(1e-9)).min(1.0);
        }
    }
}

/// Shortest step of the arm between two looks, m.
pub const FINEST: f64 = 0.002;

/// Lowers `room` to the distance of `mesh` from the segment, less `margin`, when that is less.
fn nearer(
    mesh: &TriMesh,
    a: &Point3<f64>,
    b: &Point3<f64>,
    margin: f64,
    contact: CollisionPair,
    clearance: &mut Clearance,
) {
    if let Some(distance) = mesh.distance_to_segment(a, b, clearance.excess.max(-margin) + margin)
        && distance - margin < clearance.excess
    {
        *clearance = Clearance { excess: distance - margin, contact: Some(contact) };
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::Vector3;

    use super::*;
    use crate::mesh::shapes;
    use crate::robot::Cell;

    #[test]
    fn two_arms_are_clear_of_each_other_of_themselves_and_of_their_stand() {
        let cell = Cell::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/dual_ur5e.toml")).unwrap();
        assert_eq!(cell.arms.len(), 2);
        let far = shapes::rectangle(0.1, 0.1, 0.0, 0.1).unwrap().transformed(&Pose::translation(0.0, 0.0, -5.0));
        let tips: Vec<_> = cell.arms.iter().map(|a| *a.model.kinematics(&a.home).world_from_tip()).collect();
        for (i, tip) in tips.iter().enumerate() {
            let (arm, other) = (&cell.arms[i], &cell.arms[1 - i]);
            let solids = cell.solids([other]).unwrap();
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
}
