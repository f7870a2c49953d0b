//! SIGKILL at random moments of runs that stream blocks to disk and meet cars, also while they
//! resume: the finished run equals the one never killed.
//!
//! `DYNVOX_KILL_TRIALS` says how many runs are killed; every second one is killed again while it
//! resumes.
#![allow(missing_docs)]
#![cfg(unix)]

#[path = "command_line/binary.rs"]
mod binary;
#[path = "command_line/same_run.rs"]
mod same_run;

use binary::{dynvox, names, output_text};
use dynvox_core::random::Random;
use same_run::{assert_same, summary};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Runs that are killed where the environment does not say.
const TRIALS: u32 = 4;
/// A small street with traffic, found by exact masks, whose map outgrows its pool.
const STREET: [&str; 17] = [
    "run",
    "--profile",
    "tiny",
    "--set",
    "street.width=192",
    "--set",
    "street.height=64",
    "--set",
    "street.frames=16",
    "--set",
    "volume.voxel_size_m=0.06",
    "--set",
    "volume.prune_lag=4",
    "--instances",
    "exact",
    "--threads",
    "1",
];

/// Counts of the killed runs.
#[derive(Debug, Default)]
struct Counts {
    /// Killed before their end.
    killed: u32,
    /// Number of these that were killed again before their resumption ended.
    killed_again: u32,
    /// Had no snapshot yet, and were started again.
    started_again: u32,
}

/// Starts the binary without waiting for its end.
fn started(root: &Path, args: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_dynvox"))
        .args(args)
        .current_dir(root)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Sends SIGKILL, after which a run cannot clean up. Whether that ended it.
fn killed(mut run: Child) -> bool {
    run.kill().unwrap();
    run.wait().unwrap().signal().is_some()
}

/// Starts the binary and kills it after a while. Whether the kill ended it.
fn killed_after(root: &Path, args: &[&str], delay: Duration) -> bool {
    let run = started(root, args);
    std::thread::sleep(delay);
    killed(run)
}

/// Starts the binary and kills it as soon as it has written a file.
fn killed_once_written(root: &Path, args: &[&str], file: &Path) {
    let mut run = started(root, args);
    while !file.is_file() {
        assert!(run.try_wait().unwrap().is_none(), "the run ended without {}", file.display());
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(killed(run), "the run ended before it was killed");
}

/// Returns true if the killed run had come to its end, and removed what it no longer needed.
fn is_complete(root: &Path) -> bool {
    let folder = root.join("killed");
    folder.exists() && !names(&folder).iter().any(|name| name.starts_with("run.snapshot"))
}

/// Resumes the killed run, or starts it again where it had no snapshot, until it is complete.
fn complete(root: &Path, start: &[&str], counts: &mut Counts) {
    let resumed = dynvox(root, &["run", "--resume", "killed", "--quiet"]);
    if !resumed.status.success() {
        let text = output_text(&resumed);
        assert!(
            text.contains("there is no such run")
                || text.contains("it was interrupted before its first snapshot"),
            "{text}"
        );
        counts.started_again += 1;
        let again = dynvox(root, start);
        assert!(again.status.success(), "{}", output_text(&again));
    }
}

#[dynvox_needs::long("DYNVOX_KILL_TRIALS")]
#[test]
fn runs_killed_at_any_moment_equal_the_run_never_killed() {
    let trials = std::env::var("DYNVOX_KILL_TRIALS")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(TRIALS);
    let root = TempDir::new().unwrap();
    let root = root.path();
    let begin = Instant::now();
    let args = |out: &'static str| {
        [&STREET[..], &["--snapshot-every", "2", "--quiet", "--out", out]].concat()
    };
    assert!(dynvox(root, &args("whole")).status.success());
    // Kills come at any moment of a whole run.
    let longest = begin.elapsed();
    let of = summary(&root.join("whole"));
    // Blocks must leave and come back, and objects must leave, or the test would say little.
    assert!(
        of["evict"]["stored"].as_u64() > Some(0) && of["evict"]["loaded"].as_u64() > Some(0),
        "{of}"
    );
    assert!(of["objects"].as_array().unwrap().len() > 1, "{of}");
    let (mut random, mut counts) = (Random::new(17), Counts::default());
    let start = args("killed");
    let mut delay = || longest * random.below(1_000) / 1_000;
    while counts.killed < trials || counts.killed_again < trials / 2 {
        if !killed_after(root, &start, delay()) {
            // It had ended before the kill.
            std::fs::remove_dir_all(root.join("killed")).unwrap();
            continue;
        }
        counts.killed += 1;
        // Every second resumption is killed as well.
        if counts.killed_again < counts.killed / 2 {
            counts.killed_again +=
                u32::from(killed_after(root, &["run", "--resume", "killed", "--quiet"], delay()));
        }
        if !is_complete(root) {
            complete(root, &start, &mut counts);
        }
        assert_same(root, "whole", "killed");
        std::fs::remove_dir_all(root.join("killed")).unwrap();
        assert_eq!(names(root), ["whole"], "nothing is left over");
        println!("{counts:?}");
    }
}

#[dynvox_needs::long]
#[test]
fn a_run_killed_while_it_removes_its_snapshots_is_complete_once_resumed() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    let args = |out: &'static str| {
        [&STREET[..], &["--snapshot-every", "2", "--quiet", "--out", out]].concat()
    };
    assert!(dynvox(root, &args("whole")).status.success());
    let snapshot = root.join(".killed.partial/run.snapshot");
    killed_once_written(root, &args("killed"), &snapshot);
    // As if it had come to its end, and was killed when its store and its last snapshot were
    // removed.
    let kept = std::fs::read(&snapshot).unwrap();
    assert!(dynvox(root, &["run", "--resume", "killed", "--quiet"]).status.success());
    std::fs::write(root.join("killed/run.snapshot.previous"), kept).unwrap();
    assert!(!is_complete(root));
    let resumed = dynvox(root, &["run", "--resume", "killed"]);
    assert!(
        resumed.status.success() && output_text(&resumed).contains("was complete"),
        "{}",
        output_text(&resumed)
    );
    assert!(is_complete(root));
    assert_same(root, "whole", "killed");
}
