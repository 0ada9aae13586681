//! `[localisation]`: how a base finds out where it stands.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::twin::{LocaliserKind, LocaliserOptions};

/// `[localisation]`: what measures where a base stands. Numbers that are absent are those of the sensor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LocalisationSettings {
    /// Which sensor. Numbers that are absent are its own.
    pub sensor: LocaliserKind,
    /// Standard deviation of one reading of the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub noise_mm: Option<f64>,
    /// Standard deviation of one reading of the heading.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 45))]
    pub noise_deg: Option<f64>,
    /// Readings that are averaged.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub readings: Option<u32>,
    /// What averaging leaves at least.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub floor_mm: Option<f64>,
    /// Standard deviation of a slow wander of the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub wander_mm: Option<f64>,
    /// Standard deviation of a slow wander of the heading.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 45))]
    pub wander_deg: Option<f64>,
    /// Time in which the wander is forgotten.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 1e6))]
    pub wander_s: Option<f64>,
    /// Bend of the measured volume 1.5 m from its middle, which is the sheet's; drawn once a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub warp_mm: Option<f64>,
    /// Error of the measured volume's scale; drawn once a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 50))]
    pub scale_percent: Option<f64>,
    /// Largest jump when the base is found again after a drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub jump_mm: Option<f64>,
    /// Share of drives after which it jumps.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 100))]
    pub jump_percent: Option<f64>,
    /// How far off the sensor is mounted; drawn once a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1000))]
    pub mounting_mm: Option<f64>,
    /// How far it is turned where it is mounted; drawn once a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 45))]
    pub mounting_deg: Option<f64>,
    /// Age of a reading.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 10_000))]
    pub latency_ms: Option<f64>,
}

impl LocalisationSettings {
    /// All that a known sensor has, as a file would say it.
    pub fn of(sensor: LocaliserKind) -> Self {
        let o = sensor.options();
        // 0.1 mm is 0.1 again, not 0.09999999999999999
        let neat = |x: f64| Some((x * 1e9).round() / 1e9);
        let mm = |x: f64| neat(x * 1e3);
        let deg = |x: f64| neat(x.to_degrees());
        Self {
            sensor,
            noise_mm: mm(o.noise[0]),
            noise_deg: deg(o.noise[1]),
            readings: Some(o.readings),
            floor_mm: mm(o.floor),
            wander_mm: mm(o.wander[0]),
            wander_deg: deg(o.wander[1]),
            wander_s: neat(o.wander_time),
            warp_mm: mm(o.warp),
            scale_percent: neat(o.scale * 1e2),
            jump_mm: mm(o.jump),
            jump_percent: neat(o.jump_rate * 1e2),
            mounting_mm: mm(o.mounting[0]),
            mounting_deg: deg(o.mounting[1]),
            latency_ms: mm(o.latency),
        }
    }

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
