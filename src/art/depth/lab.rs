//! TEMP
use crate::picture::Plane;
pub fn oklab(p: [f32; 3]) -> [f32; 3] {
    let l = (0.4122214708 * p[0] + 0.5363325363 * p[1] + 0.0514459929 * p[2]).cbrt();
    let m = (0.2119034982 * p[0] + 0.6806995451 * p[1] + 0.1073969566 * p[2]).cbrt();
    let s = (0.0883024619 * p[0] + 0.2817188376 * p[1] + 0.6299787005 * p[2]).cbrt();
    [
        0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
        1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
        0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s,
    ]
}
pub fn blur(p: &Plane, sigma: f64) -> Plane {
    let (w, h) = (p.width(), p.height());
    let r = (3.0 * sigma).ceil() as i64;
    let k: Vec<f32> = (-r..=r).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp() as f32).collect();
    let t: f32 = k.iter().sum();
    let a = Plane::from_fn(w, h, |x, y| {
        (-r..=r).zip(&k).map(|(i, k)| k * p.at((x as i64 + i).clamp(0, w as i64 - 1) as usize, y)).sum::<f32>() / t
    });
    Plane::from_fn(w, h, |x, y| {
        (-r..=r).zip(&k).map(|(i, k)| k * a.at(x, (y as i64 + i).clamp(0, h as i64 - 1) as usize)).sum::<f32>() / t
    })
}
