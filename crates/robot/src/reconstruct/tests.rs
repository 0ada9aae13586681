use nalgebra::Translation3;

use super::*;
use crate::math::frame_from_axes;

#[test]
fn clouds_without_a_surface_are_refused_in_words() {
    let outward = -Vector3::x();
    let rotation = frame_from_axes(&outward, &Vector3::z().cross(&outward));
    let sheet = SheetFrame { world_from_sheet: Pose::from_parts(Translation3::new(-0.33, 0.0, 0.3), rotation) };
    let refuse = |points: Vec<Point3<f64>>| {
        let cloud = PointCloud { points, ..PointCloud::default() };
        from_cloud(&cloud, "own", &sheet, [0.1, 0.1], &MeshingOptions::default()).err().expect("is refused").to_string()
    };
    let at = |y: f64, z: f64| Point3::new(-0.28, y, z);
    assert!(refuse(vec![]).starts_with("0 of 0 points"));
    assert!(refuse(vec![at(0.0, 0.3), at(0.01, 0.3), at(0.0, 0.31)]).starts_with("3 of 3 points"));
    assert_eq!(refuse(vec![at(f64::NAN, 0.3); 100]), "point 0 is not finite");
    assert!(refuse(vec![at(0.0, 5.0); 100]).starts_with("0 of 100 points"));
    let one_place = refuse(vec![at(0.0, 0.3); 100]);
    assert!(one_place.starts_with("1 of 100 points") || one_place.contains("no surface"), "{one_place}");
    let line = (0..200).map(|i| at(0.0, 0.22 + 0.0008 * f64::from(i))).collect();
    assert!(refuse(line).contains("no surface"));
}
