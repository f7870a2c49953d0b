//! `dynvox bench`.

mod report;

use crate::run::{self, Bench};
use dynvox_core::parallel::Vectors;
use report::BoardReport;
use std::path::PathBuf;

/// Arguments of `dynvox bench`.
#[derive(Debug, clap::Args)]
pub struct BenchArgs {
    /// Write the figures to standard output as JSON, and nothing else
    #[arg(long)]
    json: bool,
    /// Leave out the kernels for vector instructions that not every machine of this kind has
    #[arg(long)]
    baseline: bool,
    /// Run once for each kind of vector instructions, compare the digests, and write machine,
    /// digests and times to this file as JSON, for others to compare with theirs
    #[arg(long, value_name = "FILE", conflicts_with_all = ["json", "baseline"])]
    report: Option<PathBuf>,
    /// Data set and options, as of `dynvox run`; the synthetic street without one
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "RUN OPTIONS")]
    run: Vec<String>,
}

pub fn run(args: &BenchArgs) -> anyhow::Result<()> {
    let plan = super::run::request_of(&args.run)?.resolve()?;
    if let Some(path) = &args.report {
        let report = BoardReport::new(&plan, &args.run)?;
        // Written first: figures of levels that differ are what a developer needs.
        report.write(path)?;
        report.print();
        outln!("\nwritten to {}", path.display());
        return report.check_digests();
    }
    let bench =
        run::bench(&plan, if args.baseline { Vectors::BASELINE } else { Vectors::detect() })?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&bench)?);
    } else {
        print(&bench);
    }
    Ok(())
}

/// Prints the costs of the stages, of the most expensive steps, and of the units of work.
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
    outln!("\nSteps that cost most, ms: by CPU time, and by counted work");
    outln!(
        "{:<13}{:>11}{:>9}{:>9}{:>9}{:>19}",
        "",
        "median",
        "p99",
        "p99.9",
        "worst",
        "p99.9 / median"
    );
    for tail in &bench.tails {
        outln!(
            "{:<13}{:>11.2}{:>9.2}{:>9.2}{:>9.2}{:>19.2}",
            tail.cost,
            tail.median_ms,
            tail.p99_ms,
            tail.p999_ms,
            tail.worst_ms,
            tail.p999_ms / tail.median_ms
        );
    }
    // A few frames tell nothing of a prediction's error.
    if bench.units.is_empty() {
        return;
    }
    outln!("\nTime of a unit of work, by half of the frames; its error in the other half");
    outln!(
        "{:<13}{:<20}{:>9}{:>12}{:>9}{:>15}",
        "stage",
        "unit",
        "ns",
        "error, %",
        "worst",
        "at bound, ms"
    );
    for unit in &bench.units {
        outln!(
            "{:<13}{:<20}{:>9.1}{:>12.0}{:>9.0}{:>15.1}",
            unit.stage,
            unit.unit,
            unit.ns,
            100.0 * unit.error,
            100.0 * unit.error_max,
            unit.bound_ms
        );
    }
}
