//! What a pen does with ink: line width from force, flow from speed and dwell, a reservoir that runs dry.
//!
//! Every law is a published form; its constants are fixed by what a pen's maker or a ruler can tell (width and density at
//! the nominal force and speed, metres of line in a pen). `docs/ink.md` derives them.
use std::path::Path;

use serde::Deserialize;

use crate::diagnostic::{self, ConfigError};
use crate::files;

/// How a soft nib meets the canvas, which sets the exponent of contact width in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TipShape {
    /// A rounded tip: contact radius as force to the 1/3 (Hertz; Johnson, *Contact Mechanics*, 1985, eq. 4.22).
    Sphere,
    /// A pointed tip: contact radius as force to the 1/2 (Sneddon 1965, doi:10.1016/0020-7225(65)90019-4).
    Cone,
}

/// The nib as a contact spring, for the physics.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NibSpring {
    /// Normal stiffness `k`, N/m.
    pub stiffness: f64,
    /// Normal damping `c`, s/m: the force of a nib whose depth `d` grows at speed `v` is `k d (1 + c v)`, held between 0
    /// and `1.2 k d` (Hunt and Crossley 1975, doi:10.1115/1.3423596, with a linear spring and bounded loss).
    pub damping: f64,
    /// Stiffness of the bristles across the canvas, N/m: the nib bends this much before it slips.
    pub lateral_stiffness: f64,
    /// Damping of the bristles, N s/m.
    pub lateral_damping: f64,
    /// Coulomb friction coefficient `mu` on paper; a canvas may scale it.
    pub friction: f64,
    /// Radius of the ball that the nib ends in, m; 0 is a point. It decides how far the nib enters a gap and how it climbs an edge.
    pub radius: f64,
}

/// Speeds below this are taken for this where a steady line's width is asked for, m/s.
const SLOWEST: f64 = 1e-3;

/// A kind of pen. Lengths in m, forces in N, speeds in m/s, volumes in m^3.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PenModel {
    /// Name, as in scenarios.
    pub name: String,
    /// Shape of the tip.
    pub tip: TipShape,
    /// Width of a line drawn with hardly any force, m.
    pub width_at_rest: f64,
    /// Width of a line at the nominal force and speed, m.
    pub width_nominal: f64,
    /// Width at which the nib is squeezed flat, m.
    pub width_max: f64,
    /// The nib as a spring.
    pub spring: NibSpring,
    /// Below this normal force the nib skips: no ink, N.
    pub force_min: f64,
    /// Force at which width and density are nominal, N.
    pub force_nominal: f64,
    /// Force that damages the nib, N. The ink goes on; measurements may warn.
    pub force_max: f64,
    /// Speed at which width and density are nominal, m/s.
    pub speed_nominal: f64,
    /// Fastest speed at which the feed keeps up with a full line of nominal width, m/s.
    pub speed_rated: f64,
    /// Share of the nominal deposit that the paper absorbs over time, 0..1; the rest wets its roughness at once.
    pub absorbed_share: f64,
    /// Largest density that paper takes up; more ink than that spreads.
    pub density_max: f64,
    /// Density below which a line breaks up into nothing.
    pub density_min: f64,
    /// Growth of a blot's width, m per square root of a second.
    pub blot_rate: f64,
    /// Largest growth of a blot's width, m.
    pub blot_max: f64,
    /// Ink in a full pen, m^3.
    pub volume: f64,
    /// Length of nominal line in a full pen if it didn't fade, m.
    pub line_length: f64,
    /// The last share of the volume over which the line fades, 0..1.
    pub fade_share: f64,
    /// How the nib dries in the open; `None` when it doesn't.
    pub drying: Option<Drying>,
}

/// How a nib dries that is neither capped nor drawing.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Drying {
    /// Time in the open after which its line begins to fade, s.
    pub open: f64,
    /// Time after that in which the line's density falls to 1/e, s.
    pub fade: f64,
    /// Length of line that brings the ink back, m: what is left of the drying falls to 1/e.
    pub recovery: f64,
}

impl Drying {
    /// Share of the density that a nib gives which has been in the open for `time` s.
    pub fn share(&self, time: f64) -> f64 {
        (-((time - self.open).max(0.0) / self.fade)).exp()
    }
}

/// The pens that come with the program: name and TOML text.
const PENS: [(&str, &str); 4] = [
    ("felt_tip", include_str!("../../../../pens/felt_tip.toml")),
    ("fineliner_04", include_str!("../../../../pens/fineliner_04.toml")),
    ("fineliner_08", include_str!("../../../../pens/fineliner_08.toml")),
    ("marker", include_str!("../../../../pens/marker.toml")),
];

impl PenModel {
    /// Names of the pens that come with the program, sorted.
    pub fn known() -> impl Iterator<Item = &'static str> {
        PENS.iter().map(|(name, _)| *name)
    }

    /// The pen of a [known](Self::known) name; `None` of any other.
    pub fn named(name: &str) -> Option<Self> {
        let (name, text) = PENS.iter().find(|(known, _)| *known == name)?;
        Self::parse(text, Path::new(&format!("pens/{name}.toml"))).ok()
    }

    /// Reads a pen from a TOML file.
    ///
    /// # Errors
    /// [`ConfigError`] with file and line when it can't be read, a key is unknown or missing, or a number is out of its
    /// range.
    pub fn read(file: &Path) -> Result<Self, ConfigError> {
        let text =
            files::read_text(file).map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })?;
        Self::parse(&text, file)
    }

    /// Parses a pen from TOML text; `file` is named in errors, which are those of [`read`](Self::read).
    pub fn parse(text: &str, file: &Path) -> Result<Self, ConfigError> {
        let pen: PenFile = diagnostic::parse(text, file)?;
        pen.check().map_err(|(key, message)| diagnostic::invalid(text, file, key, message))?;
        let PenFile { name, nib, contact, force, flow, reservoir, drying } = pen;
        Ok(Self {
            name,
            tip: nib.tip,
            width_at_rest: nib.width_at_rest_mm * 1e-3,
            width_nominal: nib.width_nominal_mm * 1e-3,
            width_max: nib.width_max_mm * 1e-3,
            spring: NibSpring {
                stiffness: contact.stiffness_n_m,
                damping: contact.damping_s_m,
                lateral_stiffness: contact.lateral_stiffness_n_m,
                lateral_damping: contact.lateral_damping_n_s_m,
                friction: contact.friction,
                radius: nib.radius_mm * 1e-3,
            },
            force_min: force.min_n,
            force_nominal: force.nominal_n,
            force_max: force.max_n,
            speed_nominal: flow.nominal_speed_mm_s * 1e-3,
            speed_rated: flow.rated_speed_mm_s * 1e-3,
            absorbed_share: flow.absorbed_share,
            density_max: flow.density_max,
            density_min: flow.density_min,
            blot_rate: flow.blot_mm_sqrt_s * 1e-3,
            blot_max: flow.blot_max_mm * 1e-3,
            volume: reservoir.volume_ml * 1e-6,
            line_length: reservoir.line_m,
            fade_share: reservoir.fade_share,
            drying: drying.map(|d| Drying { open: d.open_s, fade: d.fade_s, recovery: d.recovery_mm * 1e-3 }),
        })
    }

    /// Width of the nib's contact, m, under a normal force, N: `w = min(w_rest + (w_nominal - w_rest) (F/F_nominal)^p,
    /// w_max)` with `p` by [`TipShape`]; 0 without force.
    pub fn contact_width(&self, force: f64) -> f64 {
        if force <= 0.0 {
            return 0.0;
        }
        let f = force / self.force_nominal;
        let growth = match self.tip {
            TipShape::Sphere => f.cbrt(),
            TipShape::Cone => f.sqrt(),
        };
        (self.width_at_rest + (self.width_nominal - self.width_at_rest) * growth).min(self.width_max)
    }

    /// Width of the line, m, that a steady press of `force`, N, draws at `speed`, m/s: the contact and what ink spreads
    /// beyond it in the time `w / v` that the nib takes to pass.
    pub fn line_width(&self, force: f64, speed: f64) -> f64 {
        let contact = self.contact_width(force);
        contact + self.spread(contact / speed.max(SLOWEST))
    }

    /// Least and largest force, N, that is planned for a line of desired width: four times what makes the nib skip, since forces
    /// waver, and what squeezes the nib flat or damages it.
    pub fn force_range(&self) -> [f64; 2] {
        let share = (self.width_max - self.width_at_rest) / (self.width_nominal - self.width_at_rest).max(1e-9);
        let flat = self.force_nominal
            * match self.tip {
                TipShape::Sphere => share.powi(3),
                TipShape::Cone => share.powi(2),
            };
        let least = (4.0 * self.force_min).min(self.force_nominal).max(1e-3 * self.force_nominal);
        [least, flat.min(self.force_max).max(least)]
    }

    /// Narrowest and widest line, m, at the nominal speed.
    pub fn width_range(&self) -> [f64; 2] {
        self.force_range().map(|force| self.line_width(force, self.speed_nominal))
    }

    /// Force, N, for a line of this width, m, at this speed, m/s: the inverse of [`line_width`](Self::line_width) within
    /// [`force_range`](Self::force_range), and the nearest end of that for widths out of reach.
    pub fn force_for_width(&self, width: f64, speed: f64) -> f64 {
        let [mut low, mut high] = self.force_range();
        if self.line_width(high, speed) <= width {
            return high;
        }
        // the width never falls with force, so halving finds it; 50 times reach the last bits
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.line_width(middle, speed) < width { low = middle } else { high = middle }
        }
        high
    }

    /// Time for which a point under the nib is wetted at the nominal force and speed, s: `t_n = w_n / v_n`.
    pub fn wetting_time_nominal(&self) -> f64 {
        self.width_nominal / self.speed_nominal
    }

    /// By how much ink spreads beyond the contact, m, at a wetting time, s: `b (sqrt(t) - sqrt(t_n))` between 0 and the
    /// pen's bound, after Lucas and Washburn (doi:10.1103/PhysRev.17.273), whose front advances as the root of time.
    pub fn spread(&self, wetting_time: f64) -> f64 {
        (self.blot_rate * (wetting_time.sqrt() - self.wetting_time_nominal().sqrt())).clamp(0.0, self.blot_max)
    }

    /// Density of the deposit of a full pen, in units of the nominal line's: what paper takes up or what the feed
    /// delivers, whichever is less; at most [`density_max`](Self::density_max).
    ///
    /// - Taken up after the wetting time `t`: `1 - s + s sqrt(t / t_n)`, Bristow's law of absorption, `s` the absorbed
    ///   share (Svensk Papperstidning 70 (1967) 623).
    /// - Delivered at slip speed `v`, m/s, on contact width `w`, m: `w_n v_rated / (w v)`, a feed of bounded flow.
    pub fn density(&self, wetting_time: f64, speed: f64, width: f64) -> f64 {
        let s = self.absorbed_share;
        let taken = 1.0 - s + s * (wetting_time / self.wetting_time_nominal()).sqrt();
        let full_feed = self.width_nominal * self.speed_rated;
        let swept = width * speed;
        let delivered = if swept * self.density_max > full_feed { full_feed / swept } else { self.density_max };
        taken.min(delivered).min(self.density_max)
    }

    /// Thickness of wet ink at density 1, m: the volume over the area of all the line in a pen.
    pub fn film(&self) -> f64 {
        self.volume / (self.line_length * self.width_nominal)
    }

    /// Factor on density when `left`, m^3, of the ink is left: 1, then falling in proportion over the last
    /// [`fade_share`](Self::fade_share), as the flow from a draining wick falls with its saturation.
    pub fn fade(&self, left: f64) -> f64 {
        let fading = self.fade_share * self.volume;
        if left >= fading { 1.0 } else { (left / fading).max(0.0) }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PenFile {
    name: String,
    nib: NibTable,
    contact: ContactTable,
    force: ForceTable,
    flow: FlowTable,
    reservoir: ReservoirTable,
    drying: Option<DryingTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NibTable {
    tip: TipShape,
    width_at_rest_mm: f64,
    width_nominal_mm: f64,
    width_max_mm: f64,
    #[serde(default)]
    radius_mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ContactTable {
    stiffness_n_m: f64,
    damping_s_m: f64,
    lateral_stiffness_n_m: f64,
    lateral_damping_n_s_m: f64,
    friction: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ForceTable {
    min_n: f64,
    nominal_n: f64,
    max_n: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FlowTable {
    nominal_speed_mm_s: f64,
    rated_speed_mm_s: f64,
    absorbed_share: f64,
    density_max: f64,
    density_min: f64,
    blot_mm_sqrt_s: f64,
    blot_max_mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReservoirTable {
    volume_ml: f64,
    line_m: f64,
    fade_share: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DryingTable {
    open_s: f64,
    fade_s: f64,
    recovery_mm: f64,
}

impl PenFile {
    /// Every number against its range; the key and what would be right of the first that is out.
    fn check(&self) -> Result<(), (&'static str, String)> {
        let (nib, contact, force, flow, reservoir) =
            (&self.nib, &self.contact, &self.force, &self.flow, &self.reservoir);
        // Generous bounds, m or N or s being what they may: they keep every later quotient finite.
        let ranges = [
            ("nib.width_at_rest_mm", nib.width_at_rest_mm, 1e-3, 100.0),
            ("nib.width_nominal_mm", nib.width_nominal_mm, nib.width_at_rest_mm, 100.0),
            ("nib.width_max_mm", nib.width_max_mm, nib.width_nominal_mm, 100.0),
            ("nib.radius_mm", nib.radius_mm, 0.0, 20.0),
            ("contact.stiffness_n_m", contact.stiffness_n_m, 1e3, 1e6),
            ("contact.damping_s_m", contact.damping_s_m, 0.0, 1e3),
            ("contact.lateral_stiffness_n_m", contact.lateral_stiffness_n_m, 1e3, 1e5),
            ("contact.lateral_damping_n_s_m", contact.lateral_damping_n_s_m, 0.0, 1e3),
            ("contact.friction", contact.friction, 0.0, 2.0),
            ("force.min_n", force.min_n, 0.0, 100.0),
            ("force.nominal_n", force.nominal_n, force.min_n.max(1e-3), 100.0),
            ("force.max_n", force.max_n, force.nominal_n, 1000.0),
            ("flow.nominal_speed_mm_s", flow.nominal_speed_mm_s, 0.1, 1e4),
            ("flow.rated_speed_mm_s", flow.rated_speed_mm_s, flow.nominal_speed_mm_s, 1e5),
            ("flow.absorbed_share", flow.absorbed_share, 0.0, 1.0),
            ("flow.density_max", flow.density_max, 1.0, 10.0),
            ("flow.density_min", flow.density_min, 1e-4, 0.9),
            ("flow.blot_mm_sqrt_s", flow.blot_mm_sqrt_s, 0.0, 100.0),
            ("flow.blot_max_mm", flow.blot_max_mm, 0.0, 100.0),
            ("reservoir.volume_ml", reservoir.volume_ml, 1e-6, 1e6),
            ("reservoir.line_m", reservoir.line_m, 1e-3, 1e9),
            ("reservoir.fade_share", reservoir.fade_share, 1e-3, 1.0),
        ];
        let drying = self.drying.iter().flat_map(|d| {
            [
                ("drying.open_s", d.open_s, 0.0, 1e7),
                ("drying.fade_s", d.fade_s, 1e-3, 1e7),
                ("drying.recovery_mm", d.recovery_mm, 1e-3, 1e4),
            ]
        });
        for (key, value, low, high) in ranges.into_iter().chain(drying) {
            if !(low..=high).contains(&value) {
                return Err((key, format!("`{key}` is {value}, but must lie between {low} and {high}")));
            }
        }
        if self.name.is_empty() {
            return Err(("name", "`name` is empty, but a pen needs one".to_string()));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pens() -> Vec<PenModel> {
        PenModel::known().map(|name| PenModel::named(name).expect("a known pen parses")).collect()
    }

    #[test]
    fn every_pen_carries_its_name() {
        for (name, text) in PENS {
            let pen = PenModel::parse(text, Path::new(name)).unwrap();
            assert_eq!(pen.name, name);
        }
    }

    #[test]
    fn width_and_density_are_nominal_at_the_nominal_force_and_speed() {
        for pen in pens() {
            let w = pen.contact_width(pen.force_nominal);
            let t = w / pen.speed_nominal;
            assert!((w - pen.width_nominal).abs() < 1e-12);
            assert!((pen.density(t, pen.speed_nominal, w) - 1.0).abs() < 1e-9 && pen.spread(t) < 1e-9);
        }
    }

    #[test]
    fn a_fineliner_08_pressed_3_mm_at_350_n_m_draws_0_8_mm() {
        let pen = PenModel::named("fineliner_08").unwrap();
        assert!((pen.contact_width(350.0 * 3e-3) - 0.8e-3).abs() < 1e-12);
    }

    #[test]
    fn a_full_pen_holds_its_metres_of_line() {
        for pen in pens() {
            assert!((pen.film() * pen.width_nominal * pen.line_length / pen.volume - 1.0).abs() < 1e-12);
            assert!((1e-6..1e-5).contains(&pen.film()), "{}: a wet film of {} m", pen.name, pen.film());
        }
    }

    #[test]
    fn a_number_out_of_range_is_refused_at_its_line() {
        let text = PENS[1].1.replace("width_max_mm = 0.55", "width_max_mm = 0.35");
        let error = PenModel::parse(&text, Path::new("thin.toml")).unwrap_err().to_string();
        assert_eq!(error, "thin.toml:9: `nib.width_max_mm` is 0.35, but must lie between 0.4 and 100");
    }

    proptest! {
        #[test]
        fn width_grows_with_force_and_density_falls_with_speed(f in 0.0..8.0f64, df in 0.0..2.0f64, v in 0.0..2.0f64, dv in 0.0..1.0f64) {
            for pen in pens() {
                prop_assert!(pen.contact_width(f + df) >= pen.contact_width(f));
                prop_assert!(pen.contact_width(f) <= pen.width_max);
                let at = |v: f64| pen.density(pen.width_nominal / (v + 1e-6), v, pen.width_nominal);
                prop_assert!(at(v + dv) <= at(v) && at(v) <= pen.density_max && at(v + dv) >= 0.0);
            }
        }

        #[test]
        fn force_for_width_is_the_inverse_of_line_width(share in 0.0..1.0f64, speed in 2e-3..0.2f64, off in 1e-4..1e-2f64) {
            for pen in pens() {
                let [low, high] = pen.force_range();
                let [narrow, wide] = [low, high].map(|f| pen.line_width(f, speed));
                let width = narrow + share * (wide - narrow);
                let force = pen.force_for_width(width, speed);
                prop_assert!((low..=high).contains(&force));
                prop_assert!((pen.line_width(force, speed) / width - 1.0).abs() < 1e-9, "{}: {} N", pen.name, force);
                prop_assert_eq!(pen.force_for_width(wide + off, speed), high);
                prop_assert!((pen.force_for_width(narrow - off, speed) / low - 1.0).abs() < 1e-6);
            }
        }

        #[test]
        fn arbitrary_text_never_panics(text in "\\PC*", cut in 0usize..900, put in "[-0-9a-z.=\\[\\]\"\n ]{0,12}") {
            let _ = PenModel::parse(&text, Path::new("x.toml"));
            let mut near: String = PENS[0].1.to_string();
            let cut = cut.min(near.len());
            near.insert_str(cut, &put);
            let _ = PenModel::parse(&near, Path::new("x.toml"));
        }
    }
}
