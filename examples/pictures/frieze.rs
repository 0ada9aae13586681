//! A frieze for a wall: a procession of deer, horses and hares between trees and houses, over waves with fish, under a meander.
use std::f64::consts::TAU;

use crate::page::{P, Page, placed, smooth};

const BLACK: usize = 0;
const RED: usize = 1;
const BLUE: usize = 2;
/// Height of the ground, mm.
const GROUND: f64 = 118.0;

/// Outlines in units of about 2 mm, facing right, hoofs at 0.
const DEER: [P; 38] = [
    (98.0, 74.0),
    (92.0, 81.0),
    (86.0, 85.0),
    (79.0, 92.0),
    (81.0, 84.0),
    (75.0, 72.0),
    (67.0, 60.0),
    (50.0, 57.0),
    (28.0, 58.0),
    (18.0, 55.0),
    (13.0, 58.0),
    (11.0, 53.0),
    (16.0, 49.0),
    (16.0, 40.0),
    (12.0, 30.0),
    (14.0, 22.0),
    (13.0, 2.0),
    (17.5, 2.0),
    (19.0, 22.0),
    (22.0, 31.0),
    (30.0, 36.0),
    (36.0, 37.0),
    (52.0, 35.0),
    (60.0, 32.0),
    (61.0, 26.0),
    (59.5, 16.0),
    (59.0, 2.0),
    (63.5, 2.0),
    (65.0, 16.0),
    (67.5, 27.0),
    (71.0, 34.0),
    (75.5, 44.0),
    (80.0, 56.0),
    (84.0, 66.0),
    (88.0, 69.0),
    (94.0, 69.5),
    (98.0, 70.5),
    (99.0, 72.0),
];
const HORSE: [P; 38] = [
    (106.0, 72.0),
    (101.0, 82.0),
    (93.0, 91.0),
    (88.0, 95.0),
    (87.0, 91.0),
    (80.0, 86.0),
    (72.0, 74.0),
    (64.0, 64.0),
    (50.0, 60.0),
    (34.0, 62.0),
    (22.0, 61.0),
    (15.0, 55.0),
    (12.0, 47.0),
    (13.0, 38.0),
    (10.0, 29.0),
    (12.0, 20.0),
    (10.0, 2.0),
    (16.0, 2.0),
    (18.0, 20.0),
    (22.0, 30.0),
    (32.0, 36.0),
    (42.0, 36.0),
    (56.0, 34.0),
    (64.0, 31.0),
    (66.0, 24.0),
    (64.0, 14.0),
    (63.0, 2.0),
    (69.0, 2.0),
    (71.0, 15.0),
    (74.0, 27.0),
    (79.0, 38.0),
    (83.0, 50.0),
    (86.0, 62.0),
    (90.0, 70.0),
    (95.0, 68.0),
    (101.0, 64.0),
    (105.0, 65.0),
    (107.0, 68.0),
];
const HARE: [P; 24] = [
    (52.0, 26.0),
    (48.0, 32.0),
    (44.0, 34.0),
    (40.0, 46.0),
    (36.0, 52.0),
    (36.0, 42.0),
    (38.0, 33.0),
    (32.0, 30.0),
    (22.0, 32.0),
    (12.0, 30.0),
    (6.0, 24.0),
    (3.0, 27.0),
    (1.0, 23.0),
    (5.0, 18.0),
    (4.0, 10.0),
    (2.0, 1.5),
    (14.0, 1.5),
    (17.0, 8.0),
    (26.0, 12.0),
    (32.0, 10.0),
    (36.0, 1.5),
    (42.0, 2.0),
    (42.0, 14.0),
    (47.0, 21.0),
];

pub fn page() -> Page {
    let mut page = Page::new(2000.0, 500.0, &[("Black", "#1b1b1f"), ("Red", "#b0432a"), ("Blue", "#235f94")]);
    meander(&mut page, 462.0);
    waves(&mut page);
    ground(&mut page);
    sun(&mut page, (1000.0, 366.0));
    for (x, scale) in [(70.0, 1.05), (395.0, 0.9), (715.0, 1.0), (1225.0, 0.92), (1560.0, 1.04), (1930.0, 0.95)] {
        tree(&mut page, (x, GROUND), scale);
    }
    for (x, w, h) in [(890.0, 92.0, 78.0), (1000.0, 84.0, 104.0), (1098.0, 78.0, 66.0)] {
        house(&mut page, (x, GROUND), w, h);
    }
    for (x, scale, stag) in [(130.0, 1.55, true), (1625.0, 1.55, true)] {
        animal(&mut page, &DEER, (x, GROUND), scale, RED, stag);
    }
    for x in [465.0, 1292.0] {
        horse(&mut page, (x, GROUND), 1.5);
    }
    for x in [318.0, 764.0, 1160.0, 1478.0, 1796.0, 1856.0] {
        animal(&mut page, &HARE, (x, GROUND), 0.95, BLACK, false);
    }
    for (k, x) in
        [180.0, 260.0, 330.0, 470.0, 560.0, 780.0, 1210.0, 1330.0, 1430.0, 1490.0, 1700.0, 1790.0].iter().enumerate()
    {
        bird(&mut page, (*x, 392.0 + 26.0 * ((k * 7 % 5) as f64 / 4.0)), 15.0 + (k % 3) as f64 * 4.0);
    }
    for x in [285.0, 610.0, 1400.0, 1745.0] {
        cloud(&mut page, (x, 350.0 + 16.0 * (x / 190.0).sin()));
    }
    page
}

/// A key pattern, a stroke a period, between two broken lines.
fn meander(page: &mut Page, y: f64) {
    let (period, h) = (40.0, 26.0);
    for k in 0..49 {
        let x = 20.0 + f64::from(k) * period;
        let key = [(1.0, 0.0), (1.0, 26.0), (31.0, 26.0), (31.0, 8.0), (16.0, 8.0), (16.0, 17.0), (23.0, 17.0)];
        page.line(RED, &placed(&key, (x, y), 1.0, false));
        page.line(
            RED,
            &placed(&[(5.5, 0.0), (5.5, 21.5), (26.5, 21.5), (26.5, 12.5), (20.5, 12.5)], (x, y), 1.0, false),
        );
        page.line(RED, &placed(&[(8.0, 0.0), (38.5, 0.0), (38.5, 26.0)], (x, y), 1.0, false));
        for (dy, ink) in [(-6.0, BLACK), (h + 6.0, BLACK)] {
            page.line(ink, &[(x + 1.0, y + dy), (x + period - 1.0, y + dy)]);
        }
    }
}

/// Rolling scrolls, and fish under them.
fn waves(page: &mut Page) {
    for k in 0..40 {
        let x = 22.0 + 49.0 * f64::from(k);
        let spiral = |from: f64, grow: f64| -> Vec<P> {
            (0..=44)
                .map(|i| {
                    let t = f64::from(i) / 44.0;
                    let a = from + 1.35 * TAU * (1.0 - t);
                    let r = 2.0 + grow * t;
                    (x + 18.0 + r * a.cos(), 74.0 + r * a.sin())
                })
                .collect()
        };
        page.line(BLUE, &spiral(-0.6, 15.0));
        page.line(BLUE, &spiral(-0.6, 11.5));
        page.curve(BLUE, &[(x + 34.0, 64.0), (x + 30.0, 54.0), (x + 16.0, 50.0), (x + 2.0, 55.0)]);
        page.curve(BLUE, &[(x + 42.0, 62.0), (x + 38.0, 51.0), (x + 24.0, 44.0), (x + 4.0, 48.0)]);
        for (dy, w) in [(36.0, 30.0), (30.0, 38.0)] {
            page.curve(
                BLUE,
                &[(x, dy), (x + 0.25 * w, dy + 2.2), (x + 0.5 * w, dy), (x + 0.75 * w, dy - 2.2), (x + w, dy)],
            );
        }
        if k % 3 == 1 {
            fish(page, (x + 14.0, 14.0), 1.0);
        } else {
            page.curve(
                BLUE,
                &[(x + 2.0, 16.0), (x + 12.0, 18.0), (x + 22.0, 16.0), (x + 32.0, 14.0), (x + 42.0, 16.0)],
            );
        }
    }
}

fn fish(page: &mut Page, at: P, scale: f64) {
    let body = [
        (0.0, 0.0),
        (10.0, 7.0),
        (24.0, 7.5),
        (36.0, 1.0),
        (43.0, 8.0),
        (42.0, -8.0),
        (36.0, -1.0),
        (24.0, -7.5),
        (10.0, -7.0),
    ];
    let outline = placed(&smooth(&body, true), at, scale, false);
    page.line(BLACK, &outline);
    page.arc(BLACK, (at.0 + 7.0, at.1 + 1.5), 1.2, 0.0, 360.0);
    for k in 0..5 {
        page.arc(RED, (at.0 + 10.0 + 4.5 * f64::from(k), at.1), 4.5, -55.0, 55.0);
    }
}

/// Grass and pebbles along a broken line.
fn ground(page: &mut Page) {
    for k in 0..33 {
        let x = 14.0 + 60.0 * f64::from(k);
        page.curve(
            BLACK,
            &[(x, GROUND - 3.0), (x + 18.0, GROUND - 1.5), (x + 38.0, GROUND - 3.5), (x + 56.0, GROUND - 2.0)],
        );
        for _ in 0..9 {
            let (u, lean, tall) = (page.random(), page.random() - 0.5, 5.0 + 8.0 * page.random());
            let base = x + 56.0 * u;
            page.curve(
                BLACK,
                &[(base, GROUND - 1.0), (base + 2.0 * lean, GROUND + 0.6 * tall), (base + 6.0 * lean, GROUND + tall)],
            );
        }
        for _ in 0..3 {
            let (u, v, r) = (page.random(), page.random(), 1.2 + 1.6 * page.random());
            page.arc(BLACK, (x + 56.0 * u, GROUND - 9.0 - 7.0 * v), r, 0.0, 300.0);
        }
    }
}

fn sun(page: &mut Page, at: P) {
    for r in [9.0, 15.0, 21.0, 27.0] {
        page.arc(RED, at, r, 3.0 * r, 3.0 * r + 340.0);
    }
    for k in 0..36 {
        let a = (10.0 * f64::from(k)).to_radians();
        let (r0, r1) = (33.0, if k % 2 == 0 { 56.0 } else { 45.0 });
        page.line(RED, &[(at.0 + r0 * a.cos(), at.1 + r0 * a.sin()), (at.0 + r1 * a.cos(), at.1 + r1 * a.sin())]);
    }
}

/// A trunk that forks, with leaves along its twigs.
fn tree(page: &mut Page, (x, y): P, scale: f64) {
    let trunk: [&[P]; 2] = [
        &[(-13.0, 0.0), (-7.0, 12.0), (-5.5, 50.0), (-6.0, 92.0)],
        &[(13.0, 0.0), (7.0, 12.0), (5.5, 50.0), (6.0, 92.0)],
    ];
    for side in trunk {
        page.curve(BLACK, &placed(side, (x, y), scale, false));
    }
    for k in 0..9 {
        let h = 12.0 + 8.5 * f64::from(k);
        let d = 2.0 * (page.random() - 0.5);
        page.curve(BLACK, &placed(&[(-4.0 + d, h), (-1.0 + d, h + 5.0), (d, h + 11.0)], (x, y), scale, false));
    }
    let crown = (x, y + 160.0 * scale);
    let rings = [(0.0, 1), (22.0, 8), (40.0, 14), (57.0, 19), (73.0, 25)];
    for (ring, (radius, count)) in rings.iter().enumerate() {
        for k in 0..*count {
            let a = TAU * (f64::from(k) + 0.5 * (ring % 2) as f64) / f64::from(*count);
            let (r, turn) = (radius * scale * (0.96 + 0.08 * page.random()), a + 0.5 * (page.random() - 0.5));
            let root = (crown.0 + r * a.cos(), crown.1 + 0.92 * r * a.sin());
            leaf(page, root, turn, 15.0 * scale, if (ring + k as usize).is_multiple_of(5) { RED } else { BLUE });
        }
    }
    for k in 0..7 {
        let a = (25.0 + 130.0 * f64::from(k) / 6.0_f64).to_radians();
        let (foot, tip) = ((x, y + 88.0 * scale), (x + 60.0 * scale * a.cos(), y + (100.0 + 52.0 * a.sin()) * scale));
        page.curve(BLACK, &[foot, (0.6 * foot.0 + 0.4 * tip.0, 0.4 * foot.1 + 0.6 * tip.1), tip]);
    }
}

/// An almond with a midrib.
fn leaf(page: &mut Page, (x, y): P, turn: f64, length: f64, ink: usize) {
    let (s, c) = turn.sin_cos();
    let at = |u: f64, v: f64| (x + length * (u * c - v * s), y + length * (u * s + v * c));
    let side = [at(0.0, 0.0), at(0.35, 0.24), at(0.75, 0.14), at(1.0, 0.0), at(0.75, -0.14), at(0.35, -0.24)];
    let outline = smooth(&side, true);
    page.line(ink, &outline);
    page.line(ink, &[at(0.18, 0.0), at(0.8, 0.0)]);
}

fn house(page: &mut Page, (x, y): P, w: f64, h: f64) {
    let (l, r) = (x - 0.5 * w, x + 0.5 * w);
    let ridge = y + h + 0.55 * w;
    page.line(BLACK, &[(l, y), (l, y + h), (r, y + h), (r, y)]);
    let roof = [(l - 7.0, y + h), (x, ridge), (r + 7.0, y + h)];
    page.line(RED, &[roof[0], roof[1], roof[2], roof[0]]);
    // tiles in rows
    let rows = ((ridge - y - h) / 7.0) as i32;
    for k in 0..rows {
        let level = y + h + 7.0 * f64::from(k) + 2.0;
        let half = (0.5 * w + 7.0) * (1.0 - (level - y - h) / (ridge - y - h)) - 5.0;
        let n = (2.0 * half / 7.0).floor() as i32;
        for i in 0..n {
            page.arc(RED, (x - 3.5 * f64::from(n) + 7.0 * f64::from(i) + 3.5, level + 3.2), 3.1, 180.0, 360.0);
        }
    }
    page.line(BLACK, &[(x - 9.0, y), (x - 9.0, y + 26.0)]);
    page.arc(BLACK, (x, y + 26.0), 9.0, 0.0, 180.0);
    page.line(BLACK, &[(x + 9.0, y), (x + 9.0, y + 26.0)]);
    for i in 0..3 {
        page.line(BLACK, &[(x - 4.5 + 4.5 * f64::from(i), y + 2.0), (x - 4.5 + 4.5 * f64::from(i), y + 28.0)]);
    }
    let mut level = y + 44.0;
    while level + 18.0 < y + h {
        for dx in [-0.28 * w, 0.28 * w] {
            let (a, b) = (x + dx - 7.0, x + dx + 7.0);
            page.line(BLACK, &[(a, level), (b, level), (b, level + 16.0), (a, level + 16.0), (a, level)]);
            page.line(BLUE, &[(x + dx, level + 1.5), (x + dx, level + 14.5)]);
            page.line(BLUE, &[(a + 1.5, level + 8.0), (b - 1.5, level + 8.0)]);
        }
        level += 28.0;
    }
    for i in 0..((h - 8.0) / 9.0) as i32 {
        let row = y + 8.0 + 9.0 * f64::from(i);
        for side in [l + 2.0, r - 11.0] {
            page.line(BLACK, &[(side, row), (side + 9.0, row)]);
        }
    }
    // chimney and smoke
    let c = x + 0.26 * w;
    page.line(
        BLACK,
        &[(c - 5.0, ridge - 0.32 * w), (c - 5.0, ridge + 2.0), (c + 5.0, ridge + 2.0), (c + 5.0, ridge - 0.40 * w)],
    );
    page.curve(BLACK, &[(c, ridge + 6.0), (c + 5.0, ridge + 14.0), (c - 3.0, ridge + 22.0), (c + 4.0, ridge + 32.0)]);
}

/// An outline with hatching, and the two legs behind.
fn animal(page: &mut Page, shape: &[P], at: P, scale: f64, ink: usize, stag: bool) {
    let outline = placed(&smooth(shape, true), at, scale, false);
    page.line(BLACK, &outline);
    page.hatched(ink, &outline, 62.0, 3.6);
    let unit = |points: &[P]| placed(points, at, scale, false);
    if shape.len() > 30 {
        for (x, y, bend) in [(25.0, 33.0, 2.5), (69.0, 30.0, -2.0)] {
            page.curve(
                BLACK,
                &unit(&[
                    (x, y),
                    (x + bend, 18.0),
                    (x + 3.0, 2.0),
                    (x + 7.0, 2.0),
                    (x + 6.0 + bend, 18.0),
                    (x + 7.0, y + 0.5),
                ]),
            );
        }
        page.arc(BLACK, unit(&[(89.0, 78.5)])[0], 1.6, 0.0, 360.0);
    } else {
        page.arc(BLACK, unit(&[(47.0, 27.5)])[0], 1.3, 0.0, 360.0);
    }
    if stag {
        for side in [0.0, 7.0] {
            page.curve(
                BLACK,
                &unit(&[(82.0 - side, 91.0), (76.0 - side, 104.0), (78.0 - side, 118.0), (86.0 - side, 127.0)]),
            );
            page.curve(BLACK, &unit(&[(77.5 - side, 101.0), (86.0 - side, 106.0), (92.0 - side, 114.0)]));
            page.curve(BLACK, &unit(&[(76.5 - side, 111.0), (68.0 - side, 118.0), (66.0 - side, 126.0)]));
        }
    }
}

fn horse(page: &mut Page, at: P, scale: f64) {
    animal(page, &HORSE, at, scale, BLACK, false);
    let unit = |points: &[P]| placed(points, at, scale, false);
    for k in 0..11 {
        let t = f64::from(k) / 10.0;
        let (x, y) = (88.0 - 24.0 * t, 92.0 - 27.0 * t);
        page.curve(RED, &unit(&[(x - 1.0, y + 2.0), (x - 8.0, y + 3.0), (x - 13.0, y - 4.0)]));
    }
    for k in 0..9 {
        let t = f64::from(k) / 8.0;
        page.curve(
            RED,
            &unit(&[
                (15.0 - t, 57.0 - 3.0 * t),
                (4.0 - 3.0 * t, 52.0 - 4.0 * t),
                (1.0 - 2.0 * t, 34.0 - 6.0 * t),
                (3.0 - 6.0 * t, 20.0 - 4.0 * t),
            ]),
        );
    }
}

fn bird(page: &mut Page, (x, y): P, span: f64) {
    for sign in [-1.0, 1.0] {
        page.curve(
            BLACK,
            &[(x + sign, y), (x + sign * 0.5 * span, y + 0.36 * span), (x + sign * span, y + 0.12 * span)],
        );
    }
}

fn cloud(page: &mut Page, (x, y): P) {
    for (dx, dy, r) in [(-34.0, 0.0, 13.0), (-14.0, 9.0, 17.0), (12.0, 10.0, 18.0), (34.0, 1.0, 13.0)] {
        page.arc(BLUE, (x + dx, y + dy), r, 10.0, 170.0);
        page.arc(BLUE, (x + dx, y + dy), 0.62 * r, 20.0, 160.0);
    }
    for k in 0..4 {
        let inset = 7.0 * f64::from(k);
        page.line(
            BLUE,
            &[(x - 46.0 + inset, y - 3.0 - 4.0 * f64::from(k)), (x + 46.0 - inset, y - 3.0 - 4.0 * f64::from(k))],
        );
    }
}
