//! Scene files: a canvas, the sheet in front of it, and the furniture round it, as TOML.
//!
//! ```toml
//! name = "hemisphere"
//! color = [236, 232, 220]                 # of the canvas, sRGB
//! friction = 0.3                          # between pen and canvas
//! [canvas]
//! shape = "dome"                          # plane, dome, column, cone, bucket, box, cylinder, extrusion or mesh
//! radius_mm = 150
//! pose = { xyz_mm = [520, 0, 300], rpy_deg = [0, 0, 0] }
//! [sheet]
//! xyz_mm = [520, 0, 480]                  # the centre
//! normal = [0, 0, 1]                      # out of the canvas
//! up = [1, 0, 0]                          # towards the sheet's upper edge
//! [[furniture]]                           # only seen and avoided
//! shape = "box"
//! size_mm = [700, 1000, 30]
//! pose = { xyz_mm = [600, 0, 285] }
//! color = [120, 90, 60]
//! ```
use std::path::Path;

use nalgebra::{Translation3, Vector3};
use serde::Deserialize;

use super::canvas::{Canvas, SheetFrame};
use super::mapped::Mapping;
use super::projection::Projection;
use super::shape::{ShapeError, ShapeFile};
use super::wall::Wall;
use crate::diagnostic::{self, Changes, ConfigError};
use crate::files;
use crate::math::{Pose, Rgb, frame_from_axes};
use crate::mesh::{MeshFileError, TriMesh};

/// Edge length of the triangles of a canvas unless the scene says otherwise, mm.
const CANVAS_TRIANGLE_MM: f64 = 5.0;
/// The same for furniture, which nothing touches.
const FURNITURE_TRIANGLE_MM: f64 = 25.0;
/// Farthest that the canvas may stick out of the sheet at its centre towards the artist, m: a sheet may lie within a thick canvas.
const MOST_BEFORE: f64 = 0.1;
/// Farthest that the sheet may float from the canvas, m.
const MOST_BEHIND: f64 = 2.0;
/// `normal` and `up` must be at least this far from parallel (sine of the angle).
const MIN_SINE: f64 = 0.02;

/// Why a scene can't be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The scene file itself is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A mesh file that it names is wrong.
    #[error(transparent)]
    MeshFile(#[from] MeshFileError),
}

/// A thing that is seen and avoided, but not drawn on.
#[derive(Clone, Debug)]
pub struct Furniture {
    /// Surface, m, world frame.
    pub mesh: TriMesh,
    /// Colour.
    pub color: Rgb,
}

/// A canvas and what stands round it.
#[derive(Clone)]
pub struct Scene {
    /// The canvas, nominal, in the world frame.
    pub canvas: Canvas,
    /// Colour of the canvas.
    pub color: Rgb,
    /// Coulomb friction between pen and canvas.
    pub friction: f64,
    /// The canvas as a wall, of an extrusion.
    pub wall: Option<Wall>,
    /// Furniture in the file's order.
    pub furniture: Vec<Furniture>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    name: String,
    #[serde(default = "white")]
    color: Rgb,
    #[serde(default = "usual_friction")]
    friction: f64,
    canvas: ShapeFile,
    sheet: SheetFile,
    #[serde(default)]
    furniture: Vec<ShapeFile>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SheetFile {
    xyz_mm: [f64; 3],
    normal: [f64; 3],
    up: [f64; 3],
}

fn white() -> Rgb {
    Rgb([255, 255, 255])
}

fn usual_friction() -> f64 {
    0.3
}

impl Scene {
    /// Reads a scene file; mesh files in it are relative to it.
    ///
    /// # Errors
    /// Unknown or missing keys, sizes that are not positive, directions that are zero or parallel, and a sheet whose
    /// centre has no canvas behind it, each with file and line; and a mesh file that can't be read.
    pub fn read(file: &Path) -> Result<Self, SceneError> {
        Self::read_changed(file, &Changes::default())
    }

    /// The same with values of the scene file changed.
    ///
    /// # Errors
    /// Those of [`Scene::read`].
    pub fn read_changed(file: &Path, changes: &Changes) -> Result<Self, SceneError> {
        let text =
            files::read_text(file).map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })?;
        let config = |e| match e {
            SceneError::Config(c) => Ok(c),
            other => Err(other),
        };
        changes.with(&text, file, |text| Self::parse(text, file), config)
    }

    /// Parses the text of a scene file; `file` is named in errors and gives the folder of mesh files.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SceneError> {
        let SceneFile { name, color, friction, canvas, sheet, furniture } = diagnostic::parse(text, file)?;
        if !(0.0..=5.0).contains(&friction) {
            let message = format!("friction of {friction} is not in 0 to 5");
            return Err(diagnostic::invalid(text, file, "friction", message).into());
        }
        let (mesh, wall) = canvas.made(file, CANVAS_TRIANGLE_MM).map_err(|e| e.in_table(text, file, "canvas", 0))?;
        if canvas.color.is_some() {
            let message = "the colour of the canvas stands above its table: color = [R, G, B]";
            return Err(diagnostic::invalid(text, file, "canvas.color", message).into());
        }
        let sheet_frame = sheet
            .frame()
            .map_err(|(key, message)| diagnostic::invalid(text, file, &format!("sheet.{key}"), message))?;
        let canvas = Canvas { name, mesh, sheet: sheet_frame };
        if let Some(message) = misplaced(&canvas) {
            return Err(diagnostic::invalid(text, file, "sheet.xyz_mm", message).into());
        }
        let furniture = furniture
            .iter()
            .enumerate()
            .map(|(i, item)| {
                let mesh = item
                    .mesh(file, FURNITURE_TRIANGLE_MM)
                    .map_err(|e: ShapeError| e.in_table(text, file, "furniture", i))?;
                Ok(Furniture { mesh, color: item.color.unwrap_or_else(white) })
            })
            .collect::<Result<_, SceneError>>()?;
        Ok(Self { canvas, color, friction, wall, furniture })
    }
}

/// What is wrong with where the canvas is as seen from the sheet, if anything.
fn misplaced(canvas: &Canvas) -> Option<String> {
    let world_from_sheet = &canvas.sheet.world_from_sheet;
    let Some(seen) = Projection::new(canvas).to_surface(&nalgebra::Point2::origin()) else {
        let places = canvas.mesh.vertices().iter().map(|p| world_from_sheet.inverse_transform_point(p).coords * 1e3);
        let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let (low, high) = places.fold(start, |(low, high), p| (low.inf(&p), high.sup(&p)));
        return Some(format!(
            "no canvas behind the sheet's centre (xyz_mm), or it faces away: look along -normal; from there the canvas is at \
             {:.1} to {:.1} mm to the right, {:.1} to {:.1} mm upwards and {:.1} to {:.1} mm along the normal",
            low.x, high.x, low.y, high.y, low.z, high.z
        ));
    };
    let gap = world_from_sheet.inverse_transform_point(&seen.position).z;
    let where_to = "move the sheet (xyz_mm) to just before the canvas";
    if gap > MOST_BEFORE {
        return Some(format!(
            "the canvas is {:.1} mm before the sheet, on the artist's side of it, where none is looked for: {where_to}, or turn \
             its normal round",
            1e3 * gap
        ));
    }
    (gap < -MOST_BEHIND).then(|| format!("the canvas is {:.1} mm behind the sheet: {where_to}", -1e3 * gap))
}

impl SheetFile {
    /// The sheet's frame, or the key that is wrong and why.
    fn frame(&self) -> Result<SheetFrame, (&'static str, &'static str)> {
        let direction = |v: [f64; 3]| {
            let v = Vector3::from(v);
            v.iter().all(|c| c.is_finite()).then(|| v.try_normalize(1e-9)).flatten()
        };
        let center = Vector3::from(self.xyz_mm) / 1000.0;
        if !center.iter().all(|c| c.is_finite()) {
            return Err(("xyz_mm", "coordinates must be finite"));
        }
        let normal = direction(self.normal).ok_or(("normal", "a direction must be finite and not zero"))?;
        let up = direction(self.up).ok_or(("up", "a direction must be finite and not zero"))?;
        let right = up.cross(&normal);
        if right.norm() < MIN_SINE {
            return Err(("up", "up is parallel to normal; it must point along the sheet, towards its upper edge"));
        }
        let rotation = frame_from_axes(&normal, &right);
        Ok(SheetFrame { world_from_sheet: Pose::from_parts(Translation3::from(center), rotation) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{FlattenOptions, MappingKind, mapping_of};
    use proptest::prelude::*;

    const DOME: &str = "name = 'd'\n[canvas]\nshape = 'dome'\nradius_mm = 150\ntriangle_mm = 20\npose = { xyz_mm = [520, 0, 300] }\n\
        [sheet]\nxyz_mm = [520, 0, 500]\nnormal = [0, 0, 1]\nup = [1, 0, 0]\n";

    fn parse(text: &str) -> Result<Scene, SceneError> {
        Scene::parse(text, Path::new("s.toml"))
    }

    fn mistake(from: &str, to: &str) -> String {
        assert!(DOME.contains(from));
        parse(&DOME.replace(from, to)).err().expect("is refused").to_string()
    }

    #[test]
    fn the_sheet_lies_as_asked() {
        let scene = parse(DOME).unwrap();
        let frame = scene.canvas.sheet.world_from_sheet;
        assert!((frame * Vector3::z() - Vector3::z()).norm() < 1e-12);
        assert!((frame * Vector3::y() - Vector3::x()).norm() < 1e-12);
        assert!((scene.canvas.mesh.bounds().1.z - 0.45).abs() < 1e-9);
        assert_eq!((scene.friction, scene.color), (0.3, Rgb([255; 3])));
    }

    #[test]
    fn mistakes_are_refused_with_their_line() {
        assert_eq!(mistake("radius_mm = 150", "radius_mm = -1"), "s.toml:4: radius_mm is -1, but must be above 0");
        assert_eq!(mistake("radius_mm", "radius_m"), "s.toml:4: unknown key `radius_m`: did you mean `radius_mm`?");
        assert_eq!(mistake("radius_mm = 150\n", ""), "s.toml:2: a dome needs radius_mm");
        assert_eq!(mistake("radius_mm = 150", "radius_mm = 150\nheight_mm = 3"), "s.toml:5: a dome has no height_mm");
        assert_eq!(mistake("'dome'", "'dom'"), "s.toml:3: unknown value `dom`: did you mean `dome`?");
        assert!(mistake("up = [1, 0, 0]", "up = [0, 0, 2]").starts_with("s.toml:10: up is parallel"));
        assert!(mistake("normal = [0, 0, 1]", "normal = [0, 1, 0]").contains("no canvas behind"));
        let aside = mistake("xyz_mm = [520, 0, 500]", "xyz_mm = [0, 0, 500]");
        assert!(
            aside.starts_with("s.toml:8:") && aside.contains("mm upwards and -200.0 to -50.0 mm along the normal"),
            "{aside}"
        );
        let before = mistake("xyz_mm = [520, 0, 500]", "xyz_mm = [520, 0, 100]");
        assert!(before.starts_with("s.toml:8: the canvas is 350.0 mm before the sheet"), "{before}");
        let behind = mistake("xyz_mm = [520, 0, 500]", "xyz_mm = [520, 0, 3000]");
        assert!(behind.starts_with("s.toml:8: the canvas is 2550.0 mm behind the sheet"), "{behind}");
        assert!(parse(&DOME.replace("xyz_mm = [520, 0, 500]", "xyz_mm = [520, 0, 400]")).is_ok());
        assert!(mistake("[canvas]", "friction = -1\n[canvas]").starts_with("s.toml:2:"));
        assert!(mistake("triangle_mm = 20", "triangle_mm = 1e-6").contains("triangle size"));
        let furniture =
            "[[furniture]]\nshape = 'box'\nsize_mm = [1, 1, 1]\n[[furniture]]\nshape = 'box'\nsize_mm = [1, 0, 1]\n";
        assert_eq!(
            parse(&format!("{DOME}{furniture}")).err().map(|e| e.to_string()),
            Some("s.toml:16: size_mm is 0, but must be above 0".to_string())
        );
        let lost = mistake("shape = 'dome'\nradius_mm = 150\ntriangle_mm = 20", "shape = 'mesh'\nmesh = 'nowhere.obj'");
        assert!(lost.starts_with("nowhere.obj: "), "{lost}");
    }

    #[test]
    fn a_mesh_of_an_absurd_size_is_asked_about_its_scale() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("m.obj"), "v -0.1 -0.1 0\nv 0.1 -0.1 0\nv 0 0.1 0\nf 1 2 3\n").unwrap();
        let of = |scale: f64| {
            let shape = format!("shape = 'mesh'\nmesh = 'm.obj'\nscale = {scale:?}");
            let text = DOME.replace("shape = 'dome'\nradius_mm = 150\ntriangle_mm = 20", &shape);
            Scene::parse(&text, &folder.path().join("s.toml")).map(|_| ()).map_err(|e| e.to_string())
        };
        assert_eq!(of(1.0), Ok(()));
        let small = of(0.001).unwrap_err();
        assert!(small.contains("s.toml:5: the mesh is 0.200 x 0.200 x 0.000 mm: is `scale` right?"), "{small}");
        assert!(of(1000.0).unwrap_err().contains("is `scale` right?"));
    }

    /// Shoulders of the arms that a scene is made for, m: UR5e around a table, or else the iiwa on its pedestal.
    fn shoulders(scene: &str) -> Vec<nalgebra::Point3<f64>> {
        let around = |n: u32| {
            let turn = |i: u32| std::f64::consts::FRAC_PI_2 + std::f64::consts::TAU * f64::from(i) / f64::from(n);
            (0..n).map(|i| nalgebra::Point3::new(0.72 * turn(i).cos(), 0.72 * turn(i).sin(), 0.463)).collect()
        };
        match scene.split('_').next() {
            Some("two") => around(2),
            Some("three") => around(3),
            _ => vec![nalgebra::Point3::new(0.0, 0.0, 0.64)],
        }
    }

    #[test]
    fn every_scene_in_the_folder_can_be_drawn_on() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
        files.retain(|f| f.extension().is_some_and(|e| e == "toml"));
        files.sort();
        assert!(files.len() >= 6);
        for file in files {
            let scene = Scene::read(&file).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(file.file_stem().unwrap().to_str(), Some(scene.canvas.name.as_str()));
            // walls are for robots that drive up to them
            let Some(wall) = &scene.wall else {
                assert!(scene.canvas.mesh.signed_volume() > 0.0);
                check_reach(&scene, &file);
                continue;
            };
            assert!(wall.profile.length() > 1.0, "{}", file.display());
            wall_is_drawn_on_along_its_length(&scene, wall);
        }
    }

    /// The middle 90 x 180 mm, the smallest canvas of the dissertation's table 8.1, has surface everywhere, in reach of an arm.
    fn check_reach(scene: &Scene, file: &Path) {
        let projection = Projection::new(&scene.canvas);
        for (x, y) in (-9..=9).flat_map(|i| (-9..=9).map(move |j| (0.005 * f64::from(i), 0.01 * f64::from(j)))) {
            let hit = projection.to_surface(&nalgebra::Point2::new(x, y));
            let hit = hit.unwrap_or_else(|| panic!("{}: nothing at {x}, {y}", file.display()));
            let reach = shoulders(&scene.canvas.name).into_iter().map(|s| (hit.position - s).norm());
            let reach = reach.fold(f64::INFINITY, f64::min);
            assert!((0.3..0.85).contains(&reach), "{}: {x}, {y} is {reach} m from a shoulder", file.display());
        }
    }

    /// The curve that the sheet's middle line makes of a drawing, by projection and by a conformal map, follows the wall.
    fn wall_is_drawn_on_along_its_length(scene: &Scene, wall: &Wall) {
        let width = if wall.profile.length() > 3.7 { 3.6 } else { 2.0 };
        let options = FlattenOptions { margin_mm: Some(30.0), ..FlattenOptions::default() };
        for kind in [MappingKind::Projection, MappingKind::Conformal] {
            let (mapping, _) = mapping_of(&scene.canvas, kind, [width, 0.4], &options)
                .unwrap_or_else(|e| panic!("{}: {e}", scene.canvas.name));
            let mut last: Option<f64> = None;
            for k in 0..=200 {
                let x = width * (f64::from(k) / 200.0 - 0.5);
                let hit = mapping.to_surface(&nalgebra::Point2::new(x, 0.1));
                let hit = hit.unwrap_or_else(|| panic!("{}, {}: nothing at {x}", scene.canvas.name, mapping.kind()));
                let (s, distance) = wall.profile.nearest(&hit.position.xy());
                assert!(distance < 1e-4, "{} {x}: {distance}", scene.canvas.name);
                assert!(hit.normal.xy().dot(&wall.profile.normal(s)) > 0.99, "{} {x}", scene.canvas.name);
                let step = last.map_or(0.0, |l| s - l);
                assert!((0.0..0.05).contains(&step), "{} {x}: {step} m along the wall", scene.canvas.name);
                last = Some(s);
            }
        }
    }

    #[test]
    fn a_wall_is_refused_with_the_line_of_its_profile() {
        let wall = |profile: &str| {
            parse(&format!(
                "name = 'w'\n[canvas]\nshape = 'extrusion'\nheight_mm = 1000\ntriangle_mm = 50\nprofile = {profile}\n\
                 [sheet]\nxyz_mm = [0, 0, 500]\nnormal = [-1, 0, 0]\nup = [0, 0, 1]\n"
            ))
            .map(|s| s.wall.unwrap().profile.length())
            .map_err(|e| e.to_string())
        };
        assert!((wall("{ points_mm = [[1000, 1000], [1000, -1000]] }").unwrap() - 2.0).abs() < 1e-9);
        let crossed = wall("{ points_mm = [[1000, 1000], [1000, -1000], [1500, -1000], [500, 500]] }").unwrap_err();
        assert!(crossed.starts_with("s.toml:6: the profile crosses itself at (1000.0, -250.0) mm"), "{crossed}");
        assert!(wall("{ fillet_mm = 3 }").unwrap_err().starts_with("s.toml:6: a profile is one of"));
        assert!(wall("{ file = 'nowhere.txt' }").unwrap_err().starts_with("s.toml:6: nowhere.txt: "));
        assert!(wall("{ points = [[1, 2]] }").unwrap_err().starts_with("s.toml:6: unknown key `points`"));
        let door = "{ points_mm = [[1000, 1000], [1000, -1000]] }\nopenings = [{ left_mm = 3000, right_mm = 4000, top_mm = 900 }]";
        assert!(wall(door).unwrap_err().starts_with("s.toml:7: the opening from 3000 to 4000 mm isn't in the wall"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn arbitrary_text_never_panics(text in "(name|shape|=|'dome'|\\[canvas\\]|\\[sheet\\]|\n|[0-9.e-]{1,4}|\\PC){0,40}") {
            let _ = parse(&text);
            let _ = parse(&format!("{DOME}{text}"));
        }

        #[test]
        fn arbitrary_numbers_never_panic(a in any::<f64>(), b in any::<f64>(), c in any::<f64>()) {
            prop_assume!(a.is_finite() && b.is_finite() && c.is_finite());
            let _ = parse(&DOME.replace("520, 0, 300", &format!("{a:?}, {b:?}, {c:?}")));
            let _ = parse(&DOME.replace("normal = [0, 0, 1]", &format!("normal = [{a:?}, {b:?}, {c:?}]")));
            let _ = parse(&DOME.replace("radius_mm = 150", &format!("radius_mm = {a:?}")));
            let _ = parse(&DOME.replace("triangle_mm = 20", &format!("triangle_mm = {:?}", 30.0 + b.abs())));
        }
    }
}
