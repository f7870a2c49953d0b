//! The command line. Errors become sentences here and nowhere else.

mod bench;
mod budget;
mod calibration;
mod demo;
mod diff;
mod evaluate;
mod fixtures;
mod fleet;
mod help;
mod inspect;
mod localize;
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
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// Dense stereo mapping of dynamic scenes, within a fixed byte budget and bit-exact on every
/// machine.
#[derive(Debug, Parser)]
#[command(name = "dynvox", version, after_long_help = help::EXAMPLES)]
struct Cli {
    /// Print all commands with examples and exit codes
    #[arg(long)]
    help_all: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Map the synthetic street into ./dynvox-demo
    Demo(demo::DemoArgs),
    /// Map a data set, or the synthetic street without one
    Run(Box<run::RunArgs>),
    /// Describe a folder: what it has, what is missing, and the command that maps it
    Inspect(inspect::InspectArgs),
    /// Say what a calibration of raw cameras means, and write it as a file of our own
    Calibration(calibration::CalibrationArgs),
    /// List how many bytes each part of the mapper takes: all profiles, or one region by region
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
    /// Show the map of a finished run in the browser, frame by frame
    View(view::ViewArgs),
    /// Name the first frame and stage in which two runs diverge
    Diff(diff::DiffArgs),
    /// Measure the CPU time of every stage: on one thread, and what bounds it on two
    Bench(bench::BenchArgs),
    /// Replay small clips against the digests on file
    Fixtures(fixtures::FixturesArgs),
    /// Place a recording in the map of an old run, which stays as it is
    Localize(Box<localize::LocalizeArgs>),
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
    let cli = match parsed() {
        Ok(cli) => cli,
        Err(error) => return answer(&error),
    };
    let done = match cli.command {
        None => {
            out!("{}", help::OVERVIEW);
            if cli.help_all {
                outln!("\n{}", help::EXAMPLES);
            }
            Ok(())
        }
        Some(Command::Demo(args)) => demo::run(&args),
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
        Some(Command::Localize(args)) => localize::run(&args),
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

/// The command line of this process.
fn parsed() -> Result<Cli, clap::Error> {
    let mut command = help::in_two_sizes(Cli::command());
    let mut matches = command.try_get_matches_from_mut(std::env::args_os())?;
    Cli::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut command))
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
