//! Where the sheet lies on a scanned canvas: what the shape shows of it, and what marks do.
use nalgebra::{
    Cholesky, Matrix3, Matrix3x6, Matrix6, Point2, Point3, SymmetricEigen, UnitQuaternion, Vector3, Vector6,
};
use rayon::prelude::*;

use super::ReconstructError;
use crate::math::Pose;
use crate::math::stats::quantile;
use crate::mesh::TriMesh;
use crate::surface::{BelievedCanvas, Canvas, Mapping, Projection, SheetFrame};

/// A motion is taken from the shape where it leads out of the surface by this share of the way that it moves its points, root mean
/// square; other motions slide along it. On a bumpy wall that is the mean slope of its bumps. Facets of a mesh of 7 mm triangles on a
/// radius of 140 mm slope by 1 to 2 %, and would tell of a turn that a smooth wall doesn't show.
const SHOWN: f64 = 0.05;
/// Gaps of this many places are thought to be independent: relief of a true canvas goes in waves of half its size.
const INDEPENDENT: f64 = 10.0;
/// Spread of the gaps before anything is known of it, and the least that is believed later on, m.
const SPREAD: [f64; 2] = [1e-3, 5e-5];
/// Points of the scanned surface that look for a partner on the nominal one.
const SAMPLES: usize = 4000;
/// How far off partners may be, m.
const REACH: f64 = 0.1;
/// Partners whose normals differ by more than this aren't the same place (cosine of 30 degrees).
const SAME_SIDE: f64 = 0.866;
/// A nominal point that is beside its partner by more than this (m), or by this share of the gap, is on a border or an edge: the
/// partner lies beyond it.
const BESIDE: [f64; 2] = [1e-3, 0.3];
/// Fewest partners that tell anything.
const FEWEST: usize = 50;
/// Least deviation of a mark that is believed, m.
const MARK_NOISE: f64 = 1e-5;
/// Rounds at most; one that moves nothing by more than [`STILL`] is the last.
const ROUNDS: usize = 40;
/// Movement that counts as none, m (and rad).
const STILL: f64 = 1e-7;

/// A mark that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Where on the sheet it is printed, m.
    pub on_sheet: Point2<f64>,
    /// Where it was found, m, world.
    pub position: Point3<f64>,
}

/// How well the place of the canvas is known before it is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Standard deviation of its middle along each axis, m. 0: it is known.
    pub shift: f64,
    /// Standard deviation of its turn about each axis through the middle, rad. 0: it is known.
    pub turn: f64,
    /// Standard deviation of a mark's measured place along each axis, m.
    pub mark_noise: f64,
}

impl Default for Placement {
    fn default() -> Self {
        Self { shift: 0.01, turn: 1f64.to_radians(), mark_noise: 3e-4 }
    }
}

impl Placement {
    fn check(&self) -> Result<(), ReconstructError> {
        let all = [("shift", self.shift), ("turn", self.turn), ("mark_noise", self.mark_noise)];
        match all.into_iter().find(|(_, value)| !(0.0..=1.0).contains(value)) {
            Some((name, value)) => Err(ReconstructError::BadOption { name, value, right: "from 0 to 1 m or rad" }),
            None => Ok(()),
        }
    }
}

/// What was found out about the sheet's place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// Of the six motions of a rigid body, how many the shape shows.
    pub shown: usize,
    /// Robust standard deviation of the scanned surface from the nominal one at the found place, m.
    pub spread: f64,
    /// Marks that were used.
    pub marks: usize,
}

/// Puts the sheet of the `nominal` canvas on a scanned one: the most probable rigid motion of the nominal canvas, about the middle of
/// its bounds, given how far the scanned surface is from its tangent planes (Y. Chen and G. Medioni,
/// doi:10.1016/0262-8856(92)90066-C), where `marks` were found, and how far it may stand off at all. The surface itself stays the
/// scanned one.
///
/// Of the motions that the shape leaves open, such as a plane's sliding on itself or a column's turn about its axis, those that lead
/// out of the surface by less than a share of 0.05 of the way are not taken from it at all: there the sheet stays at its nominal place,
/// unless marks say otherwise. Which motions those are is a matter of the nominal mesh alone: neither noise nor relief of the scan adds
/// to them. Marks say where the sheet is along itself; out of it, they say no more than the nominal shape is true.
///
/// A canvas of another size than the nominal one isn't scaled: the surface has its measured size, and a drawing keeps its own.
///
/// # Errors
/// Options out of range, and a sheet that comes out with no surface behind its centre.
pub fn locate_sheet(
    scanned: BelievedCanvas,
    nominal: &Canvas,
    marks: &[Mark],
    placement: &Placement,
) -> Result<(BelievedCanvas, Located), ReconstructError> {
    placement.check()?;
    let behind = Projection::new(nominal);
    let z = |p: &Point2<f64>| Some(behind.to_surface(p)?.position);
    let marks: Vec<Pair> =
        marks.iter().filter_map(|m| Some(Pair { nominal: z(&m.on_sheet)?, found: m.position })).collect();
    let fit = Fit::new(&scanned.mesh, nominal, marks, placement);
    let (motion, located) = fit.solve();
    let sheet = SheetFrame { world_from_sheet: motion * nominal.sheet.world_from_sheet };
    let canvas = BelievedCanvas(Canvas { sheet, ..scanned.0 });
    if Projection::new(&canvas).to_surface(&Point2::origin()).is_none() {
        return Err(ReconstructError::NoSurface);
    }
    Ok((canvas, located))
}

/// A mark where it should be, and where it is; m, world.
struct Pair {
    nominal: Point3<f64>,
    found: Point3<f64>,
}

/// A scanned point and the tangent plane of the nominal canvas, moved, that it should lie in.
struct Link {
    /// From the canvas's middle to the point, m.
    arm: Vector3<f64>,
    normal: Vector3<f64>,
    /// Height of the point over the plane, m.
    gap: f64,
}

/// A sum of squares over the motion in units of its deviations: `y' h y - 2 g' y`.
struct Squares {
    h: Matrix6<f64>,
    g: Vector6<f64>,
}

struct Fit<'a> {
    nominal: &'a TriMesh,
    middle: Point3<f64>,
    /// Out of the nominal sheet.
    outward: Vector3<f64>,
    /// Points of the scanned surface and their normals.
    points: Vec<(Point3<f64>, Vector3<f64>)>,
    marks: Vec<Pair>,
    mark_noise: f64,
    /// One standard deviation of each motion: shift of the middle (m) and turn about it (rad).
    unit: Vector6<f64>,
}

impl<'a> Fit<'a> {
    fn new(scanned: &TriMesh, nominal: &'a Canvas, marks: Vec<Pair>, placement: &Placement) -> Self {
        let (low, high) = nominal.mesh.bounds();
        let all = scanned.vertices().iter().zip(scanned.vertex_normals());
        let step = scanned.vertices().len().div_ceil(SAMPLES).max(1);
        let Placement { shift, turn, mark_noise } = *placement;
        Self {
            nominal: &nominal.mesh,
            middle: nalgebra::center(&low, &high),
            outward: nominal.sheet.world_from_sheet.rotation * Vector3::z(),
            points: all.step_by(step).map(|(p, n)| (*p, *n)).collect(),
            marks,
            mark_noise: mark_noise.max(MARK_NOISE),
            unit: Vector6::new(shift, shift, shift, turn, turn, turn),
        }
    }

    /// The motion (world) of the nominal canvas.
    fn solve(&self) -> (Pose, Located) {
        let mut y = Vector6::zeros();
        // marks first: partners on the shape are looked for from where they put it
        if !self.marks.is_empty() {
            for _ in 0..ROUNDS {
                let step = self.step(&y, self.by_marks(&y, 0.0), None);
                y += step;
                if self.unit.component_mul(&step).amax() < STILL {
                    break;
                }
            }
        }
        let mut located = Located { shown: 0, spread: 0.0, marks: self.marks.len() };
        for round in 0..ROUNDS {
            let links = self.links(&y);
            if links.len() < FEWEST {
                break;
            }
            let gaps: Vec<f64> = links.iter().map(|l| l.gap.abs()).collect();
            // 1.4826 times the median is the deviation of a normal distribution
            located.spread = (1.4826 * quantile(&gaps, 0.5).unwrap_or(0.0)).max(SPREAD[1]);
            // before the first step gaps are distances, not errors
            let (spread, limit) =
                if round == 0 { (SPREAD[0], f64::INFINITY) } else { (located.spread, 4.685 * located.spread) };
            let (shape, shown) = self.by_shape(&links, &y, limit);
            located.shown = shown;
            let marks = self.by_marks(&y, spread);
            let step = self.step(&y, marks, Some((shape, INDEPENDENT / (spread * spread))));
            y += step;
            if self.unit.component_mul(&step).amax() < STILL {
                break;
            }
        }
        (self.pose(&y), located)
    }

    /// The motion of `y` deviations.
    fn pose(&self, y: &Vector6<f64>) -> Pose {
        let x = self.unit.component_mul(y);
        let turn = UnitQuaternion::from_scaled_axis(x.fixed_rows::<3>(3).into_owned());
        let there = nalgebra::Translation3::from(self.middle.coords + x.fixed_rows::<3>(0));
        there * turn * nalgebra::Translation3::from(-self.middle.coords)
    }

    /// The way (m) that a point at `arm` from the middle goes with each motion.
    fn ways(&self, arm: &Vector3<f64>) -> Matrix3x6<f64> {
        let mut ways = Matrix3x6::zeros();
        ways.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        ways.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
        for i in 0..6 {
            ways.column_mut(i).scale_mut(self.unit[i]);
        }
        ways
    }

    /// Partners of the scanned points, in the order of the points.
    fn links(&self, y: &Vector6<f64>) -> Vec<Link> {
        let pose = self.pose(y);
        let middle = pose * self.middle;
        let link = |(p, side): &(Point3<f64>, Vector3<f64>)| {
            let q = pose.inverse_transform_point(p);
            let near = self.nominal.closest_point_within(&q, REACH)?;
            let apart = q - near.position;
            let gap = near.normal.dot(&apart);
            let beside = (apart - near.normal * gap).norm();
            let normal = pose * near.normal;
            let same = normal.dot(side) >= SAME_SIDE && beside <= BESIDE[0].max(BESIDE[1] * gap.abs());
            same.then(|| Link { arm: p - middle, normal, gap })
        };
        let found: Vec<Option<Link>> = self.points.par_iter().map(link).collect();
        found.into_iter().flatten().collect()
    }

    /// The mean of the squared gaps over the motions that the shape shows, and how many those are. Gaps beyond `limit` (m) don't count
    /// (Tukey's weight).
    fn by_shape(&self, links: &[Link], y: &Vector6<f64>, limit: f64) -> (Squares, usize) {
        let (mut out, mut all, mut g, mut sum) = (Matrix6::zeros(), Matrix6::zeros(), Vector6::zeros(), 0.0);
        for l in links {
            let u = l.gap / limit;
            if u.abs() >= 1.0 {
                continue;
            }
            let weight = (1.0 - u * u).powi(2);
            let ways = self.ways(&l.arm);
            let row = ways.transpose() * l.normal;
            out += row * row.transpose() * weight;
            all += ways.transpose() * ways * weight;
            g += row * (weight * l.gap);
            sum += weight;
        }
        let mut shape = Squares { h: Matrix6::zeros(), g: Vector6::zeros() };
        let mut shown = 0;
        if sum <= 0.0 {
            return (shape, shown);
        }
        let eigen = SymmetricEigen::new(out / sum);
        for (squared, motion) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let way = (motion.transpose() * (all / sum) * motion).x;
            if *squared > SHOWN * SHOWN * way && way > 0.0 {
                shown += 1;
                shape.h += motion * motion.transpose() * *squared;
                shape.g += motion * (motion.dot(&(g / sum)) + squared * motion.dot(y));
            }
        }
        (shape, shown)
    }

    /// The squared errors of the marks in their deviations. Out of the sheet they are as uncertain as the surface, which is `spread`
    /// (m) off the nominal one.
    fn by_marks(&self, y: &Vector6<f64>, spread: f64) -> Squares {
        let mut marks = Squares { h: Matrix6::zeros(), g: Vector6::zeros() };
        let pose = self.pose(y);
        let outward = pose * self.outward;
        let variance = self.mark_noise * self.mark_noise;
        let less = 1.0 / variance - 1.0 / (variance + spread * spread);
        let weight = Matrix3::identity() / variance - outward * outward.transpose() * less;
        for pair in &self.marks {
            let there = pose * pair.nominal;
            let ways = self.ways(&(there - pose * self.middle));
            marks.h += ways.transpose() * weight * ways;
            marks.g += ways.transpose() * weight * (pair.found - there + ways * y);
        }
        marks
    }

    /// From `y` to the least of all squares: of the marks, of the shape times its weight, and of `y` itself.
    fn step(&self, y: &Vector6<f64>, marks: Squares, shape: Option<(Squares, f64)>) -> Vector6<f64> {
        let (mut h, mut g) = (marks.h + Matrix6::identity(), marks.g);
        if let Some((shape, weight)) = shape {
            h += shape.h * weight;
            g += shape.g * weight;
        }
        // what is known beforehand makes the matrix positive definite; rounding alone could spoil that, and then nothing moves
        Cholesky::new(h).map_or_else(Vector6::zeros, |c| c.solve(&g) - y)
    }
}
