//! `dynvox evaluate flight`.

use crate::flight::{Conditions, Flight, FlightFrame, FlightWorld, fly};
use anyhow::bail;
use rayon::prelude::*;
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct FlightArgs {
    /// World that is flown through
    #[arg(long, value_enum, default_value_t)]
    world: FlightWorld,
    /// Flights, each through a world of its own
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
    /// Print each picture of the first flight: where the vehicle was, what it was told
    #[arg(long)]
    trace: bool,
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

impl FlightArgs {
    fn conditions(&self, seed: u64) -> Conditions {
        let &Self { world, speed: speed_m_s, black, seconds, .. } = self;
        Conditions { world, seed, speed_m_s, black, seconds }
    }
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
    if args.trace {
        return trace(args);
    }
    // Flights know nothing of each other: any number of threads gives the same.
    let rows: Vec<FlightRow> = (args.seed..args.seed.saturating_add(args.trials))
        .into_par_iter()
        .map(|seed| {
            let flight = fly(&args.conditions(seed), |_| {})?;
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

/// Flies once and prints a row for each picture.
fn trace(args: &FlightArgs) -> anyhow::Result<()> {
    outln!(
        "| picture | ahead, m | speed, m/s | allowed | by, deg | told, m | free, m | least, m | |"
    );
    outln!("|---|---|---|---|---|---|---|---|---|");
    let flight = fly(&args.conditions(args.seed), |row| {
        let FlightFrame { frame, ahead_m, speed_m_s, allowed_m_s, .. } = *row;
        let FlightFrame { by_deg, told_m, free_m, clearance_m, is_black, is_placed, .. } = *row;
        let note = match (is_black, is_placed) {
            (true, _) => "black",
            (false, false) => "extrapolated",
            (false, true) => "",
        };
        outln!(
            "| {frame} | {ahead_m:.2} | {speed_m_s:.2} | {allowed_m_s:.2} | {by_deg:.0} | \
             {told_m:.2} | {free_m:.2} | {clearance_m:.2} | {note} |"
        );
    })?;
    print(&[FlightRow { seed: args.seed, flight }]);
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
                Flight { run_over: true, .. } => "was run over",
                _ => "stopped before nothing",
            };
            outln!("seed {seed}: {what} after {:.1} m", flight.flown_m);
        }
    }
}
