//! Perceptual colours: Oklab, CIELAB and the CIEDE2000 difference.
//!
//! Oklab is Björn Ottosson's (2020, <https://bottosson.github.io/posts/oklab/>), from linear sRGB. CIELAB (CIE 15:2018) is for
//! D65 and the 2 degree observer, through the sRGB primaries of IEC 61966-2-1.
use crate::math::{Rgb, linear_from_srgb};

/// White of D65, `X`, `Y`, `Z`: the sum of the columns of [`XYZ_FROM_RGB`].
const WHITE: [f64; 3] = [0.950_455_9, 1.0, 1.089_057_8];

/// IEC 61966-2-1.
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [0.412_390_8, 0.357_584_3, 0.180_480_8],
    [0.212_639_0, 0.715_168_7, 0.072_192_3],
    [0.019_330_8, 0.119_194_8, 0.950_532_2],
];

/// A colour in Oklab: lightness 0..=1, green to red, blue to yellow.
pub type Oklab = [f32; 3];

/// Oklab of a colour in linear light.
pub fn oklab_from_linear([r, g, b]: [f32; 3]) -> Oklab {
    let l = (0.412_221_47 * r + 0.536_332_55 * g + 0.051_445_995 * b).cbrt();
    let m = (0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b).cbrt();
    let s = (0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b).cbrt();
    [
        0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s,
        1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
        0.025_904_037 * l + 0.782_771_77 * m - 0.808_675_77 * s,
    ]
}

/// The colour in linear light of Oklab; outside 0..=1 where no display shows it.
pub fn linear_from_oklab([lightness, a, b]: Oklab) -> [f32; 3] {
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
}

/// Linear light of an sRGB colour.
pub fn linear_from_rgb(color: Rgb) -> [f32; 3] {
    color.0.map(|v| linear_from_srgb(v) as f32)
}

/// Oklab of an sRGB colour.
pub fn oklab_from_rgb(color: Rgb) -> Oklab {
    oklab_from_linear(linear_from_rgb(color))
}

/// Square of the difference of two colours: their distance in Oklab with both axes of chroma counted twice, without which
/// greys and faint colours are taken for each other. White to black is 1.
pub fn oklab_difference2(p: Oklab, q: Oklab) -> f32 {
    let d = [p[0] - q[0], 2.0 * (p[1] - q[1]), 2.0 * (p[2] - q[2])];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// CIELAB (`L*` 0..=100, `a*`, `b*`; D65) of a colour in linear light.
pub fn cielab_from_linear(rgb: [f64; 3]) -> [f64; 3] {
    let f = |row: usize| {
        let m = XYZ_FROM_RGB[row];
        let t = (m[0] * rgb[0] + m[1] * rgb[1] + m[2] * rgb[2]) / WHITE[row];
        let d = 6.0 / 29.0;
        if t > d * d * d { t.cbrt() } else { t / (3.0 * d * d) + 4.0 / 29.0 }
    };
    let (x, y, z) = (f(0), f(1), f(2));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The CIEDE2000 difference of two CIELAB colours; about 1 is just seen side by side.
///
/// As written down by Sharma, Wu and Dalal (2005), doi:10.1002/col.20070, with `kL = kC = kH = 1`.
pub fn ciede2000(p: [f64; 3], q: [f64; 3]) -> f64 {
    let chroma = |c: [f64; 3]| c[1].hypot(c[2]);
    let compressed = |c: f64| (c.powi(7) / (c.powi(7) + 25f64.powi(7))).sqrt();
    let g = 0.5 * (1.0 - compressed((chroma(p) + chroma(q)) / 2.0));
    let polar = |c: [f64; 3]| {
        let a = (1.0 + g) * c[1];
        let hue = if a == 0.0 && c[2] == 0.0 { 0.0 } else { c[2].atan2(a).to_degrees().rem_euclid(360.0) };
        (a.hypot(c[2]), hue)
    };
    let ((c1, h1), (c2, h2)) = (polar(p), polar(q));
    let grey = c1 * c2 == 0.0;
    let mut dh = if grey { 0.0 } else { h2 - h1 };
    let mut hue = if grey { h1 + h2 } else { (h1 + h2) / 2.0 };
    if dh.abs() > 180.0 {
        // The short way round the circle, and the mean on that side.
        dh -= 360.0 * dh.signum();
        hue += if h1 + h2 < 360.0 { 180.0 } else { -180.0 };
    }
    let d_hue = 2.0 * (c1 * c2).sqrt() * (dh / 2.0).to_radians().sin();
    let (light, c) = ((p[0] + q[0]) / 2.0, (c1 + c2) / 2.0);
    let cos = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cos(hue - 30.0) + 0.24 * cos(2.0 * hue) + 0.32 * cos(3.0 * hue + 6.0)
        - 0.20 * cos(4.0 * hue - 63.0);
    let s_light = 1.0 + 0.015 * (light - 50.0).powi(2) / (20.0 + (light - 50.0).powi(2)).sqrt();
    let (s_chroma, s_hue) = (1.0 + 0.045 * c, 1.0 + 0.015 * c * t);
    let turn = 60.0 * (-((hue - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * compressed(c) * turn.to_radians().sin();
    let (l, c, h) = ((q[0] - p[0]) / s_light, (c2 - c1) / s_chroma, d_hue / s_hue);
    (l * l + c * c + h * h + rotation * c * h).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Pairs of colours and their difference, from table 1 of doi:10.1002/col.20070.
    const SHARMA: [([f64; 3], [f64; 3], f64); 20] = [
        ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
        ([50.0, 3.1571, -77.2803], [50.0, 0.0, -82.7485], 2.8615),
        ([50.0, 2.8361, -74.0200], [50.0, 0.0, -82.7485], 3.4412),
        ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0000),
        ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0009], 7.1792),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0011], 7.2195),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0009, -2.4900], 4.8045),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0011, -2.4900], 4.7461),
        ([50.0, 2.5, 0.0], [50.0, 0.0, -2.5], 4.3065),
        ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
        ([50.0, 2.5, 0.0], [61.0, -5.0, 29.0], 22.8977),
        ([50.0, 2.5, 0.0], [56.0, -27.0, -3.0], 31.9030),
        ([50.0, 2.5, 0.0], [58.0, 24.0, 15.0], 19.4535),
        ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
        ([63.0109, -31.0961, -5.8663], [62.8187, -29.7946, -4.0864], 1.2630),
        ([35.0831, -44.1164, 3.7933], [35.0232, -40.0716, 1.5901], 1.8645),
        ([36.4612, 47.8580, 18.3852], [36.2715, 50.5065, 21.2231], 1.4146),
        ([90.8027, -2.0831, 1.4410], [91.1528, -1.6435, 0.0447], 1.4441),
        ([2.0776, 0.0795, -1.1350], [0.9033, -0.0636, -0.5514], 0.9082),
    ];

    #[test]
    fn published_differences_are_met_both_ways() {
        for (p, q, difference) in SHARMA {
            assert!((ciede2000(p, q) - difference).abs() < 5e-5, "{p:?} {q:?}: {}", ciede2000(p, q));
            assert!((ciede2000(q, p) - difference).abs() < 5e-5);
        }
    }

    #[test]
    fn white_black_and_red_are_where_they_should_be() {
        let near = |a: [f64; 3], b: [f64; 3], by: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() < by);
        assert!(near(cielab_from_linear([1.0; 3]), [100.0, 0.0, 0.0], 1e-4));
        assert!(near(cielab_from_linear([0.0; 3]), [0.0; 3], 1e-9));
        assert!(near(cielab_from_linear([1.0, 0.0, 0.0]), [53.24, 80.09, 67.20], 0.02));
        assert!(near(oklab_from_linear([1.0, 0.0, 0.0]).map(f64::from), [0.62796, 0.22486, 0.12585], 1e-4));
        assert!(near(oklab_from_linear([1.0; 3]).map(f64::from), [1.0, 0.0, 0.0], 1e-5));
    }

    proptest! {
        #[test]
        fn oklab_comes_back(r in 0.0f32..1.0, g in 0.0f32..1.0, b in 0.0f32..1.0) {
            let back = linear_from_oklab(oklab_from_linear([r, g, b]));
            prop_assert!([r, g, b].iter().zip(back).all(|(a, b)| (a - b).abs() < 2e-5), "{:?}", back);
        }
    }
}
