//! `dynvox evaluate faults`.

use super::mapped::each_report;
use crate::cli::run;
use crate::evaluate::certainty::PathHonesty;
use crate::evaluate::faults::{EvaluatedFrame, FaultOutcome};
use crate::evaluate::gauntlet::Trial;
use crate::request::{Plan, Request, Source};
use anyhow::{Context, bail};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct FaultsArgs {
    /// Frame that faults begin in
    #[arg(long, default_value_t = 20, value_name = "N")]
    at: usize,
    /// Frames of a run
    #[arg(long, default_value_t = 44, value_name = "N")]
    frames: usize,
    /// One fault instead of the list, as `dynvox run --faults` takes it; may be repeated
    #[arg(long, value_name = "SPEC")]
    fault: Vec<String>,
    /// Only rows whose kind has this word, or of this world: street, room, yard
    #[arg(long, value_name = "WORD", conflicts_with = "fault")]
    only: Option<String>,
    /// Only a few rows, one for each cause of errors
    #[arg(long, conflicts_with = "fault")]
    short: bool,
    /// Seed of the synthetic worlds
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Write the table to standard output as JSON
    #[arg(long)]
    json: bool,
    /// Arguments of `dynvox run` after --: a data set with true poses, settings
    #[arg(last = true, value_name = "RUN ARGUMENTS")]
    run: Vec<String>,
}

/// A line of the table.
#[derive(Serialize)]
struct FaultRow {
    #[serde(flatten)]
    trial: Trial,
    #[serde(flatten)]
    outcome: FaultOutcome,
    /// Root mean squares over estimated poses since the fault, m: of the error, and of its sigma.
    error_m: f64,
    sigma_m: f64,
    /// Errors of these poses within two sigma, all six directions together.
    within: u32,
    compared: u32,
}

/// Heads of the table's columns.
const HEADS: [&str; 12] = [
    "scene",
    "fault",
    "error, m (RMS)",
    "sigma, m (RMS)",
    "within 2 sigma, %",
    "unreported error, m",
    "deg",
    "wrong and unreported",
    "fused from a wrong pose",
    "extrapolated",
    "map affected",
    "recovered after",
];

pub fn run(args: &FaultsArgs) -> anyhow::Result<()> {
    if args.at == 0 || args.at >= args.frames {
        bail!(
            "--at {} leaves no frame before or after it. Give 1 to {}",
            args.at,
            args.frames.saturating_sub(1)
        );
    }
    let mut rows = Vec::new();
    if !args.json {
        outln!("| {} |", HEADS.join(" | "));
        outln!("|{}", "---|".repeat(HEADS.len()));
    }
    for trial in trials(args)? {
        let row = tried(args, trial)?;
        if !args.json {
            outln!("{}", line(&row));
        }
        rows.push(row);
    }
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&rows)?);
    } else {
        outln!("{}", total(&rows));
    }
    Ok(())
}

/// Rows that are asked for.
fn trials(args: &FaultsArgs) -> anyhow::Result<Vec<Trial>> {
    if !args.fault.is_empty() {
        return Ok(args.fault.iter().map(|fault| Trial::from_fault(fault)).collect());
    }
    // A recording has no other worlds than its own.
    let is_rendered = !matches!(run::request_of(&args.run)?.input.source, Source::Recording(_));
    let mut trials = Trial::listed(args.at);
    trials.retain(|trial| {
        (is_rendered || trial.fits_any_data())
            && (!args.short || trial.is_short())
            && args.only.as_ref().is_none_or(|word| trial.is_of(word))
    });
    if trials.is_empty() {
        bail!("no row of the table is asked for. Try --only with another word, or without it");
    }
    Ok(trials)
}

fn line(FaultRow { trial, outcome, error_m, sigma_m, within, compared }: &FaultRow) -> String {
    let FaultOutcome {
        unreported_m,
        unreported_deg,
        unreported_frames,
        wrong_fused,
        extrapolated,
        map_affected,
        recovered_after,
    } = outcome;
    let (name, fault) = (trial.name(), &trial.fault);
    let fault = if fault.is_empty() { String::new() } else { format!("`{fault}`") };
    let recovered = recovered_after.map_or_else(|| "not".to_owned(), |frames| frames.to_string());
    let share = percent(*within, *compared);
    format!(
        "| {name} | {fault} | {error_m:.3} | {sigma_m:.3} | {share} | {unreported_m:.2} \
         | {unreported_deg:.2} | {unreported_frames} | {wrong_fused} | {extrapolated} \
         | {map_affected} | {recovered} |"
    )
}

/// Share in percent; a dash of nothing.
fn percent(part: u32, whole: u32) -> String {
    if whole == 0 {
        "-".to_owned()
    } else {
        format!("{:.1}", 100.0 * f64::from(part) / f64::from(whole))
    }
}

/// Sentence on all rows.
fn total(rows: &[FaultRow]) -> String {
    let wrong = |row: &FaultRow| row.outcome.unreported_frames;
    let (frames, bad) =
        (rows.iter().map(wrong).sum::<usize>(), rows.iter().filter(|r| wrong(r) > 0));
    let within = rows.iter().map(|row| row.within).sum();
    let compared = rows.iter().map(|row| row.compared).sum();
    format!(
        "{} rows: {frames} frames wrong and unreported, in {} rows; {} % of the errors within \
         2 sigma",
        rows.len(),
        bad.count(),
        percent(within, compared)
    )
}

/// Maps a row's scene with its fault and compares with the truth.
fn tried(args: &FaultsArgs, trial: Trial) -> anyhow::Result<FaultRow> {
    let plan = || -> anyhow::Result<Plan> {
        let own = if trial.fits_any_data() && args.seed.is_none() {
            Vec::new()
        } else {
            trial.arguments(args.seed)
        };
        let mut request: Request = run::request_of(&[&own[..], &args.run].concat())?;
        request.frames.most = request.frames.most.or(Some(args.frames));
        if !trial.fault.is_empty() {
            request.input.faults = Some(trial.fault.parse().map_err(anyhow::Error::msg)?);
        }
        Ok(request.resolve()?)
    };
    let plan =
        plan().with_context(|| format!("{}{} cannot be tried", trial.name(), trial.fault))?;
    let (mut frames, mut path) = (Vec::new(), PathHonesty::default());
    each_report(&plan, |report, true_t_world_camera| {
        frames.push(EvaluatedFrame {
            t_world_camera: report.t_world_camera,
            true_t_world_camera: *true_t_world_camera,
            pose: report.pose,
            severity: report.severity(),
            fused: report.fused,
            segment: report.segment.get().into(),
        });
        // Poses count from the frame before the fault, as they do in the outcome.
        if frames.len() >= args.at {
            path.add(report, true_t_world_camera);
        }
    })?;
    let outcome = FaultOutcome::from_frames(&frames, args.at);
    let [error_m, sigma_m] = path.poses.distances_m();
    let (within, compared) = (path.poses.within.iter().sum(), 6 * path.poses.count);
    Ok(FaultRow { trial, outcome, error_m, sigma_m, within, compared })
}
