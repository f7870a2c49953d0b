//! The binary, run in a folder, and what it left there.
#![allow(dead_code, reason = "the program that kills does not need all of it")]

use image::{GrayImage, Luma};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Calibration that [`rig`] writes.
pub const CALIB: &str = "focal_px 90\ncenter_u_px 79.5\ncenter_v_px 31.5\nbaseline_m 0.5\n";

/// Runs the binary in `folder`.
pub fn dynvox(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dynvox")).args(args).current_dir(folder).output().unwrap()
}

/// Returns what a command wrote to standard error.
pub fn output_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Names in the folder, hidden ones but the marker included, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name != ".dynvox")
        .collect();
    names.sort();
    names
}

/// A stereo folder with `frames` textured frames of a plane 4.5 m away: 10 px of disparity.
pub fn rig(root: &Path, frames: u32) {
    for (side, shift) in [("left", 0), ("right", 10)] {
        fs::create_dir_all(root.join("rig").join(side)).unwrap();
        for at in 0..frames {
            let texture =
                |u: u32, v: u32| {
                    Luma([((u / 3).wrapping_mul(2_654_435_761)
                        ^ (v / 3).wrapping_mul(40_503_777) >> 7) as u8])
                };
            let image = GrayImage::from_fn(160, 64, |u, v| texture(u + shift, v));
            image.save(root.join("rig").join(side).join(format!("{at:03}.png"))).unwrap();
        }
    }
    fs::write(root.join("rig/calib.txt"), CALIB).unwrap();
}
