//! `dynvox evaluate places`.

use crate::cli::localize::NEVER;
use crate::cli::run::request_of;
use crate::evaluate::quantile::{ascending, quantile};
use crate::request::{Request, Source};
use crate::run::{PlacedFrame, Remembered, localize_among, remember};
use crate::synth::{Town, TownConfig, World};
use anyhow::{Context as _, bail};
use dynvox_core::geometry::Transform;
use serde::Serialize;

/// Keyframes where none are asked for.
const KEYFRAMES: usize = 1_000;
/// Error from which on a place is a wrong one: three times what a sound place was ever off by.
const WRONG_M: f64 = 2.0;
const WRONG_DEG: f64 = 5.0;

#[derive(Debug, clap::Args)]
pub struct PlacesArgs {
    /// Seed of the town
    #[arg(long, default_value_t = 12, value_name = "N")]
    seed: u64,
    /// Recordings of each kind; their beginnings are spread over the lap
    #[arg(long, default_value_t = 10, value_name = "N")]
    beginnings: usize,
    /// Frames of a recording, among which one must be placed
    #[arg(long, default_value_t = 30, value_name = "N")]
    within: usize,
    /// Only kinds whose name has this word: cars, sun, left, round
    #[arg(long, value_name = "WORD")]
    only: Option<String>,
    /// Write all recordings to standard output as JSON
    #[arg(long)]
    json: bool,
    /// Arguments of `dynvox run` after --: settings of the town, the mapper and the images
    #[arg(last = true, value_name = "RUN ARGUMENTS")]
    run: Vec<String>,
}

/// Difference of a recording from the first one.
type Another = fn(&mut TownConfig);

/// Kinds of recordings. All have other parked cars, traffic and noise.
const KINDS: [(&str, Another); 4] = [
    ("other cars", |_| {}),
    ("other cars, sun turned by 90 degrees", |town| town.sun_turn_deg += 90.0),
    ("other cars, 3 m to the left", |town| town.lane_shift_m += 3.0),
    ("other cars, the other way round", |town| town.reverse = !town.reverse),
];

/// A recording that was to be placed.
#[derive(Serialize)]
struct PlacesRow {
    kind: &'static str,
    start: usize,
    /// Frames until the first that is placed, that one counted.
    frames: Option<usize>,
    /// Largest errors over its placed frames.
    error_m: f64,
    error_deg: f64,
}

impl PlacesRow {
    fn is_wrong(&self) -> bool {
        self.error_m > WRONG_M || self.error_deg > WRONG_DEG
    }
}

pub fn run(args: &PlacesArgs) -> anyhow::Result<()> {
    let mut request = request_of(&args.run)?;
    if !matches!(request.input.source, Source::Street | Source::Town) {
        bail!("only a town has another day: give settings after --, and no data set");
    }
    request.input.source = Source::Town;
    request.settings.street_mut().seed = args.seed;
    request.settings.town_mut().laps = 1.0;
    request.settings.mapper.fuse_every = NEVER;
    if request.bounds.keyframes == 0 {
        request.bounds.keyframes = KEYFRAMES;
    }
    let town = town_of(&request)?;
    let first = First { remembered: remember(&request.clone().resolve()?)?, town };
    let asked = |name: &str| args.only.as_ref().is_none_or(|word| name.contains(word.as_str()));
    let mut rows = Vec::new();
    for (kind, another) in KINDS.into_iter().filter(|(name, _)| asked(name)) {
        let mut request = request.clone();
        another(request.settings.town_mut());
        request.settings.town_mut().recording += 1;
        request.frames.most = Some(args.within);
        let lap = town_of(&request)?.frames() as usize;
        for number in 0..args.beginnings {
            request.frames.start = number * lap / args.beginnings;
            rows.push(first.row(kind, &request)?);
        }
    }
    if rows.is_empty() {
        bail!(
            "no recording is asked for. Try --only with another word, and --beginnings 1 or more"
        );
    }
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&rows)?);
    } else {
        print(&rows);
    }
    Ok(())
}

fn town_of(request: &Request) -> anyhow::Result<Town> {
    Ok(Town::new(request.settings.street(), request.settings.town())?)
}

/// First recording, among whose keyframes the others are placed.
struct First {
    remembered: Remembered,
    town: Town,
}

impl First {
    /// Places a recording, and compares its poses with the true ones.
    fn row(&self, kind: &'static str, request: &Request) -> anyhow::Result<PlacesRow> {
        let start = request.frames.start;
        let town = town_of(request)?;
        let placed = localize_among(&request.clone().resolve()?, &self.remembered)?.placed;
        let frames = placed.first().map(|at| at.frame - start + 1);
        let mut row = PlacesRow { kind, start, frames, error_m: 0.0, error_deg: 0.0 };
        for at in &placed {
            let error = self.error(at, &town).context("the first recording has no pose")?;
            row.error_m = row.error_m.max(error.distance_m());
            row.error_deg = row.error_deg.max(error.angle_rad().to_degrees());
        }
        Ok(row)
    }

    /// Error of a placed frame against the first recording's nearest one, whose own drift is none
    /// of it.
    fn error(&self, at: &PlacedFrame, town: &Town) -> Option<Transform> {
        let t_town_camera = town.t_town_world() * town.t_world_camera(at.frame as u32);
        let from_town = self.town.t_town_world().inverse();
        let t_world_camera = from_town * t_town_camera;
        let relative =
            |frame: usize| self.town.t_world_camera(frame as u32).inverse() * t_world_camera;
        let poses = self.remembered.poses.iter();
        let near = poses.map(|&(frame, pose)| (relative(frame), pose));
        let (relative, pose) =
            near.min_by(|(a, _), (b, _)| a.distance_m().total_cmp(&b.distance_m()))?;
        Some((pose * relative).inverse() * at.t_world_camera)
    }
}

fn print(rows: &[PlacesRow]) {
    outln!("| recording | placed | frames until then, median and most | largest error | wrong |");
    outln!("|---|---|---|---|---|");
    for of_kind in rows.chunk_by(|a, b| a.kind == b.kind) {
        let frames = ascending(of_kind.iter().filter_map(|row| row.frames).map(|n| n as f64));
        let most = |of: fn(&PlacesRow) -> f64| of_kind.iter().map(of).fold(0.0, f64::max);
        outln!(
            "| {} | {} of {} | {}, {} | {:.2} m, {:.2} degrees | {} |",
            of_kind[0].kind,
            frames.len(),
            of_kind.len(),
            quantile(&frames, 0.5).map_or("-".to_owned(), |n| n.to_string()),
            frames.last().map_or("-".to_owned(), |n| n.to_string()),
            most(|row| row.error_m),
            most(|row| row.error_deg),
            of_kind.iter().filter(|row| row.is_wrong()).count()
        );
    }
}
