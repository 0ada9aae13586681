//! Lengths between points, rounded to a grid on which sums are exact.

/// 1.5 * 2^52: so many quanta added to a number push all digits below one quantum out of an `f64`.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// Euclidean distance, rounded to a multiple of a power of two.
///
/// With every length on one grid, sums and differences of a few dozen of them are exact: a move that gains more than
/// nothing really shortens the tour, whatever the order of the sums, and no search can go round in circles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Metric {
    shift: f64,
}

impl Metric {
    /// For points in [-1, 1] x [-1, 1]: distances to 2^-46.
    pub(super) fn fine() -> Self {
        Self { shift: SHIFT * 2f64.powi(-46) }
    }

    /// Distances to the nearest integer, TSPLIB's `EUC_2D`.
    pub(super) fn whole() -> Self {
        Self { shift: SHIFT }
    }

    /// Distance between two points; 0 to a point that is nowhere (NaN).
    #[inline(always)]
    pub(super) fn distance(self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
        let d = ((dx * dx + dy * dy).sqrt() + self.shift) - self.shift;
        if d > 0.0 { d } else { 0.0 }
    }
}
