//! The tracker's parts by themselves: which levels there are, what is paired with what, and which
//! motions are no estimates.

use super::*;

/// Levels of a picture of one disparity: number, width and height, coarsest first.
fn levels(width: usize, height: usize, most: u8, memory: usize) -> Vec<[usize; 3]> {
    let (disparity_q8, mut memory) = (vec![20 << 8; width * height], vec![0.0; memory]);
    let view = View::new(&disparity_q8, width, height).unwrap();
    let pyramid = Pyramid::build(&RIG, LIMITS_M, view, most, &mut memory);
    pyramid.coarse_to_fine().map(|(at, level)| [at, level.width(), level.height()]).collect()
}

#[test]
fn levels_halve_until_they_are_too_small_or_do_not_fit() {
    assert_eq!(levels(640, 192, 4, 640 * 192), [[2, 80, 24], [1, 160, 48], [0, 320, 96]]);
    assert_eq!(levels(640, 192, 2, 640 * 192), [[1, 160, 48], [0, 320, 96]]);
    assert_eq!(levels(256, 80, 4, 256 * 80), [[1, 64, 20], [0, 128, 40]]);
    assert_eq!(levels(254, 80, 4, 256 * 80), [[0, 127, 40]], "too narrow");
    assert_eq!(levels(256, 78, 4, 256 * 80), [[0, 128, 39]], "too low");
    assert_eq!(levels(16, 8, 4, 256 * 80), [[0, 8, 4]], "the finest has no least size");
    assert_eq!(levels(256, 80, 4, 128 * 40 + 64 * 20), [[1, 64, 20], [0, 128, 40]]);
    assert_eq!(levels(256, 80, 4, 128 * 40 + 64 * 20 - 1), [[0, 128, 40]]);
    assert_eq!(levels(256, 80, 4, 128 * 40 - 1), [[0; 3]; 0]);
    assert_eq!([0, 1, 2, 3, 4, 9].map(Pyramid::stride_px), [2.0, 4.0, 8.0, 16.0, 32.0, 32.0]);
}

#[test]
fn disparities_of_one_surface_within_the_limits_are_averaged() {
    // 180 px m: from 2 to 20 m it is 9 to 90 px.
    let limits_m = [2.0, 20.0];
    let px = |value: f64| (value * 256.0) as u16;
    // 2 x 2 px after 2 x 2 px: the first is what the others must be close to.
    let blocks: [([f64; 4], f32); 8] = [
        ([10.0, 10.5, 0.0, 20.0], 10.25),
        ([0.0, 0.0, 0.0, 12.0], 12.0),
        ([0.0; 4], 0.0),
        ([9.0, 10.0, 8.75, 10.25], 9.5),
        ([90.0, 90.25, 89.0, 91.0], 89.5),
        ([30.0, 29.0, 31.0, 31.25], 30.0),
        ([8.0, 7.0, 100.0, 50.0], 50.0),
        ([40.0, 40.5, 40.25, 40.25], 40.25),
    ];
    let mut disparity_q8 = [0u16; 32];
    for (at, (block, _)) in blocks.iter().enumerate() {
        let first = at / 4 * 16 + at % 4 * 2;
        [0, 1, 8, 9]
            .iter()
            .zip(block)
            .for_each(|(offset, value)| disparity_q8[first + offset] = px(*value));
    }
    let mut memory = [7.0; 32];
    let pyramid =
        Pyramid::build(&RIG, limits_m, View::new(&disparity_q8, 8, 4).unwrap(), 1, &mut memory);
    let (_, level) = pyramid.coarse_to_fine().next().unwrap();
    assert_eq!(level.pixels(), blocks.map(|(_, mean)| mean));
}

#[test]
fn a_coarser_level_averages_the_finer_one_and_bridges_no_edge() {
    // Columns of 20 px, then of 40 from the 33rd column of the finest level on: an edge within a
    // block of the coarser one.
    let disparity_q8: Vec<u16> = (0..256 * 80)
        .map(|at| if at % 256 < 66 { 20 << 8 } else { (40 << 8) + 128 * (at / 512 % 2) as u16 })
        .collect();
    let mut memory = vec![0.0; 256 * 80];
    let pyramid =
        Pyramid::build(&RIG, LIMITS_M, View::new(&disparity_q8, 256, 80).unwrap(), 2, &mut memory);
    let both: Vec<_> = pyramid.coarse_to_fine().map(|(_, level)| level).collect();
    for v in 0..20 {
        for u in 0..64 {
            // Rows of 40 and of 40.5 px; in the block of the edge the first column alone counts.
            assert_eq!(both[0].get(u, v), Some(if u <= 16 { 20.0 } else { 40.25 }), "{u} {v}");
        }
    }
    for (v, expected) in [(0, 40.0), (1, 40.5), (2, 40.0), (39, 40.5)] {
        assert_eq!(
            (both[1].get(32, v), both[1].get(33, v)),
            (Some(20.0), Some(expected)),
            "row {v}"
        );
    }
}

/// Depth and normals of each pixel of a map.
struct Shown {
    depth_m: Vec<f32>,
    normal: Vec<[i8; 3]>,
}

/// A map that shows one depth everywhere, with these normals.
fn wall(depth_m: f32, normal: [i8; 3]) -> Shown {
    Shown { depth_m: vec![depth_m; WIDTH * HEIGHT], normal: vec![normal; WIDTH * HEIGHT] }
}

fn picture(shown: &Shown) -> MapPicture<'_> {
    MapPicture {
        depth_m: View::new(&shown.depth_m, WIDTH, HEIGHT).unwrap(),
        normal: View::new(&shown.normal, WIDTH, HEIGHT).unwrap(),
        every: 1,
    }
}

#[test]
fn a_point_is_paired_with_the_surface_at_the_nearest_pixel() {
    let mut map = wall(5.0, [127, 0, -127]);
    (map.depth_m[3 * WIDTH + 7], map.normal[3 * WIDTH + 7]) = (8.0, [0, 127, 0]);
    map.depth_m[0] = 0.0;
    let config = IcpConfig::default();
    let pairing = Pairing::new(&config, &RIG, 0);
    let at =
        |u: f64, v: f64| pairing.associate(&(Vector3::from(RIG.ray(u, v)) * 6.0), &picture(&map));
    let surface = |u: f64, v: f64, depth: f64| Vector3::from(RIG.ray(u, v)) * depth;
    for (u, v) in [(7.0, 3.0), (7.49, 3.49), (6.51, 2.51)] {
        assert_eq!(
            at(u, v),
            Some((surface(7.0, 3.0, 8.0), Vector3::new(0.0, 1.0, 0.0))),
            "{u} {v}"
        );
    }
    assert_eq!(at(7.51, 3.0), Some((surface(8.0, 3.0, 5.0), Vector3::new(1.0, 0.0, -1.0))));
    assert_eq!(at(7.0, 2.49), Some((surface(7.0, 2.0, 5.0), Vector3::new(1.0, 0.0, -1.0))));
    assert_eq!(at(0.0, 0.0), None, "nothing is shown there");
    // The image ends half a pixel beyond the middles of its outermost pixels.
    assert!(
        at(-0.49, 9.0).is_some()
            && at(-0.51, 9.0).is_none()
            && at(9.0, -0.49).is_some()
            && at(9.0, -0.51).is_none()
    );
    assert!(
        at(639.49, 9.0).is_some()
            && at(639.51, 9.0).is_none()
            && at(9.0, 191.49).is_some()
            && at(9.0, 191.51).is_none()
    );
    assert_eq!(
        pairing.associate(&Vector3::new(0.0, 0.0, -6.0), &picture(&map)),
        None,
        "behind the camera"
    );
}

#[test]
fn a_pair_counts_by_its_distance_from_the_plane_and_its_noise() {
    let config = IcpConfig { distance_m: 0.1, noise_px: 0.5, ..IcpConfig::default() };
    let map = wall(6.0, [0, 0, -127]);
    for level in [0, 1] {
        let (width, height, stride) =
            (WIDTH >> (level + 1), HEIGHT >> (level + 1), f64::from(2u32 << level));
        let pairing = Pairing::new(&config, &RIG, level);
        for (disparity, within) in [(30.0, true), (29.0, true), (26.0, level == 1), (15.0, false)] {
            let mut disparity_px = vec![0.0f32; width * height];
            let (u, v) = (width / 2, height / 2 + 3);
            disparity_px[v * width + u] = disparity;
            let sums = pairing.sums(
                &Transform::IDENTITY,
                View::new(&disparity_px, width, height).unwrap(),
                &picture(&map),
            );
            let depth = 180.0 / f64::from(disparity);
            let noise_m = 0.5 / 180.0 * depth * depth;
            // The point's pixel in the image, and the middle of the pixel that is nearest to it.
            let [from, to]: [[f64; 2]; 2] =
                [[(u as f64 + 0.5) * stride - 0.5, (v as f64 + 0.5) * stride - 0.5]; 2];
            let to = to.map(|px| libm::floor(px + 0.5));
            let away = Vector3::from(RIG.ray(from[0], from[1])) * depth
                - Vector3::from(RIG.ray(to[0], to[1])) * 6.0;
            let reach_m = (0.1 + 3.0 * noise_m) * stride / 2.0;
            assert_eq!(away.norm() < reach_m, within, "{away:?} {reach_m}");
            assert_eq!(
                (sums.points, sums.pairs),
                (1, u32::from(within)),
                "level {level}, {disparity} px"
            );
            let (squared, weight) =
                ((6.0 - depth) * (6.0 - depth), 1.0 / (0.02 * 0.02 + noise_m * noise_m));
            let expected = if within { [squared, weight, weight * squared] } else { [0.0; 3] };
            let found = [sums.squared_m2, sums.equations.weight, sums.equations.error];
            assert!(
                (0..3).all(|at| (found[at] - expected[at]).abs() <= 1e-9 * (1.0 + expected[at])),
                "{found:?} {expected:?}"
            );
        }
    }
}

#[test]
fn each_test_of_a_motion_decides_by_itself() {
    let config = IcpConfig { pairs_min: 0.25, step_max_m: 2.0, ..IcpConfig::default() };
    let good = IcpReport {
        points: 400,
        pairs: 100,
        eigen_share: f64::from(MIN_EIGEN_SHARE),
        ..IcpReport::default()
    };
    let status = |change: &dyn Fn(&mut IcpReport)| {
        let mut report = good;
        change(&mut report);
        classify(&config, &report)
    };
    assert_eq!(status(&|_| ()), IcpStatus::Tracked, "each at its bound");
    assert_eq!(status(&|report| (report.pairs, report.points) = (99, 99)), IcpStatus::TooFewPairs);
    assert_eq!(status(&|report| report.eigen_share = 0.000_499), IcpStatus::Degenerate);
    assert_eq!(status(&|report| report.points = 401), IcpStatus::OffTheMap);
    for (way_m, turn_rad, expected) in [
        (2.0, 0.0, IcpStatus::Tracked),
        (2.001, 0.0, IcpStatus::TooFar),
        (0.0, 0.35, IcpStatus::Tracked),
        // The length of the quaternion's vector, twice: the angle but for its cube.
        (0.0, 0.353, IcpStatus::TooFar),
        (f64::NAN, 0.0, IcpStatus::TooFar),
    ] {
        let motion = walk([0.0, -turn_rad, 0.0], [way_m, 0.0, 0.0]);
        assert_eq!(
            status(&|report| report.t_current_previous = motion),
            expected,
            "{way_m} m, {turn_rad} rad"
        );
    }
}

#[test]
fn steps_end_where_they_come_to_rest_or_are_as_many_as_allowed() {
    let motion = walk([0.0, 0.01, 0.0], [0.02, 0.0, 0.08]);
    let steps = |levels: u8, steps: u8, motion: &Transform| {
        tracked(&IcpConfig { levels, steps, ..IcpConfig::default() }, &SCENE, motion).steps
    };
    assert_eq!((steps(1, 1, &motion), steps(3, 1, &motion)), (1, 3));
    assert!(steps(3, 50, &motion) < 60, "of 150");
    assert!(steps(1, 50, &Transform::IDENTITY) <= 4);
    assert_eq!(tracked(&IcpConfig::default(), &[], &motion).steps, 3, "without pairs one each");
}

#[test]
fn only_a_tracked_motion_is_one_to_follow_and_each_status_has_its_name() {
    let all = [
        IcpStatus::Tracked,
        IcpStatus::TooFewPairs,
        IcpStatus::Degenerate,
        IcpStatus::OffTheMap,
        IcpStatus::TooFar,
        IcpStatus::Contradicted,
    ];
    let motion = walk([0.0; 3], [1.0, 2.0, 3.0]);
    for status in all {
        let report = IcpReport { status, t_current_previous: motion, ..IcpReport::default() };
        assert_eq!(report.motion(), (status == IcpStatus::Tracked).then_some(motion), "{status:?}");
    }
    assert_eq!(
        all.map(IcpStatus::name),
        [
            "tracked",
            "too few pairs",
            "degenerate direction",
            "off the map",
            "too far",
            "contradicted by the images"
        ]
    );
    assert_eq!(IcpReport::unpaired().motion(), None);
    // The matches agree, which must not turn a failure into a success.
    let mut off =
        IcpReport { status: IcpStatus::OffTheMap, matches: [0, 100], ..IcpReport::default() };
    off.check_matches();
    assert_eq!(off.status, IcpStatus::OffTheMap, "what failed before keeps its reason");
}
