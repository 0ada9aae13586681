//! `[localisation]`: how a base finds out where it stands.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::twin::{LocaliserKind, LocaliserOptions};

use super::check::Check;
use super::resolve::ScenarioError;

/// `[localisation]`: what measures where a base stands. Numbers that are absent are those of the sensor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LocalisationSettings {
    /// The sensor: `perfect`, `tracker`, `lidar` or `board`.
    pub sensor: LocaliserKind,
    /// Standard deviation of one reading, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_mm: Option<f64>,
    /// The same of the heading, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_deg: Option<f64>,
    /// Readings that are averaged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub readings: Option<u32>,
    /// What averaging leaves at least, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor_mm: Option<f64>,
    /// Standard deviation of a slow wander, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wander_mm: Option<f64>,
    /// The same of the heading, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wander_deg: Option<f64>,
    /// Time in which the wander is forgotten, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wander_s: Option<f64>,
    /// Bend of the measured volume 1.5 m from its middle, mm; drawn once a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warp_mm: Option<f64>,
    /// Error of the measured volume's scale, per cent; drawn once a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_percent: Option<f64>,
    /// Largest jump when the base is found again after a drive, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jump_mm: Option<f64>,
    /// Share of drives after which it jumps, per cent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jump_percent: Option<f64>,
    /// How far off the sensor is mounted, mm; drawn once a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting_mm: Option<f64>,
    /// The same of the heading, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting_deg: Option<f64>,
    /// Age of a reading, ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latency_ms: Option<f64>,
}

impl LocalisationSettings {
    /// The same in SI units.
    pub fn options(&self) -> LocaliserOptions {
        let o = self.sensor.options();
        let mm = |v: Option<f64>, or: f64| v.map_or(or, |v| v * 1e-3);
        let deg = |v: Option<f64>, or: f64| v.map_or(or, f64::to_radians);
        let percent = |v: Option<f64>, or: f64| v.map_or(or, |v| v * 1e-2);
        LocaliserOptions {
            noise: [mm(self.noise_mm, o.noise[0]), deg(self.noise_deg, o.noise[1])],
            readings: self.readings.unwrap_or(o.readings),
            floor: mm(self.floor_mm, o.floor),
            wander: [mm(self.wander_mm, o.wander[0]), deg(self.wander_deg, o.wander[1])],
            wander_time: self.wander_s.unwrap_or(o.wander_time),
            warp: mm(self.warp_mm, o.warp),
            scale: percent(self.scale_percent, o.scale),
            jump: mm(self.jump_mm, o.jump),
            jump_rate: percent(self.jump_percent, o.jump_rate),
            mounting: [mm(self.mounting_mm, o.mounting[0]), deg(self.mounting_deg, o.mounting[1])],
            latency: self.latency_ms.map_or(o.latency, |v| v * 1e-3),
        }
    }
}

/// Every number in its range.
pub(super) fn check_localisation(l: &LocalisationSettings, check: &Check) -> Result<(), ScenarioError> {
    let within = |key: &str, value: Option<f64>, most: f64| {
        value.map_or(Ok(()), |v| check.within(&format!("localisation.{key}"), v, 0.0, most))
    };
    within("noise_mm", l.noise_mm, 1000.0)?;
    within("noise_deg", l.noise_deg, 45.0)?;
    within("floor_mm", l.floor_mm, 1000.0)?;
    within("wander_mm", l.wander_mm, 1000.0)?;
    within("wander_deg", l.wander_deg, 45.0)?;
    if let Some(s) = l.wander_s {
        check.above_zero("localisation.wander_s", s, 1e6)?;
    }
    within("warp_mm", l.warp_mm, 1000.0)?;
    within("scale_percent", l.scale_percent, 50.0)?;
    within("jump_mm", l.jump_mm, 1000.0)?;
    within("jump_percent", l.jump_percent, 100.0)?;
    within("mounting_mm", l.mounting_mm, 1000.0)?;
    within("mounting_deg", l.mounting_deg, 45.0)?;
    within("latency_ms", l.latency_ms, 10_000.0)?;
    if l.readings == Some(0) {
        return Err(check.wrong("localisation.readings", "must be at least 1"));
    }
    Ok(())
}
