//! What fails leaves nothing, what is finished stands whole.

use super::*;
use std::fs;
use tempfile::TempDir;

#[test]
fn an_abandoned_run_folder_leaves_nothing_and_a_finished_one_stands_whole() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("a/run");
    let folder = RunFolder::begin(&target, false).unwrap();
    fs::write(folder.file("x"), "1").unwrap();
    drop(folder);
    assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 0);
    let folder = RunFolder::begin(&target, false).unwrap();
    fs::write(folder.file("summary.json"), "{}").unwrap();
    assert!(!target.exists(), "not before it is whole");
    assert_eq!(folder.commit(&[]).unwrap(), target);
    assert!(RunFolder::begin(&target, false).unwrap_err().to_string().contains("--overwrite"));
    let folder = RunFolder::begin(&target, true).unwrap();
    fs::write(folder.file("summary.json"), "{2}").unwrap();
    drop(folder);
    assert_eq!(
        fs::read_to_string(target.join("summary.json")).unwrap(),
        "{}",
        "a failed run does not touch the one before"
    );
    let folder = RunFolder::begin(&target, true).unwrap();
    fs::write(folder.file("new"), "").unwrap();
    folder.commit(&[]).unwrap();
    assert!(target.join("new").exists() && !target.join("summary.json").exists());
    assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 1);
    assert!(
        RunFolder::begin(&target, true).unwrap_err().to_string().contains("is not a run folder"),
        "another's folder is left alone"
    );
}

#[test]
fn folders_without_a_name_are_numbered() {
    let root = TempDir::new().unwrap();
    assert!(RunFolder::next_name(root.path(), "street").ends_with("street-001"));
    fs::create_dir(root.path().join("street-001")).unwrap();
    assert!(RunFolder::next_name(root.path(), "street").ends_with("street-002"));
}

#[test]
fn a_folder_in_use_is_refused_to_a_second_run_and_to_a_resuming_one() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("run");
    let folder = RunFolder::begin(&target, false).unwrap();
    fs::write(folder.file("map.ply"), "half of it").unwrap();
    fs::write(folder.snapshot(), "").unwrap();
    for refused in [RunFolder::begin(&target, true), RunFolder::reopen(&target)] {
        assert!(refused.unwrap_err().to_string().contains("another run is writing to"));
    }
    assert_eq!(fs::read_to_string(folder.file("map.ply")).unwrap(), "half of it");
    drop(folder);
    assert!(RunFolder::reopen(&target).is_ok(), "the lock ends with its run");
}

#[test]
fn results_that_cannot_be_moved_stay_complete_where_they_are() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("run");
    let folder = RunFolder::begin(&target, false).unwrap();
    fs::write(folder.file("summary.json"), "{}").unwrap();
    let partial = folder.path().to_path_buf();
    // Something else took the name during the run.
    fs::create_dir(&target).unwrap();
    fs::write(target.join("foreign"), "").unwrap();
    let message = folder.commit(&[]).unwrap_err().to_string();
    assert!(
        message.contains(&partial.display().to_string()) && message.contains("Move the folder"),
        "{message}"
    );
    assert!(partial.join("summary.json").is_file() && target.join("foreign").is_file());
}

#[test]
fn what_an_earlier_crash_left_does_not_stop_a_replacement() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("run");
    let finished = |content: &str, overwrite: bool| {
        let folder = RunFolder::begin(&target, overwrite).unwrap();
        fs::write(folder.file("summary.json"), content).unwrap();
        folder.commit(&[]).unwrap();
    };
    finished("{1}", false);
    fs::create_dir(root.path().join(".run.replaced")).unwrap();
    fs::write(root.path().join(".run.replaced/a"), "").unwrap();
    finished("{2}", true);
    assert_eq!(fs::read_to_string(target.join("summary.json")).unwrap(), "{2}");
    assert!(root.path().join(".run.replaced/a").is_file(), "and it is left alone");
}

#[test]
fn the_current_directory_is_refused_before_the_first_frame() {
    let message = RunFolder::begin(Path::new("."), true).unwrap_err().to_string();
    assert!(message.contains("is the current directory"), "{message}");
}
