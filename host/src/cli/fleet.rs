//! `dynvox fleet`.

use super::run::plan_of;
use crate::fleet::{self, Identity, Job, JobState, Lattice, Manifest, Recordings};
use crate::formats::Axes;
use crate::report::text::grouped;
use crate::run::store::BlockFile;
use crate::run::{BLOCKS_FILE, Plan, RunManifest, stereo_frame};
use anyhow::{Context, bail};
use dynvox_core::digest::Digest;
use dynvox_core::view::MeshConfig;
use std::path::{Path, PathBuf};
use std::process::Command;

#[derive(Debug, clap::Args)]
pub struct FleetArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Make jobs of a list of recordings, each with its bytes of memory
    Plan {
        /// The list, TOML
        recordings: PathBuf,
        /// Folder of the jobs
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Do a share of the jobs that are not done: map, and keep the map's sums
    Run {
        /// Folder of the jobs
        folder: PathBuf,
        /// The share: every n-th job from the i-th on, from 0; by default that of Slurm's or Kubernetes' variables, else all
        #[arg(long, value_name = "I/N")]
        shard: Option<Shard>,
    },
    /// Say which jobs are done
    Status {
        /// Folder of the jobs
        folder: PathBuf,
        /// Write the table to standard output as JSON
        #[arg(long)]
        json: bool,
    },
    /// Add maps: folders of sums, or folders of jobs that are all done
    Merge {
        /// What to add, in any order
        #[arg(required = true)]
        maps: Vec<PathBuf>,
        /// Folder to write
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Write the surface of a merged map
    Mesh {
        /// Folder of sums
        map: PathBuf,
        /// File to write
        #[arg(long, value_name = "FILE.ply")]
        out: PathBuf,
        /// Least weight of a voxel
        #[arg(long, default_value_t = MeshConfig::default().min_weight, value_name = "N")]
        min_weight: u8,
        /// Axes: those of the camera, or east, north, up
        #[arg(long, value_enum, default_value_t)]
        axes: Axes,
    },
}

/// Every `of`-th job from `index` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shard {
    index: usize,
    of: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        let shard = parts.map(|(index, of)| Self { index, of }).filter(|shard| shard.index < shard.of);
        shard.ok_or_else(|| format!("`{text}` is no share: write 0/4 to 3/4"))
    }
}

impl Shard {
    /// The share that a scheduler gives to this process.
    fn of_scheduler(variable: impl Fn(&str) -> Option<usize>) -> Self {
        let slurm = || {
            Some((variable("SLURM_ARRAY_TASK_ID")?.checked_sub(variable("SLURM_ARRAY_TASK_MIN")?)?, variable("SLURM_ARRAY_TASK_COUNT")?))
        };
        let kubernetes = || Some((variable("JOB_COMPLETION_INDEX")?, variable("DYNVOX_SHARDS")?));
        let (index, of) = slurm().or_else(kubernetes).filter(|(index, of)| index < of).unwrap_or((0, 1));
        Self { index, of }
    }
}

pub fn run(args: &FleetArgs) -> anyhow::Result<()> {
    match &args.action {
        Action::Plan { recordings, out } => plan(recordings, out),
        Action::Run { folder, shard } => {
            let variable = |name: &str| std::env::var(name).ok()?.parse().ok();
            work(folder, shard.unwrap_or_else(|| Shard::of_scheduler(variable)))
        }
        Action::Status { folder, json } => status(folder, *json),
        Action::Merge { maps, out } => merge(maps, out),
        Action::Mesh { map, out, min_weight, axes } => {
            let meshed = fleet::write_mesh(map, out, *min_weight, *axes)?;
            let (triangles, blocks) = (grouped(meshed.mesh.triangles), grouped(meshed.blocks));
            outln!("{}: {triangles} triangles of {blocks} blocks", out.display());
            if meshed.overflowed > 0 {
                eprintln!("warning: {} voxels were seen too often for their sums and are left out", grouped(meshed.overflowed));
            }
            Ok(())
        }
    }
}

/// The plan of a run's arguments.
fn planned(arguments: &[String]) -> anyhow::Result<Plan> {
    let line: Vec<String> = ["dynvox", "--quiet"].into_iter().map(str::to_owned).chain(arguments.iter().cloned()).collect();
    plan_of(&line)
}

/// What identifies a run: its settings, what is known of its data set, its first and its last image.
fn identify(plan: &Plan) -> anyhow::Result<Identity> {
    let mut digest = Digest::default();
    for (key, value) in RunManifest::of(plan, std::iter::empty(), Path::new(""))?.fingerprint() {
        digest.bytes(key.as_bytes());
        digest.bytes(value.as_bytes());
    }
    let frames = plan.frames.listed();
    for &index in [frames.first(), frames.last()].into_iter().flatten() {
        let images = plan.dataset.frame(index)?;
        digest.u64(stereo_frame(&images, &[]).map_or(0, |frame| frame.digest()));
    }
    Ok(Identity { digest: digest.finish(), bytes: plan.rss_limit_bytes })
}

fn plan(recordings: &Path, out: &Path) -> anyhow::Result<()> {
    let of = |arguments: &[String]| identify(&planned(arguments)?);
    let manifest = Manifest::plan(recordings, &Recordings::read(recordings)?, of)?;
    manifest.write(out)?;
    outln!("{} jobs in {}. Do them with: dynvox fleet run {}", manifest.jobs.len(), out.display(), out.display());
    Ok(())
}

fn work(folder: &Path, shard: Shard) -> anyhow::Result<()> {
    let manifest = Manifest::read(folder)?;
    let mut failed = Vec::new();
    for job in manifest.shard(shard.index, shard.of) {
        if job.state(folder) == JobState::Done {
            continue;
        }
        match map(folder, job) {
            Ok(()) => outln!("{} is done", job.name),
            Err(error) => {
                eprintln!("error: {}: {}", job.name, super::sentence(&error));
                failed.push(job.name.as_str());
            }
        }
    }
    if failed.is_empty() {
        return Ok(());
    }
    bail!("{} failed. The others are done; repeat the command for what is left", failed.join(", "))
}

/// Runs one job in a process of its own, and keeps the sums of its map.
fn map(folder: &Path, job: &Job) -> anyhow::Result<()> {
    let is_same = |plan: &Plan| anyhow::Ok(job.is_of(identify(plan)?.digest));
    let plan = planned(&job.arguments)?;
    if !is_same(&plan)? {
        bail!("its settings or images are not those of the plan. Plan again");
    }
    let run_folder = job.run_folder(folder);
    let run = Command::new(std::env::current_exe()?)
        .arg("run")
        .args(&job.arguments)
        .args(["--quiet", "--keep-blocks", "--overwrite", "--out"])
        .arg(&run_folder)
        .output()
        .context("the run cannot be started")?;
    if !run.status.success() {
        bail!("{}", String::from_utf8_lossy(&run.stderr).trim().trim_start_matches("error: "));
    }
    if !is_same(&planned(&job.arguments)?)? {
        bail!("its images have changed while it ran. Plan again");
    }
    let volume = &plan.config.volume;
    let lattice = Lattice {
        voxel_size_m: volume.voxel_size_m,
        truncation_m: volume.truncation_m,
        colour: plan.capacity.colour,
    };
    let blocks = run_folder.join(BLOCKS_FILE);
    let (mut store, _) = BlockFile::open(&blocks, lattice.voxel_size_m, lattice.truncation_m)?;
    let t_world_map = job.t_world_camera().context("its place in the world is no rigid motion")?;
    let out = job.submap(folder);
    std::fs::create_dir_all(folder.join("submaps"))?;
    let submap = fleet::submap(&mut store, &lattice, &t_world_map, &out)?;
    if submap.beyond > 0 {
        eprintln!("warning: {} blocks of {} are beyond the world's coordinates", submap.beyond, job.name);
    }
    // The sums are all that is needed of them.
    std::fs::remove_file(&blocks)?;
    Ok(())
}

fn status(folder: &Path, json: bool) -> anyhow::Result<()> {
    let manifest = Manifest::read(folder)?;
    let word = |job: &Job| match job.state(folder) {
        JobState::Done => "done",
        JobState::Started => "started",
        JobState::Open => "open",
    };
    if json {
        let rows =
            manifest.jobs.iter().map(|job| serde_json::json!({ "name": job.name, "id": job.id, "bytes": job.bytes, "state": word(job) }));
        outln!("{}", serde_json::to_string_pretty(&rows.collect::<Vec<_>>())?);
        return Ok(());
    }
    outln!("{:<24}{:<20}{:>14}  state", "recording", "id", "memory, MiB");
    manifest.jobs.iter().for_each(|job| outln!("{:<24}{:<20}{:>14}  {}", job.name, job.id, job.bytes >> 20, word(job)));
    Ok(())
}

fn merge(maps: &[PathBuf], out: &Path) -> anyhow::Result<()> {
    let mut inputs = Vec::new();
    for map in maps {
        if !map.join(fleet::MANIFEST_FILE).is_file() {
            inputs.push(map.clone());
            continue;
        }
        let manifest = Manifest::read(map)?;
        let open: Vec<&str> = manifest.jobs.iter().filter(|job| job.state(map) != JobState::Done).map(|job| job.name.as_str()).collect();
        if !open.is_empty() {
            bail!("{} of {} are not done. Do them with: dynvox fleet run {}", open.join(", "), map.display(), map.display());
        }
        inputs.extend(manifest.jobs.iter().map(|job| job.submap(map)));
    }
    let merged = fleet::merge(&inputs, out)?;
    let digest = fleet::digest(out)?;
    outln!("{}: {} blocks in {} tiles, digest {digest:016x}", out.display(), grouped(merged.blocks), merged.tiles);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_read_from_text_and_from_schedulers() {
        assert_eq!("2/3".parse(), Ok(Shard { index: 2, of: 3 }));
        assert!(["3/3", "1", "/", "-1/2", "0/0"].iter().all(|text| text.parse::<Shard>().is_err()));
        let of = |variables: &[(&str, usize)]| {
            let found = |name: &str| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| *value);
            Shard::of_scheduler(found)
        };
        let slurm = [("SLURM_ARRAY_TASK_ID", 6), ("SLURM_ARRAY_TASK_MIN", 4), ("SLURM_ARRAY_TASK_COUNT", 5)];
        assert_eq!(of(&slurm), Shard { index: 2, of: 5 });
        assert_eq!(of(&[("JOB_COMPLETION_INDEX", 1), ("DYNVOX_SHARDS", 2)]), Shard { index: 1, of: 2 });
        assert_eq!(of(&[("JOB_COMPLETION_INDEX", 1)]), Shard { index: 0, of: 1 });
    }
}
