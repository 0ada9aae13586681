//! GUIDE.md tells everything there is to set and everything that is measured, in the words of the fields.
#[path = "../../examples/guide/tables.rs"]
mod tables;

fn guide() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/GUIDE.md")).unwrap()
}

#[test]
fn the_tables_of_the_guide_are_what_the_fields_say() {
    let old = guide();
    let new = tables::renewed(&old).unwrap();
    let missing: Vec<&str> = new.lines().filter(|row| !old.lines().any(|l| l == *row)).collect();
    let surplus: Vec<&str> = old.lines().filter(|row| !new.lines().any(|l| l == *row)).collect();
    assert!(
        old == new,
        "`make guide` puts these rows into GUIDE.md:\n{}\nand takes these out:\n{}",
        missing.join("\n"),
        surplus.join("\n")
    );
}

#[test]
fn rows_are_of_every_key_with_default_range_and_words() {
    let empty = "<!-- options: scenario -->\nx\n<!-- end -->\n<!-- options: scenario.drive scenario.truth -->\n<!-- end -->\n\
                 <!-- options: experiment -->\n<!-- end -->\n";
    let table = tables::renewed(empty).unwrap();
    for row in [
        "| `seed` | 1 |  | Seed of every random number of the run. Same seed, same bits |",
        "| `robot` | `\"iiwa_fixed\"` |  | A robot, by name or path |",
        "| `drawing.fill` | `\"outline\"` |  | What becomes of filled areas. `\"outline\"`: The pen draws their outline. `\"ignore\"`: They are left out. `\"hatch\"`: The pen draws their outline and hatches them |",
        "| `drive.approach_mm` | 50 | 0 to 10000 | Length of the last stretch before a stop, which is driven slowly |",
        "| `truth.offset_mm` | `[0, 0, 0]` | each -1000 to 1000 | How far canvas and sheet stand from where the robot believes them, in the world |",
        "| `coverage.mount_mm` | `[120, 0, 731]` | -2000 to 2000, -2000 to 2000, 0 to 3000 | Where the arm's base frame stands on it: forward and to the left of its centre, and over the floor. Of a robot that has a base it is the robot's own |",
        "| `drawing.pattern.kind` | needed |  | Which pattern. `\"grid\"`: n x n squares. `\"hilbert\"`: Hilbert's space-filling curve. `\"arrowhead\"`: Sierpinski's arrowhead curve. `\"snowflake\"`: Koch's snowflake. `\"target\"`: A test target: circles, crosses and rulers |",
        "| `[canvas.overlay]` |  |  | The drawing once more over the first, laid by another mapping: to compare the two on one canvas |",
        "| `[[scan.camera]]` |  |  | A place of one's own in place of `views` |",
        "| `scan.camera.eye_mm` | needed | each -1000000 to 1000000 | Where the eye is, in the world |",
        "| `plot.bins` |  | 2 to 200 | Bars of a histogram; 24 when absent |",
        "| `accept.mean_max` |  |  | The mean, or the rate, may not be above this |",
    ] {
        assert!(table.lines().any(|l| l == row), "{row} is not in\n{table}");
    }
    assert!(!table.contains("\nx\n"), "what stood in the table goes");
}

#[test]
fn a_marker_without_a_table_is_refused() {
    let whole = "<!-- options: scenario -->\n<!-- end -->\n<!-- options: experiment -->\n<!-- end -->\n";
    assert!(tables::renewed(whole).is_ok());
    for (more, expected) in [
        ("<!-- options: scenario.driving -->\n<!-- end -->\n", "no table `scenario.driving`"),
        ("<!-- optoins: scenario -->\n<!-- end -->\n", "no table `optoins: scenario`"),
        ("<!-- figures -->\n", "has no `<!-- end -->`"),
    ] {
        let error = tables::renewed(&format!("{whole}{more}")).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    assert!(tables::renewed("# Guide\n").is_err());
}
