//! A sweep as a user meets it: interrupted, resumed, divided into shares.

use super::binary::{dynvox, names, output_text};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;
use tempfile::TempDir;

const SWEEP: [&str; 24] = [
    "sweep",
    "street",
    "--sweeps",
    "prune-weight,scale,methods",
    "--weights",
    "0,1",
    "--scales",
    "100,50",
    "--prune-lag",
    "2",
    "--evaluation-delay",
    "3",
    "--profile",
    "small",
    "--frames",
    "6",
    "--set",
    "street.width=320",
    "--set",
    "street.height=96",
    "--set",
    "street.frames=6",
    "--quiet",
    "--out",
];

/// One of three frames.
const SMALL_SWEEP: [&str; 21] = [
    "sweep",
    "street",
    "--sweeps",
    "prune-weight",
    "--prune-lag",
    "1",
    "--evaluation-delay",
    "1",
    "--profile",
    "tiny",
    "--frames",
    "3",
    "--set",
    "street.width=192",
    "--set",
    "street.height=64",
    "--set",
    "street.frames=3",
    "--set",
    "volume.voxel_size_m=0.2",
    "--quiet",
];

/// The results in a sweep's folder, by name.
fn results(folder: &Path) -> Vec<PathBuf> {
    let list = fs::read_dir(folder.join("runs")).into_iter().flatten().flatten();
    let mut paths: Vec<_> = list
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "json"))
        .collect();
    paths.sort();
    paths
}

/// Begins a sweep in folder `out` of `root` and kills it once `count` results are there.
fn kill_after_results(root: &Path, args: &[&str], out: &str, count: usize) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_dynvox"))
        .args(args)
        .arg(out)
        .current_dir(root)
        .spawn()
        .unwrap();
    while results(&root.join(out)).len() < count && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Returns the content and time of a file, which tell whether a result was made anew.
fn made(path: impl AsRef<Path>) -> (Vec<u8>, SystemTime) {
    (fs::read(&path).unwrap(), fs::metadata(path).unwrap().modified().unwrap())
}

#[test]
fn a_killed_sweep_does_not_repeat_what_was_done() {
    let root = TempDir::new().unwrap();
    let args = [&SMALL_SWEEP[..], &["--weights", "0,1,2", "--out"]].concat();
    kill_after_results(root.path(), &args, "cut", 1);
    let before = results(&root.path().join("cut"));
    assert!((1..3).contains(&before.len()), "killed in the middle: {before:?}");
    // When each result was written.
    let kept: Vec<_> = before.iter().map(made).collect();
    let resumed = dynvox(root.path(), &[&args[..], &["cut"]].concat());
    assert!(resumed.status.success(), "{}", output_text(&resumed));
    assert_eq!(before.iter().map(made).collect::<Vec<_>>(), kept, "finished runs are not repeated");
    assert_eq!(results(&root.path().join("cut")).len(), 3, "three weights");
    assert_eq!(
        names(&root.path().join("cut")),
        ["plan.json", "prune-weight.csv", "report.html", "runs"]
    );
}

#[test]
fn shares_of_a_sweep_are_merged_to_the_tables_of_the_whole() {
    let root = TempDir::new().unwrap();
    let args = [&SMALL_SWEEP[..], &["--weights", "0,1", "--out"]].concat();
    let done = |args: &[&str]| {
        let run = dynvox(root.path(), args);
        assert!(run.status.success(), "{args:?}: {}", output_text(&run));
    };
    done(&[&args[..], &["alone"]].concat());
    for (machine, share) in [("1", "0/2"), ("2", "1/2")] {
        done(&[&args[..], &[machine, "--plan"]].concat());
        done(&["fleet", "run", machine, "--shard", share]);
        assert_eq!(results(&root.path().join(machine)).len(), 1);
    }
    // From the folders of the machines, without running anything.
    done(&["sweep", "--merge", "1", "2", "--out", "whole", "--quiet"]);
    let [whole, alone] = ["whole", "alone"]
        .map(|out| fs::read_to_string(root.path().join(out).join("prune-weight.csv")).unwrap());
    assert_eq!((whole.lines().count(), whole), (3, alone));
}

#[dynvox_needs::long]
#[test]
fn a_killed_sweep_resumes_and_merged_shares_equal_the_whole() {
    let root = TempDir::new().unwrap();
    let results = |out: &str| results(&root.path().join(out));
    kill_after_results(root.path(), &SWEEP, "cut", 2);
    let before = results("cut");
    assert!((2..7).contains(&before.len()), "killed in the middle: {before:?}");
    let kept: Vec<_> = before.iter().map(made).collect();
    let resumed = dynvox(root.path(), &[&SWEEP[..], &["cut"]].concat());
    assert!(resumed.status.success(), "{}", output_text(&resumed));
    assert_eq!(before.iter().map(made).collect::<Vec<_>>(), kept, "finished runs are not repeated");
    assert_eq!(results("cut").len(), 7, "two late, two scales, tracker, no objects and motion");
    assert_eq!(
        names(&root.path().join("cut")),
        ["methods.csv", "plan.json", "prune-weight.csv", "report.html", "runs", "scale.csv"]
    );
    assert!(
        names(&root.path().join("cut/runs")).iter().all(|name| name.ends_with(".json")),
        "only its result stays of a run"
    );
    for (machine, share) in [("1", "0/2"), ("2", "1/2")] {
        // Planned on each machine alike, and then each runs its share.
        let planned = dynvox(root.path(), &[&SWEEP[..], &[machine, "--plan"]].concat());
        assert!(
            planned.stdout.starts_with(b"7 jobs in ") && results(machine).is_empty(),
            "{}",
            output_text(&planned)
        );
        let run = dynvox(root.path(), &["fleet", "run", machine, "--shard", share]);
        assert!(run.status.success() && results(machine).len() >= 3, "{}", output_text(&run));
        let again = dynvox(root.path(), &["fleet", "run", machine, "--shard", share]);
        assert!(again.status.success() && again.stdout.is_empty(), "what is done is left alone");
        let status: serde_json::Value = serde_json::from_slice(
            &dynvox(root.path(), &["fleet", "status", machine, "--json"]).stdout,
        )
        .unwrap();
        let done = status
            .as_array()
            .unwrap()
            .iter()
            .filter(|job| job["state"] == "done" && job["bytes"].as_u64() > Some(1 << 20));
        assert_eq!(done.count(), results(machine).len(), "{status}");
    }
    // Runs of a sweep keep results, not maps.
    let merged = dynvox(root.path(), &["fleet", "resample", "1"]);
    assert!(output_text(&merged).contains("which keep no maps"), "{}", output_text(&merged));
    let merged = dynvox(root.path(), &["sweep", "--merge", "1", "2", "--out", "whole", "--quiet"]);
    assert!(merged.status.success(), "{}", output_text(&merged));
    for table in ["prune-weight.csv", "scale.csv", "methods.csv"] {
        let [whole, cut] = ["whole", "cut"]
            .map(|out| fs::read_to_string(root.path().join(out).join(table)).unwrap());
        assert_eq!(whole, cut, "{table}");
        assert!(
            // Every run has an accuracy, but those whose tracking failed.
            whole.lines().skip(1).all(|line| line
                .split(',')
                .nth_back(18)
                .is_some_and(|accuracy| accuracy.parse::<f64>().is_ok() || line.contains("ICP"))),
            "{whole}"
        );
    }
    let other = dynvox(root.path(), &[&SWEEP[..], &["cut", "--set", "volume.far_m=10"]].concat());
    assert!(
        !other.status.success() && output_text(&other).contains("belongs to another sweep"),
        "{}",
        output_text(&other)
    );
}
