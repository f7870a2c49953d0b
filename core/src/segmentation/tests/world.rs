//! A world of moving and parked cars, and a tracker that is run in it.

use super::*;

pub(super) const WIDTH: usize = 400;
pub(super) const HEIGHT: usize = 120;
pub(super) const RIG: StereoRig =
    StereoRig { focal_px: 300.0, center_u_px: 200.0, center_v_px: 50.0, baseline_m: 0.5 };
pub(super) const CAPACITY: Capacity =
    Capacity { image_width: WIDTH, image_height: HEIGHT, ..Capacity::TINY };
/// Height of the camera above the ground, m.
pub(super) const GROUND_M: f64 = 1.6;

/// A box whose front is 1.8 m wide and 1.4 m high, on the ground at `[x, z]`.
#[derive(Clone, Copy)]
pub(super) struct Car {
    pub(super) at: [f64; 2],
    pub(super) motion: [f64; 2],
}

impl Car {
    pub(super) fn at_frame(&self, frame: u32) -> [f64; 2] {
        let [x, z] = self.at;
        let [dx, dz] = self.motion.map(|motion| motion * f64::from(frame));
        [x + dx, z + dz]
    }
}

pub(super) fn project([x, y, z]: [f64; 3]) -> [[f32; 2]; 2] {
    let per_m = RIG.focal_px / z;
    let (u, v) = (x * per_m + RIG.center_u_px, y * per_m + RIG.center_v_px);
    [[u as f32, v as f32], [(u - RIG.baseline_m * per_m) as f32, v as f32]]
}

/// Input of a tracker in a world.
pub(super) struct WorldInput<'i, 's> {
    /// Matches on each car, at most.
    pub(super) matches_on_car: usize,
    /// Images, where patches are searched for.
    pub(super) images: Option<&'i mut FlowMatcher<'s>>,
}

impl WorldInput<'_, '_> {
    pub(super) fn thin(&self, world: &World, frame: u32, matches: &mut Vec<Match>) {
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
pub(super) struct World {
    pub(super) cars: Vec<Car>,
    pub(super) step_m: f64,
    pub(super) noise_px: f32,
}

impl World {
    pub(super) fn camera_z(&self, frame: u32) -> f64 {
        self.step_m * f64::from(frame)
    }

    /// Depth and what is seen at a pixel: 0 the background, n the n-th car.
    pub(super) fn cast(&self, frame: u32, u: usize, v: usize) -> (f64, usize) {
        self.cast_from(0.0, frame, [u as f64, v as f64])
    }

    /// Casts a ray from a camera moved to the right.
    pub(super) fn cast_from(&self, right_m: f64, frame: u32, [u, v]: [f64; 2]) -> (f64, usize) {
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

    pub(super) fn disparity(&self, frame: u32) -> Vec<u16> {
        let of = |at: usize| {
            (RIG.focal_baseline_px_m() / self.cast(frame, at % WIDTH, at / WIDTH).0 * 256.0) as u16
        };
        (0..WIDTH * HEIGHT).map(of).collect()
    }

    /// Matches from the frame before, on a grid of the current frame.
    pub(super) fn matches(&self, frame: u32) -> Vec<Match> {
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

    pub(super) fn camera(&self, frame: u32) -> CameraMotion {
        CameraMotion {
            t_world_camera: Transform::from_translation([0.0, 0.0, self.camera_z(frame)]),
            t_current_previous: (frame > 0)
                .then(|| Transform::from_translation([0.0, 0.0, -self.step_m])),
        }
    }

    /// Runs `frames` frames, with the detections `detect` returns, and shows the tracks and the
    /// report of each.
    pub(super) fn run(
        &self,
        frames: u32,
        detect: impl FnMut(u32) -> Vec<(PixelBox, Vec<u8>)>,
    ) -> Vec<(Vec<TrackReport>, SegmentationReport)> {
        self.run_with(WorldInput { matches_on_car: usize::MAX, images: None }, frames, detect)
    }

    pub(super) fn run_with(
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
                let detections: Vec<Detection<'_>> = owned.iter().map(detection).collect();
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
                    map: None,
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
    pub(super) fn mask(&self, frame: u32) -> (PixelBox, Vec<u8>) {
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
    pub(super) fn overlap(&self, frame: u32, pixels: &PixelBox) -> f32 {
        let on_car: Vec<(i32, i32)> = (0..WIDTH * HEIGHT)
            .filter(|at| self.cast(frame, at % WIDTH, at / WIDTH).1 == 1)
            .map(|at| ((at % WIDTH) as i32, (at / WIDTH) as i32))
            .collect();
        let both = on_car.iter().filter(|&&(u, v)| pixels.contains(u, v)).count() as i64;
        both as f32 / (on_car.len() as i64 + pixels.area() - both) as f32
    }
}

/// A car in a box, with its mask.
fn detection(masked: &(PixelBox, Vec<u8>)) -> Detection<'_> {
    let (PixelBox { left, top, width, height }, mask) = masked;
    let (left, top, width, height) = (*left, *top, *width, *height);
    let (width, height) = (width as u32, height as u32);
    Detection { class: Class::Car, score: 0.8, left, top, width, height, mask }
}
