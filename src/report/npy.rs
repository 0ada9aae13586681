//! NumPy arrays: the head of a `.npy` file (format 1.0, C order), and arrays of bytes.

/// Magic, version and header for values of type `descr`, such as `<f8`; the values follow as they are.
pub(super) fn npy_header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let mut sizes = shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    if shape.len() == 1 {
        sizes.push(',');
    }
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({sizes}), }}");
    // magic, version and length take 10 bytes; the whole is padded to a multiple of 64 and ends with a newline
    let padding = 63 - (10 + header.len()) % 64;
    header.push_str(&" ".repeat(padding));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend_from_slice(&(header.len() as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes
}

/// An array of bytes (`|u1`) of the given shape.
pub fn npy_bytes(shape: &[usize], values: &[u8]) -> Vec<u8> {
    let mut bytes = npy_header("|u1", shape);
    bytes.extend_from_slice(values);
    bytes
}

/// The values of a file that [`npy_bytes`] wrote with this shape; `None` of any other.
pub fn read_npy_bytes<'a>(shape: &[usize], file: &'a [u8]) -> Option<&'a [u8]> {
    let values = file.strip_prefix(npy_header("|u1", shape).as_slice())?;
    (values.len() == shape.iter().product::<usize>()).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_and_other_files_do_not() {
        let file = npy_bytes(&[2, 1, 3], &[0, 1, 2, 2, 1, 0]);
        assert_eq!(file.len() % 64, 6);
        assert!(
            String::from_utf8_lossy(&file[10..])
                .starts_with("{'descr': '|u1', 'fortran_order': False, 'shape': (2, 1, 3), }")
        );
        assert_eq!(read_npy_bytes(&[2, 1, 3], &file), Some(&[0, 1, 2, 2, 1, 0][..]));
        assert_eq!(read_npy_bytes(&[3, 1, 2], &file), None);
        assert_eq!(read_npy_bytes(&[2, 1, 3], &file[..file.len() - 1]), None);
        assert_eq!(read_npy_bytes(&[2, 1, 3], b"NUMPY"), None);
    }
}
