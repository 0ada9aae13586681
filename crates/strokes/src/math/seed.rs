//! Random streams: each part of a run derives its own from the run's one seed and a name.
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use sha2::{Digest as _, Sha256};

/// The stream of random numbers named `name` of the run seeded `seed`; `index` tells trials apart.
///
/// Streams of different names, seeds or indices are independent, so adding one part never shifts another's numbers.
pub fn stream(seed: u64, name: &str, index: u64) -> ChaCha8Rng {
    let mut h = Sha256::new();
    h.update(seed.to_le_bytes());
    h.update(index.to_le_bytes());
    h.update(name.as_bytes());
    ChaCha8Rng::from_seed(h.finalize().into())
}
