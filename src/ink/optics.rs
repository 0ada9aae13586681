//! Light, ink and paper: sRGB to linear light and back, and how strongly an ink absorbs.
use crate::math::Rgb;

/// The paper of pictures unless another is asked for: a very light warm white.
pub const PAPER: Rgb = Rgb([0xfd, 0xfc, 0xf8]);

/// The darkest linear light an ink may have: a quarter of a step of 8-bit sRGB, which rounds to black. A channel of 0 would
/// absorb without end.
const DARKEST: f64 = 0.25 / 255.0 / 12.92;

/// Linear light, 0..=1, of an sRGB value (IEC 61966-2-1).
pub fn linear_from_srgb(value: u8) -> f64 {
    let v = f64::from(value) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB value nearest to a linear light, which is clamped to 0..=1.
pub fn srgb_from_linear(light: f64) -> u8 {
    let l = light.clamp(0.0, 1.0);
    let v = if l <= 0.0031308 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
    (255.0 * v).round() as u8
}

/// How strongly an ink absorbs red, green and blue: `a = ln(paper / ink)` in linear light, at least 0, so that by the law of
/// Beer and Lambert paper under density `D` shows `paper exp(-D a)`, and under density 1 the ink's colour.
pub fn absorbance(ink: Rgb, paper: Rgb) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (ink, paper) = (linear_from_srgb(ink.0[k]).max(DARKEST), linear_from_srgb(paper.0[k]).max(DARKEST));
        (paper / ink).ln().max(0.0)
    })
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

    #[test]
    fn density_1_shows_the_inks_colour_and_2_a_darker_one() {
        for ink in [Rgb([0, 0, 0]), Rgb([200, 30, 40]), Rgb([0, 128, 255]), Rgb([253, 252, 10])] {
            let a = absorbance(ink, PAPER);
            for (k, a) in a.iter().enumerate() {
                let shown = |density: f64| srgb_from_linear(linear_from_srgb(PAPER.0[k]) * (-density * a).exp());
                assert_eq!(shown(1.0), ink.0[k].min(PAPER.0[k]));
                assert!(shown(2.0) <= shown(1.0) && shown(0.0) == PAPER.0[k]);
            }
        }
    }
}
