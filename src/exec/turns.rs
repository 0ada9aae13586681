//! Who waits for whom: an order between the arms' visits to the canvas, kept whatever each of them really takes.
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::plan::VisitOrder;

/// Keeps the order of visits among arms that run on threads of their own.
pub struct Turns {
    order: VisitOrder,
    board: Mutex<Board>,
    bell: Condvar,
}

#[derive(Default)]
struct Board {
    /// The step after the last of each visit that has ended, by arm.
    ended: Vec<Vec<Option<u64>>>,
    /// Arms whose work is over, done or not.
    gone: Vec<bool>,
    /// The step at which an arm gave up.
    called_off: Option<u64>,
    /// Whether every arm is to stop where it next can.
    stopping: bool,
}

impl Turns {
    /// Nobody has begun.
    pub fn new(order: VisitOrder) -> Self {
        let arms = order.arms();
        let board = Board { ended: vec![Vec::new(); arms], gone: vec![false; arms], ..Board::default() };
        Self { order, board: Mutex::new(board), bell: Condvar::new() }
    }

    fn board(&self) -> MutexGuard<'_, Board> {
        // a thread that panicked while it held the board left it whole
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many arms there are.
    pub fn arms(&self) -> usize {
        self.order.arms()
    }

    /// Waits until all visits that come before this one have ended: the last of the steps at which they did, or `None` if one of them
    /// never will.
    pub fn wait_for(&self, arm: usize, visit: usize) -> Option<u64> {
        let mut board = self.board();
        loop {
            let before = self.order.before(arm, visit);
            let end = |(a, v): &(usize, usize)| board.ended.get(*a).and_then(|e| e.get(*v).copied().flatten());
            let open: Vec<usize> = before.iter().filter(|b| end(b).is_none()).map(|b| b.0).collect();
            if open.is_empty() {
                return Some(before.iter().filter_map(end).max().unwrap_or(0));
            }
            if open.iter().any(|a| board.gone[*a]) {
                return None;
            }
            board = self.bell.wait(board).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A visit has ended; `step` is the one after its last.
    pub fn end(&self, arm: usize, visit: usize, step: u64) {
        let mut board = self.board();
        let ended = &mut board.ended[arm];
        ended.resize(ended.len().max(visit + 1), None);
        ended[visit] = Some(step);
        self.bell.notify_all();
    }

    /// An arm's work is over; `gave_up` is the step at which it gave up, if it did.
    pub fn leave(&self, arm: usize, gave_up: Option<u64>) {
        let mut board = self.board();
        board.gone[arm] = true;
        board.called_off = [board.called_off, gave_up].into_iter().flatten().min();
        self.bell.notify_all();
    }

    /// Whether the run was called off at this step or before, as far as is known by now.
    pub fn is_called_off(&self, step: u64) -> bool {
        self.board().called_off.is_some_and(|end| step >= end)
    }

    /// Lets every arm stop where it next can.
    pub fn stop(&self) {
        self.board().stopping = true;
        self.bell.notify_all();
    }

    /// Whether arms are to stop where they next can.
    pub fn is_stopping(&self) -> bool {
        self.board().stopping
    }
}
