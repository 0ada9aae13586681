//! Kicks: small double bridges, mended by Lin-Kernighan moves.
use rand_chacha::rand_core::Rng;

use super::lin_kernighan::Optimiser;

/// Steps from neighbour to neighbour that the edges of a kick are apart.
const WALK: u32 = 30;
/// Neighbours among which a step chooses.
const CHOICE: u32 = 5;
const NONE: u32 = u32::MAX;

/// Quick random numbers (Vigna, "An Experimental Exploration of Marsaglia's xorshift Generators, Scrambled", 2016).
pub(super) struct Dice {
    state: u64,
}

impl Dice {
    /// Numbers that follow from the next one of a stream.
    pub(super) fn new(stream: &mut impl Rng) -> Self {
        Self { state: stream.next_u64() | 1 }
    }

    /// A number in 0..n.
    #[inline(always)]
    pub(super) fn below(&mut self, n: u32) -> u32 {
        self.state ^= self.state >> 12;
        self.state ^= self.state << 25;
        self.state ^= self.state >> 27;
        let high = self.state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32;
        ((high * u64::from(n)) >> 32) as u32
    }
}

/// Changes the tour by a double bridge between edges around a node and mends it; takes everything back if it got
/// longer. Returns by how much the tour is shorter.
pub(super) fn kick(optimiser: &mut Optimiser, node: u32, dice: &mut Dice) -> f64 {
    let Some((first, lengths)) = choose(optimiser, node, dice) else { return 0.0 };
    let tour = &optimiser.tour;
    let n = tour.len() as u32;
    let at = |k: u32| tour.at(if first + k >= n { first + k - n } else { first + k });
    let cuts = [0, lengths[0], lengths[0] + lengths[1], lengths[0] + lengths[1] + lengths[2]];
    let [a, b, c, d] = cuts.map(|k| (at(k), at(k + 1)));
    if [a, b, c, d].iter().any(|&(x, y)| optimiser.stays(x, y)) {
        return 0.0;
    }
    let sum = |edges: [(u32, u32); 4]| edges.iter().map(|&(x, y)| optimiser.distance(x, y)).sum::<f64>();
    let won = sum([a, b, c, d]) - sum([(a.0, c.1), (d.0, b.1), (c.0, a.1), (b.0, d.1)]);
    let path = tour.bridged(a.1, lengths);
    optimiser.tour.keep();
    optimiser.tour.lay(&path);
    for (x, y) in [a, b, c, d] {
        optimiser.look_at(x);
        optimiser.look_at(y);
    }
    let won = won + optimiser.settle(-won);
    if won < 0.0 {
        optimiser.tour.undo();
    }
    won.max(0.0)
}

/// Four edges near a node: the position of the first one, and how many nodes lie between it and the next, and so on.
/// None if two are the same.
fn choose(optimiser: &Optimiser, node: u32, dice: &mut Dice) -> Option<(u32, [u32; 3])> {
    let tour = &optimiser.tour;
    let n = tour.len() as u32;
    let start = tour.position(node);
    // places round the tour, counted so that the start is half-way: edges near it are near each other
    let mut places = [n / 2; 4];
    for place in &mut places[1..] {
        let mut at = node;
        for _ in 0..WALK {
            let (to, _) = optimiser.neighbours[at as usize][dice.below(CHOICE) as usize];
            // nowhere, the end of an open tour, is everyone's neighbour, but no way leads on from it
            if to != NONE && optimiser.neighbours[to as usize][0].0 != NONE {
                at = to;
            }
        }
        let ahead = tour.position(at) + n - start + n / 2;
        *place = ahead % n;
    }
    places.sort_unstable();
    let lengths = [places[1] - places[0], places[2] - places[1], places[3] - places[2]];
    let first = (start + n - n / 2 + places[0]) % n;
    lengths.iter().all(|&l| l > 0).then_some((first, lengths))
}
