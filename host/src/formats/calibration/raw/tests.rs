//! Each format contains_all the same rig; each way to damage a file is answered by a sentence.

mod models;
mod others;
mod units;
mod variants;
mod vertical;

use super::*;
use crate::formats::calibration::{CalibrationHints, CameraGeometry, RectifiedSize};
use dynvox_core::rectify::{Lens, LensModel, RawCamera};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const KALIBR: &str = kalibr::FORMAT.example[0].1;

fn euroc(x: f64) -> String {
    format!(
        "%YAML:1.0\n# General sensor definitions.\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: \
         4\n  data: [1.0, 0.0, 0.0, {x},\n         0.0, 1.0, 0.0, 0.02,\n         \
         0.0, 0.0, 1.0, 0.01,\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, \
         480]\ncamera_model: pinhole\n\
         intrinsics: [458.6, 457.2, 367.2, 248.3] #fu, fv, cu, cv\ndistortion_model: \
         radial-tangential\n\
         distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]\n"
    )
}

const MATRIX: &str = "!!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 458.6, 0., \
                      367.2, 0., 457.2, 248.3, 0., 0., 1. ]\n";
const COEFFICIENTS: &str = "!!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ -0.28, \
                            0.07, 0.0002, 0.00002, 0. ]\n";
const R: &str = "R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 0., 0., 0., \
                 1., 0., 0., 0., 1. ]\n";
const T: &str =
    "T: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ -0.11, 0., 0. ]\n";

fn opencv_short() -> [String; 2] {
    [
        format!("%YAML:1.0\n---\nM1: {MATRIX}D1: {COEFFICIENTS}M2: {MATRIX}D2: {COEFFICIENTS}"),
        format!("%YAML:1.0\n---\n{R}{T}size: [752, 480]\n"),
    ]
}

fn opencv_long() -> [String; 2] {
    let one = format!(
        "%YAML:1.0\n---\nimage_width: 752\nimage_height: 480\ncameraMatrix: {MATRIX}distCoeffs: \
         {COEFFICIENTS}"
    );
    [one.clone(), format!("{one}{R}{T}")]
}

fn opencv_xml() -> String {
    let matrix = |name: &str, rows: u32, data: &str| {
        format!(
            "<{name} type_id=\"opencv-matrix\"><rows>{rows}</rows><cols>3</cols><dt>d</dt><data>\n \
             {data}</data></{name}>\n"
        )
    };
    let camera = |number: u32| {
        matrix(&format!("M{number}"), 3, "458.6 0. 367.2 0. 457.2 248.3 0. 0. 1.")
            + &matrix(&format!("D{number}"), 1, "-0.28 0.07 0.0002 0.00002 0.")
    };
    let rest = matrix("R", 3, "1. 0. 0. 0. 1. 0. 0. 0. 1.") + &matrix("T", 3, "-0.11 0. 0.");
    format!(
        "<?xml \
         version=\"1.0\"?>\n<opencv_storage>\n{}{}{rest}<image_width>752</image_width><image_height>480</image_height></opencv_storage>",
        camera(1),
        camera(2)
    )
}

const KITTI: &str = kitti_raw::FORMAT.example[0].1;

/// Files with these names and texts, in a folder that lives as long as they are read.
fn written(files: &[(&str, &str)]) -> (TempDir, Vec<PathBuf>) {
    let folder = TempDir::new().unwrap();
    let paths = files.iter().map(|(name, text)| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    });
    let paths = paths.collect();
    (folder, paths)
}

fn read(files: &[(&str, &str)]) -> Result<StereoCalibration, FormatError> {
    let (_folder, paths) = written(files);
    StereoCalibration::read(&paths.iter().map(PathBuf::as_path).collect::<Vec<_>>(), None)
}

fn refusal(files: &[(&str, &str)]) -> String {
    read(files).unwrap_err().to_string()
}

#[test]
fn all_formats_tell_of_the_same_rig() {
    let (short, long, xml) = (opencv_short(), opencv_long(), opencv_xml());
    let variants = [
        ("OpenCV", vec![("intrinsics.yml", &*short[0]), ("extrinsics.yml", &*short[1])]),
        ("OpenCV", vec![("left.yaml", &*long[0]), ("right.yaml", &*long[1])]),
        ("OpenCV", vec![("stereo.xml", &*xml)]),
    ];
    // ZED's resolutions and those of rectified images are not these.
    let other = ["ZED", "Middlebury", "RobotCar", "keys", "KITTI", "K and baseline"];
    let examples = CALIBRATION_FORMATS.iter().map(|row| (row.name, row.example.to_vec()));
    let examples = examples.filter(|(name, _)| !other.contains(name));
    for (format, files) in examples.chain(variants) {
        let calibration = read(&files).unwrap_or_else(|error| panic!("{format}: {error}"));
        assert_eq!(calibration.format, format);
        for camera in [calibration.left, calibration.right] {
            assert_eq!(
                ([camera.width, camera.height], camera.lens.focal_px(), camera.lens.center_px()),
                ([752, 480], [458.6, 457.2], [367.2, 248.3])
            );
            let same = LensModel::RadialTangential {
                radial: [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0],
                tangential: [0.0002, 0.00002],
            };
            assert_eq!(*camera.lens.model(), same, "{format}");
        }
        assert!(
            (calibration.baseline_m() - 0.11).abs() < 1e-9 && calibration.angle_deg() < 1e-9,
            "{format}"
        );
        let (rectification, rig) =
            calibration.rectify(Sizing::Automatic { max_width: 800, max_height: 600 }).unwrap();
        assert!((rig.baseline_m - 0.11).abs() < 1e-9);
        let given = matches!(format, "ROS CameraInfo" | "ROS oST" | "KITTI raw").then_some(400.0);
        assert!(
            given.is_none_or(|focal| rig.focal_px == focal),
            "{format} gives its own rectification"
        );
        assert_eq!(rectification.left.raw, calibration.left);
    }
}

#[test]
fn the_documentation_lists_every_format() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/inputs.md");
    let page = fs::read_to_string(page).unwrap();
    for row in CALIBRATION_FORMATS {
        let line = format!("| {} | {} |", row.name, row.files);
        assert!(page.contains(&line), "docs/inputs.md lacks: {line}");
    }
}

/// The page of examples, from the rows of the table.
fn page_of_examples() -> String {
    let mut page = String::from(include_str!("tests/page.md"));
    for row in CALIBRATION_FORMATS {
        page.push_str(&format!(
            "\n## {}\n\n{}. Lengths are in {}.\n",
            row.name, row.files, row.unit
        ));
        for (name, text) in row.example {
            page.push_str(&format!("\n`{name}`:\n\n```text\n{}\n```\n", text.trim_end()));
        }
    }
    page
}

#[test]
fn the_page_of_calibrations_has_an_example_of_every_format() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/calibration.md");
    if std::env::var_os("DYNVOX_BLESS").is_some() {
        fs::write(path, page_of_examples()).unwrap();
    }
    let page = fs::read_to_string(path).unwrap();
    assert!(
        page == page_of_examples(),
        "DYNVOX_BLESS=1 cargo test -p dynvox --lib calibration:: writes docs/calibration.md anew"
    );
}

#[test]
fn files_of_no_format_are_told_all_that_are_known() {
    let message = refusal(&[(
        "rig.yaml",
        "focal: 3
",
    )]);
    assert!(CALIBRATION_FORMATS.iter().all(|row| message.contains(row.name)), "{message}");
}

#[test]
fn own_files_keep_every_bit() {
    for files in [vec![("camchain.yaml", KALIBR)], vec![("calib_cam_to_cam.txt", KITTI)]] {
        let calibration = read(&files).unwrap();
        let again = read(&[("own.toml", &to_toml(&calibration))]).unwrap();
        assert_eq!(StereoCalibration { format: calibration.format, ..again }, calibration);
    }
}

#[test]
fn a_written_camchain_is_read_again() {
    let models = [
        LensModel::RadialTangential {
            radial: [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0],
            tangential: [2e-4, -3e-4],
        },
        LensModel::Equidistant { radial: [-0.013, 0.02, -0.012, 0.002] },
        LensModel::DoubleSphere { xi: -0.18, alpha: 0.59 },
        LensModel::ExtendedUnified { alpha: 0.6, beta: 1.1 },
    ];
    let plain = read(&[("camchain.yaml", KALIBR)]).unwrap();
    for model in models {
        let camera = |camera: RawCamera| RawCamera {
            lens: Lens::new(camera.lens.focal_px(), camera.lens.center_px(), model).unwrap(),
            ..camera
        };
        let calibration =
            StereoCalibration { left: camera(plain.left), right: camera(plain.right), ..plain };
        assert_eq!(
            read(&[("camchain.yaml", &to_kalibr(&calibration).unwrap())]).unwrap(),
            calibration
        );
    }
    let rational = LensModel::RadialTangential {
        radial: [0.9, 0.2, 0.01, 1.2, 0.4, 0.05],
        tangential: [0.0; 2],
    };
    let lens = Lens::new([400.0; 2], [300.0; 2], rational).unwrap();
    assert_eq!(
        to_kalibr(&StereoCalibration { left: RawCamera { lens, ..plain.left }, ..plain }),
        None,
        "Kalibr has no rational model"
    );
}

#[test]
fn bad_files_of_our_own_format_are_answered_by_a_sentence() {
    let text = to_toml(&read(&[("calib_cam_to_cam.txt", KITTI)]).unwrap());
    for end in (0..text.len().saturating_sub(60)).step_by(41) {
        let message = refusal(&[("own.toml", &text[..end])]);
        assert!(message.contains("own.toml") && message.contains(". "), "{message}");
    }
    let contains = |from: &str, to: &str, words: &str| {
        assert!(text.contains(from), "{from}: {text}");
        let message = refusal(&[("own.toml", &text.replace(from, to))]);
        assert!(message.contains(words), "{words}: {message}");
    };
    contains("width_px", "widht_px", "not a calibration");
    contains("458.6", "nan", "focal length is not a positive number");
    contains("458.6", "0.0", "focal length is not a positive number");
    contains("367.2", "inf", "principal point is not finite");
    contains("[1.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]", "not a rotation matrix");
    contains("baseline_m = 0.11", "baseline_m = 537.0", "Is it in millimetres?");
    contains("width_px = 752", "width_px = 1", "raw");
}

#[test]
fn bad_files_of_kitti_are_answered_by_a_sentence() {
    let contains = |from: &str, to: &str, words: &str| {
        assert!(KITTI.contains(from), "{from}");
        let message = refusal(&[("calib_cam_to_cam.txt", &KITTI.replace(from, to))]);
        assert!(message.contains(words), "{words}: {message}");
    };
    contains("K_01", "K_0l", "K_01");
    contains("458.6", "nan", "finite");
    contains("458.6", "0.0", "focal length");
    contains(
        "R_rect_00: 1 0 0 0 1 0 0 0 1",
        "R_rect_00: 1 0 0 0 0 0 0 0 1",
        "not a rotation matrix",
    );
    contains("P_rect_01: 400 0 370 -44 ", "P_rect_01: 400 0 370 -440000 ", "Is it in millimetres?");
}

#[test]
fn every_lens_of_kalibr_is_read() {
    let with = |model: &str, distortion: &str, intrinsics: &str, coefficients: &str| {
        KALIBR
            .replace("camera_model: pinhole", &format!("camera_model: {model}"))
            .replace("distortion_model: radtan", &format!("distortion_model: {distortion}"))
            .replace("[458.6, 457.2, 367.2, 248.3]", intrinsics)
            .replace("[-0.28, 0.07, 0.0002, 0.00002]", coefficients)
    };
    let model = |text: &str| {
        read(&[("camchain.yaml", text)]).map(|calibration| *calibration.left.lens.model())
    };
    let fisheye =
        with("pinhole", "equidistant", "[190, 190, 376, 240]", "[0.003, 0.0007, -0.002, 0.0002]");
    assert_eq!(
        model(&fisheye).unwrap(),
        LensModel::Equidistant { radial: [0.003, 0.0007, -0.002, 0.0002] }
    );
    let double = with("ds", "none", "[-0.2, 0.59, 350, 350, 376, 240]", "[]");
    assert_eq!(model(&double).unwrap(), LensModel::DoubleSphere { xi: -0.2, alpha: 0.59 });
    let extended = with("eucm", "none", "[0.6, 1.1, 350, 350, 376, 240]", "[]");
    assert_eq!(model(&extended).unwrap(), LensModel::ExtendedUnified { alpha: 0.6, beta: 1.1 });
    let omni = with("omni", "none", "[1.0, 700, 700, 376, 240]", "[]");
    assert_eq!(model(&omni).unwrap(), LensModel::ExtendedUnified { alpha: 0.5, beta: 1.0 });
    let bent = with("omni", "radtan", "[1.0, 700, 700, 376, 240]", "[-0.1, 0, 0, 0]");
    let LensModel::General { xi, radial, .. } = model(&bent).unwrap() else { panic!("no sphere") };
    assert_eq!((xi, radial[0]), (1.0, -0.1), "Mei's model with distortion");
    let other = with("pinhole", "fov", "[350, 350, 376, 240]", "[0.9]");
    assert!(model(&other).unwrap_err().to_string().contains("distortion model fov is not known"));
}

#[test]
fn a_truncated_file_is_refused_wherever_it_ends() {
    let long = opencv_long();
    for (name, text) in [
        ("camchain.yaml", KALIBR),
        ("calib_cam_to_cam.txt", KITTI),
        ("stereo.xml", &opencv_xml()),
        ("one.yaml", &long[1]),
    ] {
        for end in (0..text.len().saturating_sub(60)).step_by(37) {
            let message = refusal(&[(name, &text[..end])]);
            assert!(message.contains(name) && message.contains(". "), "{message}");
        }
    }
}

fn contains_all(message: String, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "{word}: {message}");
    }
}

#[test]
fn damaged_numbers_are_named_with_the_next_action() {
    let kalibr = |from: &str, to: &str| {
        assert!(KALIBR.contains(from), "{from}");
        refusal(&[("camchain.yaml", &KALIBR.replace(from, to))])
    };
    contains_all(
        kalibr("458.6", ".nan"),
        &["non-finite", "line 5", "Check that the file is whole"],
    );
    contains_all(kalibr("458.6", "0.0"), &["focal length is not a positive number", "above 0"]);
    contains_all(
        kalibr(
            "intrinsics: [458.6, 457.2, 367.2, 248.3]\n  resolution: [752, 480]\ncam1",
            "resolution: [752, 480]\ncam1",
        ),
        &["intrinsics is missing in cam0"],
    );
    contains_all(
        kalibr("[1.0, 0.0, 0.0, -0.11]", "[0.0, 0.0, 0.0, -0.11]"),
        &["not a rotation matrix", "copy it whole"],
    );
    contains_all(
        kalibr("-0.11]", "-537.0]"),
        &["537 m apart. Is it in millimetres?", "--calibration-unit mm"],
    );
    contains_all(kalibr("-0.11]", "0.11]"), &["right camera stands to the left", "give --swap"]);
    contains_all(kalibr("-0.11]", "0.0]"), &["distance between the cameras is 0"]);
    contains_all(
        kalibr("resolution: [752, 480]", "resolution: [75, 48]"),
        &["does not fit images of 75 x 48 px"],
    );
    contains_all(
        kalibr("resolution: [752, 480]", "resolution: [752.5, 480]"),
        &["not a width and a height"],
    );
    contains_all(kalibr("T_cn_cnm1", "T_cn_cnm2"), &["T_cn_cnm1 is missing in cam1"]);
}

#[test]
fn files_that_lack_something_say_so() {
    contains_all(refusal(&[("a.yaml", "a: 1\n")]), &["no known calibration", "Known are dynvox"]);
    contains_all(refusal(&[("a.yaml", "- 1\n")]), &["it holds no keys"]);
    contains_all(refusal(&[("a.yaml", &euroc(0.0))]), &["one sensor.yaml", "--calibration twice"]);
    contains_all(refusal(&[("a.toml", "[left]\n")]), &["not a calibration"]);
    contains_all(
        refusal(&[(
            "c.txt",
            &KITTI.replace("1 0 0 0 1 0 0 0 1\nP_rect_00", "1 0 0 0 1 0 0 1\nP_rect_00"),
        )]),
        &["R_rect_00 has 8 numbers, not 9"],
    );
    let short = opencv_short();
    contains_all(
        refusal(&[("intrinsics.yml", &short[0])]),
        &["R or rotation", "second --calibration"],
    );
    let sizeless = short[1].replace("size: [752, 480]\n", "");
    contains_all(
        refusal(&[("intrinsics.yml", &short[0]), ("extrinsics.yml", &sizeless)]),
        &["does not say the size"],
    );
    let camodocal = camodocal::FORMAT.example[0].1;
    contains_all(
        refusal(&[("l.yaml", camodocal), ("r.yaml", camodocal)]),
        &["extrinsics.yaml", "cannot be read"],
    );
}

#[test]
fn images_of_another_size_do_not_fit() {
    let calibration = read(&[("camchain.yaml", KALIBR)]).unwrap();
    assert!(calibration.fits(Path::new("c"), [752, 480]).is_ok());
    let message = calibration.fits(Path::new("c"), [640, 480]).unwrap_err().to_string();
    assert!(message.contains("752 x 480 px, but these are 640 x 480 px"), "{message}");
    let (short, sizeless) = (opencv_short(), opencv_short()[1].replace("size: [752, 480]\n", ""));
    let (_folder, paths) = written(&[("i.yml", &short[0]), ("e.yml", &sizeless)]);
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    assert_eq!(
        StereoCalibration::read(&paths, Some([752, 480])).unwrap().left.width,
        752,
        "told by the images"
    );
}

#[test]
fn the_rectified_size_is_the_calibrations_or_a_given_one() {
    let (_folder, paths) = written(&[("calib_cam_to_cam.txt", KITTI)]);
    let fitted = |rectified: RectifiedSize| {
        CameraGeometry::read(&paths, CalibrationHints::default())
            .unwrap()
            .fitted((752, 480), &rectified)
    };
    let own = fitted(RectifiedSize::default()).unwrap();
    assert_eq!((own.size, own.rig.focal_px), ((700, 400), 400.0));
    let size = RectifiedSize { width_px: Some(320), height_px: Some(200), focal_px: None };
    let given = fitted(size).unwrap();
    assert!(
        given.size == (320, 200) && given.rig.focal_px < 458.6,
        "the least focal length without invalid pixels"
    );
    let closer = fitted(RectifiedSize { focal_px: Some(500.0), ..size }).unwrap();
    assert_eq!((closer.size, closer.rig.focal_px), ((320, 200), 500.0));
    let refused = |rectified: RectifiedSize| fitted(rectified).unwrap_err().to_string();
    assert!(
        refused(RectifiedSize { height_px: None, ..size })
            .contains("needs width and height. Give --rectified WxH")
    );
    assert!(
        refused(RectifiedSize { width_px: Some(8), ..size })
            .contains("8 x 200 px must lie within 32 to 4096")
    );
    assert!(
        refused(RectifiedSize { focal_px: Some(f64::NAN), ..size })
            .contains("must be a positive number")
    );
    assert!(
        refused(RectifiedSize { focal_px: Some(500.0), ..RectifiedSize::default() })
            .contains("needs a rectified size")
    );
}
