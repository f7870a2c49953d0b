//! `dynvox diff`.

use crate::report::compare::{Comparison, Run, compare};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Settings named at most.
const MOST_SETTINGS: usize = 20;

#[derive(Debug, clap::Args)]
pub struct DiffArgs {
    /// A run folder
    a: PathBuf,
    /// Another
    b: PathBuf,
    /// Take runs for equal that agree in every frame they share, as a run and one resumed in its middle do
    #[arg(long)]
    shared: bool,
}

/// 0 where the runs are equal, 1 where they are not, 2 where that cannot be told.
pub fn main(args: &DiffArgs) -> ExitCode {
    match run(args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn run(args: &DiffArgs) -> anyhow::Result<bool> {
    let comparison = compare(&Run::read(&args.a)?, &Run::read(&args.b)?)?;
    print!("{}", sentences(&comparison, [&args.a, &args.b]));
    Ok(comparison.equal() || args.shared && comparison.parting.is_none())
}

fn sentences(comparison: &Comparison, names: [&Path; 2]) -> String {
    let [a, b] = names.map(|name| name.display().to_string());
    let mut text = String::new();
    for setting in comparison.settings.iter().take(MOST_SETTINGS) {
        let [one, other] = setting.values.each_ref().map(|value| value.as_deref().unwrap_or("nothing"));
        text += &format!("setting {}: {one} in {a}, {other} in {b}\n", setting.key);
    }
    if comparison.settings.len() > MOST_SETTINGS {
        text += &format!("and {} settings more\n", comparison.settings.len() - MOST_SETTINGS);
    }
    let shared = comparison.shared;
    text += &match (&comparison.parting, comparison.prefix()) {
        (Some(parting), _) => {
            let stage = parting.stage.map_or("the digest of all alone: a table was edited".to_owned(), |stage| stage.to_string());
            format!("the runs part at frame {}, first in: {stage}\n", parting.frame)
        }
        (None, Some(which)) => {
            let [short, long] = if which == 0 { [&a, &b] } else { [&b, &a] };
            let more = comparison.frames[1 - which][2] - shared;
            format!("{short} is the beginning of {long}: equal in its {shared} frames, {more} more follow\n")
        }
        (None, None) if comparison.equal() => format!("equal in all {shared} frames\n"),
        (None, None) => {
            let said = |[first, last, count]: [usize; 3]| format!("{count} frames from {first} to {last}");
            let [one, other] = comparison.frames.map(said);
            format!("equal in the {shared} frames they share; {a} has {one}, {b} has {other}\n")
        }
    };
    text
}
