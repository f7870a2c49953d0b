//! `dynvox evaluate certainty`.

use super::mapped::each_report;
use crate::cli::run;
use crate::evaluate::certainty::{DIRECTIONS, Honesty, PathHonesty};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct CertaintyArgs {
    /// Write the figures to standard output as JSON
    #[arg(long)]
    json: bool,
    /// Arguments of `dynvox run` after --: a data set with true poses, settings
    #[arg(last = true, value_name = "RUN ARGUMENTS")]
    run: Vec<String>,
}

/// Figures of a run.
#[derive(Serialize)]
struct Figures {
    motions: Honesty,
    poses: Honesty,
}

pub fn run(args: &CertaintyArgs) -> anyhow::Result<()> {
    let plan = run::request_of(&args.run)?.resolve()?;
    let mut path = PathHonesty::default();
    each_report(&plan, |report, truth| path.add(report, truth))?;
    let figures = Figures { motions: path.motions, poses: path.poses };
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&figures)?);
        return Ok(());
    }
    outln!("| of | direction | within 2 sigma | error (RMS) | sigma (RMS) |");
    outln!("|---|---|---|---|---|");
    for (of, honesty) in [("motion", figures.motions), ("pose", figures.poses)] {
        let ([errors, sigmas], shares) = (honesty.sizes(), honesty.shares());
        for (at, direction) in DIRECTIONS.iter().enumerate() {
            // Angles in thousandths of a degree, lengths in mm.
            let (scale, unit) = if at < 3 { (1e3f64.to_degrees(), "mdeg") } else { (1e3, "mm") };
            outln!(
                "| {of} | {direction} | {:.1} % | {:.2} {unit} | {:.2} {unit} |",
                100.0 * shares[at],
                scale * errors[at],
                scale * sigmas[at]
            );
        }
    }
    outln!("{} motions, {} poses", figures.motions.count, figures.poses.count);
    Ok(())
}
