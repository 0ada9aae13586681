//! Pictures as pixels, and their PNG files.
use std::path::Path;

use crate::math::Rgb;
use crate::picture::PictureError;

/// Largest side of a picture that is made or read, px.
pub const MAX_SIDE: u32 = 32_768;

/// A picture: 8-bit sRGB, rows from the top, pixels from the left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

impl Image {
    /// A picture of these pixels: three bytes each, row by row.
    ///
    /// # Errors
    /// [`PictureError::Pixels`] when the bytes don't fill it.
    pub fn new(width: u32, height: u32, rgb: Vec<u8>) -> Result<Self, PictureError> {
        if rgb.len() as u64 != 3 * u64::from(width) * u64::from(height) {
            return Err(PictureError::Pixels { width, height, bytes: rgb.len() });
        }
        Ok(Self { width, height, rgb })
    }

    /// Width, px.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, three bytes each, row by row.
    pub fn bytes(&self) -> &[u8] {
        &self.rgb
    }

    /// The pixel in a column and row; `None` outside.
    pub fn pixel(&self, column: u32, row: u32) -> Option<Rgb> {
        if column >= self.width {
            return None;
        }
        let at = 3 * (row as usize * self.width as usize + column as usize);
        self.rgb.get(at..at + 3).map(|p| Rgb([p[0], p[1], p[2]]))
    }

    /// The picture as a PNG file's bytes, with its resolution in px/mm where it has one.
    ///
    /// # Errors
    /// [`PictureError::Encode`], for a picture without pixels.
    pub fn to_png(&self, px_per_mm: Option<f64>) -> Result<Vec<u8>, PictureError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        // Line art packs well at any level; this one is several times faster than the default.
        encoder.set_compression(png::Compression::Fast);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_pixel_dims(px_per_mm.map(|r| {
            let per_metre = (r * 1000.0).round() as u32;
            png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }
        }));
        encoder.add_text_chunk("Software".to_string(), "calamus".to_string())?;
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Writes a PNG file, first under a temporary name beside it, so that there is never half a file.
    ///
    /// # Errors
    /// [`PictureError::Io`] or [`PictureError::Encode`].
    pub fn write_png(&self, file: &Path, px_per_mm: Option<f64>) -> Result<(), PictureError> {
        let bytes = self.to_png(px_per_mm)?;
        let part = file.with_extension("png.part");
        let io = |source| PictureError::Io { file: file.to_path_buf(), source };
        std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, file)).map_err(|source| {
            // What matters is the first error; the part may not even exist.
            let _ = std::fs::remove_file(&part);
            io(source)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;

    proptest! {
        #[test]
        fn a_png_gives_back_its_pixels(width in 1u32..40, height in 1u32..40, seed in any::<u64>()) {
            let rgb = (0..3 * width * height).map(|i| (seed.rotate_left(i) ^ u64::from(i)) as u8).collect();
            let image = Image::new(width, height, rgb).unwrap();
            let png = image.to_png(Some(16.0)).unwrap();
            let mut reader = png::Decoder::new(Cursor::new(&png[..])).read_info().unwrap();
            let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut rgb).unwrap();
            prop_assert_eq!(&rgb, image.bytes());
            let dims = reader.info().pixel_dims.unwrap();
            prop_assert_eq!((dims.xppu, dims.yppu), (16_000, 16_000));
            prop_assert_eq!(&reader.info().uncompressed_latin1_text[0].text, "calamus");
        }
    }

    #[test]
    fn a_file_is_whole_or_absent() {
        let dir = tempfile::tempdir().unwrap();
        let image = Image::new(2, 1, vec![1, 2, 3, 4, 5, 6]).unwrap();
        image.write_png(&dir.path().join("a.png"), None).unwrap();
        assert!(image.write_png(&dir.path().join("none/a.png"), None).is_err());
        let names: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, ["a.png"]);
        assert_eq!(image.pixel(1, 0), Some(Rgb([4, 5, 6])));
        assert_eq!((image.pixel(2, 0), image.pixel(0, 1)), (None, None));
    }
}
