//! Calibrations of other people's cameras: the right baseline, or a refusal that says what to do.

use super::*;
use crate::formats::calibration::{LengthUnit, Swap};

/// Outcome that is right for a file as its author left it.
enum Right {
    /// Baseline, m, within half a per cent; and the number of notes about guesses.
    Baseline(f64),
    /// A refusal with these words.
    Refused(&'static [&'static str]),
}
use Right::{Baseline, Refused};

/// Files in a folder of the collection, size of the images, and what is right.
type Row = (&'static [&'static str], [u32; 2], Right);

const VGA: [u32; 2] = [640, 480];
const EUROC: [u32; 2] = [752, 480];

/// An iPhone held upright.
const IPHONE: [&str; 3] = [
    concat!("iphone11_por", "trait_calib/stereo.yml"),
    concat!("iphone11_por", "trait_calib/left.yml"),
    concat!("iphone11_por", "trait_calib/right.yml"),
];

#[rustfmt::skip]
const FOUND: &[Row] = &[
    (&["openvins_euroc_mav/kalibr_imucam_chain.yaml"], EUROC, Baseline(0.1101)),
    (&["openvins_kaist/kalibr_imucam_chain.yaml"], [1280, 560], Baseline(0.4752)),
    (&["openvins_kaist_vio/kalibr_imucam_chain.yaml"], VGA, Baseline(0.0500)),
    (&["openvins_rs_t265/kalibr_imucam_chain.yaml"], [848, 800], Baseline(0.0627)),
    (&["openvins_uzhfpv_indoor/kalibr_imucam_chain.yaml"], VGA, Baseline(0.0796)),
    (&["openvins_rs_d455/kalibr_imucam_chain.yaml"], [848, 480], Refused(&["one camera", "cam1"])),
    (&["vinsfusion_euroc/euroc_stereo_imu_config.yaml"], EUROC, Baseline(0.1101)),
    (&["vinsfusion_euroc/cam0_pinhole.yaml", "vinsfusion_euroc/cam1_pinhole.yaml",
       "vinsfusion_euroc/euroc_stereo_imu_config.yaml"], EUROC, Baseline(0.1101)),
    (&["orbslam2/EuRoC.yaml"], EUROC, Baseline(0.1101)),
    (&["ugv_orbslam/far_stereo.yaml"], [1280, 524], Baseline(0.6009)),
    (&["kimera_Euroc/LeftCameraParams.yaml", "kimera_Euroc/RightCameraParams.yaml"], EUROC,
     Baseline(0.1101)),
    (&["kimera_D455/LeftCameraParams.yaml", "kimera_D455/RightCameraParams.yaml"], VGA,
     Baseline(0.0949)),
    (&["kimera_RealSenseIR/LeftCameraParams.yaml", "kimera_RealSenseIR/RightCameraParams.yaml"],
     VGA, Baseline(0.0499)),
    (&["kaist_urban/left.yaml", "kaist_urban/right.yaml"], [1280, 600], Baseline(0.482)),
    (&["kaist_urban/cam_left.yml", "kaist_urban/cam_right.yml", "kaist_urban/extrinsic.yml"],
     [1280, 600], Baseline(0.482)),
    (&["kaist_urban/extrinsic.yml", "kaist_urban/cam_right.yml", "kaist_urban/cam_left.yml"],
     [1280, 600], Baseline(0.482)),
    (&["kaist_urban/result.yml"], [1280, 600], Refused(&["not the lenses", "calib.txt"])),
    (&["ugv_ros/left.yaml", "ugv_ros/right.yaml"], [1280, 1024], Baseline(0.2979)),
    (&["ugv_ros/right.yaml", "ugv_ros/left.yaml"], [1280, 1024], Baseline(0.2979)),
    (&["ugv_ros/ost.txt"], [1280, 1024], Baseline(0.2979)),
    (&["rtabmap/rtabmap_left.yaml", "rtabmap/rtabmap_right.yaml"], VGA, Baseline(0.1197)),
    (&["oakd_lite/calib.json"], [1280, 720], Baseline(0.0752)),
    (&["zed/zed_factory.conf"], [1280, 720], Baseline(0.1201)),
    (&["zed/zed_factory.conf"], [2208, 1242], Baseline(0.1201)),
    (&["zed/zed_factory.conf"], [960, 540], Refused(&["no section for images of 960 x 540"])),
    (&["middlebury/calib.txt"], [741, 497], Baseline(0.193)),
    (&["foundationstereo/K.txt"], [960, 540], Baseline(0.063)),
    (&["basalt/euroc_ds_calib.json"], EUROC, Baseline(0.1101)),
    (&["basalt/t265_kb4_calib.json"], [848, 800], Baseline(0.0632)),
    (&["kitti_raw/calib_cam_to_cam.txt"], [1392, 512], Baseline(0.5371)),
    (&["kitti_raw/calib_cam_to_cam.txt"], [1242, 375], Baseline(0.5371)),
    (&[IPHONE[0]], VGA, Refused(&["stands below the first", "Give --vertical"])),
    (&[IPHONE[1], IPHONE[2]], VGA,
     Refused(&["R or rotation is missing"])),
    (&["opencv_sample/intrinsics.yml", "opencv_sample/extrinsics.yml"], VGA,
     Refused(&["3.34", "squares of the calibration board?", "--calibration-unit cm"])),
    (&["opencv_sample/extrinsics.yml", "opencv_sample/intrinsics.yml"], VGA,
     Refused(&["3.34", "squares of the calibration board?"])),
    (&["ugv_mm/intrinsics.yml", "ugv_mm/extrinsics.yml"], [1280, 1024],
     Refused(&["millimetres?", "--calibration-unit mm"])),
    (&["shuangmu/intrinsics_realsense.yml", "shuangmu/extrinsics_realsense.yml"], VGA,
     Refused(&["millimetres?", "--calibration-unit mm"])),
    (&["shuangmu/intrinsics_hik.yml", "shuangmu/extrinsics_hik.yml"], [3072, 2048],
     Refused(&["millimetres?"])),
    (&["needle/left.yaml", "needle/right.yaml"], VGA, Refused(&["the second camera stands"])),
    (&["needle/config.xml"], VGA, Refused(&["opencv_storage"])),
    (&["stereopi_ros/left.yaml", "stereopi_ros/right.yaml"], [320, 240],
     Refused(&["does not fit images of 320 x 240 px"])),
];

fn collection() -> Option<PathBuf> {
    let beside =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/other-cameras/calibrations");
    Some(PathBuf::from(beside)).filter(|folder| folder.is_dir())
}

fn read_with(
    paths: &[PathBuf],
    size: [u32; 2],
    hints: CalibrationHints,
) -> Result<CalibrationRead, FormatError> {
    CalibrationFiles::read(paths, hints)?.cameras(Some(size))
}

#[test]
fn the_calibrations_of_other_people_are_right_or_refused() {
    let Some(folder) = collection() else {
        eprintln!("skipped: ../shared/data/other-cameras/calibrations is not there");
        return;
    };
    let mut wrong = Vec::new();
    for (files, size, right) in FOUND {
        let paths: Vec<PathBuf> = files.iter().map(|file| folder.join(file)).collect();
        let found = read_with(&paths, *size, CalibrationHints::default());
        match (right, found) {
            (Baseline(baseline_m), Ok(read)) => {
                let found_m = check::baseline_m(&read.cameras);
                if (found_m / baseline_m - 1.0).abs() > 5e-3 {
                    wrong.push(format!("{files:?}: {found_m} m, not {baseline_m} m"));
                }
            }
            (Refused(words), Err(error)) => {
                let message = error.to_string();
                let lacks = |word: &&&str| !message.contains(**word);
                if let Some(word) = words.iter().find(lacks) {
                    wrong.push(format!("{files:?}: no {word:?} in {message}"));
                }
            }
            (Baseline(_), Err(error)) => wrong.push(format!("{files:?}: {error}")),
            (Refused(_), Ok(read)) => wrong.push(format!("{files:?}: {}", read.sentence())),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(unlisted(&folder), Vec::<String>::new(), "every file is in the table");
}

/// Files of the collection that no row reads.
fn unlisted(folder: &Path) -> Vec<String> {
    let mut missing = Vec::new();
    for author in fs::read_dir(folder).unwrap().flatten() {
        for file in fs::read_dir(author.path()).unwrap().flatten() {
            let name = format!(
                "{}/{}",
                author.file_name().to_string_lossy(),
                file.file_name().to_string_lossy()
            );
            let named = ["cam0_mei.yaml", "cam1_mei.yaml"];
            let listed = FOUND.iter().any(|(files, ..)| files.contains(&&*name))
                || named.iter().any(|by_config| name.ends_with(by_config));
            if !listed {
                missing.push(name);
            }
        }
    }
    missing.sort();
    missing
}

#[test]
fn a_person_answers_for_the_unit_of_other_peoples_calibrations() {
    let Some(folder) = collection() else {
        eprintln!("skipped: ../shared/data/other-cameras/calibrations is not there");
        return;
    };
    let baseline_m = |files: [&str; 2], size, unit: &str| {
        let hints = CalibrationHints { unit: Some(unit.parse().unwrap()), ..Default::default() };
        let read = read_with(&files.map(|file| folder.join(file)), size, hints).unwrap();
        check::baseline_m(&read.cameras)
    };
    let sample = ["opencv_sample/intrinsics.yml", "opencv_sample/extrinsics.yml"];
    assert!((baseline_m(sample, VGA, "0.025") - 0.08358).abs() < 1e-4);
    let ugv = ["ugv_mm/intrinsics.yml", "ugv_mm/extrinsics.yml"];
    assert!((baseline_m(ugv, [1280, 1024], "mm") - 0.30117).abs() < 1e-4);
}

#[test]
fn exchanged_cameras_are_exchanged_back_where_a_person_says_so() {
    let hints = CalibrationHints { swap: Some(Swap::Calibration), ..Default::default() };
    for row in CALIBRATION_FORMATS.iter().filter(|row| !row.example.is_empty()) {
        let (_folder, paths) = written(row.example);
        let size = if row.name == "ZED" { [1280, 720] } else { EUROC };
        let plain = read_with(&paths, size, CalibrationHints::default()).unwrap();
        assert!((check::baseline_m(&plain.cameras) - 0.11).abs() < 1e-9, "{}", row.name);
        let message = read_with(&paths, size, hints).unwrap_err().to_string();
        let named = message.contains("to the left of the left one");
        assert!(named && message.contains("--swap"), "{}: {message}", row.name);
        let metre = CalibrationHints { unit: Some(LengthUnit(2.0 * row.unit.0)), ..hints };
        let again = read_with(&paths, size, CalibrationHints { swap: None, ..metre }).unwrap();
        assert!((check::baseline_m(&again.cameras) - 0.22).abs() < 1e-9, "{}", row.name);
    }
}
