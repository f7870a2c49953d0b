//! The command line. Errors become sentences here and nowhere else.

mod budget;
mod calibration;
mod capacity;
mod diff;
mod egomotion;
mod evaluate;
mod fixtures;
mod inspect;
mod run;
mod settings;
mod sweep;
mod synth;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  dynvox                                        map the synthetic street: no data set needed
  dynvox inspect ~/kitti                        what is there, and the command that maps it
  dynvox run ~/kitti --sequence 06              map a KITTI odometry sequence
  dynvox run ~/tracking --sequence 0003 --frames 100 --threads 4
  dynvox run ~/my-rig                           a folder with left/, right/, calib.txt
  dynvox run ~/kitti --sequence 06 --profile small --scale 0.5
  dynvox run --set volume.voxel_size_m=0.1 --set street.seed=7 --out out/coarse
  dynvox run --config out/coarse/config.toml    the same again
  dynvox run ~/kitti --sequence 06 --snapshot-every 100 --out out/long
  dynvox run --resume out/long                  what stopped goes on from its last snapshot
  dynvox run ~/raw-rig --calibration camchain.yaml   images as the cameras deliver them
  dynvox calibration camchain.yaml              what a calibration means
  dynvox budget --profile small                 where the bytes of a profile go
  dynvox budget --memory 48MiB --image 752x480   bounds that fit a number of bytes
  dynvox run ~/my-rig --memory 48MiB            the same, for the images that come
  dynvox run ~/kitti --sequence 06 --evaluate lidar     accuracy and completeness of input and map
  dynvox evaluate trajectory out/kitti-odometry-06-001 ~/kitti/poses/06.txt
  dynvox evaluate stereo ~/kitti-stereo-2015        D1 and coverage of the matcher, by region
  dynvox sweep street ~/kitti:06 --out sweep    prune weights, frame rates and scales on one page
  dynvox synth --out street --set street.frames=50
  dynvox diff out/a out/b                       the first frame and stage in which two runs part

A run leaves a folder with map.ply, trajectories, frames.csv, summary.json and report.html: open the last in a browser.";

/// Maps streets densely from a stereo camera, within a byte budget fixed in advance, with the same bits on every machine.
#[derive(Debug, Parser)]
#[command(name = "dynvox", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Map a data set, or the synthetic street without one (this is also what `dynvox` alone does)
    Run(Box<run::RunArgs>),
    /// Say what a folder holds, what is missing, and the command that maps it
    Inspect(inspect::InspectArgs),
    /// Say what a calibration of raw cameras means, and write it as a file of our own
    Calibration(calibration::CalibrationArgs),
    /// Show where the bytes go: all profiles, or one region by region
    Budget(budget::BudgetArgs),
    /// Hold files against the truth: trajectories, disparities
    Evaluate(evaluate::EvaluateArgs),
    /// Make many runs with one thing varied, and one page of them beside the original's numbers
    Sweep(Box<sweep::SweepArgs>),
    /// Write the synthetic street in KITTI's layout, with all its truth
    Synth(synth::SynthArgs),
    /// Name the first frame and the first stage in which two runs part
    Diff(diff::DiffArgs),
    /// Replay small clips against the digests on file
    Fixtures(fixtures::FixturesArgs),
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    let filter = tracing_subscriber::EnvFilter::try_from_env("DYNVOX_LOG").unwrap_or_else(|_| "warn".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).without_time().init();
    let done = match Cli::parse().command {
        None => run::run(&run::RunArgs::without_arguments()),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::Inspect(args)) => inspect::run(&args),
        Some(Command::Calibration(args)) => calibration::run(&args),
        Some(Command::Budget(args)) => budget::run(&args),
        Some(Command::Evaluate(args)) => evaluate::run(&args),
        Some(Command::Sweep(args)) => sweep::run(&args),
        Some(Command::Synth(args)) => synth::run(&args),
        Some(Command::Diff(args)) => return diff::main(&args),
        Some(Command::Fixtures(args)) => fixtures::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The profile of that name, in any case, and its name.
fn profile(name: &str) -> anyhow::Result<(String, dynvox_core::Capacity)> {
    let known = dynvox_core::Capacity::PROFILES;
    let found = known.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
    found.map(|(name, capacity)| ((*name).to_owned(), *capacity)).ok_or_else(|| {
        let names = known.map(|(name, _)| name).join(", ");
        anyhow::anyhow!("there is no profile {name}. Choose one of {names}; `dynvox budget` shows them")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed_and_every_example_parses() {
        Cli::command().debug_assert();
        for line in EXAMPLES.lines().filter(|line| line.trim_start().starts_with("dynvox")) {
            let command = line.trim().split("   ").next().unwrap();
            assert!(Cli::try_parse_from(command.split_whitespace()).is_ok(), "{command}");
        }
    }
}
