//! Settings, manifests, and what runs left: tables and meshes.

use super::texts::widened;
use super::{Bomb, Call, above};
use dynvox_core::random::Random;
use std::fs;
use std::path::Path;

const SETTINGS: &str = "at most 8 MiB of settings are read";

pub const KINDS: &[Bomb] = &[
    Bomb {
        name: "sparse settings",
        bound: SETTINGS,
        make: |to, r| sparse(to, r, "--config"),
    },
    Bomb {
        name: "sparse capacity",
        bound: SETTINGS,
        make: |to, r| sparse(to, r, "--capacity"),
    },
    Bomb { name: "settings of deep nesting", bound: "not TOML", make: nested },
    Bomb { name: "sparse list of recordings", bound: SETTINGS, make: recordings },
    Bomb { name: "sparse list of jobs", bound: "at most 32 MiB of a manifest", make: jobs },
    Bomb { name: "run folder with a sparse summary", bound: SETTINGS, make: summary },
    Bomb { name: "run folder with a sparse table", bound: "frames.csv", make: table },
    Bomb { name: "PLY header without an end", bound: "header", make: ply_header },
    Bomb { name: "PLY of many vertices", bound: "its header says", make: ply_counts },
];

fn sparse(root: &Path, random: &mut Random, option: &str) -> Call {
    widened(&root.join("s.toml"), random);
    Call::new(&["run", option, "s.toml", "--quiet"])
}

fn nested(root: &Path, random: &mut Random) -> Call {
    fs::write(root.join("s.toml"), format!("a = {}", "[".repeat(above(10_000, random) as usize)))
        .unwrap();
    Call::new(&["run", "--config", "s.toml", "--quiet"])
}

fn recordings(root: &Path, random: &mut Random) -> Call {
    widened(&root.join("list.toml"), random);
    Call::new(&["fleet", "plan", "list.toml", "--out", "fleet"])
}

fn jobs(root: &Path, random: &mut Random) -> Call {
    fs::create_dir(root.join("fleet")).unwrap();
    widened(&root.join("fleet/jobs.json"), random);
    Call::new(&["fleet", "run", "fleet"])
}

/// A folder with the files of a run.
fn run_folder(root: &Path, name: &str) {
    fs::create_dir(root.join(name)).unwrap();
    fs::write(root.join(name).join("frames.csv"), "frame,digest\n").unwrap();
    fs::write(root.join(name).join("config.toml"), "").unwrap();
    fs::write(root.join(name).join("summary.json"), "{}").unwrap();
}

fn summary(root: &Path, random: &mut Random) -> Call {
    run_folder(root, "a");
    run_folder(root, "b");
    widened(&root.join("a/summary.json"), random);
    Call::new(&["diff", "a", "b"])
}

fn table(root: &Path, random: &mut Random) -> Call {
    run_folder(root, "a");
    run_folder(root, "b");
    widened(&root.join("a/frames.csv"), random);
    Call::new(&["diff", "a", "b"])
}

fn ply(root: &Path, text: &str) -> Call {
    run_folder(root, "a");
    fs::write(root.join("a/map.ply"), text).unwrap();
    fs::write(root.join("a/trajectory_kitti.txt"), "").unwrap();
    Call::new(&["view", "a", "--no-open"])
}

fn ply_header(root: &Path, random: &mut Random) -> Call {
    let lines = "comment\n".repeat(above(10_000, random) as usize);
    ply(root, &format!("ply\nformat binary_little_endian 1.0\n{lines}"))
}

fn ply_counts(root: &Path, random: &mut Random) -> Call {
    let count = u64::MAX - u64::from(random.next_u32());
    ply(
        root,
        &format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\n\
             property float y\nproperty float z\nelement face {count}\n\
             property list uchar int vertex_indices\nend_header\n"
        ),
    )
}
