//! Hands the linker the memory map of the board.

use std::{env, fs, path::PathBuf};

fn main() {
    println!("cargo:rerun-if-changed=link");
    // include_bytes! watches the file it names, cargo the name.
    for file in ["CLIP", "CONSTANTS", "DIGESTS"] {
        println!("cargo:rerun-if-env-changed=DYNVOX_{file}");
    }
    let target = |key: &str| env::var(format!("CARGO_CFG_TARGET_{key}")).unwrap_or_default();
    if target("ARCH") == "arm" && target("OS") == "none" {
        let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
        fs::copy("link/mps2-an500.x", out.join("memory.x"))
            .expect("the memory map is beside this file");
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
        println!("cargo:rustc-link-arg-bins=-Tlink/stack-sizes.x");
        println!("cargo:rustc-link-arg-bins=--nmagic");
    }
}
