//! Lines that were drawn, found again in a picture.
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use super::Picture;
use super::register::{DrawnPoint, Estimate, Evidence, SeenPoint, Sighting, Unknowns};
use super::ridge::Darkness;
use crate::math::Pose;

/// Most points of lines that are looked for.
const MOST: usize = 800;
/// Fewest points of lines that must be found.
const FEWEST: usize = 40;
/// Smallest share of the points in view that must be found.
const SHARE: f64 = 0.4;
/// Largest residual across the lines that is taken for a match, px.
const LARGEST_RMS: f64 = 1.5;
/// Largest standard deviation of the place along the wall that is of use, m, were the camera's mount known.
const CLEAR: f64 = 3e-4;
/// Steps of the coarse search: along the wall, off it, and up, m; and how far up it goes, m.
const STEPS: [f64; 3] = [5e-4, 2.5e-3, 5e-4];
const UP: f64 = 1e-3;
/// Share by which a place at the end of the search counts less than the one that was believed.
const LIKELY: f64 = 0.05;
/// Points that the coarse search looks at.
const COARSE: usize = 250;
/// How far across a line it is sought, px, round after round.
const REACHES: [f64; 6] = [12.0, 10.0, 8.0, 6.0, 5.0, 5.0];
/// Places along the wall that are farther from each other than this are different starts, m; and most of them.
const ANOTHER: f64 = 2e-3;
const STARTS: usize = 6;
/// Share of the points of the best match from which on another explains the picture as well.
const ALIKE: f64 = 0.9;

/// Why a picture was of no use: the belief stays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
pub enum LookRefused {
    /// Hardly any line of those that should be in view was found.
    #[error("found {found} of {wanted} points of drawn lines")]
    TooFew {
        /// Points found.
        found: usize,
        /// Points that should be in view.
        wanted: usize,
    },
    /// The lines fit as well elsewhere.
    #[error("the lines fit as well {:.1} mm on", apart * 1e3)]
    Ambiguous {
        /// How far apart the two matches are, m.
        apart: f64,
    },
    /// What was found doesn't lie as it was drawn.
    #[error("lines are {rms_px:.1} px from where they should be")]
    Unlike {
        /// Root of the mean square across the lines, px.
        rms_px: f64,
    },
    /// The lines don't tell where along the wall the base stands.
    #[error("lines tell the place along the wall to {:.2} mm only", sd * 1e3)]
    Unclear {
        /// Its standard deviation, m.
        sd: f64,
    },
    /// The correction is larger than any that is expected.
    #[error("a correction of {:.1} mm and {:.1} mrad is too large", by[0] * 1e3, by[1] * 1e3)]
    TooFar {
        /// Shift (m) and turn (rad).
        by: [f64; 2],
    },
}

/// A picture among what is known: dark lines, where the camera was, and what lines there should be.
pub(super) struct Look<'a> {
    pub dark: Darkness,
    pub base_from_camera: Pose,
    pub points: Vec<&'a DrawnPoint>,
}

impl<'a> Look<'a> {
    /// Looks at a picture; of `drawn` what is in view counts.
    pub fn new(picture: &Picture, base_from_camera: Pose, drawn: &'a [DrawnPoint], e: &Evidence) -> Self {
        let x = e.prior();
        let faces = |p: &DrawnPoint| {
            let eye = (e.world_from_base * base_from_camera).translation.vector;
            (eye - p.position.coords).dot(&p.normal) > 0.0
        };
        let seen = |p: &&DrawnPoint| {
            faces(p) && e.project(&base_from_camera, p, &x).is_some_and(|at| e.camera.sees(&at, 2.0 * REACHES[0]))
        };
        let all: Vec<&DrawnPoint> = drawn.iter().filter(seen).collect();
        let points = all.iter().step_by(all.len().div_ceil(MOST).max(1)).copied().collect();
        Self { dark: Darkness::of(picture), base_from_camera, points }
    }

    /// Finds the lines and where that puts the base.
    pub fn find(&self, e: &Evidence) -> Result<(Sighting, Estimate), LookRefused> {
        let wanted = self.points.len();
        if wanted < FEWEST {
            return Err(LookRefused::TooFew { found: 0, wanted });
        }
        let starts = if self.points.iter().all(|p| p.own) { vec![e.prior()] } else { self.coarse(e) };
        let mut best: Option<(Sighting, Estimate)> = None;
        let mut refused = LookRefused::TooFew { found: 0, wanted };
        let mut others: Vec<(usize, f64, f64)> = Vec::new();
        for start in starts {
            match self.refine(e, start) {
                Ok((sighting, estimate)) => {
                    others.push((sighting.points.len(), estimate.rms_px, estimate.x[0]));
                    // the one that explains more points; of those that explain as many the first
                    if best.as_ref().is_none_or(|(b, _)| sighting.points.len() > b.points.len()) {
                        best = Some((sighting, estimate));
                    }
                }
                Err(LookRefused::TooFew { found, .. }) if matches!(refused, LookRefused::TooFew { found: f, .. } if f >= found) =>
                    {}
                Err(why) => refused = why,
            }
        }
        let (sighting, estimate) = best.ok_or(refused)?;
        let count = sighting.points.len() as f64;
        let as_good = |(points, rms, along): &(usize, f64, f64)| {
            let alike = *points as f64 > ALIKE * count && *rms < 1.5 * estimate.rms_px.max(0.2);
            let apart = (along - estimate.x[0]).abs();
            (alike && apart > 0.5 * ANOTHER).then_some(apart)
        };
        match others.iter().filter_map(as_good).min_by(f64::total_cmp) {
            Some(apart) => Err(LookRefused::Ambiguous { apart }),
            None => Ok((sighting, estimate)),
        }
    }

    /// The lines and where they put the base, from a start that is some pixels off.
    fn refine(&self, e: &Evidence, start: Unknowns) -> Result<(Sighting, Estimate), LookRefused> {
        let (wanted, mut x, mut found) = (self.points.len(), start, None);
        for reach in REACHES {
            let sighting = self.sight(e, &x, reach);
            let count = sighting.points.len();
            if count < FEWEST || (count as f64) < SHARE * wanted as f64 {
                return Err(LookRefused::TooFew { found: count, wanted });
            }
            let estimate = Evidence { sightings: std::slice::from_ref(&sighting), ..*e }.solve(x);
            x = estimate.x;
            found = Some((sighting, estimate));
        }
        let (sighting, estimate) = found.ok_or(LookRefused::TooFew { found: 0, wanted })?;
        if estimate.rms_px > LARGEST_RMS {
            return Err(LookRefused::Unlike { rms_px: estimate.rms_px });
        }
        Ok((sighting, estimate))
    }

    /// The lines across which the picture is dark.
    fn sight(&self, e: &Evidence, x: &Unknowns, reach: f64) -> Sighting {
        let points = self.points.iter().filter_map(|p| {
            let (place, across, width) = self.across(e, p, x)?;
            let off = self.dark.line_across(&place, &across, width, reach)?;
            Some(SeenPoint { drawn: **p, place: place + across * off, across })
        });
        Sighting { base_from_camera: self.base_from_camera, points: points.collect() }
    }

    /// Where a point should be in the picture (px), across which direction, and how wide its line is there (px).
    fn across(&self, e: &Evidence, p: &DrawnPoint, x: &Unknowns) -> Option<(Point2<f64>, Vector2<f64>, f64)> {
        let on = |by: f64| DrawnPoint { position: p.position + p.along * by, ..*p };
        let (a, b) = (e.project(&self.base_from_camera, p, x)?, e.project(&self.base_from_camera, &on(p.width), x)?);
        let along = b - a;
        let across = Vector2::new(-along.y, along.x).try_normalize(1e-9)?;
        Some((a, across, along.norm().max(2.0)))
    }

    /// Where along the wall, off it and up the drawn lines are darkest, the best first. Farther off they only have another size.
    fn coarse(&self, e: &Evidence) -> Vec<Unknowns> {
        let few: Vec<&&DrawnPoint> = self.points.iter().step_by(self.points.len().div_ceil(COARSE)).collect();
        let steps = |most: f64, step: f64| {
            let n = (most / step).ceil() as i32;
            (-n..=n).map(move |i| f64::from(i) * step)
        };
        let reach = [2.0 * e.spread[0], 2.0 * e.spread[1], UP];
        let prior = e.prior();
        let score = |x: &Unknowns| {
            let dark = |p: &&&DrawnPoint| {
                e.project(&self.base_from_camera, p, x).map_or(0.0, |at| f64::from(self.dark.at(&at)))
            };
            few.iter().map(dark).sum::<f64>() / few.len() as f64
        };
        let mut best: Vec<(f64, f64, Unknowns)> = Vec::new();
        for along in steps(reach[0], STEPS[0]) {
            let mut most = (along, -1.0, prior);
            for off in steps(reach[1], STEPS[1]) {
                for up in steps(reach[2], STEPS[2]) {
                    let mut x = prior;
                    (x[0], x[1]) = (along, off);
                    // up and down is the camera's own
                    let lift = (e.world_from_base * self.base_from_camera).inverse() * nalgebra::Vector3::z() * up;
                    (x[3], x[4], x[5]) = (x[3] + lift.x, x[4] + lift.y, x[5] + lift.z);
                    let score = score(&x);
                    if score > most.1 {
                        most = (along, score, x);
                    }
                }
            }
            best.push(most);
        }
        // of places that fit alike the one that was believed comes first
        let fits = |i: usize| best[i].1 * (1.0 - LIKELY * (best[i].0 / reach[0]).powi(2));
        let mut order: Vec<usize> = (0..best.len()).collect();
        order.sort_by(|a, b| fits(*b).total_cmp(&fits(*a)));
        let peak = best.iter().map(|b| b.1).fold(0.0, f64::max);
        let mut starts: Vec<(f64, Unknowns)> = Vec::new();
        for (along, score, x) in order.into_iter().map(|i| best[i]) {
            let known = starts.iter().any(|(a, _)| (a - along).abs() < ANOTHER);
            if !known && starts.len() < STARTS && score > 0.6 * peak {
                starts.push((along, x));
            }
        }
        starts.into_iter().map(|(_, x)| x).collect()
    }
}

/// Whether an estimate tells enough, and no more than can be: `largest` are the shift (m) and the turn (rad) that are expected at most.
pub(super) fn useful(estimate: &Estimate, largest: [f64; 2]) -> Result<(), LookRefused> {
    let sd = estimate.sd_along();
    if sd > CLEAR {
        return Err(LookRefused::Unclear { sd });
    }
    let by = [estimate.x[0].hypot(estimate.x[1]), estimate.x[2].abs()];
    if by[0] > largest[0] || by[1] > largest[1] {
        return Err(LookRefused::TooFar { by });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};

    use super::*;
    use crate::math::frame_from_axes;
    use crate::mesh::TriMesh;
    use crate::robot::JointVector;
    use crate::skill::looking::CameraModel;
    use crate::skill::looking::register::{MountBelief, WallFrame};

    /// Width of a line, m.
    const WIDTH: f64 = 8e-4;

    /// A wall that faces -x at x = 3, and a camera 0.3 m before it that looks at its middle.
    struct Scene {
        wall: TriMesh,
        camera: CameraModel,
        base: Pose,
        base_from_camera: Pose,
        mount: MountBelief,
        lines: Vec<[Point3<f64>; 2]>,
    }

    impl Scene {
        fn new(lines: &[[[f64; 2]; 2]]) -> Self {
            let v = [(-1.0, 0.5), (1.0, 0.5), (1.0, 2.0), (-1.0, 2.0)].map(|(y, z)| Point3::new(3.0, y, z)).to_vec();
            let wall = TriMesh::new(v, vec![[0, 2, 1], [0, 3, 2]]).expect("a mesh");
            let base = Pose::from_parts(
                Translation3::new(2.15, 0.1, 0.0),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.02),
            );
            let eye =
                Pose::from_parts(Translation3::new(2.7, 0.0, 1.2), frame_from_axes(&Vector3::x(), &-Vector3::y()));
            Self {
                wall,
                camera: CameraModel::new([640, 480], 0.8, Pose::identity()),
                base,
                base_from_camera: base.inverse() * eye,
                mount: MountBelief::calibrated(3e-4, 8e-4),
                lines: lines.iter().map(|l| l.map(|[y, z]| Point3::new(3.0, y, z))).collect(),
            }
        }

        fn evidence(&self) -> Evidence<'_> {
            Evidence {
                camera: &self.camera,
                mount: &self.mount,
                world_from_base: self.base,
                wall: WallFrame::at(Point3::new(3.0, 0.0, 1.2), &-Vector3::x()).expect("upright"),
                spread: [5e-3, 5e-3, 5e-3],
                sightings: &[],
                felt: &[],
                canvas: &self.wall,
            }
        }

        fn drawn(&self, own: bool) -> Vec<DrawnPoint> {
            let mut points = Vec::new();
            for [a, b] in &self.lines {
                let (way, n) = (b - a, ((b - a).norm() / 1e-3) as usize);
                for i in 1..n {
                    let position = a + way * (i as f64 / n as f64);
                    points.push(DrawnPoint {
                        position,
                        along: way.normalize(),
                        normal: -Vector3::x(),
                        width: WIDTH,
                        own,
                    });
                }
            }
            points
        }

        /// What a camera sees on a base that truly stands elsewhere, with its mount off by `mount`.
        fn picture(&self, x: &Unknowns) -> Picture {
            let e = self.evidence();
            let mount = Pose::new(Vector3::new(x[3], x[4], x[5]), Vector3::new(x[6], x[7], x[8]));
            let eye = e.wall.correction(x) * self.base * self.base_from_camera * mount;
            let at = eye.translation.vector;
            let size_px = self.camera.size_px;
            let mut pixels = Vec::with_capacity(3 * size_px[0] * size_px[1]);
            for i in 0..size_px[0] * size_px[1] {
                let place = Point2::new((i % size_px[0]) as f64 + 0.5, (i / size_px[0]) as f64 + 0.5);
                let ray = eye * self.camera.ray(&place);
                let hit = Point3::from(at + ray * ((3.0 - at.x) / ray.x));
                let pixel = (3.0 - at.x) / self.camera.focal_px;
                let gap = |[a, b]: &[Point3<f64>; 2]| {
                    let t = ((hit - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    (hit - a - (b - a) * t).norm()
                };
                let gap = self.lines.iter().map(gap).fold(f64::INFINITY, f64::min);
                let cover = ((0.5 * WIDTH - gap) / pixel + 0.5).clamp(0.0, 1.0);
                pixels.extend([(200.0 * (1.0 - 0.9 * cover)).round() as u8; 3]);
            }
            Picture { size_px, pixels, q: JointVector::zeros() }
        }

        fn find(&self, picture: &Picture, own: bool) -> Result<Estimate, LookRefused> {
            let mut e = self.evidence();
            if own {
                // its wall was felt
                e.spread = [5e-3, 1.5e-4, 3e-4];
            }
            let drawn = self.drawn(own);
            let look = Look::new(picture, self.base_from_camera, &drawn, &e);
            let found = look.find(&e)?.1;
            if !own {
                useful(&found, [0.02, 0.02])?;
            }
            Ok(found)
        }
    }

    /// Lines that lean both ways, and a level one.
    fn crossing() -> Scene {
        Scene::new(&[
            [[-0.08, 1.12], [0.06, 1.28]],
            [[0.05, 1.11], [-0.05, 1.29]],
            [[-0.09, 1.2], [0.1, 1.2]],
            [[0.08, 1.15], [0.085, 1.26]],
        ])
    }

    fn unknowns(values: [f64; 9]) -> Unknowns {
        Unknowns::from_row_slice(&values)
    }

    #[test]
    fn a_base_that_is_off_is_found_to_a_tenth_of_a_millimetre() {
        let scene = crossing();
        for truth in [[0.0, 0.0, 0.0], [4e-3, -3e-3, 2e-3], [-6e-3, 5e-3, -4e-3]] {
            let x = unknowns([truth[0], truth[1], truth[2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
            let found = scene.find(&scene.picture(&x), false).expect("lines are there");
            assert!((found.x[0] - truth[0]).abs() < 1e-4, "along {} {}", found.x[0], truth[0]);
            assert!((found.x[1] - truth[1]).abs() < 6e-4, "off {} {}", found.x[1], truth[1]);
            // a turn about the vertical hardly shows in a picture, which leaves it to the pen; it makes it no worse
            let worst = truth[2].abs() + 3e-4;
            assert!((found.x[2] - truth[2]).abs() < worst, "turned {} {}", found.x[2], truth[2]);
            assert!(found.rms_px < 0.3, "{}", found.rms_px);
        }
    }

    #[test]
    fn what_a_base_has_drawn_itself_tells_how_its_camera_sits() {
        let scene = crossing();
        let x = unknowns([0.0, 0.0, 0.0, 3e-4, -2e-4, 1e-4, 5e-4, 8e-4, 4e-4]);
        let learned = scene.find(&scene.picture(&x), true).expect("lines are there").mount().expect("is regular");
        // what counts is where it puts the lines
        let e = scene.evidence();
        let known = Unknowns::from_fn(|i, _| if i < 3 { 0.0 } else { learned.mean[i - 3] });
        for p in scene.drawn(false) {
            let at = |x: &Unknowns| e.project(&scene.base_from_camera, &p, x).expect("ahead");
            assert!((at(&known) - at(&x)).norm() < 0.15, "{}", (at(&known) - at(&x)).norm());
        }
        // so a base that is off is then found better than its camera's calibration has it
        let off = unknowns([2e-3, 0.0, 0.0, x[3], x[4], x[5], x[6], x[7], x[8]]);
        let picture = scene.picture(&off);
        let before = scene.find(&picture, false).expect("lines are there").x[0];
        let after = Scene { mount: learned, ..crossing() }.find(&picture, false).expect("lines are there").x[0];
        assert!((after - 2e-3).abs() < 1e-4 && (before - 2e-3).abs() > 3e-4, "{before} {after}");
    }

    #[test]
    fn a_picture_without_lines_or_with_others_is_refused() {
        let scene = crossing();
        let nothing = unknowns([0.0; 9]);
        let bare = Scene { lines: Vec::new(), ..crossing() }.picture(&nothing);
        assert!(matches!(scene.find(&bare, false), Err(LookRefused::TooFew { .. })));
        let blank = Scene { lines: Vec::new(), ..crossing() };
        let why = blank.find(&bare, false).err();
        assert!(matches!(why, Some(LookRefused::TooFew { found: 0, wanted: 0 })), "{why:?}");
        // level lines alone don't tell where along the wall
        let level = Scene::new(&[[[-0.3, 1.15], [0.3, 1.15]], [[-0.3, 1.25], [0.3, 1.25]]]);
        let why = level.find(&level.picture(&nothing), false).err();
        assert!(matches!(why, Some(LookRefused::Unclear { sd }) if sd > 1e-3), "{why:?}");
        // upright ones 6 mm apart fit as well at the next
        let fence: Vec<[[f64; 2]; 2]> =
            (-30..=30).map(|i| [[0.006 * f64::from(i), 1.0], [0.006 * f64::from(i), 1.4]]).collect();
        let fence = Scene::new(&fence);
        let why = fence.find(&fence.picture(&nothing), false).err();
        assert!(matches!(why, Some(LookRefused::Ambiguous { apart }) if (apart - 0.006).abs() < 1.1e-3), "{why:?}");
    }

    #[test]
    fn felt_points_tell_how_far_the_wall_is_and_how_the_base_is_turned() {
        let scene = crossing();
        let truth = unknowns([0.0, -4e-3, 3e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let e = scene.evidence();
        let stood = e.wall.correction(&truth) * scene.base;
        let felt: Vec<Point3<f64>> =
            [[-0.3, 1.1], [0.3, 1.15], [0.0, 1.3]].map(|[y, z]| stood.inverse() * Point3::new(3.0, y, z)).to_vec();
        let found = Evidence { felt: &felt, spread: [1e-5, 5e-3, 5e-3], ..e }.solve(e.prior());
        assert!((found.x - truth).fixed_rows::<3>(0).amax() < 2e-5, "{}", found.x);
    }
}
