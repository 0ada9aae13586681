//! Touched heights over a plane: a quadtree that only grows, and the surface that it suggests.
//!
//! Key is the place on the plane, value the height over it (section V.A.1 of the dissertation). As there, a height in between is
//! bilinear in a quad of four touched places, one from each quadrant around. Two things are added: a smooth surface of
//! low order, fitted to all touches, is taken out first, so that only what is left is interpolated bilinearly and few touches already
//! tell a curved wall; and where no quad encloses a place, what is left fades with distance instead of being extrapolated.
use nalgebra::{Point2, SMatrix, SVector};

/// A touched place: where on the plane, m, and how high, m.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Touch {
    /// Place on the plane, m.
    pub at: Point2<f64>,
    /// Height over the plane, m.
    pub height: f64,
}

/// Terms of a polynomial of order 4 in two variables.
const TERMS: usize = 15;
/// Expected size of a term over the extent, by its order, m: what is known before anything is touched.
const PRIOR: [f64; 5] = [10.0, 10.0, 0.1, 0.004, 0.004];
/// How far single touches stray from such a surface, m.
const STRAY: f64 = 2e-4;
/// Distance over which what is left of the trend fades outside of all quads, m.
const FADE: f64 = 0.02;
/// Deepest level of the tree: 1 m split 20 times is 1 um.
const DEEPEST: u32 = 20;

/// One square, its touch, and the four squares in it.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Node {
    center: Point2<f64>,
    half: f64,
    touch: Touch,
    children: [Option<u32>; 4],
}

/// Touched heights, at most one in a circle of the spacing's radius.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct HeightTree {
    center: Point2<f64>,
    half: f64,
    spacing: f64,
    nodes: Vec<Node>,
}

/// Which quadrant around `center` holds `p`: bit 0 right, bit 1 up.
fn quadrant(center: &Point2<f64>, p: &Point2<f64>) -> usize {
    usize::from(p.x >= center.x) | usize::from(p.y >= center.y) << 1
}

impl HeightTree {
    /// An empty tree over the square around `center` with sides of `2 half` (m) that keeps touches at least `spacing` (m) apart.
    pub fn new(center: Point2<f64>, half: f64, spacing: f64) -> Self {
        Self { center, half, spacing, nodes: Vec::new() }
    }

    /// Touches held.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Nothing has been touched.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// All touches, in the order learned.
    pub fn touches(&self) -> impl Iterator<Item = &Touch> {
        self.nodes.iter().map(|n| &n.touch)
    }

    /// Learns a touch. Returns false, and learns nothing, of one that isn't finite, lies outside the square, or is nearer to another
    /// than the spacing.
    pub fn insert(&mut self, touch: Touch) -> bool {
        let from = touch.at - self.center;
        // not a number is never within
        let inside = from.x.abs() <= self.half && from.y.abs() <= self.half && touch.height.is_finite();
        if !inside || self.nearest(&touch.at).is_some_and(|(_, gap)| gap < self.spacing) {
            return false;
        }
        let (mut center, mut half, mut parent) = (self.center, self.half, None);
        let mut next = if self.nodes.is_empty() { None } else { Some(0u32) };
        let mut depth = 0;
        while let Some(i) = next {
            if depth == DEEPEST {
                return false;
            }
            depth += 1;
            let node = &self.nodes[i as usize];
            let q = quadrant(&node.center, &touch.at);
            half = 0.5 * node.half;
            let side = |bit: usize| if q & bit == 0 { -half } else { half };
            center = Point2::new(node.center.x + side(1), node.center.y + side(2));
            parent = Some((i as usize, q));
            next = node.children[q];
        }
        if let Some((parent, q)) = parent {
            self.nodes[parent].children[q] = Some(self.nodes.len() as u32);
        }
        self.nodes.push(Node { center, half, touch, children: [None; 4] });
        true
    }

    /// The nearest touch, and how far it is, m.
    pub fn nearest(&self, at: &Point2<f64>) -> Option<(Touch, f64)> {
        self.best(at, |_| true).map(|(i, d2)| (self.nodes[i].touch, d2.sqrt()))
    }

    /// The nearest touch that `wanted` takes, and its squared distance, m2.
    fn best(&self, at: &Point2<f64>, wanted: impl Fn(&Point2<f64>) -> bool) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        let mut open = Vec::with_capacity(32);
        if !self.nodes.is_empty() {
            open.push(0u32);
        }
        while let Some(i) = open.pop() {
            let node = &self.nodes[i as usize];
            let gap = |x: f64, c: f64| ((x - c).abs() - node.half).max(0.0);
            let outside = gap(at.x, node.center.x).powi(2) + gap(at.y, node.center.y).powi(2);
            if best.is_some_and(|(_, d2)| outside > d2) {
                continue;
            }
            let d2 = (node.touch.at - at).norm_squared();
            // of two as near, the one learned first, in whichever order they are met
            let nearer = |(b, b2): (usize, f64)| d2 < b2 || (d2 == b2 && (i as usize) < b);
            if wanted(&node.touch.at) && best.is_none_or(nearer) {
                best = Some((i as usize, d2));
            }
            // the quadrant of the place itself is looked at first
            let own = quadrant(&node.center, at);
            open.extend([3, 2, 1].iter().filter_map(|k| node.children[own ^ k]));
            open.extend(node.children[own]);
        }
        best
    }

    /// The nearest touch in each quadrant around `at`, counter-clockwise from lower left.
    fn around(&self, at: &Point2<f64>) -> [Option<Touch>; 4] {
        [0, 1, 3, 2].map(|q| self.best(at, |p| quadrant(at, p) == q).map(|(i, _)| self.nodes[i].touch))
    }

    /// The surface that the touches suggest now.
    pub fn surface(&self) -> TouchedSurface<'_> {
        let mut a = SMatrix::<f64, TERMS, TERMS>::zeros();
        let mut b = SVector::<f64, TERMS>::zeros();
        for (k, (i, j)) in orders().enumerate() {
            a[(k, k)] = (STRAY / PRIOR[i + j]).powi(2);
        }
        // heights are counted from their mean: the prior knows no level
        let mean = self.touches().map(|t| t.height).sum::<f64>() / self.len().max(1) as f64;
        for t in self.touches() {
            let f = self.terms(&t.at);
            a += f * f.transpose();
            b += f * (t.height - mean);
        }
        // the prior makes it positive definite
        let mut trend = a.cholesky().map_or_else(SVector::zeros, |c| c.solve(&b));
        trend[0] += mean;
        TouchedSurface { tree: self, trend }
    }

    /// Terms of the trend at a place.
    fn terms(&self, at: &Point2<f64>) -> SVector<f64, TERMS> {
        let p = (at - self.center) / self.half;
        SVector::from_iterator(orders().map(|(i, j)| p.x.powi(i as i32) * p.y.powi(j as i32)))
    }
}

/// Exponents of x and y of the trend's terms.
fn orders() -> impl Iterator<Item = (usize, usize)> {
    (0..=4).flat_map(|n| (0..=n).map(move |j| (n - j, j)))
}

/// Heights between touches.
#[derive(Clone, Debug)]
pub struct TouchedSurface<'a> {
    tree: &'a HeightTree,
    trend: SVector<f64, TERMS>,
}

impl TouchedSurface<'_> {
    /// The height over the plane at `at`, m; 0 everywhere when nothing has been touched.
    pub fn height(&self, at: &Point2<f64>) -> f64 {
        self.smooth(at) + self.left(at)
    }

    /// The trend alone, m.
    pub fn smooth(&self, at: &Point2<f64>) -> f64 {
        self.trend.dot(&self.tree.terms(at))
    }

    /// What touches have left of the trend at `at`, m.
    fn left(&self, at: &Point2<f64>) -> f64 {
        let around = self.tree.around(at);
        let left = |t: &Touch| t.height - self.smooth(&t.at);
        if let [Some(a), Some(b), Some(c), Some(d)] = around {
            let corners = [a, b, c, d];
            if let Some([u, v]) = unit_place(&corners.map(|t| t.at), at) {
                let [a, b, c, d] = corners.map(|t| left(&t));
                return (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * d + u * c);
            }
        }
        let (mut sum, mut weights, mut nearest) = (0.0, 0.0, f64::INFINITY);
        for t in around.iter().flatten() {
            let d2 = (t.at - at).norm_squared();
            let weight = 1.0 / (d2 + 1e-12);
            sum += weight * left(t);
            weights += weight;
            nearest = nearest.min(d2.sqrt());
        }
        if weights > 0.0 { sum / weights * (-nearest / FADE).exp() } else { 0.0 }
    }
}

/// Where in the unit square a place of the quad `corners` (counter-clockwise) lies: the inverse of a bilinear map. `None` outside,
/// and where the quad is folded or flat.
fn unit_place(corners: &[Point2<f64>; 4], at: &Point2<f64>) -> Option<[f64; 2]> {
    const SLACK: f64 = 1e-9;
    let [a, b, c, d] = corners;
    let (e, f, g, h) = (b - a, d - a, (a - b) + (c - d), at - a);
    // at = a + u e + v f + u v g: v solves k2 v^2 + k1 v + k0 = 0
    let (k2, k1, k0) = (g.perp(&f), e.perp(&f) + h.perp(&g), h.perp(&e));
    let scale = e.perp(&f).abs().max(g.perp(&f).abs());
    if scale.is_nan() || scale < 1e-16 {
        return None;
    }
    let roots = if k2.abs() < 1e-9 * k1.abs() {
        [-k0 / k1, f64::NAN]
    } else {
        let root = (k1 * k1 - 4.0 * k2 * k0).sqrt();
        // the numerically sound pair of roots
        let half = -0.5 * (k1 + root.copysign(k1));
        [half / k2, k0 / half]
    };
    let inside = |x: f64| (-SLACK..=1.0 + SLACK).contains(&x);
    roots.into_iter().filter(|v| inside(*v)).find_map(|v| {
        let along = e + g * v;
        let u = (h - f * v).dot(&along) / along.norm_squared();
        // a NaN of a square without width is outside too
        inside(u).then(|| [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tree(touches: impl IntoIterator<Item = (f64, f64, f64)>) -> HeightTree {
        let mut tree = HeightTree::new(Point2::origin(), 0.2, 1e-4);
        for (x, y, height) in touches {
            tree.insert(Touch { at: Point2::new(x, y), height });
        }
        tree
    }

    fn place() -> impl Strategy<Value = (f64, f64)> {
        (-0.15..0.15f64, -0.15..0.15f64)
    }

    proptest! {
        #[test]
        fn a_plane_is_reproduced(
            places in proptest::collection::vec(place(), 3..60), at in place(),
            (a, b, c) in (-0.05..0.05f64, -0.5..0.5f64, -0.5..0.5f64),
        ) {
            let plane = |(x, y): (f64, f64)| a + b * x + c * y;
            let tree = tree(places.iter().map(|p| (p.0, p.1, plane(*p))));
            let q = places[0];
            let pairs = places.iter().flat_map(|p| places.iter().map(move |r| (p, r)));
            let spans = pairs.map(|(p, r)| ((p.0 - q.0) * (r.1 - q.1) - (p.1 - q.1) * (r.0 - q.0)).abs());
            let widest = spans.fold(0.0, f64::max);
            prop_assume!(widest > 5e-3);
            let error = tree.surface().height(&Point2::new(at.0, at.1)) - plane(at);
            // three places in a triangle not too thin tell a plane far from them by some hundred times what they were smoothed by; in
            // thinner ones by more, as the square of how thin
            prop_assert!(error.abs() < 1e-4 * f64::max(1.0, (1e-2 / widest).powi(2)), "{error} {widest}");
        }

        #[test]
        fn nearest_touches_are_those_of_a_plain_search(places in proptest::collection::vec(place(), 1..80), at in place()) {
            let tree = tree(places.iter().map(|p| (p.0, p.1, 0.0)));
            let at = Point2::new(at.0, at.1);
            for (slot, q) in [0usize, 1, 3, 2].into_iter().enumerate() {
                let plain = tree.touches().filter(|t| quadrant(&at, &t.at) == q).map(|t| (t.at - at).norm());
                let plain = plain.fold(f64::INFINITY, f64::min);
                let found = tree.around(&at)[slot].map_or(f64::INFINITY, |t| (t.at - at).norm());
                prop_assert!(found == plain);
            }
        }

        #[test]
        fn order_of_learning_makes_no_difference(places in proptest::collection::vec((place(), -0.01..0.01f64), 1..40), at in place()) {
            let far = |p: &((f64, f64), f64), q: &((f64, f64), f64)| (p.0.0 - q.0.0).hypot(p.0.1 - q.0.1) > 2e-4;
            prop_assume!((0..places.len()).all(|i| (0..i).all(|j| far(&places[i], &places[j]))));
            let flat = |p: &((f64, f64), f64)| (p.0.0, p.0.1, p.1);
            let (one, other) = (tree(places.iter().map(flat)), tree(places.iter().rev().map(flat)));
            let at = Point2::new(at.0, at.1);
            prop_assert!((one.surface().height(&at) - other.surface().height(&at)).abs() < 1e-7);
        }

        #[test]
        fn heights_are_finite_and_touches_are_met(places in proptest::collection::vec((place(), -0.02..0.02f64), 0..60), at in place()) {
            let tree = tree(places.iter().map(|p| (p.0.0, p.0.1, p.1)));
            let surface = tree.surface();
            prop_assert!(surface.height(&Point2::new(at.0, at.1)).is_finite());
            for t in tree.touches() {
                prop_assert!(surface.height(&t.at).is_finite());
            }
        }

        #[test]
        fn the_unit_square_and_the_quad_are_inverse(
            bend in proptest::collection::vec(-0.3..0.3f64, 8), u in 0.02..0.98f64, v in 0.02..0.98f64,
        ) {
            let corner = |k: usize, x: f64, y: f64| Point2::new(x + bend[2 * k], y + bend[2 * k + 1]);
            let quad = [corner(0, 0.0, 0.0), corner(1, 1.0, 0.0), corner(2, 1.0, 1.0), corner(3, 0.0, 1.0)];
            let [a, b, c, d] = quad.map(|p| p.coords);
            let at = (a * (1.0 - u) + b * u) * (1.0 - v) + (d * (1.0 - u) + c * u) * v;
            let [x, y] = unit_place(&quad, &at.into()).ok_or_else(|| TestCaseError::fail("outside"))?;
            let back = (a * (1.0 - x) + b * x) * (1.0 - y) + (d * (1.0 - x) + c * x) * y;
            prop_assert!((back - at).norm() < 1e-8, "{u} {v} {x} {y}");
        }
    }

    #[test]
    fn nine_touches_tell_a_cylinder_and_more_tell_it_better() {
        let (radius, wall) = (0.175f64, |x: f64, radius: f64| (radius * radius - x * x).sqrt() - radius);
        let worst = |n: usize| {
            let grid = |i: usize| -0.06 + 0.12 * i as f64 / (n - 1) as f64;
            let tree = tree((0..n * n).map(|k| (grid(k % n), grid(k / n), wall(grid(k % n), radius))));
            let surface = tree.surface();
            (0..400)
                .map(|k| Point2::new(-0.06 + 0.006 * f64::from(k % 20), -0.06 + 0.006 * f64::from(k / 20)))
                .map(|p| (surface.height(&p) - wall(p.x, radius)).abs())
                .fold(0.0, f64::max)
        };
        let errors = [worst(3), worst(5), worst(9)];
        assert!(errors[0] < 5e-4 && errors[1] < errors[0] && errors[2] < 5e-5, "{errors:?}");
    }

    #[test]
    fn touches_too_near_or_outside_or_not_finite_are_not_learned() {
        let mut tree = HeightTree::new(Point2::origin(), 0.1, 1e-3);
        let touch = |x: f64, height: f64| Touch { at: Point2::new(x, 0.0), height };
        assert!(tree.insert(touch(0.0, 0.0)) && tree.insert(touch(1.5e-3, 0.0)));
        for bad in [touch(5e-4, 0.0), touch(0.2, 0.0), touch(f64::NAN, 0.0), touch(0.05, f64::INFINITY)] {
            assert!(!tree.insert(bad), "{bad:?}");
        }
        assert_eq!(tree.len(), 2);
    }
}
