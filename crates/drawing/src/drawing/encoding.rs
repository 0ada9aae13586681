//! Bytes of a file to text: marks of byte order, UTF-16, Latin-1 where a file says so; and unpacking.
use std::borrow::Cow;
use std::io::Read as _;

/// The text of a file, without its byte order mark.
///
/// # Errors
/// The 1-based line of the first byte that is no text.
pub(super) fn text(bytes: &[u8]) -> Result<Cow<'_, str>, usize> {
    let wide = |little: bool, bytes: &[u8]| {
        let unit = |b: &[u8]| if little { u16::from_le_bytes([b[0], b[1]]) } else { u16::from_be_bytes([b[0], b[1]]) };
        let units: Vec<u16> = bytes.chunks_exact(2).map(unit).collect();
        let text = String::from_utf16(&units).map_err(|_| 1usize)?;
        Ok(Cow::Owned(text))
    };
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => utf8(rest).map(Cow::Borrowed),
        [0xff, 0xfe, rest @ ..] => wide(true, rest),
        [0xfe, 0xff, rest @ ..] => wide(false, rest),
        [b'<', 0, ..] => wide(true, bytes),
        [0, b'<', ..] => wide(false, bytes),
        _ => match utf8(bytes) {
            Ok(text) => Ok(Cow::Borrowed(text)),
            Err(_) if says_latin(bytes) => Ok(Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect())),
            Err(line) => Err(line),
        },
    }
}

fn utf8(bytes: &[u8]) -> Result<&str, usize> {
    std::str::from_utf8(bytes).map_err(|e| bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1)
}

/// Whether an XML declaration names a one-byte encoding of western languages.
fn says_latin(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).to_ascii_lowercase();
    let head = head.split("?>").next().unwrap_or("");
    head.starts_with("<?xml")
        && ["iso-8859-1", "iso-8859-15", "windows-1252", "latin1"].iter().any(|e| head.contains(e))
}

/// Unpacks gzip.
///
/// # Errors
/// What is broken in the file, or that it unpacks to more than `limit` bytes.
pub(super) fn unpack(bytes: &[u8], limit: usize) -> std::io::Result<Vec<u8>> {
    let mut out = Vec::new();
    flate2::read::MultiGzDecoder::new(bytes).take(limit as u64 + 1).read_to_end(&mut out)?;
    match out.len() > limit {
        true => Err(std::io::Error::other(format!("unpacks to more than {} MiB", limit >> 20))),
        false => Ok(out),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_in_every_encoding() {
        let wide = |t: &str, f: fn(u16) -> [u8; 2]| t.encode_utf16().flat_map(f).collect::<Vec<u8>>();
        let t = "<a>\u{e4}</a>";
        for bytes in [
            t.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", t.as_bytes()].concat(),
            [vec![0xff, 0xfe], wide(t, u16::to_le_bytes)].concat(),
            [vec![0xfe, 0xff], wide(t, u16::to_be_bytes)].concat(),
            wide(t, u16::to_le_bytes),
        ] {
            assert_eq!(text(&bytes).unwrap(), t);
        }
        let latin = b"<?xml version='1.0' encoding='ISO-8859-1'?><a>\xe4</a>";
        assert!(text(latin).unwrap().ends_with(t));
        assert_eq!(text(b"a\nb\xff"), Err(2));
    }

    #[test]
    fn packed_files_are_unpacked_within_a_limit() {
        use std::io::Write as _;
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packer.write_all(&[b'a'; 5000]).unwrap();
        let packed = packer.finish().unwrap();
        assert_eq!(unpack(&packed, 5000).unwrap(), [b'a'; 5000]);
        assert!(unpack(&packed, 4999).unwrap_err().to_string().contains("more than"));
        assert!(unpack(&packed[..20], 5000).is_err());
    }
}
