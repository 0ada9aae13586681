//! The iiwa 7: bent, smoothly flowing housings, joint by joint.
//!
//! The joint centres stand at 340, 740 and 1140 mm, seams about the vertical axes at 157.5, 524.5 and 924.5 mm; pitch
//! joints meet in a plane beside the axis, so that the housings lie to the left and to the right in turn.
use nalgebra::Vector3;

use crate::Mesh;
use crate::lathe::{band, lid, turn};
use crate::nets;
use crate::solid::{Solid, at, behind, block, common, cut, cylinder, join, rod};

/// Cell size of the housings.
const CELL: f64 = 13.0;

/// Radius of the housings about the vertical axes.
const TUBE: f64 = 67.5;

/// Radius of the housings about the pitch axes.
const DRUM: f64 = 71.0;

/// A housing from a vertical tube to a drum about y. In its own coordinates the drum's axis is y through the origin, the
/// plane where it meets its neighbour is `y = 0` and it lies at `y > 0`; the tube stands at `y = tube_y`, from its open
/// end at `-end` (below) to the drum.
fn elbow(tube_y: f64, depth: f64, end: f64) -> Solid {
    let drum = cylinder(at(0.0, -10.0, 0.0), at(0.0, depth, 0.0), DRUM, 33.0);
    let neck = rod(at(0.0, tube_y, -end + 68.0), TUBE - 13.0, at(0.0, depth * 0.46, -4.0), 60.0);
    let tube = cylinder(at(0.0, tube_y, -end - 40.0), at(0.0, tube_y, -end + 62.0), TUBE - 3.0, 24.0);
    let body = join(join(tube, neck, 40.0), drum, 34.0);
    // The neighbour's drum swings past on the other side of the plane.
    let swing = common(
        cylinder(at(0.0, -200.0, 0.0), at(0.0, 200.0, 0.0), DRUM + 2.5, 1.0),
        behind(at(0.0, 1.0, 0.0), Vector3::y()),
        3.0,
    );
    let body = cut(body, swing, 5.0);
    // A flat outer face for the cover, and an open end that stops inside its collar.
    let body = common(body, behind(at(0.0, depth, 0.0), Vector3::y()), 8.0);
    common(body, behind(at(0.0, 0.0, -end + 6.0), -Vector3::z()), 3.0)
}

/// Places a solid made for drum axis y, tube below: mirrored in y and z as asked, then moved.
fn placed(solid: Solid, flip_y: bool, flip_z: bool, origin: [f64; 3]) -> Solid {
    let sign = |flip: bool| if flip { -1.0 } else { 1.0 };
    let (sy, sz) = (sign(flip_y), sign(flip_z));
    Box::new(move |p| solid(&at(p.x - origin[0], sy * (p.y - origin[1]), sz * (p.z - origin[2]))))
}

fn housing(solid: &Solid, low: [f64; 3], high: [f64; 3], cell: f64) -> Mesh {
    nets::mesh(solid, at(low[0], low[1], low[2]), at(high[0], high[1], high[2]), cell)
}

/// Every mesh of the arm, by file name.
pub fn parts() -> Vec<(String, Mesh)> {
    let mut parts: Vec<(String, Mesh)> = Vec::new();
    let mut add = |name: &str, mesh: Mesh| parts.push((format!("iiwa7_{name}"), mesh));

    // Shared by several links: round covers and rings for the outer faces, along z, and the seam between two tubes.
    let o = at(0.0, 0.0, 0.0);
    add("cover", lid(38.0, 1.6, o, Vector3::z()));
    add("cover_ring", band(38.4, 42.5, -4.0, 1.0, o, Vector3::z()));
    add("wrist_cover", lid(34.0, 1.4, o, Vector3::z()));
    add("wrist_ring", band(34.4, 38.5, -4.0, 1.0, o, Vector3::z()));
    add("seam", band(50.0, TUBE - 1.0, -4.0, 4.0, o, Vector3::z()));
    let collar = [(56.0, 1.2), (TUBE + 0.3, 1.2), (TUBE + 1.2, 2.1), (TUBE + 1.2, 13.0), (TUBE - 5.0, 18.0)];
    add("collar", turn(&collar, o, Vector3::z(), 40));
    add("drum_seam", band(50.0, DRUM - 4.0, -4.0, 4.0, o, Vector3::z()));

    // The base: a foot that flows into the first tube, and the block of plugs behind it.
    let flare = (0..=10).map(|i| {
        let t = f64::from(i) / 10.0;
        let s = t * t * (3.0 - 2.0 * t);
        (100.0 + (TUBE - 100.0) * s, 27.0 + (142.0 - 27.0) * t)
    });
    let profile: Vec<_> =
        [(0.0, 0.0), (102.5, 0.0), (104.0, 1.5), (104.0, 22.0), (103.0, 25.0)].into_iter().chain(flare).collect();
    let plugs = block(at(-63.0, 0.0, 42.0), Vector3::new(100.0, 108.0, 80.0), 15.0);
    let plugs = housing(&plugs, [-135.0, -72.0, -20.0], [5.0, 72.0, 100.0], 13.0);
    add("link_0", turn(&profile, o, Vector3::z(), 44).with(plugs));

    // Links 1 and 3: tube below, drum above, on the -y and the +y side.
    let low_bound = |mirror: bool| if mirror { [-95.0, -95.0, -45.0] } else { [-95.0, -140.0, -45.0] };
    let high_bound = |mirror: bool| if mirror { [95.0, 140.0, 290.0] } else { [95.0, 95.0, 290.0] };
    let upright = |mirror: bool, end: f64| {
        let plane = if mirror { 10.5 } else { -10.5 };
        let solid = placed(elbow(-10.5, 104.0, end), !mirror, false, [0.0, plane, 192.5]);
        housing(&solid, low_bound(mirror), high_bound(mirror), CELL)
    };
    add("link_1", upright(false, 182.5));
    add("link_3", upright(true, 215.5));

    // Link 2: drum below, tube above; link 4 is the same turned half round.
    let hanging = placed(elbow(10.5, 119.0, 184.0), false, true, [0.0, 0.0, 0.0]);
    add("link_2", housing(&hanging, [-95.0, -95.0, -100.0], [95.0, 140.0, 210.0], CELL));

    // Link 5: from the tube to a slim blade at -y that carries the wrist.
    let tube = cylinder(at(0.0, 0.0, -70.0), at(0.0, 0.0, 52.0), TUBE - 3.0, 24.0);
    let lean = rod(at(0.0, -5.0, 48.0), 54.0, at(0.0, -58.0, 168.0), 46.0);
    let blade = cylinder(at(0.0, -98.0, 192.5), at(0.0, -60.0, 192.5), 57.0, 16.0);
    let body = join(join(tube, lean, 30.0), blade, 30.0);
    let wrist = join(
        rod(at(0.0, 0.0, 192.5), 71.5, at(0.0, 0.0, 290.0), 71.5),
        cylinder(at(0.0, -69.5, 192.5), at(0.0, 60.0, 192.5), 68.0, 2.0),
        4.0,
    );
    let body = cut(body, wrist, 10.0);
    let body = common(body, behind(at(0.0, -99.0, 0.0), -Vector3::y()), 6.0);
    let body = common(body, behind(at(0.0, 0.0, -17.0), -Vector3::z()), 3.0);
    add("link_5", housing(&body, [-95.0, -120.0, -45.0], [95.0, 95.0, 275.0], 11.5));

    // Link 6: the wrist's ball, its axis at local y = 70.7 mm from the blade's plane.
    let ball = rod(at(0.0, 70.7, -20.0), 66.0, at(0.0, 70.7, 24.0), 66.5);
    let neck = cylinder(at(0.0, 70.7, 20.0), at(0.0, 70.7, 81.0), 53.0, 8.0);
    let hub = cylinder(at(0.0, 2.5, 0.0), at(0.0, 60.0, 0.0), 54.0, 6.0);
    let body = join(join(ball, neck, 18.0), hub, 14.0);
    let body = common(body, behind(at(0.0, 125.0, 0.0), Vector3::y()), 5.0);
    add("link_6", housing(&body, [-85.0, -15.0, -105.0], [85.0, 155.0, 100.0], 11.5));

    // Link 7: the flange, its face at z = 35 mm.
    let flange = [(46.0, -9.5), (50.0, -9.5), (51.5, -8.0), (51.5, 21.0), (50.0, 22.5), (36.0, 24.5), (31.5, 26.0)];
    add("link_7", turn(&flange, o, Vector3::z(), 44));
    let face = [(31.5, 25.0), (31.5, 34.2), (30.7, 35.0), (20.0, 35.0), (20.0, 32.0), (0.0, 32.0)];
    let mut steel = turn(&face, o, Vector3::z(), 32);
    for i in 0..7 {
        let (s, c) = (f64::from(i) * std::f64::consts::FRAC_PI_4).sin_cos();
        steel =
            steel.with(turn(&[(2.8, 35.0), (2.8, 35.6), (0.0, 35.6)], at(25.0 * c, 25.0 * s, 0.0), Vector3::z(), 8));
    }
    add("link_7_trim", steel);
    add("link_7_ring", band(48.0, 52.0, 9.0, 13.0, o, Vector3::z()));
    parts
}
