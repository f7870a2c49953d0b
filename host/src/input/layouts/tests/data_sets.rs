//! One recording in the layout of each data set, each with its own calibration and times.

use super::*;

/// Time of the first frame, ns.
const START_NS: u64 = 1_317_042_145_000_000_000;
/// From frame to frame, ns: 20 Hz.
const STEP_NS: u64 = 50_000_000;

fn write(path: PathBuf, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

/// Saves four frames; `path` names the file of a frame and a camera.
fn save_frames(path: impl Fn(u32, usize) -> PathBuf) {
    for at in 0..4 {
        pair(at).iter().enumerate().for_each(|(camera, image)| save(image, path(at, camera)));
    }
}

/// KITTI's calibration file with the keys of the raw data.
fn rectified_calibration() -> String {
    CALIB
        .replace("P0", "P_rect_00")
        .replace("P1", "P_rect_01")
        .replace("P2", "P_rect_02")
        .replace("P3", "P_rect_03")
}

/// The two cameras of a KITTI recording, with the images in `data` and the times as dates.
fn write_cameras(recording: &Path, data: &str) {
    save_frames(|at, camera| recording.join(format!("image_0{camera}/{data}/{at:010}.png")));
    let dates: String =
        (0..4).map(|at| format!("2011-09-26 13:02:25.{:09}\n", at * STEP_NS)).collect();
    ["image_00", "image_01"]
        .iter()
        .for_each(|camera| write(recording.join(camera).join("timestamps.txt"), &dates));
}

fn write_kitti_raw(root: &Path) {
    write(
        root.join("calib_cam_to_cam.txt"),
        &format!("calib_time: 09-Jan-2012\nS_rect_00: 40 32\n{}", rectified_calibration()),
    );
    write_cameras(&root.join("2011_09_26_drive_0001_sync"), "data");
}

fn write_kitti_360(root: &Path) {
    write(root.join("calibration/perspective.txt"), &rectified_calibration());
    write_cameras(&root.join("data_2d_raw/2013_05_28_drive_0000_sync"), "data_rect");
}

fn write_cityscapes(root: &Path) {
    let camera = r#"{"extrinsic": {"baseline": 0.5, "x": 1.7}, "intrinsic": {"fx": 50, "fy": 50.1, "u0": 20, "v0": 16}}"#;
    write(root.join("camera/train/aachen/aachen_000001_000002_camera.json"), camera);
    save_frames(|at, camera| {
        let folder = ["leftImg8bit", "rightImg8bit"][camera];
        root.join(format!("{folder}_sequence/train/aachen/aachen_000001_{at:06}_{folder}.png"))
    });
}

/// The right camera is a millisecond late.
fn write_euroc(root: &Path) {
    write(root.join("mav0/calib.txt"), CALIB);
    save_frames(|at, camera| root.join(format!("mav0/cam{camera}/data/{at}.png")));
    for (camera, late_ns) in [("cam0", 0), ("cam1", 1_000_000)] {
        let row = |at: u64| format!("{},{at}.png\r\n", START_NS + at * STEP_NS + late_ns);
        let table = format!("#timestamp [ns],filename\r\n{}", (0..4).map(row).collect::<String>());
        write(root.join("mav0").join(camera).join("data.csv"), &table);
    }
}

#[test]
fn every_data_set_gives_the_same_frames_rig_and_times() {
    type Write = fn(&Path);
    let layouts: [(Layout, Write); 4] = [
        (kitti_raw::KITTI_RAW, write_kitti_raw),
        (kitti_raw::KITTI_360, write_kitti_360),
        (cityscapes::DATA_SET, write_cityscapes),
        (euroc::DATA_SET, write_euroc),
    ];
    for (layout, write) in layouts {
        let root = TempDir::new().unwrap();
        write(root.path());
        assert_eq!(Layout::guess(root.path()).unwrap(), layout);
        let (found, sequences) = survey(root.path(), &OpenOptions::default()).unwrap();
        assert_eq!((found, sequences.len()), (layout, 1), "{layout:?}");
        let dataset = open(root.path(), &OpenOptions::default())
            .unwrap_or_else(|error| panic!("{layout:?}: {error}"));
        assert_eq!(
            (dataset.len(), dataset.size(), dataset.rig().focal_px, dataset.rig().baseline_m),
            (4, (40, 32), 50.0, 0.5),
            "{layout:?}"
        );
        for at in 0..4 {
            let frame = dataset.frame(at).unwrap();
            let expected = pair(at as u32).map(|image| image.into_raw());
            assert_eq!(
                [frame.left.pixels(), frame.right.pixels()],
                expected.each_ref().map(Vec::as_slice),
                "{layout:?} frame {at}"
            );
            let ns = if layout == cityscapes::DATA_SET {
                at as u64 * 1_000_000_000 / 17
            } else {
                START_NS + at as u64 * STEP_NS
            };
            assert_eq!(dataset.stamp_ns(at), Some(ns), "{layout:?} frame {at}");
        }
    }
}

#[test]
fn camera_files_of_cityscapes_that_are_none_are_refused() {
    let root = TempDir::new().unwrap();
    write_cityscapes(root.path());
    let camera = root.path().join("camera/train/aachen/aachen_000001_000002_camera.json");
    let text = fs::read_to_string(&camera).unwrap();
    let refused = || open(root.path(), &OpenOptions::default()).err().unwrap().to_string();
    for (from, to, words) in [
        ("\"baseline\": 0.5", "\"baseline\": 0", "not those of a stereo camera"),
        ("\"fx\": 50,", "", "missing field `fx`"),
    ] {
        fs::write(&camera, text.replace(from, to)).unwrap();
        let message = refused();
        assert!(message.contains(words) && message.contains("--calibration"), "{message}");
    }
    fs::remove_file(&camera).unwrap();
    let message = refused();
    assert!(message.contains("it has no camera file of aachen_000001"), "{message}");
}

#[test]
fn the_documentation_lists_every_data_set() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/inputs.md");
    let page = fs::read_to_string(page).unwrap();
    for layout in DATA_SETS {
        let row = format!("| `{}` |", layout.name());
        assert!(page.contains(&row), "docs/inputs.md lacks: {row}");
    }
}
