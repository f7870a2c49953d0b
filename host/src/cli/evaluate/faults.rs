//! `dynvox evaluate faults`.

use super::mapped::each_report;
use crate::cli::run;
use crate::evaluate::faults::{EvaluatedFrame, FaultOutcome};
use crate::request::{Plan, Request};
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
    fault: String,
    #[serde(flatten)]
    outcome: FaultOutcome,
}

/// The faults of the table that begin in frame `at`.
fn listed(at: usize) -> Vec<String> {
    let (next, third, fifth) = (at + 1, at + 3, at + 5);
    [
        format!("drop@{at}"),
        format!("drop@{at}..{fifth}"),
        format!("duplicate@{at}"),
        format!("duplicate@{at}..{third}"),
        format!("swap@{at}"),
        format!("exchange@{at}"),
        format!("exchange@{at}.."),
        format!("freeze:right@{at}.."),
        format!("freeze:left@{at}.."),
        format!("freeze@{at}..{fifth}"),
        format!("delay:right@{at}.."),
        format!("delay:left@{at}.."),
        format!("black@{at}"),
        format!("black@{at}..{fifth}"),
        format!("black:right@{at}..{third}"),
        format!("noise=10@{at}.."),
        format!("noise=40@{at}..{fifth}"),
        format!("occlude=0.5@{at}..{fifth}"),
        format!("occlude:left=0.9@{at}..{fifth}"),
        format!("brightness=0.3@{at}..{fifth}"),
        format!("brightness:right=1.5@{at}.."),
        format!("jump=2@{at}"),
        format!("jump=10@{at}"),
        format!("jump=20@{at}"),
        format!("jump=30@{at}"),
        format!("jump=100@{at}"),
        format!("masks@{at}"),
        format!("masks@{at}..{fifth}"),
        format!("drop@{at}..%20"),
        format!("black@{at},drop@{next}"),
    ]
    .into()
}

pub fn run(args: &FaultsArgs) -> anyhow::Result<()> {
    if args.at == 0 || args.at >= args.frames {
        bail!(
            "--at {} leaves no frame before or after it. Give 1 to {}",
            args.at,
            args.frames.saturating_sub(1)
        );
    }
    let mut request = run::request_of(&args.run)?;
    request.frames.most = request.frames.most.or(Some(args.frames));
    let faults = if args.fault.is_empty() { listed(args.at) } else { args.fault.clone() };
    let mut rows = Vec::new();
    if !args.json {
        outln!(
            "| fault | unreported error, m | deg | wrong and unreported | fused from a wrong pose \
             | extrapolated | map affected | recovered after |"
        );
        outln!("|---|---|---|---|---|---|---|---|");
    }
    for fault in faults {
        let row = FaultRow { outcome: outcome(&request, &fault, args.at)?, fault };
        if !args.json {
            outln!("{}", line(&row));
        }
        rows.push(row);
    }
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&rows)?);
    }
    Ok(())
}

fn line(FaultRow { fault, outcome }: &FaultRow) -> String {
    let FaultOutcome {
        unreported_m,
        unreported_deg,
        unreported_frames,
        wrong_fused,
        extrapolated,
        map_affected,
        recovered_after,
    } = outcome;
    let recovered = recovered_after.map_or_else(|| "not".to_owned(), |frames| frames.to_string());
    format!(
        "| `{fault}` | {unreported_m:.2} | {unreported_deg:.2} | {unreported_frames} \
         | {wrong_fused} | {extrapolated} | {map_affected} | {recovered} |"
    )
}

/// Maps with one fault and compares with the truth.
fn outcome(request: &Request, fault: &str, at: usize) -> anyhow::Result<FaultOutcome> {
    let trial = || -> anyhow::Result<Plan> {
        let mut request = request.clone();
        request.input.faults = Some(fault.parse().map_err(anyhow::Error::msg)?);
        Ok(request.resolve()?)
    };
    let plan = trial().with_context(|| format!("{fault} cannot be tried"))?;
    Ok(FaultOutcome::from_frames(&evaluated(&plan)?, at))
}

/// Maps the frames of a plan and puts the truth beside each.
fn evaluated(plan: &Plan) -> anyhow::Result<Vec<EvaluatedFrame>> {
    let mut frames = Vec::new();
    each_report(plan, |report, true_t_world_camera| {
        frames.push(EvaluatedFrame {
            t_world_camera: report.t_world_camera,
            true_t_world_camera: *true_t_world_camera,
            pose: report.pose,
            severity: report.severity(),
            fused: report.fused,
            segment: report.segment.get().into(),
        });
    })?;
    Ok(frames)
}
