//! A skyline over a river in one ink: towers, a dome, spires, a lattice tower.
use crate::page::{P, Page, placed, smooth};

/// Height of the quay, mm.
const QUAY: f64 = 108.0;

pub fn page() -> Page {
    let mut page = Page::new(1190.0, 500.0, &[("Black", "#1b1b1f")]);
    river(&mut page);
    for (x, w, h, kind) in [
        (34.0, 56.0, 150.0, 0),
        (96.0, 44.0, 206.0, 1),
        (146.0, 60.0, 118.0, 2),
        (212.0, 40.0, 250.0, 1),
        (340.0, 54.0, 176.0, 0),
        (400.0, 46.0, 232.0, 2),
        (598.0, 48.0, 196.0, 1),
        (652.0, 62.0, 134.0, 0),
        (842.0, 44.0, 262.0, 2),
        (892.0, 58.0, 160.0, 1),
        (956.0, 42.0, 214.0, 0),
        (1094.0, 62.0, 140.0, 2),
    ] {
        block(&mut page, x, w, h, kind);
    }
    dome(&mut page, 522.0, 56.0);
    lattice(&mut page, 776.0, 300.0);
    spire(&mut page, 290.0, 40.0);
    spire(&mut page, 1042.0, 40.0);
    for (k, x) in [110.0, 300.0, 480.0, 640.0, 940.0, 1110.0].iter().enumerate() {
        cloud(&mut page, (*x, 420.0 + 12.0 * (k % 3) as f64));
    }
    page
}

fn river(page: &mut Page) {
    for k in 0..20 {
        let x = 12.0 + 59.0 * f64::from(k);
        page.line(0, &[(x, QUAY), (x + 57.0, QUAY)]);
        page.line(0, &[(x, QUAY - 6.0), (x + 57.0, QUAY - 6.0)]);
        for i in 0..4 {
            page.line(0, &[(x + 14.0 * f64::from(i) + 4.0, QUAY - 1.0), (x + 14.0 * f64::from(i) + 4.0, QUAY - 5.0)]);
        }
    }
    for row in 0..7 {
        let y = 86.0 - 12.0 * f64::from(row);
        let mut x = 14.0 + 9.0 * page.random();
        while x < 1130.0 {
            let w = 26.0 + 30.0 * page.random();
            page.curve(0, &[(x, y), (x + 0.25 * w, y + 2.4), (x + 0.5 * w, y), (x + 0.75 * w, y - 2.4), (x + w, y)]);
            x += w + 6.0 + 14.0 * page.random();
        }
    }
}

/// A house of windows: 0 panes, 1 upright slits, 2 bricks between bands.
fn block(page: &mut Page, x: f64, w: f64, h: f64, kind: i32) {
    let top = QUAY + h;
    page.line(0, &[(x, QUAY + 1.0), (x, top), (x + w, top), (x + w, QUAY + 1.0)]);
    page.line(0, &[(x - 2.0, top + 4.0), (x + w + 2.0, top + 4.0)]);
    let mut y = QUAY + 14.0;
    while y + 14.0 < top {
        let n = ((w - 8.0) / 11.0).floor();
        let pitch = (w - 6.0) / n;
        for i in 0..n as i32 {
            let a = x + 3.0 + pitch * f64::from(i) + 2.0;
            let b = a + pitch - 4.0;
            match kind {
                0 => page.line(0, &[(a, y), (b, y), (b, y + 10.0), (a, y + 10.0), (a, y)]),
                1 => {
                    page.line(0, &[(a, y), (a, y + 11.0)]);
                    page.line(0, &[(b, y), (b, y + 11.0)]);
                }
                _ => {
                    page.arc(0, (0.5 * (a + b), y + 5.0), 0.5 * (b - a), 0.0, 180.0);
                    page.line(0, &[(a, y), (a, y + 5.0)]);
                    page.line(0, &[(b, y), (b, y + 5.0)]);
                }
            }
        }
        if kind == 2 {
            page.line(0, &[(x + 2.0, y - 3.0), (x + w - 2.0, y - 3.0)]);
        }
        y += 16.0;
    }
    let shade: [P; 4] = [(x + 0.72 * w, QUAY + 2.0), (x + w, QUAY + 2.0), (x + w, top), (x + 0.72 * w, top)];
    page.hatched(0, &shade, 55.0, 5.0);
    if h > 200.0 {
        page.line(0, &[(x + 0.5 * w, top + 5.0), (x + 0.5 * w, top + 34.0)]);
        page.line(
            0,
            &[
                (x + 0.35 * w, top + 5.0),
                (x + 0.35 * w, top + 14.0),
                (x + 0.65 * w, top + 14.0),
                (x + 0.65 * w, top + 5.0),
            ],
        );
    }
}

fn dome(page: &mut Page, x: f64, r: f64) {
    let base = QUAY + 96.0;
    page.line(0, &[(x - r, QUAY + 1.0), (x - r, base), (x + r, base), (x + r, QUAY + 1.0)]);
    for k in 0..9 {
        let a = x - r + 8.0 + (2.0 * r - 16.0) * f64::from(k) / 8.0;
        page.line(0, &[(a - 2.5, QUAY + 12.0), (a - 2.5, base - 16.0)]);
        page.line(0, &[(a + 2.5, QUAY + 12.0), (a + 2.5, base - 16.0)]);
        page.arc(0, (a, base - 12.0), 4.0, 0.0, 180.0);
    }
    for dy in [-5.0, 4.0, 9.0] {
        page.line(0, &[(x - r - 3.0, base + dy), (x + r + 3.0, base + dy)]);
    }
    page.arc(0, (x, base + 12.0), r, 0.0, 180.0);
    for k in 1..8 {
        let a = (22.5 * f64::from(k)).to_radians().cos();
        let rib: Vec<P> = (0..=12)
            .map(|i| {
                let t = (90.0 * f64::from(i) / 12.0 * 0.94).to_radians();
                (x + r * a * t.cos(), base + 12.0 + r * t.sin())
            })
            .collect();
        page.line(0, &rib);
    }
    page.line(
        0,
        &[
            (x - 9.0, base + r + 13.0),
            (x - 9.0, base + r + 28.0),
            (x + 9.0, base + r + 28.0),
            (x + 9.0, base + r + 13.0),
        ],
    );
    page.arc(0, (x, base + r + 28.0), 9.0, 10.0, 170.0);
    page.line(0, &[(x, base + r + 38.0), (x, base + r + 56.0)]);
    page.line(0, &[(x - 5.0, base + r + 49.0), (x + 5.0, base + r + 49.0)]);
}

/// A tower of crossed bars that narrows upwards.
fn lattice(page: &mut Page, x: f64, h: f64) {
    let half = |t: f64| 54.0 * (1.0 - t).powf(2.1) + 3.0;
    let n = 22;
    let at = |k: i32, side: f64| {
        let t = f64::from(k) / f64::from(n);
        (x + side * half(t), QUAY + h * t)
    };
    for side in [-1.0, 1.0] {
        for inner in [1.0, 0.72] {
            let leg: Vec<P> = (0..=n)
                .map(|k| {
                    let p = at(k, side);
                    (x + (p.0 - x) * inner, p.1)
                })
                .collect();
            page.line(0, &smooth(&leg, false));
        }
    }
    for k in 0..n {
        let (a, b, c, d) = (at(k, -1.0), at(k, 1.0), at(k + 1, 1.0), at(k + 1, -1.0));
        if k > 3 {
            page.line(0, &[a, c]);
            page.line(0, &[b, d]);
        }
        for side in [-1.0, 1.0] {
            let (p, q) = (at(k, side), at(k + 1, side));
            page.line(0, &[p, (x + (q.0 - x) * 0.72, q.1)]);
            page.line(0, &[(x + (p.0 - x) * 0.72, p.1), q]);
        }
        if [4, 5, 11, 12, 18].contains(&k) {
            page.line(0, &[(a.0 - 3.0, a.1), (b.0 + 3.0, b.1)]);
        }
    }
    page.arc(0, (x, QUAY), 33.0, 8.0, 172.0);
    page.arc(0, (x, QUAY), 28.0, 8.0, 172.0);
    page.line(0, &[(x, QUAY + h + 2.0), (x, QUAY + h + 30.0)]);
}

fn spire(page: &mut Page, x: f64, w: f64) {
    let top = QUAY + 122.0;
    page.line(0, &[(x - 0.5 * w, QUAY + 1.0), (x - 0.5 * w, top), (x + 0.5 * w, top), (x + 0.5 * w, QUAY + 1.0)]);
    let roof: [P; 3] = [(x - 0.6 * w, top + 3.0), (x, top + 118.0), (x + 0.6 * w, top + 3.0)];
    page.line(0, &[roof[0], roof[1], roof[2], roof[0]]);
    page.hatched(0, &roof, 28.0, 5.0);
    page.arc(0, (x, top - 26.0), 12.0, 0.0, 360.0);
    page.line(0, &[(x, top - 26.0), (x, top - 17.0)]);
    page.line(0, &[(x, top - 26.0), (x + 6.0, top - 26.0)]);
    for k in 0..12 {
        let a = (30.0 * f64::from(k)).to_radians();
        page.line(
            0,
            &placed(&[(9.0 * a.cos(), 9.0 * a.sin()), (11.0 * a.cos(), 11.0 * a.sin())], (x, top - 26.0), 1.0, false),
        );
    }
    for row in 0..4 {
        let y = QUAY + 12.0 + 20.0 * f64::from(row);
        for side in [-8.0, 8.0] {
            page.arc(0, (x + side, y + 8.0), 4.0, 0.0, 180.0);
            page.line(0, &[(x + side - 4.0, y), (x + side - 4.0, y + 8.0)]);
            page.line(0, &[(x + side + 4.0, y), (x + side + 4.0, y + 8.0)]);
        }
    }
}

fn cloud(page: &mut Page, (x, y): P) {
    for (dx, dy, r) in [(-26.0, 0.0, 10.0), (-10.0, 7.0, 14.0), (11.0, 8.0, 14.0), (27.0, 1.0, 10.0)] {
        page.arc(0, (x + dx, y + dy), r, 12.0, 168.0);
    }
    page.line(0, &[(x - 36.0, y - 2.0), (x + 36.0, y - 2.0)]);
    page.line(0, &[(x - 22.0, y - 7.0), (x + 24.0, y - 7.0)]);
}
