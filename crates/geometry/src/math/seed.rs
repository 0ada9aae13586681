//! Random streams: each part of a run derives its own from the run's one seed and a name.
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
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

/// A number in `[0, 1)` of 53 random bits.
pub fn unit(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A standard normal number by Box and Muller's transform (doi:10.1214/aoms/1177706645).
pub fn standard_normal(rng: &mut impl Rng) -> f64 {
    // the logarithm's argument is never 0
    let (u, v) = (1.0 - unit(rng), unit(rng));
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
