//! `dynvox bench`.

use crate::run::{self, Bench};
use dynvox_core::parallel::Vectors;

/// Arguments of `dynvox bench`.
#[derive(Debug, clap::Args)]
pub struct BenchArgs {
    /// Write the figures to standard output as JSON, and nothing else
    #[arg(long)]
    json: bool,
    /// Leave out the kernels for vector instructions that not every machine of this kind has
    #[arg(long)]
    baseline: bool,
    /// Data set and options, as of `dynvox run`; the synthetic street without one
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "RUN OPTIONS")]
    run: Vec<String>,
}

pub fn run(args: &BenchArgs) -> anyhow::Result<()> {
    let plan = super::run::request_of(&args.run)?.resolve()?;
    let bench =
        run::bench(&plan, if args.baseline { Vectors::BASELINE } else { Vectors::detect() })?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&bench)?);
    } else {
        print(&bench);
    }
    Ok(())
}

fn print(bench: &Bench) {
    outln!("CPU time, ms, medians of {} frames, {} kernels", bench.frames, bench.vectors);
    outln!(
        "{:<13}{:>11}{:>19}{:>17}",
        "stage",
        "one thread",
        "two, at the least",
        "any, at the least"
    );
    for stage in &bench.stages {
        outln!(
            "{:<13}{:>11.2}{:>19.2}{:>17.2}",
            stage.name,
            stage.work_ms,
            stage.two_threads_ms,
            stage.span_ms
        );
    }
}
