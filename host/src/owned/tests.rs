//! Nothing foreign is emptied, replaced or removed, and no link is followed.

use super::*;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A folder with a file of the user's, and its content.
fn users(root: &Path, name: &str) -> std::path::PathBuf {
    let folder = root.join(name);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("thesis.tex"), "years of work").unwrap();
    folder
}

fn thesis(folder: &Path) -> String {
    fs::read_to_string(folder.join("thesis.tex")).unwrap_or_default()
}

#[test]
fn a_folder_without_a_marker_is_refused_and_keeps_its_files() {
    let root = TempDir::new().unwrap();
    let folder = users(root.path(), "d");
    for taken in [OwnedFolder::create(&folder), OwnedFolder::open(&folder)] {
        assert!(matches!(taken, Err(NotOwned::Foreign { .. })), "{taken:?}");
    }
    fs::write(folder.join(MARKER_FILE), "dynvox").unwrap();
    assert!(OwnedFolder::open(&folder).is_err(), "some other file of that name is no proof");
    assert_eq!(thesis(&folder), "years of work");
}

#[cfg(unix)]
#[test]
fn a_link_to_a_folder_is_neither_emptied_nor_written_through() {
    use std::os::unix::fs::symlink;
    let root = TempDir::new().unwrap();
    let victim = users(root.path(), "victim");
    let link = root.path().join("link");
    symlink(&victim, &link).unwrap();
    assert!(OwnedFolder::create(&link).is_err() && OwnedFolder::open(&link).is_err());
    // A folder of dynvox's own with a link instead of a part.
    let own = OwnedFolder::create(&root.path().join("own")).unwrap();
    create_folder(&own.path().join("objects")).unwrap();
    write(&own.path().join("objects/thesis.tex"), b"ours").unwrap();
    fs::remove_dir_all(own.path().join("objects")).unwrap();
    symlink(&victim, own.path().join("objects")).unwrap();
    assert!(write(&own.path().join("objects/new.ply"), b"").is_err(), "not through the link");
    assert!(remove_file(&own.path().join("objects/thesis.tex")).is_err());
    assert_eq!(own.foreign_entry().unwrap(), Some(own.path().join("objects")));
    assert!(own.remove().is_err());
    // A link in the place of a file, one without a target as well.
    for target in [victim.join("thesis.tex"), root.path().join("nowhere")] {
        let file = root.path().join("map.ply");
        symlink(&target, &file).unwrap();
        assert!(create_file(&file).is_err() && write_whole(&file, |_| Ok(())).is_err());
        assert!(replace_whole(&file, |_| Ok(())).is_err());
        fs::remove_file(&file).unwrap();
    }
    assert!(!root.path().join("nowhere").exists());
    assert_eq!(thesis(&victim), "years of work");
    assert_eq!(fs::read_dir(&victim).unwrap().count(), 1);
}

#[test]
fn only_files_of_the_ledger_are_removed() {
    let root = TempDir::new().unwrap();
    let mut own = OwnedFolder::create(&root.path().join("own")).unwrap();
    create_folder(&own.path().join("objects/deep")).unwrap();
    write(&own.path().join("objects/deep/7.ply"), b"ply").unwrap();
    write(&own.path().join("map.ply"), b"ply").unwrap();
    assert_eq!(own.foreign_entry().unwrap(), None);
    // A file that the user put there.
    fs::write(own.path().join("objects/notes.txt"), "mine").unwrap();
    assert_eq!(own.foreign_entry().unwrap(), Some(own.path().join("objects/notes.txt")));
    assert!(remove_file(&own.path().join("objects/notes.txt")).is_err());
    assert!(create_file(&own.path().join("objects/notes.txt")).is_err());
    let refused = own.remove().unwrap_err().to_string();
    // All of dynvox's own is gone, and the user's file is still there.
    assert!(refused.contains("notes.txt") && refused.contains("left alone"), "{refused}");
    assert!(!own.path().join("map.ply").exists());
    assert_eq!(fs::read_to_string(own.path().join("objects/notes.txt")).unwrap(), "mine");
    fs::remove_file(own.path().join("objects/notes.txt")).unwrap();
    own.clear().unwrap();
    own.remove().unwrap();
    assert!(!root.path().join("own").exists());
}

#[test]
fn another_name_of_a_file_keeps_its_content() {
    let root = TempDir::new().unwrap();
    let own = OwnedFolder::create(&root.path().join("own")).unwrap();
    let (map, backup) = (own.path().join("map.ply"), root.path().join("backup.ply"));
    write(&map, b"first").unwrap();
    fs::hard_link(&map, &backup).unwrap();
    write(&map, b"second").unwrap();
    assert_eq!(fs::read(&backup).unwrap(), b"first");
    assert_eq!(fs::read(&map).unwrap(), b"second");
}

#[test]
fn a_folder_that_took_the_place_of_another_is_left_alone() {
    let root = TempDir::new().unwrap();
    let path = root.path().join("own");
    let own = OwnedFolder::create(&path).unwrap();
    fs::rename(&path, root.path().join("elsewhere")).unwrap();
    let other = OwnedFolder::create(&path).unwrap();
    write(&path.join("map.ply"), b"of the other").unwrap();
    assert!(own.remove().unwrap_err().to_string().contains("took its place"));
    drop(other);
    assert_eq!(fs::read(path.join("map.ply")).unwrap(), b"of the other");
}

#[test]
fn a_file_that_was_there_is_not_replaced_by_one_written_whole() {
    let root = TempDir::new().unwrap();
    let path = root.path().join("cameras.toml");
    fs::write(&path, "mine").unwrap();
    let refused = write_whole(&path, |file| std::io::Write::write_all(file, b"new")).unwrap_err();
    assert!(refused.to_string().contains("left alone"), "{refused}");
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    replace_whole(&path, |file| std::io::Write::write_all(file, b"new")).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new", "a user may ask for it");
    fs::remove_file(&path).unwrap();
    write_whole(&path, |file| std::io::Write::write_all(file, b"new")).unwrap();
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 1, "no draft stays");
}

#[test]
fn drafts_of_dead_processes_go_and_those_of_living_ones_stay() {
    let root = TempDir::new().unwrap();
    let target = root.path().join("street");
    let living = DraftFolder::begin(&target).unwrap();
    // No process has its lock: it was dropped.
    let dead = root.path().join(".street.partial-1-1");
    drop(OwnedFolder::create(&dead).unwrap());
    // It has the name of a draft, and no marker.
    let foreign = users(root.path(), ".street.partial-2-1");
    let draft = DraftFolder::begin(&target).unwrap();
    assert!(living.path().is_dir() && !dead.exists());
    assert_eq!(thesis(&foreign), "years of work");
    write(&draft.path().join("a"), b"1").unwrap();
    draft.rename(&target).unwrap();
    drop(living);
    // The target and the user's folder are left.
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 2);
    assert!(OwnedFolder::open(&target).is_ok(), "the marker stays");
}

#[test]
fn an_output_around_or_inside_an_input_is_refused() {
    let root = TempDir::new().unwrap();
    let data = users(root.path(), "own/data");
    let inputs = [data.clone(), root.path().join("poses.txt")];
    for (output, relation) in [
        (root.path().join("own"), "contains"),
        (data.join("out/street"), "lies within"),
        (data.clone(), " is "),
        // A path with two dots in it.
        (root.path().join("own/../own"), "contains"),
        (root.path().join("poses.txt"), " is "),
    ] {
        let refused = check_overlap(&output, &inputs).unwrap_err().to_string();
        assert!(refused.contains(relation), "{refused}");
    }
    // Names that begin alike, and siblings.
    for output in ["own/data-2", "out", "own/out"] {
        assert!(check_overlap(&root.path().join(output), &inputs).is_ok(), "{output}");
    }
}

#[cfg(unix)]
#[test]
fn an_output_inside_an_input_is_refused_by_way_of_a_link_too() {
    let root = TempDir::new().unwrap();
    let data = users(root.path(), "data");
    std::os::unix::fs::symlink(&data, root.path().join("link")).unwrap();
    let refused = check_overlap(&root.path().join("link/out"), &[data]).unwrap_err();
    assert!(refused.to_string().contains("lies within"));
}
