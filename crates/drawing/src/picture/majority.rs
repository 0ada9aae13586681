//! Labels without specks: each pixel joins the majority of its surroundings.
use rayon::prelude::*;

/// The label that is commonest within `radius` px (a square) of each pixel; its own where none is commoner.
pub fn majority<T: Copy + PartialEq + Send + Sync>(labels: &[T], width: usize, radius: usize) -> Vec<T> {
    let height = labels.len().checked_div(width).unwrap_or(0);
    let mut joined = labels.to_vec();
    if radius == 0 || height == 0 {
        return joined;
    }
    joined.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
        let rows = y.saturating_sub(radius)..(y + radius + 1).min(height);
        let mut votes: Vec<(T, u32)> = Vec::new();
        for (x, label) in line.iter_mut().enumerate() {
            let columns = x.saturating_sub(radius)..(x + radius + 1).min(width);
            votes.clear();
            // its own vote stands first, and wins a draw
            votes.push((*label, 0));
            for row in rows.clone() {
                for l in &labels[row * width + columns.start..row * width + columns.end] {
                    match votes.iter_mut().find(|v| v.0 == *l) {
                        Some(v) => v.1 += 1,
                        None => votes.push((*l, 1)),
                    }
                }
            }
            let mut best = votes[0];
            votes.iter().filter(|v| v.1 > votes[0].1).for_each(|v| {
                if v.1 > best.1 {
                    best = *v;
                }
            });
            *label = best.0;
        }
    });
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specks_vanish_and_edges_stay() {
        let labels: Vec<u8> = (0..400).map(|i| if i == 105 { 7 } else { u8::from(i % 20 >= 10) }).collect();
        let joined = majority(&labels, 20, 2);
        assert!((0..400).all(|i| joined[i] == u8::from(i % 20 >= 10)));
        assert_eq!(majority(&[3u8], 1, 4), [3]);
        assert!(majority::<u8>(&[], 0, 1).is_empty());
    }
}
