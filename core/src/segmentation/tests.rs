//! Moving objects among static points, with closed answers.

mod patches;

use super::*;
use crate::{
    egomotion::Estimator,
    geometry::Transform,
    masks::PixelBox,
    memory::SLAB_ALIGN,
    random::Random,
    scene_flow::{FlowMatcher, Match},
    tracking::{Class, Detection, FrameMatches, OwnerCode, TrackReport, Tracker, TrackingConfig},
};
use std::{vec, vec::Vec};

const WIDTH: usize = 400;
const HEIGHT: usize = 120;
const RIG: StereoRig =
    StereoRig { focal_px: 300.0, center_u_px: 200.0, center_v_px: 50.0, baseline_m: 0.5 };
const CAPACITY: Capacity = Capacity { image_width: WIDTH, image_height: HEIGHT, ..Capacity::TINY };
/// Height of the camera above the ground, m.
const GROUND_M: f64 = 1.6;

/// A box whose front is 1.8 m wide and 1.4 m high, on the ground at `[x, z]`.
#[derive(Clone, Copy)]
struct Car {
    at: [f64; 2],
    motion: [f64; 2],
}

impl Car {
    fn at_frame(&self, frame: u32) -> [f64; 2] {
        let [x, z] = self.at;
        let [dx, dz] = self.motion.map(|motion| motion * f64::from(frame));
        [x + dx, z + dz]
    }
}

fn project([x, y, z]: [f64; 3]) -> [[f32; 2]; 2] {
    let per_m = RIG.focal_px / z;
    let (u, v) = (x * per_m + RIG.center_u_px, y * per_m + RIG.center_v_px);
    [[u as f32, v as f32], [(u - RIG.baseline_m * per_m) as f32, v as f32]]
}

/// Input of a tracker in a world.
struct WorldInput<'i, 's> {
    /// Matches on each car, at most.
    matches_on_car: usize,
    /// Images, where patches are searched for.
    images: Option<&'i mut FlowMatcher<'s>>,
}

impl WorldInput<'_, '_> {
    fn thin(&self, world: &World, frame: u32, matches: &mut Vec<Match>) {
        let mut left = vec![self.matches_on_car; world.cars.len() + 1];
        left[0] = usize::MAX;
        matches.retain(|m| {
            let [u, v] = m.current_left.map(|at| at.round() as usize);
            let left = &mut left[world.cast(frame, u, v).1];
            let keep = *left > 0;
            *left -= usize::from(keep);
            keep
        });
    }
}

/// A world of a ground, a wall 40 m ahead and cars; the camera moves forward by `step_m` a frame.
struct World {
    cars: Vec<Car>,
    step_m: f64,
    noise_px: f32,
}

impl World {
    fn camera_z(&self, frame: u32) -> f64 {
        self.step_m * f64::from(frame)
    }

    /// Depth and what is seen at a pixel: 0 the background, n the n-th car.
    fn cast(&self, frame: u32, u: usize, v: usize) -> (f64, usize) {
        self.cast_from(0.0, frame, [u as f64, v as f64])
    }

    /// Casts a ray from a camera moved to the right.
    fn cast_from(&self, right_m: f64, frame: u32, [u, v]: [f64; 2]) -> (f64, usize) {
        let [x, y] = [(u - RIG.center_u_px) / RIG.focal_px, (v - RIG.center_v_px) / RIG.focal_px];
        // Nothing is farther than 40 m.
        let mut best = (40.0, 0);
        if y > 0.0 && GROUND_M / y < best.0 {
            best.0 = GROUND_M / y;
        }
        for (number, car) in (1..).zip(&self.cars) {
            let [car_x, car_z] = car.at_frame(frame);
            let z = car_z - self.camera_z(frame);
            // A car is a box without depth, 1.8 m wide and 1.4 m high on the ground.
            let inside =
                (right_m + x * z - car_x).abs() < 0.9 && y * z < GROUND_M && y * z > GROUND_M - 1.4;
            if z > 1.0 && inside && z < best.0 {
                best = (z, number);
            }
        }
        best
    }

    fn disparity(&self, frame: u32) -> Vec<u16> {
        let of = |at: usize| {
            (RIG.focal_baseline_px_m() / self.cast(frame, at % WIDTH, at / WIDTH).0 * 256.0) as u16
        };
        (0..WIDTH * HEIGHT).map(of).collect()
    }

    /// Matches from the frame before, on a grid of the current frame.
    fn matches(&self, frame: u32) -> Vec<Match> {
        let mut random = Random::new(u64::from(frame));
        let mut matches = Vec::new();
        for (u, v) in
            (4..HEIGHT).step_by(5).flat_map(|v| (4..WIDTH).step_by(6).map(move |u| (u, v)))
        {
            let (z, number) = self.cast(frame, u, v);
            let now = [
                (u as f64 - RIG.center_u_px) * z / RIG.focal_px,
                (v as f64 - RIG.center_v_px) * z / RIG.focal_px,
                z,
            ];
            let motion = number.checked_sub(1).map_or([0.0; 2], |car| self.cars[car].motion);
            // The same point before: without the car's own motion, and the camera a step back.
            let before = [now[0] - motion[0], now[1], z - motion[1] + self.step_m];
            let mut noise = || (random.below(2001) as f32 / 1000.0 - 1.0) * self.noise_px;
            let [current_left, current_right] =
                project(now).map(|[u, v]| [u + noise(), v + noise()]);
            let [previous_left, previous_right] =
                project(before).map(|[u, v]| [u + noise(), v + noise()]);
            matches.push(Match { previous_left, previous_right, current_left, current_right });
        }
        matches
    }

    fn camera(&self, frame: u32) -> CameraMotion {
        CameraMotion {
            t_world_camera: Transform::from_translation([0.0, 0.0, self.camera_z(frame)]),
            t_current_previous: (frame > 0)
                .then(|| Transform::from_translation([0.0, 0.0, -self.step_m])),
        }
    }

    /// Runs `frames` frames, with the detections `detect` returns, and shows the tracks and the
    /// report of each.
    fn run(
        &self,
        frames: u32,
        detect: impl FnMut(u32) -> Vec<(PixelBox, Vec<u8>)>,
    ) -> Vec<(Vec<TrackReport>, SegmentationReport)> {
        self.run_with(WorldInput { matches_on_car: usize::MAX, images: None }, frames, detect)
    }

    fn run_with(
        &self,
        mut input: WorldInput<'_, '_>,
        frames: u32,
        mut detect: impl FnMut(u32) -> Vec<(PixelBox, Vec<u8>)>,
    ) -> Vec<(Vec<TrackReport>, SegmentationReport)> {
        let mut config = TrackingConfig::default();
        // No least sizes: the pictures are small.
        (config.instances.area_min_px, config.instances.track_area_min_px) = (0, 0);
        let segmentation = SegmentationConfig { enabled: true, ..SegmentationConfig::default() };
        let bytes = Tracker::bytes(&CAPACITY)
            + MotionSegmenter::bytes(&CAPACITY)
            + Estimator::bytes(&CAPACITY);
        let mut slab = vec![0u8; bytes + SLAB_ALIGN];
        let mut carver = Carver::new(&mut slab, bytes).unwrap();
        let mut tracker = Tracker::new_in(&CAPACITY, &config, &mut carver);
        let mut segmenter = MotionSegmenter::new_in(&CAPACITY, &mut carver);
        let mut estimator = Estimator::new_in(&CAPACITY, &mut carver);
        (0..frames)
            .map(|frame| {
                let (mut matches, disparity) = (
                    if frame > 0 { self.matches(frame) } else { Vec::new() },
                    self.disparity(frame),
                );
                input.thin(self, frame, &mut matches);
                if let Some(images) = &mut input.images {
                    self.push(frame, images);
                }
                let disparity_q8 = View::new(&disparity, WIDTH, HEIGHT).unwrap();
                let owned = detect(frame);
                let detections: Vec<Detection<'_>> = owned
                    .iter()
                    .map(|(pixels, mask)| Detection {
                        class: Class::Car,
                        score: 0.8,
                        left: pixels.left,
                        top: pixels.top,
                        width: pixels.width as u32,
                        height: pixels.height as u32,
                        mask,
                    })
                    .collect();
                let camera = self.camera(frame);
                // The segmentation reads the same matches as the tracker, and no sparse ones.
                let matches = FrameMatches { refined: &matches, sparse: &[] };
                let mut assigned =
                    tracker.detect(frame, &detections, [WIDTH, HEIGHT], matches).assign_matches();
                let search = input
                    .images
                    .as_deref()
                    .filter(|_| frame > 0)
                    .map(|matcher| GuidedMatching { matcher, disparity_q8 });
                let seen = SegmentationInput {
                    rig: &RIG,
                    camera: &camera,
                    disparity_q8,
                    ground: GroundPlane::find(&RIG, disparity_q8),
                    search,
                    bias_px: [config.motion.bias_px, config.motion.lens_px].map(f64::from),
                };
                let report = segmenter.segment(&segmentation, &seen, &mut assigned);
                assigned.estimate_motions(&RIG, &camera, None, &mut estimator).commit();
                (tracker.tracks().collect(), report)
            })
            .collect()
    }

    /// The mask of the first car, in its box.
    fn mask(&self, frame: u32) -> (PixelBox, Vec<u8>) {
        let on_car = |u: i32, v: i32| self.cast(frame, u as usize, v as usize).1 == 1;
        // Pixel by pixel, by the rays that meet the car.
        let pixels = || {
            (0..HEIGHT as i32)
                .flat_map(|v| (0..WIDTH as i32).map(move |u| (u, v)))
                .filter(|&(u, v)| on_car(u, v))
        };
        let (left, right) =
            (pixels().map(|(u, _)| u).min().unwrap(), pixels().map(|(u, _)| u).max().unwrap());
        let (top, bottom) =
            (pixels().map(|(_, v)| v).min().unwrap(), pixels().map(|(_, v)| v).max().unwrap());
        let mask = (top..=bottom)
            .flat_map(|v| (left..=right).map(move |u| (u, v)))
            .map(|(u, v)| u8::from(on_car(u, v)))
            .collect();
        (PixelBox { left, top, width: right + 1 - left, height: bottom + 1 - top }, mask)
    }

    /// Intersection over union of a box with the pixels of the first car.
    fn overlap(&self, frame: u32, pixels: &PixelBox) -> f32 {
        let on_car: Vec<(i32, i32)> = (0..WIDTH * HEIGHT)
            .filter(|at| self.cast(frame, at % WIDTH, at / WIDTH).1 == 1)
            .map(|at| ((at % WIDTH) as i32, (at / WIDTH) as i32))
            .collect();
        let both = on_car.iter().filter(|&&(u, v)| pixels.contains(u, v)).count() as i64;
        both as f32 / (on_car.len() as i64 + pixels.area() - both) as f32
    }
}

fn nothing(_: u32) -> Vec<(PixelBox, Vec<u8>)> {
    Vec::new()
}

const OVERTAKING: Car = Car { at: [2.5, 9.0], motion: [0.0, 1.4] };
const PARKED: Car = Car { at: [-3.0, 16.0], motion: [0.0, 0.0] };

#[test]
fn an_overtaking_car_is_found_in_the_third_frame_a_parked_one_never() {
    let world = World { cars: vec![OVERTAKING, PARKED], step_m: 0.8, noise_px: 0.2 };
    let frames = world.run(10, nothing);
    for (frame, (tracks, report)) in (0..).zip(&frames) {
        assert_eq!(tracks.len(), usize::from(frame > 1), "frame {frame}: {report:?}");
        let Some(track) = tracks.first() else { continue };
        assert_eq!(track.class, Class::MovingObject);
        let overlap = world.overlap(frame, &track.pixels);
        assert!(track.detected && overlap > 0.7, "frame {frame}: {overlap} {:?}", track.pixels);
    }
    let track = frames[9].0[0];
    assert_eq!(track.state, crate::tracking::MotionState::Dynamic);
    assert!((track.speed_m_s.unwrap()[0] - 14.0).abs() < 0.5, "{:?}", track.speed_m_s);
}

#[test]
fn where_nothing_moves_nothing_is_found() {
    for step_m in [0.0, 0.4, 1.2] {
        let world =
            World { cars: vec![PARKED, Car { at: [2.0, 12.0], ..PARKED }], step_m, noise_px: 0.3 };
        for (frame, (tracks, report)) in world.run(8, nothing).iter().enumerate() {
            assert_eq!(
                (tracks.len(), report.groups),
                (0, 0),
                "frame {frame} at {step_m} m: {report:?}"
            );
        }
    }
}

#[test]
fn joint_matches_find_a_car_that_keeps_its_distance() {
    // In the image it moves by two thirds of a pixel of disparity a frame, as much as one match
    // errs by.
    let leader = Car { at: [0.5, 18.0], motion: [0.0, 1.4] };
    let world = World {
        cars: vec![leader, Car { at: [-3.5, 26.0], ..PARKED }],
        step_m: 1.4,
        noise_px: 0.2,
    };
    for (frame, (tracks, report)) in world.run(8, nothing).iter().enumerate() {
        assert_eq!(tracks.len(), usize::from(frame > 1), "frame {frame}: {report:?}");
        for track in tracks {
            assert!(
                world.overlap(frame as u32, &track.pixels) > 0.5,
                "frame {frame}: {:?}",
                track.pixels
            );
        }
    }
}

#[test]
fn a_mask_does_not_grow_over_matches_that_do_not_move() {
    // Both cars are at one distance, a metre apart.
    let parked = Car { at: [5.3, 14.0], motion: [0.0, 0.0] };
    let world = World {
        cars: vec![Car { at: [2.5, 14.0], motion: [0.0, 0.0] }, parked],
        step_m: 0.0,
        noise_px: 0.0,
    };
    let (disparity, [middle, beside]) =
        (world.disparity(0), [2.5, 5.3].map(|x| project([x, 1.0, 14.0])[0]));
    let lattice = Lattice::new(&RIG, View::new(&disparity, WIDTH, HEIGHT).unwrap(), None);
    let (mut cells, mut blocked, mut queue) = (vec![0; 3000], vec![0; 3000], vec![0; 3000]);
    let extent = extent::Extent { low: [1.7, 0.3, 13.9], high: [5.4, 1.5, 14.1] };
    let mut is_marked = |blocked: &[u8]| {
        lattice.grow(&extent, blocked, &mut cells, &mut queue).unwrap();
        [middle, beside].map(|[u, v]| lattice.is_own(&cells, u as i32, v as i32))
    };
    assert_eq!(is_marked(&blocked), [true, true]);
    for at in (40..HEIGHT)
        .flat_map(|v| (0..WIDTH).map(move |u| [u as f32, v as f32]))
        .filter(|[u, _]| *u > 285.0)
    {
        lattice.block(
            [at[0], at[1], (RIG.focal_baseline_px_m() / 14.0) as f32],
            false,
            &mut blocked,
        );
    }
    assert_eq!(is_marked(&blocked), [true, false]);
    // A match that moves frees its cell again, one of another disparity does not.
    let [u, v] = beside;
    lattice.block([u, v, 90.0], true, &mut blocked);
    assert_eq!(is_marked(&blocked), [true, false]);
    lattice.block([u, v, (RIG.focal_baseline_px_m() / 14.0) as f32], true, &mut blocked);
    assert_eq!(is_marked(&blocked), [true, true]);
}

#[test]
fn a_mask_reaches_the_left_border_where_only_the_left_camera_sees() {
    // A car 8 m ahead, cut by the border; so near the border that its disparity of 18.75 px is
    // missing, and farther from it than that explains.
    for (unseen, left) in [(24, 0), (60, 60)] {
        let disparity = |at: usize| match (at % WIDTH, at / WIDTH) {
            (u, _) if u < unseen => 0,
            (u, v) if u < 100 && (30..90).contains(&v) => 4_800,
            _ => 1_024,
        };
        let disparity_q8: Vec<u16> = (0..WIDTH * HEIGHT).map(disparity).collect();
        let lattice = Lattice::new(&RIG, View::new(&disparity_q8, WIDTH, HEIGHT).unwrap(), None);
        let extent = extent::Extent { low: [-5.2, -0.5, 7.9], high: [-2.7, 1.0, 8.1] };
        let mut working = (vec![0; cells(&CAPACITY)], vec![0; cells(&CAPACITY)]);
        let pixels = lattice.grow(&extent, &[], &mut working.0, &mut working.1).unwrap();
        assert_eq!((pixels.left, pixels.left + pixels.width), (left, 100), "{pixels:?}");
    }
}

#[test]
fn a_masked_car_is_not_found_twice() {
    let world = World { cars: vec![OVERTAKING], step_m: 0.8, noise_px: 0.2 };
    let mask = |frame: u32| vec![world.mask(frame)];
    for (frame, (tracks, report)) in world.run(6, mask).iter().enumerate() {
        assert_eq!((tracks.len(), report.instances), (1, 0), "frame {frame}: {report:?}");
    }
}

#[test]
fn a_detector_that_comes_later_takes_the_track_over() {
    let world = World { cars: vec![OVERTAKING], step_m: 0.8, noise_px: 0.2 };
    let mask = |frame: u32| if frame < 5 { Vec::new() } else { vec![world.mask(frame)] };
    let frames = world.run(8, mask);
    let (tracks, report) = &frames[7];
    assert_eq!(
        (tracks.len(), tracks[0].id, tracks[0].class, report.instances),
        (1, 1, Class::Car, 0)
    );
}

#[test]
fn a_car_that_is_hidden_from_the_matches_is_predicted_for_three_frames() {
    // The car moves for three frames, and stands from then on.
    let world = World { cars: vec![OVERTAKING], step_m: 0.8, noise_px: 0.2 };
    let static_world =
        World { cars: vec![Car { motion: [0.0, 0.0], ..OVERTAKING }], step_m: 0.8, noise_px: 0.2 };
    let mut storage = vec![Hypothesis::default(); MAX_HYPOTHESES];
    let mut hypotheses = Hypotheses::new(&mut storage);
    let config = SegmentationConfig::default();
    let model = |camera: &CameraMotion| {
        StaticModel::new(&config, &RIG, &camera.t_current_previous.unwrap(), [0.25, 0.0])
    };
    let bytes = MotionSegmenter::bytes(&CAPACITY);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let mut carver = Carver::new(&mut slab, bytes).unwrap();
    let mut segmenter = MotionSegmenter::new_in(&CAPACITY, &mut carver);
    core::mem::swap(&mut segmenter.hypotheses, &mut hypotheses);
    let mut confirmed = Vec::new();
    for frame in 1..9 {
        let shown = if frame < 4 { &world } else { &static_world };
        let (camera, matches) = (shown.camera(frame), shown.matches(frame));
        let codes = vec![OwnerCode::default(); matches.len()];
        let disparity = shown.disparity(frame);
        let lattice = Lattice::new(&RIG, View::new(&disparity, WIDTH, HEIGHT).unwrap(), None);
        let contradictions = Contradictions {
            model: &model(&camera),
            t_world_camera: &camera.t_world_camera,
            refined: Owned { matches: &matches, codes: &codes, variance: 1.0 },
            sparse: Owned { matches: &[], codes: &[], variance: SPARSE_VARIANCE },
            lattice: &lattice,
        };
        // Without images: matches alone.
        segmenter.observe(&contradictions, None);
        confirmed.push(
            segmenter.hypotheses.all().iter().filter(|hypothesis| hypothesis.is_shown()).count(),
        );
    }
    // Confirmed in the second frame, and predicted three frames beyond the third.
    assert_eq!(confirmed, [0, 1, 1, 1, 1, 1, 0, 0]);
}
