//! `dynvox budget`.

mod targets;
mod work;

use crate::formats::CapacityFile;
use crate::report::text::grouped;
use crate::request::{self, Bytes, ImageSize};
use dynvox_core::memory::Placement;
use dynvox_core::volume::{BLOCK_SIDE, VolumeConfig};
use dynvox_core::{BudgetOptions, Capacity};
use std::fmt::Write;

/// Speed of the camera in the table, m/s.
const SPEED_M_S: f64 = 10.0;
/// Blocks a metre of the synthetic street leaves in the map (docs/measurements/memory.md).
const BLOCKS_PER_M: u32 = 1_000;
/// Profile whose work is shown where none is named: what `dynvox run` has room for.
const DEFAULT: &str = "onboard";

#[derive(Debug, clap::Args)]
pub struct BudgetArgs {
    /// Show this profile region by region
    #[arg(long, value_name = "NAME", conflicts_with_all = ["memory", "image"])]
    profile: Option<String>,
    /// Find the bounds that fit so many bytes: 48MiB, 1GiB
    #[arg(long, value_name = "BYTES", requires = "image")]
    memory: Option<Bytes>,
    /// Largest image, px: 752x480
    #[arg(long, value_name = "WxH", requires = "memory")]
    image: Option<ImageSize>,
    /// Largest raw image, px, where images come unrectified
    #[arg(long, value_name = "WxH", requires = "memory")]
    raw: Option<ImageSize>,
    /// Side of a voxel, m
    #[arg(long, value_name = "M", requires = "memory", default_value_t = VolumeConfig::default().voxel_size_m)]
    voxel: f32,
    /// Keep colour, even where it costs most blocks
    #[arg(long, requires = "memory", conflicts_with = "no_colour")]
    colour: bool,
    /// Keep no colour
    #[arg(long, requires = "memory")]
    no_colour: bool,
    /// Objects reconstructed at once [default: as many as a fifth of the bytes allows]
    #[arg(long, value_name = "N", requires = "memory")]
    objects: Option<usize>,
    /// Sum up slab, stack and code for the targets they are known for
    #[arg(long)]
    stack: bool,
    /// Show the most work of any step, in units that depend on no machine
    #[arg(long, conflicts_with = "stack")]
    work: bool,
    /// Setting that the work depends on: volume.prune_blocks_per_frame=500
    #[arg(long, value_name = "KEY=VALUE", requires = "work")]
    set: Vec<String>,
    /// Write the tables to standard output as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &BudgetArgs) -> anyhow::Result<()> {
    if let (Some(memory), Some(ImageSize(width, height))) = (args.memory, args.image) {
        let colour = if args.colour { Some(true) } else { args.no_colour.then_some(false) };
        let options = BudgetOptions {
            colour,
            objects: args.objects,
            voxel_size_m: Some(args.voxel),
            raw_image: args.raw.map_or([0; 2], |ImageSize(width, height)| [width, height]),
        };
        let capacity = request::solve(memory, (width, height), &options)?;
        if args.work {
            return work::show((&memory.to_string(), &capacity), &args.set, args.json);
        }
        return if args.stack {
            targets::show(&[(memory.to_string(), capacity)], args.json)
        } else {
            solved(args, memory, &capacity)
        };
    }
    if args.work {
        let (name, capacity) = request::profile(args.profile.as_deref().unwrap_or(DEFAULT))?;
        return work::show((&name, &capacity), &args.set, args.json);
    }
    match &args.profile {
        Some(name) if args.stack => targets::show(&[request::profile(name)?], args.json)?,
        None if args.stack => {
            let profiles = Capacity::PROFILES.map(|(name, capacity)| (name.to_owned(), capacity));
            targets::show(&profiles, args.json)?;
        }
        None if args.json => outln!("{}", serde_json::to_string_pretty(&profiles_json()?)?),
        None => overview(),
        Some(name) => {
            let (name, capacity) = request::profile(name)?;
            regions(&name, &capacity, args.json)?;
        }
    }
    Ok(())
}

fn profiles_json() -> anyhow::Result<serde_json::Value> {
    let profiles = Capacity::PROFILES.iter().map(|(name, capacity)| {
        let mut value = serde_json::to_value(CapacityFile::of(capacity))?;
        value["bytes"] = capacity.bytes().into();
        Ok(((*name).to_owned(), value))
    });
    Ok(serde_json::Value::Object(profiles.collect::<anyhow::Result<_>>()?))
}

/// Shows the capacity of a budget: what fits into it, as Rust and as TOML.
fn solved(args: &BudgetArgs, memory: Bytes, capacity: &Capacity) -> anyhow::Result<()> {
    let volume = VolumeConfig { voxel_size_m: args.voxel, ..VolumeConfig::default() };
    let path_m = path_m(capacity.blocks, &volume);
    if args.json {
        let mut value = serde_json::to_value(CapacityFile::of(capacity))?;
        value["bytes"] = capacity.bytes().into();
        value["path_m"] = path_m.into();
        outln!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(());
    }
    outln!("{} of {} bytes ({memory})", grouped(capacity.bytes() as u64), grouped(memory.0 as u64));
    outln!(
        "  distance before blocks are evicted: about {path_m:.0} m, by the synthetic street's \
         blocks a metre"
    );
    outln!("  pruning window: {} frames", capacity.history_frames);
    outln!(
        "  objects reconstructed at once: {}, of {} blocks each",
        capacity.objects,
        grouped(capacity.object_blocks as u64)
    );
    outln!(
        "\nas a file for `dynvox run --capacity FILE`:\n\n{}",
        CapacityFile::of(capacity).to_toml()?
    );
    outln!("as Rust:\n\nconst CAPACITY: Capacity = {capacity:#?};");
    outln!("\nas C:\n\n{}", to_c(capacity)?);
    Ok(())
}

/// The capacity as an initialiser in C.
fn to_c(capacity: &Capacity) -> anyhow::Result<String> {
    let table = serde_json::to_value(CapacityFile::of(capacity))?;
    let bounds = table["capacity"].as_object().into_iter().flatten();
    let fields = bounds.map(|(name, value)| match value.as_bool() {
        Some(flag) => format!("  .{name} = {},\n", u8::from(flag)),
        None => format!("  .{name} = {value},\n"),
    });
    Ok(format!("static const DynvoxCapacity capacity = {{\n{}}};", fields.collect::<String>()))
}

fn overview() {
    out!("{}", table(&VolumeConfig::default()));
    outln!(
        "\n`dynvox budget --profile NAME` shows a profile region by region; `dynvox budget \
         --memory 48MiB --image 752x480` finds bounds for other cases."
    );
}

/// All profiles and what fits into them.
pub fn table(volume: &VolumeConfig) -> String {
    let mut table = String::new();
    let _ = writeln!(
        table,
        "{:<10}{:>16}{:>10}{:>14}{:>10}{:>10}{:>10}{:>10}{:>8}{:>8}{:>10}",
        "profile",
        "slab, bytes",
        "MiB",
        "image, px",
        "blocks",
        "m3",
        "path, s",
        "visible",
        "window",
        "matches",
        "colour"
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
            path_s(capacity.blocks, volume).map_or_else(|| "-".to_owned(), |s| format!("{s:.1}")),
            grouped(capacity.visible_blocks as u64),
            capacity.history_frames,
            grouped(capacity.matches as u64),
            if capacity.colour { "yes" } else { "no" }
        );
    }
    let _ = writeln!(
        table,
        "\nimage: the largest; m3: blocks of {block_m:.2} m a side; window: frames \
         `volume.prune_lag` can span; path: seconds at {SPEED_M_S} m/s until \
         the pool is full and blocks are evicted to disk,\nby the {BLOCKS_PER_M} blocks a metre \
         of the synthetic street at its default size, noise pruned, with \
         voxels of 0.05 m (another street or voxel: another figure)"
    );
    table
}

/// Metres of driving until so many blocks are full: surfaces of the same extent take fewer blocks
/// of larger voxels, by the square of their side.
fn path_m(blocks: usize, volume: &VolumeConfig) -> f64 {
    let coarser = f64::from(volume.voxel_size_m) / f64::from(VolumeConfig::default().voxel_size_m);
    blocks as f64 / f64::from(BLOCKS_PER_M) * coarser * coarser
}

/// Seconds until so many blocks are full; known for the voxels it was measured with.
fn path_s(blocks: usize, volume: &VolumeConfig) -> Option<f64> {
    let measured = VolumeConfig::default();
    let same = volume.voxel_size_m == measured.voxel_size_m
        && volume.truncation_m == measured.truncation_m
        && volume.far_m == measured.far_m;
    same.then(|| blocks as f64 / f64::from(BLOCKS_PER_M) / SPEED_M_S)
}

fn regions(name: &str, capacity: &Capacity, json: bool) -> anyhow::Result<()> {
    let (bytes, footprint) = (capacity.bytes(), capacity.footprint());
    if json {
        let regions: Vec<_> = footprint
            .regions()
            .iter()
            .map(|region| {
                serde_json::json!({
                    "name": region.name,
                    "bytes": region.bytes,
                    "placement": region.placement().name()
                })
            })
            .collect();
        outln!(
            "{}",
            serde_json::to_string_pretty(&serde_json::json!({
                "profile": name,
                "bytes": bytes,
                "hot_bytes": capacity.hot_bytes(),
                "cold_bytes": capacity.cold_bytes(),
                "regions": regions
            }))?
        );
        return Ok(());
    }
    outln!("{:<34}{:>16}{:>10}  memory", format!("region of {name}"), "bytes", "share");
    let row = |name: &str, region_bytes: usize, placement: &str| {
        let share = 100.0 * region_bytes as f64 / bytes as f64;
        let row =
            format!("{name:<34}{:>16}{share:>8.1} %  {placement}", grouped(region_bytes as u64));
        outln!("{}", row.trim_end());
    };
    for region in footprint.regions() {
        row(region.name, region.bytes, region.placement().name());
    }
    row("slab", footprint.bytes(), "");
    row("of it in fast memory", capacity.hot_bytes(), Placement::Hot.name());
    row("in large memory", capacity.cold_bytes(), Placement::Cold.name());
    Ok(())
}
