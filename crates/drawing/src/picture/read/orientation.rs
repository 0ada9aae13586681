//! Which way up a camera was held.

/// The picture turned upright: its size and pixels after undoing `orientation`.
pub(super) fn upright<T: Copy>(orientation: u8, width: usize, height: usize, pixels: Vec<T>) -> (usize, usize, Vec<T>) {
    let (w, h) = if orientation >= 5 { (height, width) } else { (width, height) };
    // Where an upright column and row are found in the picture as stored.
    let from = |x: usize, y: usize| match orientation {
        2 => (width - 1 - x, y),
        3 => (width - 1 - x, height - 1 - y),
        4 => (x, height - 1 - y),
        5 => (y, x),
        6 => (y, height - 1 - x),
        7 => (width - 1 - y, height - 1 - x),
        8 => (width - 1 - y, x),
        _ => (x, y),
    };
    if orientation <= 1 || orientation > 8 {
        return (width, height, pixels);
    }
    let mut turned = Vec::with_capacity(pixels.len());
    for y in 0..h {
        turned.extend((0..w).map(|x| {
            let (column, row) = from(x, y);
            pixels[row * width + column]
        }));
    }
    (w, h, turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_orientation_is_undone() {
        // The upright picture is 0 1 2 / 3 4 5, stored as a camera would.
        let stored: [(u8, usize, Vec<u8>); 8] = [
            (1, 3, vec![0, 1, 2, 3, 4, 5]),
            (2, 3, vec![2, 1, 0, 5, 4, 3]),
            (3, 3, vec![5, 4, 3, 2, 1, 0]),
            (4, 3, vec![3, 4, 5, 0, 1, 2]),
            (5, 2, vec![0, 3, 1, 4, 2, 5]),
            (6, 2, vec![2, 5, 1, 4, 0, 3]),
            (7, 2, vec![5, 2, 4, 1, 3, 0]),
            (8, 2, vec![3, 0, 4, 1, 5, 2]),
        ];
        for (orientation, width, pixels) in stored {
            let upright = upright(orientation, width, 6 / width, pixels);
            assert_eq!(upright, (3, 2, vec![0, 1, 2, 3, 4, 5]), "orientation {orientation}");
        }
    }
}
