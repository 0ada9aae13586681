//! Lin-Kernighan moves on a piece of a tour.
//!
//! A move is looked for without touching the tour: what it would make of it is a [`Path`], a list of a few pieces of
//! the present one. Only moves that shorten the tour are carried out.
use super::array::{ArrayTour, PIECES, Path};
use super::metric::Metric;

/// Neighbours of each node that new edges may lead to.
pub(super) const NEIGHBOURS: usize = 8;
/// Ways on that are followed at each depth.
const BREADTH: [usize; 20] = [5, 3, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1];
/// Depths at which an edge may be taken out that leaves a ring and a path.
const RINGS: usize = 1;

const NONE: u32 = u32::MAX;
// each depth adds a piece, and a ring, opened one depth further on, one more
const _: () = assert!(1 + BREADTH.len() + RINGS <= PIECES);

/// Nodes 0..n with their places and neighbours, and a tour of them that only gets shorter.
pub(super) struct Optimiser {
    metric: Metric,
    points: Vec<[f64; 2]>,
    pub(super) neighbours: Vec<[(u32, f64); NEIGHBOURS]>,
    pub(super) tour: ArrayTour,
    /// Difference of the two ends of an edge that must stay, 0-(n-1); 0 where there is none.
    seam: u32,
    queue: Vec<u32>,
    queue_head: usize,
    queued: Vec<bool>,
}

/// A way to go on from a path.
#[derive(Clone, Copy)]
struct Candidate {
    /// Length taken out less length put in, before the path is closed.
    open: f64,
    piece: usize,
    step: u32,
    head: u32,
    ring: bool,
}

/// The shortest tour that a search has come by.
struct Best {
    gain: f64,
    path: Path,
}

impl Optimiser {
    /// A tour 0, 1, 2 ... of points, with neighbours nearest first, filled up with `u32::MAX`. With `seam` the edge
    /// from the last to the first node stays.
    pub(super) fn new(
        metric: Metric,
        points: Vec<[f64; 2]>,
        neighbours: Vec<[(u32, f64); NEIGHBOURS]>,
        seam: bool,
    ) -> Self {
        let n = points.len();
        Self {
            metric,
            points,
            neighbours,
            tour: ArrayTour::new(n),
            seam: if seam { n as u32 - 1 } else { 0 },
            queue: Vec::new(),
            queue_head: 0,
            queued: vec![false; n],
        }
    }

    #[inline(always)]
    pub(super) fn distance(&self, a: u32, b: u32) -> f64 {
        self.metric.distance(self.points[a as usize], self.points[b as usize])
    }

    #[inline(always)]
    pub(super) fn stays(&self, a: u32, b: u32) -> bool {
        a.abs_diff(b) == self.seam
    }

    /// Puts a node on the list of those to look at.
    pub(super) fn look_at(&mut self, node: u32) {
        if !self.queued[node as usize] {
            self.queued[node as usize] = true;
            self.queue.push(node);
        }
    }

    /// Looks at the listed nodes, and at those that moves touch, until no move shortens the tour; returns by how much
    /// it got shorter.
    ///
    /// Stops early where that is `debt`, by which a kick had made the tour longer: lengths are exact, so that this is
    /// hardly ever another tour than the one before the kick, in which there was nothing left to look for.
    pub(super) fn settle(&mut self, debt: f64) -> f64 {
        let mut total = 0.0;
        while self.queue_head < self.queue.len() {
            let node = self.queue[self.queue_head];
            self.queue_head += 1;
            self.queued[node as usize] = false;
            while let Some(gain) = self.improve(node) {
                total += gain;
                if total == debt {
                    for node in self.queue.drain(self.queue_head..) {
                        self.queued[node as usize] = false;
                    }
                    break;
                }
            }
        }
        self.queue.clear();
        self.queue_head = 0;
        total
    }

    /// Looks for a move that takes out an edge at a node, and makes it.
    fn improve(&mut self, node: u32) -> Option<f64> {
        for forwards in [true, false] {
            let head = if forwards { self.tour.next(node) } else { self.tour.previous(node) };
            if self.stays(node, head) {
                continue;
            }
            let gain = self.distance(node, head);
            let path = self.tour.path(head, forwards);
            let mut best = Best { gain: 0.0, path };
            self.deepen(0, &path, head, node, gain, &mut best);
            if best.gain > 0.0 {
                self.make(&best.path);
                return Some(best.gain);
            }
        }
        None
    }

    /// Follows a path from `head` to `tail`, which takes out `gain` more than it puts in but isn't closed.
    fn deepen(&mut self, depth: usize, path: &Path, head: u32, tail: u32, gain: f64, winner: &mut Best) {
        const MOST: usize = 2 * NEIGHBOURS;
        let mut ways = [Candidate { open: 0.0, piece: 0, step: 0, head: 0, ring: false }; MOST];
        let mut count = 0;
        let mut best: Option<(f64, usize)> = None;
        for k in 0..NEIGHBOURS {
            let (to, length) = self.neighbours[head as usize][k];
            let left = gain - length;
            if to == NONE || left <= winner.gain {
                break;
            }
            let step = path.frame.step(self.tour.position(to));
            let piece = path.piece_of(step);
            if let Some(before) = path.before(piece, step) {
                let new_head = self.tour.at(path.frame.position(before));
                if new_head != head && !self.stays(new_head, to) {
                    let open = left + self.distance(new_head, to);
                    let closed = open - self.distance(new_head, tail);
                    if closed > 0.0 && best.is_none_or(|(b, _)| closed > b) {
                        best = Some((closed, count));
                    }
                    ways[count] = Candidate { open, piece, step, head: new_head, ring: false };
                    count += 1;
                }
            }
            if depth < RINGS
                && let Some(after) = path.after(piece, step)
            {
                let new_head = self.tour.at(path.frame.position(after));
                if !self.stays(new_head, to) && to != head {
                    let open = left + self.distance(new_head, to);
                    ways[count] = Candidate { open, piece, step, head: new_head, ring: true };
                    count += 1;
                }
            }
        }
        if let Some((gain, i)) = best
            && gain > winner.gain
        {
            let new = path.turned_before(ways[i].piece, ways[i].step);
            *winner = Best { gain, path: new };
        }
        if depth + 1 >= BREADTH.len() {
            return;
        }
        for i in 0..BREADTH[depth].min(count) {
            let most = (i..count).fold(i, |m, j| if ways[j].open > ways[m].open { j } else { m });
            ways.swap(i, most);
            let way = ways[i];
            if way.open <= winner.gain {
                break;
            }
            if way.ring {
                self.open_ring(depth + 1, path, &way, tail, winner);
            } else {
                let new = path.turned_before(way.piece, way.step);
                self.deepen(depth + 1, &new, way.head, tail, way.open, winner);
            }
            if winner.gain > 0.0 {
                return;
            }
        }
    }

    /// Follows a path of which all up to a step was closed to a ring: an edge from the rest's start into the ring
    /// opens it again.
    fn open_ring(&mut self, depth: usize, path: &Path, ring: &Candidate, tail: u32, winner: &mut Best) {
        const MOST: usize = 2 * NEIGHBOURS;
        let mut ways = [(0.0, 0, 0, false, 0); MOST];
        let mut count = 0;
        let mut best: Option<(f64, usize)> = None;
        for k in 0..NEIGHBOURS {
            let (to, length) = self.neighbours[ring.head as usize][k];
            let left = ring.open - length;
            if to == NONE || left <= winner.gain {
                break;
            }
            let step = path.frame.step(self.tour.position(to));
            let piece = path.piece_of(step);
            let inside = piece < ring.piece
                || piece == ring.piece
                    && if path.pieces()[piece].backwards { step >= ring.step } else { step <= ring.step };
            if !inside {
                continue;
            }
            // opened before `to`, which then comes next to the rest, or after it
            for turned in [true, false] {
                let other = if turned { path.before(piece, step) } else { path.after(piece, step) };
                let Some(other) = other.filter(|_| turned || step != ring.step) else { continue };
                let new_head = self.tour.at(path.frame.position(other));
                if self.stays(new_head, to) {
                    continue;
                }
                let open = left + self.distance(new_head, to);
                let closed = open - self.distance(new_head, tail);
                if closed > 0.0 && best.is_none_or(|(b, _)| closed > b) {
                    best = Some((closed, count));
                }
                ways[count] = (open, piece, if turned { step } else { other }, turned, new_head);
                count += 1;
            }
        }
        if let Some((gain, i)) = best
            && gain > winner.gain
        {
            let (_, piece, step, turned, _) = ways[i];
            let new = path.ring_opened(ring.piece, ring.step, piece, step, turned);
            *winner = Best { gain, path: new };
        }
        if depth + 1 >= BREADTH.len() {
            return;
        }
        for i in 0..BREADTH[depth].min(count) {
            let most = (i..count).fold(i, |m, j| if ways[j].0 > ways[m].0 { j } else { m });
            ways.swap(i, most);
            if ways[i].0 <= winner.gain {
                break;
            }
            let (open, piece, step, turned, head) = ways[i];
            let new = path.ring_opened(ring.piece, ring.step, piece, step, turned);
            self.deepen(depth + 1, &new, head, tail, open, winner);
            if winner.gain > 0.0 {
                return;
            }
        }
    }

    /// Makes a move, and puts the ends of the edges that it changes on the list.
    fn make(&mut self, path: &Path) {
        for piece in path.pieces() {
            for step in [piece.low, piece.high] {
                let node = self.tour.at(path.frame.position(step));
                self.look_at(node);
            }
        }
        self.tour.lay(path);
    }
}
