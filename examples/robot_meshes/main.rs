//! Writes the meshes that the robots' URDFs show: `cargo run --example robot_meshes`.
//!
//! The shapes are this project's own, modelled on the outer dimensions in `robots/SOURCE.md`: housings are smoothly
//! blended solids ([`solid`]) turned into triangles ([`nets`]), rings, lids and the pen are turned on a lathe
//! ([`lathe`]). Coordinates are mm in the link frames. The same files come out of every run.
mod iiwa;
mod lathe;
mod nets;
mod pen;
mod ridgeback;
mod solid;
mod ur5e;

use std::fmt::Write;
use std::path::Path;

use nalgebra::Point3;

/// Triangles with shared vertices, mm.
#[derive(Default)]
struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn with(mut self, other: Mesh) -> Mesh {
        let first = self.vertices.len() as u32;
        self.vertices.extend(other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        self
    }

    /// Wavefront text, coordinates to 0.1 mm.
    fn obj(&self) -> String {
        let mut text = String::new();
        for v in &self.vertices {
            let [x, y, z] = [v.x, v.y, v.z].map(|c| (c * 10.0).round() / 10.0 + 0.0);
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for [a, b, c] in &self.triangles {
            let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
        }
        text
    }
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("robots/meshes");
    std::fs::create_dir_all(&folder)?;
    let mut total = 0;
    for (name, mesh) in iiwa::parts().into_iter().chain(ur5e::parts()).chain(pen::parts()).chain(ridgeback::parts()) {
        let text = mesh.obj();
        println!("{name}.obj: {} triangles, {} kB", mesh.triangles.len(), text.len() / 1000);
        total += text.len();
        std::fs::write(folder.join(format!("{name}.obj")), text)?;
    }
    println!("{} kB in all", total / 1000);
    Ok(())
}
