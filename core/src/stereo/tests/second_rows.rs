//! Images of many rows: every second row is matched.

use super::{
    scenes::{Texture, share_within_one_px, surface},
    *,
};
use crate::parallel::TwoThreads;

const WIDTH: usize = 300;

/// Two surfaces, a road below and a wall above, both slanted.
fn truth(u: f32, v: f32) -> f32 {
    if v < 60.0 { 16.0 + 0.04 * u } else { 2.0 + 0.3 * v }
}

fn second(config: StereoConfig) -> StereoConfig {
    StereoConfig { second_rows_from: 100, ..config }
}

/// Without filters, so that rows say nothing of each other.
const BARE: StereoConfig = StereoConfig {
    speckle_size: 0,
    lone_share: 0.0,
    gap_width: 0,
    adaptive_mean: 0,
    ..StereoConfig::robotics()
};

#[test]
fn every_second_row_is_as_if_all_were_matched() {
    // An even and an odd number of rows.
    for height in [120, 121] {
        let (left, right) = surface(WIDTH, height, 8, truth);
        let (_, all) = disparity(&BARE, &left, &right, &Serial);
        let (report, some) = disparity(&second(BARE), &left, &right, &Serial);
        assert_eq!(report.row_pixels as usize, WIDTH * (height / 2));
        let rows = all.chunks(WIDTH).zip(some.chunks(WIDTH)).enumerate();
        for (v, (all, some)) in rows.filter(|(v, _)| v % 2 == 1) {
            assert!(all == some, "row {v} of {height}");
        }
        // The rows between hold what is between, the farther of two surfaces, or the only one.
        for v in (2..height - 1).step_by(2) {
            let row = |v: usize| &some[v * WIDTH..(v + 1) * WIDTH];
            for ((&above, &below), &here) in row(v - 1).iter().zip(row(v + 1)).zip(row(v)) {
                let (far, near) = (above.min(below), above.max(below));
                let least = if far > 0 { far } else { near };
                assert!(least <= here && here <= near, "row {v}: {above}, {here}, {below}");
                assert!(near - least <= 384 || here == far, "row {v}: {above}, {here}, {below}");
            }
        }
        assert!(some[..WIDTH].iter().chain(&some[(height - 1) * WIDTH..]).all(|&d| d == 0));
    }
}

#[test]
fn surfaces_are_as_true_as_with_every_row() {
    let (left, right) = surface(WIDTH, 160, 9, truth);
    let config = StereoConfig::default();
    let share = |config: &StereoConfig| {
        let (report, found) = disparity(config, &left, &right, &Serial);
        (report, share_within_one_px(&found, WIDTH, truth))
    };
    let ((all, share_of_all), (some, share_of_some)) = (share(&config), share(&second(config)));
    assert!(share_of_some >= share_of_all - 0.01, "{share_of_some}, not {share_of_all}");
    assert!(2 * some.matched < all.matched + all.matched / 20, "{some:?}");
    assert_eq!((some.pixels, 2 * some.row_pixels), (all.pixels, all.row_pixels));
}

#[test]
fn images_below_the_limit_keep_their_bits() {
    let (left, right) = surface(WIDTH, 99, 10, truth);
    let config = StereoConfig::default();
    assert!(
        disparity(&config, &left, &right, &Serial)
            == disparity(&second(config), &left, &right, &Serial)
    );
}

#[test]
fn threads_and_row_limits_give_the_same_bits() {
    // Rows that no number of bands divides.
    for height in [101, 118, 139] {
        let (left, right) = surface(WIDTH, height, 11, truth);
        let config = second(StereoConfig { median: true, ..StereoConfig::default() });
        let serial = disparity(&config, &left, &right, &Serial);
        assert!(serial == disparity(&config, &left, &right, &TwoThreads));
    }
}

#[test]
fn a_small_patch_goes_at_the_same_size() {
    // A patch before a wall, 20 px wide: whether it goes is a matter of its area.
    let (wall, near) = (Texture::new(560, 120, 6), Texture::new(560, 120, 7));
    let image = |shift: f32, rows: usize| {
        Grey::of(WIDTH, 120, |u, v| {
            let inside =
                (140.0..160.0).contains(&(u + shift * 40.0)) && (50..50 + rows).contains(&v);
            if inside { near.at(u + shift * 40.0, v) } else { wall.at(u + shift * 15.0, v) }
        })
    };
    let config = StereoConfig { lone_share: 0.0, ..StereoConfig::default() };
    let seen = |config: &StereoConfig, rows: usize| {
        let (_, found) = disparity(config, &image(0.0, rows), &image(1.0, rows), &Serial);
        found.iter().filter(|&&d| d.abs_diff(40 * 256) < 256).count()
    };
    for config in [config, second(config)] {
        let [small, large] = [6, 24].map(|rows| seen(&config, rows));
        assert!(small == 0 && large > 200, "{small}, {large}");
    }
}
