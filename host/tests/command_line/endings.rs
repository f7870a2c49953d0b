//! A run always ends as a run: what stops it, what was mapped until then is there, marked as
//! incomplete.

use super::binary::{dynvox, names, output_text, rig};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

const INCOMPLETE: Option<i32> = Some(4);

fn summary(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("summary.json")).unwrap()).unwrap()
}

/// Lines of a file.
fn lines(path: &Path) -> usize {
    fs::read_to_string(path).unwrap().lines().count()
}

/// The first `count` digests of frames.csv.
fn digests(folder: &Path, count: usize) -> Vec<String> {
    let csv = fs::read_to_string(folder.join("frames.csv")).unwrap();
    csv.lines().skip(1).take(count).map(|line| line.split(',').nth(2).unwrap().to_owned()).collect()
}

/// Truncates a picture of the rig.
fn truncate(root: &Path, name: &str) {
    let path = root.join("rig").join(name);
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len().min(5_000) / 2]).unwrap();
}

#[test]
fn an_unreadable_frame_ends_the_run_with_all_that_was_mapped() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 8);
    let args = ["run", "rig", "--profile", "tiny", "--quiet", "--out"];
    // A whole run to compare with.
    assert!(dynvox(root.path(), &[&args[..], &["whole"]].concat()).status.success());
    truncate(root.path(), "right/005.png");
    let run = dynvox(root.path(), &[&args[..], &["part"]].concat());
    let text = output_text(&run);
    assert_eq!(run.status.code(), INCOMPLETE, "{text}");
    assert!(
        text.contains("right/005.png cannot be read") && text.contains("--skip-bad-frames"),
        "{text}"
    );
    assert!(text.contains("What was mapped until then is in part"), "{text}");
    let part = root.path().join("part");
    // An incomplete run has every file that a complete one has.
    assert_eq!(names(&part), names(&root.path().join("whole")), "every file is there");
    let of = summary(&part);
    assert_eq!(
        (&of["incomplete"]["cause"], &of["incomplete"]["frames_left"]),
        (&"input".into(), &3.into()),
        "{of}"
    );
    assert_eq!(
        (&of["frames"], of["map"]["triangles"].as_u64() > Some(0)),
        (&5.into(), true),
        "{of}"
    );
    assert_eq!(lines(&part.join("trajectory_kitti.txt")), 5);
    // The frames before the damage are the same, bit for bit.
    assert_eq!(digests(&part, 5), digests(&root.path().join("whole"), 5));
    assert!(summary(&root.path().join("whole"))["incomplete"].is_null());
    assert!(fs::read_to_string(part.join("report.html")).unwrap().contains("Incomplete: "));

    // With the option the frame is left out, and the run goes on.
    let run = dynvox(root.path(), &[&args[..], &["skipped", "--skip-bad-frames"]].concat());
    assert!(run.status.success(), "{}", output_text(&run));
    let of = summary(&root.path().join("skipped"));
    assert_eq!((&of["frames"], &of["input"]["skipped"]["count"]), (&7.into(), &1.into()), "{of}");
    assert_eq!(of["input"]["skipped"]["first"][0]["frame"], 5);
    assert!(of["incomplete"].is_null());
    assert_eq!(names(root.path()), ["part", "rig", "skipped", "whole"]);
}

#[test]
fn a_run_of_which_no_frame_can_be_mapped_is_an_error_and_leaves_nothing() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    truncate(root.path(), "right/000.png");
    let args = ["run", "rig", "--profile", "tiny", "--quiet", "--out", "result"];
    let run = dynvox(root.path(), &args);
    assert_eq!(run.status.code(), Some(1), "{}", output_text(&run));
    truncate(root.path(), "right/001.png");
    let run = dynvox(root.path(), &[&args[..], &["--skip-bad-frames"]].concat());
    assert_eq!(run.status.code(), Some(1), "{}", output_text(&run));
    assert!(output_text(&run).contains("error: frame 0 was refused"), "{}", output_text(&run));
    assert_eq!(names(root.path()), ["rig"]);
}

/// Starts a long street, sends the signal after its first line, and waits for its end.
#[cfg(unix)]
fn signalled(root: &Path, signal: &str, more: &[&str]) -> (Option<i32>, String) {
    let street = [
        "--set",
        "street.width=320",
        "--set",
        "street.height=96",
        "--set",
        "street.frames=2000",
        "--profile",
        "tiny",
    ];
    let mut run = Command::new(env!("CARGO_BIN_EXE_dynvox"))
        .args([&["run", "--out", "result"], &street[..], more].concat())
        .current_dir(root)
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut text = BufReader::new(run.stderr.take().unwrap()).lines().map(Result::unwrap);
    // Only then are the handlers set and the first frame is mapped.
    assert!(text.any(|line| line.starts_with("frame 1/2000")), "it is under way");
    let sent = Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let rest: Vec<String> = text.collect();
    (run.wait().unwrap().code(), rest.join("\n"))
}

/// Returns true if this process was started with SIGHUP ignored.
#[cfg(unix)]
fn ignores_hang_up() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let bits = ignored.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok());
    bits.unwrap_or(0) & 1 == 1
}

#[cfg(unix)]
#[test]
fn a_signal_ends_the_run_after_its_frame() {
    let all = [("-INT", "SIGINT"), ("-TERM", "SIGTERM"), ("-HUP", "SIGHUP")];
    // A program started by nohup ignores the last one, and so do the runs of this test then.
    let count = if ignores_hang_up() { 2 } else { 3 };
    for (signal, name) in all.into_iter().take(count) {
        let root = TempDir::new().unwrap();
        let (code, text) = signalled(root.path(), signal, &[]);
        assert_eq!(code, INCOMPLETE, "{text}");
        assert!(text.contains(&format!("the run was stopped by {name} after")), "{text}");
        let (result, of) = (root.path().join("result"), summary(&root.path().join("result")));
        let frames = of["frames"].as_u64().unwrap() as usize;
        // Stopped early, but not before the first frame.
        assert!((1..2000).contains(&frames), "{frames}");
        assert_eq!(
            (&of["incomplete"]["cause"], of["incomplete"]["frames_left"].as_u64()),
            (&"signal".into(), Some(2000 - frames as u64))
        );
        // A row for each frame, and a header.
        assert_eq!(
            (lines(&result.join("trajectory_tum.txt")), lines(&result.join("frames.csv"))),
            (frames, frames + 1)
        );
        assert!(
            result.join("map.ply").is_file()
                && !result.join("map.blocks").exists()
                && !result.join("run.snapshot").exists()
        );
        assert_eq!(names(root.path()), ["result"]);
    }
}

#[cfg(unix)]
#[test]
fn a_stopped_run_with_snapshots_has_results_and_can_be_resumed() {
    let root = TempDir::new().unwrap();
    let (code, text) = signalled(root.path(), "-INT", &["--snapshot-every", "100000"]);
    assert_eq!(code, INCOMPLETE, "{text}");
    assert!(text.contains("`dynvox run --resume result` resumes the run"), "{text}");
    let result = root.path().join("result");
    let frames = summary(&result)["frames"].as_u64().unwrap() as usize;
    // All that is needed to resume, and the results so far.
    assert!(
        ["map.ply", "map.blocks", "run.snapshot", "report.html"]
            .iter()
            .all(|file| result.join(file).is_file())
    );
    let before = fs::read(result.join("frames.csv")).unwrap();
    // A new run does not overwrite what can be resumed.
    let refused = dynvox(root.path(), &["run", "--out", "result"]);
    assert!(
        output_text(&refused).contains("an interrupted run to result has a snapshot"),
        "{}",
        output_text(&refused)
    );
    // One frame further, then the memory limit ends it again.
    let run =
        dynvox(root.path(), &["run", "--resume", "result", "--quiet", "--rss-limit-mib", "1"]);
    assert_eq!(run.status.code(), INCOMPLETE, "{}", output_text(&run));
    let of = summary(&result);
    assert_eq!(
        (&of["frames"], &of["incomplete"]["cause"]),
        (&(frames + 1).into(), &"memory".into()),
        "one frame further"
    );
    let after = fs::read_to_string(result.join("frames.csv")).unwrap();
    let known = String::from_utf8(before).unwrap();
    // The frames from before the interruption are unchanged.
    assert!(
        known
            .lines()
            .zip(after.lines())
            .skip(1)
            .all(|(a, b)| a.split(',').nth(2) == b.split(',').nth(2))
    );
    assert_eq!(names(root.path()), ["result"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_size_limit_loses_the_map_and_nothing_else() {
    let root = TempDir::new().unwrap();
    // 1 KiB blocks: the mesh outgrows the limit, what is kept for the last files does not.
    let script = format!(
        "ulimit -f 2600; exec {} run --out result --quiet --profile tiny --no-stream \
         --set street.width=320 --set street.height=96 \
         --set street.frames=12",
        env!("CARGO_BIN_EXE_dynvox")
    );
    let run = Command::new("bash").args(["-c", &script]).current_dir(root.path()).output().unwrap();
    let text = output_text(&run);
    assert_eq!(run.status.code(), INCOMPLETE, "{text}");
    let of = summary(&root.path().join("result"));
    assert_eq!(
        (&of["incomplete"]["cause"], &of["incomplete"]["missing"][0]),
        (&"disk".into(), &"map.ply".into()),
        "{of}"
    );
    assert_eq!(lines(&root.path().join("result/trajectory_kitti.txt")), 12);
    let files = names(&root.path().join("result"));
    assert!(
        !files
            .iter()
            .any(|name| name.ends_with(".faces") || name == "map.ply" || name == ".reserve"),
        "{files:?}"
    );
}
