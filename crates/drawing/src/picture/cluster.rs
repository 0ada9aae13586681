//! Clusters of colours: k-means, Ward's agglomeration, and DBSCAN, all on a histogram.
//!
//! A picture of millions of pixels has some thousand colours that an eye tells apart, so that clustering weighted bins
//! costs little whatever the size. The crates that do clustering (`kmeans_colors`, `linfa-clustering`, `petal-clustering`) know
//! no weights or bring an array library with them, hence the few lines here.
use std::collections::BTreeMap;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::math::stream;
use crate::picture::Picture;
use crate::picture::color::{Oklab, oklab_difference2, oklab_from_linear};

/// Bins along each axis of Oklab for each unit of it.
const BINS: [f32; 3] = [64.0, 96.0, 96.0];

/// Most colours that are agglomerated, since each is compared with each.
const WARD_MAX: usize = 1000;

/// A colour and how many pixels have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weighted {
    pub(super) color: Oklab,
    pub(super) weight: f32,
}

/// The colours of a picture in bins of about 1.5 % of lightness, each with its mean colour, in a fixed order.
pub(super) fn histogram(picture: &Picture) -> Vec<Weighted> {
    /// Pixels of a part: a fixed number, so that sums don't depend on the number of threads.
    const PART: usize = 1 << 16;
    type Bins = BTreeMap<u32, ([f64; 3], u32)>;
    let part = |pixels: &[[f32; 3]]| {
        let mut keyed: Vec<(u32, Oklab)> = pixels
            .iter()
            .map(|p| {
                let lab = oklab_from_linear(*p);
                let bin = |k: usize| ((lab[k] * BINS[k]).round().clamp(-127.0, 127.0) + 128.0) as u32;
                (bin(0) << 16 | bin(1) << 8 | bin(2), lab)
            })
            .collect();
        keyed.sort_by_key(|k| k.0);
        let mut bins: Vec<(u32, [f64; 3], u32)> = Vec::new();
        for (key, lab) in keyed {
            match bins.last_mut() {
                Some(bin) if bin.0 == key => {
                    bin.1 = [0, 1, 2].map(|k| bin.1[k] + f64::from(lab[k]));
                    bin.2 += 1;
                }
                _ => bins.push((key, lab.map(f64::from), 1)),
            }
        }
        bins
    };
    let parts: Vec<_> = picture.pixels.par_chunks(PART).map(part).collect();
    let mut bins = Bins::new();
    for (key, sum, count) in parts.into_iter().flatten() {
        let bin = bins.entry(key).or_default();
        bin.0 = [0, 1, 2].map(|k| bin.0[k] + sum[k]);
        bin.1 += count;
    }
    let mean = |(sum, count): &([f64; 3], u32)| Weighted {
        color: sum.map(|s| (s / f64::from(*count)) as f32),
        weight: *count as f32,
    };
    bins.values().map(mean).collect()
}

/// The index of the nearest of some colours; 0 of none.
pub(super) fn nearest(color: Oklab, of: &[Oklab]) -> usize {
    let mut best = (f32::INFINITY, 0);
    for (i, c) in of.iter().enumerate() {
        let d = oklab_difference2(color, *c);
        if d < best.0 {
            best = (d, i);
        }
    }
    best.1
}

/// The weighted mean of each cluster; `None` where a cluster is empty.
fn means(colors: &[Weighted], labels: &[usize], k: usize) -> Vec<Option<Weighted>> {
    let mut sums = vec![([0.0f64; 3], 0.0f64); k];
    for (c, label) in colors.iter().zip(labels) {
        let sum = &mut sums[*label];
        sum.0 = [0, 1, 2].map(|k| sum.0[k] + f64::from(c.weight) * f64::from(c.color[k]));
        sum.1 += f64::from(c.weight);
    }
    let mean = |(sum, weight): ([f64; 3], f64)| {
        (weight > 0.0).then(|| Weighted { color: sum.map(|s| (s / weight) as f32), weight: weight as f32 })
    };
    sums.into_iter().map(mean).collect()
}

/// At most `k` colours by k-means (Lloyd 1982, doi:10.1109/TIT.1982.1056489) from the seeds of k-means++ (Arthur and
/// Vassilvitskii 2007); the best of `starts`.
pub(super) fn k_means(colors: &[Weighted], k: usize, starts: usize, seed: u64) -> Vec<Weighted> {
    let run = |start: usize| {
        let mut random = stream(seed, "palette", start as u64);
        let mut centers = seeds(colors, k, &mut random);
        let mut labels: Vec<usize> = Vec::new();
        for _ in 0..100 {
            let next: Vec<usize> = colors.iter().map(|c| nearest(c.color, &centers)).collect();
            if next == labels {
                break;
            }
            labels = next;
            for (center, mean) in centers.iter_mut().zip(means(colors, &labels, k)) {
                *center = mean.map_or(*center, |m| m.color);
            }
        }
        let off = |(c, l): (&Weighted, &usize)| f64::from(c.weight * oklab_difference2(c.color, centers[*l]));
        let cost: f64 = colors.iter().zip(&labels).map(off).sum();
        (cost, means(colors, &labels, centers.len()).into_iter().flatten().collect::<Vec<_>>())
    };
    let runs: Vec<_> = (0..starts.max(1)).into_par_iter().map(run).collect();
    runs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|r| r.1).unwrap_or_default()
}

/// `k` of the colours, or as many as differ, each chosen with a chance of its squared distance from those before.
fn seeds(colors: &[Weighted], k: usize, random: &mut ChaCha8Rng) -> Vec<Oklab> {
    let mut far: Vec<f64> = colors.iter().map(|c| f64::from(c.weight)).collect();
    let mut seeds: Vec<Oklab> = Vec::new();
    while seeds.len() < k {
        let total: f64 = far.iter().sum();
        if total <= 1e-12 {
            break;
        }
        let mut left = random.random_range(0.0..total);
        let found = far.iter().position(|w| {
            left -= w;
            left < 0.0
        });
        // Rounding may leave a crumb at the end.
        let Some(chosen) = found.or_else(|| far.iter().rposition(|w| *w > 0.0)) else { break };
        let seed = colors[chosen].color;
        seeds.push(seed);
        for (w, c) in far.iter_mut().zip(colors) {
            let d = f64::from(c.weight * oklab_difference2(c.color, seed));
            *w = if seeds.len() == 1 { d } else { w.min(d) };
        }
    }
    seeds
}

/// `k` colours by agglomeration: the two clusters whose union adds least to the squares within (Ward 1963,
/// doi:10.1080/01621459.1963.10500845) become one, again and again.
pub(super) fn ward(colors: &[Weighted], k: usize, seed: u64) -> Vec<Weighted> {
    // Where there are too many colours, k-means gathers those that are as good as equal.
    let mut clusters = if colors.len() > WARD_MAX { k_means(colors, WARD_MAX / 2, 1, seed) } else { colors.to_vec() };
    let cost =
        |a: &Weighted, b: &Weighted| a.weight * b.weight / (a.weight + b.weight) * oklab_difference2(a.color, b.color);
    let closest = |clusters: &[Weighted], i: usize| {
        let others = (i + 1..clusters.len()).map(|j| (cost(&clusters[i], &clusters[j]), j));
        others.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, i))
    };
    // Of each cluster, the best to join of those after it.
    let mut best: Vec<(f32, usize)> = (0..clusters.len()).map(|i| closest(&clusters, i)).collect();
    while clusters.len() > k.max(1) {
        let Some((i, &(_, j))) = best.iter().enumerate().min_by(|a, b| a.1.0.total_cmp(&b.1.0)) else { break };
        let (a, b) = (clusters[i], clusters[j]);
        let weight = a.weight + b.weight;
        let color = [0, 1, 2].map(|c| (a.color[c] * a.weight + b.color[c] * b.weight) / weight);
        clusters[i] = Weighted { color, weight };
        let last = clusters.len() - 1;
        clusters.swap_remove(j);
        best.swap_remove(j);
        for m in 0..clusters.len() {
            let touched = m == i || m == j || [i, j, last].contains(&best[m].1);
            if touched {
                best[m] = closest(&clusters, m);
                continue;
            }
            for t in [i, j] {
                if t > m && t < clusters.len() {
                    let c = cost(&clusters[m], &clusters[t]);
                    if c < best[m].0 {
                        best[m] = (c, t);
                    }
                }
            }
        }
    }
    clusters
}

/// Clusters by density (Ester, Kriegel, Sander and Xu 1996): a colour with at least `min_share` of all pixels within `reach`
/// of it is inside a cluster, and so is what is within its reach. The rest, noise, goes to the nearest cluster.
pub(super) fn dbscan(colors: &[Weighted], reach: f32, min_share: f64) -> Vec<Weighted> {
    let total: f64 = colors.iter().map(|c| f64::from(c.weight)).sum();
    let near = |a: &Weighted| -> Vec<u32> {
        let close = |(_, b): &(usize, &Weighted)| oklab_difference2(a.color, b.color) <= reach * reach;
        colors.iter().enumerate().filter(close).map(|(j, _)| j as u32).collect()
    };
    let dense = |a: &Weighted| {
        let close = colors.iter().filter(|b| oklab_difference2(a.color, b.color) <= reach * reach);
        close.map(|b| f64::from(b.weight)).sum::<f64>() >= min_share * total
    };
    let core: Vec<bool> = colors.par_iter().map(dense).collect();
    const NONE: usize = usize::MAX;
    let mut labels = vec![NONE; colors.len()];
    let mut count = 0;
    for i in 0..colors.len() {
        if !core[i] || labels[i] != NONE {
            continue;
        }
        labels[i] = count;
        let mut open = vec![i];
        while let Some(at) = open.pop() {
            for j in near(&colors[at]).into_iter().map(|j| j as usize) {
                if labels[j] == NONE {
                    labels[j] = count;
                    if core[j] {
                        open.push(j);
                    }
                }
            }
        }
        count += 1;
    }
    if count == 0 {
        return Vec::new();
    }
    let inside: Vec<(Weighted, usize)> =
        colors.iter().zip(&labels).filter(|(_, l)| **l != NONE).map(|(c, l)| (*c, *l)).collect();
    let (members, member_labels): (Vec<Weighted>, Vec<usize>) = inside.into_iter().unzip();
    // A cluster's colour is that of its own; noise only adds to its weight.
    let mut found: Vec<Weighted> = means(&members, &member_labels, count).into_iter().flatten().collect();
    let centers: Vec<Oklab> = found.iter().map(|c| c.color).collect();
    for (c, _) in colors.iter().zip(&labels).filter(|(_, l)| **l == NONE) {
        found[nearest(c.color, &centers)].weight += c.weight;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOBS: [Oklab; 4] = [[0.9, 0.0, 0.05], [0.6, 0.15, 0.1], [0.5, -0.1, 0.1], [0.3, 0.02, -0.15]];

    /// Four blobs of colours, unequal in weight, and a little dust between.
    fn blobs(dust: bool) -> Vec<Weighted> {
        let mut random = stream(3, "blobs", 0);
        let mut colors = Vec::new();
        for (i, blob) in BLOBS.iter().enumerate() {
            for _ in 0..150 {
                let color = blob.map(|v| v + random.random_range(-0.03..0.03));
                colors.push(Weighted { color, weight: 10.0 * (i + 1) as f32 });
            }
        }
        if dust {
            for _ in 0..60 {
                let color =
                    [random.random_range(0.0..1.0), random.random_range(-0.3..0.3), random.random_range(-0.3..0.3)];
                colors.push(Weighted { color, weight: 1.0 });
            }
        }
        colors
    }

    fn finds_the_blobs(found: &[Weighted]) {
        assert_eq!(found.len(), 4, "{found:?}");
        for blob in BLOBS {
            let colors: Vec<Oklab> = found.iter().map(|f| f.color).collect();
            let near = colors[nearest(blob, &colors)];
            assert!(oklab_difference2(near, blob) < 0.015 * 0.015, "{blob:?}: {near:?}");
        }
    }

    #[test]
    fn every_method_finds_four_blobs() {
        finds_the_blobs(&k_means(&blobs(false), 4, 4, 1));
        finds_the_blobs(&ward(&blobs(false), 4, 1));
        finds_the_blobs(&dbscan(&blobs(false), 0.05, 0.005));
    }

    #[test]
    fn dust_makes_no_cluster_of_density() {
        let colors = blobs(true);
        let found = dbscan(&colors, 0.05, 0.005);
        finds_the_blobs(&found);
        let weight = |c: &[Weighted]| c.iter().map(|c| c.weight).sum::<f32>();
        assert!((weight(&found) - weight(&colors)).abs() < 1.0);
        assert!(dbscan(&colors, 0.001, 0.5).is_empty());
    }

    #[test]
    fn agglomeration_is_the_cheapest_union_each_time() {
        let mut random = stream(5, "ward", 0);
        let colors: Vec<Weighted> = (0..40)
            .map(|_| Weighted {
                color: [0; 3].map(|_| random.random_range(0.0..1.0)),
                weight: random.random_range(1.0..9.0),
            })
            .collect();
        let cost = |a: &Weighted, b: &Weighted| {
            a.weight * b.weight / (a.weight + b.weight) * oklab_difference2(a.color, b.color)
        };
        let mut plain = colors.clone();
        while plain.len() > 7 {
            let pairs = (0..plain.len()).flat_map(|i| (i + 1..plain.len()).map(move |j| (i, j)));
            let (i, j) =
                pairs.min_by(|a, b| cost(&plain[a.0], &plain[a.1]).total_cmp(&cost(&plain[b.0], &plain[b.1]))).unwrap();
            let (b, a) = (plain.remove(j), plain[i]);
            let weight = a.weight + b.weight;
            plain[i] =
                Weighted { color: [0, 1, 2].map(|c| (a.color[c] * a.weight + b.color[c] * b.weight) / weight), weight };
        }
        let mut fast = ward(&colors, 7, 1);
        for set in [&mut fast, &mut plain] {
            set.sort_by(|a, b| a.color[0].total_cmp(&b.color[0]));
        }
        for (a, b) in fast.iter().zip(&plain) {
            assert!(oklab_difference2(a.color, b.color) < 1e-8 && (a.weight - b.weight).abs() < 1e-3);
        }
    }

    #[test]
    fn few_or_no_colours_give_few_or_none() {
        let one = [Weighted { color: [0.5, 0.0, 0.0], weight: 3.0 }];
        assert_eq!(k_means(&one, 4, 2, 1), one);
        assert_eq!(ward(&one, 4, 1), one);
        assert_eq!(dbscan(&one, 0.1, 0.5), one);
        assert!(k_means(&[], 4, 2, 1).is_empty() && ward(&[], 4, 1).is_empty() && dbscan(&[], 0.1, 0.1).is_empty());
    }

    #[test]
    fn the_histogram_holds_every_pixel() {
        let pixels = (0..70_000).map(|i| [(i % 256) as f32 / 255.0, 0.5, (i % 7) as f32 / 7.0]).collect();
        let picture = Picture::from_pixels(700, 100, pixels).unwrap();
        let bins = histogram(&picture);
        assert_eq!(bins.iter().map(|b| b.weight).sum::<f32>(), 70_000.0);
        assert!(bins.len() < 1000);
    }
}
