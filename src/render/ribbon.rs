//! Ink as geometry: each inked line a connected, mitred ribbon that lies on the canvas.
//!
//! The ribbon has the line's true width in metres; the shader pushes its edges out by a fraction of a pixel and gives
//! each pixel the share that the line covers, so that lines thinner than a pixel fade instead of vanishing. Within a
//! ribbon no two triangles overlap at joints (the inner edge of a bend stops at its centre of curvature), so that
//! multiplying by the ink's transmittance darkens crossings and leaves joints alone.
use bytemuck::{Pod, Zeroable};
use nalgebra::{Point3, Rotation3, Unit, Vector3};

use crate::ink::{InkPoint, InkTrace};
use crate::math::{Rgb, linear_from_srgb};

/// One edge point of a ribbon, as `shaders/ink.wgsl` reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct InkVertex {
    /// Middle of the line, m, world.
    pub position: [f32; 3],
    /// Outward unit normal of the canvas.
    pub normal: [f32; 3],
    /// Unit direction of drawing; at an end, pointing out of the line.
    pub tangent: [f32; 3],
    /// Direction to this edge, as long as the mitre is for each metre off the middle.
    pub edge: [f32; 3],
    /// Half width (m), share of it at this edge (signed), distance beyond the end (m).
    pub shape: [f32; 3],
    /// Optical density of each channel, natural logarithm.
    pub absorb: [f32; 3],
}

/// Ribbons ready to be drawn. Independent of the camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ribbons {
    pub(super) vertices: Vec<InkVertex>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Bends sharper than this get a rounded outer edge, rad.
const ROUND_FROM: f64 = 0.35;
/// Largest distance from the drawn line that thinning may cause, as a share of its width.
const THINNING: f64 = 0.04;
/// The same, m, which keeps chords of wide lines from diving into a curved canvas.
const THINNING_MOST: f64 = 5e-5;
/// Least cosine between the canvas normals at both ends of a segment.
const LEAST_COSINE: f64 = 0.996;

/// A point of a line after thinning.
#[derive(Clone, Copy)]
struct Knot {
    at: Point3<f64>,
    normal: Vector3<f64>,
    half: f64,
    density: f64,
}

impl Ribbons {
    /// Everything in a trace that was drawn up to time `until` (s), or all of it.
    pub fn from_trace(trace: &InkTrace, until: Option<f64>) -> Self {
        let mut ribbons = Ribbons::default();
        for stroke in &trace.strokes {
            let color = trace.inks.get(stroke.ink as usize).map_or(Rgb([0, 0, 0]), |i| i.color);
            let drawn = until.map_or(stroke.points.len(), |t| stroke.points.partition_point(|p| p.time <= t));
            ribbons.add(&stroke.points[..drawn], color);
        }
        ribbons
    }

    /// Adds one unbroken line of an ink that looks like `color` (sRGB, on white paper) where its density is 1.
    ///
    /// Points that aren't finite or have no width are left out; one point becomes a dot.
    pub fn add(&mut self, points: &[InkPoint], color: Rgb) {
        let absorb = absorbance(color);
        let knots = thinned(points);
        let (Some(first), Some(last)) = (knots.first(), knots.last()) else { return };
        if knots.len() == 1 {
            let tangent = any_tangent(&first.normal);
            let start =
                self.section(first, -tangent, [first.normal.cross(&tangent); 2], [1.0, -1.0], first.half, absorb);
            let middle = self.section(first, tangent, [first.normal.cross(&tangent); 2], [1.0, -1.0], 0.0, absorb);
            let end = self.section(first, tangent, [first.normal.cross(&tangent); 2], [1.0, -1.0], first.half, absorb);
            self.join(start, middle);
            self.join(middle, end);
            return;
        }
        let steps: Vec<(Vector3<f64>, f64)> = knots
            .windows(2)
            .map(|w| {
                let step = w[1].at - w[0].at;
                (step.normalize(), step.norm())
            })
            .collect();
        let left = |normal: &Vector3<f64>, tangent: &Vector3<f64>| {
            normal.cross(tangent).try_normalize(1e-9).unwrap_or_else(|| any_tangent(normal))
        };
        let tangent = steps[0].0;
        let side = left(&first.normal, &tangent);
        // the cap's sides keep their hand: seen along the line, left stays left
        let cap = self.section(first, -tangent, [side; 2], [1.0, -1.0], first.half, absorb);
        let mut before = self.section(first, tangent, [side; 2], [1.0, -1.0], 0.0, absorb);
        self.join(cap, before);
        for (i, knot) in knots.iter().enumerate().take(knots.len() - 1).skip(1) {
            let ((t0, l0), (t1, l1)) = (steps[i - 1], steps[i]);
            let (s0, s1) = (left(&knot.normal, &t0), left(&knot.normal, &t1));
            let bend = s0.cross(&s1).dot(&knot.normal).atan2(s0.dot(&s1));
            let half_bend = 0.5 * bend;
            // +1 where the line bends to the left, whose edge is then the inner one
            let hand = if bend >= 0.0 { 1.0 } else { -1.0 };
            let mitre = (s0 + s1).try_normalize(1e-6).map_or(-t0 * hand, |m| m) / half_bend.cos().max(0.2);
            let room = l0.min(l1) / (knot.half * half_bend.tan().abs().max(1e-9));
            let inner = room.min(1.0);
            let turns = if bend.abs() < ROUND_FROM { 0 } else { (bend.abs() / ROUND_FROM).ceil() as u32 };
            for k in 0..=turns {
                let (outer, tangent) = if turns == 0 {
                    (mitre, t0 + t1)
                } else {
                    let turn = Rotation3::from_axis_angle(
                        &Unit::new_normalize(knot.normal),
                        bend * f64::from(k) / f64::from(turns),
                    );
                    (turn * s0, turn * t0)
                };
                let tangent = tangent.try_normalize(1e-9).unwrap_or(t0);
                let (edges, shares) =
                    if hand > 0.0 { ([mitre, outer], [inner, -1.0]) } else { ([outer, mitre], [1.0, -inner]) };
                let here = self.section(knot, tangent, edges, shares, 0.0, absorb);
                self.join(before, here);
                before = here;
            }
        }
        let tangent = steps[steps.len() - 1].0;
        let side = left(&last.normal, &tangent);
        let end = self.section(last, tangent, [side; 2], [1.0, -1.0], 0.0, absorb);
        let cap = self.section(last, tangent, [side; 2], [1.0, -1.0], last.half, absorb);
        self.join(before, end);
        self.join(end, cap);
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Adds the left and right edge of a cross-section and returns the index of the left one.
    fn section(
        &mut self,
        knot: &Knot,
        tangent: Vector3<f64>,
        edges: [Vector3<f64>; 2],
        shares: [f64; 2],
        beyond: f64,
        absorb: [f64; 3],
    ) -> u32 {
        let index = self.vertices.len() as u32;
        let f = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        for (edge, share) in edges.iter().zip(shares) {
            self.vertices.push(InkVertex {
                position: f(&knot.at.coords),
                normal: f(&knot.normal),
                tangent: f(&tangent),
                edge: f(&(edge * share.signum())),
                shape: [knot.half as f32, share as f32, beyond as f32],
                absorb: absorb.map(|a| (a * knot.density) as f32),
            });
        }
        index
    }

    fn join(&mut self, before: u32, after: u32) {
        self.triangles.push([before, before + 1, after]);
        self.triangles.push([before + 1, after + 1, after]);
    }
}

/// Optical density (natural logarithm) that turns white paper into a colour, for each channel.
fn absorbance(color: Rgb) -> [f64; 3] {
    color.0.map(|c| -linear_from_srgb(c).max(0.004).ln())
}

fn any_tangent(normal: &Vector3<f64>) -> Vector3<f64> {
    let other = if normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    normal.cross(&other).normalize()
}

/// The points worth keeping: those without which the line, its width or its density would visibly change.
fn thinned(points: &[InkPoint]) -> Vec<Knot> {
    let mut all: Vec<Knot> = Vec::with_capacity(points.len());
    for p in points {
        let finite = p.position.iter().chain(p.normal.iter()).all(|c| c.is_finite());
        let Some(normal) = p.normal.try_normalize(1e-9) else { continue };
        if !(finite && p.width > 0.0 && p.width.is_finite() && p.density > 0.0 && p.density.is_finite()) {
            continue;
        }
        let knot = Knot { at: p.position, normal, half: 0.5 * p.width, density: p.density };
        if all.last().is_none_or(|last| (last.at - knot.at).norm() > 1e-3 * p.width) {
            all.push(knot);
        }
    }
    // Ramer-Douglas-Peucker with an explicit stack: halves of spans wait on it, the earlier on top
    let mut kept: Vec<Knot> = all.first().copied().into_iter().collect();
    let mut spans = if all.len() > 1 { vec![(0, all.len() - 1)] } else { Vec::new() };
    while let Some((from, to)) = spans.pop() {
        match worst(&all[from..=to]) {
            Some(k) => spans.extend([(from + k, to), (from, from + k)]),
            None => kept.push(all[to]),
        }
    }
    kept
}

/// The knot for which the straight segment from the first to the last stands least well, when it is too bad there.
fn worst(knots: &[Knot]) -> Option<usize> {
    let (a, b) = (knots[0], knots[knots.len() - 1]);
    let chord = b.at - a.at;
    let length2 = chord.norm_squared();
    let bent = a.normal.dot(&b.normal) < LEAST_COSINE;
    let badness = |k: &Knot| {
        let s = if length2 > 0.0 { ((k.at - a.at).dot(&chord) / length2).clamp(0.0, 1.0) } else { 0.0 };
        let off = (k.at - a.at - chord * s).norm() / (2.0 * THINNING * k.half).min(THINNING_MOST);
        let half = a.half + (b.half - a.half) * s;
        let density = a.density + (b.density - a.density) * s;
        let width = (half - k.half).abs() / (THINNING * k.half);
        off.max(width).max((density - k.density).abs() / (THINNING * k.density.max(0.25)))
    };
    let inner = knots.iter().enumerate().take(knots.len() - 1).skip(1);
    let worst = inner.map(|(i, k)| (i, badness(k))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    if worst.1 > 1.0 { Some(worst.0) } else { bent.then_some(knots.len() / 2) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use proptest::prelude::*;

    fn point(x: f64, y: f64, width: f64) -> InkPoint {
        InkPoint {
            position: Point3::new(x, y, 0.0),
            normal: Vector3::z(),
            sheet: Point2::new(x, y),
            width,
            density: 1.0,
            time: 0.0,
        }
    }

    /// Area of a ribbon at its true width, negative parts counted against it.
    fn area(r: &Ribbons) -> (f64, f64) {
        let at = |i: u32| {
            let v = &r.vertices[i as usize];
            let place = |k: usize| {
                let out = v.edge[k] * v.shape[0] * v.shape[1].abs() + v.tangent[k] * v.shape[2];
                f64::from(v.position[k] + out)
            };
            Vector3::new(place(0), place(1), place(2))
        };
        let signed = |t: &[u32; 3]| 0.5 * (at(t[1]) - at(t[0])).cross(&(at(t[2]) - at(t[0]))).z;
        let (mut plus, mut minus) = (0.0, 0.0);
        for t in &r.triangles {
            let a = signed(t);
            if a > 0.0 { plus += a } else { minus -= a }
        }
        (plus, minus)
    }

    #[test]
    fn a_straight_line_is_one_rectangle_and_two_caps() {
        let mut r = Ribbons::default();
        let points: Vec<InkPoint> = (0..=1000).map(|i| point(f64::from(i) * 1e-4, 0.0, 0.001)).collect();
        r.add(&points, Rgb([0, 0, 0]));
        assert!(r.triangle_count() < 60, "{}", r.triangle_count());
        let (plus, minus) = area(&r);
        assert!((plus - 0.1 * 0.001 - 0.001 * 0.001).abs() < 1e-8 && minus < 1e-10, "{plus} {minus}");
    }

    #[test]
    fn joints_do_not_overlap() {
        // the outline of a zigzag and of a tight arc is covered once: the sum of the triangles is their area
        for bend_deg in [-140.0, -90.0, -30.0, -5.0, 5.0, 45.0, 90.0, 120.0f64] {
            let (s, c) = bend_deg.to_radians().sin_cos();
            let mut points: Vec<InkPoint> = (0..=100).map(|i| point(f64::from(i) * 1e-4, 0.0, 0.002)).collect();
            points.extend((1..=100).map(|i| point(0.01 + f64::from(i) * 1e-4 * c, f64::from(i) * 1e-4 * s, 0.002)));
            let mut r = Ribbons::default();
            r.add(&points, Rgb([0, 0, 0]));
            let (plus, minus) = area(&r);
            // two bars less the shared kite, with a round or mitred outer corner, and square caps
            let half = 0.001;
            let kite = half * half * (0.5 * bend_deg.to_radians().abs()).tan();
            let wedge = 0.5 * half * half * bend_deg.to_radians().abs();
            let desired = 2.0 * 0.01 * 0.002 - kite + wedge + 2.0 * half * 0.002;
            assert!((plus / desired - 1.0).abs() < 0.02, "{bend_deg}: {plus} for {desired}");
            assert!(minus < 0.01 * desired, "{bend_deg}: {minus}");
        }
    }

    #[test]
    fn ink_later_than_asked_is_not_there() {
        let mut late = point(0.1, 0.0, 0.001);
        late.time = 2.0;
        let stroke = crate::ink::InkStroke { ink: 0, stroke: None, arm: 0, points: vec![point(0.0, 0.0, 0.001), late] };
        let trace = InkTrace { inks: vec![], strokes: vec![stroke] };
        let reach =
            |until| Ribbons::from_trace(&trace, until).vertices.iter().map(|v| v.position[0]).fold(0.0, f32::max);
        assert_eq!(reach(Some(1.0)), 0.0);
        assert_eq!(reach(None), 0.1);
    }

    proptest! {
        #[test]
        fn any_points_give_finite_ribbons(values in prop::collection::vec((any::<f64>(), -0.1..0.1f64, any::<f32>()), 0..40)) {
            let points: Vec<InkPoint> = values.iter().map(|(x, y, w)| point(*x, *y, f64::from(*w))).collect();
            let mut r = Ribbons::default();
            r.add(&points, Rgb([10, 20, 30]));
            for t in &r.triangles {
                prop_assert!(t.iter().all(|i| (*i as usize) < r.vertices.len()));
            }
            let small: Vec<InkPoint> = values.iter().map(|(x, y, _)| point(x.sin() * 0.1, *y, 0.001)).filter(|p| p.position.x.is_finite()).collect();
            let mut r = Ribbons::default();
            r.add(&small, Rgb([10, 20, 30]));
            prop_assert!(r.vertices.iter().all(|v| bytemuck::cast_slice::<_, f32>(&[*v]).iter().all(|x| x.is_finite())));
        }
    }
}
