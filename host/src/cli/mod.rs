//! The command line. Errors become sentences here and nowhere else.

mod bench;
mod budget;
mod calibration;
mod diff;
mod evaluate;
mod fixtures;
mod fleet;
mod inspect;
mod manual;
#[cfg(test)]
mod messages;
mod rectified;
mod run;
mod settings;
mod signals;
mod sweep;
mod synth;
mod view;

use crate::request::RequestError;
use crate::terminal;
use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  dynvox                                        map the synthetic street: no data set needed
  dynvox inspect ~/kitti                        its content, and the command that maps it
  dynvox run ~/kitti --sequence 06              map a KITTI odometry sequence
  dynvox run ~/tracking --sequence 0003 --frames 100 --threads 4
  dynvox run ~/my-rig                           a folder with left/, right/, calib.txt
  dynvox run ~/kitti --sequence 06 --profile small --scale 0.5
  dynvox run --set volume.voxel_size_m=0.1 --set street.seed=7 --out out/coarse
  dynvox run --config out/coarse/config.toml    the same again
  dynvox run ~/kitti --sequence 06 --snapshot-every 100 --out out/long
  dynvox run --resume out/long                  resume an interrupted run from its last snapshot
  dynvox run ~/raw-rig --calibration camchain.yaml   images as the cameras deliver them
  dynvox calibration camchain.yaml              what a calibration means
  dynvox settings volume.voxel_size_m           what a setting means, its range and its default
  dynvox budget --profile small                 where the bytes of a profile go
  dynvox budget --memory 48MiB --image 752x480   bounds that fit a number of bytes
  dynvox run ~/my-rig --memory 48MiB            the same, for the images that come
  dynvox run ~/kitti --sequence 06 --evaluate lidar     accuracy and completeness of input and map
  dynvox evaluate trajectory out/kitti-odometry-06-001 ~/kitti/poses/06.txt
  dynvox evaluate stereo ~/kitti-stereo-2015        D1 and coverage of the matcher, by region
  dynvox evaluate masks masks/motion ~/tracking/instances/0003   IoU of masks that a run saved
  dynvox sweep street ~/kitti:06 --out sweep    prune weights, frame rates and scales on one page
  dynvox synth --out street --set street.frames=50
  dynvox bench ~/kitti --sequence 06 --frames 60    CPU time of every stage, on one thread and on \
  two
  dynvox fixtures new pinned --from ~/my-rig --memory 32MiB   digests of your own rig, for your CI
  dynvox fleet plan recordings.toml --out fleet   jobs for many recordings, whose maps become one
  dynvox view out/street-001                    its map in the browser
  dynvox diff out/a out/b                       the first frame and stage in which two runs diverge

A run leaves a folder with map.ply, trajectories, frames.csv, summary.json and report.html: open \
the last in a browser.

Exit codes: 0 done; 1 failed; 2 wrong command line; 3 images refused; 4 the run ended early or \
lacks a file: what was mapped is in its folder,
and summary.json says why under `incomplete`.";

/// Dense stereo mapping of dynamic scenes, within a fixed byte budget and bit-exact on every
/// machine.
#[derive(Debug, Parser)]
#[command(name = "dynvox", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Map a data set, or the synthetic street without one (the default command)
    Run(Box<run::RunArgs>),
    /// Describe a folder: what it has, what is missing, and the command that maps it
    Inspect(inspect::InspectArgs),
    /// Say what a calibration of raw cameras means, and write it as a file of our own
    Calibration(calibration::CalibrationArgs),
    /// Show where the bytes go: all profiles, or one region by region
    Budget(budget::BudgetArgs),
    /// Evaluate files against ground truth: trajectories, disparities, masks
    Evaluate(evaluate::EvaluateArgs),
    /// Run many times with one setting varied, and compare the results with the original's numbers
    /// on one page
    Sweep(Box<sweep::SweepArgs>),
    /// Write the synthetic street in KITTI's layout, with its ground truth
    Synth(synth::SynthArgs),
    /// Describe the settings: all, one section, or one with its unit, range and default
    Settings(settings::SettingsArgs),
    /// Turn the map of a finished run in the browser, frame by frame
    View(view::ViewArgs),
    /// Name the first frame and stage in which two runs diverge
    Diff(diff::DiffArgs),
    /// Take the CPU time of every stage: on one thread, and what bounds it on two
    Bench(bench::BenchArgs),
    /// Replay small clips against the digests on file
    Fixtures(fixtures::FixturesArgs),
    /// Map many recordings, and add their maps in any order
    Fleet(fleet::FleetArgs),
    /// Write completions for a shell: dynvox completions bash >
    /// ~/.local/share/bash-completion/completions/dynvox
    Completions(manual::CompletionsArgs),
    /// Write the manual: dynvox man | man -l -
    Man(manual::ManArgs),
    /// Serve a network to the program that started this one
    #[cfg(feature = "onnx")]
    #[command(hide = true)]
    NetworkWorker {
        /// ONNX file
        network: std::path::PathBuf,
    },
}

/// Exit code of a run whose images would give a meaningless map.
const REFUSED_INPUT: u8 = 3;
/// Exit code of a run that ended early, or whose results lack a file.
const INCOMPLETE: u8 = 4;

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    #[cfg(feature = "onnx")]
    if let Ok(program) = std::env::current_exe() {
        crate::input::masks::run_networks_in(program);
    }
    signals::survive_file_size_limit();
    terminal::expect(std::env::args_os().skip(1));
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return answer(&error),
    };
    let done = match cli.command {
        None => run::run(&run::RunArgs::default()),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::Inspect(args)) => inspect::run(&args),
        Some(Command::Calibration(args)) => calibration::run(&args),
        Some(Command::Budget(args)) => budget::run(&args),
        Some(Command::Evaluate(args)) => evaluate::run(&args),
        Some(Command::Sweep(args)) => sweep::run(&args),
        Some(Command::Synth(args)) => synth::run(&args),
        Some(Command::Settings(args)) => settings::run(&args),
        Some(Command::View(args)) => view::run(&args),
        Some(Command::Diff(args)) => return diff::main(&args),
        Some(Command::Bench(args)) => bench::run(&args),
        Some(Command::Fixtures(args)) => fixtures::run(&args),
        Some(Command::Fleet(args)) => fleet::run(&args),
        Some(Command::Completions(args)) => {
            manual::completions(&args, Cli::command());
            Ok(())
        }
        Some(Command::Man(args)) => manual::man(&args, Cli::command()),
        #[cfg(feature = "onnx")]
        Some(Command::NetworkWorker { network }) => {
            return crate::input::masks::serve_network(&network);
        }
    };
    match done.and_then(|()| terminal::finish()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            errln!("error: {}", sentence(&error));
            match () {
                () if matches!(error.downcast_ref(), Some(RequestError::Refused(_))) => {
                    ExitCode::from(REFUSED_INPUT)
                }
                () if error.is::<run::IncompleteRun>() => ExitCode::from(INCOMPLETE),
                () => ExitCode::FAILURE,
            }
        }
    }
}

/// Prints what the command line's parser answers: help, the version, or what is wrong.
fn answer(error: &clap::Error) -> ExitCode {
    let text = error.render().to_string();
    if error.use_stderr() {
        errln!("{}", text.trim_end());
        return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(1));
    }
    out!("{text}");
    if terminal::finish().is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// An error with its causes, without how a command is used.
fn sentence(error: &anyhow::Error) -> String {
    if let Some(refused) = error.downcast_ref::<clap::Error>() {
        let text = refused.to_string();
        return text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
    }
    crate::sentence(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed_and_every_example_parses() {
        Cli::command().debug_assert();
        for line in EXAMPLES.lines().filter(|line| line.trim_start().starts_with("dynvox")) {
            let command = line.trim().split("   ").next().unwrap();
            assert!(Cli::try_parse_from(command.split_whitespace()).is_ok(), "{command}");
        }
    }
}
