//! The first minutes with the program: what it says of itself, and where results go.

use super::binary::{dynvox, names, output_text, rig};
use tempfile::TempDir;

#[test]
fn a_run_inside_a_recording_leaves_its_results_beside_it() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    let inside = root.path().join("rig");
    let run = dynvox(&inside, &["run", ".", "--profile", "tiny", "--quiet"]);
    assert!(run.status.success(), "{}", output_text(&run));
    assert_eq!(names(&inside), ["calib.txt", "left", "right"]);
    assert_eq!(names(&root.path().join("out")), ["rig-001"]);
    // A second one counts on, and a folder of the recording is inside it, too.
    let run = dynvox(&inside.join("left"), &["run", "..", "--profile", "tiny", "--quiet"]);
    assert!(run.status.success(), "{}", output_text(&run));
    assert_eq!(names(&root.path().join("out")), ["rig-001", "rig-002"]);
    // An output that was asked for is not moved.
    let asked = dynvox(&inside, &["run", ".", "--profile", "tiny", "--out", "here"]);
    assert_eq!(asked.status.code(), Some(1));
    assert!(output_text(&asked).contains("lies within"), "{}", output_text(&asked));
}

#[test]
fn the_bare_program_says_what_it_can_do_and_writes_nothing() {
    let root = TempDir::new().unwrap();
    let bare = dynvox(root.path(), &[]);
    assert!(bare.status.success() && names(root.path()).is_empty());
    let text = String::from_utf8(bare.stdout).unwrap();
    assert!(text.lines().count() < 24 && text.contains("dynvox demo"), "{text}");
}

#[test]
fn the_demo_leaves_its_folder_twice_and_ends_with_three_files_to_open() {
    let root = TempDir::new().unwrap();
    for _ in 0..2 {
        let demo = dynvox(root.path(), &["demo", "--frames", "1"]);
        assert!(demo.status.success(), "{}", output_text(&demo));
        assert_eq!(names(root.path()), ["dynvox-demo"]);
        let text = String::from_utf8(demo.stdout).unwrap();
        let last: Vec<&str> = text.lines().rev().take(3).collect();
        let words = |line: &&str| {
            line.split_whitespace().find(|word| word.contains('/')).map(str::to_owned)
        };
        for file in last.iter().map(|line| words(line).unwrap()) {
            assert!(root.path().join(&file).is_file(), "{file}");
        }
    }
    // What is not a run stays.
    std::fs::create_dir(root.path().join("mine")).unwrap();
    std::fs::write(root.path().join("mine/notes.txt"), "mine").unwrap();
    let refused = dynvox(root.path(), &["demo", "--frames", "1", "--out", "mine"]);
    assert!(!refused.status.success() && root.path().join("mine/notes.txt").is_file());
}
