//! Reachability: where the pen of an arm can be with a given direction, and the turn about it free.
//!
//! The map of section VI.A of the dissertation, for a canvas that the pen meets squarely.
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::math::{Digest, Pose, frame_from_axes};
use crate::mesh::{MeshError, TriMesh, shapes};
use crate::plan::field::Workcell;
use crate::plan::reach_grid::ReachGrid;
use crate::plan::surroundings::{PenUse, Surroundings};
use crate::plan::{IkSolution, IkSolver, PenTarget, PlanOptions, dexterity};
use crate::robot::{ArmModel, JointVector};

/// How the pen gets to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Reach {
    /// Not within the joint limits.
    Out = 0,
    /// Only where links would be too near to something, or to a singularity.
    Blocked = 1,
    /// It can draw there.
    Free = 2,
}

impl Reach {
    /// The value with this number.
    pub fn from_byte(byte: u8) -> Option<Self> {
        [Self::Out, Self::Blocked, Self::Free].into_iter().find(|r| *r as u8 == byte)
    }
}

/// Where one arm can draw.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachMap {
    /// The points.
    pub grid: ReachGrid,
    /// What holds at each, in the grid's order.
    pub nodes: Vec<Reach>,
}

impl ReachMap {
    /// Number of nodes at which `reach` holds.
    pub fn count(&self, reach: Reach) -> usize {
        self.nodes.iter().filter(|n| **n == reach).count()
    }

    /// A digest of the points and of what holds there.
    pub fn digest(&self) -> String {
        let mut digest = Digest::new();
        add_grid(&mut digest, &self.grid);
        let bytes: Vec<u8> = self.nodes.iter().map(|r| *r as u8).collect();
        digest.bytes(&bytes).hex()
    }
}

/// Changes when the same question may get another answer, so that kept maps are not taken for new ones.
const VERSION: &[u8] = b"reachability 1";
/// Distance between nodes that are solved without a neighbour's help, m.
const COARSE: f64 = 0.2;
/// Seeds tried at those.
const COARSE_SEEDS: usize = 16;
/// Seeds tried at each node of an edge.
const EDGE_SEEDS: usize = 24;
/// Seeds tried at a point by itself.
const ALONE_SEEDS: usize = 96;
/// Newton steps from a neighbour's configuration, a few centimetres away.
const NEAR_STEPS: usize = 16;
/// Newton steps from a configuration anywhere.
const FAR_STEPS: usize = 40;

/// An arm that is asked where it can draw with its pen in one direction.
///
/// At every point asked about there is taken to be a piece of canvas, square to the pen, which the arm must keep clear of
/// as of obstacles; the nib may touch it. All limits and margins are those of planning.
pub struct ReachProbe<'a> {
    arm: &'a ArmModel,
    home: JointVector,
    obstacles: &'a [TriMesh],
    axis: Vector3<f64>,
    options: PlanOptions,
    patch: TriMesh,
    patch_side: f64,
}

/// The arm in its surroundings.
struct Asked<'a> {
    cell: Workcell<'a>,
    /// Whether the canvas is a piece that lies at each point asked about.
    patch: bool,
}

/// What an attempt at a point came to.
#[derive(Clone, Copy)]
enum Attempt {
    Missed,
    Blocked(JointVector),
    Free(JointVector),
}

impl<'a> ReachProbe<'a> {
    /// Asks `arm`, waiting at `home` among `obstacles` (world), for places of the pen along `axis` (unit, world, out of
    /// the nib). `patch_side` is the side of the piece of canvas, m.
    pub fn new(
        arm: &'a ArmModel,
        home: &JointVector,
        obstacles: &'a [TriMesh],
        axis: &Vector3<f64>,
        options: &PlanOptions,
        patch_side: f64,
    ) -> Result<Self, MeshError> {
        let patch = shapes::rectangle(patch_side, patch_side, 0.0, patch_side)?;
        Ok(Self { arm, home: *home, obstacles, axis: *axis, options: options.clone(), patch, patch_side })
    }

    /// The arm before `canvas`, which follows the point where it is a `patch`.
    fn workcell<'w>(&'w self, canvas: &'w TriMesh, patch: bool) -> Asked<'w> {
        let cell = Workcell {
            solver: IkSolver::new(self.arm, self.options.limit_margin),
            surroundings: Surroundings::new(self.arm, canvas, self.obstacles, &self.options),
            options: &self.options,
            home: self.home,
        };
        Asked { cell, patch }
    }

    /// Whether the pen can draw at `point` (m, world), found for this point alone from many configurations.
    pub fn reach(&self, point: &Point3<f64>) -> Reach {
        self.alone(&self.workcell(&self.patch, true), point, ALONE_SEEDS).reach()
    }

    /// The same with a whole `canvas` (world) in place of the piece at the point.
    pub fn reach_on(&self, point: &Point3<f64>, canvas: &TriMesh) -> Reach {
        self.alone(&self.workcell(canvas, false), point, ALONE_SEEDS).reach()
    }

    /// Whether the pen can draw at each node of `grid`.
    ///
    /// Neighbours have like configurations, so a solution spreads from node to node (in rounds of which each sees only
    /// the one before, so that no order of threads shows). It starts at nodes 0.2 m apart that are solved from
    /// configurations all over the joints' ranges, and what stays unsolved at its edges is tried from many more; what
    /// that finds spreads again. `hear` is told the number of nodes known to be reached.
    pub fn map(&self, grid: &ReachGrid, hear: &(dyn Fn(u64) + Sync)) -> ReachMap {
        let asked = self.workcell(&self.patch, true);
        let mut flood = Flood {
            probe: self,
            asked: &asked,
            grid,
            known: vec![Attempt::Missed; grid.len()],
            edged: vec![false; grid.len()],
        };
        let stride = (COARSE / grid.spacing).round().max(1.0) as usize;
        let coarse = (0..grid.len()).filter(|index| grid.node(*index).iter().all(|n| n % stride == stride / 2));
        let coarse: Vec<usize> = coarse.filter(|index| grid.is_within(self.arm, *index)).collect();
        let mut fresh = flood.solve(&coarse, COARSE_SEEDS);
        while !fresh.is_empty() {
            hear(flood.reached());
            fresh = flood.spread(fresh);
            if fresh.is_empty() {
                let edge = flood.edge();
                fresh = flood.solve(&edge, EDGE_SEEDS);
            }
        }
        ReachMap { grid: grid.clone(), nodes: flood.known.iter().map(Attempt::reach).collect() }
    }

    /// A digest of all that the map of `grid` depends on.
    pub fn key(&self, grid: &ReachGrid) -> String {
        let mut digest = Digest::new();
        digest.bytes(VERSION);
        add_pose(&mut digest, &self.arm.world_from_base);
        add_pose(&mut digest, &self.arm.last_from_tip);
        for joint in &self.arm.joints {
            add_pose(&mut digest, &joint.parent_from_joint);
            digest.bytes(&[joint.kind as u8]).numbers(joint.axis.iter());
            digest.numbers([&joint.lower, &joint.upper, &joint.velocity]);
        }
        for link in &self.arm.links {
            digest.bytes(&(link.capsules.len() as u64).to_le_bytes());
            for c in &link.capsules {
                digest.numbers(c.a.iter().chain(c.b.iter()).chain([&c.radius]));
            }
        }
        digest.numbers(self.home.iter()).numbers(self.axis.iter());
        for mesh in self.obstacles {
            digest.bytes(&(mesh.vertices().len() as u64).to_le_bytes());
            digest.numbers(mesh.vertices().iter().flat_map(|v| v.iter()));
            for corner in mesh.triangles().iter().flatten() {
                digest.bytes(&corner.to_le_bytes());
            }
        }
        let o = &self.options;
        digest.numbers([&o.limit_margin, &o.canvas_margin, &o.self_margin, &o.singularity_margin]);
        digest.numbers([&o.press.largest(), &self.patch_side]);
        add_grid(&mut digest, grid);
        digest.hex()
    }

    /// Tries `point` from the first `seeds` configurations of the even sequence, until one is free.
    fn alone(&self, asked: &Asked, point: &Point3<f64>, seeds: usize) -> Attempt {
        let mut best = Attempt::Missed;
        for k in 0..seeds {
            let seed = if k == 0 { self.home } else { asked.cell.configuration(k) };
            match self.attempt(asked, point, &seed, FAR_STEPS) {
                Attempt::Free(q) => return Attempt::Free(q),
                Attempt::Blocked(q) => best = Attempt::Blocked(q),
                Attempt::Missed => {}
            }
        }
        best
    }

    /// Tries `point` from one configuration.
    fn attempt(&self, asked: &Asked, point: &Point3<f64>, seed: &JointVector, steps: usize) -> Attempt {
        let target = PenTarget { position: *point, axis: self.axis };
        match asked.cell.solver.reach_within(&target, seed, steps) {
            Err(_) => Attempt::Missed,
            Ok(s) if self.is_free(asked, &s, point) => Attempt::Free(s.q),
            Ok(s) => Attempt::Blocked(s.q),
        }
    }

    /// Whether the arm may draw there: the planner's checks.
    fn is_free(&self, asked: &Asked, solution: &IkSolution, point: &Point3<f64>) -> bool {
        if dexterity(&solution.kinematics) < self.options.singularity_margin {
            return false;
        }
        let turn = frame_from_axes(&-self.axis, &Vector3::x());
        let patch_from_world = asked.patch.then(|| Pose::from_parts(point.coords.into(), turn).inverse());
        let around = &asked.cell.surroundings;
        around.clearance_with_canvas(&solution.kinematics, PenUse::Drawing, patch_from_world.as_ref()).is_clear()
    }
}

impl Attempt {
    fn reach(&self) -> Reach {
        match self {
            Self::Missed => Reach::Out,
            Self::Blocked(_) => Reach::Blocked,
            Self::Free(_) => Reach::Free,
        }
    }
}

/// A map being made.
struct Flood<'a> {
    probe: &'a ReachProbe<'a>,
    asked: &'a Asked<'a>,
    grid: &'a ReachGrid,
    known: Vec<Attempt>,
    /// Nodes that were tried by themselves.
    edged: Vec<bool>,
}

impl Flood<'_> {
    fn reached(&self) -> u64 {
        self.known.iter().filter(|a| matches!(a, Attempt::Free(_))).count() as u64
    }

    /// Keeps what attempts came to, in the order of the list; says which are free.
    fn keep(&mut self, found: Vec<(usize, Attempt)>) -> Vec<usize> {
        let mut fresh = Vec::new();
        for (index, attempt) in found {
            match (attempt, &self.known[index]) {
                (Attempt::Free(_), _) => {
                    self.known[index] = attempt;
                    fresh.push(index);
                }
                (Attempt::Blocked(_), Attempt::Missed) => self.known[index] = attempt,
                _ => {}
            }
        }
        fresh
    }

    /// Solves nodes by themselves.
    fn solve(&mut self, nodes: &[usize], seeds: usize) -> Vec<usize> {
        let solve = |index: &usize| (*index, self.probe.alone(self.asked, &self.grid.position(*index), seeds));
        let found = nodes.par_iter().map(solve).collect();
        nodes.iter().for_each(|index| self.edged[*index] = seeds >= EDGE_SEEDS);
        self.keep(found)
    }

    /// Carries the configurations of `fresh` nodes to their neighbours that are not free yet, again and again; returns nothing
    /// new to spread.
    fn spread(&mut self, mut fresh: Vec<usize>) -> Vec<usize> {
        while !fresh.is_empty() {
            let mut waiting: Vec<(usize, usize)> = Vec::new();
            for from in &fresh {
                let open = self.grid.neighbours(*from).filter(|to| !matches!(self.known[*to], Attempt::Free(_)));
                waiting.extend(open.map(|to| (to, *from)));
            }
            waiting.sort_unstable();
            let groups: Vec<&[(usize, usize)]> = waiting.chunk_by(|a, b| a.0 == b.0).collect();
            let carry = |group: &&[(usize, usize)]| {
                let to = group[0].0;
                let point = self.grid.position(to);
                let mut best = Attempt::Missed;
                for (_, from) in *group {
                    let Attempt::Free(seed) = &self.known[*from] else { continue };
                    match self.probe.attempt(self.asked, &point, seed, NEAR_STEPS) {
                        Attempt::Free(q) => return (to, Attempt::Free(q)),
                        Attempt::Blocked(q) => best = Attempt::Blocked(q),
                        Attempt::Missed => {}
                    }
                }
                (to, best)
            };
            let found = groups.par_iter().map(carry).collect();
            fresh = self.keep(found);
        }
        fresh
    }

    /// Nodes that are not free though a neighbour is, or that the pen gets to in a way that is not allowed; each once.
    fn edge(&self) -> Vec<usize> {
        let beside_free = |index: usize| self.grid.neighbours(index).any(|n| matches!(self.known[n], Attempt::Free(_)));
        let open = |index: &usize| match self.known[*index] {
            Attempt::Free(_) => false,
            Attempt::Blocked(_) => true,
            Attempt::Missed => beside_free(*index),
        };
        (0..self.grid.len()).filter(|index| !self.edged[*index] && open(index)).collect()
    }
}

fn add_pose(digest: &mut Digest, pose: &Pose) {
    digest.numbers(pose.translation.vector.iter()).numbers(pose.rotation.coords.iter());
}

fn add_grid(digest: &mut Digest, grid: &ReachGrid) {
    digest.numbers(grid.origin.iter().chain(grid.right.iter()).chain(grid.up.iter()).chain(grid.axis.iter()));
    digest.numbers([&grid.spacing]);
    for d in 0..3 {
        digest.bytes(&grid.first[d].to_le_bytes()).bytes(&(grid.size[d] as u64).to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stream;
    use crate::plan::arms;
    use rand::RngExt as _;

    fn table() -> Vec<TriMesh> {
        let slab = shapes::cuboid(&Vector3::new(0.3, 1.0, 0.1), 1.0).unwrap();
        vec![slab.transformed(&Pose::translation(-0.45, 0.0, 0.1))]
    }

    #[test]
    fn a_map_agrees_with_points_solved_one_by_one() {
        let obstacles = table();
        for (arm, home) in [(arms::ur5e(), arms::ur5e_home()), (arms::iiwa(), arms::iiwa_home())] {
            let axis = -Vector3::z();
            let probe = ReachProbe::new(&arm, &home, &obstacles, &axis, &PlanOptions::default(), 0.3).unwrap();
            let grid = ReachGrid::around(&[&arm], &axis, 0.1).unwrap();
            let map = probe.map(&grid, &|_| ());
            let mut random = stream(7, "nodes", 0);
            let within: Vec<usize> = (0..grid.len()).filter(|i| grid.is_within(&arm, *i)).collect();
            let (mut agree, mut free, tried) = (0, 0, 150);
            for _ in 0..tried {
                let index = within[random.random_range(0..within.len())];
                let alone = probe.reach(&grid.position(index));
                free += usize::from(alone == Reach::Free);
                agree += usize::from((alone == Reach::Free) == (map.nodes[index] == Reach::Free));
            }
            assert!(free > 20 && free < tried - 20, "{}: {free} of {tried} say little", arm.name);
            assert!(agree * 100 >= tried * 99, "{}: {agree} of {tried} agree", arm.name);
        }
    }

    #[test]
    fn a_map_is_the_same_on_one_thread_and_on_two() {
        let arm = arms::ur5e();
        let probe =
            ReachProbe::new(&arm, &arms::ur5e_home(), &[], &Vector3::x(), &PlanOptions::default(), 0.2).unwrap();
        let grid = ReachGrid::around(&[&arm], &Vector3::x(), 0.15).unwrap();
        let map = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| probe.map(&grid, &|_| ()))
        };
        let (one, two) = (map(1), map(2));
        assert!(one.count(Reach::Free) > 100);
        assert_eq!(one, two);
        assert_eq!(one.digest(), two.digest());
    }

    #[test]
    fn what_stands_in_the_way_blocks_and_changes_the_key() {
        let (arm, home) = (arms::iiwa(), arms::iiwa_home());
        let axis = -Vector3::z();
        let place = Point3::new(0.45, 0.0, 0.4);
        let slab = shapes::cuboid(&Vector3::new(0.4, 0.4, 0.05), 1.0).unwrap();
        let walls = [slab.transformed(&Pose::translation(0.45, 0.0, 0.5))];
        let probe = |obstacles| ReachProbe::new(&arm, &home, obstacles, &axis, &PlanOptions::default(), 0.3).unwrap();
        let (open, under) = (probe(&[]), probe(&walls));
        assert_eq!(open.reach(&place), Reach::Free);
        assert_eq!(under.reach(&place), Reach::Blocked, "the pen passes through the slab");
        assert_eq!(open.reach(&Point3::new(2.0, 0.0, 0.4)), Reach::Out);
        let grid = ReachGrid::around(&[&arm], &axis, 0.2).unwrap();
        assert_ne!(open.key(&grid), under.key(&grid));
        assert_eq!(open.key(&grid), probe(&[]).key(&grid));
    }
}
