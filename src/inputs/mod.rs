//! The files that a run depends on: those that a scenario names, and those that these name.
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::diagnostic::{Changes, ConfigError};
use crate::drawing;
use crate::files::{self, FilesRead};
use crate::math::Digest;
use crate::mesh::{self, MeshFileError};
use crate::pen::PenModel;
use crate::robot::{Cell, RobotError};
use crate::scenario::{Artwork, Generator, Scenario};
use crate::surface::{Scene, SceneError};
use crate::tool::ToolSet;

/// Names this build: a digest of its sources and of the compiler.
pub const BUILD: &str = env!("CALAMUS_BUILD");

/// A file that can't be read, or isn't right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// It can't be read.
    #[error("{}: {source}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A robot.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A pen, or a pen tool.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A cloud.
    #[error(transparent)]
    Cloud(#[from] MeshFileError),
}

/// The files of one or more scenarios, with digests of what is in them.
#[derive(Default)]
pub struct Inputs {
    files: FilesRead,
    /// What the scenarios name, as far as it was followed.
    named: BTreeSet<(PathBuf, String)>,
}

impl Inputs {
    /// What a run's result depends on, a line each: the program, its scenario and the part drawn (as texts), every file.
    ///
    /// # Errors
    /// A file can't be read, or isn't right.
    pub fn run_key(scenario: &Scenario, [toml, part]: [&str; 2]) -> Result<String, InputError> {
        let digest = |text: &str| Digest::new().bytes(text.as_bytes()).hex();
        let mut inputs = Self::default();
        inputs.add(scenario)?;
        let mut key = format!("the program: {BUILD}\nthe scenario: {}\nthe part: {}\n", digest(toml), digest(part));
        for (file, of_file) in inputs.files() {
            key += &format!("{}: {of_file}\n", file.display());
        }
        Ok(key)
    }

    /// Adds what a scenario depends on. Files that were followed before aren't read again.
    ///
    /// # Errors
    /// A file can't be read, or isn't right.
    pub fn add(&mut self, scenario: &Scenario) -> Result<(), InputError> {
        let changes = &scenario.change;
        self.follow_changed(&scenario.robot, &changes.robot, |file| {
            let tools =
                Cell::load_changed(file, &changes.robot)?.arms.into_iter().filter_map(|a| a.gripper).map(|g| g.tool);
            tools.into_iter().try_for_each(|tool| Ok(ToolSet::read(&tool).map(|_| ())?))
        })?;
        self.follow_changed(&scenario.canvas.scene, &changes.scene, |file| {
            Ok(Scene::read_changed(file, &changes.scene).map(|_| ())?)
        })?;
        for pen in scenario.pen.inks.values().chain([&scenario.pen.kind]) {
            self.follow(pen, |file| Ok(PenModel::read(file).map(|_| ())?))?;
        }
        if let Some(cloud) = scenario.scan.as_ref().and_then(|s| s.cloud.as_ref()) {
            self.follow(Path::new(cloud), |file| Ok(mesh::read_cloud(file, 1.0).map(|_| ())?))?;
        }
        for file in artwork(scenario)? {
            // its bytes count; what they mean is found out when the drawing is made of them
            self.follow(&file, |file| {
                files::read(file).map(|_| ()).map_err(|source| InputError::File { file: file.to_path_buf(), source })
            })?;
        }
        Ok(())
    }

    /// The files with their digests.
    pub fn files(&self) -> &FilesRead {
        &self.files
    }

    fn follow(&mut self, file: &Path, read: impl FnOnce(&Path) -> Result<(), InputError>) -> Result<(), InputError> {
        self.follow_changed(file, &Changes::default(), read)
    }

    /// The same of a file that names others where it is changed so.
    fn follow_changed(
        &mut self,
        file: &Path,
        changes: &Changes,
        read: impl FnOnce(&Path) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        if self.named.insert((file.to_path_buf(), format!("{changes:?}"))) {
            let (result, found) = files::listened(|| read(file));
            self.files.extend(found);
            result?;
        }
        Ok(())
    }
}

/// The files of which the drawing is made.
fn artwork(scenario: &Scenario) -> Result<Vec<PathBuf>, InputError> {
    match &scenario.drawing.artwork {
        Artwork::Pattern(_) => Ok(Vec::new()),
        Artwork::File(file) => drawing::sources(file).map_err(|source| InputError::File { file: file.clone(), source }),
        Artwork::Picture(picture) => {
            let more: Vec<PathBuf> = match &picture.generator {
                Generator::LayeredDepth(settings) => settings.files().cloned().collect(),
                _ => Vec::new(),
            };
            Ok([picture.file.clone()].into_iter().chain(more).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use crate::run::{Cache, evaluate};
    use crate::scenario::Override;

    fn root() -> &'static Path {
        Path::new(env!("CARGO_MANIFEST_DIR"))
    }

    fn inputs(scenario: &Scenario) -> FilesRead {
        let mut inputs = Inputs::default();
        inputs.add(scenario).unwrap();
        inputs.files().clone()
    }

    /// Everything below a folder, copied.
    fn copy(from: &Path, to: &Path) {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap().flatten() {
            let target = to.join(entry.file_name());
            if entry.path().is_dir() {
                copy(&entry.path(), &target);
            } else {
                std::fs::copy(entry.path(), target).unwrap();
            }
        }
    }

    #[test]
    fn what_a_robot_names_counts() {
        let dir = tempfile::tempdir().unwrap();
        for folder in ["robots", "tools"] {
            copy(&root().join(folder), &dir.path().join(folder));
        }
        let robot = dir.path().join("robots/dual_ur5e_hands.toml");
        let set: Override = format!("robot={:?}", robot.to_str().unwrap()).parse().unwrap();
        let scenario = Scenario::read(&root().join("scenarios/four_colours.toml"), &[set]).unwrap();
        let before = inputs(&scenario);
        let inside: Vec<&PathBuf> = before.keys().filter(|f| f.starts_with(dir.path())).collect();
        for kind in ["urdf", "toml", "obj"] {
            let of_kind = |f: &&&PathBuf| f.extension().is_some_and(|e| e == kind);
            let file = inside.iter().rfind(of_kind).unwrap_or_else(|| panic!("no {kind} in {inside:?}"));
            let text = std::fs::read(file).unwrap();
            let comment: &[u8] = if kind == "urdf" { b"<!-- other -->" } else { b"# other\n" };
            std::fs::write(file, [&text[..], b"\n", comment].concat()).unwrap();
            assert_ne!(inputs(&scenario)[*file], before[*file], "{}", file.display());
        }
    }

    #[test]
    fn a_scan_and_the_images_beside_a_picture_count() {
        let dir = tempfile::tempdir().unwrap();
        let cloud = dir.path().join("cloud.ply");
        let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
        std::fs::write(&cloud, ply).unwrap();
        let set = |text: String| text.parse::<Override>().unwrap();
        let sets =
            [set("canvas.belief=\"scan\"".to_string()), set(format!("scan.cloud={:?}", cloud.to_str().unwrap()))];
        let scanned = Scenario::read(&root().join("scenarios/scanned_column.toml"), &sets).unwrap();
        assert!(inputs(&scanned).keys().any(|f| f.ends_with("cloud.ply")));
        let layered = Scenario::read(&root().join("scenarios/layered_depth.toml"), &[]).unwrap();
        let Artwork::Picture(picture) = &layered.drawing.artwork else { panic!("a picture") };
        let Generator::LayeredDepth(settings) = &picture.generator else { panic!("by depth") };
        assert!(settings.files().count() >= 2);
        let known = inputs(&layered);
        assert!(settings.files().all(|f| known.contains_key(f)), "{:?}", known.keys());
    }

    #[test]
    fn a_run_reads_nothing_else() {
        for name in ["letter", "grid_plane", "touched_cone"] {
            let small = ["drawing.width_mm=12", "sim.plant=\"articulated\""].map(|s| s.parse().unwrap());
            let scenario = Scenario::read(&root().join(format!("scenarios/{name}.toml")), &small).unwrap();
            let known = inputs(&scenario);
            let (done, read) = files::listened(|| evaluate(&scenario, &Cache::default(), &Silent));
            done.unwrap();
            assert!(!read.is_empty());
            assert!(read.iter().all(|(file, digest)| known.get(file) == Some(digest)), "{name}: {:?}", read.keys());
        }
    }
}
