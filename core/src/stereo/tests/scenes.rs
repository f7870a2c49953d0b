//! Textured surfaces whose disparity is known everywhere.

use super::*;
use crate::random::Random;

/// A random texture, smooth enough to be shifted by fractions of a pixel: noise of two sizes.
pub(super) struct Texture {
    width: usize,
    noise: Vec<f32>,
}

impl Texture {
    pub(super) fn new(width: usize, height: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let raw: Vec<f32> = (0..width * height).map(|_| random.below(256) as f32).collect();
        let smooth =
            |i: usize| (0..9).filter_map(|k| raw.get(i + k % 3 + k / 3 * width)).sum::<f32>() / 9.0;
        Self { width, noise: (0..raw.len()).map(smooth).collect() }
    }

    pub(super) fn at(&self, u: f32, v: usize) -> f32 {
        let u = crate::geometry::scalar::clamp_f32(u, 0.0, (self.width - 2) as f32);
        let (i, f) = (u as usize, u - (u as usize) as f32);
        self.noise[v * self.width + i] * (1.0 - f) + self.noise[v * self.width + i + 1] * f
    }
}

/// A pair on whose left image the disparity is `truth(u, v)`, which must change slowly enough along
/// rows to be one surface.
pub(super) fn surface(
    width: usize,
    height: usize,
    seed: u64,
    truth: impl Fn(f32, f32) -> f32,
) -> (Grey, Grey) {
    let texture = Texture::new(width + 260, height, seed);
    let image = |at: &dyn Fn(f32, f32) -> f32| {
        Grey::of(width, height, |u, v| texture.at(at(u, v as f32), v))
    };
    let left = image(&|u, _| u);
    // The right image sees at column x what the left one sees at u with u - d(u) = x.
    let right = image(&|x, v| (0..60).fold(x, |u, _| x + truth(u, v)));
    (left, right)
}

/// Share of pixels within 1 px of the truth, among those that the right image sees too and whose
/// window fits both images.
pub(super) fn share_within_one_px(
    disparity: &[u16],
    width: usize,
    truth: impl Fn(f32, f32) -> f32,
) -> f64 {
    let height = disparity.len() / width;
    let (mut good, mut all) = (0, 0);
    for (i, &d) in disparity.iter().enumerate() {
        let (u, v) = ((i % width) as f32, (i / width) as f32);
        let expected = truth(u, v);
        // The prior ends at the outermost support points.
        let inside = u - expected >= 16.0
            && u < width as f32 - 16.0
            && (16.0..height as f32 - 16.0).contains(&v);
        if inside {
            all += 1;
            good += usize::from(
                d > 0
                    && (f32::from(d) / 256.0 - expected) * (f32::from(d) / 256.0 - expected) <= 1.0,
            );
        }
    }
    assert!(all > 1_000);
    good as f64 / all as f64
}

#[test]
fn finds_a_wall_facing_the_cameras() {
    for d in [1.0, 7.0, 23.5, 130.0] {
        let (left, right) = surface(400, 120, 1, |_, _| d);
        let (report, disparity) = disparity(&StereoConfig::default(), &left, &right, &Serial);
        assert_eq!(report.status, StereoStatus::Matched);
        let share = share_within_one_px(&disparity, 400, |_, _| d);
        assert!(share >= 0.95, "{share} of the wall at {d} px");
    }
}

#[test]
fn finds_slanted_surfaces_and_their_fractions() {
    let road = |_: f32, v: f32| 4.0 + 0.3 * v;
    let facade = |u: f32, _: f32| 60.0 - 0.12 * u;
    let hill = |u: f32, v: f32| 30.0 + 0.05 * u - 0.08 * v;
    for (name, truth) in
        [("road", &road as &dyn Fn(f32, f32) -> f32), ("facade", &facade), ("hill", &hill)]
    {
        let (left, right) = surface(400, 120, 2, truth);
        let (_, disparity) = disparity(&StereoConfig::default(), &left, &right, &Serial);
        let share = share_within_one_px(&disparity, 400, truth);
        assert!(share >= 0.9, "{share} of the {name}");
    }
}

#[test]
fn a_right_image_moved_by_five_pixels_moves_the_result_by_five() {
    // A slanted surface, so that disparities are no whole numbers.
    let truth = |u: f32, v: f32| 20.0 + 0.03 * u + 0.1 * v;
    let (left, right) = surface(400, 120, 3, truth);
    let (_, shifted) = surface(400, 120, 3, |u, v| truth(u, v) + 5.0);
    let (_, before) = disparity(&StereoConfig::default(), &left, &right, &Serial);
    let (_, after) = disparity(&StereoConfig::default(), &left, &shifted, &Serial);
    let mut differences: Vec<i32> = before
        .iter()
        .zip(&after)
        .filter(|(a, b)| **a > 0 && **b > 0)
        .map(|(a, b)| i32::from(*b) - i32::from(*a))
        .collect();
    differences.sort_unstable();
    // At least half of the pixels have an answer in both.
    assert!(differences.len() > 400 * 120 / 2);
    assert!(
        (differences[differences.len() / 2] - 5 * 256).abs() <= 16,
        "median {}",
        differences[differences.len() / 2]
    );
    let near = differences.iter().filter(|&&d| (d - 5 * 256).abs() <= 256).count();
    assert!(near * 10 >= differences.len() * 9);
}

#[test]
fn a_pillar_before_a_wall_keeps_its_edges() {
    let (wall, pillar) = (Texture::new(660, 120, 4), Texture::new(660, 120, 5));
    let image = |shift: f32| {
        Grey::of(400, 120, |u, v| {
            // The right image shows the texture of a surface further left by its disparity.
            let near = (180.0..220.0).contains(&(u + shift * 40.0));
            if near { pillar.at(u + shift * 40.0, v) } else { wall.at(u + shift * 15.0, v) }
        })
    };
    // Disparities of 40 px for the pillar and 15 px for the wall, in 256ths of a pixel below.
    let (_, disparity) = disparity(&StereoConfig::default(), &image(0.0), &image(1.0), &Serial);
    let share = |columns: std::ops::Range<usize>, expected: f32| {
        let pixels: Vec<u16> = disparity
            .chunks(400)
            .skip(20)
            .take(80)
            .flat_map(|row| row[columns.clone()].to_vec())
            .collect();
        pixels
            .iter()
            .filter(|&&d| {
                (f32::from(d) / 256.0 - expected) * (f32::from(d) / 256.0 - expected) < 2.25
            })
            .count() as f64
            / pixels.len() as f64
    };
    // The columns keep 4 px and more off the pillar's edges, where windows lie on both surfaces.
    assert!(share(184..216, 40.0) > 0.9, "pillar: {}", share(184..216, 40.0));
    assert!(share(230..380, 15.0) > 0.9, "wall to its right: {}", share(230..380, 15.0));
    // What only the left camera sees, to the left of the pillar, is filled with the wall behind.
    assert!(share(60..150, 15.0) > 0.9, "wall to its left: {}", share(60..150, 15.0));
}

#[test]
fn a_lone_patch_goes_and_one_of_the_wall_behind_a_gap_stays() {
    let (wall, near) = (Texture::new(660, 120, 6), Texture::new(660, 120, 7));
    // A patch of 24 x 20 px floats before the wall; another of the wall's own is framed by 20 px
    // without texture.
    let (floating, framed, frame) =
        ((94.0..118.0, 50..70), (274.0..298.0, 50..70), (254.0..318.0, 30..90));
    let image = |shift: f32| {
        Grey::of(400, 120, |u, v| {
            let inside = |(columns, rows): &(std::ops::Range<f32>, std::ops::Range<usize>),
                          d: f32| {
                columns.contains(&(u + shift * d)) && rows.contains(&v)
            };
            if inside(&floating, 40.0) {
                near.at(u + shift * 40.0, v)
            } else if inside(&frame, 15.0) && !inside(&framed, 15.0) {
                120.0
            } else {
                wall.at(u + shift * 15.0, v)
            }
        })
    };
    let (left, right) = (image(0.0), image(1.0));
    let shown = |lone_share: f32, lone_gap: usize| {
        let config =
            StereoConfig { lone_share, lone_gap, gap_width: lone_gap, ..StereoConfig::default() };
        let (report, disparity) = disparity(&config, &left, &right, &Serial);
        let count = |columns: std::ops::Range<usize>, expected: i32| {
            let pixels =
                disparity.chunks(400).skip(50).take(20).flat_map(|row| &row[columns.clone()]);
            pixels.filter(|&&d| (i32::from(d) - 256 * expected).abs() <= 256).count()
        };
        // A removal that took the wall with it would pass the checks of the patches.
        assert!(count(150..230, 15) > 1_500, "the wall stays");
        // The counted columns keep 4 px inside each patch.
        (count(98..114, 40), count(278..294, 15), report)
    };
    let (floating, framed, report) = shown(0.0, 32);
    assert!(floating > 250 && framed > 250, "{floating}, {framed}: {report:?}");
    // Both, and what their edges add, have less than a fiftieth of the image: 960 px.
    let (floating, framed, removed) = shown(0.02, 32);
    assert!(floating == 0 && framed > 250, "{floating}, {framed}: {removed:?}");
    assert!(removed.speckles > report.speckles + 400);
    // A gap of 8 px does not reach across the frame of 20, so that the framed patch is alone too.
    let (floating, framed, _) = shown(0.02, 8);
    assert!(floating == 0 && framed == 0, "{floating}, {framed}");
}
