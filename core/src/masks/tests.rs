//! Masks, scaled and not.

use super::*;
use crate::random::Random;
use std::{vec, vec::Vec};

#[test]
fn the_runs_of_rows_have_the_pixels_that_lie_in_the_scaled_mask() {
    let mut words = vec![0; 1000];
    let mut store = MaskStore::new(&mut words);
    let pixels = PixelBox { left: 70, top: 3, width: 150, height: 21 };
    let mask = store.alloc(pixels).unwrap();
    for v in 0..21 {
        // Holes, whole rows, whole words, and none.
        let is_set = |u: i32| match v % 5 {
            0 => true,
            1 => (58..122).contains(&u),
            2 => v < 10,
            _ => (u * 7 + v * 13) % 11 > 1,
        };
        let row: Vec<u8> = (0..150).map(|u| u8::from(is_set(u))).collect();
        store.set_row(&mask, 3 + v, 70, &row);
    }
    for (mask, permille) in [mask, MaskHandle::full(pixels)]
        .into_iter()
        .flat_map(|mask| [300, 970, 1000, 1200, 1440].map(|by| (mask, by)))
    {
        for shift in [0, -90, 60] {
            let scaled = ScaledMask::new(&store, mask, permille).moved([shift, 0]);
            for v in -5..40 {
                let mut found = Vec::new();
                scaled.runs(v, 240, |run| found.extend(run));
                let expected: Vec<usize> =
                    (0..240).filter(|&u| scaled.contains(u as i32, v)).collect();
                assert_eq!(found, expected, "row {v} at {permille}");
            }
        }
    }
    let same = ScaledMask::new(&store, mask, 1000);
    assert!((0..30).all(|v| (60..240).all(|u| same.contains(u, v) == store.contains(&mask, u, v))));
}

#[test]
fn overlap_by_words_is_overlap_by_pixels_at_any_shift() {
    let (mut one, mut two) = (vec![0; 600], vec![0; 600]);
    let (mut a, mut b) = (MaskStore::new(&mut one), MaskStore::new(&mut two));
    let mut random = Random::new(4);
    for _ in 0..60 {
        a.clear();
        b.clear();
        let mut fill = |store: &mut MaskStore<'_>| {
            // Boxes of many sizes and positions, with two thirds of their pixels set.
            let mut below = |bound| random.below(bound) as i32;
            let pixels = PixelBox {
                left: below(150),
                top: below(20),
                width: 1 + below(140),
                height: 1 + below(20),
            };
            let mask = store.alloc(pixels).unwrap();
            for v in 0..pixels.height {
                let row: Vec<u8> = (0..pixels.width).map(|_| random.below(3) as u8).collect();
                store.set_row(&mask, pixels.top + v, pixels.left, &row);
            }
            mask
        };
        let (mine, theirs) = (fill(&mut a), fill(&mut b));
        let shift = [random.below(99) as i32 - 49, random.below(9) as i32 - 4];
        let (mut both, mut any) = (0, 0);
        // Pixel by pixel, beyond both boxes.
        for v in -10..60 {
            for u in -60..400 {
                let (x, y) =
                    (a.contains(&mine, u, v), b.contains(&theirs, u - shift[0], v - shift[1]));
                both += i32::from(x && y);
                any += i32::from(x || y);
            }
        }
        assert_eq!(a.overlap(&mine, &b, &theirs, shift), both as f32 / any as f32);
    }
}
