//! Lens models and shapes of files that each tool has beside its usual ones.

use super::*;
use crate::formats::calibration::{LengthUnit, LensFamily, Swap};

/// A text with parts replaced; it must have each of them.
fn with(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}: {text}");
        text.replace(from, to)
    })
}

/// Reads files for images of a size.
fn sized(files: &[(&str, &str)], size: [u32; 2]) -> Result<CalibrationRead, FormatError> {
    let (_folder, paths) = written(files);
    CalibrationFiles::read(&paths, CalibrationHints::default())?.cameras(Some(size))
}

/// Four coefficients, each another one, so that an exchange is noticed.
const VALUES: [f64; 4] = [-0.01, 0.02, -0.03, 0.04];

#[test]
fn every_lens_of_basalt_is_read() {
    let example = basalt::FORMAT.example[0].1;
    let parameters = "\"k1\": -0.28, \"k2\": 0.07, \"p1\": 0.0002, \"p2\": 0.00002, \"k3\": 0, \
                      \"k4\": 0, \"k5\": 0, \"k6\": 0";
    // Both cameras have it: models of one rig are told apart elsewhere.
    let model = |name: &str, of_model: &str| {
        let text = with(example, &[("pinhole-radtan8", name), (parameters, of_model)]);
        read(&[("calib.json", &text)]).map(|calibration| *calibration.left.lens.model())
    };
    let kb4 = model("kb4", r#""k1": -0.01, "k2": 0.02, "k3": -0.03, "k4": 0.04"#).unwrap();
    assert_eq!(kb4, LensModel::Equidistant { radial: VALUES });
    let double = model("ds", r#""xi": -0.2, "alpha": 0.59"#).unwrap();
    assert_eq!(double, LensModel::DoubleSphere { xi: -0.2, alpha: 0.59 });
    let extended = model("eucm", r#""alpha": 0.6, "beta": 1.1"#).unwrap();
    assert_eq!(extended, LensModel::ExtendedUnified { alpha: 0.6, beta: 1.1 });
    let unified = model("ucm", r#""alpha": 0.6"#).unwrap();
    assert_eq!(unified, LensModel::ExtendedUnified { alpha: 0.6, beta: 1.0 });
    assert_eq!(model("pinhole", r#""w": 0"#).unwrap(), LensModel::IDEAL);
    let other = model("fov", r#""w": 0.9"#).unwrap_err().to_string();
    contains_all(other, &["camera model fov is not known", "Known are pinhole"]);
    contains_all(model("ds", r#""xi": 0"#).unwrap_err().to_string(), &["alpha is missing"]);
}

#[test]
fn basalts_cameras_are_two_with_unit_quaternions() {
    let example = basalt::FORMAT.example[0].1;
    let turned = with(example, &[("\"qw\": 1}", "\"qw\": 2}")]);
    contains_all(refusal(&[("calib.json", &turned)]), &["does not have length 1", "Copy qx"]);
    let one = with(example, &[("[[752, 480], [752, 480]]", "[[752, 480]]")]);
    let words = ["resolution has fewer than two cameras", "Calibrate two"];
    contains_all(refusal(&[("calib.json", &one)]), &words);
}

#[test]
fn every_lens_of_camodocal_is_read() {
    let [left, right, extrinsics] = [0, 1, 2].map(|at| camodocal::FORMAT.example[at].1);
    let (bent, pinhole) = (
        "   k1: -0.28\n   k2: 0.07\n   p1: 0.0002\n   p2: 0.00002\n",
        "   fx: 458.6\n   fy: 457.2\n   cx: 367.2\n   cy: 248.3\n",
    );
    let model = |changes: &[(&str, &str)]| {
        let cameras = [left, right].map(|text| with(text, changes));
        let files = [("l.yaml", &*cameras[0]), ("r.yaml", &cameras[1]), ("e.yaml", extrinsics)];
        read(&files).map(|calibration| *calibration.left.lens.model())
    };
    let fisheye = "   k2: -0.01\n   k3: 0.02\n   k4: -0.03\n   k5: 0.04\n   mu: 400\n   \
                   mv: 401\n   u0: 370\n   v0: 240\n";
    assert_eq!(
        model(&[("PINHOLE", "KANNALA_BRANDT"), (pinhole, fisheye)]).unwrap(),
        LensModel::Equidistant { radial: VALUES }
    );
    let mirror = format!("{bent}mirror_parameters:\n   xi: 1.0\n");
    let gamma = "   gamma1: 700\n   gamma2: 701\n   u0: 370\n   v0: 240\n";
    let mei = model(&[("PINHOLE", "MEI"), (bent, &mirror), (pinhole, gamma)]).unwrap();
    assert!(matches!(mei, LensModel::General { xi: 1.0, .. }), "{mei:?}");
    let other = model(&[("PINHOLE", "SCARAMUZZA")]).unwrap_err().to_string();
    contains_all(other, &["camera model SCARAMUZZA is not known", "KANNALA_BRANDT and MEI"]);
    let long = with(extrinsics, &[("q_w: 1.", "q_w: 1.5")]);
    let words = ["does not have length 1", "Copy q_x"];
    contains_all(refusal(&[("l.yaml", left), ("r.yaml", right), ("e.yaml", &long)]), &words);
}

#[test]
fn vins_names_the_files_of_its_cameras() {
    let example = vins::FORMAT.example;
    let (folder, paths) = written(example);
    let config = |path: &PathBuf| {
        CalibrationFiles::read(std::slice::from_ref(path), CalibrationHints::default())?
            .cameras(None)
    };
    let found = config(&paths[0]).unwrap();
    assert!((check::baseline_m(&found.cameras) - 0.11).abs() < 1e-12);
    // The name is an author's, and the file may have stayed with them.
    fs::remove_file(folder.path().join("cam1.yaml")).unwrap();
    let message = config(&paths[0]).unwrap_err().to_string();
    contains_all(message, &["cam1_calib names cam1.yaml", "three times --calibration"]);
}

/// ORB-SLAM2's settings of raw images with their rectification.
fn orb_slam_raw() -> String {
    let side = |name: &str, along: f64| {
        let matrix =
            |key: &str, data: &str| format!("{name}.{key}: !!opencv-matrix\n   data: [{data}]\n");
        [
            format!("{name}.width: 752\n{name}.height: 480\n"),
            matrix("K", "458.6, 0, 367.2, 0, 457.2, 248.3, 0, 0, 1"),
            matrix("D", "-0.28, 0.07, 0.0002, 0.00002, 0"),
            matrix("R", "1, 0, 0, 0, 1, 0, 0, 0, 1"),
            matrix("P", &format!("400, 0, 370, {along}, 0, 400, 250, 0, 0, 0, 1, 0")),
        ]
        .concat()
    };
    format!("%YAML:1.0\nCamera.fx: 400.0\n{}{}", side("LEFT", 0.0), side("RIGHT", -44.0))
}

#[test]
fn orb_slams_rectification_is_taken_over() {
    let calibration = read(&[("EuRoC.yaml", &orb_slam_raw())]).unwrap();
    assert_eq!(calibration.format, "ORB-SLAM");
    let (_, rig) =
        calibration.rectify(Sizing::Automatic { max_width: 800, max_height: 600 }).unwrap();
    assert_eq!((rig.focal_px, rig.center_u_px), (400.0, 370.0));
    assert!((rig.baseline_m - 0.11).abs() < 1e-12);
    let lacking = with(&orb_slam_raw(), &[("RIGHT.D", "RIGHT.E")]);
    contains_all(refusal(&[("EuRoC.yaml", &lacking)]), &["RIGHT.D is missing"]);
}

#[test]
fn orb_slams_baseline_and_size_may_stand_elsewhere() {
    let rectified = "%YAML:1.0\nCamera.fx: 435.2\nCamera.cx: 367.4\nCamera.cy: 252.2\n\
                     Stereo.b: 0.11\n";
    let found = sized(&[("rig.yaml", rectified)], [752, 480]).unwrap();
    assert_eq!(check::baseline_m(&found.cameras), 0.11);
    // Old settings leave the size to the images.
    let sizes = ("Camera.width: 752\nCamera.height: 480\n", "");
    let sizeless = with(orbslam::FORMAT.example[0].1, &[sizes]);
    let found = sized(&[("rig.yaml", &sizeless)], [752, 480]).unwrap();
    let Cameras::Raw(calibration) = found.cameras else { panic!("raw") };
    assert_eq!([calibration.right.width, calibration.right.height], [752, 480]);
    contains_all(refusal(&[("rig.yaml", &sizeless)]), &["does not say the size", "--image WxH"]);
}

/// The calibration that an OAK camera holds, of two cameras.
fn oak(kind: &str, left: &str, right: &str) -> String {
    let camera = |extrinsics: &str| {
        format!(
            r#"{{"cameraType": {kind}, "width": 752, "height": 480,
            "intrinsicMatrix": [[458.6,0,367.2],[0,457.2,248.3],[0,0,1]],
            "distortionCoeff": [-0.01,0.02,-0.03,0.04,0,0,0,0,0,0,0,0,0,0]{extrinsics}}}"#
        )
    };
    format!(r#"{{"cameraData": [[1, {}], [2, {}]]}}"#, camera(left), camera(right))
}

#[test]
fn oaks_sockets_lenses_and_motions_are_told_apart() {
    let motion = |to: u32, x: f64| {
        format!(
            r#", "extrinsics": {{"toCameraSocket": {to}, "translation": {{"x": {x}, "y": 0,
            "z": 0}}, "rotationMatrix": [[1,0,0],[0,1,0],[0,0,1]]}}"#
        )
    };
    for kind in ["1", "\"Fisheye\""] {
        let back = read(&[("oak.json", &oak(kind, "", &motion(1, 11.0)))]).unwrap();
        assert_eq!(*back.left.lens.model(), LensModel::Equidistant { radial: VALUES });
        assert!((back.baseline_m() - 0.11).abs() < 1e-12, "the right camera's motion is inverted");
    }
    let apart = refusal(&[("oak.json", &oak("0", "", &motion(0, 5.5)))]);
    contains_all(apart, &["neither camera has extrinsics to the other one"]);
    // An OAK-D has a colour camera on another socket.
    let third = with(&oak("0", &motion(2, -11.0), ""), &[("[2, {", "[3, {")]);
    contains_all(refusal(&[("oak.json", &third)]), &["no cameras on the sockets 1 (left)"]);
    let sizes = with(depthai::FORMAT.example[0].1, &[("\"width\": 752, \"height\": 480,", "")]);
    assert!(sized(&[("calib.json", &sizes)], [752, 480]).is_ok());
}

#[test]
fn opencvs_matrices_that_no_lens_has_are_refused() {
    let example = opencv::FORMAT.example[0].1;
    let matrix = "458.6, 0., 367.2, 0., 457.2, 248.3, 0., 0., 1.";
    let refused = |data: &str| refusal(&[("stereo.yml", &with(example, &[(matrix, data)]))]);
    // `cameraParameters.IntrinsicMatrix` of MATLAB is the transpose of OpenCV's matrix.
    let transposed = refused("458.6, 0., 0., 0., 457.2, 0., 367.2, 248.3, 1.");
    contains_all(transposed, &["transposed, as MATLAB writes", "Transpose the camera matrices"]);
    let skewed = refused("458.6, 3.5, 367.2, 0., 457.2, 248.3, 0., 0., 1.");
    contains_all(skewed, &["has a skew of 3.5", "Calibrate without skew"]);
}

#[test]
fn opencvs_files_without_lenses_say_what_they_hold() {
    let example = opencv::FORMAT.example[0].1;
    let bare = with(example, &[("D1", "d_one"), ("D2", "d_two")]);
    contains_all(refusal(&[("stereo.yml", &bare)]), &["distortion coefficients", "second --cal"]);
    // `stereoRectify` gives these, and people save them instead of the lenses.
    let projection = |along: f64| format!("[400, 0, 370, {along}, 0, 400, 250, 0, 0, 0, 1, 0]");
    let rectified = format!(
        "R1: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nR2: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nP1: {}\nP2: {}\n",
        projection(0.0),
        projection(-44.0)
    );
    let words = ["it holds a rectification", "`P1: 400 0 370 -44 0 400"];
    contains_all(refusal(&[("rectified.yml", &rectified)]), &words);
}

#[test]
fn names_of_models_decide_between_lenses() {
    // Four coefficients without a name are a guess.
    let example = with(
        opencv::FORMAT.example[0].1,
        &[("-0.28, 0.07, 0.0002, 0.00002, 0.", "-0.01, 0.02, -0.03, 0.04")],
    );
    for (name, expected) in [
        ("fisheye", "equidistant"),
        ("kannala_brandt4", "equidistant"),
        ("plumb_bob", "radial_tangential"),
        ("pinhole", "radial_tangential"),
    ] {
        let text = format!("{example}distortion_model: {name}\n");
        let found = sized(&[("stereo.yml", &text)], [752, 480]).unwrap();
        assert_eq!(found.guessed_lens, None, "{name}");
        let Cameras::Raw(calibration) = found.cameras else { panic!("raw") };
        assert_eq!(calibration.left.lens.model().name(), expected, "{name}");
    }
}

#[test]
fn a_right_file_that_comes_first_is_exchanged_and_said() {
    let long = opencv_long();
    let motion = long[1].strip_prefix(&long[0]).unwrap();
    let [right, left] = [long[0].clone(), format!("{}{motion}", long[0])];
    let found = sized(&[("right.yaml", &right), ("left.yaml", &left)], [752, 480]).unwrap();
    assert!(found.guesses[0].contains("right camera's file comes first: exchanged"));
    let [left, right] = [0, 1].map(|at| ros::FORMAT.example[at].1);
    let found = sized(&[("right.yaml", right), ("left.yaml", left)], [752, 480]).unwrap();
    assert!((check::baseline_m(&found.cameras) - 0.11).abs() < 1e-12);
}

#[test]
fn straight_cameras_without_distortion_have_rectified_images() {
    let straight = |text: &str| {
        with(
            text,
            &[
                ("458.6, 0, 367.2, 0, 457.2, 248.3", "400, 0, 370, 0, 400, 250"),
                ("-0.28, 0.07, 0.0002, 0.00002, 0", "0, 0, 0, 0, 0"),
            ],
        )
    };
    let [left, right] = [0, 1].map(|at| straight(ros::FORMAT.example[at].1));
    let found = sized(&[("left.yaml", &left), ("right.yaml", &right)], [752, 480]).unwrap();
    assert!(matches!(found.cameras, Cameras::Rectified(_)));
    assert!(found.sentence().starts_with("rectified, 752 x 480, focal length 400.00 px"));
    assert_eq!(found.raw(None).unwrap().left.width, 752);
    // KITTI's lines say no size.
    let kitti = "P0: 700 0 350 0 0 700 250 0 0 0 1 0\nP1: 700 0 350 -77 0 700 250 0 0 0 1 0\n";
    let (_folder, paths) = written(&[("calib.txt", kitti)]);
    let files = CalibrationFiles::read(&paths, CalibrationHints::default()).unwrap();
    let message = files.cameras(None).unwrap().raw(None).unwrap_err().to_string();
    contains_all(message, &["does not say the size", "--image WxH"]);
}

#[test]
fn two_models_of_one_rig_are_both_named() {
    let (left, right) = KALIBR.split_at(KALIBR.find("cam1").unwrap());
    let right = with(right, &[("radtan", "equidistant"), ("-0.28, 0.07", "-0.01, 0.01")]);
    let found = sized(&[("camchain.yaml", &format!("{left}{right}"))], [752, 480]).unwrap();
    assert!(found.sentence().starts_with("raw, radial-tangential and equidistant, 752 x 480"));
}

#[test]
fn a_calibration_is_one_to_four_files() {
    for count in [0, 5] {
        let paths = vec![PathBuf::from("rig.yaml"); count];
        let read = CalibrationFiles::read(&paths, CalibrationHints::default());
        contains_all(read.unwrap_err().to_string(), &["1 to 4 files", "--calibration LEFT"]);
    }
}

#[test]
fn cameras_a_millimetre_apart_are_asked_for_their_unit() {
    let near = with(KALIBR, &[("-0.11]", "-0.0011]")]);
    let words = ["the cameras are 1.1", "mm apart", "--calibration-unit m if it is right"];
    contains_all(refusal(&[("camchain.yaml", &near)]), &words);
    let behind =
        with(KALIBR, &[("-0.11]", "0.0]"), ("0.0, 0.0, 1.0, 0.0]", "0.0, 0.0, 1.0, 0.2]")]);
    contains_all(refusal(&[("camchain.yaml", &behind)]), &["one behind the other"]);
}

#[test]
fn hints_are_told_as_options() {
    for (unit, shown) in
        [("m", "m"), ("cm", "cm"), ("mm", "mm"), ("0.025", "0.025"), ("inch", "0.0254")]
    {
        let unit: LengthUnit = unit.parse().unwrap();
        let hints = CalibrationHints { unit: Some(unit), ..Default::default() };
        assert_eq!(hints.options(), format!(" --calibration-unit {shown}"));
        assert_eq!(shown.parse(), Ok(unit), "and taken again");
    }
    for (swap, shown, calibration, images) in [
        (Swap::Both, " --swap", true, true),
        (Swap::Calibration, " --swap=calibration", true, false),
        (Swap::Images, " --swap=images", false, true),
    ] {
        assert_eq!((swap.calibration(), swap.images()), (calibration, images));
        let hints = CalibrationHints { swap: Some(swap), ..Default::default() };
        assert_eq!(hints.options(), shown);
    }
    let lens_model = Some(LensFamily::Fisheye.other());
    let hints = CalibrationHints { lens_model, vertical: true, ..Default::default() };
    assert_eq!(hints.options(), " --lens-model pinhole --vertical");
    assert_eq!(LengthUnit(0.025).to_string(), "0.025 m");
}

#[test]
fn formats_with_one_shape_name_what_is_another() {
    let middlebury = middlebury::FORMAT.example[0].1;
    let line = |key: &str| middlebury.lines().find(|line| line.starts_with(key)).unwrap();
    let (cam0, cam1) = (line("cam0"), line("cam1"));
    let shape = cam0.replace("cam0", "cam1").replace(';', "; 7");
    let message = refusal(&[("calib.txt", &with(middlebury, &[(cam1, &shape)]))]);
    assert!(message.contains("cam1"), "{message}");
    let other = with(KALIBR, &[("camera_model: pinhole", "camera_model: pear")]);
    let words = ["the camera model pear is not known", "pinhole, ds, eucm and omni"];
    contains_all(refusal(&[("camchain.yaml", &other)]), &words);
    let zed = zed::FORMAT.example[0].1;
    let message = sized(&[("SN1.conf", zed)], [333, 222]).unwrap_err().to_string();
    contains_all(message, &["no section for images of 333 x 222 px", "as the camera delivers"]);
    let keys = "focal_px 700\ncenter_u_px nan\ncenter_v_px 180\nbaseline_m 0.5\n";
    contains_all(refusal(&[("calib.txt", keys)]), &["principal point is not finite"]);
}

#[test]
fn a_plain_folders_calibration_is_keys_or_kittis_lines() {
    use crate::formats::calibration::read_rig;
    let keys = "focal_px 700 # of both\ncenter_u_px 350\ncenter_v_px 250\nbaseline_m 0.11\n";
    let kitti = "P0: 700 0 350 0 0 700 250 0 0 0 1 0\nP1: 700 0 350 -77 0 700 250 0 0 0 1 0\n";
    let (_folder, paths) = written(&[("keys.txt", keys), ("kitti.txt", kitti)]);
    assert_eq!(read_rig(&paths[0]).unwrap().focal_px, read_rig(&paths[1]).unwrap().focal_px);
    assert!((read_rig(&paths[1]).unwrap().baseline_m - 0.11).abs() < 1e-12);
}
