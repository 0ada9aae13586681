//! Pictures become drawings: whatever the picture, a good result or one clear message, and the same at any thread count.
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use calamus::progress::{Progress, Silent};
use calamus::report::OutputDir;
use calamus::run::{Outcome, RunError, draw};
use calamus::scenario::{Override, Sketch};

const STYLES: [&str; 6] = ["tsp", "stipple", "painterly", "layered_depth", "hatching", "edges"];

fn art(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/art").join(name)
}

/// Draws a picture with these settings into a folder.
fn drawn(file: &Path, sets: &[&str], folder: &Path) -> Result<Outcome, RunError> {
    let overrides: Vec<Override> = sets.iter().map(|s| s.parse().unwrap()).collect();
    let sketch = Sketch::of_file(file, &overrides).unwrap();
    draw(&sketch, &OutputDir::check(folder).unwrap(), &Silent)
}

/// What a style is set to, to be quick.
fn quick(style: &str) -> [String; 5] {
    let few = match style {
        "tsp" => "drawing.tsp.points=400",
        "stipple" => "drawing.stipple.dots=400",
        "painterly" => "drawing.painterly.strokes=60",
        "layered_depth" => "drawing.layered_depth.strokes=60",
        _ => "drawing.rotate_deg=0",
    };
    [
        format!("drawing.style={style}"),
        few.into(),
        "drawing.width_mm=80".into(),
        "pen.kind=fineliner_08".into(),
        "render.drawing_px=300".into(),
    ]
}

fn in_threads<T: Send>(count: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap().install(f)
}

#[test]
fn strokes_are_the_same_at_one_and_two_threads_and_previews_show_the_picture() {
    for style in STYLES {
        let sets = quick(style);
        let mut sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        if style == "tsp" {
            sets.push("drawing.color.separation=cmyk");
        }
        let svgs: Vec<String> = [1, 2]
            .iter()
            .map(|threads| {
                let folder = tempfile::tempdir().unwrap();
                let outcome = in_threads(*threads, || drawn(&art("pasture.png"), &sets, folder.path())).unwrap();
                let m = &outcome.metrics;
                let d = m.drawing.as_ref().unwrap();
                assert!(d.length_m > 0.1 && d.estimated_s.unwrap() > 1.0 || style == "stipple", "{style}: {d:?}");
                assert_eq!(d.layers.iter().map(|l| l.strokes).sum::<usize>(), d.strokes);
                let ssim = m.value("image.preview_ssim").unwrap();
                assert!(ssim > 0.15, "{style}: likeness {ssim}");
                assert!(folder.path().join("preview.png").exists());
                std::fs::read_to_string(folder.path().join("wished.svg")).unwrap()
            })
            .collect();
        assert!(svgs[0] == svgs[1], "{style}");
    }
}

#[test]
fn ordered_by_ink_the_pen_changes_far_less_and_the_picture_stays() {
    for style in ["painterly", "layered_depth"] {
        let strokes = format!("drawing.{style}.strokes=120");
        let with = |order: &str| {
            let folder = tempfile::tempdir().unwrap();
            let sets = [
                &format!("drawing.style={style}"),
                &strokes,
                "drawing.width_mm=100",
                "drawing.color.count=4",
                &format!("drawing.ink_order={order}"),
            ];
            let m = drawn(&art("pasture.png"), &sets, folder.path()).unwrap().metrics;
            let d = m.drawing.clone().unwrap();
            assert!(d.inks == 4 && d.strokes <= 120 && d.strokes > 50, "{style}: {d:?}");
            (d.ink_changes, m.value("image.preview_ssim").unwrap())
        };
        let (made, by_ink, few) = (with("as_made"), with("by_ink"), with("fewest_changes"));
        assert!(made.0 >= 30, "{style}: {} changes in the artist's order", made.0);
        assert!(by_ink.0 == 3 && few.0 < made.0 / 3, "{style}: {made:?} {by_ink:?} {few:?}");
        assert!((made.1 - by_ink.1).abs() < 0.01 && (made.1 - few.1).abs() < 0.01, "{style}: {made:?} {by_ink:?}");
    }
}

/// An 8-bit RGB picture of one colour as a PNG file.
fn plain(folder: &Path, name: &str, side: u32, rgb: [u8; 3]) -> PathBuf {
    let pixels = rgb.repeat((side * side) as usize);
    let file = folder.join(name);
    calamus::picture::Image::new(side, side, pixels).unwrap().write_png(&file, None).unwrap();
    file
}

#[test]
fn odd_pictures_are_drawn_or_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/drawing/tests/data");
    let whole = std::fs::read(art("chart.png")).unwrap();
    let cut = folder.path().join("cut.png");
    std::fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    let good =
        [art("chart.png"), art("ramp16.png"), data.join("cmyk.jpg"), plain(folder.path(), "black.png", 40, [0; 3])];
    let empty = [plain(folder.path(), "white.png", 40, [255; 3])];
    let any = [plain(folder.path(), "one-black.png", 1, [0; 3]), plain(folder.path(), "one-white.png", 1, [255; 3])];
    for style in STYLES {
        let sets = quick(style);
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let with = |file: &Path| drawn(file, &sets, &folder.path().join("out"));
        for file in &good {
            match with(file) {
                Ok(outcome) => assert!(outcome.metrics.drawing.unwrap().strokes > 0, "{style} {}", file.display()),
                // a picture of one tone has no edges
                Err(e) => assert!(style == "edges" && !file.ends_with("chart.png"), "{style} {}: {e}", file.display()),
            }
        }
        for file in &empty {
            let message = with(file).unwrap_err().to_string();
            assert!(message.contains("nothing to draw") && !message.contains('\n'), "{style}: {message}");
        }
        for file in &any {
            if let Err(e) = with(file) {
                assert!(!e.to_string().contains('\n'), "{style}: {e}");
            }
        }
        let message = with(&cut).unwrap_err().to_string();
        assert!(message.contains("cut.png") && !message.contains('\n'), "{message}");
    }
}

/// Keeps what a user would be told.
#[derive(Default)]
struct Told(Mutex<Vec<String>>);

impl Progress for Told {
    fn stage(&self, _name: &str, _total: Option<u64>) {}
    fn advance(&self, _done: u64) {}
    fn note(&self, text: &str) {
        self.0.lock().unwrap().push(text.into());
    }
}

#[test]
fn a_picture_is_what_it_contains_and_its_oddities_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/drawing/tests/data");
    let moving = folder.path().join("a picture without an ending");
    std::fs::copy(data.join("moving.gif"), &moving).unwrap();
    let open_end = folder.path().join("a TIFF by its name.tif");
    let jpeg = std::fs::read(data.join("adobe_rgb.jpg")).unwrap();
    std::fs::write(&open_end, &jpeg[..jpeg.len() - 2]).unwrap();
    let sets: Vec<Override> = quick("stipple").iter().map(|s| s.parse().unwrap()).collect();
    for (file, note) in [(&moving, "its first frame is drawn"), (&open_end, "its end marker is missing")] {
        let told = Told::default();
        let sketch = Sketch::of_file(file, &sets).unwrap();
        let outcome = draw(&sketch, &OutputDir::check(&folder.path().join("out")).unwrap(), &told).unwrap();
        assert!(outcome.metrics.drawing.unwrap().strokes > 0);
        let told = told.0.into_inner().unwrap();
        let name = file.file_name().unwrap().to_str().unwrap();
        assert!(told.iter().any(|t| t.contains(name) && t.contains(note)), "{told:?}");
    }
    let text = folder.path().join("notes.dat");
    std::fs::write(&text, "no picture").unwrap();
    let message = Sketch::of_file(&text, &sets).unwrap_err().to_string();
    assert!(message.contains("a picture (.png, .jpg, .webp"), "{message}");
}
