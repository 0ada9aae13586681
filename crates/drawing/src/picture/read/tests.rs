//! Small files of every kind, whole and broken. The JPEGs in `tests/data` were written with Pillow: `cmyk.jpg` has columns of
//! full cyan, magenta, yellow and black, `turned.jpg` is red left of blue with Exif orientation 6, `grey_progressive.jpg` a
//! ramp from black at the top to white.
use super::*;
use crate::math::linear_from_srgb;
use png::ColorType;
use proptest::prelude::*;

const CMYK: &[u8] = include_bytes!("../../../tests/data/cmyk.jpg");
const TURNED: &[u8] = include_bytes!("../../../tests/data/turned.jpg");
const GREY: &[u8] = include_bytes!("../../../tests/data/grey_progressive.jpg");

fn png(
    w: u32,
    h: u32,
    color: ColorType,
    bits: u8,
    data: &[u8],
    more: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, w, h);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::from_u8(bits).unwrap());
    more(&mut encoder);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

fn content(bytes: &[u8]) -> Picture {
    picture(bytes.to_vec(), &ReadOptions::default()).unwrap().content
}

fn pixels(bytes: &[u8]) -> Vec<[f32; 3]> {
    content(bytes).pixels
}

fn srgb(bytes: &[u8]) -> Vec<[u8; 3]> {
    content(bytes).to_image().unwrap().bytes().chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
}

fn near(a: [u8; 3], b: [u8; 3], by: u8) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= by)
}

#[test]
fn every_kind_of_png_is_read() {
    let none = |_: &mut png::Encoder<'_, &mut Vec<u8>>| {};
    assert_eq!(pixels(&png(3, 1, ColorType::Grayscale, 1, &[0b1010_0000], none)), [[1.0; 3], [0.0; 3], [1.0; 3]]);
    let deep = pixels(&png(2, 1, ColorType::Grayscale, 16, &[0xff, 0xff, 0x80, 0x80], none));
    assert!(deep[0] == [1.0; 3] && (deep[1][0] - linear_from_srgb(0x80) as f32).abs() < 1e-6);
    let palette = png(2, 1, ColorType::Indexed, 2, &[0b0110_0000], |e| {
        e.set_palette(&[9, 9, 9, 10, 20, 30, 200, 100, 50][..]);
    });
    assert_eq!(srgb(&palette), [[10, 20, 30], [200, 100, 50]]);
    // Half-transparent black on white is half of the light, not half of the sRGB value.
    let alpha = pixels(&png(2, 1, ColorType::Rgba, 8, &[0, 0, 0, 51, 9, 9, 9, 0], none));
    assert!((alpha[0][1] - 0.8).abs() < 1e-6 && alpha[1] == [1.0; 3]);
    let clear = png(2, 1, ColorType::Grayscale, 8, &[7, 8], |e| e.set_trns(&[0, 7][..]));
    assert_eq!(srgb(&clear), [[255; 3], [8; 3]]);
    let linear = png(1, 1, ColorType::Grayscale, 8, &[51], |e| e.set_source_gamma(png::ScaledFloat::new(1.0)));
    assert!((pixels(&linear)[0][0] - 0.2).abs() < 1e-6);
}

#[test]
fn an_interlaced_png_is_put_together() {
    // 3 x 3 px of 0, 10 .. 80, in the passes of Adam7
    let bytes = b"\x89PNG\r\n\x1a\n\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x03\x00\x00\x00\x03\x08\x00\x00\x00\x01\x04\x44\xda\xf5\x00\x00\x00\x17\x49\x44\x41\x54\x78\x9c\x63\x60\x60\x10\x61\xb0\x09\x60\xe0\x62\x70\x63\x90\xd3\x30\x02\x00\x08\xa7\x01\x69\x3d\xdf\x97\x62\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82";
    assert_eq!(indices::labels(bytes).unwrap().ids, [0, 10, 20, 30, 40, 50, 60, 70, 80]);
    assert_eq!(srgb(bytes)[5], [50; 3]);
}

#[test]
fn jpegs_in_four_inks_in_grey_and_turned_are_read() {
    let cmyk = srgb(CMYK);
    for (x, want) in [(4, [0, 255, 255]), (12, [255, 0, 255]), (20, [255, 255, 0]), (28, [0; 3])] {
        assert!(near(cmyk[4 * 32 + x], want, 3), "column {x}: {:?}", cmyk[4 * 32 + x]);
    }
    // Without Adobe's word for it, 255 is full ink.
    let mut plain = CMYK.to_vec();
    let at = plain.windows(5).position(|w| w == b"Adobe").unwrap();
    plain[at] = b'a';
    assert!(near(srgb(&plain)[4 * 32 + 28], [0; 3], 3) && near(srgb(&plain)[4 * 32 + 4], [0; 3], 3));
    plain[at] = b'A';
    plain[at + 11] = 2;
    assert_eq!(srgb(&plain).len(), 32 * 8);
    let turned = content(TURNED);
    assert_eq!((turned.width(), turned.height()), (8, 16));
    assert!(turned.at(4, 2)[0] > 0.9 && turned.at(4, 13)[2] > 0.9);
    let grey = content(GREY).luminance();
    assert!(grey.at(3, 0) < 0.01 && grey.at(3, 15) > 0.9);
}

#[test]
fn large_pictures_are_averaged_down_in_linear_light() {
    let data: Vec<u8> = (0..64 * 48).map(|i| if (i + i / 64) % 2 == 0 { 255 } else { 0 }).collect();
    let board = png(64, 48, ColorType::Grayscale, 8, &data, |_| {});
    let small = picture(board, &ReadOptions { max_pixels: 12 }).unwrap().content;
    assert_eq!((small.width(), small.height()), (4, 3));
    assert!(small.pixels.iter().all(|p| (p[0] - 0.5).abs() < 1e-6));
}

#[test]
fn depth_and_labels_are_read_as_stored() {
    let none = |_: &mut png::Encoder<'_, &mut Vec<u8>>| {};
    let deep = png(2, 1, ColorType::Grayscale, 16, &[1, 2, 0x80, 0], none);
    assert_eq!(indices::labels(&deep).unwrap(), Labels { width: 2, height: 1, ids: vec![0x102, 0x8000] });
    assert!((depth(deep.clone()).unwrap().content.values[1] - 32_768.0 / 65_535.0).abs() < 1e-7);
    let palette = png(3, 1, ColorType::Indexed, 4, &[0x21, 0], |e| e.set_palette(&[7; 9][..]));
    assert_eq!(indices::labels(&palette).unwrap().ids, [2, 1, 0]);
    let color = png(2, 1, ColorType::Rgb, 8, &[5, 5, 5, 9, 9, 9], none);
    assert_eq!(depth(color.clone()).unwrap().content.values, [5.0 / 255.0, 9.0 / 255.0]);
    assert!(matches!(indices::labels(&color), Err(Fault::NotLabels { .. })));
    let color = png(1, 1, ColorType::Rgb, 8, &[5, 6, 5], none);
    assert!(matches!(depth(color.clone()), Err(Fault::NotGrey)));
    assert!(matches!(indices::labels(GREY), Err(Fault::NotLabels { .. })));
}

#[test]
fn a_file_cut_short_is_never_half_a_picture() {
    let whole = png(20, 20, ColorType::Rgb, 8, &(0..1200).map(|i| (i * 37 % 251) as u8).collect::<Vec<_>>(), |_| {});
    for bytes in [&whole[..], CMYK, TURNED, GREY] {
        let all = pixels(bytes);
        for cut in 0..bytes.len() {
            // Without its last checksums or end marker it may still be whole.
            if let Ok(cut_short) = picture(bytes[..cut].to_vec(), &ReadOptions::default()) {
                assert!(cut_short.content.pixels == all, "{cut} of {} bytes were taken for a picture", bytes.len());
            }
        }
    }
}

#[test]
fn a_message_names_the_file_and_what_would_be_right() {
    let dir = tempfile::tempdir().unwrap();
    let says = |name: &str, bytes: &[u8]| {
        let file = dir.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let text = read(&file, &ReadOptions::default()).unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
        text
    };
    assert!(says("a.png", b"").contains("the file is empty: a picture has to be a PNG, JPEG,"));
    assert!(says("b.png", b"\0\0\0\x1cftypavif").contains("AVIF"));
    assert!(says("c.jpg", &GREY[..200]).contains("cut short"));
    // the frame's marker says how it is coded: SOF10 arithmetic, SOF3 lossless
    for (marker, kind) in [(0xca, "arithmetic coding"), (0xc3, "lossless coding")] {
        let mut other = GREY.to_vec();
        let at = other.windows(2).position(|w| w == [0xff, 0xc2]).unwrap();
        other[at + 1] = marker;
        let said = says("c.jpg", &other);
        assert!(said.contains(kind) && !said.contains("cut short"), "{said}");
    }
    let mut huge = png(1, 1, ColorType::Grayscale, 8, &[0], |_| {});
    huge.truncate(8);
    huge.extend(b"\0\0\0\x0dIHDR\0\x01\0\0\0\x01\0\0\x08\0\0\0\0\x49\xef\x6f\x3f");
    let text = says("d.png", &huge);
    assert!(text.contains("65536 x 65536 px are too many"), "{text}");
    assert!(matches!(read(dir.path(), &ReadOptions::default()), Err(PictureError::Io { .. })));
    assert!(matches!(read(&dir.path().join("none"), &ReadOptions::default()), Err(PictureError::Io { .. })));
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300), kind in 0usize..5, at in any::<prop::sample::Index>(), put in any::<u8>()) {
        let head: &[u8] = [&b""[..], b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", b"\xff\xd8\xff", b"", b""][kind];
        let mut file = [head, &bytes].concat();
        if kind > 2 {
            file = [CMYK, TURNED][kind - 3].to_vec();
            let at = at.index(file.len());
            file[at] = put;
        }
        let _ = picture(file.clone(), &ReadOptions { max_pixels: 64 });
        let _ = depth(file.clone());
        let _ = indices::labels(&file);
    }

    #[test]
    fn images_that_calamus_writes_come_back(w in 1u32..30, h in 1u32..30, seed in any::<u64>()) {
        let rgb: Vec<u8> = (0..3 * w * h).map(|i| (seed.rotate_left(i) ^ u64::from(i)) as u8).collect();
        let image = crate::picture::Image::new(w, h, rgb).unwrap();
        let png = image.to_png(None).unwrap();
        let back = content(&png);
        prop_assert_eq!(&back, &Picture::from_image(&image));
        prop_assert_eq!(back.to_image().unwrap(), image);
    }
}
