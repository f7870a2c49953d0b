//! `dynvox diff` as a user meets it: one pixel, one stage, one setting, one frame fewer, and
//! folders that are none.

use super::binary::{dynvox, rig};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Four textured pairs of a plane, and a run of them named `clean`.
fn prepared() -> TempDir {
    let root = TempDir::new().unwrap();
    rig(root.path(), 4);
    run(root.path(), "clean", &[]);
    root
}

fn run(root: &Path, out: &str, more: &[&str]) {
    let output = dynvox(
        root,
        &[&["run", "rig", "--profile", "tiny", "--quiet", "--out", out], more].concat(),
    );
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Exit code and all output.
fn diff(root: &Path, args: &[&str]) -> (i32, String) {
    let output = dynvox(root, &[&["diff"], args].concat());
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    (output.status.code().unwrap(), text)
}

#[test]
fn one_bit_of_one_pixel_is_found_as_input_of_its_frame() {
    let root = prepared();
    // Threads change nothing.
    run(root.path(), "again", &["--threads", "2"]);
    let (code, output) = diff(root.path(), &["clean", "again"]);
    assert_eq!((code, output.as_str()), (0, "equal in all 4 frames\n"));
    let path = root.path().join("rig/left/002.png");
    let mut image = image::open(&path).unwrap().into_luma8();
    // The lowest bit of one grey level.
    image.get_pixel_mut(80, 40).0[0] ^= 1;
    image.save(&path).unwrap();
    run(root.path(), "dirty", &[]);
    let (code, output) = diff(root.path(), &["clean", "dirty"]);
    assert_eq!((code, output.lines().next()), (1, Some("first divergence: frame 2, input")));
    assert!(
        output.contains("\napart in frame 2: pose 0.0")
            && output.contains("\napart at most: pose 0.0"),
        "{output}"
    );
}

/// Changes one digest of a stage and expects `diff` to name the stage. The core's tests show that
/// one bit of a voxel, a match, a pose or a track changes the stage's digest.
#[test]
fn one_bit_of_a_stages_digest_names_the_stage() {
    let root = prepared();
    run(root.path(), "dirty", &[]);
    let csv = root.path().join("dirty/frames.csv");
    let clean = fs::read_to_string(&csv).unwrap();
    let table: Vec<Vec<&str>> = clean.lines().map(|line| line.split(',').collect()).collect();
    for stage in ["input", "stereo", "scene_flow", "egomotion", "tracking", "static_map", "objects"]
    {
        let column = table[0].iter().position(|name| *name == format!("{stage}_digest")).unwrap();
        let mut dirty: Vec<Vec<String>> =
            table.iter().map(|row| row.iter().map(|&cell| cell.to_owned()).collect()).collect();
        let cell = &mut dirty[3][column];
        // No car drives through these images: an object's digest is one too many.
        *cell = match u64::from_str_radix(cell, 16) {
            Ok(digest) => format!("{:016x}", digest ^ 1 << 40),
            Err(_) => "7:0000010000000000".to_owned(),
        };
        let lines: Vec<String> = dirty.iter().map(|row| row.join(",") + "\n").collect();
        fs::write(&csv, lines.concat()).unwrap();
        let (code, output) = diff(root.path(), &["clean", "dirty"]);
        let named = if stage == "objects" { "object 7" } else { stage };
        assert_eq!(
            (code, output.lines().next()),
            (1, Some(format!("first divergence: frame 2, {named}").as_str()))
        );
    }
}

#[test]
fn a_setting_is_named_beside_the_stage_it_reaches_first() {
    let root = prepared();
    run(root.path(), "coarse", &["--set", "volume.voxel_size_m=0.1"]);
    let (code, output) = diff(root.path(), &["clean", "coarse"]);
    assert_eq!(code, 1);
    assert!(
        output.contains("setting volume.voxel_size_m: 0.05 in clean, 0.1 in coarse"),
        "{output}"
    );
    assert!(
        output.contains("\nfirst divergence: frame 0, static_map\napart in frame 0: "),
        "{output}"
    );
    // The first frame has no matches, so that the second is the first to differ.
    run(root.path(), "sparse", &["--set", "scene_flow.bucket_matches=1"]);
    let (code, output) = diff(root.path(), &["clean", "sparse"]);
    assert!(code == 1 && output.contains("\nfirst divergence: frame 1, scene_flow\n"), "{output}");
}

#[test]
fn a_shorter_run_is_the_beginning_of_a_longer_one() {
    let root = prepared();
    run(root.path(), "short", &["--frames", "3"]);
    let (code, output) = diff(root.path(), &["clean", "short"]);
    assert_eq!(
        (code, output.as_str()),
        (1, "short is a prefix of clean: equal in all its 3 frames, 1 more follow\n")
    );
    assert_eq!(diff(root.path(), &["clean", "short", "--shared"]).0, 0);
    run(root.path(), "first", &["--frames", "1"]);
    run(root.path(), "rest", &["--start", "1"]);
    let (code, output) = diff(root.path(), &["first", "rest"]);
    assert!(code == 2 && output.contains("the runs share no frame"), "{output}");
}

#[test]
fn what_is_no_run_folder_or_an_old_or_damaged_one_is_told_with_what_to_do() {
    let root = prepared();
    let trouble = |name: &str, sentence: &str| {
        let (code, output) = diff(root.path(), &["clean", name]);
        assert!(code == 2 && output.contains("error: ") && output.contains(sentence), "{output}");
    };
    trouble("rig", "rig is not a run folder: its frames.csv cannot be read");
    trouble("rig", "Give a folder that `dynvox run` wrote");
    trouble("nowhere", "nowhere is not a run folder");
    run(root.path(), "old", &[]);
    let csv = root.path().join("old/frames.csv");
    let text = fs::read_to_string(&csv).unwrap();
    fs::write(&csv, text.replace("stereo_digest", "other")).unwrap();
    trouble("old", "has no column stereo_digest: an older dynvox wrote it");
    // The last line lacks its end.
    fs::write(&csv, &text[..text.len() - 30]).unwrap();
    trouble("old", "line 5 cannot be read");
}
