//! How strongly an ink absorbs light.
use crate::math::{Rgb, linear_from_srgb};

/// The darkest linear light an ink may have: a quarter of a step of 8-bit sRGB, which rounds to black. A channel of 0 would
/// absorb without end.
const DARKEST: f64 = 0.25 / 255.0 / 12.92;

/// How strongly an ink absorbs red, green and blue: `a = ln(paper / ink)` in linear light, at least 0, so that by the law of
/// Beer and Lambert paper under density `D` shows `paper exp(-D a)`, and under density 1 the ink's colour.
pub fn absorbance(ink: Rgb, paper: Rgb) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (ink, paper) = (linear_from_srgb(ink.0[k]).max(DARKEST), linear_from_srgb(paper.0[k]).max(DARKEST));
        (paper / ink).ln().max(0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{PAPER, srgb_from_linear};

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
