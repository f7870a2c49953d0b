//! How much masks are scaled.

use super::*;
use crate::masks::ScaledMask;

fn square(side: i32) -> PixelBox {
    PixelBox { left: 100, top: 30, width: side, height: side }
}

/// At an image width of 1242 and the published settings: which pixels of a square mask of `side`
/// px, with a corner of `corner` px cut off or none, are deleted and which copied.
fn deleted(
    side: i32,
    corner: i32,
    test: impl Fn(&dyn Fn(i32, i32) -> bool, &dyn Fn(i32, i32) -> bool, PixelBox),
) {
    let mut words = vec![0; 1000];
    let mut store = MaskStore::new(&mut words);
    let pixels = square(side);
    let mask = store.alloc(pixels).unwrap();
    for v in 0..side {
        let row: Vec<u8> = (0..side).map(|u| u8::from(u >= corner || v >= corner)).collect();
        store.set_row(&mask, pixels.top + v, pixels.left, &row);
    }
    let scale = InstancesConfig::default().delete_permille(pixels.area(), 1242);
    let scaled = ScaledMask::new(&store, mask, scale);
    test(&|u, v| scaled.contains(u, v), &|u, v| store.contains(&mask, u, v), scaled.pixels);
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
        // The corner's 20 px are 24 in the scaled mask, which begins 6 px before; a pixel that is
        // only partly in is out.
        assert!(!delete(94 + 23, 24 + 23) && delete(94 + 25, 24 + 23) && delete(94 + 23, 24 + 25));
    });
}
