//! A clean pair gives no finding; each planted fault is named.

use super::*;
use crate::formats::calibration::{CalibrationHints, LengthUnit};
use crate::formats::read_picture;
use crate::input::{OpenOptions, open};
use std::path::PathBuf;

const WIDTH: usize = 480;
const HEIGHT: usize = 200;

/// Smooth noise of several scales about a shift in the world.
fn texture(x: f64, y: f64) -> f64 {
    let hash = |i: i64, j: i64, seed: u64| {
        let mixed = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (j as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ seed;
        ((mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40) as f64
            / (1u64 << 24) as f64
    };
    let layer = |scale: f64, seed: u64| {
        let (x, y) = (x / scale, y / scale);
        let (i, j) = (x.floor(), y.floor());
        let (s, t) = (x - i, y - j);
        let at = |di: i64, dj: i64| hash(i as i64 + di, j as i64 + dj, seed);
        (at(0, 0) * (1.0 - s) + at(1, 0) * s) * (1.0 - t)
            + (at(0, 1) * (1.0 - s) + at(1, 1) * s) * t
    };
    20.0 + 90.0 * layer(3.0, 1) + 70.0 * layer(11.0, 2) + 50.0 * layer(60.0, 3)
}

fn image(at: impl Fn(f64, f64) -> f64) -> Image<u8> {
    let pixels = (0..WIDTH * HEIGHT)
        .map(|i| at((i % WIDTH) as f64, (i / WIDTH) as f64).clamp(0.0, 255.0) as u8);
    Image::new(WIDTH, HEIGHT, pixels.collect()).unwrap()
}

/// Pairs of a wall 12 px of disparity away; `right` says where a right pixel looks in the left
/// image, and how bright it is.
fn faults(right: impl Fn(f64, f64) -> ([f64; 2], f64)) -> Vec<Fault> {
    let pairs: Vec<Pair> = (0..3)
        .map(|frame| {
            let shift = 400.0 * f64::from(frame);
            let left = image(|u, v| texture(u + shift, v));
            let seen = image(|u, v| {
                let ([u, v], gain) = right(u, v);
                gain * texture(u + shift, v)
            });
            Pair::new(&left, &seen, 10)
        })
        .collect();
    assert!(
        pairs
            .iter()
            .all(|pair| pair.difference < SAME || pair.mean < BLACK || pair.matches.len() > 20)
    );
    diagnose(&pairs).into_iter().map(|finding| finding.fault).collect()
}

#[test]
fn a_clean_pair_gives_no_finding_and_each_fault_is_named() {
    assert_eq!(faults(|u, v| ([u + 12.0, v], 1.0)), []);
    assert_eq!(faults(|u, v| ([u - 12.0, v], 1.0)), [Fault::Exchanged]);
    assert_eq!(faults(|u, v| ([u + 12.0, v - 3.0], 1.0)), [Fault::NotRectified]);
    // Beyond the near search for rows.
    assert_eq!(faults(|u, v| ([u + 12.0, v - 14.0], 1.0)), [Fault::NotRectified]);
    let roll = 0.6f64.to_radians();
    assert_eq!(faults(|u, v| ([u + 12.0, v + roll * (u - 240.0)], 1.0)), [Fault::NotRectified]);
    assert_eq!(faults(|u, v| ([u + 12.0, v], 0.6)), [Fault::Exposure]);
    assert_eq!(faults(|u, v| ([u, v], 1.0)), [Fault::SameImage]);
}

#[test]
fn the_message_gives_the_size_of_the_fault_and_large_faults_are_refused() {
    let finding_for = |rows: f64| {
        let pairs = [0.0, 400.0, 800.0].map(|shift| {
            let left = image(|u, v| texture(u + shift, v));
            Pair::new(&left, &image(|u, v| texture(u + shift + 12.0, v - rows)), 10)
        });
        let findings = diagnose(&pairs);
        (findings[0].refused, findings[0].message.clone())
    };
    let (refused, message) = finding_for(3.0);
    assert!(
        refused && message.contains("rows lie 3.0 px apart") && message.contains("--calibration"),
        "{message}"
    );
    assert!(!finding_for(0.8).0, "a warning");
}

#[test]
fn black_images_are_refused_and_too_few_matches_are_said() {
    let black = image(|_, _| 0.0);
    assert_eq!(diagnose(&[Pair::new(&black, &black, 10)])[0].fault, Fault::Black);
    let grey = image(|u, _| 100.0 + u / 10.0);
    let other = image(|u, _| 90.0 + u / 10.0);
    assert!(
        diagnose(&[Pair::new(&grey, &other, 1)]).iter().all(|finding| [
            Fault::Focus,
            Fault::Unknown
        ]
        .contains(&finding.fault)),
        "nothing can be matched"
    );
    let unknown = diagnose(&[Pair::new(&grey, &other, 1)]).pop().unwrap();
    assert!(
        unknown.fault == Fault::Unknown
            && !unknown.refused
            && unknown.message.contains("could not be examined: 0 matches"),
        "{unknown:?}"
    );
}

#[test]
fn shuffled_frames_are_out_of_order_and_a_gap_is_a_jump() {
    let thumbnails = |shifts: &[f64]| {
        shifts
            .iter()
            .map(|shift| order::thumbnail(&image(|u, v| texture(u + shift, v))))
            .collect::<Vec<_>>()
    };
    let moving: Vec<f64> = (0..16).map(|frame| 6.0 * f64::from(frame)).collect();
    assert!(order::check(&thumbnails(&moving), 0).is_none());
    let shuffled: Vec<f64> = (0..16).map(|frame| moving[frame * 7 % 16]).collect();
    assert_eq!(order::check(&thumbnails(&shuffled), 0).unwrap().fault, Fault::Order);
    assert!(order::check(&thumbnails(&[5.0; 16]), 0).is_none(), "a standing camera");
}

/// A folder of the clips.
pub fn data(path: &str) -> PathBuf {
    PathBuf::from(dynvox_needs::data_folder!()).join(path)
}

#[dynvox_needs::clips(
    "kitti-odometry/sequences/06",
    "kitti-odometry/sequences/r1405",
    "kitti-tracking/training/image_02/0003",
    "kitti-tracking/training/image_02/0005",
    "kitti-raw/2011_09_26/2011_09_26_drive_1405_extract"
)]
#[test]
fn real_clips_give_no_false_alarm() {
    let clips: [(&str, Option<&str>); 5] = [
        ("kitti-odometry", Some("06")),
        ("kitti-odometry", Some("r1405")),
        ("kitti-tracking", Some("0003")),
        ("kitti-tracking", Some("0005")),
        ("kitti-raw/2011_09_26/2011_09_26_drive_1405_extract", None),
    ];
    for (path, sequence) in clips {
        let options =
            OpenOptions { sequence: sequence.map(str::to_owned), ..OpenOptions::default() };
        let source = open(&data(path), &options).unwrap();
        let findings = examine(source.as_ref(), &(0..source.len()).collect::<Vec<_>>()).unwrap();
        assert!(findings.is_empty(), "{sequence:?}: {findings:?}");
    }
}

#[dynvox_needs::clips("kitti-stereo-2012/training")]
#[test]
fn single_real_pairs_give_no_false_alarm() {
    let folder = data("kitti-stereo-2012/training");
    for name in ["000027_10.png", "000151_10.png", "000174_10.png"] {
        let [left, right] = ["image_0", "image_1"].map(|camera| {
            read_picture(&folder.join(camera).join(name)).unwrap().to_8_bit(None).grey
        });
        let findings = diagnose(&[Pair::new(&left, &right, 1)]);
        assert!(findings.is_empty(), "{name}: {findings:?}");
    }
}

/// Pictures of a chessboard by a good rig: rows agree within 0.25 px, disparities reach 150 px.
#[dynvox_needs::clips("other-cameras/opencv-lab")]
#[test]
fn a_good_rig_has_one_verdict_for_any_number_of_pictures() {
    let folder = data("other-cameras/opencv-lab");
    let scratch = tempfile::TempDir::new().unwrap();
    let entries = |name: &str| {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        text.replace("%YAML:1.0", "").replace("---", "")
    };
    let file = scratch.path().join("stereo.yml");
    let head = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n";
    let (lenses, poses) = (entries("intrinsics.yml"), entries("extrinsics.yml"));
    std::fs::write(&file, format!("{head}{lenses}\n{poses}")).unwrap();
    // Translations are in squares of the board.
    let hints = CalibrationHints { unit: Some(LengthUnit(0.025)), ..Default::default() };
    let options = OpenOptions { calibration: vec![file], hints, ..OpenOptions::default() };
    let source = open(&folder, &options).unwrap();
    for count in [1, 2, 3, 5, 8, source.len()] {
        let findings = examine(source.as_ref(), &(0..count).collect::<Vec<_>>()).unwrap();
        let rows = findings
            .iter()
            .find(|finding| matches!(finding.fault, Fault::NotRectified | Fault::Unknown));
        assert!(rows.is_none(), "{count} pairs: {rows:?}");
    }
}

/// Two flat pictures 3 px apart in rows, as a rectified pair and through lenses without distortion.
#[test]
fn rows_that_a_calibration_leaves_apart_are_its_own_fault() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (side, rows, shift) in [("left", 0.0, 0.0), ("right", 3.0, 12.0)] {
        std::fs::create_dir(path(side)).unwrap();
        for at in 0..3 {
            let picture = image(|u, v| texture(u + 400.0 * f64::from(at) + shift, v - rows));
            let head = format!("P5\n{WIDTH} {HEIGHT}\n255\n");
            let bytes = [head.as_bytes(), picture.pixels()].concat();
            std::fs::write(path(side).join(format!("{at}.pgm")), bytes).unwrap();
        }
    }
    let message = |name: &str, text: &str| {
        std::fs::write(path(name), text).unwrap();
        let options = OpenOptions { calibration: vec![path(name)], ..OpenOptions::default() };
        let source = open(folder.path(), &options).unwrap();
        let findings = examine(source.as_ref(), &[0, 1, 2]).unwrap();
        let rows = findings.into_iter().find(|finding| finding.fault == Fault::NotRectified);
        rows.expect("rows lie apart").message
    };
    let keys = "focal_px 400\ncenter_u_px 239.5\ncenter_v_px 99.5\nbaseline_m 0.1\n";
    let rectified = message("rectified.txt", keys);
    assert!(rectified.contains("are not rectified") && rectified.contains(GIVE_RAW), "{rectified}");
    let matrix = "[[400, 0, 239.5], [0, 400, 99.5], [0, 0, 1]]";
    let none = "[0, 0, 0, 0, 0]";
    let raw = message(
        "stereo.yml",
        &format!(
            "K1: {matrix}\nD1: {none}\nK2: {matrix}\nD2: {none}\nR: [[1, 0, 0], [0, 1, 0], [0, 0, \
             1]]\nT: [-0.1, 0, 0]\n"
        ),
    );
    assert!(raw.contains("their calibration does not rectify") && raw.contains("anew"), "{raw}");
    assert!(!raw.contains(GIVE_RAW), "{raw}");
}
