//! Rendered data sets, as their archives unpack.

use super::*;

/// Files of a recording's folder.
fn write(path: PathBuf, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

/// Frames 0 to 3 as both cameras see them.
fn save_frames(path: impl Fn(u32, usize) -> PathBuf) {
    for at in 0..4 {
        pair(at).iter().enumerate().for_each(|(camera, image)| save(image, path(at, camera)));
    }
}

fn vkitti(variation: &Path) {
    save_frames(|at, camera| variation.join(format!("frames/rgb/Camera_{camera}/rgb_{at:05}.png")));
    write(
        variation.join("intrinsic.txt"),
        "frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]\n0 0 50.5 50.5 20 16\n0 1 50.5 50.5 20 16\n",
    );
    // The camera names forward: the world comes nearer.
    let row = |at: u32, camera: u32| format!("{at} {camera} 1 0 0 0 0 1 0 0 0 0 1 -{at} 0 0 0 1\n");
    let rows: String = (0..4).flat_map(|at| [row(at, 0), row(at, 1)]).collect();
    write(variation.join("extrinsic.txt"), &format!("frame cameraID r1,1 r1,2\n{rows}"));
}

#[test]
fn virtual_kitti_is_read_from_its_root_a_scene_and_a_variation() {
    let root = TempDir::new().unwrap();
    for variation in ["Scene01/clone", "Scene01/fog", "Scene20/clone"] {
        vkitti(&root.path().join(variation));
    }
    let opened = |path: &str, sequence: Option<&str>| {
        let sequence = sequence.map(str::to_owned);
        open(&root.path().join(path), &OpenOptions { sequence, ..OpenOptions::default() })
    };
    for (path, sequence) in [("", Some("Scene01/fog")), ("Scene01", Some("fog")), ("Scene20", None)]
    {
        let dataset = opened(path, sequence).unwrap();
        assert_eq!((dataset.len(), dataset.size()), (4, (40, 32)));
        let rig = dataset.rig();
        assert_eq!((rig.focal_px, rig.baseline_m), (50.5, 0.532_725), "{path}");
        assert_eq!(dataset.truth().unwrap()[3].translation_m, [0.0, 0.0, 3.0]);
    }
    let choice = opened("", None).err().unwrap().to_string();
    assert!(choice.contains("Scene01/clone, Scene01/fog, Scene20/clone"), "{choice}");
    // What is missing or wrong is named.
    let folder = root.path().join("Scene20/clone");
    write(folder.join("extrinsic.txt"), "0 0 2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1\n");
    let scaled = opened("Scene20", None).err().unwrap().to_string();
    assert!(scaled.contains("extrinsic.txt") && scaled.contains("no rotation"), "{scaled}");
    vkitti(&folder);
    fs::remove_file(folder.join("intrinsic.txt")).unwrap();
    let missing = opened("Scene20", None).err().unwrap().to_string();
    assert!(missing.contains("vkitti_2.0.3_textgt"), "{missing}");
}

#[test]
fn spring_has_a_camera_for_each_scene() {
    let root = TempDir::new().unwrap();
    for scene in ["0001", "0002"] {
        let scene = root.path().join(scene);
        let side = |camera: usize| ["left", "right"][camera];
        save_frames(|at, camera| {
            let side = side(camera);
            scene.join(format!("frame_{side}/frame_{side}_{:04}.png", at + 1))
        });
        write(scene.join("cam_data/intrinsics.txt"), "60.5 60.5 20 16\n61 61 20 16\n");
    }
    let sequence = Some("0002".to_owned());
    let options = OpenOptions { sequence, ..OpenOptions::default() };
    let dataset = open(root.path(), &options).unwrap();
    assert_eq!((dataset.len(), dataset.rig().focal_px, dataset.rig().baseline_m), (4, 60.5, 0.065));
    let scene = root.path().join("0001");
    assert_eq!(open(&scene, &OpenOptions::default()).unwrap().len(), 4);
    fs::write(scene.join("cam_data/intrinsics.txt"), "60.5 60.5\n").unwrap();
    let refused = refusal(&scene, None);
    assert!(refused.contains("intrinsics.txt") && refused.contains("--calibration"), "{refused}");
}

/// A calibration of DrivingStereo for images of a size.
fn driving_stereo_calibration(scale: f64) -> String {
    let [width, height] = [40.0, 32.0].map(|side| side * scale);
    let (focal, u, v) = (50.0 * scale, 20.0 * scale, 16.0 * scale);
    format!(
        "calib_time: 2018\nS_101: 99 99\nK_101: 1 0 0 0 1 0 0 0 1\nS_rect_101: {width} {height}\n\
         P_rect_101: {focal} 0 {u} 0 0 {focal} {v} 0 0 0 1 0\nP_rect_103: {focal} 0 {u} -{} 0 \
         {focal} {v} 0 0 0 1 0\n",
        0.5 * focal
    )
}

#[test]
fn driving_stereo_has_several_recordings_and_sizes() {
    let root = TempDir::new().unwrap();
    let names = ["2018-07-09-16-11-56", "2018-07-10-09-54-03"];
    for recording in names {
        let sides = ["train-left-image", "train-right-image"];
        save_frames(|at, camera| {
            let name = format!("{recording}_2018-07-10-23-59-59-{:03}.png", 200 * at + 5);
            root.path().join(sides[camera]).join(recording).join(name)
        });
        for (folder, scale) in [("full-image-calib", 2.0), ("half-image-calib", 1.0)] {
            let file = root.path().join(format!("train-calib/{folder}/{recording}.txt"));
            write(file, &driving_stereo_calibration(scale));
        }
    }
    let opened = |path: &Path, sequence: Option<&str>| {
        let sequence = sequence.map(str::to_owned);
        open(path, &OpenOptions { sequence, ..OpenOptions::default() })
    };
    assert_eq!(Layout::guess(root.path()).unwrap().name(), "drivingstereo");
    let dataset = opened(root.path(), Some(names[1])).unwrap();
    assert_eq!((dataset.len(), dataset.size()), (4, (40, 32)));
    assert_eq!((dataset.rig().focal_px, dataset.rig().baseline_m), (50.0, 0.5), "of this size");
    let midnight_ns = 1_531_267_200_000_000_000;
    assert_eq!(dataset.stamp_ns(3), Some(midnight_ns - 1_000_000_000 + 605_000_000));
    let choice = opened(root.path(), None).err().unwrap().to_string();
    assert!(choice.contains("2018-07-09-16-11-56, 2018-07-10-09-54-03"), "{choice}");
    // A weather's folder holds images without folders; calibrations lie above.
    let sunny = root.path().join("sunny");
    let sides = ["left-image-half-size", "right-image-half-size"];
    for (at, recording) in [(0, names[0]), (1, names[0]), (2, names[1])] {
        for (camera, image) in pair(at).iter().enumerate() {
            let name = format!("{recording}_2018-07-09-16-12-1{at}-770.png");
            save(image, sunny.join(sides[camera]).join(name));
        }
    }
    let dataset = opened(&sunny, Some(names[0])).unwrap();
    assert_eq!((dataset.len(), dataset.rig().baseline_m), (2, 0.5));
    fs::remove_dir_all(root.path().join("train-calib")).unwrap();
    let missing = opened(&sunny, Some(names[0])).err().unwrap().to_string();
    assert!(missing.contains("Fetch the calibrations") && missing.contains(names[0]), "{missing}");
}

#[test]
fn argoverse_prints_the_command_that_writes_its_calibration() {
    let root = TempDir::new().unwrap();
    let log = root.path().join("00a6ffc1");
    let sides = ["stereo_front_left", "stereo_front_right"];
    save_frames(|at, camera| {
        let time_ns = 315_966_265_259_836_000 + 50_000_000 * u64::from(at);
        // Its times have 18 digits.
        log.join("sensors/cameras").join(sides[camera]).join(format!("{time_ns}.png"))
    });
    assert_eq!(Layout::guess(root.path()).unwrap().name(), "argoverse");
    let refused = open(root.path(), &OpenOptions::default()).err().unwrap().to_string();
    assert!(
        refused.contains("pip install pandas") && refused.contains("read_feather"),
        "{refused}"
    );
    let matrix = "[[50, 0, 20], [0, 50, 16], [0, 0, 1]]";
    let rig = format!(
        r#"{{"image_width": 40, "image_height": 32, "M1": {matrix}, "D1": [0, 0, 0, 0, 0],
        "M2": {matrix}, "D2": [0, 0, 0, 0, 0], "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "T": [-0.5, 0, 0]}}"#
    );
    write(log.join("calibration/stereo.json"), &rig);
    for path in [root.path(), &log] {
        let dataset = open(path, &OpenOptions::default()).unwrap();
        assert_eq!((dataset.len(), dataset.rig().baseline_m), (4, 0.5));
        assert_eq!(dataset.stamp_ns(2), Some(315_966_265_359_836_000));
    }
}
