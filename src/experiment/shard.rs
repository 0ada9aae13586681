//! A share of an experiment's trials.
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The `index`th of `count` shares, from 1: trials whose index has that remainder, so that shares take about as long.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Which, from 1.
    pub index: u64,
    /// Of how many.
    pub count: u64,
}

impl Shard {
    /// All trials.
    pub const ALL: Shard = Shard { index: 1, count: 1 };

    /// Whether a trial is in this share.
    pub fn has(&self, trial: u64) -> bool {
        trial % self.count.max(1) == self.index.wrapping_sub(1)
    }

    /// How many of `total` trials are in this share.
    pub(super) fn size(&self, total: u64) -> usize {
        (0..total).filter(|t| self.has(*t)).count()
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed =
            text.split_once('/').and_then(|(i, n)| Some(Self { index: i.parse().ok()?, count: n.parse().ok()? }));
        match parsed {
            Some(shard) if (1..=shard.count).contains(&shard.index) => Ok(shard),
            _ => Err(format!("`{text}` should be a share such as 3/10: the third of ten, counted from 1")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_whole_and_apart() {
        for count in 1..5 {
            let shards: Vec<Shard> = (1..=count).map(|i| format!("{i}/{count}").parse().unwrap()).collect();
            for trial in 0..13 {
                assert_eq!(shards.iter().filter(|s| s.has(trial)).count(), 1);
            }
            assert_eq!(shards.iter().map(|s| s.size(13)).sum::<usize>(), 13);
        }
        for text in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
