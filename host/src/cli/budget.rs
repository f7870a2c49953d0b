//! `dynvox budget`.

use crate::export::report::grouped;
use crate::harness::HostSlab;
use dynvox_core::geometry::StereoRig;
use dynvox_core::{Capacity, Config, Mapper};

#[derive(Debug, clap::Args)]
pub struct BudgetArgs {
    /// Show this profile region by region
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
}

pub fn run(args: &BudgetArgs) -> anyhow::Result<()> {
    match &args.profile {
        None => overview(),
        Some(name) => regions(name, &super::profile(name)?)?,
    }
    Ok(())
}

fn overview() {
    println!(
        "{:<10}{:>16}{:>10}{:>14}{:>10}{:>10}{:>10}{:>8}",
        "profile", "slab, bytes", "MiB", "image, px", "blocks", "visible", "matches", "colour"
    );
    for (name, capacity) in Capacity::PROFILES {
        let bytes = capacity.bytes();
        println!(
            "{name:<10}{:>16}{:>10.1}{:>14}{:>10}{:>10}{:>10}{:>8}",
            grouped(bytes as u64),
            bytes as f64 / 1_048_576.0,
            format!("{} x {}", capacity.image_width, capacity.image_height),
            grouped(capacity.blocks as u64),
            grouped(capacity.visible_blocks as u64),
            grouped(capacity.matches as u64),
            if capacity.colour { "yes" } else { "no" }
        );
    }
    println!("\n`dynvox budget --profile NAME` shows a profile region by region.");
}

fn regions(name: &str, capacity: &Capacity) -> anyhow::Result<()> {
    let bytes = capacity.bytes();
    let mut slab = HostSlab::map(bytes)
        .ok_or_else(|| anyhow::anyhow!("this machine has no {bytes} bytes for profile {name}. Look at a smaller one"))?;
    // The regions depend on the capacity alone: any rig will do.
    let rig = StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };
    let mapper = Mapper::new(capacity, &Config::for_rig(rig), slab.bytes_mut())
        .map_err(|error| anyhow::anyhow!("the core refuses profile {name}: {error:?}. This is a bug of dynvox: please report it"))?;
    let footprint = mapper.footprint();
    println!("{:<34}{:>16}{:>10}", format!("region of {name}"), "bytes", "share");
    for region in footprint.regions() {
        println!("{:<34}{:>16}{:>8.1} %", region.name, grouped(region.bytes as u64), 100.0 * region.bytes as f64 / bytes as f64);
    }
    println!("{:<34}{:>16}{:>8.1} %", "slab", grouped(footprint.bytes() as u64), 100.0 * footprint.bytes() as f64 / bytes as f64);
    Ok(())
}
