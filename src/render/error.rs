//! Why there is no picture.

/// Why a view can't be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// There is no graphics adapter that can render the views, not even a software one.
    #[error(
        "no graphics adapter that can render: for 3D views install a software driver (Debian: apt-get install mesa-vulkan-drivers)"
    )]
    NoAdapter,
    /// The adapter refused to work.
    #[error("the graphics adapter failed: {0}")]
    Device(String),
    /// The view's size is zero or more than the adapter can hold.
    #[error("a view of {width} x {height} px: the adapter renders 1 to {max} px a side")]
    Size {
        /// Asked width, px.
        width: u32,
        /// Asked height, px.
        height: u32,
        /// Largest side, px.
        max: u32,
    },
    /// The camera has no direction: eye and target coincide, `up` lies along the line of sight, or a number isn't finite.
    #[error("view from {eye:?} to {target:?} with {fov_deg} degrees has no direction")]
    Camera {
        /// Eye, m, world.
        eye: [f64; 3],
        /// Target, m, world.
        target: [f64; 3],
        /// Vertical field of view, degrees.
        fov_deg: f64,
    },
    /// No view has this name.
    #[error("no view is named `{name}`: known are {known}")]
    UnknownView {
        /// The asked name.
        name: String,
        /// The names there are.
        known: String,
    },
}
