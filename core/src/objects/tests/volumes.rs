//! What gets into an object's volume, and what goes out of it.

use super::*;
use crate::objects::crop::CropSource;
use crate::{masks::MaskHandle, parallel::Vectors, volume::BlockCoord};

const SMALL: Board = Board { half_m: [0.8, 0.5], ..Board::CAR };
/// Board as a mask twice too wide shows it.
const WIDE: Board = Board { half_m: [1.6, 0.5], ..Board::CAR };

/// A volume's blocks, and the greatest weight of a voxel in it.
fn content(instances: &Instances<'_>) -> (Vec<BlockCoord>, u8) {
    let Some((_, object)) = instances.objects().next() else { return (Vec::new(), 0) };
    let blocks = object.volume().blocks();
    let slots = || object.volume().pool().live();
    let heaviest = slots().filter_map(|slot| blocks.weight(slot)?.iter().max().copied()).max();
    (slots().filter_map(|slot| blocks.coord(slot)).collect(), heaviest.unwrap_or(0))
}

/// Shows a parked car, too wide in the frames `wide` says; the blocks after each frame and what the
/// sink gets in the end.
fn parked(frames: u32, z: f64, wide: impl Fn(u32) -> bool) -> (Vec<usize>, usize) {
    with(&CAPACITY, &known_in_the_fourth_frame(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let blocks = (0..frames)
            .map(|frame| {
                let board = if wide(frame) { &WIDE } else { &SMALL };
                run.step(Transform::IDENTITY, &[(board, Some(shift(0.0, 0.0, z)))]);
                content(run.instances).0.len()
            })
            .collect();
        run.instances.finish(&mut run.sink);
        assert_eq!(run.instances.objects.volumes.blocks(), 0, "what was handed over is empty");
        (blocks, run.sink.0[0].2)
    })
}

#[test]
fn voxels_seen_once_go_every_fourth_frame_and_at_the_end() {
    // Known to stand in frame 3: the volume's first frame; the seventh is its fourth.
    let (blocks, _) = parked(8, 15.0, |frame| frame == 5);
    let (careful, _) = parked(8, 15.0, |_| false);
    assert_eq!(blocks[..5], careful[..5]);
    assert!(blocks[5] > blocks[4], "{blocks:?}");
    assert_eq!(blocks[6], careful[6], "it was a mistake");
    let (blocks, handed) = parked(9, 15.0, |frame| frame == 8);
    let (careful, expected) = parked(9, 15.0, |_| false);
    assert!(blocks[8] > careful[8]);
    assert_eq!(handed, expected);
}

#[test]
fn what_was_seen_once_from_near_stays() {
    let (blocks, handed) = parked(8, 9.0, |frame| frame == 5);
    let (careful, expected) = parked(8, 9.0, |_| false);
    assert!(blocks[7] > careful[7] && handed > expected, "{blocks:?} {careful:?}");
}

#[test]
fn of_an_object_seen_but_for_a_moment_everything_is_handed_over() {
    let (blocks, handed) = parked(6, 15.0, |frame| frame == 5);
    let (careful, expected) = parked(6, 15.0, |_| false);
    assert!(blocks[5] > careful[5] && handed > expected, "{handed} and {expected} blocks");
}

#[test]
fn each_crop_that_waited_is_fused_once() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for _ in 0..4 {
            run.step(Transform::IDENTITY, &[(&SMALL, Some(shift(0.0, 0.0, 9.0)))]);
        }
        assert_eq!(
            (content(run.instances).1, run.instances.objects.crops.len()),
            (40, 0),
            "three that waited and this frame's, each of weight 10"
        );
    });
}

#[test]
fn a_volume_lies_where_the_object_is() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        for _ in 0..4 {
            run.step(Transform::IDENTITY, &[(&SMALL, Some(shift(2.0, -0.6, 9.0)))]);
        }
        // 1.2 to 2.8 m to the right, -1.1 to -0.1 m down, 9 m ahead and 20 cm to either side; in
        // blocks of 40 cm, the nearest lattice point's.
        let blocks = content(run.instances).0;
        let range = |of: fn(&BlockCoord) -> i16| {
            (blocks.iter().map(of).min().unwrap(), blocks.iter().map(of).max().unwrap())
        };
        assert_eq!(
            (range(|at| at.x), range(|at| at.y), range(|at| at.z)),
            ((2, 7), (-3, -1), (22, 23))
        );
    });
}

#[test]
fn a_static_object_is_fused_where_it_was_seen_in_the_world() {
    // With these bounds every motion counts as static.
    let state = StateConfig {
        dynamic_m_s: 50.0,
        static_m_s: 50.0,
        slow_m_s: 50.0,
        ..StateConfig::default()
    };
    with(
        &Capacity { object_blocks: 2000, ..CAPACITY },
        &TrackingConfig { state, ..any_size() },
        |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for frame in 0..4 {
                run.step(
                    Transform::IDENTITY,
                    &[(&SMALL, Some(shift(0.0, 0.0, 8.0 + 0.8 * f64::from(frame))))],
                );
            }
            assert_eq!(run.track(1).unwrap().state, MotionState::Static);
            let mut layers: Vec<i16> = content(run.instances).0.iter().map(|at| at.z).collect();
            layers.sort_unstable();
            layers.dedup();
            assert_eq!(layers, (19..=26).collect::<Vec<_>>(), "four positions 80 cm apart");
        },
    );
}

#[test]
fn beyond_twenty_metres_nothing_is_fused() {
    let blocks = |z: f64| {
        with(&CAPACITY, &any_size(), |instances, estimator| {
            let mut run = Run::new(instances, estimator);
            for _ in 0..5 {
                run.step(Transform::IDENTITY, &[(&Board::CAR, Some(shift(0.0, 0.0, z)))]);
            }
            assert_eq!(run.instances.objects().count(), 1);
            content(run.instances).0.len()
        })
    };
    assert!(blocks(18.0) > 0);
    assert_eq!(blocks(22.0), 0);
}

#[test]
fn a_post_before_a_car_is_no_part_of_it() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut run = Run::new(instances, estimator);
        let post = Board { half_m: [0.05, 0.2], points: 0, ..Board::CAR };
        for _ in 0..5 {
            run.step_behind(
                Transform::IDENTITY,
                &[(&Board::CAR, Some(shift(0.0, 0.0, 10.0)))],
                &[(&post, Some(shift(0.0, 0.0, 4.0)))],
            );
        }
        let nearest = content(run.instances).0.iter().map(|at| at.z).min();
        assert_eq!(nearest, Some(24), "9.6 m");
    });
}

/// The columns that are left of a crop 60 px wide whose mask is its left 54, of a picture with
/// these disparities, px, in each row.
fn cropped(disparity_px: impl Fn(i32) -> f64) -> Vec<i32> {
    let pixels = PixelBox { left: 20, top: 10, width: 60, height: 30 };
    let mut words = vec![0; 1000];
    let mut store = MaskStore::new(&mut words);
    let mask = store.alloc(pixels).unwrap();
    (10..40).for_each(|v| store.set_row(&mask, v, 20, &[1; 54]));
    let row: Vec<u16> = (0..WIDTH as i32).map(|u| (disparity_px(u - 20) * 256.0) as u16).collect();
    let disparity = row.repeat(HEIGHT);
    let mut crop = vec![7u16; pixels.area() as usize];
    let source = CropSource {
        rig: &RIG,
        extent_m: 5.0,
        disparity_q8: View::new(&disparity, WIDTH, HEIGHT).unwrap(),
        masks: &store,
        mask: &mask,
    };
    let kept = source.copy_into(&mut crop, Vectors::detect());
    let columns = |row: &[u16]| (0..60).filter(|&u| row[u as usize] > 0).collect::<Vec<i32>>();
    let first = columns(&crop[..60]);
    assert!(crop.chunks_exact(60).all(|row| columns(row) == first));
    assert_eq!(kept, 30 * first.len() as u32);
    first
}

#[test]
fn a_crop_is_what_lies_under_the_mask_and_near_the_middle_depth() {
    // Stripes at 10, 14, 16, 6, 4 and again 10 m, with nothing known between.
    let depth_m = |u: i32| match u {
        0..20 | 53..60 => 10.0,
        24..28 => 14.0,
        32..36 => 16.0,
        40..44 => 6.0,
        48..50 => 4.0,
        _ => f64::INFINITY,
    };
    let expected: Vec<i32> = (0..20).chain(24..28).chain(40..44).chain([53]).collect();
    assert_eq!(cropped(|u| 150.0 / depth_m(u)), expected);
}

#[test]
fn disparities_that_run_on_behind_an_edge_are_left_out_not_slopes() {
    // 1.6 px from surface to surface, then 1.4.
    let step =
        |height_px: f64| cropped(|u| if (20..40).contains(&u) { 15.0 + height_px } else { 15.0 });
    assert_eq!(step(1.6), (0..17).chain(20..40).chain(43..54).collect::<Vec<_>>());
    assert_eq!(step(1.4), (0..54).collect::<Vec<_>>());
    assert_eq!(
        cropped(|u| 14.0 + 0.3 * f64::from(u)),
        (0..54).collect::<Vec<_>>(),
        "the side of a car seen from behind"
    );
}

/// A crop the obvious way: pixel by pixel.
fn plain_crop(
    extent_m: f64,
    disparity: View<'_, u16>,
    is_set: impl Fn(i32, i32) -> bool,
    pixels: &PixelBox,
) -> Vec<u16> {
    let at = |u: i32, v: i32| {
        usize::try_from(u)
            .ok()
            .zip(usize::try_from(v).ok())
            .and_then(|(u, v)| disparity.get(u, v))
            .unwrap_or(0)
    };
    let pixels_of_box = (0..pixels.area() as i32)
        .map(|i| (pixels.left + i % pixels.width, pixels.top + i / pixels.width));
    let masked: Vec<_> =
        pixels_of_box.map(|(u, v)| (u, v, if is_set(u, v) { at(u, v) } else { 0 })).collect();
    let mut known: Vec<u16> = masked
        .iter()
        .map(|pixel| pixel.2 / 128)
        .zip(&masked)
        .filter(|(_, pixel)| pixel.2 > 0)
        .map(|(bin, _)| bin)
        .collect();
    known.sort_unstable();
    let bin = if known.is_empty() { 0 } else { known[known.len() / 2] };
    let depth_m = RIG.focal_baseline_px_m() / ((f64::from(bin) + 0.5) * 0.5);
    let is_near = |disparity: u16| {
        let disparity = f64::from(disparity);
        let of = |depth_m: f64| RIG.focal_baseline_px_m() / depth_m * 256.0;
        disparity >= of(depth_m + extent_m).floor()
            && (depth_m <= extent_m || disparity <= of(depth_m - extent_m).floor())
    };
    let is_behind_edge = |u: i32, v: i32, disparity: u16| {
        let nearer = |u: i32, v: i32| i32::from(at(u, v)) > i32::from(disparity) + 384;
        (1..=3).any(|px| {
            nearer(u - px, v) || nearer(u + px, v) || nearer(u, v - px) || nearer(u, v + px)
        })
    };
    let kept = |&(u, v, disparity): &(i32, i32, u16)| {
        if is_near(disparity) && !is_behind_edge(u, v, disparity) { disparity } else { 0 }
    };
    masked.iter().map(kept).collect()
}

/// Disparities in runs of similar ones, with pixels without any; the steps grow with the round.
fn stepped_disparities(random: &mut Random, round: u32) -> Vec<u16> {
    let mut level = 0;
    let mut pixel = || {
        let steps = random.below(12) == 0;
        level = if steps { 1_000 + random.below(1 + round * 15) } else { level };
        if random.below(30) == 0 { 0 } else { (level + random.below(200)) as u16 }
    };
    (0..WIDTH * HEIGHT).map(|_| pixel()).collect()
}

#[test]
fn crops_equal_those_cut_pixel_by_pixel() {
    let mut random = Random::new(5);
    let mut kept = 0;
    for round in 0..200 {
        let disparity = stepped_disparities(&mut random, round);
        let disparity = View::new(&disparity, WIDTH, HEIGHT).unwrap();
        let mut span = |size: usize| {
            let first = random.below(size as u32 / 2);
            let last = if random.below(3) == 0 {
                size as u32
            } else {
                first + 1 + random.below(size as u32 / 2)
            };
            [
                first as i32,
                (last - if random.below(3) == 0 { 0 } else { first }).min(size as u32 - first)
                    as i32,
            ]
        };
        let ([left, width], [top, height]) = (span(WIDTH), span(HEIGHT));
        let pixels = PixelBox { left, top, width, height };
        let mut words = vec![0; 8 * HEIGHT];
        let mut store = MaskStore::new(&mut words);
        let boxed = round % 4 == 0;
        let mask = if boxed { MaskHandle::full(pixels) } else { store.alloc(pixels).unwrap() };
        if !boxed {
            let bits: Vec<u8> =
                (0..WIDTH * HEIGHT).map(|_| u8::from(random.below(8) > 0)).collect();
            (0..HEIGHT)
                .for_each(|v| store.set_row(&mask, v as i32, 0, &bits[v * WIDTH..][..WIDTH]));
        }
        for vectors in Vectors::available() {
            let mut crop = vec![7u16; pixels.area() as usize];
            let source = CropSource {
                rig: &RIG,
                extent_m: 3.0,
                disparity_q8: disparity,
                masks: &store,
                mask: &mask,
            };
            let count = source.copy_into(&mut crop, vectors);
            assert_eq!(
                crop,
                plain_crop(3.0, disparity, |u, v| store.contains(&mask, u, v), &pixels),
                "round {round}"
            );
            assert_eq!(count as usize, crop.iter().filter(|disparity| **disparity > 0).count());
            kept += count;
        }
    }
    assert!(kept > 10_000, "{kept}");
}

#[test]
fn an_object_without_depth_leaves_no_crop() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut shot = Scene::default().shoot(
            Transform::IDENTITY,
            &[(&Board::CAR, Some(shift(0.0, 0.0, 9.0)))],
            &[],
        );
        shot.disparity_q8.fill(0);
        instances.take(&shot, true, estimator, &mut NoSink);
        assert_eq!((instances.tracks().count(), instances.objects.crops.len()), (1, 0));
    });
}
