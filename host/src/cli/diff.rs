//! `dynvox diff`.

use crate::report::compare::{Comparison, RunDigests, compare};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Settings listed at most.
const MAX_SETTINGS: usize = 20;

#[derive(Debug, clap::Args)]
pub struct DiffArgs {
    /// A run folder
    a: PathBuf,
    /// Another run folder
    b: PathBuf,
    /// Accept runs that agree in every frame they share
    #[arg(long)]
    shared: bool,
    /// Write the comparison to standard output as JSON
    #[arg(long)]
    json: bool,
}

/// 0 for equal runs, 1 for different ones, 2 where they cannot be compared.
pub fn main(args: &DiffArgs) -> ExitCode {
    match run(args).and_then(|equal| crate::terminal::finish().map(|()| equal)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            errln!("error: {}", super::sentence(&error));
            ExitCode::from(2)
        }
    }
}

fn run(args: &DiffArgs) -> anyhow::Result<bool> {
    let comparison = compare(&RunDigests::read(&args.a)?, &RunDigests::read(&args.b)?)?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&to_json(&comparison))?);
    } else {
        out!("{}", sentences(&comparison, [&args.a, &args.b]));
    }
    Ok(comparison.equal() || args.shared && comparison.divergence.is_none())
}

fn to_json(comparison: &Comparison) -> serde_json::Value {
    let frames = |[first, last, count]: [usize; 3]| serde_json::json!({ "first": first, "last": last, "count": count });
    let divergence = comparison.divergence.as_ref();
    serde_json::json!({
        "equal": comparison.equal(),
        "shared_frames": comparison.shared,
        "frames": comparison.frames.map(frames),
        "divergence": divergence.map(|at| serde_json::json!({ "frame": at.frame, "stage": at.stage.map(|stage| stage.to_string()) })),
        "settings": comparison.settings.iter().map(|one| serde_json::json!({ "key": one.key, "values": one.values })).collect::<Vec<_>>(),
    })
}

fn sentences(comparison: &Comparison, names: [&Path; 2]) -> String {
    let [a, b] = names.map(|name| name.display().to_string());
    let mut text = String::new();
    for setting in comparison.settings.iter().take(MAX_SETTINGS) {
        let [one, other] =
            setting.values.each_ref().map(|value| value.as_deref().unwrap_or("not set"));
        text += &format!("setting {}: {one} in {a}, {other} in {b}\n", setting.key);
    }
    if comparison.settings.len() > MAX_SETTINGS {
        text += &format!("and {} more settings\n", comparison.settings.len() - MAX_SETTINGS);
    }
    let shared = comparison.shared;
    text += &match (&comparison.divergence, comparison.prefix()) {
        (Some(divergence), _) => {
            let stage = divergence
                .stage
                .map_or("the combined digest alone: a table was edited".to_owned(), |stage| {
                    stage.to_string()
                });
            let apart = format!(
                "apart in frame {}: {}\napart at most: {}\n",
                divergence.frame, divergence.there, divergence.most
            );
            format!("first divergence: frame {}, {stage}\n{apart}", divergence.frame)
        }
        (None, Some(which)) => {
            let [short, long] = if which == 0 { [&a, &b] } else { [&b, &a] };
            let more = comparison.frames[1 - which][2] - shared;
            format!(
                "{short} is a prefix of {long}: equal in all its {shared} frames, {more} more \
                 follow\n"
            )
        }
        (None, None) if comparison.equal() => format!("equal in all {shared} frames\n"),
        (None, None) => {
            let range =
                |[first, last, count]: [usize; 3]| format!("{count} frames from {first} to {last}");
            let [one, other] = comparison.frames.map(range);
            format!("equal in the {shared} frames they share; {a} has {one}, {b} has {other}\n")
        }
    };
    text
}
