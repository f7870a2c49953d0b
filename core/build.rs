//! Tells the core that the target has Arm's DSP extension.
//!
//! The compiler knows it as a target feature, which stable releases do not show to the code they
//! compile. The extension is a part of ARMv7E-M (Cortex-M4 and M7); for ARMv8-M, where it is an
//! option, the flags name a processor that has it or the feature itself.

use std::env;

/// Flags that choose the extension on an ARMv8-M target.
const FLAGS: [&str; 5] = [
    "target-cpu=cortex-m33",
    "target-cpu=cortex-m35p",
    "target-cpu=cortex-m55",
    "target-cpu=cortex-m85",
    "+dsp",
];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(dynvox_dsp)");
    let get = |key: &str| env::var(key).unwrap_or_default();
    let (target, flags) = (get("TARGET"), get("CARGO_ENCODED_RUSTFLAGS"));
    // Other targets of ARMv8-M are compiled for processors without it.
    let is_chosen =
        target.starts_with("thumbv8m.main") && FLAGS.iter().any(|flag| flags.contains(flag));
    if target.starts_with("thumbv7em") || is_chosen {
        println!("cargo:rustc-cfg=dynvox_dsp");
    }
}
