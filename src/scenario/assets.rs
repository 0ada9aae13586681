//! Where robots, pens, scenes and scenarios are found by name.
use crate::files;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The folders that assets lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssetKind {
    /// `robots/`
    Robot,
    /// `pens/`
    Pen,
    /// `scenes/`
    Scene,
    /// `scenarios/`
    Scenario,
    /// `scenarios/experiments/`
    Experiment,
}

impl AssetKind {
    /// Name of the folder.
    pub fn folder(self) -> &'static str {
        match self {
            AssetKind::Robot => "robots",
            AssetKind::Pen => "pens",
            AssetKind::Scene => "scenes",
            AssetKind::Scenario => "scenarios",
            AssetKind::Experiment => "scenarios/experiments",
        }
    }

    /// What one of them is called.
    pub fn noun(self) -> &'static str {
        match self {
            AssetKind::Robot => "robot",
            AssetKind::Pen => "pen",
            AssetKind::Scene => "scene",
            AssetKind::Scenario => "scenario",
            AssetKind::Experiment => "experiment",
        }
    }
}

/// A named asset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Asset {
    /// The file's name without `.toml`.
    pub name: String,
    /// The file.
    pub file: PathBuf,
}

/// The places where asset folders are looked for, nearest first.
#[derive(Clone, Debug)]
pub struct Assets {
    roots: Vec<PathBuf>,
}

impl Assets {
    /// The asset folders seen from `folder`: in it and the folders above it, in the current directory, in
    /// `CALAMUS_ASSETS`, and in the source tree that the program was built from.
    pub fn seen_from(folder: &Path) -> Self {
        let mut roots = Vec::new();
        if let Ok(folder) = std::path::absolute(folder) {
            roots.extend(folder.ancestors().map(Path::to_path_buf));
        }
        roots.extend(std::env::current_dir());
        roots.extend(std::env::var_os("CALAMUS_ASSETS").map(PathBuf::from));
        roots.push(PathBuf::from(env!("CARGO_MANIFEST_DIR")));
        Self { roots }
    }

    /// Every asset of a kind, by name; of two with one name the nearer.
    pub fn list(&self, kind: AssetKind) -> Vec<Asset> {
        let mut found = BTreeMap::new();
        for root in &self.roots {
            let Ok(entries) = files::folder(&root.join(kind.folder())) else { continue };
            for file in entries {
                if file.extension().is_some_and(|e| e == "toml")
                    && let Some(name) = file.file_stem().and_then(|n| n.to_str())
                {
                    found.entry(name.to_string()).or_insert(file);
                }
            }
        }
        found.into_iter().map(|(name, file)| Asset { name, file }).collect()
    }

    /// The file that `text` means: a path relative to `folder` when it has a `/` or ends in an extension, else the
    /// name of an asset. The error says what would be right.
    pub fn find(&self, kind: AssetKind, text: &str, folder: &Path) -> Result<PathBuf, String> {
        let as_path = text.contains('/') || Path::new(text).extension().is_some();
        if as_path {
            return existing(&folder.join(text));
        }
        let assets = self.list(kind);
        if let Some(found) = assets.iter().find(|a| a.name == text) {
            return existing(&found.file);
        }
        let names: Vec<&str> = assets.iter().map(|a| a.name.as_str()).collect();
        let noun = kind.noun();
        Err(match crate::diagnostic::nearest(text, names.iter().copied()) {
            Some(near) => format!("no {noun} `{text}`: did you mean `{near}`?"),
            None if names.is_empty() => format!("no {noun} `{text}`: no {}/ folder was found", kind.folder()),
            None => format!("no {noun} `{text}`: known are {}", names.join(", ")),
        })
    }
}

/// The absolute path of a file that is there and whose name can be written in a TOML file.
pub(super) fn existing(file: &Path) -> Result<PathBuf, String> {
    let found = std::fs::canonicalize(file).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => format!("no file {}", file.display()),
        _ => format!("{}: {e}", file.display()),
    })?;
    if !found.is_file() {
        return Err(format!("{} is not a file", found.display()));
    }
    if found.to_str().is_none() {
        return Err(format!("the path {} is not UTF-8", found.display()));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for file in ["robots/anton.toml", "scenarios/robots/anton.toml", "robots/berta.toml", "scenarios/x.toml"] {
            let file = dir.path().join(file);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, "").unwrap();
        }
        dir
    }

    #[test]
    fn the_nearest_folder_wins() {
        let dir = tree();
        let folder = dir.path().join("scenarios");
        let assets = Assets::seen_from(&folder);
        let anton = assets.find(AssetKind::Robot, "anton", &folder).unwrap();
        assert!(anton.ends_with("scenarios/robots/anton.toml"));
        assert!(assets.find(AssetKind::Robot, "berta", &folder).unwrap().ends_with("robots/berta.toml"));
        assert!(assets.find(AssetKind::Robot, "../robots/berta.toml", &folder).unwrap().is_absolute());
    }

    #[test]
    fn a_misspelt_name_gets_the_nearest() {
        let dir = tree();
        let assets = Assets::seen_from(dir.path());
        let error = assets.find(AssetKind::Robot, "bertha", dir.path()).unwrap_err();
        assert_eq!(error, "no robot `bertha`: did you mean `berta`?");
        assert!(assets.find(AssetKind::Robot, "robots/none.toml", dir.path()).unwrap_err().starts_with("no file "));
    }
}
