//! Makes the pictures in `scenarios/art/`: `cargo run --release --example pictures -- [FOLDER [NAME...]]`.
//!
//! Scenes of signed distance fields ([`field`]) are drawn by a small sphere tracer ([`march`]): a portrait, a still
//! life, a pasture with its true depth and labels, a shell. Flat test pictures ([`chart`]) and a recording of a stylus
//! ([`signature`]) go with them, and what is drawn on walls: strokes on a [`page`] ([`frieze`], [`skyline`]) and flat colour ([`mural`]). The same files come out of every run. `--draft` renders at a third of the size.
mod chart;
mod field;
mod files;
mod frieze;
mod march;
mod mural;
mod orchard;
mod page;
mod pasture;
mod portrait;
mod shell;
mod signature;
mod skyline;

use std::io::Result;
use std::path::{Path, PathBuf};

use png::{BitDepth, ColorType};

use march::{Camera, Picture, Scene};

/// Where files go, and whether they're only for a look.
struct Studio {
    folder: PathBuf,
    draft: bool,
}

impl Studio {
    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn render(&self, scene: &impl Scene, camera: &Camera, width: usize, height: usize) -> Picture {
        let part = if self.draft { 3 } else { 1 };
        march::render(scene, camera, width / part, height / part)
    }

    fn make(&self, name: &str) -> Result<()> {
        match name {
            "portrait" => {
                let picture = self.render(&portrait::Portrait::new(), &portrait::Portrait::camera(), 900, 1125);
                files::colour(&self.file("portrait.png"), &picture, 2.0)
            }
            "orchard" => {
                let picture = self.render(&orchard::Orchard::new(), &orchard::Orchard::camera(), 800, 800);
                files::colour(&self.file("orchard.png"), &picture, 2.0)
            }
            "pasture" => {
                let picture = self.render(&pasture::Pasture::new(), &pasture::Pasture::camera(), 1000, 800);
                files::colour(&self.file("pasture.png"), &picture, 2.0)?;
                files::depth(&self.file("pasture-depth.png"), &picture)?;
                files::labels(&self.file("pasture-labels.png"), &picture)?;
                std::fs::write(self.file("pasture-labels.json"), pasture::labels())
            }
            "shell" => {
                let picture = self.render(&shell::Shell::new(), &shell::Shell::camera(), 1000, 850);
                files::grey(&self.file("shell.png"), &picture, 1.0)
            }
            "chart" => {
                let (width, height) = (chart::WIDTH, chart::HEIGHT);
                let path = self.file("chart.png");
                files::write(&path, width, height, ColorType::Rgba, BitDepth::Eight, &chart::chart())?;
                files::grey16(&self.file("ramp16.png"), chart::RAMP.0, chart::RAMP.1, chart::ramp())
            }
            "frieze" => std::fs::write(self.file("frieze.svg"), frieze::page().svg("Frieze")),
            "skyline" => std::fs::write(self.file("skyline.svg"), skyline::page().svg("Skyline")),
            "letters" | "flowers" => {
                let mural = if name == "letters" { mural::letters() } else { mural::flowers() };
                let path = self.file(&format!("{name}.png"));
                files::write(&path, mural.width, mural.height, ColorType::Rgb, BitDepth::Eight, &mural.bytes())
            }
            "signature" => std::fs::write(self.file("signature.jsonl"), signature::recording()),
            other => Err(std::io::Error::other(format!("no picture is called {other:?}: choose from {NAMES:?}"))),
        }
    }
}

const NAMES: [&str; 10] =
    ["portrait", "orchard", "pasture", "shell", "chart", "signature", "frieze", "skyline", "letters", "flowers"];

fn main() -> Result<()> {
    let mut args: Vec<String> = std::env::args().skip(1).collect();
    let draft = args.iter().any(|a| a == "--draft");
    args.retain(|a| a != "--draft");
    let given = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/art");
    let folder = args.first().map_or(given, PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    let studio = Studio { folder, draft };
    let desired: Vec<&str> = args.iter().skip(1).map(String::as_str).collect();
    for name in if desired.is_empty() { NAMES.to_vec() } else { desired } {
        let start = std::time::Instant::now();
        studio.make(name)?;
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    Ok(())
}
