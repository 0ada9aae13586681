//! What the segments of a JPEG say, without its pixels.
//!
//! ITU-T T.81, annex B.

/// What the decoder doesn't tell of a file.
#[derive(Default)]
pub(super) struct Outline {
    /// Colours of a pixel.
    pub(super) components: u8,
    /// Where the `A` of Adobe's segment stands.
    pub(super) adobe: Option<usize>,
    /// All coefficients have to be held until the last scan.
    pub(super) held: bool,
    /// The end marker is there.
    pub(super) ended: bool,
    /// For each component's number, the coefficients that some scan brings to their last bit.
    known: Vec<(u8, u64)>,
    /// Of a kind that the decoder doesn't know: which.
    pub(super) foreign: Option<&'static str>,
}

impl Outline {
    /// Walks the segments; `None` where they break off before the first scan.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        let mut found = Self::default();
        let mut at = 2;
        let mut scans = 0;
        // Between a scan's data and the end of the file only what was seen so far counts.
        while let Some((marker, body)) = segment(bytes, &mut at) {
            if marker == 0xd9 {
                found.ended = scans > 0;
                break;
            }
            let whole = found.note(marker, body, at);
            if found.foreign.is_some() {
                return Some(found);
            }
            match whole {
                None if scans == 0 => return None,
                None => break,
                Some(()) => scans += usize::from(marker == 0xda),
            }
        }
        (scans > 0).then_some(found)
    }

    /// Takes one segment, which ends at `end`; `None` where it is broken.
    fn note(&mut self, marker: u8, body: &[u8], end: usize) -> Option<()> {
        self.foreign = foreign(marker, body);
        match marker {
            0xc0..=0xc2 => {
                self.components = *body.get(5)?;
                self.held |= marker == 0xc2;
                self.known = body.get(6..)?.chunks_exact(3).map(|c| (c[0], 0)).collect();
            }
            0xee if body.starts_with(b"Adobe") => self.adobe = Some(end - body.len()),
            0xda => {
                let count = usize::from(*body.first()?);
                self.held |= count < usize::from(self.components);
                let [start, last, bits] = *body.get(1 + 2 * count..4 + 2 * count)? else { return None };
                let band = (u64::MAX >> (63 - last.min(63))) & (u64::MAX << start.min(63));
                for number in body[1..].chunks_exact(2).take(count).map(|c| c[0]) {
                    let known = self.known.iter_mut().filter(|(n, _)| *n == number);
                    // The low half says how many bits are still to come.
                    known.for_each(|(_, seen)| *seen |= if bits & 15 == 0 { band } else { 0 });
                }
            }
            _ => {}
        }
        Some(())
    }

    /// Whether there is a last scan for every coefficient.
    pub(super) fn all_scans(&self) -> bool {
        !self.known.is_empty() && self.known.iter().all(|(_, seen)| *seen == u64::MAX)
    }
}

/// The next segment's marker and body (none has the end marker); `at` goes behind it.
fn segment<'a>(bytes: &'a [u8], at: &mut usize) -> Option<(u8, &'a [u8])> {
    loop {
        *at += bytes.get(*at..)?.iter().position(|b| *b == 0xff)?;
        *at += bytes.get(*at..)?.iter().position(|b| *b != 0xff)?;
        let marker = bytes[*at];
        *at += 1;
        match marker {
            0xd9 => return Some((marker, &[])),
            // Stuffed zeros and restarts of a scan's data, and another start.
            0 | 1 | 0xd0..=0xd8 => {}
            _ => {
                let length = usize::from(u16::from_be_bytes([*bytes.get(*at)?, *bytes.get(*at + 1)?])).max(2);
                let body = bytes.get(*at + 2..*at + length)?;
                *at += length;
                return Some((marker, body));
            }
        }
    }
}

/// The kind of a JPEG that the decoder doesn't know, by a frame's marker (ITU-T T.81, table B.1) and body.
fn foreign(marker: u8, body: &[u8]) -> Option<&'static str> {
    match marker {
        0xc9..=0xcf => Some("arithmetic coding"),
        0xc3 => Some("lossless coding"),
        0xc5..=0xc7 => Some("hierarchical coding"),
        0xc0..=0xc2 if body.first().is_some_and(|bits| *bits != 8) => Some("more than 8 bits a colour"),
        _ => None,
    }
}
