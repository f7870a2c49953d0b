//! What gets into an object's volume, and what goes out of it.

use super::*;
use crate::volume::BlockCoord;

const SMALL: Board = Board { half_m: [0.8, 0.5], ..Board::CAR };
/// The same as a mask twice too wide shows it.
const WIDE: Board = Board { half_m: [1.6, 0.5], ..Board::CAR };

/// A volume's blocks, and the greatest weight of a voxel in it.
fn content(instances: &Instances<'_>) -> (Vec<BlockCoord>, u8) {
    let Some((_, object)) = instances.objects().next() else { return (Vec::new(), 0) };
    let blocks = object.volume().blocks();
    let slots = || (0..object.volume().pool().high_water() as u32).filter(|slot| object.volume().pool().handle(*slot).is_some());
    let heaviest = slots().filter_map(|slot| blocks.weight(slot)?.iter().max().copied()).max();
    (slots().filter_map(|slot| blocks.coord(slot)).collect(), heaviest.unwrap_or(0))
}

/// Shows a parked car, too wide in the frames `wide` says; the blocks after each frame and what the sink gets in the end.
fn parked(frames: u32, wide: impl Fn(u32) -> bool) -> (Vec<usize>, usize) {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut drive = Drive::new(instances, estimator);
        let blocks = (0..frames)
            .map(|frame| {
                let board = if wide(frame) { &WIDE } else { &SMALL };
                drive.step(Transform::identity(), &[(board, Some(shift(0.0, 0.0, 9.0)))]);
                content(drive.instances).0.len()
            })
            .collect();
        drive.instances.finish(&mut drive.sink);
        assert_eq!(drive.instances.objects.blocks(), 0, "what was handed over is empty");
        (blocks, drive.sink.0[0].2)
    })
}

#[test]
fn what_was_seen_once_goes_at_every_fourth_fused_frame_and_before_the_object_leaves() {
    // Known to stand in frame 3: the volume's first frame; the seventh is its fourth.
    let (blocks, _) = parked(8, |frame| frame == 5);
    let (careful, _) = parked(8, |_| false);
    assert_eq!(blocks[..5], careful[..5]);
    assert!(blocks[5] > blocks[4], "{blocks:?}");
    assert_eq!(blocks[6], careful[6], "it was a mistake");
    let (blocks, handed) = parked(9, |frame| frame == 8);
    let (careful, expected) = parked(9, |_| false);
    assert!(blocks[8] > careful[8]);
    assert_eq!(handed, expected);
}

#[test]
fn of_an_object_seen_but_for_a_moment_everything_is_handed_over() {
    let (blocks, handed) = parked(6, |frame| frame == 5);
    let (careful, expected) = parked(6, |_| false);
    assert!(blocks[5] > careful[5] && handed > expected, "{handed} and {expected} blocks");
}

#[test]
fn each_crop_that_waited_is_fused_once() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut drive = Drive::new(instances, estimator);
        for _ in 0..4 {
            drive.step(Transform::identity(), &[(&SMALL, Some(shift(0.0, 0.0, 9.0)))]);
        }
        assert_eq!((content(drive.instances).1, drive.instances.crops.len()), (4, 0), "three that waited and this frame's");
    });
}

#[test]
fn a_volume_lies_where_the_thing_is() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut drive = Drive::new(instances, estimator);
        for _ in 0..4 {
            drive.step(Transform::identity(), &[(&SMALL, Some(shift(2.0, -0.6, 9.0)))]);
        }
        // 1.2 to 2.8 m to the right, -1.1 to -0.1 m down, 9 m ahead and 30 cm to either side; in blocks of 40 cm, the nearest lattice point's.
        let blocks = content(drive.instances).0;
        let range = |of: fn(&BlockCoord) -> i16| (blocks.iter().map(of).min().unwrap(), blocks.iter().map(of).max().unwrap());
        assert_eq!((range(|at| at.x), range(|at| at.y), range(|at| at.z)), ((2, 7), (-3, -1), (21, 23)));
    });
}

#[test]
fn what_counts_as_standing_is_put_where_it_was_seen_in_the_world() {
    // Whatever it does, it counts as standing.
    let state = StateConfig { dynamic_m_s: 50.0, static_m_s: 50.0, slow_m_s: 50.0, ..StateConfig::default() };
    with(&Capacity { object_blocks: 2000, ..CAPACITY }, &InstancesConfig { state, ..any_size() }, |instances, estimator| {
        let mut drive = Drive::new(instances, estimator);
        for frame in 0..4 {
            drive.step(Transform::identity(), &[(&SMALL, Some(shift(0.0, 0.0, 8.0 + 0.8 * f64::from(frame))))]);
        }
        assert_eq!(drive.track(1).unwrap().state, State::Static);
        let mut layers: Vec<i16> = content(drive.instances).0.iter().map(|at| at.z).collect();
        layers.sort_unstable();
        layers.dedup();
        assert_eq!(layers, (19..=26).collect::<Vec<_>>(), "four places 80 cm apart");
    });
}

#[test]
fn beyond_twenty_metres_nothing_is_fused() {
    let blocks = |z: f64| {
        with(&CAPACITY, &any_size(), |instances, estimator| {
            let mut drive = Drive::new(instances, estimator);
            for _ in 0..5 {
                drive.step(Transform::identity(), &[(&Board::CAR, Some(shift(0.0, 0.0, z)))]);
            }
            assert_eq!(drive.instances.objects().count(), 1);
            content(drive.instances).0.len()
        })
    };
    assert!(blocks(18.0) > 0);
    assert_eq!(blocks(22.0), 0);
}

#[test]
fn a_post_before_a_car_is_no_part_of_it() {
    with(&CAPACITY, &any_size(), |instances, estimator| {
        let mut drive = Drive::new(instances, estimator);
        let post = Board { half_m: [0.05, 0.2], points: 0, ..Board::CAR };
        for _ in 0..5 {
            drive.step_behind(Transform::identity(), &[(&Board::CAR, Some(shift(0.0, 0.0, 10.0)))], &[(&post, Some(shift(0.0, 0.0, 4.0)))]);
        }
        let nearest = content(drive.instances).0.iter().map(|at| at.z).min();
        assert_eq!(nearest, Some(24), "9.6 m");
    });
}

#[test]
fn a_crop_is_what_lies_under_the_mask_and_near_the_middle_depth() {
    let pixels = PixelBox { left: 20, top: 10, width: 40, height: 30 };
    let mut words = vec![0; 1000];
    let mut store = MaskStore::new(&mut words);
    let place = store.take(pixels).unwrap();
    // The left four fifths of the box.
    (10..40).for_each(|v| store.enter_row(&place, v, 20, &[1; 32]));
    // 10 m, and a column each at 14, 16, 6 and 4 m.
    let at = |depth_m: f64| (RIG.focal_baseline_px_m() / depth_m * 256.0) as u16;
    let mut disparity = vec![at(10.0); WIDTH * HEIGHT];
    let columns = [(22, 14.0), (24, 16.0), (26, 6.0), (28, 4.0)];
    for row in disparity.chunks_exact_mut(WIDTH) {
        columns.iter().for_each(|&(u, depth_m)| row[u] = at(depth_m));
    }
    let mut crop = vec![7u16; pixels.area() as usize];
    let kept = crop::cut(&RIG, 5.0, View::new(&disparity, WIDTH, HEIGHT).unwrap(), &store, &place, &mut crop);
    assert_eq!(kept, 30 * (32 - 2));
    for row in crop.chunks_exact(40) {
        let there: Vec<usize> = (0..40).filter(|&u| row[u] > 0).collect();
        let expected: Vec<usize> = (0..32).filter(|u| ![4, 8].contains(u)).collect();
        assert_eq!(there, expected);
    }
}

#[test]
fn a_thing_without_any_depth_leaves_nothing_to_wait_for() {
    let mask = [1; 3600];
    let car = detection(Class::Car, 0.9, &PixelBox { left: 100, top: 30, width: 60, height: 60 }, &mask);
    with(&CAPACITY, &any_size(), |instances, estimator| {
        take_frame(instances, estimator, 0, &[car], [&[], &[]]);
        assert_eq!((instances.tracks().count(), instances.crops.len()), (1, 0));
    });
}
