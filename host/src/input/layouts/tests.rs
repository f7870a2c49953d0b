//! Each layout on a tiny folder, and everything that can be wrong with it.

use super::*;
use crate::formats::luma;
use crate::input::source::{FrameSource, Scaled};
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
fn odometry_is_found_from_its_root_its_sequences_folder_and_the_sequence_itself() {
    let root = odometry(3);
    fs::write(root.path().join("sequences/06/times.txt"), "0\n0.1\n0.25\n0.4\n").unwrap();
    fs::create_dir_all(root.path().join("poses")).unwrap();
    fs::write(root.path().join("poses/06.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n1 0 0 0 0 1 0 0 0 0 1 2\n").unwrap();
    for path in ["", "sequences", "sequences/06"] {
        let dataset = open(&root.path().join(path), &OpenOptions::default()).unwrap();
        assert_eq!((dataset.name(), dataset.len(), dataset.size()), ("kitti-odometry-06", 3, (40, 32)));
        assert_eq!((dataset.rig().baseline_m, dataset.time_s(2)), (0.5, 0.25));
        assert_eq!(dataset.truth().unwrap()[2].translation_m[2], 2.0);
        assert!(dataset.notes().is_empty());
        let frame = dataset.frame(1).unwrap();
        assert_eq!(frame.left.get(2, 1), Some((2 * 3 + 5) ^ 1), "pixels arrive as they were stored");
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
    assert_eq!(open(root.path(), &OpenOptions { sequence: Some("06".into()), ..OpenOptions::default() }).unwrap().time_s(0), 1.0);
}

#[test]
fn the_colour_pair_has_its_own_calibration_and_the_truth_moves_to_its_camera() {
    let root = odometry(2);
    for at in 0..2 {
        for camera in [2, 3] {
            colour(root.path().join(format!("sequences/06/image_{camera}/{at:06}.png")));
        }
    }
    fs::create_dir_all(root.path().join("poses")).unwrap();
    // A quarter turn about y: a camera 6 cm to the side travels.
    fs::write(root.path().join("poses/06.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n0 0 1 0 0 1 0 0 -1 0 0 0\n").unwrap();
    let auto = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(auto.frame(0).unwrap().colour.is_none() && auto.notes()[0].contains("--images colour"));
    let dataset = open(root.path(), &OpenOptions { cameras: CameraPair::Colour, ..OpenOptions::default() }).unwrap();
    let frame = dataset.frame(0).unwrap();
    assert_eq!(frame.left.get(7, 9), Some(luma([7, 9, 200])));
    assert_eq!(frame.colour.unwrap().get(7, 9), Some([7, 9, 200]));
    let moved = dataset.truth().unwrap()[1].translation_m;
    // Camera 2 stands at x = -t = -0.06 of camera 0, so it goes from there to (0, 0, 0.06): by (0.06, 0, 0.06).
    assert!((nalgebra::Vector3::from(moved) - nalgebra::Vector3::new(0.06, 0.0, 0.06)).norm() < 1e-12, "{moved:?}");
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
    fs::write(root.path().join("training/calib/0003.txt"), format!("{CALIB}R_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 1 2 3\n")).unwrap();
    for path in ["", "training"] {
        let dataset = open(&root.path().join(path), &OpenOptions { sequence: Some("0003".into()), ..OpenOptions::default() }).unwrap();
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
    assert!(refusal(root.path(), None).contains("calib.txt is missing. A stereo folder has the images of both cameras"));
    fs::write(&calib, "# my rig\nfocal_px 50\ncenter_u_px = 20\ncenter_v_px: 16\nbaseline_m 0.5 # metres\n").unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert_eq!((dataset.rig().focal_px, dataset.rig().baseline_m, dataset.len()), (50.0, 0.5, 2));
    fs::write(&calib, CALIB).unwrap();
    assert_eq!(open(root.path(), &OpenOptions::default()).unwrap().rig(), dataset.rig());
    fs::write(&calib, "focal_px 50\nbaseline_m -0.5\ncenter_u_px 3\n").unwrap();
    assert!(refusal(root.path(), None).contains("center_v_px is missing"));
    fs::write(&calib, "focal_px 50\nbaseline_m -0.5\ncenter_u_px 3\ncenter_v_px 3\n").unwrap();
    assert!(refusal(root.path(), None).contains("the baseline is -0.5 m. The right camera must stand"));
    fs::write(&calib, "focal_px 50\nbaselin_m 0.5\n").unwrap();
    assert!(refusal(root.path(), None).contains("`baselin_m 0.5` is not a line of it"));
}

#[test]
fn images_without_a_partner_are_skipped_and_counted_and_the_rest_keeps_its_times() {
    let root = odometry(6);
    fs::write(root.path().join("sequences/06/times.txt"), "0\n1\n2\n3\n4\n5\n").unwrap();
    fs::remove_file(root.path().join("sequences/06/image_1/000001.png")).unwrap();
    fs::remove_file(root.path().join("sequences/06/image_0/000004.png")).unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert_eq!((0..dataset.len()).map(|at| dataset.time_s(at)).collect::<Vec<_>>(), [0.0, 2.0, 3.0, 5.0]);
    assert!(dataset.notes()[0].contains("1 left and 1 right images have no partner: skipped"), "{:?}", dataset.notes());
    fs::remove_dir_all(root.path().join("sequences/06/image_1")).unwrap();
    let message = refusal(root.path(), None);
    assert!(message.contains("image_1 is missing") && message.contains("fetch the other half"), "{message}");
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
    assert_eq!((0..4).map(|at| dataset.stem(at).unwrap()).collect::<Vec<_>>(), ["8", "9", "10", "11"]);
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
    assert!(dataset.notes().iter().any(|note| note.contains("12 bits are taken as significant")), "{:?}", dataset.notes());
    assert_eq!(dataset.frame(0).unwrap().left.get(39, 0), Some((975 / 16) as u8));
    assert_eq!(dataset.frame(3).unwrap().left.get(39, 0), Some((3_875 / 16) as u8));
    let given = open(root.path(), &OpenOptions { bits: Some(10), ..OpenOptions::default() }).unwrap();
    assert_eq!(given.frame(0).unwrap().left.get(39, 0), Some((975 / 4) as u8));
}

#[test]
fn images_of_another_size_and_truncated_ones_are_refused_by_name() {
    let root = odometry(4);
    let image = |side: u8, at: u8| root.path().join(format!("sequences/06/image_{side}/{at:06}.png"));
    grey(image(1, 1), 41, 0);
    let bytes = fs::read(image(0, 2)).unwrap();
    fs::write(image(0, 2), &bytes[..bytes.len() / 2]).unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(dataset.frame(0).is_ok());
    let message = |at| dataset.frame(at).unwrap_err().to_string();
    assert!(message(1).contains("image_1/000001.png is 41 x 32 px, but the sequence began with 40 x 32"), "{}", message(1));
    assert!(message(2).contains("image_0/000002.png cannot be read") && message(2).contains("--frames"), "{}", message(2));
}

#[test]
fn calibrations_times_and_poses_that_do_not_fit_are_refused_or_said() {
    let root = odometry(3);
    let file = |name: &str| root.path().join("sequences/06").join(name);
    fs::write(file("times.txt"), "0\n0.1\n").unwrap();
    assert!(refusal(root.path(), None).contains("it has 2 times, but there are images up to number 2"));
    fs::write(file("times.txt"), "0\n0.1\n0.1\n").unwrap();
    assert!(refusal(root.path(), None).contains("the time on line 3 is not after"));
    fs::write(file("times.txt"), "0\n0.1\nsoon\n").unwrap();
    assert!(refusal(root.path(), None).contains("line 3 is not one time in seconds"));
    fs::remove_file(file("times.txt")).unwrap();
    fs::write(file("poses.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n").unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(dataset.truth().is_none() && dataset.notes().iter().any(|note| note.contains("only 1 poses for 3 images")));
    fs::write(file("calib.txt"), CALIB.lines().next().unwrap()).unwrap();
    assert!(refusal(root.path(), None).contains("calib.txt cannot be used: it has no P1. Add the line `P1: `"));
    fs::write(file("calib.txt"), CALIB.replace("-25", "25")).unwrap();
    assert!(refusal(root.path(), None).contains("the baseline is -0.5 m"));
    fs::remove_file(file("calib.txt")).unwrap();
    assert!(open(root.path(), &OpenOptions::default()).err().unwrap().to_string().contains("calib.txt is missing"));
}

#[test]
fn what_is_not_there_or_not_a_data_set_is_said() {
    let root = odometry(1);
    assert!(refusal(&root.path().join("nowhere"), None).contains("there is no data set at"));
    assert!(refusal(root.path(), Some("09")).contains("no sequence 09") && refusal(root.path(), Some("09")).contains("It holds 06"));
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
    assert!(Scaled::new(small(), 0.0).is_err() && Scaled::new(small(), 1.5).is_err() && Scaled::new(small(), f64::NAN).is_err());
    let wide = TempDir::new().unwrap();
    for side in ["left", "right"] {
        fs::create_dir_all(wide.path().join(side)).unwrap();
        GrayImage::from_fn(80, 64, |u, v| Luma([(u * 3 + v * 2) as u8])).save(wide.path().join(side).join("0.png")).unwrap();
    }
    fs::write(wide.path().join("calib.txt"), CALIB).unwrap();
    let half = Scaled::new(open(wide.path(), &OpenOptions::default()).unwrap(), 0.5).unwrap();
    assert_eq!((half.size(), half.rig().focal_px, half.rig().center_u_px), ((40, 32), 25.0, 9.75));
    let pixel = |u: u32, v: u32| u * 3 + v * 2;
    let mean = (pixel(10, 6) + pixel(11, 6) + pixel(10, 7) + pixel(11, 7) + 2) / 4;
    assert_eq!(half.frame(0).unwrap().left.get(5, 3), Some(mean as u8));
}

/// Four frames of two cameras, as anything can be dressed with them.
fn pair(at: u32) -> [GrayImage; 2] {
    [0u32, 90].map(|shift| GrayImage::from_fn(40, 32, |u, v| Luma([(u * 3 + v * 5 + at * 17 + shift) as u8])))
}

fn save(image: &GrayImage, path: PathBuf) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    image.save(path).unwrap();
}

#[test]
fn one_recording_dressed_in_every_folder_and_format_gives_the_same_frames() {
    type Dress = fn(&Path, u32, &[GrayImage; 2]);
    let dresses: [(&str, Dress); 9] = [
        ("two folders, left and right", |root, at, [l, r]| {
            save(l, root.join(format!("left/{}.png", at + 8)));
            save(r, root.join(format!("right/{}.png", at + 8)));
        }),
        ("two folders, cam0 and cam1", |root, at, [l, r]| {
            save(l, root.join(format!("cam0/data/{at:06}.pgm")));
            save(r, root.join(format!("cam1/data/{at:06}.pgm")));
        }),
        ("two folders, infra1 and infra2", |root, at, [l, r]| {
            save(l, root.join(format!("infra1/a_{at}.tiff")));
            save(r, root.join(format!("infra2/b_{at:04}.bmp")));
        }),
        ("two folders, Left and Right", |root, at, [l, r]| {
            let deep = |image: &GrayImage, path: PathBuf| {
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                ImageBuffer::from_fn(40, 32, |u, v| Luma([u16::from(image.get_pixel(u, v)[0]) << 8])).save(path).unwrap();
            };
            deep(l, root.join(format!("Left/{at}.png")));
            deep(r, root.join(format!("Right/{at}.png")));
        }),
        ("two folders, image_0 and image_1", |root, at, [l, r]| {
            // The right camera is a millisecond late.
            save(l, root.join(format!("image_0/{}.png", 1_403_636_579_000_000_000 + u64::from(at) * 50_000_000)));
            save(r, root.join(format!("image_1/{}.png", 1_403_636_579_001_000_000 + u64::from(at) * 50_000_000)));
        }),
        ("one folder, the camera in the files' names", |root, at, [l, r]| {
            save(l, root.join(format!("left_{}.png", at + 8)));
            save(r, root.join(format!("right_{}.png", at + 8)));
        }),
        ("one folder, the camera in the files' names", |root, at, [l, r]| {
            save(l, root.join(format!("{at:03}_0.ppm")));
            save(r, root.join(format!("{at:03}_1.ppm")));
        }),
        ("one folder, both images in one file", |root, at, [l, r]| {
            save(&GrayImage::from_fn(80, 32, |u, v| *if u < 40 { l } else { r }.get_pixel(u % 40, v)), root.join(format!("{at}.png")));
        }),
        ("one folder, both images in one file", |root, at, [l, r]| {
            save(&GrayImage::from_fn(40, 64, |u, v| *if v < 32 { l } else { r }.get_pixel(u, v % 32)), root.join(format!("{at}.png")));
        }),
    ];
    for (arrangement, dress) in dresses {
        let root = TempDir::new().unwrap();
        fs::write(root.path().join("calib.txt"), CALIB).unwrap();
        (0..4).for_each(|at| dress(root.path(), at, &pair(at)));
        assert_eq!(folder::describe(root.path()), arrangement);
        let dataset = open(root.path(), &OpenOptions::default()).unwrap_or_else(|error| panic!("{arrangement}: {error}"));
        assert_eq!((dataset.len(), dataset.size()), (4, (40, 32)), "{arrangement}");
        for at in 0..4 {
            let frame = dataset.frame(at).unwrap();
            let expected = pair(at as u32).map(|image| image.into_raw());
            assert_eq!([frame.left.pixels(), frame.right.pixels()], expected.each_ref().map(Vec::as_slice), "{arrangement} frame {at}");
        }
    }
}

#[test]
fn images_of_one_camera_are_refused_unless_said_to_hold_both() {
    let root = TempDir::new().unwrap();
    fs::write(root.path().join("calib.txt"), CALIB).unwrap();
    (0..2).for_each(|at| save(&pair(at)[0], root.path().join(format!("{at}.png"))));
    assert!(refusal(root.path(), None).contains("--stacked side-by-side"));
    let options = OpenOptions { stacking: Some(Stacking::SideBySide), ..OpenOptions::default() };
    assert_eq!(open(root.path(), &options).unwrap().size(), (20, 32));
}

/// Four frames at 20 Hz in the layouts of other data sets, each with its own calibration and times.
#[test]
fn one_recording_dressed_as_each_data_set_gives_the_same_frames_rig_and_times() {
    let each = |dress: &dyn Fn(u32, [GrayImage; 2])| (0..4).for_each(|at| dress(at, pair(at)));
    let rect = CALIB.replace("P0", "P_rect_00").replace("P1", "P_rect_01").replace("P2", "P_rect_02").replace("P3", "P_rect_03");
    let dates: String = (0..4).map(|at| format!("2011-09-26 13:02:25.{:09}\n", at * 50_000_000)).collect();
    let start_ns: u64 = 1_317_042_145_000_000_000;
    let write = |path: PathBuf, text: &str| {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    let dress = |layout: Layout, root: &Path| match layout {
        Layout::KittiRaw => {
            let drive = root.join("2011_09_26_drive_0001_sync");
            write(root.join("calib_cam_to_cam.txt"), &format!("calib_time: 09-Jan-2012\nS_rect_00: 40 32\n{rect}"));
            each(&|at, [l, r]| {
                save(&l, drive.join(format!("image_00/data/{at:010}.png")));
                save(&r, drive.join(format!("image_01/data/{at:010}.png")));
            });
            ["image_00", "image_01"].iter().for_each(|camera| write(drive.join(camera).join("timestamps.txt"), &dates));
        }
        Layout::Kitti360 => {
            let drive = root.join("data_2d_raw/2013_05_28_drive_0000_sync");
            write(root.join("calibration/perspective.txt"), &rect);
            each(&|at, [l, r]| {
                save(&l, drive.join(format!("image_00/data_rect/{at:010}.png")));
                save(&r, drive.join(format!("image_01/data_rect/{at:010}.png")));
            });
            ["image_00", "image_01"].iter().for_each(|camera| write(drive.join(camera).join("timestamps.txt"), &dates));
        }
        Layout::Cityscapes => {
            let camera = r#"{"extrinsic": {"baseline": 0.5, "x": 1.7}, "intrinsic": {"fx": 50, "fy": 50.1, "u0": 20, "v0": 16}}"#;
            write(root.join("camera/train/aachen/aachen_000001_000002_camera.json"), camera);
            each(&|at, [l, r]| {
                save(&l, root.join(format!("leftImg8bit_sequence/train/aachen/aachen_000001_{at:06}_leftImg8bit.png")));
                save(&r, root.join(format!("rightImg8bit_sequence/train/aachen/aachen_000001_{at:06}_rightImg8bit.png")));
            });
        }
        _ => {
            write(root.join("mav0/calib.txt"), CALIB);
            let table = |late: u64| {
                let row = |at: u64| format!("{},{at}.png\r\n", start_ns + at * 50_000_000 + late);
                format!("#timestamp [ns],filename\r\n{}", (0..4).map(row).collect::<String>())
            };
            each(&|at, [l, r]| {
                save(&l, root.join(format!("mav0/cam0/data/{at}.png")));
                save(&r, root.join(format!("mav0/cam1/data/{at}.png")));
            });
            write(root.join("mav0/cam0/data.csv"), &table(0));
            write(root.join("mav0/cam1/data.csv"), &table(1_000_000));
        }
    };
    for layout in [Layout::KittiRaw, Layout::Kitti360, Layout::Cityscapes, Layout::Euroc] {
        let root = TempDir::new().unwrap();
        dress(layout, root.path());
        assert_eq!(Layout::guess(root.path()).unwrap(), layout);
        let (found, sequences) = survey(root.path(), None).unwrap();
        assert_eq!((found, sequences.len()), (layout, 1), "{layout:?}");
        let dataset = open(root.path(), &OpenOptions::default()).unwrap_or_else(|error| panic!("{layout:?}: {error}"));
        assert_eq!(
            (dataset.len(), dataset.size(), dataset.rig().focal_px, dataset.rig().baseline_m),
            (4, (40, 32), 50.0, 0.5),
            "{layout:?}"
        );
        for at in 0..4 {
            let frame = dataset.frame(at).unwrap();
            let expected = pair(at as u32).map(|image| image.into_raw());
            assert_eq!([frame.left.pixels(), frame.right.pixels()], expected.each_ref().map(Vec::as_slice), "{layout:?} frame {at}");
            let ns = if layout == Layout::Cityscapes { at as u64 * 1_000_000_000 / 17 } else { start_ns + at as u64 * 50_000_000 };
            assert_eq!(dataset.stamp_ns(at), Some(ns), "{layout:?} frame {at}");
        }
    }
}

#[test]
fn recordings_as_the_lenses_drew_them_are_refused_unless_a_calibration_says_otherwise() {
    let root = TempDir::new().unwrap();
    (0..2).for_each(|at| {
        for (side, image) in ["cam0", "cam1"].iter().zip(pair(at)) {
            save(&image, root.path().join(format!("mav0/{side}/data/{at}.png")));
        }
    });
    assert!(refusal(root.path(), None).contains("are raw, and no calibration of their lenses"));
    let calibration = root.path().join("mine.txt");
    fs::write(&calibration, CALIB).unwrap();
    assert_eq!(open(root.path(), &OpenOptions { calibration: vec![calibration], ..OpenOptions::default() }).unwrap().len(), 2);
}
