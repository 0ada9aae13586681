//! Where arms can draw, slice by slice, as figure 6.1 of the dissertation shows it in space.
use crate::math::Rgb;
use crate::plan::{Reach, ReachMap};

use super::figure::Figure;
use super::plot::{Frame, Plot, WIDTH};

/// Colours of the first two arms, of more, and of what all can reach: green, blue and red as in the dissertation.
const ARMS: [(&str, [u8; 3]); 3] =
    [("#58a870", [88, 168, 112]), ("#5a83c4", [90, 131, 196]), ("#b08a4a", [176, 138, 74])];
const ALL: (&str, [u8; 3]) = ("#cf4b40", [207, 75, 64]);
const BLOCKED: (&str, [u8; 3]) = ("#dcd8cd", [220, 216, 205]);
/// Slices beside each other.
const COLUMNS: usize = 4;
/// Room for the ticks and labels of a slice, px.
const LEFT: f64 = 58.0;
const RIGHT: f64 = 10.0;
const HEAD: f64 = 26.0;
const FOOT: f64 = 46.0;

/// A canvas to show, in the frame of the grid (m: right, up; at slice `k`).
#[derive(Clone, Debug, PartialEq)]
pub struct ShownCanvas {
    /// Index of the slice.
    pub k: usize,
    /// Its centre.
    pub center: [f64; 2],
    /// Width and height.
    pub size: [f64; 2],
    /// Lines of the drawing on it.
    pub strokes: Vec<Vec<(f64, f64)>>,
}

/// Slices `shown` (indices along the pen's axis) of the maps of all arms, which share a grid; `bases` are where the arms stand,
/// right and up in the grid's frame.
pub fn reach_figure(
    title: &str,
    arms: &[(&str, &ReachMap)],
    bases: &[(f64, f64)],
    shown: &[usize],
    canvas: Option<&ShownCanvas>,
) -> Figure {
    let Some(grid) = arms.first().map(|a| &a.1.grid) else { return Figure::new(title, Figure::HEAD) };
    let (x, y) = extent(arms, bases);
    let width = (WIDTH - 20.0) / COLUMNS as f64 - LEFT - RIGHT;
    let height = (width * (y.1 - y.0) / (x.1 - x.0)).clamp(80.0, 420.0);
    let rows = shown.len().div_ceil(COLUMNS);
    let mut figure = Figure::new(title, Figure::HEAD + rows as f64 * (HEAD + height + FOOT));
    for (n, k) in shown.iter().enumerate() {
        let (column, row) = (n % COLUMNS, n / COLUMNS);
        let left = 10.0 + column as f64 * (LEFT + width + RIGHT) + LEFT;
        let top = Figure::HEAD + row as f64 * (HEAD + height + FOOT) + HEAD;
        let frame = Frame { left, top, right: left + width, bottom: top + height };
        let mut plot = Plot::within(frame, (x.0 * 1e3, x.1 * 1e3), (y.0 * 1e3, y.1 * 1e3));
        plot.heading(&format!("depth {:.0} mm", grid.coordinate(2, *k) * 1e3));
        fill(&mut plot, arms, *k);
        for (u, v) in bases {
            plot.curve("#1b2a41", &[(u * 1e3, v * 1e3)]);
        }
        if let Some(canvas) = canvas.filter(|c| c.k == *k) {
            let ([u, v], [w, h]) = (canvas.center, canvas.size.map(|s| 0.5 * s));
            let corners = [(u - w, v - h), (u + w, v - h), (u + w, v + h), (u - w, v + h), (u - w, v - h)];
            plot.polyline("#ffffff", 0.7, canvas.strokes.iter().map(Vec::as_slice), 1e3);
            plot.polyline("#1b2a41", 2.0, [corners.as_slice()].into_iter(), 1e3);
        }
        let last_row = n + COLUMNS >= shown.len();
        figure.add(&plot, if last_row { "right, mm" } else { "" }, if column == 0 { "up, mm" } else { "" });
    }
    for (i, (name, _)) in arms.iter().enumerate() {
        figure.legend(ARMS[i.min(2)].0, &if arms.len() > 1 { format!("{name} alone") } else { (*name).to_string() });
    }
    if arms.len() > 1 {
        figure.legend(ALL.0, "every arm");
    }
    figure.legend(BLOCKED.0, "too near to something, or singular");
    figure.legend("#1b2a41", if canvas.is_some() { "base, and the canvas" } else { "base" });
    figure
}

/// What of the grid is worth showing, m: where any arm gets to, and their bases.
fn extent(arms: &[(&str, &ReachMap)], bases: &[(f64, f64)]) -> ((f64, f64), (f64, f64)) {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    let mut take = |p: [f64; 2], room: f64| {
        for d in 0..2 {
            low[d] = low[d].min(p[d] - room);
            high[d] = high[d].max(p[d] + room);
        }
    };
    for (_, map) in arms {
        for index in (0..map.nodes.len()).filter(|i| map.nodes[*i] != Reach::Out) {
            let [i, j, _] = map.grid.node(index);
            take([map.grid.coordinate(0, i), map.grid.coordinate(1, j)], map.grid.spacing);
        }
    }
    bases.iter().for_each(|(u, v)| take([*u, *v], 0.05));
    if low[0] > high[0] { ((0.0, 1.0), (0.0, 1.0)) } else { ((low[0], high[0]), (low[1], high[1])) }
}

/// Squares round the nodes of slice `k`, like ones above each other as one.
fn fill(plot: &mut Plot, arms: &[(&str, &ReachMap)], k: usize) {
    let grid = &arms[0].1.grid;
    let half = 0.5 * grid.spacing;
    for i in 0..grid.size[0] {
        let mut j = 0;
        while j < grid.size[1] {
            let color = color_at(arms, grid.index([i, j, k]));
            let from = j;
            while j < grid.size[1] && color_at(arms, grid.index([i, j, k])) == color {
                j += 1;
            }
            if let Some(color) = color {
                let (u, low, high) = (grid.coordinate(0, i), grid.coordinate(1, from), grid.coordinate(1, j - 1));
                plot.cell(
                    Rgb(color),
                    ((u - half) * 1e3, (u + half) * 1e3),
                    ((low - half) * 1e3, (high + half) * 1e3),
                    "",
                );
            }
        }
    }
}

fn color_at(arms: &[(&str, &ReachMap)], index: usize) -> Option<[u8; 3]> {
    let free: Vec<usize> = (0..arms.len()).filter(|a| arms[*a].1.nodes[index] == Reach::Free).collect();
    match free.as_slice() {
        [] => arms.iter().any(|a| a.1.nodes[index] == Reach::Blocked).then_some(BLOCKED.1),
        all if all.len() == arms.len() && all.len() > 1 => Some(ALL.1),
        some => Some(ARMS[some[0].min(2)].1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::ReachGrid;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn each_slice_shows_who_gets_where() {
        let grid = ReachGrid {
            origin: Point3::origin(),
            right: -Vector3::y(),
            up: Vector3::z(),
            axis: Vector3::x(),
            spacing: 0.1,
            first: [-1, -1, 3],
            size: [3, 3, 2],
        };
        let mut nodes = vec![Reach::Out; 18];
        nodes[grid.index([1, 1, 0])] = Reach::Free;
        let left = ReachMap { grid: grid.clone(), nodes: nodes.clone() };
        nodes[grid.index([2, 1, 0])] = Reach::Free;
        nodes[grid.index([0, 0, 1])] = Reach::Blocked;
        let right = ReachMap { grid, nodes };
        let canvas =
            ShownCanvas { k: 1, center: [0.0, 0.0], size: [0.1, 0.1], strokes: vec![vec![(0.0, 0.0), (0.02, 0.02)]] };
        let svg =
            reach_figure("Reach", &[("left", &left), ("right", &right)], &[(0.0, 0.0)], &[0, 1], Some(&canvas)).svg();
        assert_eq!(svg.matches("depth 300 mm").count() + svg.matches("depth 400 mm").count(), 2);
        for (color, cells) in [("#cf4b40", 1), ("#5a83c4", 1), ("#58a870", 0), ("#dcd8cd", 1)] {
            assert_eq!(svg.matches(&format!("fill=\"{color}\"")).count(), cells, "{color}");
        }
        assert!(svg.contains("stroke=\"#ffffff\"") && !svg.contains("NaN"));
    }
}
