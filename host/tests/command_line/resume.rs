//! A run that was killed or failed resumes after its last snapshot, identical to an uninterrupted
//! one; another run is refused by name.

use super::binary::{dynvox, names, output_text, rig};
use super::same_run::{assert_same, summary};
use image::GrayImage;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// A street with traffic, detected and found by its motion, whose map outgrows its pool; with an
/// inertial unit.
const STREET: [&str; 20] = [
    "run",
    "--profile",
    "tiny",
    "--set",
    "street.width=320",
    "--set",
    "street.height=96",
    "--set",
    "street.frames=24",
    "--set",
    "street.inertial.rate_hz=100",
    "--set",
    "volume.voxel_size_m=0.05",
    "--set",
    "volume.prune_lag=6",
    "--set",
    "segmentation.enabled=true",
    "--instances",
    "exact",
    "--out",
];

/// Runs the binary until it prints `line`, and kills it there.
pub(super) fn killed_at(folder: &Path, args: &[&str], line: &str) {
    let mut run = Command::new(env!("CARGO_BIN_EXE_dynvox"))
        .args(args)
        .current_dir(folder)
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let output_text = BufReader::new(run.stderr.take().unwrap())
        .lines()
        .map(Result::unwrap)
        .find(|output_text| output_text.starts_with(line));
    // SIGKILL: the run cannot clean up.
    run.kill().unwrap();
    assert!(
        !run.wait().unwrap().success() && output_text.is_some(),
        "the run printed the line and was killed"
    );
}

#[test]
fn a_run_killed_three_times_equals_the_uninterrupted_run() {
    let root = TempDir::new().unwrap();
    let street = |out: &'static str, more: &[&'static str]| [&STREET[..], &[out], more].concat();
    assert!(dynvox(root.path(), &street("whole", &["--quiet", "--threads", "1"])).status.success());
    killed_at(
        root.path(),
        &street("stopped", &["--snapshot-every", "4", "--threads", "2"]),
        "frame 9/24",
    );
    assert!(!root.path().join("stopped").exists(), "not before the run is complete");
    // What a kill in the middle of writing leaves.
    let partial = root.path().join(".stopped.partial");
    fs::create_dir_all(partial.join("objects")).unwrap();
    let ledger = fs::OpenOptions::new().append(true).open(partial.join(".dynvox"));
    let mut ledger = ledger.unwrap();
    for torn in [".run.snapshot.partial", "objects/77.ply", ".map.faces.partial"] {
        std::io::Write::write_all(&mut ledger, format!("{torn}\n").as_bytes()).unwrap();
        fs::write(partial.join(torn), "torn").unwrap();
    }
    // Blocks that left after the last snapshot, and a torn one.
    fs::OpenOptions::new()
        .append(true)
        .open(partial.join("map.blocks"))
        .and_then(|mut file| std::io::Write::write_all(&mut file, &[7; 99]))
        .unwrap();
    // Rows that came after it, the last one torn.
    for table in
        ["blocks.csv", "frames.csv", "tracks.csv", "trajectory_kitti.txt", "trajectory_tum.txt"]
    {
        let file = fs::OpenOptions::new().append(true).open(partial.join(table));
        file.and_then(|mut file| std::io::Write::write_all(&mut file, b"8,0.8\n9,0.")).unwrap();
    }
    killed_at(root.path(), &["run", "--resume", "stopped"], "frame 18/24");
    let elsewhere = root.path().join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    // In the end, when the mesh is made; the last snapshot is that of the last frame.
    killed_at(&elsewhere, &["run", "--resume", "../stopped", "--threads", "1"], "frame 24/24");
    let last = dynvox(root.path(), &["run", "--resume", "stopped", "--json"]);
    assert!(last.status.success(), "{}", output_text(&last));
    assert!(
        serde_json::from_slice::<serde_json::Value>(&last.stdout).is_ok()
            && output_text(&last).is_empty()
    );
    assert_eq!(names(root.path()), ["elsewhere", "stopped", "whole"]);
    let of = summary(&root.path().join("whole"));
    assert!(
        of["evict"]["loaded"].as_u64().unwrap() > 0 && of["objects"].as_array().unwrap().len() > 2,
        "{of}"
    );
    assert!(!names(&root.path().join("whole/objects")).is_empty());
    // The number of threads is that of the last resumption.
    let path = root.path().join("stopped/summary.json");
    let threads = fs::read_to_string(&path).unwrap().replace("\"threads\": 2", "\"threads\": 1");
    fs::write(&path, threads).unwrap();
    assert_same(root.path(), "whole", "stopped");
}

/// A run of a stereo folder that fails at its sixth frame, after a snapshot of four.
fn stopped() -> TempDir {
    let root = TempDir::new().unwrap();
    rig(root.path(), 8);
    fs::write(root.path().join("settings.toml"), "[volume]\nvoxel_size_m = 0.08\n").unwrap();
    // A run without a stop, to compare with.
    let whole = dynvox(
        root.path(),
        &[
            "run",
            "rig",
            "--profile",
            "tiny",
            "--config",
            "settings.toml",
            "--quiet",
            "--out",
            "whole",
        ],
    );
    assert!(whole.status.success(), "{}", output_text(&whole));
    let image = root.path().join("rig/left/005.png");
    fs::rename(&image, root.path().join("005.png")).unwrap();
    // A picture of another size ends the run at its frame.
    GrayImage::new(50, 50).save(&image).unwrap();
    let args = [
        "run",
        "rig",
        "--profile",
        "tiny",
        "--config",
        "settings.toml",
        "--quiet",
        "--out",
        "out/it",
        "--snapshot-every",
        "2",
    ];
    let run = dynvox(root.path(), &args);
    assert_eq!(run.status.code(), Some(4));
    assert!(
        output_text(&run).contains("left/005.png is 50 x 50 px")
            && output_text(&run).contains("`dynvox run --resume out/it` resumes the run"),
        "{}",
        output_text(&run)
    );
    fs::rename(root.path().join("005.png"), &image).unwrap();
    assert_eq!(names(&root.path().join("out")), ["it"]);
    // Results so far, and what a resumption needs.
    let files = names(&root.path().join("out/it"));
    assert!(
        ["map.blocks", "map.ply", "run.snapshot", "summary.json"]
            .iter()
            .all(|name| files.iter().any(|file| file == name)),
        "{files:?}"
    );
    root
}

#[test]
fn a_run_that_failed_resumes_when_the_cause_is_repaired() {
    let root = stopped();
    let again = dynvox(root.path(), &["run", "rig", "--profile", "tiny", "--out", "out/it"]);
    assert!(
        output_text(&again).contains("an interrupted run to out/it has a snapshot"),
        "{}",
        output_text(&again)
    );
    let resumed = dynvox(root.path(), &["run", "--resume", "out/it", "--quiet"]);
    assert!(resumed.status.success(), "{}", output_text(&resumed));
    assert_same(root.path(), "whole", "out/it");
    // Once resumed to its end, there is nothing more to resume.
    let twice = dynvox(root.path(), &["run", "--resume", "out/it"]);
    assert!(
        output_text(&twice).contains("it has no snapshot: it is complete"),
        "{}",
        output_text(&twice)
    );
}

/// Resuming the run of [`stopped`] is refused with a sentence and changes nothing.
fn assert_refused(root: &TempDir, sentence: &str) {
    let snapshot = root.path().join("out/it/run.snapshot");
    let before = fs::read(&snapshot).unwrap();
    let run = dynvox(root.path(), &["run", "--resume", "out/it", "--quiet"]);
    assert_eq!(run.status.code(), Some(1));
    assert!(
        output_text(&run).starts_with("error: ") && output_text(&run).contains(sentence),
        "{sentence}: {}",
        output_text(&run)
    );
    assert_eq!(names(&root.path().join("out")), ["it"]);
    assert!(fs::read(&snapshot).unwrap() == before);
}

/// Asserts a refusal like [`assert_refused`], while the file `name` holds `bytes`.
fn assert_refused_with(root: &TempDir, name: &str, bytes: &[u8], sentence: &str) {
    let path = root.path().join(name);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, bytes).unwrap();
    assert_refused(root, sentence);
    fs::write(&path, whole).unwrap();
}

fn assert_resumes(root: &TempDir) {
    let resumed = dynvox(root.path(), &["run", "--resume", "out/it", "--quiet"]);
    assert!(resumed.status.success(), "{}", output_text(&resumed));
    assert_same(root.path(), "whole", "out/it");
}

#[test]
fn damaged_snapshots_and_stores_are_refused_by_name() {
    let root = stopped();
    let path = |name: &str| root.path().join(name);
    let snapshot = "out/it/run.snapshot";
    let whole = fs::read(path(snapshot)).unwrap();
    // Else the snapshot before would be taken.
    fs::remove_file(path("out/it/run.snapshot.previous")).unwrap();
    let refused =
        |bytes: &[u8], sentence: &str| assert_refused_with(&root, snapshot, bytes, sentence);
    let changed = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    // The version begins at byte 8.
    refused(b"P5 3 1 255", "is not a snapshot of a run");
    refused(&changed(8, 0), "is a snapshot of version 0; this dynvox takes version 9");
    // In the head, the manifest and the state, and at the end.
    for at in [15, 20, 30, 5_000, whole.len() / 2, whole.len() - 1] {
        refused(&changed(at, !whole[at]), "run.snapshot is damaged");
    }
    // A byte less, and one more.
    refused(&whole[..whole.len() - 1], "run.snapshot is damaged");
    refused(&[&whole[..], b"1"].concat(), "run.snapshot is damaged");
    let blocks = path("out/it/map.blocks");
    fs::rename(&blocks, path("blocks")).unwrap();
    assert_refused(&root, "map.blocks is missing");
    fs::rename(path("blocks"), &blocks).unwrap();
    assert_refused_with(
        &root,
        "out/it/map.blocks",
        b"dynvox",
        "map.blocks is not as the run left it",
    );
    for table in ["frames.csv", "tracks.csv", "trajectory_tum.txt"] {
        let known = fs::read(path(&format!("out/it/{table}"))).unwrap();
        if known.is_empty() {
            // No row yet.
            continue;
        }
        let sentence = format!("{table} is not as the run left it");
        // Cut in half, and changed in the first byte.
        assert_refused_with(
            &root,
            &format!("out/it/{table}"),
            &known[..known.len() / 2],
            &sentence,
        );
        assert_refused_with(
            &root,
            &format!("out/it/{table}"),
            &[b"#", &known[1..]].concat(),
            &sentence,
        );
    }
    assert_resumes(&root);
}

#[test]
fn a_run_whose_last_snapshot_is_damaged_resumes_from_the_one_before() {
    let root = stopped();
    let snapshot = root.path().join("out/it/run.snapshot");
    let whole = fs::read(&snapshot).unwrap();
    fs::write(&snapshot, &whole[..whole.len() - 9]).unwrap();
    let resumed = dynvox(root.path(), &["run", "--resume", "out/it", "--quiet"]);
    let text = output_text(&resumed);
    assert!(
        resumed.status.success()
            && text.contains("run.snapshot is damaged")
            && text.contains("The snapshot before it is taken"),
        "{text}"
    );
    assert_same(root.path(), "whole", "out/it");
}

#[dynvox_needs::long]
#[test]
fn objects_written_before_a_snapshot_are_checked() {
    let root = TempDir::new().unwrap();
    killed_at(
        root.path(),
        &[&STREET[..], &["stopped", "--snapshot-every", "4", "--threads", "2"]].concat(),
        "frame 24/24",
    );
    let objects = root.path().join(".stopped.partial/objects");
    let meshes: Vec<_> =
        // Meshes of objects that left before the snapshot.
        names(&objects).into_iter().filter(|name| name.ends_with(".ply")).collect();
    let first = objects.join(meshes.first().expect("an object has left"));
    let whole = fs::read(&first).unwrap();
    let refused = |sentence: &str| {
        let run = dynvox(root.path(), &["run", "--resume", "stopped", "--quiet"]);
        assert!(
            run.status.code() == Some(1) && output_text(&run).contains(sentence),
            "{sentence}: {}",
            output_text(&run)
        );
    };
    fs::remove_file(&first).unwrap();
    refused("is not as the run left it: it is missing");
    fs::write(&first, &whole[1..]).unwrap();
    refused("is not as the run left it: it is truncated or changed");
    fs::write(&first, whole).unwrap();
    let resumed = dynvox(root.path(), &["run", "--resume", "stopped", "--quiet"]);
    assert!(resumed.status.success(), "{}", output_text(&resumed));
}

#[test]
fn another_run_or_a_changed_data_set_is_refused_by_name() {
    let root = stopped();
    let path = |name: &str| root.path().join(name);
    // A snapshot has its own copy of the settings.
    fs::remove_file(path("settings.toml")).expect("a snapshot holds the settings themselves");
    let calibration = fs::read_to_string(path("rig/calib.txt"))
        .unwrap()
        .replace("baseline_m 0.5", "baseline_m 0.6");
    assert_refused_with(&root, "rig/calib.txt", calibration.as_bytes(), "the data set's rig was ");
    let mut pixels = image::open(path("rig/right/004.png")).unwrap().into_luma8();
    pixels.get_pixel_mut(80, 40).0[0] ^= 1;
    pixels.save(path("other.png")).unwrap();
    assert_refused_with(
        &root,
        "rig/right/004.png",
        &fs::read(path("other.png")).unwrap(),
        "frame 4 of the data set has changed",
    );
    let [last, away] = ["rig/left/007.png", "away.png"].map(path);
    fs::rename(&last, &away).unwrap();
    // One frame fewer, on both sides.
    fs::rename(path("rig/right/007.png"), path("away-right.png")).unwrap();
    assert_refused(&root, "the data set's number of frames was 8 and is 7");
    fs::rename(&away, &last).unwrap();
    fs::rename(path("away-right.png"), path("rig/right/007.png")).unwrap();
    for (args, sentence) in [
        (vec!["run", "--resume", "out/it", "--profile", "small"], "cannot be used with"),
        (vec!["run", "--resume", "nowhere"], "can be resumed: there is no such run"),
        (vec!["run", "--snapshot-every", "0", "--out", "x"], "--snapshot-every must be at least 1"),
        (vec!["run", "--snapshot-every", "9", "--evaluate", "exact"], "cannot be used with"),
    ] {
        let run = dynvox(root.path(), &args);
        assert!(
            !run.status.success() && output_text(&run).contains(sentence),
            "{args:?}: {}",
            output_text(&run)
        );
    }
    assert_resumes(&root);
}

#[test]
fn a_stopped_run_is_replaced_with_overwrite() {
    let root = stopped();
    let run = dynvox(
        root.path(),
        &[
            "run",
            "rig",
            "--profile",
            "tiny",
            "--quiet",
            "--frames",
            "2",
            "--out",
            "out/it",
            "--overwrite",
        ],
    );
    assert!(run.status.success(), "{}", output_text(&run));
    assert_eq!(names(&root.path().join("out")), ["it"]);
    assert!(!names(&root.path().join("out/it")).contains(&"run.snapshot".to_owned()));
}
