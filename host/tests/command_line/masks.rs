//! Moving objects without masks, and masks that are saved, taken again and compared.

use super::binary::{dynvox, names, output_text};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const STREET: [&str; 8] = [
    "--set",
    "street.width=640",
    "--set",
    "street.height=192",
    "--set",
    "street.frames=16",
    "--set",
    "volume.voxel_size_m=0.2",
];

fn street(root: &Path, out: &str, more: &[&str]) -> serde_json::Value {
    let run = dynvox(
        root,
        &[&["run", "--profile", "small", "--json", "--out", out], &STREET[..], more].concat(),
    );
    assert!(run.status.success(), "{}", output_text(&run));
    serde_json::from_slice(&run.stdout).unwrap()
}

#[test]
fn without_masks_what_moves_is_found_by_its_motion_and_reconstructed() {
    let root = TempDir::new().unwrap();
    let summary = street(root.path(), "auto", &["--save-instances", "saved"]);
    let objects = summary["objects"].as_array().unwrap();
    assert!(objects.iter().all(|object| object["class"] == "moving object"), "{objects:?}");
    assert!(objects.iter().any(|object| object["state"] == "dynamic"), "{objects:?}");
    assert!(!names(&root.path().join("auto/objects")).is_empty());
    // The street knows what moves.
    let masks = &summary["masks_truth"];
    let found: u64 = masks["ranges"]
        .as_array()
        .unwrap()
        .iter()
        .map(|range| range["found"].as_u64().unwrap())
        .sum();
    // No mask may be where nothing moves.
    assert!(
        found > 0 && masks["mean_iou"].as_f64() > Some(0.6) && masks["false_masks"] == 0,
        "{masks}"
    );
    let tracks = fs::read_to_string(root.path().join("auto/tracks.csv")).unwrap();
    let saved = names(&root.path().join("saved/motion"));
    // 16 frames.
    assert_eq!(saved.len(), 2 * 16, "a picture and a list a frame: {saved:?}");
    let rows = saved.iter().filter(|name| name.ends_with(".txt")).map(|name| {
        let list = fs::read_to_string(root.path().join("saved/motion").join(name)).unwrap();
        list.lines().filter(|line| line.contains(" moving object 0.9 ")).count()
    });
    // A row of the table is a mask of a frame.
    assert_eq!(rows.sum::<usize>(), tracks.lines().count() - 1, "each mask is a track's");
    assert_eq!(
        street(root.path(), "none", &["--frames", "4", "--instances", "none"])["objects"]
            .as_array()
            .map(Vec::len),
        Some(0)
    );
}

#[dynvox_needs::long]
#[test]
fn saved_masks_repeat_the_run_and_equal_themselves() {
    let root = TempDir::new().unwrap();
    let exact = street(
        root.path(),
        "exact",
        &["--frames", "6", "--instances", "exact", "--save-instances", "saved"],
    );
    let again = street(root.path(), "again", &["--frames", "6", "--instances", "files:saved"]);
    assert_eq!(exact["digest"], again["digest"]);
    let evaluate = |args: &[&str]| dynvox(root.path(), &[&["evaluate", "masks"], args].concat());
    let output = evaluate(&["saved", "saved", "--json"]);
    let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&figures["frames"], &figures["false_masks"]), (&6.into(), &0.into()));
    let truth = &figures["truth"][0];
    assert!(
        truth["masks"].as_u64() > Some(5)
            && truth["masks"] == truth["found"]
            && truth["mean_iou"] == 1.0,
        "{truth}"
    );
    assert!(String::from_utf8_lossy(&evaluate(&["saved", "saved"]).stdout).contains("6 frames; "));
    // Nothing was found by motion: exact masks were taken alone.
    let output = evaluate(&["saved/motion", "saved", "--json"]);
    let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (figures["found"].as_array().map(Vec::len), &figures["truth"][0]["found"]),
        (Some(0), &0.into())
    );
    fs::create_dir(root.path().join("empty")).unwrap();
    let refused = evaluate(&["empty", "saved"]);
    assert!(
        !refused.status.success() && output_text(&refused).contains("shares no picture's name"),
        "{}",
        output_text(&refused)
    );
    let refused = dynvox(
        root.path(),
        &[&["run", "--profile", "small", "--save-instances", "saved", "--out", "x"], &STREET[..]]
            .concat(),
    );
    assert!(
        !refused.status.success() && output_text(&refused).contains("saved exists"),
        "{}",
        output_text(&refused)
    );
    assert!(!root.path().join("x").exists(), "nothing half-written stays");
}
