//! Directions, costs and messages against brute force over many windows.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::disallowed_methods
)]

use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::image::View;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::planning::{CellState, Planning};
use dynvox_core::random::Random;
use dynvox_core::{Capacity, Config, Mapper, Serial, StereoFrame};
use dynvox_onboard::mavlink::{Sender, obstacle_distance, obstacle_distance_3d};
use dynvox_onboard::{
    Band, COST_FREE, COST_LETHAL, COST_UNKNOWN, Direction, SECTORS, Sectors, Vehicle, costs,
    heights, points, sectors,
};
use mavlink::dialects::ardupilotmega::MavMessage;

const WIDTH: usize = 160;
const HEIGHT: usize = 64;
const RIG: StereoRig =
    StereoRig { focal_px: 90.0, center_u_px: 80.0, center_v_px: 32.0, baseline_m: 0.5 };
const CAPACITY: Capacity = Capacity {
    image_width: WIDTH,
    image_height: HEIGHT,
    // What leaves a full map is unknown, and nothing would be free for long.
    blocks: 20_000,
    visible_blocks: 20_000,
    planning_width: 60,
    planning_length: 60,
    planning_height: 12,
    ..Capacity::TINY
};

/// Windows of a vehicle that drives about between walls at random depths, one a frame.
fn each_window(count: usize, mut check: impl FnMut(&Planning<'_>, &Transform, &mut Random)) {
    let mut random = Random::new(11);
    let mut config = Config::for_rig(RIG);
    config.volume.voxel_size_m = 0.1;
    config.volume.truncation_m = 0.6;
    config.planning.cell_voxels = 4;
    config.planning.near_m = 0.5;
    config.planning.below_m = 2.0;
    let mut slab = vec![0; CAPACITY.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&CAPACITY, &config, &mut slab).unwrap();
    let grey = vec![90; WIDTH * HEIGHT];
    let mut position = [0.0f64, 0.0];
    let mut heading = 0.0f64;
    for _ in 0..count {
        let disparity_q8: Vec<u16> = (0..8)
            .flat_map(|_| {
                let columns: Vec<u16> = (0..10)
                    .flat_map(|_| {
                        let px = 3 + random.below(20) as u16;
                        let seen = random.below(8) > 0;
                        [if seen { px << 8 } else { 0 }; WIDTH / 10]
                    })
                    .collect();
                (0..HEIGHT / 8).flat_map(move |_| columns.clone()).collect::<Vec<_>>()
            })
            .collect();
        heading += f64::from(random.below(7)) * 0.05 - 0.15;
        position = [position[0] + 0.2 * heading.sin(), position[1] + 0.2 * heading.cos()];
        let pose = Transform::new([0.0, heading, 0.0], [position[0], 0.0, position[1]]);
        let view = View::new(&grey, WIDTH, HEIGHT).unwrap();
        let frame = StereoFrame {
            disparity_q8: View::new(&disparity_q8, WIDTH, HEIGHT),
            t_world_camera: Some(pose),
            ..StereoFrame::pair(view, view)
        };
        mapper.step(&frame, &Serial).unwrap();
        mapper.update_planning_maps(0.0);
        check(mapper.planning(), &pose, &mut random);
    }
}

fn any_band(random: &mut Random) -> Band {
    Band {
        body_m: random.below(4) as f32 * 0.25,
        near_m: 0.5 + random.below(4) as f32 * 0.5,
        far_m: 3.0 + random.below(8) as f32,
        up_m: random.below(3) as f32 * 0.3,
        down_m: random.below(3) as f32 * 0.3,
        stale_frames: random.below(20),
    }
}

/// The direction of one sector, by its definition: of all columns whose circle reaches into it the
/// nearest that is not free.
fn by_definition(
    planning: &Planning<'_>,
    pose: &Transform,
    band: &Band,
    sector: usize,
) -> Direction {
    let (grid, cell_m) = (planning.grid(), planning.grid().cell_m());
    let center = grid.of_world(pose.translation_m);
    let ahead = grid.of_world(pose.transform_point([0.0, 0.0, 1.0]));
    let heading = (ahead[0] - center[0]).atan2(ahead[1] - center[1]);
    let from = (center[2] - f64::from(band.down_m) / cell_m).floor() as i32;
    let to = ((center[2] + f64::from(band.up_m) / cell_m).ceil() as i32).max(from + 1);
    let radius_m = cell_m / 2f64.sqrt();
    let [mut occupied, mut in_doubt, mut unknown] = [f64::INFINITY; 3];
    let reach = (f64::from(band.far_m) / cell_m) as i32 + 3;
    for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
        let (x, y) = (center[0].floor() as i32 + dx, center[1].floor() as i32 + dy);
        let [right, forth] = [f64::from(x) + 0.5 - center[0], f64::from(y) + 0.5 - center[1]]
            .map(|cells| cells * cell_m);
        let distance_m = right.hypot(forth);
        if distance_m + radius_m < f64::from(band.body_m)
            || distance_m - radius_m > f64::from(band.far_m)
        {
            continue;
        }
        let middle = (sector as f64 * 5.0).to_radians();
        let mut off = (right.atan2(forth) - heading - middle).rem_euclid(std::f64::consts::TAU);
        if off > std::f64::consts::PI {
            off = std::f64::consts::TAU - off;
        }
        let half = if distance_m > radius_m { (radius_m / distance_m).asin() } else { 4.0 };
        if off > half + 2.5f64.to_radians() {
            continue;
        }
        let cells: Vec<_> = (from..to).map(|z| planning.cell([x, y, z])).collect();
        let edge_m = (distance_m - radius_m).max(0.0);
        if cells.iter().any(|(state, _)| *state == CellState::Occupied) {
            occupied = occupied.min(edge_m);
        } else if distance_m + radius_m < f64::from(band.near_m) {
            // Nearer than the camera sees.
        } else if cells.iter().any(|(_, age)| age.is_none_or(|age| age > band.stale_frames)) {
            unknown = unknown.min(edge_m);
        } else if cells.iter().any(|(state, _)| *state != CellState::Free) {
            in_doubt = in_doubt.min(edge_m);
        }
    }
    if occupied.is_finite() && occupied <= unknown {
        Direction::Obstacle { distance_m: occupied.min(in_doubt) as f32 }
    } else if unknown.min(in_doubt).is_finite() {
        Direction::Unknown
    } else {
        Direction::Free
    }
}

#[test]
fn a_thousand_windows_give_what_the_definition_says() {
    let (mut compared, mut free, mut obstacles, mut border) = (0, 0, 0, 0);
    each_window(1_000, |planning, pose, random| {
        let band = any_band(random);
        let found = sectors(planning, &Vehicle::new(pose, true), &band);
        for _ in 0..6 {
            let sector = random.below(SECTORS as u32) as usize;
            let (is, right) =
                (found.directions()[sector], by_definition(planning, pose, &band, sector));
            compared += 1;
            free += usize::from(right == Direction::Free);
            obstacles += usize::from(matches!(right, Direction::Obstacle { .. }));
            match (is, right) {
                (Direction::Obstacle { distance_m: a }, Direction::Obstacle { distance_m: b })
                    if (a - b).abs() < 1e-4 => {}
                (a, b) if a == b => {}
                // A circle that touches a sector's border to the last bit.
                _ => border += 1,
            }
            assert!(is != Direction::Free || right == Direction::Free, "{sector}: {right:?}");
        }
    });
    assert!(
        compared == 6_000 && free > 10 && obstacles > 300,
        "{free} free, {obstacles} obstacles"
    );
    assert!(border <= 3, "{border} differ");
}

#[test]
fn a_pose_that_is_a_guess_and_old_looks_leave_nothing_free() {
    let mut seen_free = 0;
    each_window(60, |planning, pose, _| {
        let band = Band {
            body_m: 1.0,
            near_m: 1.0,
            far_m: 6.0,
            up_m: 0.0,
            down_m: 0.0,
            stale_frames: 1_000,
        };
        let lost = sectors(planning, &Vehicle::new(pose, false), &band);
        assert_eq!(lost.unknown(), SECTORS);
        let known = sectors(planning, &Vehicle::new(pose, true), &band);
        seen_free += known.directions().iter().filter(|one| **one == Direction::Free).count();
        // No vehicle stands outside the window and sees something.
        let far = Transform::new([0.0; 3], [900.0, 0.0, 0.0]);
        assert_eq!(sectors(planning, &Vehicle::new(&far, true), &band).unknown(), SECTORS);
        for (age, direction) in known.age_frames().iter().zip(known.directions()) {
            assert!(*age == 0 || *direction != Direction::Unknown);
        }
    });
    assert!(seen_free > 0);
}

#[test]
fn of_now_and_later_the_nearer_obstacle_counts_and_unknown_stays() {
    let (mut before, mut nearer) = (None::<Sectors>, 0);
    each_window(60, |planning, pose, random| {
        let now = sectors(planning, &Vehicle::new(pose, true), &any_band(random));
        if let Some(later) = &before {
            let both = now.or_nearer(later);
            for sector in 0..SECTORS {
                let [now, later, both] =
                    [&now, later, &both].map(|sectors| sectors.directions()[sector]);
                let to_m = |direction| match direction {
                    Direction::Obstacle { distance_m } => distance_m,
                    _ => f32::INFINITY,
                };
                assert_eq!(both == Direction::Unknown, now == Direction::Unknown);
                if now != Direction::Unknown {
                    assert_eq!(to_m(both), to_m(now).min(to_m(later)));
                    nearer += usize::from(both != now);
                }
            }
            assert_eq!(
                points(&both).count(),
                both.directions()
                    .iter()
                    .filter(|direction| matches!(direction, Direction::Obstacle { .. }))
                    .count()
            );
        }
        before = Some(now);
    });
    assert!(nearer > 100, "{nearer}");
}

#[test]
fn costs_are_free_only_where_every_cell_was_seen_free() {
    let mut counts = [0; 3];
    each_window(200, |planning, pose, random| {
        let band = any_band(random);
        let mut cost = vec![7; 60 * 60];
        let map = costs(planning, &Vehicle::new(pose, true), &band, &mut cost).unwrap();
        assert_eq!((map.width, map.length), (60, 60));
        let [x0, y0, _] = planning.origin();
        let cell_m = planning.grid().cell_m();
        let z = planning.grid().of_world(pose.translation_m)[2];
        let from = (z - f64::from(band.down_m) / cell_m).floor() as i32;
        let to = ((z + f64::from(band.up_m) / cell_m).ceil() as i32).max(from + 1);
        for (at, &cost) in cost.iter().enumerate() {
            let (x, y) = (x0 + (at % 60) as i32, y0 + (at / 60) as i32);
            let states: Vec<_> = (from..to).map(|z| planning.cell([x, y, z])).collect();
            let fresh = |(state, age): &(CellState, Option<u32>)| {
                *state == CellState::Free && age.is_some_and(|age| age <= band.stale_frames)
            };
            let right = if states.iter().any(|(state, _)| *state == CellState::Occupied) {
                COST_LETHAL
            } else if states.iter().all(fresh) {
                COST_FREE
            } else {
                COST_UNKNOWN
            };
            assert_eq!(cost, right);
            counts[match right {
                COST_FREE => 0,
                COST_LETHAL => 1,
                _ => 2,
            }] += 1;
        }
        let mut short = [0; 9];
        assert_eq!(costs(planning, &Vehicle::new(pose, true), &band, &mut short), None);
        let mut lost = vec![0; 60 * 60];
        costs(planning, &Vehicle::new(pose, false), &band, &mut lost).unwrap();
        assert!(lost.iter().all(|cost| *cost == COST_UNKNOWN));
    });
    assert!(counts.iter().all(|count| *count > 1_000), "{counts:?}");
}

#[test]
fn heights_are_those_of_the_ground_or_unknown() {
    let mut known = 0;
    each_window(100, |planning, pose, _| {
        let mut height = vec![7.0; 60 * 60];
        heights(planning, &Vehicle::new(pose, true), &mut height).unwrap();
        let above_m = -pose.translation_m[1] as f32;
        let [x0, y0, _] = planning.origin();
        for (at, &height_m) in height.iter().enumerate() {
            let column = [x0 + (at % 60) as i32, y0 + (at / 60) as i32, 0];
            match planning.column(column).unwrap().ground_m() {
                Some(ground_m) => assert!((height_m - (ground_m - above_m)).abs() < 1e-5),
                None => assert!(height_m.is_nan(), "{height_m}"),
            }
            known += usize::from(!height_m.is_nan());
        }
        assert_eq!(heights(planning, &Vehicle::new(pose, true), &mut [0.0; 9]), None);
        heights(planning, &Vehicle::new(pose, false), &mut height).unwrap();
        assert!(height.iter().all(|height_m| height_m.is_nan()), "the pose is a guess");
    });
    assert!(known > 1_000, "{known}");
}

#[test]
fn a_road_lies_as_far_below_the_vehicle_as_the_camera_stands_above_it() {
    // A level road 1.2 m below the camera, and a kerb of 0.2 m from 1 m to the right on.
    let disparity_q8: Vec<u16> = (0..HEIGHT * WIDTH)
        .map(|at| {
            let (u, v) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
            let depth_m = |below_m: f64| RIG.focal_px * below_m / (v - RIG.center_v_px);
            let is_kerb = |depth_m: f64| (u - RIG.center_u_px) * depth_m / RIG.focal_px > 1.0;
            let depth_m = if is_kerb(depth_m(1.0)) { depth_m(1.0) } else { depth_m(1.2) };
            if (0.5..12.0).contains(&depth_m) {
                (RIG.focal_px * RIG.baseline_m / depth_m * 256.0).round() as u16
            } else {
                0
            }
        })
        .collect();
    let mut config = Config::for_rig(RIG);
    config.volume.voxel_size_m = 0.1;
    config.planning.cell_voxels = 2;
    config.planning.near_m = 0.5;
    config.planning.below_m = 1.8;
    config.planning.camera_height_m = 1.2;
    let mut slab = vec![0; CAPACITY.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&CAPACITY, &config, &mut slab).unwrap();
    let grey = vec![90; WIDTH * HEIGHT];
    let view = View::new(&grey, WIDTH, HEIGHT).unwrap();
    for _ in 0..5 {
        let frame = StereoFrame {
            disparity_q8: View::new(&disparity_q8, WIDTH, HEIGHT),
            t_world_camera: Some(Transform::IDENTITY),
            ..StereoFrame::pair(view, view)
        };
        mapper.step(&frame, &Serial).unwrap();
    }
    mapper.update_planning_maps(0.0);
    let mut height = vec![0.0; 60 * 60];
    let vehicle = Vehicle::new(&Transform::IDENTITY, true);
    let map = heights(mapper.planning(), &vehicle, &mut height).unwrap();
    let at = |right_m: f64, ahead_m: f64| {
        let [x, y] = [right_m - map.origin_m[0], ahead_m - map.origin_m[1]]
            .map(|m| (m / map.resolution_m) as usize);
        height[y * map.width + x]
    };
    for ahead_m in [4.1, 4.5, 4.9] {
        assert!((at(-0.5, ahead_m) + 1.2).abs() < 0.06, "{}", at(-0.5, ahead_m));
        assert!((at(1.7, ahead_m) + 1.0).abs() < 0.06, "{}", at(1.7, ahead_m));
        assert!(at(0.0, -ahead_m).is_nan(), "nothing was seen behind");
    }
}

fn parsed(bytes: &[u8]) -> MavMessage {
    mavlink::MavlinkReader::new(bytes).read_any_message::<MavMessage>().unwrap().1
}

/// A window with free directions, obstacles and unknown ones.
fn mixed(mut with: impl FnMut(&Sectors)) {
    let mut found = 0;
    each_window(80, |planning, pose, _| {
        let band =
            Band { body_m: 1.0, near_m: 1.0, far_m: 5.0, up_m: 0.0, down_m: 0.0, stale_frames: 90 };
        let around = sectors(planning, &Vehicle::new(pose, true), &band);
        found += 1;
        with(&around);
    });
    assert_eq!(found, 80);
}

#[test]
fn a_reader_of_mavlink_reads_the_same_distances() {
    let mut kinds = [0; 3];
    mixed(|around| {
        let sender = Sender { system: 3, component: 196, sequence: 77 };
        let MavMessage::OBSTACLE_DISTANCE(read) =
            parsed(obstacle_distance(around, 1_234_567_890_123, sender).bytes())
        else {
            panic!("another message");
        };
        assert_eq!(
            (read.time_usec, read.min_distance, read.max_distance),
            (1_234_567_890_123, 100, 500)
        );
        assert_eq!((read.increment, read.increment_f, read.angle_offset), (5, 5.0, 0.0));
        assert_eq!(read.frame, mavlink::dialects::ardupilotmega::MavFrame::MAV_FRAME_BODY_FRD);
        for (cm, direction) in read.distances.iter().zip(around.directions()) {
            let (kind, right) = match *direction {
                Direction::Unknown => (0, u16::MAX),
                Direction::Free => (1, 501),
                Direction::Obstacle { distance_m } => (2, (distance_m * 100.0) as u16),
            };
            kinds[kind] += 1;
            assert_eq!(*cm, right);
        }
        for point in points(around) {
            let message = obstacle_distance_3d(point, around, 99, sender);
            let MavMessage::OBSTACLE_DISTANCE_3D(read) = parsed(message.bytes()) else {
                panic!("another message");
            };
            assert_eq!(([read.x, read.y, read.z], read.time_boot_ms), (point, 99));
            assert_eq!((read.min_distance, read.max_distance), (1.0, 5.0));
            let distance_m = point[0].hypot(point[1]);
            assert!((0.5..5.8).contains(&distance_m), "{point:?}");
        }
    });
    assert!(kinds.iter().all(|count| *count > 20), "{kinds:?}");
}
