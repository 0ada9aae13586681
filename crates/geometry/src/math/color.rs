//! Colours: sRGB, linear light, paper.
use serde::{Deserialize, Serialize};

/// A colour, sRGB, 0..=255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Rgb(pub [u8; 3]);

/// The paper of pictures unless another is asked for: a very light warm white.
pub const PAPER: Rgb = Rgb([0xfd, 0xfc, 0xf8]);

/// Linear light, 0..=1, of an sRGB value (IEC 61966-2-1).
pub fn linear_from_srgb(value: u8) -> f64 {
    light_of_srgb(f64::from(value) / 255.0)
}

/// Linear light of an sRGB value of any depth, both 0..=1 (IEC 61966-2-1).
pub fn light_of_srgb(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB value nearest to a linear light, which is clamped to 0..=1.
pub fn srgb_from_linear(light: f64) -> u8 {
    let l = light.clamp(0.0, 1.0);
    let v = if l <= 0.0031308 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
    (255.0 * v).round() as u8
}

/// [`srgb_from_linear`] by table, for pictures of many pixels.
pub struct SrgbTable(Vec<u8>);

impl SrgbTable {
    /// Sixteen steps of linear light to the steepest step of sRGB, so that a value is off by 1 only where it lies within a
    /// sixteenth of a rounding edge.
    const LAST: usize = 65_535;

    /// Computes the table.
    pub fn new() -> Self {
        Self((0..=Self::LAST).map(|i| srgb_from_linear(i as f64 / Self::LAST as f64)).collect())
    }

    /// The sRGB value of a linear light, which is clamped to 0..=1.
    pub fn get(&self, light: f32) -> u8 {
        self.0[((light * Self::LAST as f32 + 0.5) as usize).min(Self::LAST)]
    }
}

impl Default for SrgbTable {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_survives_linear_light_and_the_table() {
        let table = SrgbTable::new();
        for v in 0..=255 {
            assert_eq!(srgb_from_linear(linear_from_srgb(v)), v);
            assert_eq!(table.get(linear_from_srgb(v) as f32), v);
        }
    }
}
