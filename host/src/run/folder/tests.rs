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
    assert_eq!(fs::read_to_string(target.join("summary.json")).unwrap(), "{}", "a failed run does not touch the one before");
    let folder = RunFolder::begin(&target, true).unwrap();
    fs::write(folder.file("new"), "").unwrap();
    folder.commit(&[]).unwrap();
    assert!(target.join("new").exists() && !target.join("summary.json").exists());
    assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 1);
    assert!(RunFolder::begin(&target, true).unwrap_err().to_string().contains("is not a run folder"), "another's folder is left alone");
}

#[test]
fn folders_are_numbered_when_nobody_names_them() {
    let root = TempDir::new().unwrap();
    assert!(RunFolder::next_name(root.path(), "street").ends_with("street-001"));
    fs::create_dir(root.path().join("street-001")).unwrap();
    assert!(RunFolder::next_name(root.path(), "street").ends_with("street-002"));
}
