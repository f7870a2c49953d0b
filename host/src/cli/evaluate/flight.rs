//! `dynvox evaluate flight`.

use crate::flight::{Conditions, Flight, fly};
use anyhow::bail;
use rayon::prelude::*;
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct FlightArgs {
    /// Flights, each through a street of its own
    #[arg(long, default_value_t = 100, value_name = "N")]
    trials: u64,
    /// Seed of the first flight; the others count on from it
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    /// Speed that the vehicle would like to fly at, m/s
    #[arg(long, default_value_t = 4.0, value_name = "M_PER_S")]
    speed: f64,
    /// Share of pictures that come black, 0 to 1
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    black: f64,
    /// Length of a flight, s
    #[arg(long, default_value_t = 12.0, value_name = "S")]
    seconds: f64,
    /// Write all flights to standard output as JSON
    #[arg(long)]
    json: bool,
}

/// A flight with its seed.
#[derive(Serialize)]
struct FlightRow {
    seed: u64,
    #[serde(flatten)]
    flight: Flight,
}

pub fn run(args: &FlightArgs) -> anyhow::Result<()> {
    if !(0.1..=20.0).contains(&args.speed) {
        bail!("--speed {} is no speed for this vehicle. Give 0.1 to 20 m/s", args.speed);
    }
    if !(0.0..=1.0).contains(&args.black) {
        bail!("--black {} is no share. Give 0 to 1", args.black);
    }
    if !(1.0..=600.0).contains(&args.seconds) {
        bail!("--seconds {} is out of range. Give 1 to 600 s", args.seconds);
    }
    // Flights know nothing of each other: any number of threads gives the same.
    let rows: Vec<FlightRow> = (args.seed..args.seed.saturating_add(args.trials))
        .into_par_iter()
        .map(|seed| {
            let &FlightArgs { speed: speed_m_s, black, seconds, .. } = args;
            let flight = fly(&Conditions { seed, speed_m_s, black, seconds })?;
            Ok(FlightRow { seed, flight })
        })
        .collect::<anyhow::Result<_>>()?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&rows)?);
    } else {
        print(&rows);
    }
    Ok(())
}

/// Prints what happened, and each flight that ended badly.
fn print(rows: &[FlightRow]) {
    let count = |is: fn(&Flight) -> bool| rows.iter().filter(|row| is(&row.flight)).count();
    let flown_m: f64 = rows.iter().map(|row| row.flight.flown_m).sum();
    let stops: u32 = rows.iter().map(|row| row.flight.needless_stops).sum();
    outln!(
        "| flights | flown, m | collisions | run over | needless stops | stopped before obstacles |"
    );
    outln!("|---|---|---|---|---|---|");
    outln!(
        "| {} | {flown_m:.0} | {} | {} | {stops} | {} |",
        rows.len(),
        count(|flight| flight.collided),
        count(|flight| flight.run_over),
        count(|flight| flight.stopped)
    );
    for FlightRow { seed, flight } in rows {
        if flight.collided || flight.run_over || flight.needless_stops > 0 {
            let what = match flight {
                Flight { collided: true, .. } => "flew into something",
                Flight { run_over: true, .. } => "was run over while it stood",
                _ => "stopped before nothing",
            };
            outln!("seed {seed}: {what} after {:.1} m", flight.flown_m);
        }
    }
}
