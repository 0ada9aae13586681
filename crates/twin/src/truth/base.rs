//! Where a base stands in truth.
use crate::math::Pose;

/// Where a driven base stands. Only the physics and the measurements may see it; a robot knows its odometry and its sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueBase(Pose);

impl TrueBase {
    pub(crate) fn new(pose: Pose) -> Self {
        Self(pose)
    }

    /// Pose of the base's frame, m, world: for who measures.
    pub fn reveal(&self) -> &Pose {
        &self.0
    }
}
