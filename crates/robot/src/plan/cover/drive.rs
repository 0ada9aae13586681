//! Ways for a base from place to place, clear of everything on the floor.
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::{PI, TAU};

use super::floor::Floor;
use super::options::BasePose;

/// Distance between two looks along a straight motion, m, and rad.
const LOOK: [f64; 2] = [0.02, 0.03];
/// Side of the cells of a search, m.
const CELL: f64 = 0.10;
/// Directions in which a base may stand in a search.
const HEADINGS: i32 = 24;
/// How far beyond both places is searched, m.
const AROUND: f64 = 3.0;
/// What a turn by one direction costs, m.
const TURN_COST: f64 = 0.05;
/// Most states that a search looks at.
const MOST: usize = 400_000;

/// The shorter way round from heading `a` to `b`, rad.
fn turn(a: f64, b: f64) -> f64 {
    (b - a + PI).rem_euclid(TAU) - PI
}

/// Whether the straight motion from `a` to `b` is clear.
pub(super) fn is_straight_clear(floor: &Floor, a: &BasePose, b: &BasePose) -> bool {
    let d = b.center() - a.center();
    let swing = turn(a.heading, b.heading);
    let n = (d.norm() / LOOK[0]).max(swing.abs() / LOOK[1]).ceil().max(1.0) as usize;
    (0..=n).all(|k| {
        let u = k as f64 / n as f64;
        floor.is_clear(&BasePose { x: a.x + d.x * u, y: a.y + d.y * u, heading: a.heading + swing * u })
    })
}

/// A way of straight motions from `a` to `b`: one if it is clear, or else the shortest over a lattice of places and headings
/// (A*), with its needless turning points left out. `None` where there is none within 3 m of both.
pub(super) fn way(floor: &Floor, a: &BasePose, b: &BasePose) -> Option<Vec<BasePose>> {
    if is_straight_clear(floor, a, b) {
        return Some(vec![*a, *b]);
    }
    let found = search(floor, a, b)?;
    let mut way = vec![*a];
    let mut at = 0;
    while at + 1 < found.len() {
        let far = (at + 1..found.len()).rev().find(|k| is_straight_clear(floor, &found[at], &found[*k]));
        at = far.unwrap_or(at + 1);
        way.push(found[at]);
    }
    Some(way)
}

type Node = (i32, i32, i32);

fn search(floor: &Floor, a: &BasePose, b: &BasePose) -> Option<Vec<BasePose>> {
    let step = TAU / f64::from(HEADINGS);
    let pose = |(i, j, h): Node| BasePose {
        x: a.x + f64::from(i) * CELL,
        y: a.y + f64::from(j) * CELL,
        heading: a.heading + f64::from(h) * step,
    };
    let within = |(i, j, _): Node| {
        let p = pose((i, j, 0));
        (a.x.min(b.x) - AROUND..=a.x.max(b.x) + AROUND).contains(&p.x)
            && (a.y.min(b.y) - AROUND..=a.y.max(b.y) + AROUND).contains(&p.y)
    };
    let ahead = |n: Node| (pose(n).center() - b.center()).norm();
    let order = |x: f64| (x * 1e6) as u64;
    let mut known: BTreeMap<Node, (f64, Option<Node>)> = BTreeMap::from([((0, 0, 0), (0.0, None))]);
    let mut clear: BTreeMap<Node, bool> = BTreeMap::new();
    let mut open = BinaryHeap::from([Reverse((order(ahead((0, 0, 0))), (0, 0, 0)))]);
    while let Some(Reverse((guess, node))) = open.pop() {
        let cost = known[&node].0;
        if guess > order(cost + ahead(node)) + 1 {
            continue;
        }
        if ahead(node) < 1.5 * CELL
            && turn(pose(node).heading, b.heading).abs() < step
            && is_straight_clear(floor, &pose(node), b)
        {
            let mut way = vec![*b];
            let mut at = Some(node);
            while let Some(n) = at {
                way.push(pose(n));
                at = known[&n].1;
            }
            way.reverse();
            return Some(way);
        }
        if known.len() > MOST {
            return None;
        }
        let moves = [
            (1, 0, 0),
            (-1, 0, 0),
            (0, 1, 0),
            (0, -1, 0),
            (1, 1, 0),
            (1, -1, 0),
            (-1, 1, 0),
            (-1, -1, 0),
            (0, 0, 1),
            (0, 0, -1),
        ];
        for (di, dj, dh) in moves {
            let to = (node.0 + di, node.1 + dj, (node.2 + dh).rem_euclid(HEADINGS));
            if !within(to) || !*clear.entry(to).or_insert_with(|| floor.is_clear(&pose(to))) {
                continue;
            }
            let length = f64::from(di * di + dj * dj).sqrt() * CELL;
            let total = cost + length + if dh == 0 { 0.0 } else { TURN_COST };
            let better = known.get(&to).is_none_or(|k| total < k.0 - 1e-12);
            if better && is_straight_clear(floor, &pose(node), &pose(to)) {
                known.insert(to, (total, Some(node)));
                open.push(Reverse((order(total + ahead(to)), to)));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    /// A wall along y at x = 1 with a door of the given width in it, round y = 1.
    fn floor(door: f64) -> Floor {
        let wall = |a: f64, b: f64| [Point2::new(1.0, a), Point2::new(1.0, b)];
        Floor::bare(vec![wall(-9.0, 1.0 - 0.5 * door), wall(1.0 + 0.5 * door, 9.0)], [0.50, 0.4165])
    }

    #[test]
    fn a_base_drives_round_to_a_door_and_through_it_if_it_is_wide_enough() {
        let pose = |x: f64, deg: f64| BasePose { x, y: 0.0, heading: deg.to_radians() };
        let (from, to) = (pose(0.3, 0.0), pose(2.0, 0.0));
        let found = way(&floor(0.95), &from, &to).unwrap();
        assert_eq!((found[0], found[found.len() - 1]), (from, to));
        assert!(found.len() > 2 && found.windows(2).all(|w| is_straight_clear(&floor(0.95), &w[0], &w[1])));
        assert!(found.iter().any(|p| (p.y - 1.0).abs() < 0.1), "{found:?}");
        assert_eq!(way(&floor(0.80), &from, &to), None);
        // nothing between: straight
        assert_eq!(way(&floor(0.80), &from, &pose(0.2, 90.0)).map(|w| w.len()), Some(2));
    }
}
