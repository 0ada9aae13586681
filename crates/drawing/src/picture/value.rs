//! What a pixel may hold: one number or three.

/// A pixel that can be averaged.
pub(super) trait Pixel: Copy + Default + PartialEq + Send + Sync {
    /// `self + weight * other`, by component.
    fn plus(self, weight: f32, other: Self) -> Self;
    /// The smaller of each component.
    fn low(self, other: Self) -> Self;
    /// The larger of each component.
    fn high(self, other: Self) -> Self;
}

impl Pixel for f32 {
    fn plus(self, weight: f32, other: Self) -> Self {
        self + weight * other
    }
    fn low(self, other: Self) -> Self {
        self.min(other)
    }
    fn high(self, other: Self) -> Self {
        self.max(other)
    }
}

impl Pixel for [f32; 3] {
    fn plus(self, weight: f32, other: Self) -> Self {
        [self[0] + weight * other[0], self[1] + weight * other[1], self[2] + weight * other[2]]
    }
    fn low(self, other: Self) -> Self {
        [self[0].min(other[0]), self[1].min(other[1]), self[2].min(other[2])]
    }
    fn high(self, other: Self) -> Self {
        [self[0].max(other[0]), self[1].max(other[1]), self[2].max(other[2])]
    }
}
