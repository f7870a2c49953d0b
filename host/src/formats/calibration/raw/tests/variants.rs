//! Files of the formats as other tools and authors write them, and what a person adds.

use super::*;
use crate::formats::calibration::LensFamily;

/// A pair under any names, as YAML.
fn pair(matrices: [&str; 2], distortions: [&str; 2], coefficients: &str) -> String {
    let matrix = "[[458.6, 0, 367.2], [0, 457.2, 248.3], [0, 0, 1]]";
    let [m1, m2] = matrices.map(|name| format!("{name}: {matrix}\n"));
    let [d1, d2] = distortions.map(|name| format!("{name}: {coefficients}\n"));
    format!("{m1}{d1}{m2}{d2}R: [0, 0, 0]\nT: [[-0.11], [0], [0]]\n")
}

const BENT: &str = "[[-0.28, 0.07, 0.0002, 0.00002, 0]]";

fn with(text: &str, hints: CalibrationHints) -> Result<CalibrationRead, FormatError> {
    let (_folder, paths) = written(&[("stereo.yml", text)]);
    CalibrationFiles::read(&paths, hints)?.cameras(Some([752, 480]))
}

fn plain(text: &str) -> Result<CalibrationRead, FormatError> {
    with(text, CalibrationHints::default())
}

#[test]
fn opencvs_matrices_are_known_by_many_names() {
    for (matrices, distortions) in [
        (["K1", "K2"], ["D1", "D2"]),
        (["KL", "KR"], ["DL", "DR"]),
        (["mtx_left", "mtx_right"], ["dist_left", "dist_right"]),
        (["cameraMatrixL", "cameraMatrixR"], ["distCoeffsL", "distCoeffsR"]),
        (["left_camera_matrix", "right_camera_matrix"], ["left_dist_coeffs", "right_dist_coeffs"]),
        (["K0", "K1"], ["D0", "D1"]),
        (["Left_Camera_Matrix", "Right_Camera_Matrix"], ["Left_Distortion", "Right_Distortion"]),
    ] {
        let read = plain(&pair(matrices, distortions, BENT)).unwrap();
        assert!((check::baseline_m(&read.cameras) - 0.11).abs() < 1e-12, "{matrices:?}");
        assert!(
            read.sentence().starts_with("raw, radial-tangential, 752 x 480, baseline 0.1100 m")
        );
        assert!(read.guesses.is_empty());
    }
}

#[test]
fn a_rotation_vector_is_a_rotation() {
    let text = pair(["M1", "M2"], ["D1", "D2"], BENT).replace("[0, 0, 0]", "[0, 0.02, 0]");
    let Cameras::Raw(calibration) = plain(&text).unwrap().cameras else { panic!("raw") };
    assert!((calibration.angle_deg() - 0.02f64.to_degrees()).abs() < 1e-9);
}

#[test]
fn sections_of_one_file_hold_a_camera_each() {
    let camera = r#"{"K": [[458.6,0,367.2],[0,457.2,248.3],[0,0,1]], "dist": [-0.28,0.07,0,0,0]}"#;
    let text = format!(
        r#"{{"left": {camera}, "right": {camera},
        "R": [[1,0,0],[0,1,0],[0,0,1]], "T": [-0.11,0,0]}}"#
    );
    assert!((check::baseline_m(&plain(&text).unwrap().cameras) - 0.11).abs() < 1e-12);
}

#[test]
fn the_whole_distortion_of_opencv_is_read() {
    let fourteen =
        "[0.9, 0.2, 0.0001, 0.0001, 0.01, 1.2, 0.4, 0.05, 0.001, 0, 0.002, 0, 0.01, 0.02]";
    let Cameras::Raw(calibration) =
        plain(&pair(["M1", "M2"], ["D1", "D2"], fourteen)).unwrap().cameras
    else {
        panic!("raw")
    };
    let expected = LensModel::General {
        xi: 0.0,
        radial: [0.9, 0.2, 0.01, 1.2, 0.4, 0.05],
        tangential: [0.0001; 2],
        prism: [0.001, 0.0, 0.002, 0.0],
        tilt: [0.01, 0.02],
    };
    assert_eq!(*calibration.left.lens.model(), expected);
    let sphere = pair(["K1", "K2"], ["D1", "D2"], "[-0.3, 0.1, 0.0002, 0.0001]");
    let sphere = format!("{}xi1: 0.9\nxi2: 0.91\n", sphere.replace("458.6", "858.6"));
    let Cameras::Raw(calibration) = plain(&sphere).unwrap().cameras else { panic!("raw") };
    assert!(matches!(calibration.right.lens.model(), LensModel::General { xi: 0.91, .. }));
    for count in [1, 2, 3, 6, 9, 13, 15] {
        let list = format!("{:?}", vec![0.01; count]);
        let message = plain(&pair(["M1", "M2"], ["D1", "D2"], &list)).unwrap_err().to_string();
        assert!(message.contains("Give 4, 5, 8, 12 or 14"), "{count}: {message}");
    }
}

#[test]
fn four_coefficients_without_a_name_are_a_guess_that_is_said() {
    let fisheye = pair(["K1", "K2"], ["D1", "D2"], "[-0.01, 0.05, -0.05, 0.01]");
    let read = plain(&fisheye).unwrap();
    assert_eq!(read.guessed_lens, Some(LensFamily::Fisheye));
    assert!(read.guesses[0].contains("guess: fisheye") && read.guesses[0].contains("--lens-model"));
    let insisted = |family| {
        let hints = CalibrationHints { lens_model: Some(family), ..Default::default() };
        let read = with(&fisheye.replace("-0.05", "0.0005").replace("0.01]", "0.0001]"), hints);
        let read = read.unwrap();
        assert!(read.guesses.is_empty());
        match read.cameras {
            Cameras::Raw(calibration) => calibration.left.lens.model().name(),
            Cameras::Rectified(_) => "rectified",
        }
    };
    assert_eq!(insisted(LensFamily::Fisheye), "equidistant");
    assert_eq!(insisted(LensFamily::Pinhole), "radial_tangential");
    let named = format!("{fisheye}fisheye_model: 1\n");
    assert_eq!(plain(&named).unwrap().guessed_lens, None, "the file names it");
    let hints = CalibrationHints { lens_model: Some(LensFamily::Fisheye), ..Default::default() };
    let message = with(&pair(["K1", "K2"], ["D1", "D2"], BENT), hints).unwrap_err().to_string();
    assert!(message.contains("4 coefficients, not 5"), "{message}");
}

#[test]
fn the_images_tell_between_lenses_that_files_do_not() {
    let text = pair(["K1", "K2"], ["D1", "D2"], "[-0.01, 0.005, 0.0005, 0.0001]");
    let (_folder, paths) = written(&[("stereo.yml", &text)]);
    let settled = |fisheye_px: f64, pinhole_px: f64| {
        let rows = move |calibration: &StereoCalibration| {
            let fisheye = calibration.left.lens.model().name() == "equidistant";
            Some(if fisheye { fisheye_px } else { pinhole_px })
        };
        let cameras = CameraGeometry::read(&paths, CalibrationHints::default()).unwrap();
        cameras.settled((752, 480), Some(&rows)).unwrap().notes.join(". ")
    };
    let fisheye = settled(0.2, 3.0);
    assert!(fisheye.contains("guess: fisheye lenses (rows agree to 0.20 px"), "{fisheye}");
    assert!(fisheye.contains("raw, equidistant"), "{fisheye}");
    let pinhole = settled(3.0, 0.2);
    assert!(pinhole.contains("guess: pinhole lenses (rows agree to 0.20 px"), "{pinhole}");
}

#[test]
fn slam_systems_name_the_motion_in_many_ways() {
    let body = |key: &str, x: f64| {
        format!(
            "  {key}: [[1.0, 0.0, 0.0, {x}], [0.0, 1.0, 0.0, 0.02], [0.0, 0.0, 1.0, 0.01], \
             [0.0, 0.0, 0.0, 1.0]]\n"
        )
    };
    let (start, end) =
        (KALIBR.find("  T_cn_cnm1").unwrap(), KALIBR.rfind("  camera_model").unwrap());
    for (key, left_m, right_m) in [("T_imu_cam", -0.02, 0.09), ("T_cam_imu", 0.02, -0.09)] {
        let right = format!("{}{}{}", &KALIBR[..start], body(key, right_m), &KALIBR[end..]);
        let both = right.replace("cam0:\n", &format!("cam0:\n{}", body(key, left_m)));
        assert!((check::baseline_m(&plain(&both).unwrap().cameras) - 0.11).abs() < 1e-12, "{key}");
        let message = plain(&right).unwrap_err().to_string();
        assert!(message.contains("T_cn_cnm1 is missing in cam1"), "{message}");
    }
}

#[test]
fn orb_slam_has_rectified_fisheye_and_old_settings() {
    let rectified = "%YAML:1.0\nCamera.fx: 435.2\nCamera.fy: 435.2\nCamera.cx: 367.4\nCamera.cy: \
                     252.2\nCamera.k1: 0.0\nCamera.bf: 47.872\nViewer.PointSize:2\n";
    let read = plain(rectified).unwrap();
    assert!(matches!(read.cameras, Cameras::Rectified(_)));
    assert!((check::baseline_m(&read.cameras) - 0.11).abs() < 1e-12);
    let bent = plain(&rectified.replace("k1: 0.0", "k1: -0.28")).unwrap_err().to_string();
    assert!(bent.contains("Camera.k1 is not 0") && bent.contains("line 6"), "{bent}");
    let one = plain(&rectified.replace("Camera.bf: 47.872\n", "")).unwrap_err().to_string();
    assert!(one.contains("it is of one camera"), "{one}");
    let fisheye = orbslam::FORMAT.example[0].1.replace("PinHole", "KannalaBrandt8");
    let fisheye = fisheye.replace(".p1", ".k3").replace(".p2", ".k4");
    let Cameras::Raw(calibration) = plain(&fisheye).unwrap().cameras else { panic!("raw") };
    assert_eq!(calibration.left.lens.model().name(), "equidistant");
}

#[test]
fn differing_principal_points_become_an_offset_of_disparities() {
    let offset_px = |name: &str, text: &str| {
        let (_folder, paths) = written(&[(name, text)]);
        let read = CalibrationFiles::read(&paths, CalibrationHints::default()).unwrap();
        let Cameras::Rectified(cameras) = read.cameras(None).unwrap().cameras else {
            panic!("rectified")
        };
        let settled = CameraGeometry::read(&paths, CalibrationHints::default()).unwrap();
        let settled = settled.settled((741, 497), None).unwrap();
        let fitted = settled.cameras.fitted((741, 497), &RectifiedSize::default()).unwrap();
        let rectification = fitted.rectification.expect("the right images are moved");
        let moved = rectification.right.raw_pixel(&fitted.rig, [300.0, 200.0]).unwrap();
        assert!((moved[0] - 300.0 - cameras.offset_px).abs() < 1e-9 && moved[1] == 200.0);
        cameras.offset_px
    };
    let middlebury = middlebury::FORMAT.example[0].1;
    assert_eq!(offset_px("calib.txt", middlebury), 32.778);
    let kitti = "P0: 700 0 350 0 0 700 250 0 0 0 1 0\nP1: 700 0 360 -77 0 700 250 0 0 0 1 0\n";
    assert_eq!(offset_px("calib.txt", kitti), 10.0);
    let wrong = middlebury.replace("doffs=32.778", "doffs=0");
    let message = plain(&wrong).unwrap_err().to_string();
    assert!(message.contains("doffs is 0, but") && message.contains("(line 3)"), "{message}");
}

#[test]
fn images_of_another_scale_are_refused() {
    let kitti = "focal_px 718.9\ncenter_u_px 607.2\ncenter_v_px 185.2\nbaseline_m 0.54\n";
    let (_folder, paths) = written(&[("calib.txt", kitti)]);
    let read = || CameraGeometry::read(&paths, CalibrationHints::default()).unwrap();
    assert!(read().settled((1242, 375), None).is_ok());
    let message = read().settled((640, 192), None).unwrap_err().to_string();
    assert!(message.contains("about 1214 x 370 px") && message.contains("multiply"), "{message}");
    let message = read().settled((2484, 750), None).unwrap_err().to_string();
    assert!(message.contains("but these are 2484 x 750 px"), "{message}");
}

#[test]
fn kitti_has_two_pairs_and_images_of_either_size() {
    let grey = KITTI.to_owned();
    let colour = grey.replace("_00", "_02").replace("_01", "_03").replace("458.6", "459.6");
    let text = format!("{grey}{colour}");
    let (_folder, paths) = written(&[("calib_cam_to_cam.txt", &text)]);
    let read = |colour: bool, size: [u32; 2]| {
        let hints = CalibrationHints { colour, ..Default::default() };
        CalibrationFiles::read(&paths, hints).unwrap().cameras(Some(size)).unwrap().cameras
    };
    let focal_px = |cameras: Cameras| match cameras {
        Cameras::Raw(calibration) => calibration.left.lens.focal_px()[0],
        Cameras::Rectified(cameras) => cameras.rig.focal_px,
    };
    assert_eq!(focal_px(read(false, [752, 480])), 458.6);
    assert_eq!(focal_px(read(true, [752, 480])), 459.6, "the colour pair has its own lenses");
    assert_eq!(focal_px(read(true, [700, 400])), 400.0, "images of the rectified size");
    let old = KITTI.replace("S_rect_00", "S_00_rect").replace("P_rect_01", "P_01_rect");
    let (_folder, paths) = written(&[("calib.txt", &old)]);
    let read = CalibrationFiles::read(&paths, CalibrationHints::default()).unwrap();
    assert!((check::baseline_m(&read.cameras(None).unwrap().cameras) - 0.11).abs() < 1e-12);
}

#[test]
fn cameras_one_above_the_other_are_told_apart_from_others() {
    let ros = ros::FORMAT.example;
    let below =
        ros[1].1.replace("400, 0, 370, -44, 0, 400, 250, 0", "400, 0, 370, 0, 0, 400, 250, -44");
    let message = refusal(&[ros[0], ("right.yaml", &below)]);
    assert!(message.contains("the second camera stands below the first"), "{message}");
    let down =
        pair(["M1", "M2"], ["D1", "D2"], BENT).replace("[[-0.11], [0], [0]]", "[0, -0.11, 0]");
    let message = plain(&down).unwrap_err().to_string();
    let named = "the second camera stands below the first";
    assert!(message.contains(named) && message.contains("--vertical"), "{message}");
}

#[test]
fn binary_files_and_robotcars_are_told_what_to_write() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("calibration.npz");
    fs::write(&path, b"PK\x03\x04\xff\xfe").unwrap();
    let read = CalibrationFiles::read(&[path], CalibrationHints::default());
    assert!(read.unwrap_err().to_string().contains("cv2.FileStorage"));
    let robotcar = "983.0 983.0 643.6 493.4\n0 0 1 0\n1 0 0 0\n0 1 0 0\n0 0 0 1\n";
    let message = refusal(&[("stereo_narrow_left.txt", robotcar)]);
    assert!(message.contains("baseline_m 0.12") && message.contains("focal_px 983"), "{message}");
}

#[test]
fn the_camera_data_of_an_oak_is_in_centimetres() {
    let camera = |socket: u32, to: u32, x: f64| {
        format!(
            r#"[{socket}, {{"cameraType": 0, "width": 752, "height": 480,
            "intrinsicMatrix": [[458.6,0,367.2],[0,457.2,248.3],[0,0,1]],
            "distortionCoeff": [-0.28,0.07,0.0002,0.00002,0,0,0,0,0,0,0,0,0,0],
            "extrinsics": {{"toCameraSocket": {to}, "rotationMatrix": [[1,0,0],[0,1,0],[0,0,1]],
            "translation": {{"x": {x}, "y": 0, "z": 0}}}}}}]"#
        )
    };
    let text = format!(r#"{{"cameraData": [{}, {}]}}"#, camera(1, 2, -11.0), camera(2, 0, 5.5));
    assert!((check::baseline_m(&plain(&text).unwrap().cameras) - 0.11).abs() < 1e-12);
}

#[test]
fn a_bags_camera_info_is_checked_as_files_are() {
    let info = |cx: f64, along: f64| {
        ros::FORMAT.example[0]
            .1
            .replace("[400, 0, 370, 0,", &format!("[400, 0, {cx}, {along},"))
            .replace("[-0.28, 0.07, 0.0002, 0.00002, 0]", "[0, 0, 0, 0, 0]")
    };
    let settled = |right: String, size: (usize, usize)| {
        let texts = [info(370.0, 0.0), right];
        let hints = CalibrationHints::default();
        let path = Path::new("drive.mcap");
        let files = CalibrationFiles::from_camera_infos(path, &texts, true, hints);
        files.cameras(None)?;
        CameraGeometry::Files(Box::new(files)).settled(size, None)
    };
    let plain = settled(info(370.0, -44.0), (752, 480)).unwrap();
    assert!(plain.notes[0].starts_with("rectified, 752 x 480"), "{:?}", plain.notes);
    let binned = settled(info(370.0, -44.0), (376, 240)).unwrap_err().to_string();
    assert!(binned.contains("images of 752 x 480 px, but these are 376 x 240 px"), "{binned}");
    let apart = settled(info(378.0, -44.0), (752, 480)).unwrap_err().to_string();
    assert!(apart.contains("8.000 px apart") && apart.contains("`P1: 400 0 378 -44 "), "{apart}");
    let negative = settled(info(370.0, 44.0), (752, 480)).unwrap_err().to_string();
    assert!(negative.contains("to the left of the left one"), "{negative}");
    let focal =
        info(370.0, -44.0).replace("[400, 0, 370, -44, 0, 400,", "[420, 0, 370, -44, 0, 420,");
    let focal = settled(focal, (752, 480)).unwrap_err().to_string();
    assert!(focal.contains("differ in focal length"), "{focal}");
}
