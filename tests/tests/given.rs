//! Depth and poses from outside take the place of the core's own, within its limits.

use dynvox_core::stereo::StereoStatus;
use dynvox_core::{
    Capacity, Mapper, PoseOrigin, Report, Serial, StepError, geometry::Transform, image::View,
};
use dynvox_tests::{Clip, HeapSlab};

const SIZE: (usize, usize) = (320, 96);

/// Steps the street's frames with the given disparities, all of one image.
fn reports(frames: usize, disparity: impl Fn(usize, usize) -> u16) -> Vec<Report> {
    let clip = Clip::street(SIZE.0 as u32, SIZE.1 as u32, frames as u32);
    let given: Vec<u16> =
        (0..SIZE.0 * SIZE.1).map(|at| disparity(at % SIZE.0, at / SIZE.0)).collect();
    clip.with_mapper(&Capacity::TINY, |mapper| {
        let steps = clip.stereo().map(|frame| {
            let disparity_q8 = View::new(&given, SIZE.0, SIZE.1);
            mapper
                .step(&dynvox_core::StereoFrame { disparity_q8, ..frame }, &Serial)
                .expect("a good frame")
        });
        steps.collect()
    })
}

#[test]
fn given_disparity_is_fused_in_place_of_the_pairs_own_within_near_and_far() {
    let rig = Clip::street(SIZE.0 as u32, SIZE.1 as u32, 1).config().rig;
    let at_m = |depth_m: f64| (rig.focal_baseline_px_m() / depth_m * 256.0) as u16;
    // A wall of 40 x 20 px, and nothing else.
    let wall =
        reports(
            1,
            |u, v| if (100..140).contains(&u) && (40..60).contains(&v) { at_m(10.0) } else { 0 },
        )[0];
    assert_eq!(
        (wall.stereo.status, wall.stereo.valid, wall.stereo.refused),
        (StereoStatus::Given, 800, 0)
    );
    assert!(
        (5..200).contains(&wall.blocks.used),
        "{} blocks: only the wall is there",
        wall.blocks.used
    );
    // A disparity counts as valid, even where its depth is not fused.
    for (depth_m, why) in [(0.4, "nearer than near"), (25.0, "beyond far")] {
        let beyond = reports(1, |_, _| at_m(depth_m))[0];
        assert_eq!((beyond.stereo.valid > 0, beyond.blocks.used), (true, 0), "{why}");
    }
}

#[test]
fn disparities_wider_than_the_image_are_refused_and_counted() {
    let clip = Clip::street(64, 64, 1);
    let mut given = vec![0u16; 64 * 64];
    (given[10], given[11]) = (64 * 256 - 1, 64 * 256);
    let report = clip.with_mapper(&Capacity::TINY, |mapper| {
        let frame = clip.stereo().next().expect("a frame");
        mapper
            .step(
                &dynvox_core::StereoFrame { disparity_q8: View::new(&given, 64, 64), ..frame },
                &Serial,
            )
            .expect("a good frame")
    });
    assert_eq!((report.stereo.refused, report.stereo.valid), (1, 1));
}

#[test]
fn given_poses_are_part_of_the_inputs_digest() {
    let [a, b] = [0, 1]
        .map(|more| reports(3, move |u, v| if (u, v) == (100, 50) { 2_000 + more } else { 2_000 }));
    assert!(a.iter().zip(&b).all(|(a, b)| a.digests.input != b.digests.input));
    assert!(
        a[2].pose == PoseOrigin::Estimated && a[2].t_world_camera.translation_m[2] > 0.5,
        "the camera is followed on the images"
    );
}

#[test]
fn wrong_sizes_and_poses_that_are_none_are_refused_and_change_nothing() {
    let clip = Clip::street(SIZE.0 as u32, SIZE.1 as u32, 2);
    let small = vec![0u16; 100 * 96];
    clip.with_mapper(&Capacity::TINY, |mapper| {
        let frames: Vec<_> = clip.stereo().collect();
        let wrong =
            dynvox_core::StereoFrame { disparity_q8: View::new(&small, 100, 96), ..frames[0] };
        assert_eq!(mapper.step(&wrong, &Serial).err(), Some(StepError::SizesDiffer));
        let mut with_pose = |pose| {
            mapper
                .step(
                    &dynvox_core::StereoFrame { t_world_camera: Some(pose), ..frames[0] },
                    &Serial,
                )
                .err()
        };
        assert_eq!(
            with_pose(Transform::from_translation([f64::NAN, 0.0, 0.0])),
            Some(StepError::PoseNotFinite)
        );
        // A quaternion of another length is no rotation; squares of these lengths leave the range.
        for length in [0.0, 1e-200, 1e200] {
            let pose = Transform { rotation: [0.0, 0.0, 0.0, length], ..Transform::IDENTITY };
            assert_eq!(with_pose(pose), Some(StepError::PoseNotRotation), "{length}");
        }
        for beyond_m in [1e300, -1e300, 1e18, 2e4] {
            let pose = Transform::from_translation([0.0, 0.0, beyond_m]);
            assert_eq!(with_pose(pose), Some(StepError::PoseBeyondMap), "{beyond_m} m");
        }
        // Refused frames leave no trace: the next one is the first.
        assert_eq!(mapper.step(&frames[0], &Serial).map(|report| report.frame), Ok(0));
    });
}

#[test]
fn given_poses_are_where_the_camera_is_and_change_what_the_map_holds() {
    let clip = Clip::street(SIZE.0 as u32, SIZE.1 as u32, 3);
    let run = |shift_m: f64| -> Vec<Report> {
        let mut slab = HeapSlab::of(&Capacity::TINY);
        let mut mapper =
            Mapper::new(&Capacity::TINY, &clip.config(), slab.bytes()).expect("a slab that fits");
        let steps = (0i32..).zip(clip.stereo()).map(|(at, frame)| {
            let pose = Transform::from_translation([7.0, 0.0, shift_m * f64::from(at)]);
            mapper
                .step(&dynvox_core::StereoFrame { t_world_camera: Some(pose), ..frame }, &Serial)
                .expect("a good frame")
        });
        steps.collect()
    };
    // Two speeds, so that the map and not only the pose depends on them.
    let (slow, fast) = (run(0.8), run(0.9));
    assert_eq!(
        slow.iter().map(|report| report.pose).collect::<Vec<_>>(),
        [PoseOrigin::First, PoseOrigin::Given, PoseOrigin::Given]
    );
    assert_eq!(slow[2].t_world_camera.translation_m, [7.0, 0.0, 1.6]);
    assert!(slow.iter().all(|report| report.egomotion.is_none() && report.fused));
    assert!(slow[2].digest != fast[2].digest && slow[2].digests.input != fast[2].digests.input);
}
