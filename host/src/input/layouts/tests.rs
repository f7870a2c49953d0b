//! Each layout on a tiny folder, and everything that can be wrong with it.

mod data_sets;
mod folders;
mod published;

use super::*;
use crate::formats::luma;
use crate::input::source::{FrameSource, Scaled, Stacking};
use crate::input::{CameraPair, DATA_SETS, Layout, OpenOptions, open, survey};
use ::image::{GrayImage, ImageBuffer, Luma, RgbImage};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const CALIB: &str = "P0: 50 0 20 0 0 50 16 0 0 0 1 0\nP1: 50 0 20 -25 0 50 16 0 0 0 1 0\n\
                     P2: 50 0 20 3 0 50 16 0 0 0 1 0\nP3: 50 0 20 -22 0 50 16 0 0 0 1 0\n";

fn grey(path: PathBuf, width: u32, seed: u8) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    GrayImage::from_fn(width, 32, |u, v| Luma([(u * 3 + v * 5) as u8 ^ seed])).save(path).unwrap();
}

fn colour(path: PathBuf) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    RgbImage::from_fn(40, 32, |u, v| ::image::Rgb([u as u8, v as u8, 200])).save(path).unwrap();
}

/// Frame `at` of a recording of two cameras.
fn pair(at: u32) -> [GrayImage; 2] {
    [0u32, 90].map(|shift| {
        GrayImage::from_fn(40, 32, |u, v| Luma([(u * 3 + v * 5 + at * 17 + shift) as u8]))
    })
}

fn save(image: &GrayImage, path: PathBuf) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    image.save(path).unwrap();
}

/// An odometry root with sequence 06 of `frames` grey frames.
fn odometry(frames: u32) -> TempDir {
    let root = TempDir::new().unwrap();
    let folder = root.path().join("sequences/06");
    for at in 0..frames {
        grey(folder.join(format!("image_0/{at:06}.png")), 40, at as u8);
        grey(folder.join(format!("image_1/{at:06}.png")), 40, at as u8);
    }
    fs::write(folder.join("calib.txt"), CALIB).unwrap();
    root
}

fn refusal(path: &Path, sequence: Option<&str>) -> String {
    open(path, &OpenOptions { sequence: sequence.map(str::to_owned), ..OpenOptions::default() })
        .err()
        .expect("it should be refused")
        .to_string()
}

#[test]
fn odometry_is_found_from_its_root_its_folder_and_the_sequence() {
    let root = odometry(3);
    fs::write(root.path().join("sequences/06/times.txt"), "0\n0.1\n0.25\n0.4\n").unwrap();
    fs::create_dir_all(root.path().join("poses")).unwrap();
    fs::write(
        root.path().join("poses/06.txt"),
        "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n1 0 0 0 0 1 0 0 0 0 1 2\n",
    )
    .unwrap();
    for path in ["", "sequences", "sequences/06"] {
        let dataset = open(&root.path().join(path), &OpenOptions::default()).unwrap();
        assert_eq!(
            (dataset.name(), dataset.len(), dataset.size()),
            ("kitti-odometry-06", 3, (40, 32))
        );
        assert_eq!((dataset.rig().baseline_m, dataset.time_s(2)), (0.5, 0.25));
        assert_eq!(dataset.truth().unwrap()[2].translation_m[2], 2.0);
        assert!(dataset.notes().is_empty());
        let frame = dataset.frame(1).unwrap();
        assert_eq!(
            frame.left.get(2, 1),
            Some((2 * 3 + 5) ^ 1),
            "pixels arrive as they were stored"
        );
        assert!(frame.colour.is_none());
    }
}

#[test]
fn file_numbers_choose_the_row_of_times_and_poses_when_a_clip_begins_late() {
    let root = odometry(4);
    for camera in ["image_0", "image_1"] {
        fs::remove_file(root.path().join(format!("sequences/06/{camera}/000000.png"))).unwrap();
    }
    fs::write(root.path().join("sequences/06/times.txt"), "0\n1\n2\n3\n").unwrap();
    assert_eq!(
        open(root.path(), &OpenOptions { sequence: Some("06".into()), ..OpenOptions::default() })
            .unwrap()
            .time_s(0),
        1.0
    );
}

#[test]
fn the_colour_pair_has_its_own_calibration_and_truth() {
    let root = odometry(2);
    for at in 0..2 {
        for camera in [2, 3] {
            colour(root.path().join(format!("sequences/06/image_{camera}/{at:06}.png")));
        }
    }
    fs::create_dir_all(root.path().join("poses")).unwrap();
    // A quarter turn about y: a camera 6 cm to the side travels.
    fs::write(
        root.path().join("poses/06.txt"),
        "1 0 0 0 0 1 0 0 0 0 1 0\n0 0 1 0 0 1 0 0 -1 0 0 0\n",
    )
    .unwrap();
    let auto = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(auto.frame(0).unwrap().colour.is_none() && auto.notes()[0].contains("--images colour"));
    let dataset =
        open(root.path(), &OpenOptions { cameras: CameraPair::Colour, ..OpenOptions::default() })
            .unwrap();
    let frame = dataset.frame(0).unwrap();
    assert_eq!(frame.left.get(7, 9), Some(luma([7, 9, 200])));
    assert_eq!(frame.colour.unwrap().get(7, 9), Some([7, 9, 200]));
    let moved = dataset.truth().unwrap()[1].translation_m;
    // Camera 2 stands at x = -t = -0.06 of camera 0, so it goes from there to (0, 0, 0.06): by
    // (0.06, 0, 0.06).
    assert!(
        (nalgebra::Vector3::from(moved) - nalgebra::Vector3::new(0.06, 0.0, 0.06)).norm() < 1e-12,
        "{moved:?}"
    );
}

#[test]
fn tracking_takes_the_colour_pair_and_assumes_ten_hertz_aloud() {
    let root = TempDir::new().unwrap();
    for camera in ["image_02", "image_03"] {
        for name in ["0003/000000.png", "0003/000001.png", "0005/000000.png"] {
            colour(root.path().join("training").join(camera).join(name));
        }
    }
    fs::create_dir_all(root.path().join("training/calib")).unwrap();
    fs::write(
        root.path().join("training/calib/0003.txt"),
        format!("{CALIB}R_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 1 2 3\n"),
    )
    .unwrap();
    for path in ["", "training"] {
        let dataset = open(
            &root.path().join(path),
            &OpenOptions { sequence: Some("0003".into()), ..OpenOptions::default() },
        )
        .unwrap();
        assert_eq!((dataset.len(), dataset.time_s(1), dataset.rig().baseline_m), (2, 0.1, 0.5));
        assert!(dataset.notes().iter().any(|note| note.contains("10 frames a second")));
        assert!(dataset.frame(1).unwrap().colour.is_some());
    }
    assert!(refusal(root.path(), None).contains("0003, 0005"), "a choice is asked for");
    assert!(refusal(root.path(), Some("0007")).contains("It holds 0003, 0005"));
    assert!(refusal(root.path(), Some("0005")).contains("calib/0005.txt is missing"));
}

#[test]
fn a_plain_folder_takes_key_value_lines_or_kittis() {
    let root = TempDir::new().unwrap();
    for side in ["left", "right"] {
        grey(root.path().join(side).join("a.png"), 40, 0);
        grey(root.path().join(side).join("b.png"), 40, 0);
    }
    let calib = root.path().join("calib.txt");
    assert!(
        refusal(root.path(), None)
            .contains("calib.txt is missing. A stereo folder has the images of both cameras")
    );
    fs::write(
        &calib,
        "# my rig\nfocal_px 50\ncenter_u_px = 20\ncenter_v_px: 16\nbaseline_m 0.5 # metres\n",
    )
    .unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert_eq!((dataset.rig().focal_px, dataset.rig().baseline_m, dataset.len()), (50.0, 0.5, 2));
    fs::write(&calib, CALIB).unwrap();
    assert_eq!(open(root.path(), &OpenOptions::default()).unwrap().rig(), dataset.rig());
    fs::write(&calib, "focal_px 50\nbaseline_m -0.5\ncenter_u_px 3\n").unwrap();
    assert!(refusal(root.path(), None).contains("center_v_px is missing"));
    fs::write(&calib, "focal_px 50\nbaseline_m -0.5\ncenter_u_px 3\ncenter_v_px 3\n").unwrap();
    assert!(refusal(root.path(), None).contains("the baseline is -0.5 m: the right camera stands"));
    fs::write(&calib, "focal_px 50\nbaselin_m 0.5\n").unwrap();
    assert!(refusal(root.path(), None).contains("`baselin_m 0.5` is not a line of it"));
}

#[test]
fn images_without_a_partner_are_counted_and_times_stay() {
    let root = odometry(6);
    fs::write(root.path().join("sequences/06/times.txt"), "0\n1\n2\n3\n4\n5\n").unwrap();
    fs::remove_file(root.path().join("sequences/06/image_1/000001.png")).unwrap();
    fs::remove_file(root.path().join("sequences/06/image_0/000004.png")).unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert_eq!(
        (0..dataset.len()).map(|at| dataset.time_s(at)).collect::<Vec<_>>(),
        [0.0, 2.0, 3.0, 5.0]
    );
    assert!(
        dataset.notes()[0].contains("1 left and 1 right images have no partner: skipped"),
        "{:?}",
        dataset.notes()
    );
    fs::remove_dir_all(root.path().join("sequences/06/image_1")).unwrap();
    let message = refusal(root.path(), None);
    assert!(
        message.contains("image_1 is missing") && message.contains("fetch the other half"),
        "{message}"
    );
}

#[test]
fn frames_named_without_padding_come_in_the_order_of_their_numbers() {
    let root = TempDir::new().unwrap();
    for (at, name) in ["8", "9", "10", "11"].iter().enumerate() {
        for side in ["left", "right"] {
            grey(root.path().join(format!("{side}/{name}.png")), 40, at as u8);
        }
    }
    fs::write(root.path().join("calib.txt"), CALIB).unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert_eq!(
        (0..4).map(|at| dataset.stem(at).unwrap()).collect::<Vec<_>>(),
        ["8", "9", "10", "11"]
    );
    assert_eq!(dataset.frame(3).unwrap().left.get(0, 0), Some(3));
}

#[test]
fn sixteen_bit_images_keep_one_range_over_the_sequence_and_it_is_said() {
    let root = odometry(4);
    for (at, side) in [(0u32, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1)] {
        let path = root.path().join(format!("sequences/06/image_{side}/{at:06}.png"));
        // Bright only in the last frame: the first alone would be taken for 10 bits.
        let value = |u: u32| (u * 25 + if at == 3 { 2_900 } else { 0 }) as u16;
        ImageBuffer::<Luma<u16>, _>::from_fn(40, 32, |u, _| Luma([value(u)])).save(path).unwrap();
    }
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(
        dataset.notes().iter().any(|note| note.contains("12 bits are taken as significant")),
        "{:?}",
        dataset.notes()
    );
    assert_eq!(dataset.frame(0).unwrap().left.get(39, 0), Some((975 / 16) as u8));
    assert_eq!(dataset.frame(3).unwrap().left.get(39, 0), Some((3_875 / 16) as u8));
    let given =
        open(root.path(), &OpenOptions { bits: Some(10), ..OpenOptions::default() }).unwrap();
    assert_eq!(given.frame(0).unwrap().left.get(39, 0), Some((975 / 4) as u8));
}

#[test]
fn images_of_another_size_and_truncated_ones_are_refused_by_name() {
    let root = odometry(4);
    let image =
        |side: u8, at: u8| root.path().join(format!("sequences/06/image_{side}/{at:06}.png"));
    grey(image(1, 1), 41, 0);
    let bytes = fs::read(image(0, 2)).unwrap();
    fs::write(image(0, 2), &bytes[..bytes.len() / 2]).unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(dataset.frame(0).is_ok());
    let message = |at| dataset.frame(at).unwrap_err().to_string();
    assert!(
        message(1)
            .contains("image_1/000001.png is 41 x 32 px, but the sequence began with 40 x 32"),
        "{}",
        message(1)
    );
    assert!(
        message(2).contains("image_0/000002.png cannot be read")
            && message(2).contains("--skip-bad-frames"),
        "{}",
        message(2)
    );
}

#[test]
fn calibrations_times_and_poses_that_do_not_fit_are_refused_or_said() {
    let root = odometry(3);
    let file = |name: &str| root.path().join("sequences/06").join(name);
    fs::write(file("times.txt"), "0\n0.1\n").unwrap();
    assert!(
        refusal(root.path(), None)
            .contains("it has 2 rows for 3 images, and there are images up to")
    );
    fs::write(file("times.txt"), "0\n0.1\n0.1\n").unwrap();
    assert!(refusal(root.path(), None).contains("the time on line 3 is not after"));
    fs::write(file("times.txt"), "0\n0.1\nsoon\n").unwrap();
    assert!(refusal(root.path(), None).contains("line 3 is not one time in seconds"));
    fs::remove_file(file("times.txt")).unwrap();
    fs::write(file("poses.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n").unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(
        dataset.truth().is_none()
            && dataset.notes().iter().any(|note| note.contains("it has 1 rows for 3 images"))
    );
    fs::write(file("calib.txt"), CALIB.lines().next().unwrap()).unwrap();
    assert!(
        refusal(root.path(), None)
            .contains("calib.txt cannot be used: it has no P1. Add the line `P1: `")
    );
    fs::write(file("calib.txt"), CALIB.replace("-25", "25")).unwrap();
    assert!(refusal(root.path(), None).contains("the baseline is -0.5 m"));
    fs::remove_file(file("calib.txt")).unwrap();
    assert!(
        open(root.path(), &OpenOptions::default())
            .err()
            .unwrap()
            .to_string()
            .contains("calib.txt is missing")
    );
}

#[test]
fn what_is_not_there_or_not_a_data_set_is_said() {
    let root = odometry(1);
    assert!(refusal(&root.path().join("nowhere"), None).contains("there is no data set at"));
    assert!(
        refusal(root.path(), Some("09")).contains("no sequence 09")
            && refusal(root.path(), Some("09")).contains("It holds 06")
    );
    assert!(refusal(&root.path().join("sequences/06"), Some("09")).contains("only 06"));
    let above = TempDir::new().unwrap();
    fs::create_dir_all(above.path().join("mine/left")).unwrap();
    assert!(refusal(above.path(), None).ends_with("mine"), "a data set one level below is named");
    let empty = TempDir::new().unwrap();
    assert!(refusal(empty.path(), None).contains("--dataset says which one is meant"));
    fs::create_dir_all(empty.path().join("left")).unwrap();
    fs::create_dir_all(empty.path().join("right")).unwrap();
    fs::write(empty.path().join("calib.txt"), CALIB).unwrap();
    assert!(refusal(empty.path(), None).contains("holds no image"));
}

#[test]
fn half_size_averages_four_pixels_and_halves_the_rig() {
    let root = odometry(1);
    let small = || open(root.path(), &OpenOptions::default()).unwrap();
    assert!(Scaled::new(small(), 0.5).is_err(), "20 x 16 px are too few");
    assert!(
        Scaled::new(small(), 0.0).is_err()
            && Scaled::new(small(), 1.5).is_err()
            && Scaled::new(small(), f64::NAN).is_err()
    );
    let wide = TempDir::new().unwrap();
    for side in ["left", "right"] {
        fs::create_dir_all(wide.path().join(side)).unwrap();
        GrayImage::from_fn(80, 64, |u, v| Luma([(u * 3 + v * 2) as u8]))
            .save(wide.path().join(side).join("0.png"))
            .unwrap();
    }
    let calib = CALIB.replace(" 20 ", " 40 ").replace(" 16 ", " 32 ");
    fs::write(wide.path().join("calib.txt"), calib).unwrap();
    let half = Scaled::new(open(wide.path(), &OpenOptions::default()).unwrap(), 0.5).unwrap();
    assert_eq!((half.size(), half.rig().focal_px, half.rig().center_u_px), ((40, 32), 25.0, 19.75));
    let pixel = |u: u32, v: u32| u * 3 + v * 2;
    let mean = (pixel(10, 6) + pixel(11, 6) + pixel(10, 7) + pixel(11, 7) + 2) / 4;
    assert_eq!(half.frame(0).unwrap().left.get(5, 3), Some(mean as u8));
}

#[test]
fn raw_recordings_are_refused_without_a_calibration() {
    let root = TempDir::new().unwrap();
    (0..2).for_each(|at| {
        for (side, image) in ["cam0", "cam1"].iter().zip(pair(at)) {
            save(&image, root.path().join(format!("mav0/{side}/data/{at}.png")));
        }
    });
    assert!(refusal(root.path(), None).contains("are raw, and no calibration of their lenses"));
    let calibration = root.path().join("mine.txt");
    fs::write(&calibration, CALIB).unwrap();
    assert_eq!(
        open(
            root.path(),
            &OpenOptions { calibration: vec![calibration], ..OpenOptions::default() }
        )
        .unwrap()
        .len(),
        2
    );
}
