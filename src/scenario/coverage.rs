//! `[coverage]`: where a mobile base stands.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::plan::cover::{BasePose, CoverMethod, CoverOptions};

use super::check::Check;
use super::resolve::ScenarioError;

/// How places to stand are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CoverKind {
    /// Over the arm's reach in space, the ink alone, exactly.
    #[default]
    Map,
    /// The dissertation's circles chosen greedily over the whole wall, to compare. A patent, US 12,569,997 B2, claims this way; the
    /// default doesn't use its steps.
    Circles,
}

/// `[coverage.circles]`: sizes of `method = "circles"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CircleSettings {
    /// Radius of the circle that the arm is taken to cover.
    #[schemars(range(min = 1, max = 5000))]
    pub radius_mm: f64,
    /// Distance of its centre from the base's.
    #[schemars(range(min = 1, max = 5000))]
    pub offset_mm: f64,
    /// Radius of the circle round the base that must be free of wall.
    #[schemars(range(min = 1, max = 5000))]
    pub base_mm: f64,
}

/// The schemas of numbers of which each has a range of its own.
fn each_within(ranges: [[f64; 2]; 3]) -> serde_json::Value {
    ranges.map(|[low, high]| serde_json::json!({ "type": "number", "minimum": low, "maximum": high })).to_vec().into()
}

impl Default for CircleSettings {
    fn default() -> Self {
        Self { radius_mm: 400.0, offset_mm: 600.0, base_mm: 600.0 }
    }
}

/// `[coverage]`: where a mobile base stands so that its arm draws all of a wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CoverageSettings {
    /// How places to stand are found.
    pub method: CoverKind,
    /// Places by hand in place of that, in the order of drawing: `[[x_mm, y_mm, heading_deg], ...]` of the base's
    /// centre, in the world, and where its front points, from the world's x axis.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("items" = {
        "type": "array",
        "prefixItems": each_within([[-1e6, 1e6], [-1e6, 1e6], [-360.0, 360.0]]),
        "minItems": 3,
        "maxItems": 3,
    }))]
    pub poses: Vec<[f64; 3]>,
    /// Straight seams at these lengths along the wall from its left end, in place of free ones: one fewer than
    /// places.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(inner(range(min = 0, max = 1e6)))]
    pub borders_mm: Vec<f64>,
    /// How far the base may be from where it should stand and still reach everything and be clear.
    #[schemars(range(min = 0, max = 300))]
    pub margin_mm: f64,
    /// How far the drawing may be moved down and up its wall for the fewest places: `[-200, 100]`; it stays where it lies when
    /// absent. Heights are tried in steps of `map_spacing_mm`; of those with as few places the one that cuts fewest strokes,
    /// then the one with the fewest passes, then the nearest to where the drawing lies. For `"map"` alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -5000, max = 5000)))]
    pub raise_mm: Option<[f64; 2]>,
    /// Length and width of the base; a Ridgeback's by default.
    #[schemars(inner(range(min = 50, max = 5000)))]
    pub footprint_mm: [f64; 2],
    /// Where the arm's base frame stands on it: forward and to the left of its centre, and over the floor. Of a robot
    /// that has a base it is the robot's own.
    #[schemars(extend("prefixItems" = each_within([[-2000.0, 2000.0], [-2000.0, 2000.0], [0.0, 3000.0]])))]
    pub mount_mm: [f64; 3],
    /// Distance between the points of the map of reach.
    #[schemars(range(min = 10, max = 100))]
    pub map_spacing_mm: f64,
    /// Distance between places that are tried.
    #[schemars(range(min = 5, max = 200))]
    pub candidate_spacing_mm: f64,
    /// Plan the strokes of each place, at poses 10 mm apart, before it is taken; what fails is taken off the map and
    /// all is solved again.
    pub verify: bool,
    /// Sizes of `method = "circles"`.
    pub circles: CircleSettings,
}

impl Default for CoverageSettings {
    fn default() -> Self {
        Self {
            method: CoverKind::Map,
            poses: Vec::new(),
            borders_mm: Vec::new(),
            margin_mm: 20.0,
            raise_mm: None,
            footprint_mm: [960.0, 793.0],
            mount_mm: [120.0, 0.0, 731.0],
            map_spacing_mm: 25.0,
            candidate_spacing_mm: 25.0,
            verify: true,
            circles: CircleSettings::default(),
        }
    }
}

impl CoverageSettings {
    /// The same in m and rad.
    pub fn options(&self) -> CoverOptions {
        let m = |mm: f64| mm * 1e-3;
        let pose = |p: &[f64; 3]| BasePose { x: m(p[0]), y: m(p[1]), heading: p[2].to_radians() };
        let method = match self.method {
            _ if !self.poses.is_empty() => CoverMethod::Poses(self.poses.iter().map(pose).collect()),
            CoverKind::Map => CoverMethod::Map,
            CoverKind::Circles => CoverMethod::Circles {
                radius: m(self.circles.radius_mm),
                offset: m(self.circles.offset_mm),
                base: m(self.circles.base_mm),
            },
        };
        CoverOptions {
            method,
            borders: self.borders_mm.iter().copied().map(m).collect(),
            raise: self.raise_mm.map(|r| r.map(m)),
            footprint: self.footprint_mm.map(m),
            mount: self.mount_mm.map(m),
            margin: m(self.margin_mm),
            map_spacing: m(self.map_spacing_mm),
            candidate_spacing: m(self.candidate_spacing_mm),
            verify: self.verify,
        }
    }
}

/// What no range says: what goes with which method.
pub(super) fn check_coverage(c: &CoverageSettings, check: &Check) -> Result<(), ScenarioError> {
    if !c.poses.is_empty() && c.method == CoverKind::Circles {
        return Err(check.sentence("coverage.poses", "`poses` are places by hand: leave `method = \"circles\"` out"));
    }
    if c.method == CoverKind::Circles && !c.borders_mm.is_empty() {
        return Err(check.sentence("coverage.borders_mm", "circles make their own borders: leave `borders_mm` out"));
    }
    if let Some([low, high]) = c.raise_mm {
        if low > high {
            return Err(check.wrong("coverage.raise_mm", format!("goes from low to high, not from {low} to {high}")));
        }
        if c.method != CoverKind::Map || !c.poses.is_empty() {
            let message = "only `method = \"map\"` looks for a height: leave `raise_mm` out, and move the drawing by `canvas.offset_mm`";
            return Err(check.sentence("coverage.raise_mm", message));
        }
    }
    Ok(())
}
