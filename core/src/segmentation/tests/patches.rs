//! Patches of the images where matches are few.

use super::super::patches::PatchMemory;
use super::*;
use crate::{
    parallel::Serial,
    scene_flow::{SceneFlowConfig, test_scene},
};
use nalgebra::Point3;

/// Runs `test` with a matcher that has seen nothing.
fn with_matcher<R>(test: impl FnOnce(&mut FlowMatcher<'_>) -> R) -> R {
    let bytes = FlowMatcher::bytes(&CAPACITY);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let mut carver = Carver::new(&mut slab, bytes).unwrap();
    test(&mut FlowMatcher::new_in(&CAPACITY, &mut carver))
}

impl World {
    /// Renders the image of a camera moved to the right: textures that lie still on the background
    /// and on each car.
    fn image(&self, right_m: f64, frame: u32) -> Vec<u8> {
        let pixel = |at: usize| {
            let [u, v] = [at % WIDTH, at / WIDTH].map(|at| at as f64);
            let (z, number) = self.cast_from(right_m, frame, [u, v]);
            let [x, y] = [
                (u - RIG.center_u_px) / RIG.focal_px * z + right_m,
                (v - RIG.center_v_px) / RIG.focal_px * z,
            ];
            let [car_x, car_z] =
                number.checked_sub(1).map_or([0.0; 2], |car| self.cars[car].at_frame(frame));
            test_scene::grey(Point3::new(
                // Textures are fixed to the ground and to each car, and each car has its own.
                x - car_x,
                y,
                z + self.camera_z(frame) - car_z + 20.0 * number as f64,
            ))
            .round() as u8
        };
        (0..WIDTH * HEIGHT).map(pixel).collect()
    }

    /// Shows both images of a frame to a matcher.
    pub(super) fn push(&self, frame: u32, matcher: &mut FlowMatcher<'_>) {
        let [left, right] = [0.0, RIG.baseline_m].map(|right_m| self.image(right_m, frame));
        let [left, right] = [&left, &right].map(|image| View::new(image, WIDTH, HEIGHT).unwrap());
        matcher.push(&SceneFlowConfig::default(), left, right, &Serial);
    }

    /// Tracks by frame where each car has so many matches, with or without images.
    fn tracks(&self, matches_on_car: usize, with_images: bool) -> Vec<Vec<TrackReport>> {
        with_matcher(|matcher| {
            let input = WorldInput { matches_on_car, images: with_images.then_some(matcher) };
            self.run_with(input, 8, nothing).into_iter().map(|(tracks, _)| tracks).collect()
        })
    }
}

#[test]
fn patches_find_a_car_with_few_matches_and_no_parked_one() {
    let world = World { cars: vec![OVERTAKING, PARKED], step_m: 0.8, noise_px: 0.1 };
    assert!(world.tracks(4, false).iter().all(Vec::is_empty), "four matches are no group");
    for matches_on_car in [4, usize::MAX] {
        for (frame, tracks) in (0..).zip(&world.tracks(matches_on_car, true)).skip(3) {
            assert_eq!(tracks.len(), 1, "frame {frame} of {matches_on_car} matches");
            let overlap = world.overlap(frame, &tracks[0].pixels);
            assert!(
                overlap > 0.6,
                "frame {frame} of {matches_on_car} matches: {overlap} {:?}",
                tracks[0].pixels
            );
        }
    }
}

#[test]
fn a_supposed_car_is_found_only_where_the_images_show_its_motion() {
    let overtaking = World { cars: vec![OVERTAKING], step_m: 0.8, noise_px: 0.1 };
    let parked = World { cars: vec![Car { motion: [0.0; 2], ..OVERTAKING }], ..overtaking };
    // The extent is where the car is in this frame.
    for (world, extent_z_m, moves) in [(overtaking, 9.6, true), (parked, 8.2, false)] {
        with_matcher(|matcher| {
            for frame in 0..2 {
                world.push(frame, matcher);
            }
            let disparity = world.disparity(1);
            let disparity_q8 = View::new(&disparity, WIDTH, HEIGHT).unwrap();
            let t_current_previous = world.camera(1).t_current_previous.unwrap();
            let config = SegmentationConfig::default();
            let model = StaticModel::new(&config, &RIG, &t_current_previous, [0.25, 0.0]);
            let lattice = Lattice::new(&RIG, disparity_q8, None);
            let mut search = PatchSearch::new(
                GuidedMatching { matcher, disparity_q8 },
                &t_current_previous,
                &lattice,
            );
            let (mut cells, mut queue) = (vec![0; cells(&CAPACITY)], vec![0; cells(&CAPACITY)]);
            let (mut members, mut values) =
                (vec![Candidate::default(); MAX_PATCHES], vec![0.0; MAX_CANDIDATES]);
            // The space about the car, 20 cm deep.
            let extent = extent::Extent {
                low: [1.8, 0.4, extent_z_m - 0.1],
                high: [3.2, 1.4, extent_z_m + 0.1],
            };
            let mut is_found = |motion_m: [f64; 3], known: bool| {
                let mut memory = PatchMemory {
                    cells: &mut cells,
                    queue: &mut queue,
                    members: &mut members,
                    values: &mut values,
                };
                search
                    .verify(&model, &Seed::new(&extent, motion_m.into()).known(known), &mut memory)
                    .is_some()
            };
            for known in [false, true] {
                assert_eq!(
                    is_found([0.0, 0.0, 1.4], known),
                    moves,
                    "of a car that moves: {moves}, known: {known}"
                );
                // The search must not find what was only supposed.
                assert!(
                    !is_found([1.4, 0.0, 0.0], known),
                    "of a car that does not move to the side, known: {known}"
                );
            }
        });
    }
}
