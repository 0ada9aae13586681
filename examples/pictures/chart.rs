//! Flat test pictures: a chart with known tones, colours, lines and transparency, and a 16-bit ramp.
use crate::field::smoothstep;

pub const WIDTH: usize = 512;
pub const HEIGHT: usize = 384;
pub const RAMP: (usize, usize) = (256, 32);

/// Widths of the lines of the chart, px.
const LINES: [f64; 6] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0];
/// Patches in sRGB: the six primaries, then four inks and two skin tones.
const PATCHES: [u32; 12] = [
    0xff0000, 0x00ff00, 0x0000ff, 0x00ffff, 0xff00ff, 0xffff00, 0x17697a, 0xd4472a, 0x1f6fc4, 0x1b1b1f, 0xf0c8a8,
    0x8d5a3c,
];

/// One pixel of the chart, sRGB with alpha.
///
/// | rows | content |
/// |---|---|
/// | 0-47 | grey ramp, black to white, linear in sRGB |
/// | 48-95 | sixteen grey steps of 17 |
/// | 96-191 | twelve colour patches in two rows, each 85 or 86 px wide |
/// | 192-383, x 0-191 | radial star of 36 spokes |
/// | 192-383, x 192-351 | lines of 1 to 8 px, upright above and slanted below |
/// | 192-287, x 352-511 | smooth blob |
/// | 288-335, x 352-511 | checker of 8 px |
/// | 336-383, x 352-511 | vermilion, alpha 0 to 255 |
fn pixel(x: usize, y: usize) -> [u8; 4] {
    let opaque = |v: f64| {
        let v = v.clamp(0.0, 255.0).round() as u8;
        [v, v, v, 255]
    };
    let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
    match (y, x) {
        (0..48, _) => opaque(255.0 * x as f64 / (WIDTH - 1) as f64),
        (48..96, _) => opaque(17.0 * (x / 32) as f64),
        (96..192, _) => {
            let [_, r, g, b] = PATCHES[(y - 96) / 48 * 6 + (x * 6 / WIDTH)].to_be_bytes();
            [r, g, b, 255]
        }
        (192.., 0..192) => {
            let (dx, dy) = (px - 96.0, py - 288.0);
            let r = dx.hypot(dy);
            let wave = (dy.atan2(dx) * 36.0).sin() * r / 36.0;
            let spoke = (0.5 + wave).clamp(0.0, 1.0);
            opaque(255.0 * (1.0 - (1.0 - spoke) * smoothstep(92.0, 91.0, r)))
        }
        (192.., 192..352) => {
            // the slanted ones lean by one px in four, their width is measured across
            let lean = if y < 288 { 0.0 } else { (py - 288.0) * 0.25 };
            let across = if y < 288 { 1.0 } else { 1.0 / 1.0625f64.sqrt() };
            let covered = LINES.iter().enumerate().map(|(i, width)| {
                let away = (px - lean - (208.0 + 20.0 * i as f64)).abs() * across;
                (0.5 * width + 0.5 - away).clamp(0.0, 1.0)
            });
            opaque(255.0 * (1.0 - covered.fold(0.0, f64::max)))
        }
        (192..288, _) => {
            let (dx, dy) = ((px - 432.0) / 40.0, (py - 240.0) / 26.0);
            opaque(255.0 * (1.0 - 0.9 * (-(dx * dx + dy * dy)).exp()))
        }
        (288..336, _) => opaque(if (x / 8 + y / 8).is_multiple_of(2) { 0.0 } else { 255.0 }),
        _ => [0xd4, 0x47, 0x2a, ((x - 352) as f64 * 255.0 / 159.0).round() as u8],
    }
}

/// The chart as RGBA bytes.
pub fn chart() -> Vec<u8> {
    (0..WIDTH * HEIGHT).flat_map(|i| pixel(i % WIDTH, i / WIDTH)).collect()
}

/// Values of the 16-bit ramp, 0 to 1: upper half from black to white; lower half one 16-bit level a pixel about the
/// middle grey, which 8 bits cannot show.
pub fn ramp() -> impl Iterator<Item = f64> {
    let (width, height) = RAMP;
    (0..width * height).map(move |i| {
        let (x, y) = (i % width, i / width);
        if y < height / 2 { x as f64 / (width - 1) as f64 } else { (32768.0 - 128.0 + x as f64) / 65535.0 }
    })
}
