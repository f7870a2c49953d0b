//! Real pairs against their truth.

use super::*;
use image::DynamicImage;
use std::{format, path::Path, println};

fn read(path: &str) -> DynamicImage {
    image::open(Path::new(dynvox_needs::data_folder!()).join(path)).unwrap()
}

fn grey(path: &str) -> Grey {
    let image = read(path).into_luma8();
    Grey {
        width: image.width() as usize,
        height: image.height() as usize,
        pixels: image.into_raw(),
    }
}

fn deep(path: &str) -> Vec<u16> {
    read(path).into_luma16().into_raw()
}

/// Share of pixels with truth and estimate that are off by more than 3 px; share of truth covered;
/// median and mean |error| of those within 3 px.
fn score(estimate: &[u16], truth: &[u16]) -> [f64; 4] {
    let known = truth.iter().filter(|&&t| t > 0).count();
    let mut off: Vec<u16> = truth
        .iter()
        .zip(estimate)
        .filter(|(t, e)| **t > 0 && **e > 0)
        .map(|(t, e)| t.abs_diff(*e))
        .collect();
    off.sort_unstable();
    // 768 in 1/256 px are 3 px.
    let good = off.iter().take_while(|&&o| o <= 768).count();
    let mean = off[..good].iter().map(|&o| f64::from(o)).sum::<f64>() / good as f64 / 256.0;
    [
        100.0 * (off.len() - good) as f64 / off.len() as f64,
        100.0 * off.len() as f64 / known as f64,
        f64::from(off[good / 2]) / 256.0,
        mean,
    ]
}

fn kitti_2012(config: &StereoConfig, name: &str) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for pair in ["000027", "000151", "000174"] {
        let path = |folder: &str| format!("kitti-stereo-2012/training/{folder}/{pair}_10.png");
        let (left, right, truth) =
            (grey(&path("image_0")), grey(&path("image_1")), deep(&path("disp_noc")));
        let (report, estimate) = disparity(config, &left, &right, &Serial);
        let scores = score(&estimate, &truth);
        println!(
            "{name} {pair}: {:.2} % off at {:.2} % covered, median {:.3} px, mean {:.3} px; \
             {report:?}",
            scores[0], scores[1], scores[2], scores[3]
        );
        for (sum, score) in sums.iter_mut().zip(scores) {
            *sum += score / 3.0;
        }
    }
    println!(
        "{name} mean: {:.2} % off at {:.2} % covered, median {:.3} px, mean {:.3} px",
        sums[0], sums[1], sums[2], sums[3]
    );
    sums
}

#[dynvox_needs::clips("kitti-stereo-2012/training")]
#[test]
fn both_presets_are_as_true_as_published_on_kitti_2012() {
    let figures = [
        ("dynslam", StereoConfig::dynslam(), 5.5, 87.0),
        ("robotics", StereoConfig::robotics(), 4.3, 83.0),
    ];
    for (name, config, off, covered) in figures {
        let scores = kitti_2012(&config, name);
        assert!(scores[0] <= off, "{name}: {:.2} % off", scores[0]);
        assert!(scores[1] >= covered, "{name}: {:.2} % covered", scores[1]);
    }
}

/// Another implementation's disparities of the same pairs: not truth, but a matcher that disagrees
/// with them everywhere is wrong.
#[dynvox_needs::clips("kitti-odometry/sequences/06/disp_elas")]
#[test]
fn agrees_with_the_published_implementation_where_both_see() {
    let clip =
        |folder: &str, frame: usize| format!("kitti-odometry/sequences/06/{folder}/{frame:06}.png");
    // At the beginning, in the middle and near the end.
    for frame in [0, 25, 50] {
        let [left, right] = ["image_0", "image_1"].map(|camera| grey(&clip(camera, frame)));
        let published = deep(&clip("disp_elas", frame));
        let (report, estimate) = disparity(&StereoConfig::dynslam(), &left, &right, &Serial);
        let [off, covered, median, _] = score(&estimate, &published);
        println!(
            "06 {frame}: {off:.2} % off by more than 3 px, {covered:.1} % covered, median \
             {median:.3} px, density {:.3}",
            report.density()
        );
        assert!(
            off < 7.0 && covered > 95.0 && median < 0.35,
            "frame {frame}: {off:.2} %, {covered:.1} %, {median:.3} px"
        );
    }
}
