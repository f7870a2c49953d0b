//! `dynvox budget`.

use crate::report::html::grouped;
use dynvox_core::Capacity;
use dynvox_core::volume::{BLOCK_SIDE, VolumeConfig};
use std::fmt::Write;

/// Speed of the drive in the table, m/s.
const SPEED_M_S: f64 = 10.0;
/// Blocks a metre of the synthetic street leaves in the map (docs/measurements.md).
const BLOCKS_PER_M: u32 = 1_000;

#[derive(Debug, clap::Args)]
pub struct BudgetArgs {
    /// Show this profile region by region
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
}

pub fn run(args: &BudgetArgs) -> anyhow::Result<()> {
    match &args.profile {
        None => overview(),
        Some(name) => regions(name, &super::profile(name)?),
    }
    Ok(())
}

fn overview() {
    print!("{}", table(&VolumeConfig::default()));
    println!("\n`dynvox budget --profile NAME` shows a profile region by region.");
}

/// All profiles with what they hold.
pub fn table(volume: &VolumeConfig) -> String {
    let mut table = String::new();
    let _ = writeln!(
        table,
        "{:<10}{:>16}{:>10}{:>14}{:>10}{:>10}{:>10}{:>10}{:>8}{:>8}{:>10}",
        "profile", "slab, bytes", "MiB", "image, px", "blocks", "m3", "drive, s", "visible", "window", "matches", "colour"
    );
    let block_m = f64::from(volume.voxel_size_m) * BLOCK_SIDE as f64;
    for (name, capacity) in Capacity::PROFILES {
        let bytes = capacity.bytes();
        let _ = writeln!(
            table,
            "{name:<10}{:>16}{:>10.1}{:>14}{:>10}{:>10.0}{:>10}{:>10}{:>8}{:>8}{:>10}",
            grouped(bytes as u64),
            bytes as f64 / 1_048_576.0,
            format!("{} x {}", capacity.image_width, capacity.image_height),
            grouped(capacity.blocks as u64),
            capacity.blocks as f64 * block_m.powi(3),
            drive_s(capacity.blocks, volume).map_or_else(|| "-".to_owned(), |s| format!("{s:.1}")),
            grouped(capacity.visible_blocks as u64),
            capacity.history_frames,
            grouped(capacity.matches as u64),
            if capacity.colour { "yes" } else { "no" }
        );
    }
    let _ = writeln!(
        table,
        "\nimage: the largest; m3: blocks of {block_m:.2} m a side; window: frames `volume.prune_lag` can span; drive: seconds at {SPEED_M_S} m/s until \
         the pool is full and blocks leave to disk,\nby the {BLOCKS_PER_M} blocks a metre of the synthetic street at its default size, noise pruned, with \
         voxels of 0.05 m (another street or voxel: another figure)"
    );
    table
}

/// Seconds of driving until so many blocks are full; known for the voxels it was measured with.
fn drive_s(blocks: usize, volume: &VolumeConfig) -> Option<f64> {
    let measured = VolumeConfig::default();
    let same =
        volume.voxel_size_m == measured.voxel_size_m && volume.truncation_m == measured.truncation_m && volume.far_m == measured.far_m;
    same.then(|| blocks as f64 / f64::from(BLOCKS_PER_M) / SPEED_M_S)
}

fn regions(name: &str, capacity: &Capacity) {
    let (bytes, footprint) = (capacity.bytes(), capacity.footprint());
    println!("{:<34}{:>16}{:>10}", format!("region of {name}"), "bytes", "share");
    for region in footprint.regions() {
        println!("{:<34}{:>16}{:>8.1} %", region.name, grouped(region.bytes as u64), 100.0 * region.bytes as f64 / bytes as f64);
    }
    println!("{:<34}{:>16}{:>8.1} %", "slab", grouped(footprint.bytes() as u64), 100.0 * footprint.bytes() as f64 / bytes as f64);
}
