//! Bounds that a run needed: the least bounds hold the same run without a refusal, and smaller ones
//! do not.

use super::binary::{dynvox, output_text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A street with traffic, exact masks and no block on disk.
const STREET: [&str; 14] = [
    "run",
    "--quiet",
    "--no-stream",
    "--set",
    "street.width=320",
    "--set",
    "street.height=96",
    "--set",
    "street.frames=12",
    "--set",
    "volume.voxel_size_m=0.2",
    "--instances",
    "exact",
    "--overwrite",
];

fn run(root: &Path, out: &str, more: &[&str]) -> Value {
    let run = dynvox(root, &[&STREET[..], &["--out", out], more].concat());
    assert!(run.status.success(), "{}", output_text(&run));
    serde_json::from_slice(&fs::read(root.join(out).join("summary.json")).unwrap()).unwrap()
}

/// Returns the refusals of each bound.
fn refused(summary: &Value) -> Vec<(String, u64)> {
    let bounds = summary["capacity"]["bounds"].as_object().unwrap();
    bounds
        .iter()
        .map(|(name, of)| (name.clone(), of["refused"].as_u64().unwrap()))
        .filter(|(_, refused)| *refused > 0)
        .collect()
}

/// A stage's digest in each frame.
fn digests(folder: &Path, stage: &str) -> Vec<String> {
    let csv = fs::read_to_string(folder.join("frames.csv")).unwrap();
    let column = csv
        .lines()
        .next()
        .unwrap()
        .split(',')
        .position(|name| name == format!("{stage}_digest"))
        .unwrap();
    csv.lines().skip(1).map(|line| line.split(',').nth(column).unwrap().to_owned()).collect()
}

/// Blocks are voted on after six frames.
const LAG: [&str; 2] = ["--set", "volume.prune_lag=6"];

#[test]
fn the_least_bounds_hold_the_same_run() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    // First with bounds that are more than enough.
    let large = run(root, "large", &[&["--profile", "small"], &LAG[..]].concat());
    assert_eq!((refused(&large), &large["capacity"]["enough"]), (vec![], &true.into()), "{large}");
    let [least, slab] = [&large["capacity"]["least_bytes"], &large["slab_bytes"]]
        .map(|bytes| bytes.as_u64().unwrap());
    assert!(least < slab, "{least} of {slab}");
    // Then with the least bounds that this run needed, from its own file.
    fs::copy(root.join("large/capacity.toml"), root.join("least.toml")).unwrap();
    let again = run(root, "least", &[&["--capacity", "least.toml"], &LAG[..]].concat());
    assert_eq!((refused(&again), again["slab_bytes"].as_u64()), (vec![], Some(least)));
    // Where crops wait in their ring is in the digest of the tracks, so that one differs.
    for column in ["input", "stereo", "scene_flow", "egomotion", "static_map", "objects"] {
        assert_eq!(
            digests(&root.join("least"), column),
            digests(&root.join("large"), column),
            "{column}"
        );
    }
    let street = ["street.width=320", "street.height=96", "volume.voxel_size_m=0.2"]
        .map(|set| ["--set", set])
        .concat();
    // The console says how much would have been enough.
    let console = dynvox(
        root,
        &[
            &["run", "--capacity", "least.toml", "--frames", "2", "--instances", "exact"],
            &street[..],
        ]
        .concat(),
    );
    assert!(
        String::from_utf8_lossy(&console.stdout)
            .contains("MiB would have held this run without a refusal"),
        "{}",
        output_text(&console)
    );
}

#[dynvox_needs::long]
#[test]
fn one_fewer_of_each_bound_that_a_run_used_in_full_is_refused() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    run(root, "large", &[&["--profile", "small"], &LAG[..]].concat());
    let text = fs::read_to_string(root.join("large/capacity.toml")).unwrap();
    for name in ["features", "matches", "blocks", "visible_blocks", "mask_words", "tracks"] {
        let line = text.lines().find(|line| line.starts_with(&format!("{name} = "))).unwrap();
        let value: usize = line.rsplit(' ').next().unwrap().parse().unwrap();
        fs::write(
            root.join("fewer.toml"),
            // The bounds of the run that needed them, less one.
            text.replace(&format!("\n{line}\n"), &format!("\n{name} = {}\n", value - 1)),
        )
        .unwrap();
        let less = run(root, "less", &[&["--capacity", "fewer.toml"], &LAG[..]].concat());
        assert!(
            refused(&less).iter().any(|(refused, _)| refused == name),
            "{name}: {:?}",
            refused(&less)
        );
        assert_eq!(less["capacity"]["enough"], false);
        assert!(
            fs::read_to_string(root.join("less/capacity.toml"))
                .unwrap()
                .contains("# Something was refused")
        );
    }
}
