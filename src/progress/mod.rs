//! How far a run has come: what the stages tell, and whoever listens shows.

/// Hears how a run goes on. Calls come from any thread.
pub trait Progress: Sync {
    /// A stage begins; `total` is the work in it, in a unit of its own, when that is known.
    fn stage(&self, name: &str, total: Option<u64>);
    /// So much of the stage's work is done, from its start.
    fn advance(&self, done: u64);
    /// Something that a user should read once.
    fn note(&self, text: &str);
}

/// Listens to nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _name: &str, _total: Option<u64>) {}
    fn advance(&self, _done: u64) {}
    fn note(&self, _text: &str) {}
}
