//! Averages rows as they come, so that a large picture never stands in memory at its full size.
use crate::picture::value::Pixel;

/// Takes a picture row by row and keeps its box average at a size that was chosen before.
pub(super) struct Shrink<T> {
    source: (usize, usize),
    target: (usize, usize),
    /// For each source column its first target column, and its share in it; the rest falls into the next.
    columns: Vec<(u32, f32)>,
    row: Vec<T>,
    sums: Vec<T>,
    next: Vec<T>,
    rows_in: usize,
    pixels: Vec<T>,
}

/// The largest size of these proportions with at most `max_pixels`, each side at least 1 px; the same size when it fits.
fn fit(width: usize, height: usize, max_pixels: usize) -> (usize, usize) {
    let pixels = width as f64 * height as f64;
    if pixels <= max_pixels.max(1) as f64 {
        return (width, height);
    }
    let scale = (max_pixels.max(1) as f64 / pixels).sqrt();
    let w = ((width as f64 * scale) as usize).clamp(1, width);
    let h = ((height as f64 * scale) as usize).clamp(1, height);
    (w.min(max_pixels.max(1)), h.min((max_pixels / w).max(1)))
}

/// Where source cell `i` of `n` begins among `m <= n` target cells: the first one, and the cell's share in it.
fn share(i: usize, n: usize, m: usize) -> (usize, f32) {
    // In units of 1 / n of a target cell, the source cell spans i * m .. (i + 1) * m.
    let (start, end) = (i as u64 * m as u64, (i as u64 + 1) * m as u64);
    let cell = start / n as u64;
    let edge = (cell + 1) * n as u64;
    (cell as usize, if end <= edge { 1.0 } else { (edge - start) as f32 / m as f32 })
}

impl<T: Pixel> Shrink<T> {
    /// Rows of `width` px, `height` of them, are to come.
    pub(super) fn new(width: usize, height: usize, max_pixels: usize) -> Self {
        let target = fit(width, height, max_pixels);
        let columns = if target == (width, height) {
            Vec::new()
        } else {
            (0..width)
                .map(|i| {
                    let (cell, part) = share(i, width, target.0);
                    (cell as u32, part)
                })
                .collect()
        };
        let line = if columns.is_empty() { 0 } else { target.0 };
        Self {
            source: (width, height),
            target,
            columns,
            row: vec![T::default(); line + 1],
            sums: vec![T::default(); line],
            next: vec![T::default(); line],
            rows_in: 0,
            pixels: Vec::with_capacity(target.0 * target.1),
        }
    }

    /// Takes the next row, of the source's width.
    pub(super) fn push(&mut self, row: &[T]) {
        if self.columns.is_empty() {
            self.pixels.extend_from_slice(row);
            return;
        }
        self.row.fill(T::default());
        for (value, &(cell, part)) in row.iter().zip(&self.columns) {
            let cell = cell as usize;
            self.row[cell] = self.row[cell].plus(part, *value);
            if part < 1.0 {
                self.row[cell + 1] = self.row[cell + 1].plus(1.0 - part, *value);
            }
        }
        let (cell, part) = share(self.rows_in, self.source.1, self.target.1);
        self.rows_in += 1;
        let ends = share(self.rows_in, self.source.1, self.target.1).0 > cell;
        for (sum, value) in self.sums.iter_mut().zip(&self.row) {
            *sum = sum.plus(part, *value);
        }
        if part < 1.0 {
            for (sum, value) in self.next.iter_mut().zip(&self.row) {
                *sum = sum.plus(1.0 - part, *value);
            }
        }
        if ends {
            let cells = self.target.0 as f64 * self.target.1 as f64 / (self.source.0 as f64 * self.source.1 as f64);
            self.pixels.extend(self.sums.iter().map(|s| T::default().plus(cells as f32, *s)));
            std::mem::swap(&mut self.sums, &mut self.next);
            self.next.fill(T::default());
        }
    }

    /// The size, and the pixels of all rows that came.
    pub(super) fn finish(self) -> (usize, usize, Vec<T>) {
        (self.target.0, self.target.1, self.pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_mean_is_kept_and_the_limit_holds(w in 1usize..60, h in 1usize..60, max in 1usize..900) {
            let value = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f32;
            let mut shrink = Shrink::new(w, h, max);
            for y in 0..h {
                shrink.push(&(0..w).map(|x| value(x, y)).collect::<Vec<_>>());
            }
            let (tw, th, pixels) = shrink.finish();
            prop_assert_eq!(pixels.len(), tw * th);
            prop_assert!(tw * th <= max && tw >= 1 && th >= 1);
            let mean = |v: &[f32]| v.iter().map(|v| f64::from(*v)).sum::<f64>() / v.len() as f64;
            let all: Vec<f32> = (0..w * h).map(|i| value(i % w, i / w)).collect();
            prop_assert!((mean(&pixels) - mean(&all)).abs() < 1e-4);
        }
    }

    #[test]
    fn a_picture_that_fits_is_left_alone() {
        assert_eq!(fit(4000, 3000, 12_000_000), (4000, 3000));
        assert_eq!(fit(12_000, 9_000, 12_000_000), (4000, 3000));
        assert_eq!(fit(100_000, 1, 10), (10, 1));
    }
}
