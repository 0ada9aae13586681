//! Writes the tables of GUIDE.md anew: options from the schemas of scenarios and experiments, figures from that of metrics.json.
//!
//!     cargo run --example guide
use std::error::Error;
use std::path::Path;

mod tables;

fn main() -> Result<(), Box<dyn Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("GUIDE.md");
    let old = std::fs::read_to_string(&file)?;
    let new = tables::renewed(&old)?;
    println!("{} {}", file.display(), if new == old { "is as it should be" } else { "is written anew" });
    if new != old {
        std::fs::write(&file, new)?;
    }
    Ok(())
}
