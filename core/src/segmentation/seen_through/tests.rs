use super::*;
use crate::memory::SLAB_ALIGN;
use std::{vec, vec::Vec};

const WIDTH: usize = 320;
const HEIGHT: usize = 160;
const RIG: StereoRig =
    StereoRig { focal_px: 300.0, center_u_px: 160.0, center_v_px: 80.0, baseline_m: 0.1 };
const CAPACITY: Capacity = Capacity { image_width: WIDTH, image_height: HEIGHT, ..Capacity::TINY };
const WALL_M: f64 = 4.0;
/// Pixels at the corners of a person, which no cell beside reaches.
const CORNERS: usize = 40;

/// Calls `test` with memory of no frame.
fn with_none(test: impl FnOnce(&mut SeenThrough<'_>)) {
    let bytes = SeenThrough::bytes(&CAPACITY);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut slab[start..], bytes).unwrap();
    let mut seen_through = SeenThrough::new_in(&CAPACITY, &mut carver);
    assert_eq!(carver.footprint().bytes(), bytes);
    test(&mut seen_through);
}

/// Depths of a wall and of what stands before it: columns, rows, and depth, m.
fn scene(before: &[([usize; 2], [usize; 2], f64)]) -> Vec<u16> {
    (0..WIDTH * HEIGHT)
        .map(|i| {
            let (u, v) = (i % WIDTH, i / WIDTH);
            let is_at = |(columns, rows, _): &&([usize; 2], [usize; 2], f64)| {
                (columns[0]..columns[1]).contains(&u) && (rows[0]..rows[1]).contains(&v)
            };
            let z_m = before.iter().find(is_at).map_or(WALL_M, |(.., z_m)| *z_m);
            if z_m == f64::MAX { 0 } else { (256.0 * RIG.focal_baseline_px_m() / z_m) as u16 }
        })
        .collect()
}

/// Takes a frame; the pixels that are removed, by position.
fn removed(seen_through: &mut SeenThrough<'_>, pixels: &[u16], t: &Transform) -> Vec<usize> {
    let disparity_q8 = View::new(pixels, WIDTH, HEIGHT).unwrap();
    let present = Present { rig: &RIG, t_world_camera: t, disparity_q8, ground: None, far_m: 5.0 };
    let mut depth_m: Vec<f32> = pixels.iter().map(|q8| f32::from(*q8)).collect();
    let mut view = ViewMut::new(&mut depth_m, WIDTH, HEIGHT).unwrap();
    let (mut marks, mut queue) = ([7; WIDTH * HEIGHT / 64], [7; WIDTH * HEIGHT / 64]);
    let scratch = Scratch { marks: &mut marks, queue: &mut queue };
    let count = seen_through.remove(&present, scratch, &mut view);
    let at: Vec<usize> =
        (0..pixels.len()).filter(|&at| depth_m[at] == 0.0 && pixels[at] > 0).collect();
    assert_eq!(at.len(), count as usize);
    at
}

const STAYS: Transform = Transform::IDENTITY;

#[test]
fn who_steps_before_a_wall_is_removed_whole_and_the_wall_stays() {
    with_none(|seen_through| {
        let wall = scene(&[]);
        for _ in 0..5 {
            assert!(removed(seen_through, &wall, &STAYS).is_empty());
        }
        let person = ([120, 180], [30, 140], 2.0);
        let with_person = scene(&[person]);
        for frame in 0..10 {
            let pixels = removed(seen_through, &with_person, &STAYS);
            let is_person = |at: &usize| {
                (120..180).contains(&(at % WIDTH)) && (30..140).contains(&(at / WIDTH))
            };
            assert!(pixels.iter().all(is_person), "frame {frame}");
            assert!(pixels.len() > 60 * 110 - CORNERS, "frame {frame}");
        }
    });
}

#[test]
fn what_covers_where_it_was_is_joined_to_what_has_come() {
    with_none(|seen_through| {
        removed(seen_through, &scene(&[([120, 180], [30, 140], 2.0)]), &STAYS);
        // Half of it has come, the other half is where the first one was.
        let pixels = removed(seen_through, &scene(&[([150, 210], [30, 140], 2.0)]), &STAYS);
        assert!(pixels.len() > 60 * 110 - CORNERS, "{} px", pixels.len());
    });
}

#[test]
fn unknown_is_never_free() {
    with_none(|seen_through| {
        let unknown = scene(&[([100, 200], [20, 150], f64::MAX)]);
        removed(seen_through, &unknown, &STAYS);
        let pixels = removed(seen_through, &scene(&[([120, 180], [30, 140], 2.0)]), &STAYS);
        assert!(pixels.is_empty(), "{} px", pixels.len());
    });
}

#[test]
fn what_is_small_or_hardly_nearer_stays() {
    with_none(|seen_through| {
        removed(seen_through, &scene(&[]), &STAYS);
        for (columns, rows, z_m) in
            [([120, 132], [60, 72], 2.0), ([100, 200], [20, 140], 0.92 * WALL_M)]
        {
            let pixels = removed(seen_through, &scene(&[(columns, rows, z_m)]), &STAYS);
            assert!(pixels.is_empty(), "{} px", pixels.len());
        }
    });
}

#[test]
fn nothing_has_come_where_the_camera_alone_moves() {
    with_none(|seen_through| {
        // A block before the wall, seen ever farther to the left as the camera moves to the right.
        let (z_m, step_m) = (2.0, 0.05);
        for frame in 0..20 {
            let x_m = step_m * f64::from(frame);
            let shift = (RIG.focal_px * x_m / z_m) as usize;
            let block = ([180 - shift.min(180), 240 - shift], [40, 120], z_m);
            let camera = Transform::new([0.0; 3], [x_m, 0.0, 0.0]);
            let pixels = removed(seen_through, &scene(&[block]), &camera);
            assert!(pixels.is_empty(), "frame {frame}: {} px", pixels.len());
        }
    });
}
