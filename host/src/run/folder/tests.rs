//! What fails leaves nothing, what is finished stands whole.

use super::*;
use std::fs;
use tempfile::TempDir;

#[test]
fn an_abandoned_run_folder_leaves_nothing_and_a_finished_one_stands_whole() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("a/run");
    let folder = RunFolder::begin(&target, false).unwrap();
    owned::write(&folder.file("x"), b"1").unwrap();
    drop(folder);
    assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 0);
    let folder = RunFolder::begin(&target, false).unwrap();
    owned::write(&folder.file("summary.json"), b"{}").unwrap();
    assert!(!target.exists(), "not before it is whole");
    assert_eq!(folder.commit(&[]).unwrap(), target);
    assert!(RunFolder::begin(&target, false).unwrap_err().to_string().contains("--overwrite"));
    let folder = RunFolder::begin(&target, true).unwrap();
    owned::write(&folder.file("summary.json"), b"{2}").unwrap();
    drop(folder);
    assert_eq!(
        fs::read_to_string(target.join("summary.json")).unwrap(),
        "{}",
        "a failed run does not touch the one before"
    );
    let folder = RunFolder::begin(&target, true).unwrap();
    owned::write(&folder.file("new"), b"").unwrap();
    folder.commit(&[]).unwrap();
    assert!(target.join("new").exists() && !target.join("summary.json").exists());
    assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 1);
    let foreign = target.join("thesis.tex");
    fs::write(&foreign, "years of work").unwrap();
    let refused = RunFolder::begin(&target, true).unwrap_err().to_string();
    assert!(refused.contains("thesis.tex") && refused.contains("not made by dynvox"), "{refused}");
    fs::remove_file(target.join(owned::MARKER_FILE)).unwrap();
    let refused = RunFolder::begin(&target, true).unwrap_err().to_string();
    assert!(refused.contains("is not a run folder: it has no marker"), "{refused}");
    assert_eq!(fs::read_to_string(&foreign).unwrap(), "years of work");
    assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 1, "no partial folder stays");
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
    owned::write(&folder.file("map.ply"), b"half of it").unwrap();
    owned::write(&folder.snapshot(), b"").unwrap();
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
    owned::write(&folder.file("summary.json"), b"{}").unwrap();
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
        owned::write(&folder.file("summary.json"), content.as_bytes()).unwrap();
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

#[test]
fn a_partial_folder_without_a_marker_is_refused_and_keeps_its_files() {
    let root = TempDir::new().unwrap();
    let partial = root.path().join(".run.partial");
    fs::create_dir(&partial).unwrap();
    fs::write(partial.join("thesis.tex"), "years of work").unwrap();
    for overwrite in [false, true] {
        let refused =
            RunFolder::begin(&root.path().join("run"), overwrite).unwrap_err().to_string();
        assert!(refused.contains("is in the way of a run to"), "{refused}");
    }
    assert_eq!(fs::read_to_string(partial.join("thesis.tex")).unwrap(), "years of work");
}

#[test]
fn a_partial_folder_of_a_dead_process_is_used_again() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("run");
    let dead = RunFolder::begin(&target, false).unwrap();
    owned::write(&dead.file("frames.csv"), b"rows").unwrap();
    let moved = root.path().join("moved");
    fs::rename(dead.path(), &moved).unwrap();
    drop(dead);
    fs::rename(&moved, root.path().join(".run.partial")).unwrap();
    let folder = RunFolder::begin(&target, false).unwrap();
    assert!(!folder.file("frames.csv").exists(), "a new run does not mix with it");
    drop(folder);
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
}

#[test]
fn earlier_results_that_a_killed_run_had_moved_away_come_back() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("run");
    let folder = RunFolder::begin(&target, false).unwrap();
    owned::write(&folder.file("summary.json"), b"{1}").unwrap();
    folder.commit(&[]).unwrap();
    fs::rename(&target, root.path().join(".run.replaced")).unwrap();
    let refused = RunFolder::begin(&target, false).unwrap_err().to_string();
    assert!(refused.contains("exists"), "{refused}");
    assert_eq!(fs::read_to_string(target.join("summary.json")).unwrap(), "{1}");
}

#[test]
fn results_that_were_not_moved_are_not_removed_unasked() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("run");
    let mut folder = RunFolder::begin(&target, false).unwrap();
    owned::write(&folder.file("frames.csv"), b"rows").unwrap();
    folder.release_last_reserve();
    folder.keep();
    drop(folder);
    let refused = RunFolder::begin(&target, false).unwrap_err().to_string();
    assert!(
        refused.contains("of an earlier run are in") && refused.contains(".run.partial"),
        "{refused}"
    );
    assert!(RunFolder::begin(&target, true).is_ok());
}

#[cfg(unix)]
#[test]
fn a_link_at_the_target_is_refused_before_the_first_frame() {
    let root = TempDir::new().unwrap();
    for leads_to in ["nowhere", "."] {
        let target = root.path().join("run");
        std::os::unix::fs::symlink(root.path().join(leads_to), &target).unwrap();
        for overwrite in [false, true] {
            let refused = RunFolder::begin(&target, overwrite).unwrap_err().to_string();
            assert!(refused.contains("is a link"), "{refused}");
        }
        fs::remove_file(target).unwrap();
    }
}

#[test]
fn a_run_has_disk_space_and_files_in_reserve_until_its_end() {
    let root = TempDir::new().unwrap();
    let folder = RunFolder::begin(&root.path().join("run"), false).unwrap();
    let held = || {
        let files = fs::read_dir(folder.path()).unwrap().map(Result::unwrap);
        let sizes: Vec<u64> = files
            .filter(|file| file.file_name().to_string_lossy().starts_with(".reserve"))
            .map(|file| file.metadata().unwrap().len())
            .collect();
        (sizes.len(), sizes.iter().sum::<u64>() >> 10)
    };
    assert_eq!(held(), (20, 2304));
    folder.release_reserve();
    assert_eq!(held(), (3, 256), "the summary's own, which no table may take");
    folder.release_last_reserve();
    assert_eq!(held(), (0, 0));
}
