//! Everything that reads bytes from outside, and the C interface, as fuzz targets: each takes any
//! bytes and may refuse them, but neither panics nor hangs nor takes memory that the bytes do not
//! pay for.
//!
//! The same targets run three ways: as seeded tests (`cargo test --test fuzz`, a fixed number of
//! mutations of valid inputs), for a given time
//! (`DYNVOX_FUZZ_SECONDS=1800 cargo test --release --test fuzz`), and under cargo-fuzz with
//! coverage (`tests/fuzz`).

mod calls;
mod containers;
mod files;
mod mapper;
mod mutate;
mod seeds;

pub use mutate::Mutator;

use dynvox_core::Capacity;

/// A reader that takes any bytes.
#[derive(Clone, Copy)]
pub struct Target {
    /// Name of the target, as `cargo fuzz run NAME` takes it.
    pub name: &'static str,
    /// Inputs that it takes.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Hands it bytes. Whether it took them.
    pub run: fn(&[u8]) -> bool,
}

/// All targets.
pub const TARGETS: [Target; 18] = [
    Target { name: "calibration", seeds: seeds::calibrations, run: files::calibration },
    Target { name: "poses", seeds: seeds::poses, run: files::poses },
    Target { name: "times", seeds: seeds::times, run: files::times },
    Target { name: "inertial", seeds: seeds::inertial, run: files::inertial },
    Target { name: "recording", seeds: seeds::recording, run: files::recording },
    Target { name: "pictures", seeds: seeds::pictures, run: files::pictures },
    Target { name: "depth", seeds: seeds::depth, run: files::depth },
    Target { name: "masks", seeds: seeds::masks, run: files::masks },
    Target { name: "store", seeds: seeds::store, run: files::store },
    Target { name: "stream", seeds: seeds::stream, run: files::stream },
    Target { name: "clip", seeds: seeds::clip, run: mapper::clip },
    Target { name: "snapshot", seeds: mapper::snapshots, run: mapper::snapshot },
    Target { name: "sealed_snapshot", seeds: mapper::snapshots, run: mapper::sealed_snapshot },
    Target { name: "bag", seeds: containers::bags, run: containers::bag },
    Target { name: "mesh", seeds: containers::meshes, run: containers::mesh },
    Target { name: "plan", seeds: containers::plans, run: containers::plan },
    Target { name: "settings", seeds: seeds::settings, run: mapper::settings },
    Target { name: "calls", seeds: calls::programs, run: calls::calls },
];

/// The sizes that bound a mapper, to be made any number.
pub fn sizes(of: &mut Capacity) -> [&mut usize; 19] {
    [
        &mut of.image_width,
        &mut of.image_height,
        &mut of.raw_width,
        &mut of.raw_height,
        &mut of.features,
        &mut of.matches,
        &mut of.blocks,
        &mut of.visible_blocks,
        &mut of.history_frames,
        &mut of.detections,
        &mut of.mask_words,
        &mut of.tracks,
        &mut of.objects,
        &mut of.object_blocks,
        &mut of.crop_pixels,
        &mut of.keyframes,
        &mut of.planning_width,
        &mut of.planning_length,
        &mut of.planning_height,
    ]
}

/// Hands bytes to the target of a name.
///
/// # Panics
/// No target has that name, or it has a fault.
pub fn run(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|target| target.name == name).expect("the target is listed");
    (target.run)(bytes);
}
