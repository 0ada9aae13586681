//! The shortest tour of a handful of points (Held and Karp, "A Dynamic Programming Approach to Sequencing Problems",
//! 1962).
use super::metric::Metric;

/// The shortest closed tour, starting at point 0; time and memory double with each point.
pub(super) fn shortest(points: &[[f64; 2]], metric: Metric) -> Vec<u32> {
    let n = points.len();
    if n < 4 {
        return (0..n as u32).collect();
    }
    let distance = |a: usize, b: usize| metric.distance(points[a], points[b]);
    // point 0 is where every path starts, and isn't counted among the `m` others
    let m = n - 1;
    // [set of points seen][the last of them]: length of the shortest such path, and the point before the last
    let mut best = vec![(f64::INFINITY, 0); m << m];
    for last in 0..m {
        best[(1 << last) * m + last] = (distance(0, last + 1), 0);
    }
    for seen in 1usize..1 << m {
        for last in (0..m).filter(|&l| seen >> l & 1 == 1) {
            let so_far = best[seen * m + last].0;
            for next in (0..m).filter(|&k| seen >> k & 1 == 0) {
                let slot = &mut best[(seen | 1 << next) * m + next];
                let length = so_far + distance(last + 1, next + 1);
                if length < slot.0 {
                    *slot = (length, last);
                }
            }
        }
    }
    let mut seen = (1usize << m) - 1;
    let closed = |l: usize| best[seen * m + l].0 + distance(l + 1, 0);
    let mut last = (1..m).fold(0, |b, l| if closed(l) < closed(b) { l } else { b });
    let mut tour = Vec::with_capacity(n);
    while seen != 0 {
        tour.push(last as u32 + 1);
        let before = best[seen * m + last].1;
        seen &= !(1 << last);
        last = before;
    }
    tour.push(0);
    tour.reverse();
    tour
}
