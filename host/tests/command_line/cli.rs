//! The binary as a user meets it: exit codes, sentences, and nothing left behind when something is
//! wrong.

use super::binary::{CALIB, dynvox, names, output_text, rig};
use image::GrayImage;
use std::fs;
use std::process::Output;
use tempfile::TempDir;

#[test]
fn a_run_leaves_its_folder_and_json_alone_on_standard_output() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 3);
    let run =
        dynvox(root.path(), &["run", "rig", "--profile", "tiny", "--out", "result", "--json"]);
    assert!(run.status.success(), "{}", output_text(&run));
    assert_eq!(output_text(&run), "", "nothing but the summary");
    let summary: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(summary["frames"], 3);
    assert_eq!(summary["digest"].as_str().unwrap().len(), 16);
    for key in
        ["seconds", "fps", "slab_bytes", "stages", "egomotion", "map", "prune", "evict", "health"]
    {
        assert!(!summary[key].is_null(), "{key}");
    }
    assert!(summary["stages"]["stereo"]["cpu_median_ms"].as_f64().unwrap() > 0.0);
    let files = [
        "blocks.csv",
        "capacity.toml",
        "config.toml",
        "frames.csv",
        "map.glb",
        "map.ply",
        "pictures",
        "report.html",
        "summary.json",
        "tracks.csv",
        "trajectory_kitti.txt",
        "trajectory_tum.txt",
    ];
    assert_eq!(names(&root.path().join("result")), files);
    assert_eq!(names(root.path()), ["result", "rig"]);
    let csv = fs::read_to_string(root.path().join("result/frames.csv")).unwrap();
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert!(
        columns.len() == 4 && columns.iter().all(|count| *count == columns[0]),
        "one header, three rows, equal widths"
    );
    let report = fs::read_to_string(root.path().join("result/report.html")).unwrap();
    assert!(
        !report.contains("://") && report.contains("data:image/jpeg;base64,"),
        "one self-contained file"
    );
}

#[test]
fn digests_depend_neither_on_threads_nor_on_the_written_settings() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 3);
    let digests = |name: &str| -> Vec<String> {
        let csv = fs::read_to_string(root.path().join(name).join("frames.csv")).unwrap();
        csv.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().to_owned()).collect()
    };
    let base = ["run", "rig", "--profile", "tiny", "--quiet", "--out"];
    let with = |name: &str, more: &[&str]| {
        assert!(dynvox(root.path(), &[&base[..], &[name], more].concat()).status.success())
    };
    with("one", &["--threads", "1", "--set", "volume.voxel_size_m=0.08"]);
    with("two", &["--threads", "2", "--config", "one/config.toml"]);
    with("other", &["--threads", "2"]);
    assert_eq!(digests("one"), digests("two"));
    assert_ne!(digests("one"), digests("other"), "the setting matters, so the file was read");
}

#[test]
fn bad_input_fails_with_a_sentence_and_leaves_no_folder() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 3);
    let fails = |args: &[&str], sentence: &str| {
        let run = dynvox(root.path(), &[&["run"], args, &["--out", "result"]].concat());
        assert_eq!(run.status.code(), Some(1), "{args:?}");
        // Paths of a request are absolute; the sentences here begin at the folder of the test.
        let refusal = output_text(&run).replace(&format!("{}/", root.path().display()), "");
        assert!(refusal.contains("error: ") && refusal.contains(sentence), "{args:?}: {refusal}");
        assert_eq!(names(root.path()), ["rig"], "{args:?} left something behind");
    };
    let tiny = ["rig", "--profile", "tiny"];
    fails(&["nowhere"], "there is no data set at nowhere");
    fails(&["rig", "--profile", "huge"], "there is no profile huge");
    fails(&["rig", "--set", "volume.voxel=1"], "`volume.voxel`");
    fails(
        &["rig", "--profile", "tiny", "--set", "volume.voxel_size_m=-1"],
        "volume.voxel_size_m must be",
    );
    fails(&["rig", "--config", "missing.toml"], "missing.toml cannot be read");
    fails(&["rig", "--start", "3"], "leaves none of the 3 frames");
    fails(&["rig", "--scale", "0"], "--scale 0");
    fails(
        &["rig", "--profile", "tiny", "--set", "volume.prune_lag=65"],
        "profile tiny has a history of 64",
    );
    fails(&["rig", "--threads", "0"], "must be at least 1");
    // The first image is cut short.
    let image = root.path().join("rig/right/000.png");
    let bytes = fs::read(&image).unwrap();
    fs::write(&image, &bytes[..bytes.len() / 2]).unwrap();
    fails(&tiny, "right/000.png cannot be read");
    GrayImage::new(100, 64).save(&image).unwrap();
    fails(&tiny, "right/000.png is 100 x 64 px");
    fs::remove_file(&image).unwrap();
    fs::write(root.path().join("rig/calib.txt"), CALIB.replace("0.5\n", "0\n")).unwrap();
    fs::remove_file(root.path().join("rig/left/000.png")).unwrap();
    fails(&tiny, "the baseline is 0 m");
}

#[test]
fn images_too_large_for_the_profile_are_refused_with_what_would_fit() {
    let root = TempDir::new().unwrap();
    for side in ["left", "right"] {
        fs::create_dir_all(root.path().join("rig").join(side)).unwrap();
        GrayImage::new(640, 192).save(root.path().join("rig").join(side).join("0.png")).unwrap();
    }
    let calib = CALIB.replace("79.5", "320").replace("31.5", "96");
    fs::write(root.path().join("rig/calib.txt"), calib).unwrap();
    let run = dynvox(root.path(), &["run", "rig", "--profile", "tiny", "--force"]);
    assert!(
        output_text(&run).contains("do not fit profile tiny")
            && output_text(&run).contains("--profile small, or shrink the images with --scale 0.5")
    );
    assert!(
        output_text(&run).contains("desktop") && output_text(&run).contains("path, s"),
        "the table is shown"
    );
    let half = ["run", "rig", "--profile", "tiny", "--out", "result", "--scale", "0.5", "--quiet"];
    let refused = dynvox(root.path(), &half);
    assert_eq!(
        refused.status.code(),
        Some(3),
        "black images are refused: {}",
        output_text(&refused)
    );
    let forced = dynvox(root.path(), &[&half[..], &["--force"]].concat());
    assert!(forced.status.success(), "with --force they are mapped: {}", output_text(&forced));
}

#[test]
fn a_strict_run_ends_at_the_first_affected_frame_and_says_why() {
    let root = TempDir::new().unwrap();
    let street = [
        "--set",
        "street.width=320",
        "--set",
        "street.height=96",
        "--set",
        "street.frames=8",
        "--profile",
        "tiny",
        "--quiet",
    ];
    let run = |more: &[&str]| {
        dynvox(root.path(), &[&["run", "--out", "result"], &street[..], more].concat())
    };
    let strict = run(&["--strict", "--set", "volume.voxel_size_m=0.04"]);
    assert_eq!(strict.status.code(), Some(4));
    assert!(
        output_text(&strict).contains("frame 0: map affected: ")
            && output_text(&strict).contains("block requests refused"),
        "{}",
        output_text(&strict)
    );
    assert_eq!(names(root.path()), ["result"], "what was mapped is there");
    let full = run(&[
        "--overwrite",
        "--strict",
        "--set",
        "volume.voxel_size_m=0.2",
        "--instances",
        "exact",
    ]);
    assert!(output_text(&full).contains("objects refused"), "{}", output_text(&full));
    let coarse = ["--set", "volume.voxel_size_m=0.2", "--instances", "none"];
    assert!(
        run(&[&["--overwrite", "--strict"], &coarse[..]].concat()).status.success(),
        "no frame affects a map that fits"
    );
    let lenient = run(&["--overwrite", "--frames", "1"]);
    assert!(lenient.status.success(), "{}", output_text(&lenient));
}

#[dynvox_needs::long]
#[test]
fn a_full_disk_is_warned_of_once_and_counted_and_the_run_goes_on() {
    let root = TempDir::new().unwrap();
    let street = [
        "--set",
        "street.width=320",
        "--set",
        "street.height=96",
        "--set",
        "street.frames=48",
        "--set",
        "volume.voxel_size_m=0.1",
    ];
    let run = |out: &str, more: &[&str]| {
        let run = dynvox(
            root.path(),
            &[
                &["run", "--profile", "tiny", "--dynamic", "off", "--json", "--out", out],
                &street[..],
                more,
            ]
            .concat(),
        );
        assert!(run.status.success(), "{}", output_text(&run));
        (serde_json::from_slice::<serde_json::Value>(&run.stdout).unwrap(), output_text(&run))
    };
    let (kept, _) = run("kept", &["--keep-blocks"]);
    let (full, warning) = run("full", &["--stream-mib", "1"]);
    let (lost, _) = run("lost", &["--no-stream"]);
    assert!(
        kept["evict"]["stored"].as_u64() > Some(0) && kept["health"]["blocks_lost"] == 0,
        "{kept}"
    );
    assert_eq!(warning.matches("map.blocks cannot grow").count(), 1, "{warning}");
    assert!(
        full["health"]["blocks_lost"].as_u64() > Some(0)
            && full["health"]["disk_failure"].is_string()
    );
    assert!(full["evict"]["disk_bytes"].as_u64() <= Some(1 << 20));
    assert_eq!(full["health"]["worst_severity"], "map affected");
    assert_eq!(lost["evict"]["disk_records"], 0);
    assert!(lost["map"]["triangles"].as_u64() < full["map"]["triangles"].as_u64());
    assert!(full["map"]["triangles"].as_u64() < kept["map"]["triangles"].as_u64());
    assert!(names(&root.path().join("kept")).contains(&"map.blocks".to_owned()));
    assert!(!names(&root.path().join("full")).contains(&"map.blocks".to_owned()));
}

#[test]
fn more_resident_memory_than_allowed_ends_the_run_with_a_sentence() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    let run = dynvox(
        root.path(),
        &["run", "rig", "--profile", "tiny", "--quiet", "--out", "result", "--rss-limit-mib", "1"],
    );
    if cfg!(target_os = "linux") {
        assert_eq!(run.status.code(), Some(4));
        assert!(
            output_text(&run).contains("more than the 1048576 allowed")
                && output_text(&run).contains("--rss-limit-mib"),
            "{}",
            output_text(&run)
        );
    }
}

#[test]
fn an_existing_folder_is_replaced_only_when_asked() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    let args = ["run", "rig", "--profile", "tiny", "--quiet", "--out", "result"];
    assert!(dynvox(root.path(), &args).status.success());
    let again = dynvox(root.path(), &args);
    assert!(!again.status.success() && output_text(&again).contains("--overwrite"));
    assert!(dynvox(root.path(), &[&args[..], &["--overwrite"]].concat()).status.success());
    assert_eq!(names(root.path()), ["result", "rig"]);
    assert!(dynvox(root.path(), &args[..5]).status.success(), "without --out");
    assert_eq!(names(&root.path().join("out")), ["rig-001"]);
}

#[test]
fn a_written_street_is_mapped_as_a_kitti_folder() {
    let root = TempDir::new().unwrap();
    let small = ["--set", "street.width=160", "--set", "street.height=64"];
    let written =
        dynvox(root.path(), &[&["synth", "--out", "street", "--frames", "3"], &small[..]].concat());
    assert!(written.status.success(), "{}", output_text(&written));
    let masks = ["--instances", "files:street/sequences/00/instances"];
    let from_disk = dynvox(
        root.path(),
        &[
            &["run", "street", "--images", "colour", "--profile", "tiny", "--out", "a", "--json"],
            &masks[..],
        ]
        .concat(),
    );
    let settings = [&small[..], &["--set", "street.frames=3", "--instances", "exact"]].concat();
    let from_memory = dynvox(
        root.path(),
        &[&["run", "--profile", "tiny", "--out", "b", "--json"], &settings[..]].concat(),
    );
    let digest = |output: &Output| {
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()["digest"].clone()
    };
    assert_eq!(digest(&from_disk), digest(&from_memory), "PNG files lose nothing");
    let refused = dynvox(root.path(), &["synth", "--out", "x", "--set", "street.width=1"]);
    assert!(
        !refused.status.success()
            && output_text(&refused).contains("width")
            && !root.path().join("x").exists(),
        "{}",
        output_text(&refused)
    );
}

#[dynvox_needs::long]
#[test]
fn an_evaluation_against_scans_is_the_same_from_disk() {
    let root = TempDir::new().unwrap();
    let small = ["--set", "street.width=320", "--set", "street.height=96"];
    assert!(
        dynvox(root.path(), &[&["synth", "--out", "street", "--frames", "4"], &small[..]].concat())
            .status
            .success()
    );
    let printed = String::from_utf8(dynvox(root.path(), &["inspect", "street"]).stdout).unwrap();
    assert!(
        printed.contains("LiDAR scans of 4 frames")
            && printed.contains("dynvox run street --sequence 00 --evaluate lidar"),
        "{printed}"
    );
    let run = |args: &[&str]| {
        dynvox(root.path(), &[&["run", "--profile", "small", "--json"], args].concat())
    };
    let figures = |output: &Output| {
        assert!(output.status.success(), "{}", output_text(output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()["lidar"].clone()
    };
    let masks = ["--instances", "files:street/sequences/00/instances"];
    let from_disk = figures(&run(&[
        &["street", "--images", "colour", "--evaluate", "lidar", "--out", "a"],
        &masks[..],
    ]
    .concat()));
    let from_memory = figures(&run(&[
        &small[..],
        &["--set", "street.frames=4", "--instances", "exact", "--evaluate", "lidar", "--out", "b"],
    ]
    .concat()));
    for (source, key) in
        [("input", "accuracy"), ("input", "completeness"), ("fused", "f1"), ("fused", "points")]
    {
        let of = |figures: &serde_json::Value| figures["static"][source][key].as_f64().unwrap();
        assert!(
            (of(&from_disk) / of(&from_memory) - 1.0).abs() < 1e-3,
            "{source} {key}: {from_disk} {from_memory}"
        );
    }
    assert_eq!((&from_disk["frames"], &from_disk["source"]), (&4.into(), &"lidar".into()));
    let table = fs::read_to_string(root.path().join("a/lidar.csv")).unwrap();
    let columns: Vec<usize> = table.lines().map(|line| line.split(',').count()).collect();
    assert_eq!(columns, [16; 1 + 4 * 3 * 14], "a row for each frame, region and rule");
    let report = fs::read_to_string(root.path().join("a/report.html")).unwrap();
    assert!(report.contains("Evaluation against LiDAR") && report.contains("map against LiDAR"));
    // Exact depth is denser, and only the street has it; two frames later the first two are
    // evaluated.
    let settings = [
        &small[..],
        &[
            "--set",
            "street.frames=4",
            "--instances",
            "exact",
            "--evaluate",
            "exact",
            "--evaluation-delay",
            "2",
            "--out",
            "c",
        ],
    ]
    .concat();
    let exact = figures(&run(&settings));
    assert_eq!((&exact["frames"], &exact["delay_frames"]), (&2.into(), &2.into()));
    let points = |figures: &serde_json::Value| {
        figures["static"]["fused"]["points"].as_u64().unwrap() / figures["frames"].as_u64().unwrap()
    };
    assert!(points(&exact) > points(&from_disk), "{exact} {from_disk}");
    let refused = run(&["street", "--evaluate", "exact", "--out", "d"]);
    assert!(
        output_text(&refused).contains("only the synthetic street has exact depth"),
        "{}",
        output_text(&refused)
    );
    let refused = run(&["street", "--evaluate", "lidar", "--evaluation-delay", "9", "--out", "d"]);
    assert!(
        output_text(&refused).contains("--evaluation-delay 9 reaches beyond the last"),
        "{}",
        output_text(&refused)
    );
    // A broken scan matters only to an evaluation against scans.
    fs::write(root.path().join("street/sequences/00/velodyne/000001.bin"), [0; 17]).unwrap();
    assert!(run(&["street", "--images", "colour", "--out", "e"]).status.success());
    let refused = run(&["street", "--images", "colour", "--evaluate", "lidar", "--out", "f"]);
    assert!(
        output_text(&refused).contains("000001.bin")
            && output_text(&refused).contains("whole number of points"),
        "{}",
        output_text(&refused)
    );
    rig(root.path(), 2);
    let refused = run(&["rig", "--evaluate", "lidar", "--out", "g"]);
    assert!(
        output_text(&refused).contains("velodyne/") && !root.path().join("g").exists(),
        "{}",
        output_text(&refused)
    );
}

#[dynvox_needs::long]
#[test]
fn movers_are_separate_unless_masks_or_objects_are_off() {
    let root = TempDir::new().unwrap();
    let street = [
        "--set",
        "street.width=480",
        "--set",
        "street.height=144",
        "--set",
        "street.frames=16",
        "--set",
        "volume.voxel_size_m=0.1",
    ];
    let run = |out: &str, more: &[&str]| -> (serde_json::Value, Vec<String>) {
        let run = dynvox(
            root.path(),
            &[&["run", "--profile", "small", "--json", "--out", out], &street[..], more].concat(),
        );
        assert!(run.status.success(), "{}", output_text(&run));
        let tracks = fs::read_to_string(root.path().join(out).join("tracks.csv")).unwrap();
        (
            serde_json::from_slice(&run.stdout).unwrap(),
            tracks.lines().skip(1).map(ToOwned::to_owned).collect(),
        )
    };
    let (with, tracks) = run("with", &["--keep-blocks", "--instances", "exact"]);
    let objects = names(&root.path().join("with/objects"));
    let (meshes, paths): (Vec<&String>, Vec<&String>) =
        objects.iter().partition(|name| name.ends_with(".ply"));
    assert!(!tracks.is_empty() && !meshes.is_empty(), "{with}");
    assert_eq!(meshes.len(), paths.len(), "each mesh comes with its trajectory: {objects:?}");
    for name in paths.iter().filter(|name| name.ends_with("_kitti.txt")) {
        let path = fs::read_to_string(root.path().join("with/objects").join(name)).unwrap();
        assert!(
            !path.is_empty() && path.lines().all(|line| line.split(' ').count() == 13),
            "{name}: a frame and twelve numbers a line"
        );
    }
    for (out, option) in [("none", ["--instances", "none"]), ("off", ["--dynamic", "off"])] {
        let (without, tracks) = run(out, &option);
        assert_eq!(
            (tracks.len(), without["objects"].as_array().map(Vec::len)),
            (0, Some(0)),
            "{out}"
        );
        assert!(!names(&root.path().join(out)).contains(&"objects".to_owned()));
        assert!(
            without["map"]["triangles"].as_u64() > with["map"]["triangles"].as_u64(),
            "{out}: cars are part of the one map"
        );
    }
}

#[test]
fn a_closed_pipe_or_a_full_device_is_an_error_and_no_panic() {
    let root = TempDir::new().unwrap();
    for (device, sentence) in
        [("/dev/full", "standard output cannot be written"), ("/dev/null", "")]
    {
        let Ok(device) = fs::OpenOptions::new().write(true).open(device) else { continue };
        let args = ["budget", "--json"];
        let run = std::process::Command::new(env!("CARGO_BIN_EXE_dynvox"))
            .args(args)
            .current_dir(root.path())
            .stdout(device)
            .output()
            .unwrap();
        assert_eq!(
            run.status.code(),
            Some(i32::from(!sentence.is_empty())),
            "{}",
            output_text(&run)
        );
        assert!(
            output_text(&run).contains(sentence) && !output_text(&run).contains("panicked"),
            "{}",
            output_text(&run)
        );
    }
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_dynvox"))
        .arg("budget")
        .stdout(writer)
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(1), "{}", output_text(&run));
    assert!(
        output_text(&run).contains("standard output cannot be written")
            && !output_text(&run).contains("panicked"),
        "{}",
        output_text(&run)
    );
}

#[test]
fn more_threads_than_any_machine_has_are_refused() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    let run = dynvox(
        root.path(),
        &["run", "rig", "--profile", "tiny", "--threads", "100000", "--out", "result"],
    );
    assert_eq!(run.status.code(), Some(1));
    assert!(
        output_text(&run).contains("--threads 100000 is more than 256"),
        "{}",
        output_text(&run)
    );
}
