//! A run asked for by a request gives the bits of the run that the command line starts.

use super::binary::{dynvox, output_text, rig};
use super::same_run::rows;
use dynvox::Request;
use dynvox::request::{Memory, Options, Source};
use dynvox::run::{Checkpoint, RunFolder, run};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Options of a small street whose objects are masked, as the command line has them.
const STREET: [&str; 12] = [
    "--profile",
    "tiny",
    "--instances",
    "exact",
    "--set",
    "street.width=160",
    "--set",
    "street.height=64",
    "--set",
    "street.frames=6",
    "--set",
    "volume.voxel_size_m=0.1",
];

/// The request of [`STREET`].
fn street() -> Request {
    let mut request = Request::default();
    request.bounds.memory = Memory::Profile("tiny".to_owned());
    request.masks.source = dynvox::input::masks::MaskChoice::Exact;
    request.settings.volume.voxel_size_m = 0.1;
    let street = request.settings.street_mut();
    (street.width, street.height, street.frames) = (160, 64, 6);
    request
}

/// Runs the binary in `root`.
fn commanded(root: &Path, args: &[&str]) {
    let run = dynvox(root, args);
    assert!(run.status.success(), "{args:?}: {}", output_text(&run));
}

/// Runs a request into the folder `name` of `root`.
fn asked(root: &Path, name: &str, request: &Request) {
    let folder = RunFolder::begin(&root.join(name), false).unwrap();
    run(request.resolve().unwrap(), &folder, None).unwrap();
    folder.commit(&["map.blocks"]).unwrap();
}

/// Fails where frames, poses, tracks, blocks or meshes of two runs differ.
fn assert_same_bits(root: &Path, a: &str, b: &str) {
    let [a, b] = [a, b].map(|name| root.join(name));
    assert_eq!(rows(&a), rows(&b));
    for name in ["map.ply", "trajectory_kitti.txt", "trajectory_tum.txt", "tracks.csv"] {
        assert!(fs::read(a.join(name)).unwrap() == fs::read(b.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn a_run_by_request_has_the_bits_of_the_command_line() {
    let root = TempDir::new().unwrap();
    commanded(root.path(), &[&["run", "--quiet", "--out", "commanded"][..], &STREET].concat());
    asked(root.path(), "asked", &street());
    assert_same_bits(root.path(), "commanded", "asked");
}

#[test]
fn keywords_of_python_ask_for_the_run_of_the_command_line() {
    let keywords = json!({
        "profile": "tiny",
        "instances": "exact",
        "set": {
            "street.width": 160, "street.height": 64, "street.frames": 6,
            "volume.voxel_size_m": 0.1,
        },
    });
    let options: Options = serde_json::from_value(keywords).unwrap();
    assert_eq!(options.request().unwrap(), street());
}

#[test]
fn a_snapshot_of_the_command_line_is_resumed_by_its_request() {
    let root = TempDir::new().unwrap();
    let path = |name: &str| root.path().join(name);
    rig(root.path(), 8);
    let args = ["run", "rig", "--profile", "tiny", "--quiet", "--out"];
    commanded(root.path(), &[&args[..], &["whole"]].concat());
    // The sixth frame is torn: the run ends there with a snapshot.
    fs::rename(path("rig/left/005.png"), path("away.png")).unwrap();
    fs::write(path("rig/left/005.png"), "torn").unwrap();
    let stopped = dynvox(root.path(), &[&args[..], &["cut", "--snapshot-every", "2"]].concat());
    assert_eq!(stopped.status.code(), Some(4), "{}", output_text(&stopped));
    // Repaired.
    fs::rename(path("away.png"), path("rig/left/005.png")).unwrap();

    let mut folder = RunFolder::reopen(&path("cut")).unwrap();
    let (checkpoint, damage) = Checkpoint::read(&folder).unwrap();
    assert!(damage.is_none());
    let request = checkpoint.manifest().request().clone();
    // Absolute, since a resumed run may be called from another folder.
    assert_eq!(request.input.source, Source::Recording(path("rig")), "from any folder");
    assert_eq!(request.storage.snapshot_every, Some(2));
    folder.check_target(checkpoint.manifest().overwrites()).unwrap();
    let record = run(request.resolve().unwrap(), &folder, Some(checkpoint)).unwrap();
    assert_eq!(record.frames.len(), 8);
    folder.commit(&["map.blocks", "run.snapshot", "run.snapshot.previous"]).unwrap();
    assert_same_bits(root.path(), "whole", "cut");
}

#[test]
fn a_job_of_a_fleet_has_the_bits_of_its_request() {
    let root = TempDir::new().unwrap();
    let quoted: Vec<String> = STREET.iter().map(|word| format!("{word:?}")).collect();
    let list = format!("[[recording]]\nname = \"it\"\narguments = [{}]\n", quoted.join(", "));
    fs::write(root.path().join("recordings.toml"), list).unwrap();
    commanded(root.path(), &["fleet", "plan", "recordings.toml", "--out", "jobs"]);
    commanded(root.path(), &["fleet", "run", "jobs"]);
    let jobs: Value =
        serde_json::from_slice(&fs::read(root.path().join("jobs/jobs.json")).unwrap()).unwrap();
    let job = &jobs["jobs"][0];
    let request: Request = serde_json::from_value(job["request"].clone()).unwrap();
    let mut expected = street();
    // What a fleet adds to a recording's own settings.
    expected.settings.volume.allocation_m = 64.0;
    expected.storage.keep_blocks = true;
    assert_eq!(request, expected, "far about surfaces for registration");

    // Three ways to one result: the request, the command, the fleet.
    asked(root.path(), "asked", &request);
    let words = ["run", "--quiet", "--keep-blocks", "--set", "volume.allocation_m=64", "--out"];
    commanded(root.path(), &[&words[..], &["commanded"], &STREET].concat());
    assert_same_bits(root.path(), "commanded", "asked");
    let of_fleet = format!("jobs/runs/{}", job["id"].as_str().unwrap());
    assert_same_bits(root.path(), "commanded", &of_fleet);
}

#[test]
fn a_point_of_a_sweep_has_the_bits_of_its_request() {
    let root = TempDir::new().unwrap();
    let sizes = ["--set", "street.width=160", "--set", "street.height=64"];
    let common = [&sizes[..], &["--profile", "tiny", "--frames", "4", "--quiet"]].concat();
    let words = ["sweep", "street", "--sweeps", "scale", "--scales", "80", "--out", "sweep"];
    commanded(root.path(), &[&words[..], &common].concat());
    let plan: Value =
        serde_json::from_slice(&fs::read(root.path().join("sweep/plan.json")).unwrap()).unwrap();
    let (key, request) = plan["runs"].as_object().unwrap().iter().next().unwrap();
    let request: Request = serde_json::from_value(request.clone()).unwrap();
    asked(root.path(), "asked", &request);
    // What a sweep adds, said on the command line.
    let words = ["run", "--scale", "0.8", "--instances", "exact", "--evaluate", "exact", "--out"];
    commanded(root.path(), &[&words[..], &["commanded"], &common].concat());
    assert_same_bits(root.path(), "commanded", "asked");
    let read = |path: String| -> Value {
        serde_json::from_slice(&fs::read(root.path().join(path)).unwrap()).unwrap()
    };
    let of_sweep = read(format!("sweep/runs/{key}.json"));
    assert_eq!(of_sweep["summary"]["digest"], read("commanded/summary.json".to_owned())["digest"]);
}
