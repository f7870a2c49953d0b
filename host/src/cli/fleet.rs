//! `dynvox fleet`.

pub mod jobs;
mod world;

use crate::fleet::{Job, Uncertainty};
use crate::formats::Axes;
use anyhow::bail;
use dynvox_core::view::MeshConfig;
use std::path::PathBuf;

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
    /// Do a share of the jobs that are not done: map, and keep the map
    Run {
        /// Folder of the jobs
        folder: PathBuf,
        /// The share: every n-th job from the i-th on, from 0; by default that of Slurm's or
        /// Kubernetes' variables, else all
        #[arg(long, value_name = "I/N")]
        shard: Option<Shard>,
    },
    /// Do the run of one job in this process: a part of `fleet run`
    #[command(hide = true)]
    Job {
        /// Folder of the jobs
        folder: PathBuf,
        /// The job
        id: String,
    },
    /// Register the maps of jobs that are all done with one another, and correct where they lie in
    /// the world
    Align {
        /// Folder of the jobs
        folder: PathBuf,
        /// Uncertainty of given positions, one standard deviation
        #[arg(long, default_value_t = 0.3, value_name = "M")]
        uncertainty_m: f64,
        /// Uncertainty of given rotations, one standard deviation
        #[arg(long, default_value_t = 1.5, value_name = "DEGREES")]
        uncertainty_deg: f64,
    },
    /// Carry a share of the maps into the world, as aligned or as given: sums in the world's
    /// lattice
    Resample {
        /// Folder of the jobs
        folder: PathBuf,
        /// The share, as of `fleet run`
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
    /// Add maps: folders of sums, or folders of jobs whose maps are all resampled
    Merge {
        /// Maps to add, in any order
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
    /// Write what recordings saw, where they went and what has changed between epochs: report.json,
    /// changes.csv, map.png
    Report {
        /// Folder of the jobs
        folder: PathBuf,
        /// Merged map of the jobs
        map: PathBuf,
        /// Folder to write
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Least volume of a change
        #[arg(long, default_value_t = 0.05, value_name = "M3")]
        least_change_m3: f64,
    },
}

/// Every `of`-th job from `index` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub index: usize,
    pub of: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text
            .split_once('/')
            .and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        let shard =
            parts.map(|(index, of)| Self { index, of }).filter(|shard| shard.index < shard.of);
        shard.ok_or_else(|| format!("`{text}` is no share: write 0/4 to 3/4"))
    }
}

impl Shard {
    /// The share that a scheduler gives to this process.
    fn of_scheduler(variable: impl Fn(&str) -> Option<usize>) -> Self {
        let slurm = || {
            Some((
                variable("SLURM_ARRAY_TASK_ID")?.checked_sub(variable("SLURM_ARRAY_TASK_MIN")?)?,
                variable("SLURM_ARRAY_TASK_COUNT")?,
            ))
        };
        let kubernetes = || Some((variable("JOB_COMPLETION_INDEX")?, variable("DYNVOX_SHARDS")?));
        let (index, of) =
            slurm().or_else(kubernetes).filter(|(index, of)| index < of).unwrap_or((0, 1));
        Self { index, of }
    }
}

pub fn run(args: &FleetArgs) -> anyhow::Result<()> {
    let share = |shard: Option<Shard>| {
        let variable = |name: &str| std::env::var(name).ok()?.parse().ok();
        shard.unwrap_or_else(|| Shard::of_scheduler(variable))
    };
    match &args.action {
        Action::Plan { recordings, out } => jobs::plan(recordings, out),
        Action::Run { folder, shard } => jobs::run(folder, share(*shard)),
        Action::Job { folder, id } => jobs::run_one(folder, id),
        Action::Align { folder, uncertainty_m, uncertainty_deg } => world::align(
            folder,
            &Uncertainty { position_m: *uncertainty_m, rotation_rad: uncertainty_deg.to_radians() },
        ),
        Action::Resample { folder, shard } => world::resample(folder, share(*shard)),
        Action::Status { folder, json } => jobs::status(folder, *json),
        Action::Merge { maps, out } => world::merge(maps, out),
        Action::Mesh { map, out, min_weight, axes } => world::mesh(map, out, *min_weight, *axes),
        Action::Report { folder, map, out, least_change_m3 } => {
            world::report((folder, map), out, *least_change_m3)
        }
    }
}

/// Does something with each job of a share. What fails is named, and the others go on; `are` says
/// what has become of them.
fn each<'j, T>(
    jobs: impl Iterator<Item = (&'j Job, T)>,
    are: &str,
    mut act: impl FnMut(&Job, T) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut failed = Vec::new();
    for (job, of) in jobs {
        if let Err(error) = act(job, of) {
            errln!("error: {}: {}", job.name, super::sentence(&error));
            failed.push(job.name.as_str());
        }
    }
    if failed.is_empty() {
        return Ok(());
    }
    bail!("{} failed. The others are {are}; repeat the command for what is left", failed.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_read_from_text_and_from_schedulers() {
        assert_eq!("2/3".parse(), Ok(Shard { index: 2, of: 3 }));
        assert!(["3/3", "1", "/", "-1/2", "0/0"].iter().all(|text| text.parse::<Shard>().is_err()));
        let of = |variables: &[(&str, usize)]| {
            let found = |name: &str| {
                variables.iter().find(|(key, _)| *key == name).map(|(_, value)| *value)
            };
            Shard::of_scheduler(found)
        };
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", 6),
            ("SLURM_ARRAY_TASK_MIN", 4),
            ("SLURM_ARRAY_TASK_COUNT", 5),
        ];
        assert_eq!(of(&slurm), Shard { index: 2, of: 5 });
        assert_eq!(
            of(&[("JOB_COMPLETION_INDEX", 1), ("DYNVOX_SHARDS", 2)]),
            Shard { index: 1, of: 2 }
        );
        assert_eq!(of(&[("JOB_COMPLETION_INDEX", 1)]), Shard { index: 0, of: 1 });
    }
}
