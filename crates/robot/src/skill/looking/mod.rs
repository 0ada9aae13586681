//! Fine alignment by looking and feeling: where a base stands, from what it has drawn itself.
//!
//! A picture of lines that were drawn from earlier places tells where the base stands *against those lines*: they lie where the belief of
//! their place put them, right or wrong, so what is drawn next meets them, and errors of places add up along a wall rather than show at its
//! seams. Contact at points spread over the canvas tells how far off the wall the base stands, and how it is turned against it. Before a base
//! leaves it looks back at what it has drawn there: that lies by its pen whatever is believed of its place, so what is off is the camera's
//! own mount, and the next picture is read with it.
mod align;
mod find;
mod picture;
mod register;
mod ridge;
mod view;

pub use align::{Aligned, FeelOptions, LookOptions};
pub use find::LookRefused;
pub use picture::{CameraModel, Picture};

pub(super) use align::{Alignment, AlignmentState, Surrounds};
