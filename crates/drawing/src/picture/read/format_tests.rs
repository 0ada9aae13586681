//! Every format, and colours as littlecms has them. The files in `tests/data` and their reference colours were made by its
//! `pictures.py`.
use proptest::prelude::*;

use super::*;
use crate::picture::{ciede2000, cielab_from_linear};

macro_rules! data {
    ($name:literal) => {
        include_bytes!(concat!("../../../tests/data/", $name)).as_slice()
    };
}

/// Files of one picture each, of every format.
const FILES: [(&str, &[u8]); 24] = [
    ("adobe_rgb.jpg", data!("adobe_rgb.jpg")),
    ("associated.tif", data!("associated.tif")),
    ("display_p3.png", data!("display_p3.png")),
    ("grey.tif", data!("grey.tif")),
    ("light.hdr", data!("light.hdr")),
    ("lossy.jpg", data!("lossy.jpg")),
    ("lossy.webp", data!("lossy.webp")),
    ("lossy_progressive.jpg", data!("lossy_progressive.jpg")),
    ("moving.gif", data!("moving.gif")),
    ("moving.png", data!("moving.png")),
    ("moving.webp", data!("moving.webp")),
    ("pages.tif", data!("pages.tif")),
    ("plain.bmp", data!("plain.bmp")),
    ("plain.gif", data!("plain.gif")),
    ("plain.png", data!("plain.png")),
    ("plain.qoi", data!("plain.qoi")),
    ("plain.tif", data!("plain.tif")),
    ("plain.webp", data!("plain.webp")),
    ("press.jpg", data!("press.jpg")),
    ("press.tif", data!("press.tif")),
    ("turned.png", data!("turned.png")),
    ("turned.tif", data!("turned.tif")),
    ("turned.webp", data!("turned.webp")),
    ("wide_gamut.webp", data!("wide_gamut.webp")),
];

fn file(name: &str) -> &'static [u8] {
    FILES.iter().find(|(n, _)| *n == name).unwrap().1
}

fn noted(bytes: &[u8]) -> Noted<Picture> {
    picture(bytes.to_vec(), &ReadOptions::default()).unwrap()
}

fn says(bytes: &[u8]) -> String {
    noted(bytes).notes.join("; ")
}

/// CIEDE2000 between the pixels of two pictures, from the smallest to the largest.
fn apart(a: &Picture, b: &Picture) -> Vec<f64> {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let lab = |p: &[f32; 3]| cielab_from_linear(p.map(f64::from));
    let mut all: Vec<f64> = a.pixels.iter().zip(&b.pixels).map(|(a, b)| ciede2000(lab(a), lab(b))).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Another decoder of JPEGs rounds otherwise, and tables of inks are interpolated otherwise: a pixel in fifty may be farther off.
#[test]
fn colours_of_profiles_are_those_of_littlecms() {
    let cases = [
        ("adobe_rgb.jpg", data!("adobe_rgb_jpg_srgb.png"), 1.6),
        ("display_p3.png", data!("display_p3_png_srgb.png"), 1.0),
        ("wide_gamut.webp", data!("wide_gamut_webp_srgb.png"), 1.0),
        ("grey.tif", data!("grey_tif_srgb.png"), 1.0),
        ("press.jpg", data!("press_jpg_srgb.png"), 1.6),
        ("press.tif", data!("press_tif_srgb.png"), 1.6),
    ];
    for (name, reference, most) in cases {
        let read = noted(file(name));
        assert!(read.notes.is_empty(), "{name}: {:?}", read.notes);
        let off = apart(&read.content, &noted(reference).content);
        let (nearly_all, worst) = (off[off.len() * 49 / 50], off[off.len() - 1]);
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        println!("{name}: CIEDE2000 {mean:.2} on average, {nearly_all:.2} for 98 %, {worst:.2} at most");
        assert!(nearly_all < 1.0 && worst < most, "{name}: CIEDE2000 {nearly_all:.2} for 98 %, {worst:.2} at most");
    }
}

#[test]
fn a_profile_that_is_srgb_changes_nothing() {
    let with = data!("same.png").to_vec();
    let mut without = with.clone();
    let at = without.windows(4).position(|w| w == b"iCCP").unwrap();
    without[at..at + 4].copy_from_slice(b"icCP");
    assert_eq!(noted(&with), noted(&without));
}

#[test]
fn every_format_gives_the_same_picture() {
    let want = noted(file("plain.png"));
    assert!(want.notes.is_empty() && want.content.width() == 6);
    for name in ["plain.bmp", "plain.gif", "plain.qoi", "plain.tif", "plain.webp"] {
        assert_eq!(noted(file(name)), want, "{name}");
    }
    for (name, note) in [
        ("moving.gif", "it is animated: its first frame is drawn"),
        ("moving.webp", "it is animated: its first frame is drawn"),
        ("moving.png", "it is animated: its still picture is drawn"),
        ("pages.tif", "it has more pages: the first is drawn"),
    ] {
        let got = noted(file(name));
        assert_eq!((&got.content, got.notes.join("; ").as_str()), (&want.content, note), "{name}");
    }
}

#[test]
fn pictures_of_every_format_are_turned_upright() {
    for name in ["turned.png", "turned.tif", "turned.webp"] {
        let turned = noted(file(name)).content;
        assert_eq!((turned.width(), turned.height()), (8, 16), "{name}");
        assert!(turned.at(4, 2)[0] > 0.9 && turned.at(4, 13)[2] > 0.9, "{name}");
    }
}

#[test]
fn light_beyond_white_is_white_and_told() {
    let hdr = noted(file("light.hdr"));
    let want = [[0.25; 3], [0.5; 3], [1.0; 3], [1.0; 3]];
    assert_eq!(hdr.content.pixels, want);
    assert_eq!(hdr.notes, ["25.0 % of its light is brighter than white (1.0) and drawn as white"]);
}

#[test]
fn colours_stored_times_alpha_are_not_darkened_twice() {
    let half = noted(file("associated.tif")).content.pixels;
    // 128 of 255 red over white: red's light is full, the others' what shines through
    let through = 127.0 / 255.0;
    assert!((half[0][0] - 1.0).abs() < 1e-6 && (half[0][1] - through).abs() < 1e-6 && half[1] == [1.0; 3], "{half:?}");
}

#[test]
fn primaries_and_gamma_of_a_png_count_as_a_profile_does() {
    let pixels: Vec<u8> = (0..3 * 64).map(|i| (i * 83 % 256) as u8).collect();
    let with = |put: &dyn Fn(&mut png::Info<'static>)| {
        let mut info = png::Info::with_size(8, 8);
        info.color_type = png::ColorType::Rgb;
        put(&mut info);
        let mut bytes = Vec::new();
        let mut writer = png::Encoder::with_info(&mut bytes, info).unwrap().write_header().unwrap();
        writer.write_image_data(&pixels).unwrap();
        writer.finish().unwrap();
        noted(&bytes)
    };
    let chunks = |green, gamma| {
        with(&|info| {
            let xy = png::SourceChromaticities::new((0.3127, 0.329), (0.64, 0.33), green, (0.15, 0.06));
            info.source_chromaticities = Some(xy);
            info.source_gamma = Some(png::ScaledFloat::new(gamma));
        })
    };
    let plain = with(&|_| {});
    assert_eq!(chunks((0.3, 0.6), 1.0 / 2.2), plain);
    let profile = moxcms::ColorProfile::new_adobe_rgb().encode().unwrap();
    let by_profile = with(&|info| info.icc_profile = Some(profile.clone().into()));
    let by_chunks = chunks((0.21, 0.71), 256.0 / 563.0);
    let most = |a: &Noted<Picture>, b: &Noted<Picture>| apart(&a.content, &b.content)[63];
    let (off, moved) = (most(&by_chunks, &by_profile), most(&by_chunks, &plain));
    assert!(off < 0.5 && moved > 5.0, "{off} from the profile, {moved} from sRGB");
}

#[test]
fn a_profile_that_is_broken_or_of_another_kind_is_told() {
    let mut broken = file("grey.tif").to_vec();
    let at = broken.windows(4).position(|w| w == b"acsp").unwrap();
    broken[at] = b'x';
    assert!(says(&broken).starts_with("its colour profile can't be read ("), "{}", says(&broken));
    let mut other = file("grey.tif").to_vec();
    let at = other.windows(4).position(|w| w == b"GRAY").unwrap();
    other[at..at + 4].copy_from_slice(b"CMYK");
    assert!(says(&other).starts_with("its colour profile isn't used ("), "{}", says(&other));
}

#[test]
fn a_missing_end_marker_alone_is_told() {
    for name in ["adobe_rgb.jpg", "press.jpg", "lossy.jpg", "lossy_progressive.jpg"] {
        let whole = file(name);
        let cut = noted(&whole[..whole.len() - 2]);
        assert_eq!(cut.content, noted(whole).content, "{name}");
        assert_eq!(cut.notes, ["its end marker is missing, but none of its pixels"], "{name}");
    }
    let png = file("plain.png");
    for cut in [1, 4, 8, 12] {
        assert_eq!(says(&png[..png.len() - cut]), "its end chunk is missing, but none of its pixels");
    }
}

#[test]
fn no_format_gives_half_a_picture() {
    for (name, bytes) in FILES {
        let whole = noted(bytes).content;
        for cut in (0..bytes.len()).rev().step_by(1 + bytes.len() / 600) {
            if let Ok(read) = picture(bytes[..cut].to_vec(), &ReadOptions::default()) {
                let profile_lost = read.notes.iter().any(|n| n.contains("profile can't be read"));
                assert!(
                    read.content == whole || profile_lost,
                    "{name}: {cut} of {} bytes were taken for a picture",
                    bytes.len()
                );
            }
        }
    }
}

#[test]
fn thumbnails_of_raw_files_are_not_taken_for_pictures() {
    let mut thumbnail = file("plain.tif").to_vec();
    // its PlanarConfiguration 1 becomes NewSubfileType 1: a reduced picture
    let planar = [284_u16.to_le_bytes(), 3_u16.to_le_bytes()].concat();
    let at = thumbnail.windows(4).position(|w| w == planar).unwrap();
    thumbnail[at..at + 2].copy_from_slice(&254_u16.to_le_bytes());
    let error = picture(thumbnail, &ReadOptions::default()).unwrap_err();
    assert!(matches!(&error, Fault::NoPicture(what) if what.contains("raw file")), "{error:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn mutated_files_never_panic(
        which in any::<prop::sample::Index>(),
        put in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        head in proptest::bool::weighted(0.7),
    ) {
        let mut bytes = FILES[which.index(FILES.len())].1.to_vec();
        for (at, value) in put {
            // most of what can go wrong stands in the first kilobyte
            let within = if head { bytes.len().min(1000) } else { bytes.len() };
            bytes[at.index(within)] = value;
        }
        let _ = picture(bytes.clone(), &ReadOptions { max_pixels: 64 });
        let _ = depth(bytes.clone());
        let _ = indices::labels(&bytes);
    }
}
