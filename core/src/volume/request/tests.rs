//! Walks and requests against plain ones.

use super::*;
use crate::{
    geometry::{StereoRig, Transform},
    random::Random,
};
use std::{collections::BTreeSet, vec, vec::Vec};

#[test]
fn a_tag_is_its_block_again() {
    for block in [[0, 0, 0], [-1, 2, -3], [1_000_000, -1_000_000, 65_536]] {
        assert_eq!(Tag::from_block(block).block(), block);
    }
}

#[test]
fn a_walk_visits_neighbouring_blocks_that_small_steps_find() {
    let mut random = Random::new(8);
    for _ in 0..2_000 {
        let mut point = |scale: f32| {
            Vector3::from([(); 3].map(|()| (random.below(2_001) as f32 / 1_000.0 - 1.0) * scale))
        };
        let from = point(30.0);
        let to = from + point(4.0);
        let mut met: Vec<[i32; 3]> = Vec::new();
        walk(from, to, |block| met.push(block));
        let floor = |point: Vector3<f32>| [point.x, point.y, point.z].map(floor_i32);
        assert_eq!((met.first(), met.last()), (Some(&floor(from)), Some(&floor(to))));
        let apart = |pair: &[[i32; 3]]| {
            pair[0].iter().zip(pair[1]).map(|(a, b)| a.abs_diff(b)).sum::<u32>()
        };
        assert!(met.windows(2).all(|pair| apart(pair) == 1));
        let all: BTreeSet<_> = met.iter().copied().collect();
        // Steps that do not end on a corner, where rounding decides.
        let missed = (0..=997)
            .map(|i| floor(from + (to - from) * (i as f32 / 997.0)))
            .filter(|block| !all.contains(block))
            .count();
        assert!(missed <= 1, "{missed} of 998 points");
    }
}

#[test]
fn where_blocks_are_wide_fewer_rays_are_walked_and_each_has_its_turn() {
    const SIDE: usize = 48;
    let depth_m = vec![1.0; SIDE * SIDE];
    let rig = StereoRig { focal_px: 100.0, center_u_px: 24.0, center_v_px: 24.0, baseline_m: 0.5 };
    let view = Viewpoint { rig, width: SIDE, height: SIDE, t_world_camera: Transform::default() };
    let mut walked = [[0; SIDE * SIDE]; 3];
    for frame in 0..64 {
        let rays = Rays::new(
            &VolumeConfig::default(),
            &view,
            View::new(&depth_m, SIDE, SIDE).unwrap(),
            Vector3::zeros(),
            frame,
        );
        // Blocks of 0.4 m are 16 px wide at 2.5 m.
        assert_eq!([2.6, 2.4, 1.3, 1.2].map(|depth_m| rays.steps(depth_m)), [1, 2, 2, 4]);
        for (steps, walked) in [1, 2, 4].into_iter().zip(&mut walked) {
            for (row, column) in
                (0..SIDE / 2).flat_map(|row| (0..SIDE / 2).map(move |column| (row, column)))
            {
                let at = [
                    PIXEL_STEP * row + rays.offset[0],
                    rays.first_column(row) + PIXEL_STEP * column,
                ];
                walked[at[0] * SIDE + at[1]] += usize::from(rays.is_taken(steps, [row, column]));
            }
        }
    }
    assert_eq!(
        [16, 4, 1].map(|turns| vec![turns; SIDE * SIDE]),
        walked.map(Vec::from),
        "times in 64 frames that each ray is walked"
    );
}

#[test]
fn short_lists_lose_no_block() {
    let depth_m: Vec<f32> = (0..64 * 48).map(|i| 3.0 + (i % 7) as f32).collect();
    let depth_m = View::new(&depth_m, 64, 48).unwrap();
    let rays = Rays {
        depth_m,
        start: Vector3::new(0.3, 0.4, 0.5),
        rays: [
            Vector3::new(-1.2, -0.9, 2.5),
            Vector3::new(0.04, 0.0, 0.0),
            Vector3::new(0.0, 0.04, 0.0),
        ],
        reach_m: [0.2, 0.75],
        far_m: 20.0,
        offset: [1, 0],
        sparse_offset: [2, 1],
        wide_m: [6.0, 4.0],
    };
    let met = |list: usize| {
        let (mut caches, mut lists) = (vec![0; BANDS * CACHE_ENTRIES], vec![0; 4 * list]);
        let mut requested = RequestedCache { caches: &mut caches, lists: &mut lists };
        let (mut met, mut rounds) = (BTreeSet::new(), 0);
        let mut bands = requested.bands(48);
        while !bands.iter().all(Band::is_done) {
            rounds += 1;
            for band in &mut bands {
                rays.walk(band);
                met.extend(band.drain());
            }
        }
        (met, rounds)
    };
    let ((few, rounds), (many, one)) = (met(MAX_BLOCKS_PER_RAY), met(40_000));
    assert!(rounds > 10 && one == 1, "{rounds} rounds");
    assert!(few == many && many.len() > 500, "{} blocks", many.len());
}
