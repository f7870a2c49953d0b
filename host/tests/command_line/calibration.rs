//! A raw street whose calibration comes as OpenCV's users have it: without a size, without the name
//! of the lens, the cameras in any order, both images in one.

use super::binary::{dynvox, output_text};
use std::fs;
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

/// The numbers of the list behind the `nth` occurrence of a key.
fn list(text: &str, key: &str, nth: usize) -> Vec<f64> {
    let (at, _) = text.match_indices(&format!("{key}: [")).nth(nth).expect(key);
    let list = &text[at + key.len() + 3..];
    let list = &list[..list.find(']').expect("an end")];
    list.split(',').map(|word| word.trim().parse().expect("a number")).collect()
}

/// Camera matrix and distortion of the `nth` camera of a camchain, under OpenCV's short names.
fn camera(camchain: &str, nth: usize, number: usize) -> String {
    let [fx, fy, cx, cy] = list(camchain, "intrinsics", nth).try_into().expect("four numbers");
    let distortion = list(camchain, "distortion_coeffs", nth);
    format!(
        "K{number}: [[{fx}, 0.0, {cx}], [0.0, {fy}, {cy}], [0.0, 0.0, 1.0]]\n\
         D{number}: {distortion:?}\n"
    )
}

/// Rotation and translation of the right camera in a camchain.
fn motion(camchain: &str) -> ([[f64; 3]; 3], [f64; 3]) {
    let rows = &camchain[camchain.find("T_cn_cnm1:").expect("a motion")..];
    let row = |line: &str| -> [f64; 4] {
        let line = line.trim().trim_start_matches("- [").trim_end_matches(']');
        let numbers: Vec<f64> =
            line.split(',').map(|word| word.trim().parse().expect("a number")).collect();
        numbers.try_into().expect("four numbers")
    };
    let rows: Vec<[f64; 4]> = rows.lines().skip(1).take(3).map(row).collect();
    let of = |row: usize| [rows[row][0], rows[row][1], rows[row][2]];
    ([of(0), of(1), of(2)], [rows[0][3], rows[1][3], rows[2][3]])
}

/// Writes `left/` and `right/`, and pictures with both in `both/`.
fn write_images(root: &Path, frames: usize) {
    for folder in ["rig/left", "rig/right", "both"] {
        fs::create_dir_all(root.join(folder)).expect("a folder");
    }
    for frame in 0..frames {
        let name = format!("{frame:06}.png");
        let [left, right] = [0, 1].map(|side| {
            let from = root.join(format!("street/sequences/00/image_{side}/{name}"));
            let folder = ["rig/left", "rig/right"][side];
            fs::copy(&from, root.join(folder).join(&name)).expect("a copy");
            image::open(&from).expect("a picture").to_luma8()
        });
        let width = left.width();
        // Both pictures beside each other, as a camera with one stream sends them.
        let both = image::GrayImage::from_fn(2 * width, left.height(), |u, v| {
            if u < width { *left.get_pixel(u, v) } else { *right.get_pixel(u - width, v) }
        });
        both.save(root.join("both").join(&name)).expect("a picture");
    }
}

#[dynvox_needs::long]
#[test]
fn opencvs_file_without_size_and_lens_maps_as_kalibrs_with_both() {
    let root = TempDir::new().expect("a folder");
    let root = root.path();
    let street = ["--set", "street.width=320", "--set", "street.height=160"];
    let lens = ["--set", "street.lens.model=equidistant"];
    let synth = dynvox(
        root,
        &[&["synth", "--out", "street", "--frames", "2"], &street[..], &lens].concat(),
    );
    assert!(synth.status.success(), "{}", output_text(&synth));
    write_images(root, 2);
    let camchain =
        fs::read_to_string(root.join("street/sequences/00/camchain.yaml")).expect("a file");
    fs::write(root.join("camchain.yaml"), &camchain).expect("a file");
    let (r, t) = motion(&camchain);
    let stereo =
        format!("{}{}R: {r:?}\nT: {t:?}\n", camera(&camchain, 0, 1), camera(&camchain, 1, 2));
    fs::write(root.join("stereo.yml"), &stereo).expect("a file");

    let coarse = ["--profile", "small", "--instances", "none", "--set", "volume.voxel_size_m=0.2"];
    let run = |arguments: &[&str]| {
        dynvox(root, &[&["run"], arguments, &["--json", "--force"], &coarse[..]].concat())
    };
    let digest = |arguments: &[&str]| {
        let run = run(arguments);
        assert!(run.status.success(), "{arguments:?}: {}", output_text(&run));
        serde_json::from_slice::<serde_json::Value>(&run.stdout).expect("JSON")["digest"].clone()
    };
    let expected = digest(&["rig", "--calibration", "camchain.yaml", "--out", "a"]);
    let found = digest(&["rig", "--calibration", "stereo.yml", "--out", "b"]);
    assert_eq!(found, expected, "size and lens are those of the images");
    let both = ["both", "--calibration", "stereo.yml", "--out", "c"];
    assert_eq!(digest(&both), expected, "half of a picture is one image");

    // The right camera first, in the calibration only.
    let back = |row: usize| [r[0][row], r[1][row], r[2][row]];
    let t_back = [0, 1, 2].map(|row| -back(row).iter().zip(t).map(|(r, t)| r * t).sum::<f64>());
    let reversed = format!(
        "{}{}R: {:?}\nT: {t_back:?}\n",
        camera(&camchain, 1, 1),
        camera(&camchain, 0, 2),
        [back(0), back(1), back(2)]
    );
    fs::write(root.join("reversed.yml"), reversed).expect("a file");
    let refused = run(&["rig", "--calibration", "reversed.yml", "--out", "d"]);
    let message = output_text(&refused);
    assert!(!refused.status.success() && message.contains("--swap=calibration"), "{message}");
    let swapped = ["rig", "--calibration", "reversed.yml", "--swap=calibration", "--out", "e"];
    assert!(run(&swapped).status.success());

    // Beside the images it is found by what it holds.
    fs::copy(root.join("stereo.yml"), root.join("rig/mine.yml")).expect("a copy");
    let printed = |output: &Output| String::from_utf8_lossy(&output.stdout).into_owned();
    let inspected = printed(&dynvox(root, &["inspect", "rig"]));
    assert!(inspected.contains("raw, equidistant, "), "{inspected}");
    assert!(inspected.contains("mine.yml (OpenCV)"), "{inspected}");
    let explained = dynvox(root, &["calibration", "stereo.yml", "--images", "rig"]);
    let text = printed(&explained);
    assert!(explained.status.success() && text.contains("useful depth"), "{text}");
    assert!(text.contains("rectified_pair.png") && root.join("rectified_pair.png").is_file());
}

/// A street without distortion whose pictures are turned by a quarter, clockwise: the right camera
/// is then the lower one.
#[dynvox_needs::long]
#[test]
fn cameras_one_above_the_other_map_what_they_map_side_by_side() {
    let root = TempDir::new().expect("a folder");
    let root = root.path();
    let street = ["--set", "street.width=256", "--set", "street.height=128"];
    let synth =
        dynvox(root, &[&["synth", "--out", "street", "--frames", "2"], &street[..]].concat());
    assert!(synth.status.success(), "{}", output_text(&synth));
    let calib = fs::read_to_string(root.join("street/sequences/00/calib.txt")).expect("a file");
    let row = |name: &str| -> Vec<f64> {
        let line = calib.lines().find(|line| line.starts_with(name)).expect("a projection");
        line.split_whitespace().skip(1).map(|word| word.parse().expect("a number")).collect()
    };
    let (p0, p1) = (row("P0:"), row("P1:"));
    let (focal, center, along_m) = (p0[0], [p0[2], p0[6]], p1[3] / p1[0]);
    let matrix = |[u, v]: [f64; 2]| format!("[[{focal}, 0, {u}], [0, {focal}, {v}], [0, 0, 1]]");
    let stereo = |center: [f64; 2], t: [f64; 3]| {
        let (matrix, none) = (matrix(center), "[0, 0, 0, 0, 0]");
        format!(
            "K1: {matrix}\nD1: {none}\nK2: {matrix}\nD2: {none}\nR: [[1, 0, 0], [0, 1, 0], [0, 0, \
             1]]\nT: {t:?}\n"
        )
    };
    for folder in ["flat/left", "flat/right", "turned/left", "turned/right"] {
        fs::create_dir_all(root.join(folder)).expect("a folder");
    }
    for (frame, side) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let from = root.join(format!("street/sequences/00/image_{side}/{frame:06}.png"));
        let picture = image::open(&from).expect("a picture").to_luma8();
        let name = format!("{}/{frame:06}.png", ["left", "right"][side]);
        picture.save(root.join("flat").join(&name)).expect("a picture");
        let turned = image::imageops::rotate90(&picture);
        turned.save(root.join("turned").join(&name)).expect("a picture");
    }
    fs::write(root.join("flat.yml"), stereo(center, [along_m, 0.0, 0.0])).expect("a file");
    let center = [127.0 - center[1], center[0]];
    fs::write(root.join("turned.yml"), stereo(center, [0.0, along_m, 0.0])).expect("a file");

    let coarse = ["--profile", "small", "--instances", "none", "--set", "volume.voxel_size_m=0.2"];
    let run = |arguments: &[&str]| {
        dynvox(root, &[&["run"], arguments, &["--json", "--force"], &coarse[..]].concat())
    };
    let refused = run(&["turned", "--calibration", "turned.yml", "--out", "a"]);
    let message = output_text(&refused);
    assert!(!refused.status.success(), "{message}");
    assert!(message.contains("stands below the first. Give --vertical"), "{message}");
    let digest = |arguments: &[&str]| {
        let run = run(arguments);
        assert!(run.status.success(), "{arguments:?}: {}", output_text(&run));
        serde_json::from_slice::<serde_json::Value>(&run.stdout).expect("JSON")["digest"].clone()
    };
    let expected = digest(&["flat", "--calibration", "flat.yml", "--out", "b"]);
    let found = digest(&["turned", "--calibration", "turned.yml", "--vertical", "--out", "c"]);
    assert_eq!(found, expected, "turned back, the images are those of cameras side by side");
}
