//! The parameters of a pen tool and of its dock, read from TOML and checked.
use std::path::Path;

use serde::Deserialize;

use crate::diagnostic::{self, ConfigError};
use crate::files;

/// A tool and the dock that it stands in.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ToolSet {
    /// Name, as in files.
    pub name: String,
    /// The tool.
    pub tool: ToolDesign,
    /// Its dock.
    pub dock: DockDesign,
}

/// Shape, mass and friction of a pen tool. Lengths in m.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ToolDesign {
    /// Mass, kg, spread evenly over its solids.
    pub mass: f64,
    /// Across the flat sides.
    pub width: f64,
    /// Height of the body; the gripper's middle is the body's.
    pub height: f64,
    /// Length of the flat sides: from the back to where the bevels begin.
    pub flat: f64,
    /// Chamfer of the back's upright edges.
    pub back_chamfer: f64,
    /// Front bevels; a tool without any is a box as deep as one with the usual ones.
    pub bevel: Option<Bevel>,
    /// Plates over the fingers, which level the tool when it is lifted.
    pub plates: Option<Plates>,
    /// Stem, cone and nib below the body.
    pub nose: Nose,
    /// Coulomb friction between tool and fingers.
    pub friction_fingers: f64,
    /// Coulomb friction between tool and dock.
    pub friction_dock: f64,
}

/// The front bevels.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bevel {
    /// By how much a bevel turns from the flat side, rad.
    pub angle: f64,
    /// Width that is left of the front, m.
    pub front_width: f64,
}

/// The plates over the upper finger and over the thumb. Lengths in m.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Plates {
    /// Height of the upper finger's top above the gripper's middle.
    pub finger_top: f64,
    /// Height of the thumb's top above the gripper's middle.
    pub thumb_top: f64,
    /// Between a finger's top and its plate, when the tool stands as designed.
    pub gap: f64,
    /// How far the plates stand out of the sides.
    pub reach: f64,
    /// Thickness.
    pub thickness: f64,
}

/// Stem, cone nose and nib. Lengths in m.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Nose {
    /// From the back to the pen's axis.
    pub axis: f64,
    /// Radius of the stem and of the cone's upper end.
    pub stem_radius: f64,
    /// Length of the stem.
    pub stem: f64,
    /// Length of the cone.
    pub cone: f64,
    /// Radius of the cone's lower end.
    pub tip_radius: f64,
    /// How far the nib stands out of the cone.
    pub pen_reach: f64,
    /// Radius of the pen.
    pub pen_radius: f64,
}

/// Shape of a dock. Lengths in m.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DockDesign {
    /// Convex wedges that make up each ring of it.
    pub wedges: usize,
    /// Height of the guide ring above the cone.
    pub guide: f64,
    /// Radial clearance of the stem in the guide ring.
    pub guide_clearance: f64,
    /// Height of the flare above the guide ring.
    pub flare: f64,
    /// Radius of the flare's upper end.
    pub flare_radius: f64,
    /// Wall beyond the flare.
    pub wall: f64,
    /// What keeps the pen from drying.
    pub seal: Option<Seal>,
}

/// A soft lip below the dock's cone.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Seal {
    /// Height of the lip, m.
    pub height: f64,
    /// Largest distance of the nose from its seat at which the lip still closes, m.
    pub gap: f64,
}

/// The tool and dock that come with the program.
const PEN_TOOL: &str = include_str!("../../../../tools/pen_tool.toml");

impl ToolSet {
    /// The tool and dock that come with the program, of `tools/pen_tool.toml`.
    ///
    /// # Errors
    /// None of the file as it is shipped.
    pub fn pen_tool() -> Result<Self, ConfigError> {
        Self::parse(PEN_TOOL, Path::new("tools/pen_tool.toml"))
    }

    /// Reads a tool and its dock from a TOML file.
    ///
    /// # Errors
    /// [`ConfigError`] with file and line when it can't be read, a key is unknown or missing, or a number is out of its range.
    pub fn read(file: &Path) -> Result<Self, ConfigError> {
        let text =
            files::read_text(file).map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })?;
        Self::parse(&text, file)
    }

    /// Parses TOML text; `file` is named in errors, which are those of [`read`](Self::read).
    pub fn parse(text: &str, file: &Path) -> Result<Self, ConfigError> {
        let read: SetFile = diagnostic::parse(text, file)?;
        read.check().map_err(|(key, message)| diagnostic::invalid(text, file, key, message))?;
        Ok(read.design())
    }

    /// The same tool without plates over the fingers.
    pub fn without_plates(mut self) -> Self {
        self.tool.plates = None;
        self
    }

    /// The same tool with a square front.
    pub fn without_bevels(mut self) -> Self {
        self.tool.bevel = None;
        self
    }

    /// The same set with other friction (Coulomb's coefficient): of the fingers and of the dock on the tool.
    pub fn with_friction(mut self, fingers: f64, dock: f64) -> Self {
        self.tool.friction_fingers = fingers;
        self.tool.friction_dock = dock;
        self
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SetFile {
    name: String,
    tool: ToolTable,
    dock: DockTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolTable {
    mass_kg: f64,
    width_mm: f64,
    height_mm: f64,
    flat_mm: f64,
    back_chamfer_mm: f64,
    friction_fingers: f64,
    friction_dock: f64,
    bevel: Option<BevelTable>,
    plates: Option<PlatesTable>,
    nose: NoseTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BevelTable {
    angle_deg: f64,
    front_width_mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlatesTable {
    finger_top_mm: f64,
    thumb_top_mm: f64,
    gap_mm: f64,
    reach_mm: f64,
    thickness_mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NoseTable {
    axis_mm: f64,
    stem_radius_mm: f64,
    stem_mm: f64,
    cone_mm: f64,
    tip_radius_mm: f64,
    pen_reach_mm: f64,
    pen_radius_mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DockTable {
    wedges: usize,
    guide_mm: f64,
    guide_clearance_mm: f64,
    flare_mm: f64,
    flare_radius_mm: f64,
    wall_mm: f64,
    seal: Option<SealTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SealTable {
    height_mm: f64,
    gap_mm: f64,
}

impl SetFile {
    /// Every number against its range; the key and what would be right of the first that is out.
    fn check(&self) -> Result<(), (&'static str, String)> {
        let (t, n, d) = (&self.tool, &self.tool.nose, &self.dock);
        let half = t.height_mm / 2.0;
        // Ranges keep the solids convex and apart, and every later quotient finite; a gripper opens to 155 mm.
        let mut ranges = vec![
            ("tool.mass_kg", t.mass_kg, 0.02, 2.0),
            ("tool.width_mm", t.width_mm, 20.0, 140.0),
            ("tool.height_mm", t.height_mm, 40.0, 300.0),
            ("tool.flat_mm", t.flat_mm, 5.0, 100.0),
            ("tool.back_chamfer_mm", t.back_chamfer_mm, 0.1, (t.flat_mm / 2.0).min(t.width_mm / 4.0)),
            ("tool.friction_fingers", t.friction_fingers, 0.0, 2.0),
            ("tool.friction_dock", t.friction_dock, 0.0, 2.0),
            ("tool.nose.stem_radius_mm", n.stem_radius_mm, 3.0, t.width_mm / 2.0),
            ("tool.nose.axis_mm", n.axis_mm, 0.0, 100.0),
            ("tool.nose.stem_mm", n.stem_mm, d.guide_mm + d.flare_mm, 200.0),
            ("tool.nose.cone_mm", n.cone_mm, 2.0, 100.0),
            ("tool.nose.tip_radius_mm", n.tip_radius_mm, 1.0, n.stem_radius_mm - 0.5),
            ("tool.nose.pen_reach_mm", n.pen_reach_mm, 0.0, 100.0),
            ("tool.nose.pen_radius_mm", n.pen_radius_mm, 0.1, n.tip_radius_mm),
            ("dock.guide_mm", d.guide_mm, 1.0, 100.0),
            ("dock.guide_clearance_mm", d.guide_clearance_mm, 0.05, 10.0),
            ("dock.flare_mm", d.flare_mm, 1.0, 100.0),
            ("dock.flare_radius_mm", d.flare_radius_mm, n.stem_radius_mm + d.guide_clearance_mm, 150.0),
            ("dock.wall_mm", d.wall_mm, 1.0, 50.0),
        ];
        if let Some(b) = &t.bevel {
            ranges.push(("tool.bevel.angle_deg", b.angle_deg, 20.0, 80.0));
            ranges.push(("tool.bevel.front_width_mm", b.front_width_mm, 2.0, t.width_mm - 2.0));
        }
        if let Some(p) = &t.plates {
            ranges.push(("tool.plates.gap_mm", p.gap_mm, 0.0, 10.0));
            ranges.push(("tool.plates.thickness_mm", p.thickness_mm, 0.5, 20.0));
            let highest = half - p.thickness_mm - p.gap_mm;
            ranges.push(("tool.plates.finger_top_mm", p.finger_top_mm, -half, highest));
            ranges.push(("tool.plates.thumb_top_mm", p.thumb_top_mm, -half, highest));
            ranges.push(("tool.plates.reach_mm", p.reach_mm, 1.0, 60.0));
        }
        if let Some(s) = &d.seal {
            ranges.push(("dock.seal.height_mm", s.height_mm, 0.1, 30.0));
            ranges.push(("dock.seal.gap_mm", s.gap_mm, 0.01, s.height_mm));
        }
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err((key, format!("`{key}` is {value}, but must lie between {low} and {high}")));
            }
        }
        if !(8..=96).contains(&d.wedges) {
            return Err(("dock.wedges", format!("`dock.wedges` is {}, but must lie between 8 and 96", d.wedges)));
        }
        Ok(())
    }

    fn design(self) -> ToolSet {
        const MM: f64 = 1e-3;
        let (t, d) = (self.tool, self.dock);
        let tool = ToolDesign {
            mass: t.mass_kg,
            width: t.width_mm * MM,
            height: t.height_mm * MM,
            flat: t.flat_mm * MM,
            back_chamfer: t.back_chamfer_mm * MM,
            bevel: t.bevel.map(|b| Bevel { angle: b.angle_deg.to_radians(), front_width: b.front_width_mm * MM }),
            plates: t.plates.map(|p| Plates {
                finger_top: p.finger_top_mm * MM,
                thumb_top: p.thumb_top_mm * MM,
                gap: p.gap_mm * MM,
                reach: p.reach_mm * MM,
                thickness: p.thickness_mm * MM,
            }),
            nose: Nose {
                axis: t.nose.axis_mm * MM,
                stem_radius: t.nose.stem_radius_mm * MM,
                stem: t.nose.stem_mm * MM,
                cone: t.nose.cone_mm * MM,
                tip_radius: t.nose.tip_radius_mm * MM,
                pen_reach: t.nose.pen_reach_mm * MM,
                pen_radius: t.nose.pen_radius_mm * MM,
            },
            friction_fingers: t.friction_fingers,
            friction_dock: t.friction_dock,
        };
        let dock = DockDesign {
            wedges: d.wedges,
            guide: d.guide_mm * MM,
            guide_clearance: d.guide_clearance_mm * MM,
            flare: d.flare_mm * MM,
            flare_radius: d.flare_radius_mm * MM,
            wall: d.wall_mm * MM,
            seal: d.seal.map(|s| Seal { height: s.height_mm * MM, gap: s.gap_mm * MM }),
        };
        ToolSet { name: self.name, tool, dock }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(from: &str, to: &str) -> String {
        assert!(PEN_TOOL.contains(from));
        ToolSet::parse(&PEN_TOOL.replacen(from, to, 1), Path::new("t.toml")).unwrap_err().to_string()
    }

    #[test]
    fn the_shipped_tool_is_read() {
        let set = ToolSet::pen_tool().unwrap();
        assert!((set.tool.width - 0.0752).abs() < 1e-12);
        assert!(set.tool.plates.is_some() && set.tool.bevel.is_some() && set.dock.seal.is_some());
    }

    #[test]
    fn a_bad_number_is_refused_with_its_line_and_range() {
        let line = PEN_TOOL.lines().position(|l| l.starts_with("angle_deg")).unwrap() + 1;
        assert_eq!(
            refused("angle_deg = 49", "angle_deg = 95"),
            format!("t.toml:{line}: `tool.bevel.angle_deg` is 95, but must lie between 20 and 80")
        );
    }

    #[test]
    fn plates_that_stand_out_of_the_body_are_refused() {
        assert!(refused("finger_top_mm = 51.4", "finger_top_mm = 58").contains("must lie between -60 and 54.2"));
    }

    #[test]
    fn a_misspelt_key_is_refused_with_the_nearest() {
        assert!(refused("wedges = 16", "wedgs = 16").contains("did you mean `wedges`?"));
    }
}
