//! The UR5e: straight tubes between cylindrical joints with blue lids.
//!
//! Everything is placed by the link frames of the description: joint axes are local z except the base's, tubes run along
//! local -x, and the arm's offsets (133.3, 99.7, 99.6 mm) are those between the axes.
use nalgebra::Vector3;

use crate::Mesh;
use crate::lathe::{band, lid, turn};
use crate::nets;
use crate::solid::{Solid, at, cylinder, join};

fn housing(solid: &Solid, low: [f64; 3], high: [f64; 3], cell: f64) -> Mesh {
    nets::mesh(solid, at(low[0], low[1], low[2]), at(high[0], high[1], high[2]), cell)
}

/// Every mesh of the arm, by file name.
pub fn parts() -> Vec<(String, Mesh)> {
    let mut parts: Vec<(String, Mesh)> = Vec::new();
    let mut add = |name: &str, mesh: Mesh| parts.push((format!("ur5e_{name}"), mesh));
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let o = at(0.0, 0.0, 0.0);

    let foot = [
        (0.0, 0.0),
        (74.0, 0.0),
        (74.5, 0.5),
        (74.5, 9.0),
        (72.0, 12.0),
        (64.0, 18.0),
        (61.0, 24.0),
        (60.0, 32.0),
        (60.0, 93.0),
    ];
    let connector = turn(&[(0.0, 0.0), (13.0, 0.0), (13.0, 17.0), (0.0, 17.0)], at(-59.0, 0.0, 36.0), -x, 20);
    add("base", turn(&foot, o, z, 44).with(connector));
    add("base_trim", band(40.0, 58.5, 93.0, 99.0, o, z));

    // Shared by several links, along z: lids of the three joint sizes, and dark seams.
    add("lid_large", lid(60.2, 9.0, o, z));
    add("lid_middle", lid(55.2, 8.0, o, z));
    add("lid_small", lid(45.6, 7.0, o, z));
    add("seam_large", band(40.0, 60.0, -6.0, 4.0, o, z));
    add("seam_middle", band(36.0, 55.0, -6.0, 4.0, o, z));
    add("seam_small", band(28.0, 45.4, -5.0, 3.5, o, z));

    // Shoulder: axis of the base up, axis of the lift along local -y; the lid looks back.
    let body = join(
        cylinder(at(0.0, 0.0, -63.0), at(0.0, 0.0, 15.0), 59.5, 8.0),
        cylinder(at(0.0, 58.0, 0.0), at(0.0, -67.0, 0.0), 59.5, 4.0),
        14.0,
    );
    add("shoulder", housing(&body, [-80.0, -88.0, -84.0], [80.0, 80.0, 80.0], 11.5));

    // Upper arm, 138 mm beside the shoulder's axis.
    let side = 138.0;
    let drum = |cx: f64, low: f64, high: f64, r: f64| cylinder(at(cx, 0.0, low), at(cx, 0.0, high), r, 4.0);
    let tube = cylinder(at(-30.0, 0.0, side), at(-395.0, 0.0, side), 46.0, 2.0);
    let body =
        join(join(drum(0.0, 71.0, side + 56.0, 59.5), tube, 10.0), drum(-425.0, side - 71.0, side + 52.0, 54.5), 10.0);
    add("upper_arm", housing(&body, [-500.0, -80.0, 52.0], [80.0, 80.0, 216.0], 15.5));

    // Forearm, back by the elbow's width.
    let near = 7.0;
    let tube = cylinder(at(-25.0, 0.0, near), at(-370.0, 0.0, near), 37.5, 2.0);
    let body = join(join(drum(0.0, -24.0, 63.0, 54.5), tube, 10.0), drum(-392.2, -40.0, 60.0, 45.0), 10.0);
    add("forearm", housing(&body, [-460.0, -75.0, -70.0], [75.0, 75.0, 106.0], 16.0));

    // Wrists 1 and 2: tees of two drums, one along the joint's own axis, one along the next.
    let tee = |low: f64, high: f64, back: f64, front: f64| {
        join(
            cylinder(at(0.0, 0.0, low), at(0.0, 0.0, high), 45.0, 4.0),
            cylinder(at(0.0, back, 0.0), at(0.0, front, 0.0), 44.5, 6.0),
            10.0,
        )
    };
    add("wrist_1", housing(&tee(-71.0, 44.0, 40.0, -52.5), [-62.0, -72.0, -90.0], [62.0, 62.0, 64.0], 10.5));
    add("wrist_2", housing(&tee(-45.0, 44.0, -40.0, 52.5), [-62.0, -62.0, -64.0], [62.0, 72.0, 60.0], 10.0));

    let flange =
        [(30.0, -43.6), (43.0, -43.6), (44.0, -42.6), (44.0, -15.0), (42.5, -13.5), (37.5, -13.0), (37.5, -7.0)];
    let plug = turn(&[(0.0, 0.0), (8.0, 0.0), (8.0, 12.0), (0.0, 12.0)], at(0.0, -40.0, -28.0), -y, 16);
    add("wrist_3", turn(&flange, o, z, 44).with(plug));
    let face = [(37.5, -7.5), (37.5, -0.8), (36.7, 0.0), (31.5, 0.0), (31.5, -2.5), (0.0, -2.5)];
    add("wrist_3_trim", turn(&face, o, z, 44));
    parts
}
