//! Ink on a canvas is transparent: absorbances add, so one ink over another multiplies the light.

/// What an ink at full coverage lets through of red, green and blue, as a share of the canvas's light.
pub(super) type Wash = [f32; 3];

/// Linear light after a wash that covers this share of a place: `light * (1 - coverage * (1 - wash))`.
pub(super) fn washed(light: [f32; 3], wash: Wash, coverage: f32) -> [f32; 3] {
    std::array::from_fn(|k| light[k] * (1.0 - coverage * (1.0 - wash[k])))
}
