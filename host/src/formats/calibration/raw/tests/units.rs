//! Mountings of inertial units: every tool's files give the same one.

use super::*;
use crate::formats::calibration::{UnitCalibration, UnitCamera};

/// Unit to camera: the camera's z is the unit's x, its x the unit's -y; 5 cm to the side.
const T_CAM_IMU: &str = "[[0, -1, 0, 0.05], [0, 0, -1, 0.02], [1, 0, 0, -0.03], [0, 0, 0, 1]]";
/// Camera to unit, row by row.
const T_IMU_CAM: &str = "0, 0, 1, 0.03, -1, 0, 0, 0.05, 0, -1, 0, 0.02, 0, 0, 0, 1";

fn read(files: &[(&str, String)]) -> Result<UnitCalibration, String> {
    let folder = TempDir::new().unwrap();
    let path = |(name, text): &(&str, String)| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let paths: Vec<PathBuf> = files.iter().map(path).collect();
    UnitCalibration::read(&paths).map_err(|error| error.to_string())
}

fn assert_is_mounting(found: &UnitCalibration, what: &str) {
    let at = found.t_camera_unit.translation_m;
    let error = at.iter().zip([0.05, 0.02, -0.03]).map(|(a, b): (&f64, f64)| (a - b).abs());
    assert!(error.fold(0.0, f64::max) < 1e-9, "{what}: {at:?}");
    let x = found.t_camera_unit.rotate([1.0, 0.0, 0.0]);
    assert!(x[0].abs() < 1e-9 && x[1].abs() < 1e-9 && (x[2] - 1.0).abs() < 1e-9, "{what}: {x:?}");
}

#[test]
fn every_tool_s_files_give_the_same_mounting() {
    let noise = "gyroscope_noise_density: 0.0002\naccelerometer_random_walk: 0.003\n";
    for (name, text, camera) in [
        ("camchain.yaml", format!("cam0:\n  T_cam_imu: {T_CAM_IMU}\n"), UnitCamera::Raw),
        ("openvins.yaml", format!("cam0:\n  T_imu_cam: [{T_IMU_CAM}]\n"), UnitCamera::Raw),
        (
            "vins.yaml",
            format!("%YAML:1.0\nbody_T_cam0: !!opencv-matrix\n   data: [{T_IMU_CAM}]\n"),
            UnitCamera::Raw,
        ),
        (
            "orbslam.yaml",
            format!("%YAML:1.0\nIMU.T_b_c1: !!opencv-matrix\n   data: [{T_IMU_CAM}]\n"),
            UnitCamera::Raw,
        ),
        (
            "calib.json",
            "{\"value0\": {\"T_imu_cam\": [{\"px\": 0.03, \"py\": 0.05, \"pz\": 0.02, \"qx\": \
             -0.5, \"qy\": 0.5, \"qz\": -0.5, \"qw\": 0.5}]}}"
                .to_owned(),
            UnitCamera::Raw,
        ),
        (
            "matrix.txt",
            "# unit to camera\n0 -1 0 0.05\n0 0 -1 0.02\n1 0 0 -0.03\n".to_owned(),
            UnitCamera::Rectified,
        ),
    ] {
        let found = read(&[(name, text.clone())]).unwrap();
        assert_is_mounting(&found, name);
        assert_eq!(found.camera, camera, "{name}");
        // Of Windows' making.
        assert_is_mounting(&read(&[(name, text.replace('\n', "\r\n"))]).unwrap(), name);
        if camera == UnitCamera::Raw && name.ends_with("yaml") {
            let noisy = read(&[(name, text), ("imu.yaml", noise.to_owned())]).unwrap();
            assert_eq!(noisy.noise.turn_density, Some(2e-4), "{name}");
            assert_eq!(noisy.noise.force_walk, Some(3e-3), "{name}");
            assert_eq!(noisy.noise.force_density, None, "{name}");
        }
    }
    let sensor = |kind: &str, pose: &str| format!("sensor_type: {kind}\nT_BS:\n  data: [{pose}]\n");
    let body = "1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1";
    let (imu, camera) = (sensor("imu", body), sensor("camera", T_IMU_CAM));
    let found = read(&[("imu.yaml", imu.clone()), ("cam.yaml", camera)]).unwrap();
    assert_is_mounting(&found, "EuRoC");
    assert!(read(&[("imu.yaml", imu)]).unwrap_err().contains("does not say how"));
}

#[test]
fn a_time_shift_moves_samples_to_the_clock_of_the_cameras() {
    // Kalibr: time of the unit = time of the camera + shift.
    let text = format!("cam0:\n  T_cam_imu: {T_CAM_IMU}\n  timeshift_cam_imu: 0.012\n");
    assert_eq!(read(&[("a.yaml", text)]).unwrap().clock_offset_s, -0.012);
    let text = format!("body_T_cam0: [{T_IMU_CAM}]\ntd: -0.003\n");
    assert_eq!(read(&[("a.yaml", text)]).unwrap().clock_offset_s, 0.003);
}

#[test]
fn kitti_raw_s_three_files_lead_to_the_rectified_camera() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(
        "calib_imu_to_velo.txt",
        "calib_time: 25-May-2012 16:47:16\nR: 1 0 0 0 1 0 0 0 1\nT: -0.5 0.1 0.2\n",
    );
    write(
        "calib_velo_to_cam.txt",
        "calib_time: 1\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 0 -0.3\ndelta_f: 0 0\n",
    );
    // Turned by a quarter about z, which no camera is.
    write("calib_cam_to_cam.txt", "R_rect_00: 0 -1 0 1 0 0 0 0 1\n");
    let unit = folder.path().join("calib_imu_to_velo.txt");
    for path in [unit.clone(), folder.path().to_path_buf()] {
        let found = UnitCalibration::read(&[path]).unwrap();
        assert_eq!(found.camera, UnitCamera::Rectified);
        let at = found.t_camera_unit.translation_m;
        for (found, expected) in at.iter().zip([0.2, -0.1, -0.8]) {
            assert!((found - expected).abs() < 1e-9, "{at:?}");
        }
    }
    write("calib_velo_to_cam.txt", "R: 0 -1 0 0 0 -1 1 0\nT: 0 0 -0.3\n");
    let error = UnitCalibration::read(std::slice::from_ref(&unit)).unwrap_err().to_string();
    assert!(
        error.contains("calib_velo_to_cam.txt") && error.contains("R has 8 numbers"),
        "{error}"
    );
    fs::remove_file(folder.path().join("calib_cam_to_cam.txt")).unwrap();
    write("calib_velo_to_cam.txt", "R: 0 -1 0 0 0 -1 1 0 0\nT: 0 0 -0.3\n");
    let error = UnitCalibration::read(&[unit]).unwrap_err().to_string();
    assert!(error.contains("calib_cam_to_cam.txt cannot be read"), "{error}");
}

#[test]
fn what_is_no_mounting_is_named() {
    for (text, expected) in [
        (T_CAM_IMU.replace("-1, 0, 0.05", "-1, 0, 50"), "50.0 m from the camera"),
        (T_CAM_IMU.replace("[1, 0, 0", "[-1, 0, 0"), "no rotation and translation"),
        (T_CAM_IMU.replace("-1, 0, 0.05", "-1, 0.2, 0.05"), "no rotation and translation"),
        (T_CAM_IMU.replace("0.05", ".nan"), "non-finite"),
        (T_CAM_IMU.replace(", [0, 0, 0, 1]", ", [0, 0, 1]"), "which are no rigid motion"),
    ] {
        let error = read(&[("a.yaml", format!("cam0:\n  T_cam_imu: {text}\n"))]).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    assert!(read(&[("a.yaml", KALIBR.to_owned())]).unwrap_err().contains("does not say how"));
}
