//! Files of the user's are never removed, replaced or written through a link, also if they stand
//! where the output is to go.

use super::binary::{dynvox, names, output_text, rig};
use std::fs;
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

/// Maps a small recording, which is made if it is not there yet, into `out`.
fn map(root: &Path, out: &str, more: &[&str]) -> Output {
    if !root.join("rig").exists() {
        rig(root, 2);
    }
    let args = ["run", "rig", "--quiet", "--profile", "tiny", "--out", out];
    dynvox(root, &[&args[..], more].concat())
}

fn assert_refused(run: &Output, sentence: &str) {
    assert_eq!(run.status.code(), Some(1), "{}", output_text(run));
    assert!(output_text(run).contains(sentence), "{}", output_text(run));
}

#[cfg(unix)]
#[test]
fn a_link_named_as_the_partial_folder_keeps_its_target() {
    let root = TempDir::new().unwrap();
    fs::create_dir_all(root.path().join("shared")).unwrap();
    fs::create_dir_all(root.path().join("victim")).unwrap();
    fs::write(root.path().join("victim/a"), "x").unwrap();
    let link = root.path().join("shared/.res.partial");
    std::os::unix::fs::symlink(root.path().join("victim"), link).unwrap();
    let run = map(root.path(), "shared/res", &[]);
    assert_refused(&run, "is in the way of a run to shared/res: it is a link");
    assert_eq!(fs::read_to_string(root.path().join("victim/a")).unwrap(), "x");
    assert_eq!(names(&root.path().join("victim")), ["a"]);
}

#[test]
fn a_folder_with_a_summary_of_someone_elses_is_not_overwritten() {
    let root = TempDir::new().unwrap();
    fs::create_dir(root.path().join("d")).unwrap();
    fs::write(root.path().join("d/summary.json"), "{\"mine\":1}").unwrap();
    fs::write(root.path().join("d/thesis.tex"), "x").unwrap();
    assert_refused(&map(root.path(), "d", &["--overwrite"]), "d is not a run folder");
    assert_eq!(names(&root.path().join("d")), ["summary.json", "thesis.tex"]);
    assert_eq!(names(root.path()), ["d", "rig"]);
}

#[test]
fn a_file_of_the_users_in_a_run_folder_stops_its_replacement_by_name() {
    let root = TempDir::new().unwrap();
    assert!(map(root.path(), "result", &[]).status.success());
    fs::write(root.path().join("result/pictures/mine.txt"), "x").unwrap();
    let run = map(root.path(), "result", &["--overwrite"]);
    assert_refused(&run, "result/pictures/mine.txt is in the folder result, but was not made by");
    fs::rename(root.path().join("result/pictures/mine.txt"), root.path().join("mine")).unwrap();
    let run = map(root.path(), "result", &["--overwrite"]);
    assert!(run.status.success(), "every other file is known: {}", output_text(&run));
    assert_eq!(names(root.path()), ["mine", "result", "rig"]);
}

#[test]
fn a_run_that_would_replace_what_it_reads_is_refused() {
    let root = TempDir::new().unwrap();
    fs::create_dir(root.path().join("own")).unwrap();
    rig(&root.path().join("own"), 2);
    fs::write(root.path().join("own/summary.json"), "{}").unwrap();
    let base = ["run", "--quiet", "--profile", "tiny", "--overwrite", "--out"];
    let run = |more: &[&str]| dynvox(root.path(), &[&base[..], more].concat());
    let before = names(&root.path().join("own"));
    assert_refused(&run(&["own", "own/rig"]), "own contains");
    assert_refused(&run(&["own/rig/out", "own/rig"]), "lies within");
    let saved = run(&["result", "own/rig", "--save-instances", "own/rig/masks"]);
    assert_refused(&saved, "own/rig/masks lies within");
    assert_eq!(names(&root.path().join("own")), before);
    assert_eq!(names(root.path()), ["own"]);
    // The settings of an earlier run, in the folder to be replaced.
    assert!(map(root.path(), "first", &[]).status.success());
    let run = map(root.path(), "first", &["--overwrite", "--config", "first/config.toml"]);
    assert_refused(&run, "first contains first/config.toml");
}
