//! Which way up a camera was held.

/// The orientation of Exif data (its TIFF header first), 1..=8; 1, upright, when it says none.
///
/// Tag 0x0112 of the first directory: CIPA DC-008 (Exif 2.32), section 4.6.4.
pub(super) fn of_exif(tiff: &[u8]) -> u8 {
    find(tiff).filter(|v| (1..=8).contains(v)).unwrap_or(1)
}

fn find(tiff: &[u8]) -> Option<u8> {
    let little = match tiff.get(..2)? {
        b"II" => true,
        b"MM" => false,
        _ => return None,
    };
    let u16_at = |at: usize| {
        let b = tiff.get(at..at.checked_add(2)?)?;
        let b = [b[0], b[1]];
        Some(if little { u16::from_le_bytes(b) } else { u16::from_be_bytes(b) })
    };
    let half = |at: usize| u16_at(at).map(usize::from);
    let offset = if little { half(4)? | half(6)? << 16 } else { half(4)? << 16 | half(6)? };
    let entries = half(offset)?;
    let entry = (0..entries).map(|i| offset + 2 + 12 * i).find(|at| u16_at(*at) == Some(0x0112))?;
    u8::try_from(u16_at(entry + 8)?).ok()
}

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
    use proptest::prelude::*;

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

    #[test]
    fn both_byte_orders_are_read() {
        let big = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let little = b"II\x2a\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x08\0\0\0\0\0\0\0";
        assert_eq!((of_exif(big), of_exif(little)), (6, 8));
    }

    proptest! {
        #[test]
        fn any_bytes_have_an_orientation(mut bytes in proptest::collection::vec(any::<u8>(), 0..60), little in any::<bool>()) {
            if bytes.len() > 1 {
                bytes[..2].copy_from_slice(if little { b"II" } else { b"MM" });
            }
            prop_assert!((1..=8).contains(&of_exif(&bytes)));
        }
    }
}
