//! Sources of the camera's motion: the depth tracker, a file of poses, and frames that are tracked
//! but not fused.

use super::binary::{dynvox, output_text};
use std::fs;
use std::process::Output;
use tempfile::TempDir;

#[test]
fn the_depth_tracker_tracks_a_slow_camera_and_reports_tracking_failures() {
    let root = TempDir::new().unwrap();
    let street = [
        "--set",
        "street.width=320",
        "--set",
        "street.height=96",
        "--set",
        "street.frames=5",
        "--set",
        "street.traffic.mode=none",
    ];
    let run = |speed: &str, more: &[&str]| {
        let speed = format!("street.speed_m_s={speed}");
        let args = [
            &[
                "run",
                "--profile",
                "small",
                "--out",
                "result",
                "--overwrite",
                "--egomotion",
                "icp",
                "--set",
                &speed,
            ],
            &street[..],
            more,
        ];
        let run = dynvox(root.path(), &args.concat());
        assert!(run.status.success(), "{}", output_text(&run));
        let read = |name: &str| fs::read_to_string(root.path().join("result").join(name)).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&read("summary.json")).unwrap();
        let csv = read("frames.csv");
        let at =
            csv.lines().next().unwrap().split(',').position(|column| column == "motion").unwrap();
        let motions = csv
            .lines()
            .skip(1)
            .map(|line| line.split(',').nth(at).unwrap().to_owned())
            .collect::<Vec<_>>();
        (
            summary["egomotion"].clone(),
            motions,
            String::from_utf8_lossy(&run.stdout).into_owned(),
            read("report.html"),
        )
    };
    // Disparities that are smoothed twice make the tracker less accurate (decision 43).
    let (slow, motions, ..) = run("0.4", &["--quiet", "--set", "stereo.adaptive_mean=1"]);
    assert_eq!(
        (&slow["source"], &slow["status"], &slow["tracking_failures"]),
        (&"icp".into(), &"ok".into(), &0.into())
    );
    assert_eq!(motions, ["first", "tracked", "tracked", "tracked", "tracked"]);
    assert!(slow["ate_m"].as_f64().unwrap() < 0.05, "{slow}");
    // Nine metres a second are too fast for a tracker of depth.
    let (fast, motions, printed, report) = run("9", &[]);
    assert_eq!(fast["status"], "tracking failure");
    assert_eq!(
        fast["tracking_failures"],
        motions.iter().filter(|motion| motion.starts_with("tracking_failure_")).count()
    );
    assert_eq!(
        fast["first_failure"],
        motions.iter().position(|motion| motion.starts_with("tracking_failure_")).unwrap()
    );
    assert!(
        printed.contains("tracking failure") && printed.contains("--egomotion stereo"),
        "{printed}"
    );
    // The failure is in the page as well.
    assert!(report.contains("Tracking failure in"));
}

#[test]
fn poses_of_a_file_replace_egomotion_and_must_cover_the_frames() {
    let root = TempDir::new().unwrap();
    let street =
        ["street.width=320", "street.height=96", "street.frames=4", "volume.voxel_size_m=0.2"]
            .map(|set| ["--set", set])
            .concat();
    let street = [&street[..], &["--profile", "small", "--json"]].concat();
    let run = |out: &str, more: &[&str]| {
        dynvox(root.path(), &[&["run", "--out", out], &street[..], more].concat())
    };
    let summary = |output: Output| -> serde_json::Value {
        assert!(output.status.success(), "{}", output_text(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let stereo = summary(run("stereo", &[]));
    // Both formats of poses that a run writes can be given again.
    for file in ["trajectory_kitti.txt", "trajectory_tum.txt"] {
        let given = summary(run(file, &["--egomotion", &format!("file:stereo/{file}")]));
        assert_eq!(
            (&given["egomotion"]["source"], &given["egomotion"]["extrapolated_frames"]),
            (&"file".into(), &0.into())
        );
        let [there, here] =
            [&given, &stereo].map(|summary| summary["egomotion"]["ate_m"].as_f64().unwrap());
        assert!((there - here).abs() < 1e-9, "{there} {here}");
        let poses = fs::read_to_string(root.path().join("stereo").join(file)).unwrap();
        fs::write(
            root.path().join("short.txt"),
            poses.lines().take(3).collect::<Vec<_>>().join("\n"),
        )
        .unwrap();
        // A file that ends too early is refused before the run begins.
        let refused = run("x", &["--egomotion", "file:short.txt"]);
        assert!(
            !refused.status.success()
                && output_text(&refused).contains("frame 3")
                && output_text(&refused).contains("short.txt"),
            "{}",
            output_text(&refused)
        );
    }
    // Files and words that are no poses.
    fs::write(root.path().join("odd.txt"), "1 2 3\n").unwrap();
    assert!(
        output_text(&run("x", &["--egomotion", "file:odd.txt"])).contains("line 1 is not a pose")
    );
    assert!(
        output_text(&run("x", &["--egomotion", "file:nowhere.txt"]))
            .contains("nowhere.txt cannot be read")
    );
    assert!(
        output_text(&run("x", &["--egomotion", "imu"])).contains("one of stereo, icp, file:POSES")
    );
    assert!(!root.path().join("x").exists());
}

#[dynvox_needs::long]
#[test]
fn every_kth_frame_alone_is_fused_and_the_map_is_not_affected() {
    let root = TempDir::new().unwrap();
    let street = [
        "--set",
        "street.width=320",
        "--set",
        "street.height=96",
        "--set",
        "street.frames=5",
        "--profile",
        "small",
        "--json",
    ];
    let run = |every: &str| {
        let run = dynvox(
            root.path(),
            &[&["run", "--out", every, "--fuse-every", every, "--strict"], &street[..]].concat(),
        );
        assert!(run.status.success(), "{}", output_text(&run));
        let csv = fs::read_to_string(root.path().join(every).join("frames.csv")).unwrap();
        let header: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
        let column = |name: &str| header.iter().position(|column| *column == name).unwrap();
        let [motion, visible] = ["motion", "fuse_ms"].map(column);
        csv.lines()
            .skip(1)
            .map(|line| line.split(',').collect::<Vec<_>>())
            .map(|row| (row[motion].to_owned(), row[visible] != "0.0"))
            .collect::<Vec<_>>()
    };
    // The camera is tracked in every frame, the map fused in every second.
    let (all, second) = (run("1"), run("2"));
    assert!(all.iter().all(|(_, fused)| *fused));
    assert_eq!(
        second.iter().map(|(_, fused)| *fused).collect::<Vec<_>>(),
        [true, false, true, false, true]
    );
    assert!(
        second.iter().skip(1).all(|(motion, _)| motion == "estimated"),
        "the camera is tracked in every frame"
    );
    let refused =
        dynvox(root.path(), &[&["run", "--out", "x", "--fuse-every", "0"], &street[..]].concat());
    assert!(
        output_text(&refused).contains("mapper.fuse_every must be at least 1"),
        "{}",
        output_text(&refused)
    );
}
