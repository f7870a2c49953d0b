mod exposure;
mod matching;
mod turning;

use super::{
    FlowMatcher, FlowStatus, Match, SceneFlowConfig,
    bucket::{Scored, select},
    cells::{Cells, Shape},
    circle::{Corners, Reach},
    features::{Features, Window, table},
    prior::Prior,
    refine::{Images, Pixels, SMALL_STEP_PX, Template, middle, refine},
    support::{SortedMotions, SupportRule, support},
    suppression::{CLASSES, Candidate},
    test_scene::{HEIGHT, RIG, WIDTH, see},
    turned::TurnFlow,
};
use crate::{
    geometry::Transform,
    image::{MaskedPair, View},
    memory::{Capacity, Carver, Slab},
    parallel::{Serial, TwoThreads, Vectors},
    random::Random,
    sad::{Comparison, Descriptor, Kernels, compare, distance},
};
use nalgebra::Vector3;
use std::{boxed::Box, vec, vec::Vec};

pub(crate) const CAPACITY: Capacity = Capacity {
    image_width: WIDTH,
    image_height: HEIGHT,
    features: 4_000,
    matches: 3_000,
    ..Capacity::TINY
};
const BYTES: usize = FlowMatcher::bytes(&CAPACITY);

pub(crate) fn slab() -> Box<Slab<BYTES>> {
    Box::new(Slab::ZERO)
}

fn view(pixels: &[u8]) -> View<'_, u8> {
    View::new(pixels, WIDTH, HEIGHT).unwrap()
}

fn forward(metres: f64, turn_rad: f64) -> Transform {
    Transform::new(Vector3::new(0.0, turn_rad, 0.0), Vector3::new(0.05, 0.0, metres))
}

#[test]
fn cuts_exactly_the_bytes_it_names() {
    let mut slab = slab();
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    FlowMatcher::new_in(&CAPACITY, &mut carver);
    assert_eq!(carver.footprint().bytes(), BYTES);
    // The module's formula, and a little for bins, rows of sums and rounding.
    let formula = 33 * CAPACITY.pixels() / 2 + 216 * CAPACITY.features + 69 * CAPACITY.matches;
    assert!((formula..formula + 22_000).contains(&BYTES), "{BYTES} for {formula}");
}

#[test]
fn matches_lie_where_the_scene_says_and_two_threads_change_nothing() {
    let (first, second) = (see(&Transform::IDENTITY), see(&forward(0.4, 0.01)));
    let mut slabs = [slab(), slab()];
    let [a, b] = &mut slabs;
    let mut serial = FlowMatcher::new_in(&CAPACITY, &mut Carver::new(&mut a.0, BYTES).unwrap());
    let mut joined = FlowMatcher::new_in(&CAPACITY, &mut Carver::new(&mut b.0, BYTES).unwrap());
    let config = SceneFlowConfig::default();
    let report = serial.push(&config, view(&first[0]), view(&first[1]), &Serial);
    assert_eq!(report.status, FlowStatus::First);
    assert!(serial.sparse().is_empty() && serial.refined().is_empty());
    joined.push(&config, view(&first[0]), view(&first[1]), &TwoThreads);
    let report = serial.push(&config, view(&second[0]), view(&second[1]), &Serial);
    assert_eq!(report, joined.push(&config, view(&second[0]), view(&second[1]), &TwoThreads));
    assert_eq!(report.status, FlowStatus::Matched);
    assert!(report.refined > 200 && report.sparse.closed > 30, "{report:?}");
    let bits = |matches: &[Match]| bytemuck::cast_slice::<Match, u32>(matches).to_vec();
    assert_eq!(bits(serial.sparse()), bits(joined.sparse()));
    assert_eq!(bits(serial.refined()), bits(joined.refined()));
    assert_eq!(serial.selection(), joined.selection());
    // Rectified: partners stand in one row. Nine of ten within a fifth of a pixel.
    let level = |m: &&Match| (m.current_left[1] - m.current_right[1]).abs() < 0.2;
    assert!(serial.refined().iter().filter(level).count() * 10 > serial.refined().len() * 9);
    assert!(
        serial
            .refined()
            .iter()
            .all(|m| m.previous_disparity_px() > 0.0 && m.current_disparity_px() > 0.0)
    );
}

#[test]
fn another_size_or_too_large_a_frame_begins_anew() {
    let mut slab = slab();
    let mut matcher = FlowMatcher::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
    let config = SceneFlowConfig::default();
    // One grey level, an image one column wider than the capacity.
    let pixels = vec![7; (WIDTH + 1) * HEIGHT];
    let mut push = |left: [usize; 2], right: [usize; 2]| {
        let image = |[width, height]: [usize; 2]| View::new(&pixels, width, height).unwrap();
        matcher.push(&config, image(left), image(right), &Serial).status
    };
    assert_eq!(push([WIDTH, HEIGHT], [WIDTH, HEIGHT]), FlowStatus::First);
    assert_eq!(push([WIDTH, HEIGHT], [WIDTH, HEIGHT]), FlowStatus::Repeated);
    // Another size begins anew; unlike images are refused and forget the one before.
    assert_eq!(push([WIDTH - 1, HEIGHT], [WIDTH - 1, HEIGHT]), FlowStatus::First);
    assert_eq!(push([WIDTH - 1, HEIGHT], [WIDTH, HEIGHT]), FlowStatus::Refused);
    assert_eq!(push([WIDTH - 1, HEIGHT], [WIDTH - 1, HEIGHT]), FlowStatus::First);
    assert_eq!(push([WIDTH + 1, HEIGHT], [WIDTH + 1, HEIGHT]), FlowStatus::Refused);
}

#[test]
fn a_standing_camera_whose_right_rows_are_moved_anew_is_not_frozen() {
    let [left, right] = see(&Transform::IDENTITY);
    let other = see(&forward(0.4, 0.01));
    for (left_after, right_moved, status) in [
        // Left equal and right moved by the caller is no frozen camera.
        (&left, false, FlowStatus::Frozen),
        (&left, true, FlowStatus::Repeated),
        (&other[0], true, FlowStatus::Matched),
    ] {
        let mut slab = slab();
        let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
        let mut matcher = FlowMatcher::new_in(&CAPACITY, &mut carver);
        let config = SceneFlowConfig::default();
        matcher.push(&config, view(&left), view(&right), &Serial);
        let (left, right) = (view(left_after), view(&other[1]));
        let pair = MaskedPair { left, right, invalid: None, right_moved };
        assert_eq!(matcher.push_within(&config, &pair, &Serial).status, status, "{right_moved}");
    }
}

#[test]
fn noise_and_the_smallest_images_do_no_harm() {
    let mut slab = slab();
    let mut matcher = FlowMatcher::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
    let config = SceneFlowConfig { response_min: 1, support_min: 0, ..SceneFlowConfig::default() };
    let mut random = Random::new(5);
    // From one pixel to the largest, and widths that are no multiple of the lanes.
    for [width, height] in [
        [1, 1],
        [5, 5],
        [16, 16],
        [17, 17],
        [18, 40],
        [1, HEIGHT],
        [WIDTH, 1],
        [WIDTH, HEIGHT],
        [199, 77],
    ] {
        for _ in 0..3 {
            let [left, right] = [(); 2].map(|()| {
                (0..width * height).map(|_| random.next_u32() as u8).collect::<Vec<u8>>()
            });
            let image = |pixels| View::new(pixels, width, height).unwrap();
            let report = matcher.push(&config, image(&left), image(&right), &Serial);
            // Each step can only take from the one before.
            assert!(report.bucketed <= report.refined && report.refined <= report.dense.closed);
        }
    }
}

#[test]
fn full_lists_drop_and_count() {
    const SMALL: Capacity = Capacity { features: 300, matches: 40, ..CAPACITY };
    let bytes = FlowMatcher::bytes(&SMALL);
    let mut slab = slab();
    let mut matcher = FlowMatcher::new_in(&SMALL, &mut Carver::new(&mut slab.0, bytes).unwrap());
    let config = SceneFlowConfig::default();
    let picture = see(&Transform::IDENTITY);
    matcher.push(&config, view(&picture[0]), view(&picture[1]), &Serial);
    let report = matcher.push(&config, view(&picture[0]), view(&picture[1]), &Serial);
    assert_eq!(report.left.dense, 300);
    assert!(report.left.dropped > 0 && report.dense.dropped > 0, "{report:?}");
    assert_eq!(report.dense.closed - report.dense.dropped, 40);
}

#[test]
fn refinement_finds_a_fraction_of_a_pixel_under_gain_and_offset() {
    let texture = |u: f64, v: f64| {
        100.0 + 40.0 * (u * 0.7).sin() * (v * 0.6).cos() + 25.0 * (u * 0.3 + v * 0.8).sin()
    };
    let render = |du: f64, dv: f64, gain: f64, offset: f64| -> Vec<u8> {
        (0..64 * 64)
            .map(|i| {
                (gain * texture(f64::from(i % 64) - du, f64::from(i / 64) - dv) + offset).round()
                    as u8
            })
            .collect()
    };
    // Four pictures of one texture: shifted by parts of a pixel, brighter, and darker.
    let images = [
        render(0.0, 0.0, 1.0, 0.0),
        render(-6.3, 0.0, 1.15, 9.0),
        render(2.45, -1.7, 1.0, 0.0),
        render(-3.8, -1.62, 1.15, -7.0),
    ];
    let [previous_left, previous_right, current_left, current_right] =
        [&images[0], &images[1], &images[2], &images[3]].map(|data| Pixels { data, width: 64 });
    // Up to two pixels off in each image.
    let coarse = Match {
        previous_left: [30.0, 31.0],
        previous_right: [24.0, 31.0],
        current_left: [33.0, 30.0],
        current_right: [26.0, 29.0],
    };
    let images = Images { previous_left, previous_right, current_left, current_right };
    let (fine, _) = refine(&coarse, images).unwrap();
    let near = |found: [f32; 2], u: f32, v: f32| {
        (found[0] - u).abs() < 0.04 && (found[1] - v).abs() < 0.04
    };
    assert!(
        near(fine.previous_left, 29.5, 30.5) && near(fine.previous_right, 23.2, 30.5),
        "{fine:?}"
    );
    assert!(near(fine.current_left, 31.95, 28.8), "{fine:?}");
    assert!(near(fine.current_right, 25.7, 28.88), "{fine:?}");
    assert!(
        refine(&Match { current_left: [40.0, 45.0], ..coarse }, images).is_none(),
        "a lost patch is no match"
    );
    let flat = Pixels { data: &[50; 64 * 64], width: 64 };
    assert!(
        refine(&coarse, Images { previous_left: flat, ..images }).is_none(),
        "nothing to hold on to"
    );
}

#[test]
fn what_comes_nearer_stays_the_same_point() {
    const NEARER: f64 = 1.1;
    let texture = |u: f64, v: f64| {
        100.0 + 40.0 * (u * 0.5).sin() * (v * 0.45).cos() + 25.0 * (u * 0.2 + v * 0.6).sin()
    };
    let render = |size: f64| -> Vec<u8> {
        let from = |at: i32| 32.0 + (f64::from(at) - 32.0) / size;
        (0..64 * 64).map(|i| texture(from(i % 64), from(i / 64)).round() as u8).collect()
    };
    let (far, near) = (render(1.0), render(NEARER));
    let [far, near] = [&far, &near].map(|data| Pixels { data, width: 64 });
    let moved = |at: f32| 32.0 + (f64::from(at) - 32.0) * NEARER;
    let (mut error_px, mut count) = ([0.0; 2], 0.0);
    for (u, v) in
        (20..=44).step_by(4).flat_map(|u| (20..=44).step_by(4).map(move |v| (u as f32, v as f32)))
    {
        let guess = [moved(u), moved(v)].map(|at| at.round() as f32);
        let patch = Template::extract(far, u as usize, v as usize).unwrap();
        let Some(now) = patch.find(near, guess, SMALL_STEP_PX).map(middle) else { continue };
        let before = middle([u, v]);
        for axis in 0..2 {
            error_px[axis] += f64::from(now[axis]) - moved(before[axis]);
        }
        count += 1.0;
    }
    // The pixel that names the patch would be off by half a pixel's tenth.
    assert!(
        count > 30.0 && error_px.iter().all(|sum| (sum / count).abs() < 0.012),
        "{error_px:?} of {count}"
    );
}

#[test]
fn bins_search_where_their_matches_or_their_neighbours_went() {
    let mut slab = slab();
    let mut prior = Prior::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
    let config = SceneFlowConfig::default();
    // Matches a row below, with one disparity before and after.
    let at = |u: f32, disparity: f32, flow: f32| Match {
        previous_left: [u, 75.0],
        previous_right: [u - disparity, 75.0],
        current_left: [u + flow, 76.0],
        current_right: [u + flow - disparity, 76.0],
    };
    // Two in one bin, and one in a bin far to the right.
    let matches = [at(75.0, 20.0, -30.0), at(80.0, 24.0, -28.0), at(325.0, 6.0, 50.0)];
    prior.learn(matches.into_iter(), WIDTH, HEIGHT, &config);
    let near = prior.reach([60, 60]).unwrap();
    assert_eq!(
        near.to_previous_right,
        [-34, -10, -2, 2],
        "ten px beyond the extremes, the stereo tolerance in v"
    );
    assert_eq!(near.to_current_right, [-40, -18, -9, 11]);
    assert_eq!(prior.reach([10, 110]), Some(near), "a bin beside it learns the same");
    // The greatest of both: what lies between may belong to either.
    let between = prior.reach([210, 60]).unwrap();
    assert_eq!(
        between.to_previous_right,
        [-34, -1, -2, 2],
        "between two that know: both, and never behind the camera"
    );
    assert_eq!(between.to_current_right, [-40, 60, -9, 11]);
    prior.learn(std::iter::empty(), WIDTH, HEIGHT, &config);
    assert_eq!(prior.reach([60, 60]), Some(Reach::widest(&config)));
}

impl FlowMatcher<'_> {
    /// Flips a bit of one of the eight coordinates of a refined match.
    pub(crate) fn flip(&mut self, at: usize, coordinate: usize, bit: u32) {
        let numbers: &mut [u32; 8] = bytemuck::cast_mut(self.refined_mut(at));
        numbers[coordinate] ^= 1 << bit;
    }
}

#[test]
fn a_point_is_found_where_it_is_and_not_where_it_was_expected() {
    let mut slab = slab();
    let mut matcher = FlowMatcher::new_in(
        &CAPACITY,
        &mut Carver::new(&mut slab.0, FlowMatcher::bytes(&CAPACITY)).unwrap(),
    );
    let expected = |at: [f32; 2], off: f32| {
        // The far wall, 14 m away before and 13.7 m now.
        let [f, b] = [RIG.focal_px, RIG.baseline_m];
        let (x, y) = (
            (f64::from(at[0]) - RIG.center_u_px) * 13.7 / f,
            (f64::from(at[1]) - RIG.center_v_px) * 13.7 / f,
        );
        let project = |x: f64, z: f64| {
            [(x * f / z + RIG.center_u_px) as f32 + off, (y * f / z + RIG.center_v_px) as f32]
        };
        Match {
            previous_left: project(x, 14.0),
            previous_right: project(x - b, 14.0),
            current_left: at,
            current_right: project(x - b, 13.7),
        }
    };
    let push = |matcher: &mut FlowMatcher<'_>, z: f64| {
        let images = see(&Transform::from_translation([0.0, 0.0, z]));
        let [left, right] = [0, 1].map(|side| View::new(&images[side], WIDTH, HEIGHT).unwrap());
        matcher.push(&SceneFlowConfig::default(), left, right, &Serial);
    };
    push(&mut matcher, 0.0);
    assert_eq!(matcher.find(&expected([200.0, 80.0], 0.0)), None, "there is no frame before");
    push(&mut matcher, 0.3);
    let (mut found, mut sought) = (0, 0);
    for (u, v) in (150..240)
        .step_by(10)
        .flat_map(|u| (60..100).step_by(10).map(move |v| (u as f32, v as f32)))
    {
        sought += 1;
        let Some(m) = matcher.find(&expected([u, v], 0.8)) else { continue };
        let truth = expected(m.current_left, 0.0);
        let near =
            |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 0.15 && (a[1] - b[1]).abs() < 0.15;
        found += i32::from(
            near(m.previous_left, truth.previous_left)
                && near(m.previous_right, truth.previous_right)
                && near(m.current_right, truth.current_right),
        );
    }
    assert!(found * 10 > sought * 7, "{found} of {sought}");
    assert_eq!(matcher.find(&expected([WIDTH as f32 + 3.0, 80.0], 0.0)), None);
    assert_eq!(matcher.find(&expected([f32::NAN, 80.0], 0.0)), None);
    assert_eq!(matcher.find(&expected([200.0, 80.0], f32::INFINITY)), None);
}
