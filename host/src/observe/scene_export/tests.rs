//! Exports are read back as COLMAP and nerfstudio document them.

use super::scene::ExportedScene;
use super::*;
use dynvox_core::geometry::StereoRig;

const RIG: StereoRig =
    StereoRig { focal_px: 500.0, center_u_px: 319.5, center_v_px: 95.25, baseline_m: 0.5 };

/// A curve of three frames, and a point ahead of them.
fn scene() -> ExportedScene {
    let pose = |at: f64| Transform::new([0.02 * at, 0.1 * at, -0.03], [0.3 * at, 0.1, at]);
    ExportedScene {
        rig: RIG,
        size: (640, 192),
        frames: (0..3).map(|at| (format!("{at:06}.png"), pose(f64::from(at)))).collect(),
        points: vec![([1.5, -0.5, 12.0], [10, 20, 30])],
    }
}

/// Pixel of the scene's point in a frame, from the outer corner of the upper left pixel.
fn expected_px(pose: &Transform) -> [f64; 2] {
    let [x, y, z] = pose.inverse().transform_point([1.5, -0.5, 12.0]);
    [RIG.center_u_px + 0.5 + RIG.focal_px * x / z, RIG.center_v_px + 0.5 + RIG.focal_px * y / z]
}

fn assert_near(found: [f64; 2], expected: [f64; 2]) {
    let is_near = (0..2).all(|axis| (found[axis] - expected[axis]).abs() < 1e-6);
    assert!(is_near, "{found:?}, not {expected:?}");
}

#[test]
fn a_model_of_colmap_projects_its_points_to_their_pixels() {
    let (folder, scene) = (tempfile::TempDir::new().unwrap(), scene());
    colmap::write(folder.path(), &scene).unwrap();
    let rows = |name: &str| -> Vec<Vec<String>> {
        let text = std::fs::read_to_string(folder.path().join("sparse/0").join(name)).unwrap();
        text.lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split_whitespace().map(str::to_owned).collect())
            .collect()
    };
    let numbers =
        |words: &[String]| -> Vec<f64> { words.iter().map(|word| word.parse().unwrap()).collect() };
    let cameras = rows("cameras.txt");
    assert_eq!(cameras[0][..4], ["1", "PINHOLE", "640", "192"]);
    let [fx, fy, cx, cy] = numbers(&cameras[0][4..])[..] else { panic!("{cameras:?}") };
    let points = rows("points3D.txt");
    assert_eq!(points[0][4..7], ["10", "20", "30"]);
    let point: [f64; 3] = numbers(&points[0][1..4]).try_into().unwrap();
    let images = rows("images.txt");
    assert_eq!(images.len(), 6, "two lines an image");
    for (image, (name, pose)) in images.iter().step_by(2).zip(&scene.frames) {
        assert_eq!((&image[8], image[9].as_str()), (&"1".to_owned(), name.as_str()));
        let [w, i, j, k, x, y, z] = numbers(&image[1..8])[..] else { panic!("{image:?}") };
        let t_camera_world = Transform { rotation: [i, j, k, w], translation_m: [x, y, z] };
        let [x, y, z] = t_camera_world.transform_point(point);
        assert_near([cx + fx * x / z, cy + fy * y / z], expected_px(pose));
    }
}

#[test]
fn transforms_of_nerfstudio_project_their_points_to_their_pixels() {
    let (folder, scene) = (tempfile::TempDir::new().unwrap(), scene());
    nerfstudio::write(folder.path(), &scene).unwrap();
    let text = std::fs::read_to_string(folder.path().join("transforms.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let points = std::fs::read_to_string(folder.path().join("points.ply")).unwrap();
    assert!(points.contains("element vertex 1\n") && points.ends_with("1.5 -0.5 12 10 20 30\n"));
    for (frame, (name, pose)) in json["frames"].as_array().unwrap().iter().zip(&scene.frames) {
        assert_eq!(frame["file_path"], format!("images/{name}"));
        assert_eq!(frame["mask_path"], format!("masks/{name}"));
        let matrix = &frame["transform_matrix"];
        // The inverse of the camera's pose, which has x right, y up and looks along -z.
        let from_camera = |axis: usize| -> f64 {
            [1.5, -0.5, 12.0]
                .iter()
                .enumerate()
                .map(|(row, at)| (at - number(&matrix[row][3])) * number(&matrix[row][axis]))
                .sum()
        };
        let [x, y, z] = [0, 1, 2].map(from_camera);
        let found = [
            number(&json["cx"]) + number(&json["fl_x"]) * x / -z,
            number(&json["cy"]) - number(&json["fl_y"]) * y / -z,
        ];
        assert_near(found, expected_px(pose));
    }
}
