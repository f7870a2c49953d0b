//! Cameras one above the other are rectified to images side by side, turned by a quarter.

use super::*;
use crate::formats::calibration::Swap;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::TurnedCamera;

/// A lens with every kind of distortion, off centre and with two focal lengths.
const LENS: LensModel = LensModel::General {
    xi: 0.1,
    radial: [-0.2, 0.03, 0.0, 0.0, 0.0, 0.0],
    tangential: [0.002, -0.003],
    prism: [0.001, -0.0005, 0.002, 0.0007],
    tilt: [0.01, -0.02],
};

/// A rig whose second camera stands at `y_m` below the first, turned a little about all axes.
fn rig(y_m: f64) -> StereoCalibration {
    let lens =
        |shift_px: f64| Lens::new([460.0, 455.0], [371.0 + shift_px, 229.0], LENS).expect("a lens");
    let camera = |shift_px| RawCamera { lens: lens(shift_px), width: 752, height: 480 };
    let r = nalgebra::Rotation3::from_euler_angles(0.02, -0.03, 0.05).into_inner();
    StereoCalibration {
        left: camera(0.0),
        right: camera(4.0),
        placement: Placement::Vertical {
            r_right_left: r,
            t_right_left_m: -(r * Vector3::new(0.004, y_m, -0.003)),
        },
        format: "a test",
    }
}

const AUTOMATIC: Sizing = Sizing::Automatic { max_width: 1_920, max_height: 1_088 };

#[test]
fn rows_agree_and_disparities_are_those_of_the_baseline() {
    for y_m in [0.11, -0.11] {
        let calibration = rig(y_m);
        let (rectification, rectified) = calibration.rectify(AUTOMATIC).unwrap();
        assert!((rectified.baseline_m - calibration.baseline_m()).abs() < 1e-12);
        assert!(rectification.height > rectification.width, "high images of wide ones");
        let Placement::Vertical { r_right_left, t_right_left_m } = calibration.placement else {
            unreachable!()
        };
        let pixel = |camera: &TurnedCamera, point: Vector3<f64>| {
            let turned = camera.r_rectified_raw * point;
            let StereoRig { focal_px, center_u_px, center_v_px, .. } = rectified;
            let image = [turned.x, turned.y].map(|side| focal_px * side / turned.z);
            let [u, v] = [image[0] + center_u_px, image[1] + center_v_px];
            // The raw pixel that is looked up is the one that the lens shows the point in.
            let looked_up = camera.raw_pixel(&rectified, [u, v]).unwrap();
            let shown = camera.raw.lens.project(point.into()).unwrap();
            assert!((0..2).all(|axis| (looked_up[axis] - shown[axis]).abs() < 1e-6));
            ([u, v], turned.z)
        };
        for point in [Vector3::new(0.3, -0.2, 2.0), Vector3::new(-0.9, 0.8, 5.0)] {
            let ([u, v], depth_m) = pixel(&rectification.left, point);
            let ([right_u, right_v], _) =
                pixel(&rectification.right, r_right_left * point + t_right_left_m);
            let disparity_px = rectified.focal_px * rectified.baseline_m / depth_m;
            assert!((v - right_v).abs() < 1e-9 && (u - right_u - disparity_px).abs() < 1e-9);
        }
    }
}

#[test]
fn no_rectified_pixel_lies_outside_the_raw_images() {
    for y_m in [0.11, -0.11] {
        let (rectification, rectified) = rig(y_m).rectify(AUTOMATIC).unwrap();
        for camera in [rectification.left, rectification.right] {
            for v in (0..rectification.height).step_by(7) {
                for u in [0, rectification.width / 2, rectification.width - 1] {
                    let [raw_u, raw_v] =
                        camera.raw_pixel(&rectified, [u.into(), v.into()]).unwrap();
                    // A sensor's tilt turns only nearly.
                    let within = |at: f64, side: u32| at > -1.5 && at < f64::from(side) + 0.5;
                    assert!(within(raw_u, 752) && within(raw_v, 480), "{raw_u}, {raw_v}");
                }
            }
        }
    }
}

/// The cameras that files give where a person says that one stands above the other.
fn cameras(files: &[(&str, &str)]) -> Result<Cameras, String> {
    let (_folder, paths) = written(files);
    let hints = CalibrationHints { vertical: true, ..Default::default() };
    let read = CalibrationFiles::read(&paths, hints).unwrap().cameras(Some([752, 480]));
    read.map(|read| read.cameras).map_err(|error| error.to_string())
}

#[test]
fn files_of_every_kind_with_a_motion_are_read() {
    let down = |text: &str| text.replace("[ -0.11, 0., 0. ]", "[ 0., -0.11, 0. ]");
    let short = opencv_short();
    let opencv = [("intrinsics.yml", &*short[0]), ("extrinsics.yml", &*down(&short[1]))];
    let ros = ros::FORMAT.example;
    let below =
        ros[1].1.replace("400, 0, 370, -44, 0, 400, 250, 0", "400, 0, 370, 0, 0, 400, 250, -44");
    for files in [&opencv[..], &[ros[0], ("right.yaml", &below)]] {
        let Cameras::Raw(calibration) = cameras(files).unwrap() else { panic!("not raw") };
        let (_, rig) = calibration.rectify(AUTOMATIC).unwrap();
        assert!((rig.baseline_m - 0.11).abs() < 1e-9, "{files:?}");
    }
    // Rigs that stand otherwise are refused by name.
    let side_by_side = [("intrinsics.yml", &*short[0]), ("extrinsics.yml", &*short[1])];
    let message = cameras(&side_by_side).unwrap_err();
    assert!(message.contains("do not stand one above the other"), "{message}");
    assert!(message.contains("Leave out --vertical"), "{message}");
}

#[test]
fn an_upper_camera_that_comes_second_may_be_exchanged() {
    let short = opencv_short();
    let up = short[1].replace("[ -0.11, 0., 0. ]", "[ 0., 0.11, 0. ]");
    let (_folder, paths) = written(&[("intrinsics.yml", &*short[0]), ("extrinsics.yml", &up)]);
    let size = Some([752, 480]);
    let read = |hints| CalibrationFiles::read(&paths, hints).unwrap().cameras(size);
    let message = read(CalibrationHints::default()).unwrap_err().to_string();
    assert!(message.contains("stands above the first"), "{message}");
    let vertical = CalibrationHints { vertical: true, ..Default::default() };
    for swap in [None, Some(Swap::Calibration)] {
        let Cameras::Raw(calibration) =
            read(CalibrationHints { swap, ..vertical }).unwrap().cameras
        else {
            panic!("not raw")
        };
        assert!(calibration.rectify(AUTOMATIC).is_ok());
    }
}

#[test]
fn rectified_images_of_ros_are_turned_without_a_loss() {
    let ros = ros::FORMAT.example;
    let below =
        ros[1].1.replace("400, 0, 370, -44, 0, 400, 250, 0", "400, 0, 370, 0, 0, 400, 250, -44");
    let hints = CalibrationHints { vertical: true, ..Default::default() };
    let texts = [ros[0].1.to_owned(), below];
    let files = CalibrationFiles::from_camera_infos(Path::new("a.mcap"), &texts, true, hints);
    let Cameras::Raw(calibration) = files.cameras(None).unwrap().cameras else { panic!("not raw") };
    let (rectification, rig) = calibration.rectify(AUTOMATIC).unwrap();
    assert_eq!((rectification.width, rectification.height), (480, 752));
    assert!((rig.baseline_m - 0.11).abs() < 1e-12);
    // The upper right corner becomes the upper left one.
    let [u, v] = rectification.left.raw_pixel(&rig, [0.0, 0.0]).unwrap();
    assert!((u - 751.0).abs() < 1e-6 && v.abs() < 1e-6, "{u}, {v}");
}
