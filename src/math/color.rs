//! Colours.
use serde::{Deserialize, Serialize};

/// A colour, sRGB, 0..=255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Rgb(pub [u8; 3]);
