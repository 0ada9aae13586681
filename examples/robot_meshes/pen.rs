//! The pen holder and its fineliner: flange at z = 0, nib at z = 127.5 mm.
use nalgebra::Vector3;

use crate::Mesh;
use crate::lathe::{band, turn};
use crate::solid::at;

/// Every mesh of the tool, by file name.
pub fn parts() -> Vec<(String, Mesh)> {
    let (o, z) = (at(0.0, 0.0, 0.0), Vector3::z());
    let plate = turn(&[(0.0, 0.0), (31.5, 0.0), (31.5, 9.0), (29.5, 11.0), (20.0, 12.0), (15.0, 15.0)], o, z, 40);
    let mut screws = Mesh::default();
    for i in 0..4 {
        let (s, c) = (f64::from(i) * std::f64::consts::FRAC_PI_2 + 0.4).sin_cos();
        screws = screws.with(turn(
            &[(3.2, 10.5), (3.2, 13.2), (2.6, 13.8), (0.0, 13.8)],
            at(24.5 * c, 24.5 * s, 0.0),
            z,
            12,
        ));
    }
    let body =
        [(15.0, 14.0), (14.5, 18.0), (14.5, 52.0), (16.0, 53.5), (16.0, 69.0), (14.5, 70.5), (9.0, 72.0), (5.6, 72.0)];
    let screw = turn(&[(4.0, 0.0), (4.0, 6.0), (3.2, 6.8), (0.0, 6.8)], at(14.5, 0.0, 61.0), Vector3::x(), 16);
    let barrel = [(5.4, 71.0), (5.4, 105.0), (5.0, 107.0), (4.6, 107.2)];
    let grip = [(4.6, 107.0), (4.2, 113.0), (2.9, 119.5), (1.5, 122.5), (1.3, 123.0)];
    let tube = [(0.55, 122.5), (0.5, 126.4), (0.3, 127.3), (0.0, 127.5)];
    vec![
        ("pen_plate".to_string(), plate.with(screw)),
        ("pen_body".to_string(), turn(&body, o, z, 30).with(screws)),
        ("pen_barrel".to_string(), turn(&barrel, o, z, 24)),
        (
            "pen_grip".to_string(),
            turn(&grip, o, z, 24).with(turn(&tube, o, z, 12)).with(band(5.0, 5.6, 84.0, 88.0, o, z)),
        ),
    ]
}
