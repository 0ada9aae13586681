//! What can keep a picture from becoming strokes.

/// A picture or an option that no artwork can be made from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArtError {
    /// The picture wants no stroke.
    #[error("there is nothing to draw: {reason}")]
    NothingToDraw {
        /// Why.
        reason: String,
    },
    /// An option that makes no sense.
    #[error("{name} = {value}: {message}")]
    BadOption {
        /// The option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        message: String,
    },
}

impl ArtError {
    /// The option must lie in `low..=high`; the message says what would be right.
    pub(super) fn within(name: &'static str, value: f64, low: f64, high: f64, message: &str) -> Result<(), Self> {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(Self::BadOption { name, value, message: message.to_string() })
        }
    }
}
