//! Masks, scaled and not.

use super::*;

fn square(side: i32) -> PixelBox {
    PixelBox { left: 100, top: 30, width: side, height: side }
}

/// At an image width of 1242 and the published settings: which pixels of a square mask of `side` px, with a corner of `cut` px cut off or
/// none, are deleted and which copied.
fn deleted(side: i32, cut: i32, test: impl Fn(&dyn Fn(i32, i32) -> bool, &dyn Fn(i32, i32) -> bool, PixelBox)) {
    let mut words = vec![0; 1000];
    let mut store = MaskStore::new(&mut words);
    let pixels = square(side);
    let place = store.take(pixels).unwrap();
    for v in 0..side {
        let row: Vec<u8> = (0..side).map(|u| u8::from(u >= cut || v >= cut)).collect();
        store.enter_row(&place, pixels.top + v, pixels.left, &row);
    }
    let scale = InstancesConfig::default().delete_permille(pixels.area(), 1242);
    let scaled = ScaledMask::new(&store, place, scale);
    test(&|u, v| scaled.contains(u, v), &|u, v| store.contains(&place, u, v), scaled.pixels);
}

#[test]
fn a_large_mask_is_deleted_1_2_times_as_large_and_a_small_one_1_44_times() {
    for (side, margin) in [(60, 6), (50, 11)] {
        deleted(side, 0, |delete, copy, pixels| {
            assert_eq!(
                pixels,
                PixelBox {
                    left: 100 - margin,
                    top: 30 - margin,
                    width: side + 2 * margin,
                    height: side + 2 * margin
                }
            );
            for v in 0..120 {
                for u in 0..300 {
                    assert_eq!(delete(u, v), pixels.contains(u, v));
                    assert_eq!(copy(u, v), square(side).contains(u, v));
                }
            }
        });
    }
}

#[test]
fn a_cut_corner_is_cut_out_of_the_scaled_mask_larger() {
    deleted(60, 20, |delete, copy, _| {
        assert!(!copy(119, 49) && copy(120, 49) && copy(119, 50));
        // The corner's 20 px are 24 in the scaled mask, which begins 6 px before; a pixel that is only partly in is out.
        assert!(!delete(94 + 23, 24 + 23) && delete(94 + 25, 24 + 23) && delete(94 + 23, 24 + 25));
    });
}

#[test]
fn the_row_by_row_walk_finds_the_pixels_that_lie_in_the_scaled_mask() {
    deleted(50, 17, |_, _, _| {});
    let mut words = vec![0; 1000];
    let mut store = MaskStore::new(&mut words);
    let pixels = PixelBox { left: 0, top: 3, width: 70, height: 21 };
    let place = store.take(pixels).unwrap();
    for v in 0..21 {
        let row: Vec<u8> = (0..70).map(|u| u8::from((u * 7 + v * 13) % 11 > 1)).collect();
        store.enter_row(&place, 3 + v, 0, &row);
    }
    for permille in [970, 1000, 1200, 1440] {
        let scaled = ScaledMask::new(&store, place, permille);
        for v in -5..40 {
            let mut found = Vec::new();
            scaled.row(v, 60, |u| found.push(u as i32));
            let expected: Vec<i32> = (0..60).filter(|&u| scaled.contains(u, v)).collect();
            assert_eq!(found, expected);
        }
    }
    let same = ScaledMask::new(&store, place, 1000);
    assert!((0..30).all(|v| (0..80).all(|u| same.contains(u, v) == store.contains(&place, u, v))));
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
            let mut below = |bound| random.below(bound) as i32;
            let pixels = PixelBox { left: below(150), top: below(20), width: 1 + below(140), height: 1 + below(20) };
            let place = store.take(pixels).unwrap();
            for v in 0..pixels.height {
                let row: Vec<u8> = (0..pixels.width).map(|_| random.below(3) as u8).collect();
                store.enter_row(&place, pixels.top + v, pixels.left, &row);
            }
            place
        };
        let (mine, theirs) = (fill(&mut a), fill(&mut b));
        let shift = [random.below(99) as i32 - 49, random.below(9) as i32 - 4];
        let (mut both, mut any) = (0, 0);
        for v in -10..60 {
            for u in -60..400 {
                let (x, y) = (a.contains(&mine, u, v), b.contains(&theirs, u - shift[0], v - shift[1]));
                both += i32::from(x && y);
                any += i32::from(x || y);
            }
        }
        assert_eq!(a.overlap(&mine, &b, &theirs, shift), both as f32 / any as f32);
    }
}
