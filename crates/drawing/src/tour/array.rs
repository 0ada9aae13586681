//! A tour as an array, changed by laying pieces of it in another order, and able to take changes back.

/// Most pieces that one move may cut a tour into.
pub(super) const PIECES: usize = 24;

/// A run of a tour, in steps from where a path starts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Piece {
    /// First step.
    pub(super) low: u32,
    /// Last step.
    pub(super) high: u32,
    /// Whether it is walked from `high` to `low`.
    pub(super) backwards: bool,
}

impl Piece {
    fn len(self) -> u32 {
        self.high - self.low + 1
    }

    fn turned(self) -> Self {
        Self { backwards: !self.backwards, ..self }
    }
}

/// Where a path starts in the array, and which way it counts its steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    origin: u32,
    forwards: bool,
    len: u32,
}

impl Frame {
    /// The step of a position.
    #[inline(always)]
    pub(super) fn step(self, position: u32) -> u32 {
        let (a, b) = if self.forwards { (position, self.origin) } else { (self.origin, position) };
        if a >= b { a - b } else { a + self.len - b }
    }

    /// The position of a step.
    #[inline(always)]
    pub(super) fn position(self, step: u32) -> u32 {
        if self.forwards {
            let p = self.origin + step;
            if p >= self.len { p - self.len } else { p }
        } else if self.origin >= step {
            self.origin - step
        } else {
            self.origin + self.len - step
        }
    }
}

/// A tour before and after a move: the old one cut into pieces, walked in a new order.
///
/// The path starts at the first piece's first node, its *head*, and ends at its *tail*, which doesn't move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub(super) frame: Frame,
    pieces: [Piece; PIECES],
    len: usize,
}

impl Path {
    /// Pieces in the order of the walk.
    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces[..self.len]
    }

    /// Index of the piece that holds a step.
    #[inline(always)]
    pub(super) fn piece_of(&self, step: u32) -> usize {
        let mut i = 0;
        while i + 1 < self.len && !(self.pieces[i].low <= step && step <= self.pieces[i].high) {
            i += 1;
        }
        i
    }

    /// The step before `step` on the path, which is in piece `i`; none at the piece's start.
    #[inline(always)]
    pub(super) fn before(&self, i: usize, step: u32) -> Option<u32> {
        let piece = self.pieces[i];
        if piece.backwards { (step < piece.high).then(|| step + 1) } else { (step > piece.low).then(|| step - 1) }
    }

    /// The step after `step` on the path, which is in piece `i`; none at the piece's end.
    #[inline(always)]
    pub(super) fn after(&self, i: usize, step: u32) -> Option<u32> {
        let piece = self.pieces[i];
        if piece.backwards { (step > piece.low).then(|| step - 1) } else { (step < piece.high).then(|| step + 1) }
    }

    fn push(&mut self, piece: Piece) {
        self.pieces[self.len] = piece;
        self.len += 1;
    }

    fn empty(&self) -> Self {
        Self { frame: self.frame, pieces: [Piece::default(); PIECES], len: 0 }
    }

    /// Piece `i` cut before `step`.
    #[inline(always)]
    fn cut_before(&self, i: usize, step: u32) -> (Piece, Piece) {
        let p = self.pieces[i];
        if p.backwards {
            (Piece { low: step + 1, ..p }, Piece { high: step, ..p })
        } else {
            (Piece { high: step - 1, ..p }, Piece { low: step, ..p })
        }
    }

    /// The path with everything before `step`, in piece `i`, turned round: the step before becomes the head.
    pub(super) fn turned_before(&self, i: usize, step: u32) -> Self {
        let (left, right) = self.cut_before(i, step);
        let mut path = self.empty();
        path.push(left.turned());
        for j in (0..i).rev() {
            path.push(self.pieces[j].turned());
        }
        path.push(right);
        for &p in &self.pieces[i + 1..self.len] {
            path.push(p);
        }
        path
    }

    /// Everything up to `last` made a ring, and the ring opened at a step of it and put before the rest.
    ///
    /// `last` is the last step of the ring, in piece `i`, and not the end of that piece. The ring is opened before
    /// `open` (in piece `j`). With `turned` the ring is walked backwards from the step before `open`, and `open`
    /// comes next to the rest; else it is walked from `open` on, and the step before `open` comes next to the rest.
    pub(super) fn ring_opened(&self, i: usize, last: u32, j: usize, open: u32, turned: bool) -> Self {
        let mut ring = self.empty();
        let after = if self.pieces[i].backwards { last - 1 } else { last + 1 };
        let (left, right) = self.cut_before(i, after);
        for &p in &self.pieces[..i] {
            ring.push(p);
        }
        ring.push(left);
        let (a, b) = ring.cut_before(j, open);
        let mut path = self.empty();
        if turned {
            // from the step before `open` back to the head, on to the ring's last, and back to `open`
            path.push(a.turned());
            for k in (0..j).rev() {
                path.push(ring.pieces[k].turned());
            }
            for k in (j + 1..ring.len).rev() {
                path.push(ring.pieces[k].turned());
            }
            path.push(b.turned());
        } else {
            path.push(b);
            for k in j + 1..ring.len {
                path.push(ring.pieces[k]);
            }
            for k in 0..j {
                path.push(ring.pieces[k]);
            }
            path.push(a);
        }
        path.push(right);
        for &p in &self.pieces[i + 1..self.len] {
            path.push(p);
        }
        path
    }
}

/// A closed tour of the nodes 0..n.
pub(super) struct ArrayTour {
    order: Vec<u32>,
    position: Vec<u32>,
    /// What was overwritten since the last `keep`: nodes, and runs of positions (first, length, upwards).
    old: Vec<u32>,
    runs: Vec<(u32, u32, bool)>,
    moved: Vec<u32>,
}

impl ArrayTour {
    /// The tour 0, 1, 2 ...
    pub(super) fn new(n: usize) -> Self {
        let order: Vec<u32> = (0..n as u32).collect();
        Self { position: order.clone(), order, old: Vec::new(), runs: Vec::new(), moved: Vec::new() }
    }

    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    #[inline(always)]
    pub(super) fn position(&self, node: u32) -> u32 {
        self.position[node as usize]
    }

    #[inline(always)]
    pub(super) fn at(&self, position: u32) -> u32 {
        self.order[position as usize]
    }

    #[inline(always)]
    pub(super) fn next(&self, node: u32) -> u32 {
        let p = self.position[node as usize] as usize + 1;
        self.order[if p == self.order.len() { 0 } else { p }]
    }

    #[inline(always)]
    pub(super) fn previous(&self, node: u32) -> u32 {
        let p = self.position[node as usize] as usize;
        self.order[if p == 0 { self.order.len() - 1 } else { p - 1 }]
    }

    /// The whole tour as a path from `head` on, forwards or backwards.
    #[inline(always)]
    pub(super) fn path(&self, head: u32, forwards: bool) -> Path {
        let len = self.order.len() as u32;
        let frame = Frame { origin: self.position[head as usize], forwards, len };
        let mut pieces = [Piece::default(); PIECES];
        pieces[0] = Piece { low: 0, high: len - 1, backwards: false };
        Path { frame, pieces, len: 1 }
    }

    /// The path from `head` on with its first three runs, of these lengths, in reverse order: a double bridge.
    pub(super) fn bridged(&self, head: u32, lengths: [u32; 3]) -> Path {
        let mut path = self.path(head, true);
        let ends = [lengths[0], lengths[0] + lengths[1], lengths[0] + lengths[1] + lengths[2]];
        let piece = |low, end| Piece { low, high: end - 1, backwards: false };
        let rest = piece(ends[2], path.frame.len);
        path.len = 0;
        for p in [piece(ends[1], ends[2]), piece(ends[0], ends[1]), piece(0, ends[0]), rest] {
            path.push(p);
        }
        path
    }

    /// Lays the pieces of a path in their order; the longest one stays where it is.
    pub(super) fn lay(&mut self, path: &Path) {
        let pieces = path.pieces();
        let n = pieces.len();
        let longest = (0..n).max_by_key(|&i| pieces[i].len()).unwrap_or(0);
        // if that one is walked backwards, walk everything the other way instead
        let turn = pieces[longest].backwards;
        let len = path.frame.len;
        self.moved.clear();
        let mut to = pieces[longest].high + 1;
        let mut targets = [(0, 0); PIECES];
        let mut count = 0;
        for k in 1..n {
            let i = if turn { longest + n - k } else { longest + k } % n;
            let piece = if turn { pieces[i].turned() } else { pieces[i] };
            if to >= len {
                to -= len;
            }
            if to != piece.low || piece.backwards {
                let first = path.frame.position(if piece.backwards { piece.high } else { piece.low });
                let upwards = path.frame.forwards != piece.backwards;
                copy_run(&self.order, &mut self.moved, first, piece.len(), upwards);
                targets[count] = (to, piece.len());
                count += 1;
            }
            to += piece.len();
        }
        let mut from = 0;
        for &(to, len) in &targets[..count] {
            let first = path.frame.position(to);
            copy_run(&self.order, &mut self.old, first, len, path.frame.forwards);
            self.runs.push((first, len, path.frame.forwards));
            let nodes = &self.moved[from as usize..(from + len) as usize];
            put_run(&mut self.order, &mut self.position, nodes, first, path.frame.forwards);
            from += len;
        }
    }

    /// Makes the present tour the one that `undo` returns to.
    pub(super) fn keep(&mut self) {
        self.old.clear();
        self.runs.clear();
    }

    /// Takes everything back since the last `keep`.
    pub(super) fn undo(&mut self) {
        while let Some((first, len, upwards)) = self.runs.pop() {
            let from = self.old.len() - len as usize;
            put_run(&mut self.order, &mut self.position, &self.old[from..], first, upwards);
            self.old.truncate(from);
        }
    }
}

/// Appends the nodes at `len` positions from `first` on, upwards or downwards round the array.
fn copy_run(order: &[u32], out: &mut Vec<u32>, first: u32, len: u32, upwards: bool) {
    let (first, len) = (first as usize, len as usize);
    if upwards {
        let straight = len.min(order.len() - first);
        out.extend_from_slice(&order[first..first + straight]);
        out.extend_from_slice(&order[..len - straight]);
    } else {
        let straight = len.min(first + 1);
        out.extend(order[first + 1 - straight..=first].iter().rev());
        out.extend(order[order.len() - (len - straight)..].iter().rev());
    }
}

/// Puts nodes at the positions from `first` on, upwards or downwards round the array.
fn put_run(order: &mut [u32], position: &mut [u32], nodes: &[u32], first: u32, upwards: bool) {
    let first = first as usize;
    let straight = nodes.len().min(if upwards { order.len() - first } else { first + 1 });
    let (here, round) = nodes.split_at(straight);
    let n = order.len();
    let mut put = |low: usize, nodes: &[u32]| {
        let slots = &mut order[low..low + nodes.len()];
        if upwards {
            slots.copy_from_slice(nodes);
        } else {
            for (slot, node) in slots.iter_mut().zip(nodes.iter().rev()) {
                *slot = *node;
            }
        }
        for (p, &node) in (low as u32..).zip(slots.iter()) {
            position[node as usize] = p;
        }
    };
    if upwards {
        put(first, here);
        put(0, round);
    } else {
        put(first + 1 - straight, here);
        put(n - round.len(), round);
    }
}
