//! The canvas that is chosen where arms can draw: tried, shown, and written as a scene and a scenario.
use std::fmt::Write as _;
use std::path::Path;

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use crate::drawing::Drawing;
use crate::math::Pose;
use crate::mesh::{MeshError, shapes};
use crate::plan::{Reach, ReachGrid, ReachMap, ReachProbe, Slice};
use crate::report::{Figure, ShownCanvas, reach_figure};
use crate::robot::Arm;

/// Points across the canvas, each way, at which it is tried in the end.
const TRIED: usize = 15;
/// Slices in the picture.
const SHOWN: usize = 12;
/// Canvas beyond the drawing on each side, m.
const BORDER: f64 = 0.02;

/// How many points were tried on a canvas and at how many each arm can draw.
pub(super) type Tried = Vec<(usize, usize)>;

/// The canvas in reach.json.
#[derive(Debug, Serialize)]
pub(super) struct CanvasJson {
    pub depth_mm: f64,
    pub width_mm: f64,
    pub height_mm: f64,
    pub center_mm: [f64; 3],
    pub normal: [f64; 3],
    pub up: [f64; 3],
}

/// The canvas that was chosen.
pub(super) struct Placed<'a> {
    pub grid: &'a ReachGrid,
    pub slice: Slice,
    /// Right and up, m.
    pub center: [f64; 2],
}

impl Placed<'_> {
    fn world_center(&self) -> Point3<f64> {
        self.grid.point([self.center[0], self.center[1], self.slice.depth])
    }

    /// World from canvas: x right, y up, z out of it.
    fn rotation(&self) -> Rotation3<f64> {
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[self.grid.right, self.grid.up, -self.grid.axis]))
    }

    /// How many points across the canvas there are, and at how many of them each arm can draw, solved one by one
    /// before the whole canvas.
    pub fn tried(&self, probes: &[ReachProbe]) -> Result<Tried, MeshError> {
        let [width, height] = self.slice.size;
        let sheet = shapes::rectangle(width + 2.0 * BORDER, height + 2.0 * BORDER, 0.0, 0.1)?;
        let turn = UnitQuaternion::from_rotation_matrix(&self.rotation());
        let canvas = sheet.transformed(&Pose::from_parts(self.world_center().coords.into(), turn));
        let share = |n: usize| n as f64 / (TRIED - 1) as f64 - 0.5;
        let points: Vec<Point3<f64>> = (0..TRIED * TRIED)
            .map(|n| {
                let (u, v) = (share(n / TRIED) * width, share(n % TRIED) * height);
                self.grid.point([self.center[0] + u, self.center[1] + v, self.slice.depth])
            })
            .collect();
        let free = |probe: &ReachProbe| {
            let reached = |p: &&Point3<f64>| probe.reach_on(p, &canvas) == Reach::Free;
            (points.len(), points.par_iter().filter(reached).count())
        };
        Ok(probes.iter().map(free).collect())
    }

    pub fn json(&self) -> CanvasJson {
        CanvasJson {
            depth_mm: rounded(self.slice.depth * 1e3),
            width_mm: rounded(self.slice.size[0] * 1e3),
            height_mm: rounded(self.slice.size[1] * 1e3),
            center_mm: mm(&self.world_center().coords),
            normal: (-self.grid.axis).map(|x| x + 0.0).into(),
            up: self.grid.up.into(),
        }
    }

    pub fn figure(
        &self,
        robot: &str,
        arms: &[&Arm],
        maps: &[ReachMap],
        near: f64,
        far: f64,
        drawing: Option<&Drawing>,
    ) -> Figure {
        let grid = self.grid;
        let k = ((self.slice.depth / grid.spacing).round() - f64::from(grid.first[2])) as usize;
        let drawn = |k: &usize| {
            let at = grid.coordinate(2, *k);
            let any =
                |m: &ReachMap| (0..grid.size[0] * grid.size[1]).any(|ij| m.nodes[ij * grid.size[2] + k] == Reach::Free);
            (near - 1e-9..=far + 1e-9).contains(&at) && maps.iter().any(any)
        };
        let all: Vec<usize> = (0..grid.size[2]).filter(drawn).collect();
        let step = all.len().div_ceil(SHOWN).max(1);
        // the canvas's slice is one of those shown
        let shift = all.iter().position(|other| *other == k).unwrap_or(0) % step;
        let shown: Vec<usize> = all.iter().skip(shift).step_by(step).copied().collect();
        let scale = drawing.map_or(0.0, |d| self.slice.size[0] / d.width);
        let strokes = drawing
            .iter()
            .flat_map(|d| d.layers.iter().flat_map(|l| &l.strokes))
            .map(|s| s.points.iter().map(|p| (self.center[0] + p.x * scale, self.center[1] + p.y * scale)).collect());
        let canvas = ShownCanvas { k, center: self.center, size: self.slice.size, strokes: strokes.collect() };
        let bases: Vec<(f64, f64)> = arms
            .iter()
            .map(|a| a.model.world_from_base.translation.vector - grid.origin.coords)
            .map(|v| (grid.right.dot(&v), grid.up.dot(&v)))
            .collect();
        let named: Vec<(&str, &ReachMap)> = arms.iter().map(|a| a.model.name.as_str()).zip(maps).collect();
        let title = format!("Where {robot} can draw, and the largest canvas");
        reach_figure(&title, &named, &bases, &shown, Some(&canvas))
    }

    /// The canvas as a scene file.
    pub fn scene(&self, robot: &str) -> String {
        let [x, y, z] = mm(&self.world_center().coords);
        let (roll, pitch, yaw) = self.rotation().euler_angles();
        let [roll, pitch, yaw] = [roll, pitch, yaw].map(|a| rounded(a.to_degrees()));
        let [sx, sy, sz] = mm(&(self.world_center() - self.grid.axis * 0.05).coords);
        // a zero without a sign
        let [n, up] = [-self.grid.axis, self.grid.up].map(|v| v.map(|x| x + 0.0));
        let [width, height] = self.slice.size.map(|s| rounded((s + 2.0 * BORDER) * 1e3));
        format!(
            "# The largest canvas that {robot} can draw on, as `calamus reach` found it.\n\
             name = \"canvas of {robot}\"\ncolor = [250, 248, 240]\nfriction = 0.3\n\n\
             [canvas]\nshape = \"plane\"\nwidth_mm = {width}\nheight_mm = {height}\nthickness_mm = 10\ntriangle_mm = 20\n\
             pose = {{ xyz_mm = [{x}, {y}, {z}], rpy_deg = [{roll}, {pitch}, {yaw}] }}\n\n\
             [sheet]\nxyz_mm = [{sx}, {sy}, {sz}]\nnormal = [{}, {}, {}]\nup = [{}, {}, {}]\n",
            n[0], n[1], n[2], up[0], up[1], up[2]
        )
    }

    /// A scenario that draws `drawing` there.
    pub fn scenario(&self, robot: &Path, arm: Option<&str>, drawing: &Path) -> String {
        let absolute = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_path_buf());
        let mut toml = format!("robot = {}\n", quoted(&absolute(robot).to_string_lossy()));
        if let Some(arm) = arm {
            let _ = writeln!(toml, "arm = {}", quoted(arm));
        }
        let [width, height] = self.slice.size.map(|s| rounded(s * 1e3));
        let source = quoted(&absolute(drawing).to_string_lossy());
        let _ = writeln!(
            toml,
            "\n[drawing]\nsource = {source}\nwidth_mm = {width}\nheight_mm = {height}\n\n[canvas]\nscene = \"./canvas.toml\""
        );
        toml
    }
}

/// A TOML string.
fn quoted(text: &str) -> String {
    // JSON's strings are TOML's too
    serde_json::Value::from(text).to_string()
}

/// Without the noise of binary fractions, to a nanometre or less.
pub(super) fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6 + 0.0
}

/// mm of m.
pub(super) fn mm(v: &Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z].map(|x| rounded(x * 1e3))
}
