//! Compiles the attributes anew, and so the tests that have them, when the clips change or come
//! from another folder, and when long tests are asked for.

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=DYNVOX_DATA");
    println!("cargo::rerun-if-env-changed=DYNVOX_LONG");
    println!("cargo::rerun-if-env-changed=DYNVOX_KILL_TRIALS");
    println!("cargo::rerun-if-env-changed=PATH");
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("DYNVOX_DATA").map_or_else(beside, PathBuf::from);
    // A missing folder would count as changed at every build.
    if data.is_dir() {
        println!("cargo::rerun-if-changed={}", data.display());
    }
}
