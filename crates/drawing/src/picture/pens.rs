//! Separation into a fixed set of pens: those that one owns.
use rayon::prelude::*;

use crate::math::Rgb;
use crate::picture::color::{linear_from_rgb, oklab_difference2, oklab_from_linear};
use crate::picture::cube::Cube;
use crate::picture::{Ink, Picture, Plane, Tone};

/// Nodes along each channel of the lattice on which shares of pens are solved for.
const SIDE: usize = 17;

/// How much a pen that is far from the colour weighs against missing the colour: enough to mix neighbours rather than
/// opposites that give the same.
const FAR_WEIGHT: f32 = 0.01;

/// What is done with colours between two pens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dither {
    /// Each pixel has the nearest pen.
    #[default]
    None,
    /// Each pixel has one pen, and what that misses is made up for by its neighbours (Floyd and Steinberg 1976): good where a
    /// pixel is about as large as a mark.
    Diffusion,
    /// Each pixel has shares of several pens: good for what places marks by density.
    Shares,
}

/// Separates a picture into pens whose marks don't overlap: at each pixel the coverages add up to at most 1, and what is left
/// is bare paper, which the picture's white always is. "Nearest" is by
/// [`oklab_difference2`]; shares and errors add up in linear light, as
/// marks seen from afar do. See [`side_by_side`](crate::picture::side_by_side) for what they give together.
pub fn pens(picture: &Picture, inks: &[Ink], paper: Rgb, dither: Dither) -> Vec<Tone> {
    let paper = linear_from_rgb(paper);
    let mut colors: Vec<[f32; 3]> = inks.iter().map(|ink| linear_from_rgb(ink.color)).collect();
    colors.push(paper);
    let on_paper = |p: [f32; 3]| [p[0] * paper[0], p[1] * paper[1], p[2] * paper[2]];
    let planes = match dither {
        Dither::None => {
            let nearest = Nearest::new(&colors);
            let chosen: Vec<usize> = picture.pixels.par_iter().map(|p| nearest.of(on_paper(*p))).collect();
            one_hot(picture, &chosen, inks.len())
        }
        Dither::Diffusion => one_hot(picture, &diffused(picture, &colors, on_paper), inks.len()),
        Dither::Shares => {
            let cube = Cube::new(SIDE, inks.len(), |color, values| {
                let shares = shares(on_paper(color), &colors);
                values.copy_from_slice(&shares[..values.len()]);
            });
            cube.planes(picture)
        }
    };
    inks.iter().zip(planes).map(|(ink, coverage)| Tone { ink: ink.clone(), coverage }).collect()
}

/// Looks for the nearest of some colours.
struct Nearest(Vec<[f32; 3]>);

impl Nearest {
    fn new(colors: &[[f32; 3]]) -> Self {
        Self(colors.iter().map(|c| oklab_from_linear(*c)).collect())
    }

    fn of(&self, light: [f32; 3]) -> usize {
        let lab = oklab_from_linear(light);
        let far = |c: &[f32; 3]| oklab_difference2(*c, lab);
        let nearest = self.0.iter().enumerate().min_by(|a, b| far(a.1).total_cmp(&far(b.1)));
        nearest.map_or(0, |(i, _)| i)
    }
}

/// Coverage 1 of the chosen pen at each pixel, 0 of the others.
fn one_hot(picture: &Picture, chosen: &[usize], pens: usize) -> Vec<Plane> {
    (0..pens)
        .map(|pen| {
            let values = chosen.iter().map(|c| if *c == pen { 1.0 } else { 0.0 }).collect();
            Plane::from_values(picture.width(), picture.height(), values).unwrap_or_default()
        })
        .collect()
}

/// The pen of each pixel, errors handed on row by row, to and fro.
fn diffused(picture: &Picture, colors: &[[f32; 3]], on_paper: impl Fn([f32; 3]) -> [f32; 3]) -> Vec<usize> {
    let (w, h) = (picture.width(), picture.height());
    let nearest = Nearest::new(colors);
    let mut chosen = vec![0; w * h];
    // With a cell to spare at both ends.
    let (mut here, mut below) = (vec![[0.0f32; 3]; w + 2], vec![[0.0f32; 3]; w + 2]);
    for y in 0..h {
        for step in 0..w {
            let x = if y % 2 == 0 { step } else { w - 1 - step };
            let (ahead, behind) = if y % 2 == 0 { (x + 2, x) } else { (x, x + 2) };
            let want = on_paper(picture.at(x, y));
            // Clamped not far outside, lest what no pen can make up for be carried across the whole picture.
            let light = [0, 1, 2].map(|k| (want[k] + here[x + 1][k]).clamp(-0.2, 1.2));
            let pen = nearest.of(light);
            chosen[y * w + x] = pen;
            for k in 0..3 {
                let error = (light[k] - colors[pen][k]) / 16.0;
                here[ahead][k] += 7.0 * error;
                below[behind][k] += 3.0 * error;
                below[x + 1][k] += 5.0 * error;
                below[ahead][k] += error;
            }
        }
        std::mem::swap(&mut here, &mut below);
        below.fill([0.0; 3]);
    }
    chosen
}

/// Shares of the colours, adding up to 1, whose mean in linear light comes near to a colour.
///
/// Minimises `|J (sum w c - t)|^2 + e sum w d(c, t)^2`, `J` being the slope of Oklab at the colour `t` and `d` the
/// difference, by moving weight between two colours at a time: convex, and exact for each pair.
fn shares(target: [f32; 3], colors: &[[f32; 3]]) -> Vec<f32> {
    let safe = target.map(|v| v.max(0.01));
    let lab = oklab_from_linear(safe);
    let slope = [0, 1, 2].map(|k| {
        let mut beside = safe;
        beside[k] += 1e-3;
        oklab_from_linear(beside).map(f64::from)
    });
    let seen = |c: &[f32; 3]| {
        let d = [0, 1, 2].map(|k| f64::from(c[k] - target[k]) * 1e3);
        [0, 1, 2].map(|r| (0..3).map(|k| (slope[k][r] - f64::from(lab[r])) * d[k]).sum::<f64>())
    };
    let seen: Vec<[f64; 3]> = colors.iter().map(seen).collect();
    let far = |c: &[f32; 3]| f64::from(FAR_WEIGHT * oklab_difference2(oklab_from_linear(*c), lab));
    let far: Vec<f64> = colors.iter().map(far).collect();
    let n = colors.len();
    let start = (0..n).min_by(|a, b| far[*a].total_cmp(&far[*b])).unwrap_or(0);
    let mut weights = vec![0.0f64; n];
    weights[start] = 1.0;
    let mut off = seen[start];
    for _ in 0..60 {
        let mut moved = 0.0f64;
        for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let d = [0, 1, 2].map(|k| seen[i][k] - seen[j][k]);
            let dd: f64 = d.iter().map(|v| v * v).sum();
            let pull = (0..3).map(|k| d[k] * off[k]).sum::<f64>() + 0.5 * (far[i] - far[j]);
            let step = if dd > 1e-12 { -pull / dd } else { -pull.signum() };
            let step = step.clamp(-weights[i], weights[j]);
            weights[i] += step;
            weights[j] -= step;
            off = [0, 1, 2].map(|k| off[k] + step * d[k]);
            moved = moved.max(step.abs());
        }
        if moved < 1e-4 {
            break;
        }
    }
    weights.into_iter().map(|w| w.clamp(0.0, 1.0) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{oklab_from_rgb, side_by_side};

    const WHITE: Rgb = Rgb([255; 3]);

    fn inks(colors: &[[u8; 3]]) -> Vec<Ink> {
        colors.iter().map(|c| Ink { name: format!("{c:?}"), color: Rgb(*c) }).collect()
    }

    fn plain(color: [f32; 3]) -> Picture {
        Picture::from_pixels(40, 30, vec![color; 1200]).unwrap()
    }

    fn mean(picture: &Picture) -> [f32; 3] {
        [0, 1, 2].map(|k| picture.pixels.iter().map(|p| p[k]).sum::<f32>() / picture.pixels.len() as f32)
    }

    #[test]
    fn a_pens_own_colour_is_drawn_by_it_alone_and_white_by_none() {
        let set = inks(&[[200, 30, 40], [20, 60, 180], [30, 30, 30]]);
        for dither in [Dither::None, Dither::Diffusion, Dither::Shares] {
            for (i, ink) in set.iter().enumerate() {
                for (k, tone) in pens(&plain(linear_from_rgb(ink.color)), &set, WHITE, dither).iter().enumerate() {
                    let own = if i == k { 1.0 } else { 0.0 };
                    assert!(
                        tone.coverage.values.iter().all(|v| (v - own).abs() < 0.15),
                        "{dither:?} {i} {k} {}",
                        tone.coverage.values[0]
                    );
                }
            }
            let paper = Rgb([240, 230, 200]);
            let bare = pens(&plain([1.0; 3]), &set, paper, dither);
            assert!(bare.iter().all(|t| t.coverage.values.iter().all(|v| *v < 1e-3)), "{dither:?}");
            assert!(pens(&Picture::default(), &set, WHITE, dither).iter().all(|t| t.coverage.values.is_empty()));
            assert!(pens(&plain([0.5; 3]), &[], WHITE, dither).is_empty());
        }
    }

    #[test]
    fn coverages_add_up_to_one_at_most() {
        let set = inks(&[[250, 200, 40], [200, 30, 40], [20, 60, 180], [40, 150, 60], [30, 30, 30]]);
        let many =
            (0..1200).map(|i| [i % 10, i / 10 % 10, i / 100].map(|v| v as f32 / 9.0)).map(|p| p.map(|v| v.min(1.0)));
        let many = Picture::from_pixels(40, 30, many.collect()).unwrap();
        for dither in [Dither::None, Dither::Diffusion, Dither::Shares] {
            let tones = pens(&many, &set, WHITE, dither);
            for i in 0..1200 {
                let sum: f32 = tones.iter().map(|t| t.coverage.values[i]).sum();
                assert!(sum < 1.0 + 1e-4 && tones.iter().all(|t| t.coverage.values[i] >= 0.0), "{dither:?}: {sum}");
            }
        }
    }

    #[test]
    fn dithered_pens_have_the_pictures_mean_colour() {
        let set = inks(&[[200, 30, 40], [20, 60, 180], [30, 30, 30]]);
        // A third each of paper, red and blue can be met.
        let color =
            [0, 1, 2].map(|k| (1.0 + linear_from_rgb(set[0].color)[k] + linear_from_rgb(set[1].color)[k]) / 3.0);
        for (dither, near) in [(Dither::Diffusion, 0.02), (Dither::Shares, 0.03)] {
            let given = mean(&side_by_side(&pens(&plain(color), &set, WHITE, dither), WHITE));
            assert!((0..3).all(|k| (given[k] - color[k]).abs() < near), "{dither:?}: {given:?} for {color:?}");
        }
    }

    #[test]
    fn without_dither_each_colour_goes_to_the_nearest_pen() {
        let set = inks(&[[220, 60, 40], [60, 120, 60]]);
        let tones = pens(&plain(linear_from_rgb(Rgb([180, 40, 60]))), &set, WHITE, Dither::None);
        assert!(oklab_difference2(oklab_from_rgb(Rgb([180, 40, 60])), oklab_from_rgb(set[0].color)) < 0.05);
        assert!(
            tones[0].coverage.values.iter().all(|v| *v == 1.0) && tones[1].coverage.values.iter().all(|v| *v == 0.0)
        );
    }
}
