//! Depth and segments by a model of one's own, in the ONNX format.
use std::path::Path;

use rten::{Dimension, Model, Value};

use crate::art::depth::SemanticsError;
use crate::files;
use crate::math::srgb_from_linear;
use crate::picture::{Labels, Picture, Plane};

/// How a picture is shown to a model, and how its answer is read. The defaults are those of most published models for
/// depth and segmentation.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelOptions {
    /// Longer side of the picture shown to a model that takes any size, px.
    pub side: usize,
    /// Both sides are multiples of this, px.
    pub multiple: usize,
    /// Subtracted from red, green and blue (sRGB, 0..=1).
    pub mean: [f32; 3],
    /// By which they are then divided.
    pub deviation: [f32; 3],
    /// Whether a larger depth is nearer (a disparity), or farther (a distance).
    pub near_is_large: bool,
}

impl Default for ModelOptions {
    fn default() -> Self {
        // the mean and standard deviation of ImageNet
        let (mean, deviation) = ([0.485, 0.456, 0.406], [0.229, 0.224, 0.225]);
        Self { side: 518, multiple: 14, mean, deviation, near_is_large: true }
    }
}

/// Relative depth of a picture, 0 (far) ..= 1 (near), by an ONNX model: from `1 x 3 x H x W` to `1 x 1 x H x W`, `1 x H x W`
/// or `H x W`. The plane has the size of the model's answer.
///
/// # Errors
/// [`SemanticsError::Model`] when the file isn't a model, wants another input, or doesn't answer with a depth map.
pub fn depth_from_model(file: &Path, picture: &Picture, options: &ModelOptions) -> Result<Plane, SemanticsError> {
    let (shape, values) = answer(file, picture, options)?;
    let (width, height) = match shape[..] {
        [1, 1, h, w] | [1, h, w] | [h, w] => (w, h),
        _ => {
            return wrong(
                file,
                format!("a depth model answers 1 x 1 x H x W or 1 x H x W, but this one {}", text(&shape)),
            );
        }
    };
    if let Some(v) = values.iter().find(|v| !v.is_finite()) {
        return wrong(file, format!("there is a depth of {v}"));
    }
    let (low, high) = values.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let span = high - low;
    let near = |v: &f32| {
        let d = if span > 0.0 && span.is_finite() { ((v - low) / span).clamp(0.0, 1.0) } else { 0.5 };
        if options.near_is_large { d } else { 1.0 - d }
    };
    match Plane::from_values(width, height, values.iter().map(near).collect()) {
        Some(plane) if width * height > 0 => Ok(plane),
        _ => wrong(file, "it answers with no pixels".to_string()),
    }
}

/// The class of each pixel of a picture by an ONNX model: from `1 x 3 x H x W` to scores `1 x C x H x W`, of which the highest
/// is taken, or to classes `1 x 1 x H x W`, `1 x H x W` or `H x W`. Labels have the size of the model's answer.
///
/// # Errors
/// [`SemanticsError::Model`] when the file isn't a model, wants another input, or doesn't answer with classes.
pub fn labels_from_model(file: &Path, picture: &Picture, options: &ModelOptions) -> Result<Labels, SemanticsError> {
    let (shape, values) = answer(file, picture, options)?;
    let (classes, width, height) = match shape[..] {
        [1, c, h, w] => (c, w, h),
        [1, h, w] | [h, w] => (1, w, h),
        _ => {
            return wrong(file, format!("a segmentation model answers 1 x C x H x W, but this one {}", text(&shape)));
        }
    };
    let n = width * height;
    if n == 0 || classes == 0 || classes > usize::from(u16::MAX) + 1 {
        return wrong(file, format!("it answers {}, in which there are no classes", text(&shape)));
    }
    let class = |i: usize| {
        if classes == 1 {
            values[i].round().clamp(0.0, f32::from(u16::MAX)) as u16
        } else {
            let best = (0..classes).max_by(|a, b| values[a * n + i].total_cmp(&values[b * n + i]).then(b.cmp(a)));
            best.unwrap_or(0) as u16
        }
    };
    Ok(Labels { width, height, ids: (0..n).map(class).collect() })
}

fn wrong<T>(file: &Path, message: String) -> Result<T, SemanticsError> {
    Err(SemanticsError::Model { file: file.to_path_buf(), message })
}

fn text(shape: &[usize]) -> String {
    shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")
}

/// What a model answers to a picture: a shape, and the values in it.
fn answer(file: &Path, picture: &Picture, options: &ModelOptions) -> Result<(Vec<usize>, Vec<f32>), SemanticsError> {
    if picture.pixels.is_empty() {
        let (width, height) = (picture.width(), picture.height());
        return Err(SemanticsError::Size { what: "picture", width, height, values: 0 });
    }
    let bytes = files::read(file).map_err(|source| SemanticsError::Io { file: file.to_path_buf(), source })?;
    let model = match Model::load(bytes) {
        Ok(model) => model,
        Err(e) => return wrong(file, format!("it isn't an ONNX model that can be read: {e}")),
    };
    let (&[input], &[output, ..]) = (model.input_ids(), model.output_ids()) else {
        let (i, o) = (model.input_ids().len(), model.output_ids().len());
        return wrong(
            file,
            format!("it has {i} inputs and {o} outputs, but one picture goes in and one map comes out"),
        );
    };
    let (width, height) = size(file, model.input_shape(0), picture, options)?;
    let Ok(value) = Value::from_shape([1, 3, height, width], tensor(picture, width, height, options)) else {
        return wrong(file, format!("a picture of {width} x {height} px doesn't fit it"));
    };
    let mut answers = match model.run(vec![(input, value.into())], &[output], None) {
        Ok(answers) => answers,
        Err(e) => return wrong(file, format!("it can't be run on 1 x 3 x {height} x {width}: {e}")),
    };
    let Some(value) = answers.pop() else { return wrong(file, "it gives no answer".to_string()) };
    match floats(&value) {
        Some(found) => Ok(found),
        None => wrong(file, format!("it answers with {:?} that is no map", value.dtype())),
    }
}

/// The size of the picture that a model is shown, px.
fn size(
    file: &Path,
    shape: Option<Vec<Dimension>>,
    picture: &Picture,
    options: &ModelOptions,
) -> Result<(usize, usize), SemanticsError> {
    let long = picture.width().max(picture.height()) as f64;
    let multiple = options.multiple.clamp(1, 1024);
    let free = |side: usize| {
        let desired = side as f64 / long * options.side.clamp(1, 8192) as f64 / multiple as f64;
        (desired.round() as usize).max(1) * multiple
    };
    let (mut width, mut height) = (free(picture.width()), free(picture.height()));
    let Some(shape) = shape else { return Ok((width, height)) };
    let [batch, channels, h, w] = &shape[..] else {
        let n = shape.len();
        return wrong(file, format!("its input has {n} dimensions, but a picture has 4: 1 x 3 x height x width"));
    };
    for (dimension, wanted, what) in [(batch, 1, "pictures at a time"), (channels, 3, "channels")] {
        if let Dimension::Fixed(n) = dimension
            && *n != wanted
        {
            return wrong(file, format!("it takes {n} {what}, but {wanted} are given: 1 x 3 x height x width"));
        }
    }
    if let Dimension::Fixed(n) = h {
        height = *n;
    }
    if let Dimension::Fixed(n) = w {
        width = *n;
    }
    if width == 0 || height == 0 || width.saturating_mul(height) > 1 << 26 {
        return wrong(file, format!("it takes pictures of {width} x {height} px"));
    }
    Ok((width, height))
}

/// The picture as a model wants it: red, then green, then blue.
fn tensor(picture: &Picture, width: usize, height: usize, options: &ModelOptions) -> Vec<f32> {
    let small = picture.resized(width, height);
    let channel = |k: usize| {
        let deviation = if options.deviation[k] == 0.0 { 1.0 } else { options.deviation[k] };
        small
            .pixels
            .iter()
            .map(move |p| (f32::from(srgb_from_linear(f64::from(p[k]))) / 255.0 - options.mean[k]) / deviation)
    };
    (0..3).flat_map(channel).collect()
}

/// A tensor of 2 to 4 dimensions as numbers.
fn floats(value: &Value) -> Option<(Vec<usize>, Vec<f32>)> {
    macro_rules! of {
        ($element:ty, $rank:literal) => {
            if let Ok((shape, data)) = value.clone().into_shape_vec::<$element, $rank>() {
                return Some((shape.to_vec(), data.into_iter().map(|v| v as f32).collect()));
            }
        };
    }
    of!(f32, 4);
    of!(f32, 3);
    of!(f32, 2);
    of!(i32, 4);
    of!(i32, 3);
    of!(i32, 2);
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A field of a protobuf message: a number, or bytes with their length.
    fn number(field: u64, value: u64) -> Vec<u8> {
        [varint(field << 3), varint(value)].concat()
    }

    fn bytes(field: u64, value: &[u8]) -> Vec<u8> {
        [varint(field << 3 | 2), varint(value.len() as u64), value.to_vec()].concat()
    }

    fn varint(mut v: u64) -> Vec<u8> {
        let mut out = Vec::new();
        while v >= 0x80 {
            out.push(v as u8 | 0x80);
            v >>= 7;
        }
        out.push(v as u8);
        out
    }

    /// A tensor with a name and a shape (onnx.proto: `ValueInfoProto`); negative sizes are free.
    fn info(name: &str, shape: &[i64]) -> Vec<u8> {
        let dimension =
            |n: &i64| bytes(1, &if *n < 0 { bytes(2, format!("free{}", -n).as_bytes()) } else { number(1, *n as u64) });
        let shape: Vec<u8> = shape.iter().flat_map(dimension).collect();
        let tensor = [number(1, 1), bytes(2, &shape)].concat();
        [bytes(1, name.as_bytes()), bytes(2, &bytes(1, &tensor))].concat()
    }

    /// A model of one convolution whose kernel is one pixel: each output channel is a mixture of red, green and blue.
    fn mixer(weights: &[[f32; 3]], input: &[i64]) -> Vec<u8> {
        let raw: Vec<u8> = weights.iter().flatten().flat_map(|w| w.to_le_bytes()).collect();
        let sizes: Vec<u8> = [weights.len() as u64, 3, 1, 1].iter().flat_map(|n| number(1, *n)).collect();
        let initializer = [sizes, number(2, 1), bytes(8, b"w"), bytes(9, &raw)].concat();
        let kernel = [bytes(1, b"kernel_shape"), number(20, 7), number(8, 1), number(8, 1)].concat();
        let node =
            [bytes(1, b"x"), bytes(1, b"w"), bytes(2, b"y"), bytes(3, b"mix"), bytes(4, b"Conv"), bytes(5, &kernel)];
        let graph = [
            bytes(1, &node.concat()),
            bytes(2, b"mixer"),
            bytes(5, &initializer),
            bytes(11, &info("x", input)),
            bytes(12, &info("y", &[1, weights.len() as i64, -1, -2])),
        ];
        [number(1, 8), bytes(7, &graph.concat()), bytes(8, &[bytes(1, b""), number(2, 13)].concat())].concat()
    }

    fn file(model: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.onnx");
        std::fs::write(&path, model).unwrap();
        (folder, path)
    }

    fn raw() -> ModelOptions {
        ModelOptions { mean: [0.0; 3], deviation: [1.0; 3], side: 8, multiple: 1, ..ModelOptions::default() }
    }

    fn picture() -> Picture {
        let pixels = vec![[0.0; 3], [1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        Picture::from_pixels(3, 2, pixels).unwrap().resized(3, 2)
    }

    #[test]
    fn a_model_of_luminance_gives_depth() {
        let (_folder, path) = file(&mixer(&[[0.25, 0.5, 0.25]], &[1, 3, 2, 3]));
        let depth = depth_from_model(&path, &picture(), &raw()).unwrap();
        assert_eq!((depth.width(), depth.height()), (3, 2));
        for (found, right) in depth.values.iter().zip([0.0, 1.0, 0.25, 0.5, 0.25, 0.5]) {
            assert!((found - right).abs() < 1e-5, "{:?}", depth.values);
        }
        let far = depth_from_model(&path, &picture(), &ModelOptions { near_is_large: false, ..raw() }).unwrap();
        assert!((far.values[1]).abs() < 1e-5);
    }

    #[test]
    fn a_model_of_classes_gives_labels_at_any_size() {
        let (_folder, path) = file(&mixer(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], &[1, 3, -1, -2]));
        let labels = labels_from_model(&path, &picture(), &ModelOptions { side: 3, ..raw() }).unwrap();
        assert_eq!((labels.width, labels.height), (3, 2));
        assert_eq!(labels.ids[2..], [0, 1, 2, 1]);
        let large = labels_from_model(&path, &picture(), &ModelOptions { side: 30, ..raw() }).unwrap();
        assert_eq!((large.width, large.height), (30, 20));
        // normalisation shifts all channels alike here
        let same = ModelOptions { mean: [0.5; 3], deviation: [0.25; 3], side: 3, ..raw() };
        assert_eq!(labels_from_model(&path, &picture(), &same).unwrap().ids[2..], [0, 1, 2, 1]);
    }

    #[test]
    fn what_is_no_such_model_is_said() {
        let error = |model: &[u8]| {
            let (_folder, path) = file(model);
            let message = depth_from_model(&path, &picture(), &raw()).unwrap_err().to_string();
            message.rsplit("model.onnx: ").next().unwrap().to_string()
        };
        assert!(error(b"not a model").starts_with("it isn't an ONNX model that can be read"));
        let luminance = [[0.3, 0.6, 0.1]];
        assert!(error(&mixer(&luminance, &[1, 1, 2, 3])).starts_with("it takes 1 channels, but 3"));
        assert!(error(&mixer(&luminance, &[3, 2, 3])).starts_with("its input has 3 dimensions"));
        assert!(error(&mixer(&[[1.0; 3]; 2], &[1, 3, -1, -2])).contains("but this one 1 x 2 x 5 x 8"));
        let missing = depth_from_model(Path::new("/no/such/model.onnx"), &picture(), &raw()).unwrap_err();
        assert!(matches!(missing, SemanticsError::Io { .. }));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn damaged_models_never_panic(at in 0usize..1000, put in any::<u8>(), cut in 0usize..400) {
            let mut model = mixer(&[[0.3, 0.6, 0.1]], &[1, 3, -1, -2]);
            let at = at % model.len();
            model[at] = put;
            model.truncate(model.len().max(cut) - cut.min(model.len() / 2));
            let (_folder, path) = file(&model);
            let _ = depth_from_model(&path, &picture(), &raw());
        }
    }
}
