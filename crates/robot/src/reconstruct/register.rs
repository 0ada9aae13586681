//! Views moved onto each other: point-to-plane registration of all of them at once.
use nalgebra::{DMatrix, DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;

use super::cloud::Cloud;
use super::kdtree::KdTree;
use super::normals::normals;

/// Rounds at most; a round that moves nothing by more than [`STILL`] is the last.
const ROUNDS: usize = 15;
/// Movement that counts as none, m (and rad).
const STILL: f64 = 2e-6;
/// Points of each view that look for a partner.
const SAMPLES: usize = 4000;
/// Partners whose normals differ by more than this don't see the same surface (cosine of 30 degrees).
const SAME_SIDE: f64 = 0.866;
/// Points that one independent measurement is shared by: neighbours in a depth image err alike.
const ALIKE: f64 = 20.0;

/// How well the poses of the views are known.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Standard deviation of a camera's place along each axis, m.
    pub distance: f64,
    /// Standard deviation of its angle about each axis, rad.
    pub angle: f64,
}

/// Movements (world) that bring `views`, taken from `eyes`, onto each other: the most probable ones, given how far the points are
/// from the tangent planes of the other views' points (Y. Chen and G. Medioni, doi:10.1016/0262-8856(92)90066-C) and how far the
/// cameras may be from where they should be. Where shapes leave a motion open - a plane slides on itself - the prior closes it,
/// and it spreads what all views share evenly over them.
///
/// `reach` (m) is how far apart two views of one place may be, `radius` (m) the size of the neighbourhoods of their normals.
pub(super) fn register(
    views: &[Cloud],
    eyes: &[Point3<f64>],
    prior: Prior,
    reach: f64,
    radius: f64,
) -> Vec<Isometry3<f64>> {
    let n = views.len();
    let mut moves = vec![Isometry3::identity(); n];
    if n < 2 || prior.distance <= 0.0 && prior.angle <= 0.0 {
        return moves;
    }
    let trees: Vec<KdTree> = views.iter().map(|v| KdTree::new(&v.points)).collect();
    let planes: Vec<Vec<Vector3<f64>>> = views.iter().zip(&trees).map(|(v, t)| normals(v, t, radius)).collect();
    let pairs: Vec<(usize, usize)> =
        (0..n).flat_map(|a| (0..n).filter(move |b| *b != a).map(move |b| (a, b))).collect();
    for _ in 0..ROUNDS {
        let found: Vec<Vec<Link>> = pairs
            .par_iter()
            .map(|&(a, b)| {
                let step = views[a].len().div_ceil(SAMPLES).max(1);
                let b_from_world = moves[b].inverse();
                let link = |i: usize| {
                    let p = moves[a] * views[a].points[i];
                    let (j, _) = trees[b].nearest(&(b_from_world * p), reach)?;
                    let normal = moves[b] * planes[b][j];
                    let same = normal.dot(&(moves[a] * planes[a][i])) >= SAME_SIDE;
                    same.then(|| Link {
                        from: a,
                        to: b,
                        p,
                        normal,
                        gap: normal.dot(&(p - moves[b] * views[b].points[j])),
                    })
                };
                (0..views[a].len()).step_by(step).filter_map(link).collect()
            })
            .collect();
        let links: Vec<Link> = found.into_iter().flatten().collect();
        if links.is_empty() {
            break;
        }
        let step = solve(&links, &moves, eyes, prior);
        let mut largest = 0.0f64;
        for (v, pose) in moves.iter_mut().enumerate() {
            let d = Vector6::from_fn(|i, _| step[6 * v + i]);
            largest = largest.max(d.amax());
            *pose = about(&eyes[v], &d) * *pose;
        }
        if largest < STILL {
            break;
        }
    }
    moves
}

/// A point of one view and the tangent plane of another that it should lie in.
struct Link {
    from: usize,
    to: usize,
    p: Point3<f64>,
    normal: Vector3<f64>,
    /// Height of the point over the plane, m.
    gap: f64,
}

/// A small motion (shift m, turn rad) about a camera's eye.
fn about(eye: &Point3<f64>, motion: &Vector6<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(motion.fixed_rows::<3>(3).into_owned());
    let shift = Translation3::from(motion.fixed_rows::<3>(0).into_owned());
    let eye = Translation3::from(eye.coords);
    eye * shift * turn * eye.inverse()
}

/// One step of Gauss and Newton over the motions (shift, turn about the eye) of all views.
fn solve(links: &[Link], moves: &[Isometry3<f64>], eyes: &[Point3<f64>], prior: Prior) -> DVector<f64> {
    let mut gaps: Vec<f64> = links.iter().map(|l| l.gap.abs()).collect();
    gaps.sort_by(f64::total_cmp);
    // 1.4826 times the median is the deviation of a normal distribution
    let deviation = (1.4826 * gaps[gaps.len() / 2]).max(1e-6);
    let size = 6 * moves.len();
    let mut h = DMatrix::zeros(size, size);
    let mut g = DVector::zeros(size);
    for l in links {
        // Tukey's weight: partners far out of the noise don't belong together
        let u = l.gap / (4.685 * deviation);
        if u.abs() >= 1.0 {
            continue;
        }
        let weight = (1.0 - u * u).powi(2) / (deviation * deviation * ALIKE);
        let row = |eye: &Point3<f64>| {
            let turn = (l.p - eye).cross(&l.normal);
            Vector6::new(l.normal.x, l.normal.y, l.normal.z, turn.x, turn.y, turn.z)
        };
        let (ja, jb) = (row(&eyes[l.from]), -row(&eyes[l.to]));
        let parts = [(6 * l.from, &ja), (6 * l.to, &jb)];
        for (a, ja) in parts {
            for i in 0..6 {
                g[a + i] -= weight * l.gap * ja[i];
                for (b, jb) in parts {
                    for j in 0..6 {
                        h[(a + i, b + j)] += weight * ja[i] * jb[j];
                    }
                }
            }
        }
    }
    // an exactly known pose still needs a finite weight
    let stiff = |deviation: f64, least: f64| deviation.max(least).powi(-2);
    for (v, pose) in moves.iter().enumerate() {
        let shift = pose * eyes[v] - eyes[v];
        let turn = crate::math::rotation_vector(&pose.rotation);
        for i in 0..3 {
            let (along, round) = (stiff(prior.distance, 1e-7), stiff(prior.angle, 1e-7));
            h[(6 * v + i, 6 * v + i)] += along;
            g[6 * v + i] -= along * shift[i];
            h[(6 * v + 3 + i, 6 * v + 3 + i)] += round;
            g[6 * v + 3 + i] -= round * turn[i];
        }
    }
    // the prior makes the matrix positive definite; rounding alone could spoil that, and then nothing moves
    nalgebra::Cholesky::new(h).map_or_else(|| DVector::zeros(size), |c| c.solve(&g))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bumpy patch, 0.3 m a side.
    fn patch() -> Cloud {
        let mut cloud = Cloud::default();
        for (i, j) in (0..100).flat_map(|i| (0..100).map(move |j| (i, j))) {
            let (x, y) = (f64::from(i) * 0.003 - 0.15, f64::from(j) * 0.003 - 0.15);
            let z = 0.02 * (x * 25.0).sin() * (y * 21.0).cos() + 0.6 * x * x;
            cloud.push(Point3::new(x, y, z), Vector3::z(), 1.0);
        }
        cloud
    }

    fn moved(cloud: &Cloud, pose: &Isometry3<f64>) -> Cloud {
        Cloud { points: cloud.points.iter().map(|p| pose * p).collect(), ..cloud.clone() }
    }

    #[test]
    fn views_come_together_halfway() {
        let eyes = [Point3::new(0.0, 0.0, 0.7), Point3::new(0.3, 0.0, 0.6)];
        let motion = Vector6::new(0.001, -0.0015, 0.002, 0.003, -0.002, 0.004);
        let off = about(&eyes[1], &motion);
        let views = [patch(), moved(&patch(), &off)];
        let prior = Prior { distance: 2e-3, angle: 4e-3 };
        let moves = register(&views, &eyes, prior, 0.02, 0.009);
        let gap = |pose: &Isometry3<f64>| {
            let differs = |p: &Point3<f64>| (moves[0] * p - pose * (off * p)).norm();
            patch().points.iter().map(differs).fold(0.0, f64::max)
        };
        assert!(gap(&Isometry3::identity()) > 5e-4);
        assert!(gap(&moves[1]) < 2e-4, "{}", gap(&moves[1]));
        // neither view is better known than the other, so both move
        let share = (moves[0] * Point3::origin() - Point3::origin()).norm();
        assert!(share > 5e-4, "{share}");
    }

    #[test]
    fn well_known_poses_stay() {
        let eyes = [Point3::new(0.0, 0.0, 0.7); 2];
        let views = [patch(), moved(&patch(), &Isometry3::translation(0.0, 0.0, 1e-3))];
        let moves = register(&views, &eyes, Prior { distance: 0.0, angle: 0.0 }, 0.02, 0.009);
        assert_eq!(moves, [Isometry3::identity(); 2]);
    }
}
