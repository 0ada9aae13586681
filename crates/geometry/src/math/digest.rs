//! A digest of numbers and text, to tell whether two runs came out the same to the last bit.
use sha2::{Digest as _, Sha256};

/// Feeds numbers by their exact bits; two runs agree when their digests agree.
#[derive(Clone, Default)]
pub struct Digest(Sha256);

impl Digest {
    /// An empty digest.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds bytes.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.update(bytes);
        self
    }

    /// Adds numbers by their IEEE-754 bits.
    pub fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) -> &mut Self {
        for x in numbers {
            self.0.update(x.to_bits().to_le_bytes());
        }
        self
    }

    /// The first 16 bytes as 32 hexadecimal digits.
    pub fn hex(&self) -> String {
        self.0.clone().finalize()[..16].iter().map(|b| format!("{b:02x}")).collect()
    }
}
