//! What holds of tours, whatever the points.
use proptest::prelude::*;

use super::*;

fn options(closed: bool, kicks: f64) -> TourOptions {
    TourOptions { closed, effort: Effort::Kicks(kicks), ..TourOptions::default() }
}

fn is_permutation(order: &[u32], n: usize) -> bool {
    let mut sorted = order.to_vec();
    sorted.sort_unstable();
    sorted.len() == n && sorted.iter().enumerate().all(|(i, &x)| i as u32 == x)
}

/// Points strewn evenly over a square of side 1.
fn scattered(n: usize) -> Vec<Point2<f64>> {
    use rand_chacha::rand_core::Rng;
    let mut rng = crate::math::stream(7, "points", n as u64);
    let mut unit = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    (0..n).map(|_| Point2::new(unit(), unit())).collect()
}

/// Points of few or many places, in a line, in a cluster, far away, or anywhere.
fn any_points() -> impl Strategy<Value = Vec<Point2<f64>>> {
    let few = (0..4i32, 0..4i32).prop_map(|(x, y)| Point2::new(f64::from(x), f64::from(y)));
    let line = (-1e3..1e3f64).prop_map(|x| Point2::new(x, 0.5 * x));
    let cluster = (-1e-6..1e-6f64, -1e-6..1e-6f64).prop_map(|(x, y)| Point2::new(1.0 + x, y));
    let anywhere = (-1e3..1e3f64, -1e3..1e3f64).prop_map(|(x, y)| Point2::new(x, y));
    let extreme = (any::<f64>(), any::<f64>())
        .prop_filter("finite", |(x, y)| x.is_finite() && y.is_finite())
        .prop_map(|(x, y)| Point2::new(x, y));
    let mixed = prop_oneof![few.clone(), line.clone(), cluster, anywhere.clone()];
    prop_oneof![
        prop::collection::vec(few, 0..60),
        prop::collection::vec(line, 0..60),
        prop::collection::vec(mixed, 0..200),
        prop::collection::vec(anywhere, 0..11),
        prop::collection::vec(extreme, 0..40),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    #[test]
    fn a_tour_visits_every_point_once(points in any_points(), closed: bool, rounded: bool, seed: u64) {
        let options = TourOptions { rounded, seed, ..options(closed, 1.0) };
        prop_assert!(is_permutation(&solve(&points, &options).unwrap(), points.len()));
    }

    #[test]
    fn small_tours_are_the_shortest(
        points in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 10..13),
        closed: bool,
    ) {
        let points: Vec<Point2<f64>> = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
        let order = solve(&points, &options(closed, 20.0)).unwrap();
        let mut nodes: Vec<[f64; 2]> = points.iter().map(|p| [p.x, p.y]).collect();
        if !closed {
            nodes.push([f64::NAN; 2]);
        }
        let mut best = exact::shortest(&nodes, Metric::fine());
        if let Some(at) = best.iter().position(|&i| i as usize == points.len()) {
            best.rotate_left(at);
            best.remove(0);
        }
        let (found, best) = (length(&points, &order, closed), length(&points, &best, closed));
        prop_assert!(found <= best + 1e-9, "{found} is longer than {best}");
    }

    #[test]
    fn points_at_one_place_come_one_after_another(
        copies in prop::collection::vec((0..8i32, 0..8i32, 1..20usize), 1..30),
        closed: bool,
    ) {
        let points: Vec<Point2<f64>> = copies
            .iter()
            .flat_map(|&(x, y, n)| std::iter::repeat_n(Point2::new(f64::from(x), f64::from(y)), n))
            .collect();
        let order = solve(&points, &options(closed, 0.5)).unwrap();
        let visits = order.chunk_by(|&a, &b| points[a as usize] == points[b as usize]).count();
        let mut places: Vec<(i32, i32)> = copies.iter().map(|&(x, y, _)| (x, y)).collect();
        places.sort_unstable();
        places.dedup();
        prop_assert_eq!(visits, places.len());
    }
}

#[test]
fn points_on_a_circle_are_visited_in_turn() {
    let n = 1000;
    let turn = |i: usize| std::f64::consts::TAU * ((i * 383) % n) as f64 / n as f64;
    let points: Vec<Point2<f64>> = (0..n).map(|i| Point2::new(turn(i).cos(), turn(i).sin())).collect();
    let around = 2.0 * n as f64 * (std::f64::consts::PI / n as f64).sin();
    for closed in [true, false] {
        let order = solve(&points, &options(closed, 0.0)).unwrap();
        let expected = if closed { around } else { around * (1.0 - 1.0 / n as f64) };
        assert!((length(&points, &order, closed) - expected).abs() < 1e-9);
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let points = scattered(5000);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&points, &options(true, 0.5)).unwrap())
    };
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(3));
}

#[test]
fn tours_come_near_the_length_of_the_shortest() {
    // of random points in a square the shortest tour is 0.7313 sqrt(n A) long at n = 1,000, 0.7168 at 10,000 (Johnson
    // and McGeoch, "The Traveling Salesman Problem: A Case Study in Local Optimization", 1997)
    let n = 4000;
    let points = scattered(n);
    let shortest = 0.722 * (n as f64).sqrt();
    let lengths = [0.0, 1.0].map(|k| length(&points, &solve(&points, &options(true, k)).unwrap(), true));
    assert!(lengths[1] < lengths[0], "kicks make tours shorter: {lengths:?}");
    assert!(lengths[0] < 1.04 * shortest && lengths[1] < 1.02 * shortest, "{lengths:?} against {shortest}");
}

#[test]
fn open_tours_save_at_least_the_longest_edge() {
    let points = scattered(500);
    let closed = solve(&points, &options(true, 3.0)).unwrap();
    let open = solve(&points, &options(false, 3.0)).unwrap();
    let longest = closed.windows(2).map(|w| (points[w[0] as usize] - points[w[1] as usize]).norm()).fold(0.0, f64::max);
    assert!(length(&points, &open, false) < 1.01 * (length(&points, &closed, true) - longest));
}

#[test]
fn a_short_time_still_gives_a_tour() {
    let points = scattered(3000);
    let options = TourOptions { effort: Effort::Time(Duration::from_millis(1)), ..TourOptions::default() };
    assert!(is_permutation(&solve(&points, &options).unwrap(), points.len()));
}

#[test]
fn what_is_no_number_is_refused() {
    let mut points = scattered(20);
    points[7].y = f64::NAN;
    points[9].x = f64::INFINITY;
    assert!(matches!(solve(&points, &TourOptions::default()), Err(TourError::NotFinite { index: 7, .. })));
    for kicks in [f64::NAN, -1.0, f64::INFINITY] {
        assert!(matches!(solve(&scattered(5), &options(true, kicks)), Err(TourError::BadEffort { .. })));
    }
}
