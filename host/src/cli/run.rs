//! `dynvox run`.

mod resume;

use super::capacity::CapacityArgs;
use super::egomotion::EgomotionChoice;
use super::settings::Settings;
use crate::evaluate::objects::Medians;
use crate::formats;
use crate::input::depth::{self, DepthChoice};
use crate::input::masks::{self, MaskChoice};
use crate::input::{self, CameraPair, FrameSource, Layout, OpenOptions, Scaled, Stacking};
use crate::observe::Reference;
use crate::report::{self, Summary};
use crate::run::{self, FolderError, HOST_OVERHEAD_BYTES, Plan, RunError, RunFolder, RunRecord, Stopped, Streaming};
use anyhow::bail;
use std::path::{Path, PathBuf};

const MIB: u64 = 1 << 20;
/// Where run folders go unless `--out` says otherwise.
const DEFAULT_PARENT: &str = "out";

#[derive(Debug, clap::Args)]
pub struct RunArgs {
    /// Data set to map; the synthetic street without one
    path: Option<PathBuf>,
    /// Sequence within the data set: 06, 0003
    #[arg(long, value_name = "NAME")]
    sequence: Option<String>,
    /// Layout of the data set; guessed from the path unless given
    #[arg(long, value_enum)]
    dataset: Option<Layout>,
    /// Camera pair of KITTI odometry
    #[arg(long, value_enum, default_value_t)]
    images: CameraPair,
    /// Significant bits of 16-bit images, 8 to 16; told from the largest value of some of them otherwise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=16))]
    bits: Option<u32>,
    /// Both images of a pair lie in one file [default: told from the calibration]
    #[arg(long, value_enum, value_name = "HOW")]
    stacked: Option<Stacking>,
    /// Calibration in place of the recording's own: KITTI's P0 and P1 lines, or focal_px, center_u_px, center_v_px, baseline_m
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    #[command(flatten)]
    bounds: CapacityArgs,
    /// Threads; the result does not depend on them [default: as many as the machine has, at most 4]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// First frame
    #[arg(long, default_value_t = 0, value_name = "N")]
    start: usize,
    /// Frames to map at most
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Take every N-th frame
    #[arg(long, default_value_t = 1, value_name = "N")]
    stride: usize,
    /// Shrink the images, above 0 and up to 1
    #[arg(long, default_value_t = 1.0, value_name = "S")]
    scale: f64,
    /// Where depth comes from: elas (stereo matching here), files:DIR (PNG, PFM or OpenCV XML named as the images; depth where DIR's name
    /// speaks of depth and not of disparity), disparity:DIR, depth:DIR, or exact (the synthetic street)
    #[arg(long, default_value = "elas", value_name = "SOURCE")]
    depth: DepthChoice,
    /// Where masks of what could move come from: auto, none, files:DIR (PNG and list), mots:DIR or FILE (KITTI-MOTS), mnc:DIR, exact or
    /// noisy[:SEED] (the synthetic street)
    #[arg(long, default_value = "auto", value_name = "SOURCE")]
    instances: MaskChoice,
    /// Whether what moves is kept out of the static map and reconstructed apart; off fuses everything into one map [default: on]
    #[arg(long, value_name = "on|off", value_parser = on_or_off)]
    dynamic: Option<bool>,
    /// Where the camera's motion comes from: stereo (matches over two pairs), icp (depth against the map, the baseline of hand-held mappers:
    /// expected to fail on a drive), or file:POSES (KITTI or TUM) [default: stereo]
    #[arg(long, value_name = "SOURCE")]
    egomotion: Option<EgomotionChoice>,
    /// Fuse every K-th frame; the camera is followed in all [default: 1]
    #[arg(long, value_name = "K")]
    fuse_every: Option<u32>,
    /// Settings from a file; config.toml of an earlier run is one
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One setting, over those of the file; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Lose the blocks that leave the full pool; otherwise they go to map.blocks in the run folder, come back when seen again, and are in map.ply
    #[arg(long)]
    no_stream: bool,
    /// Let map.blocks grow to so many MiB at most; the disk is the limit otherwise
    #[arg(long, value_name = "MIB", conflicts_with = "no_stream")]
    stream_mib: Option<u64>,
    /// Leave map.blocks in the run folder when the mesh is written
    #[arg(long, conflicts_with = "no_stream")]
    keep_blocks: bool,
    /// Hold input and map against LiDAR scans or the synthetic street's exact depth: accuracy and completeness, of the street and of cars
    #[arg(long, value_enum, value_name = "REFERENCE")]
    evaluate: Option<Reference>,
    /// Hold the map against a frame so many frames later, when pruning has been there
    #[arg(long, default_value_t = 0, value_name = "N")]
    evaluation_delay: usize,
    /// Fail at the first frame that harms the map: a guessed pose, a block lost or refused
    #[arg(long)]
    strict: bool,
    /// Fail when the process holds more than so many MiB [default: the slab and 256]
    #[arg(long, value_name = "MIB")]
    rss_limit_mib: Option<u64>,
    /// Write a snapshot every N frames, so that a run that was stopped can go on: at most N frames are mapped again. --evaluate holds more than
    /// a snapshot does, and cannot be had with it
    #[arg(long, value_name = "N", conflicts_with = "evaluate")]
    snapshot_every: Option<usize>,
    /// Let a stopped run go on from its last snapshot, into RUN_FOLDER, where it was to end. Settings and data set are those it was begun with; only
    /// --threads, --rss-limit-mib, --snapshot-every, --json and --quiet may be given anew
    #[arg(long, value_name = "RUN_FOLDER", conflicts_with_all = resume::BEGUN)]
    resume: Option<PathBuf>,
    /// Folder for the results [default: out/<data set>-NNN]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the run folder that is there
    #[arg(long)]
    overwrite: bool,
    /// Write the summary to standard output as JSON, and nothing else
    #[arg(long)]
    json: bool,
    /// Show no progress
    #[arg(long)]
    quiet: bool,
}

/// The arguments of a run without the command's name.
#[derive(clap::Parser)]
struct Alone {
    #[command(flatten)]
    args: RunArgs,
}

impl RunArgs {
    /// What `dynvox` alone means.
    pub fn of_nothing() -> Self {
        <Alone as clap::Parser>::parse_from(["dynvox"]).args
    }

    /// What a line of arguments means, the program's name first.
    pub fn of(line: &[String]) -> Result<Self, clap::Error> {
        Ok(<Alone as clap::Parser>::try_parse_from(line)?.args)
    }

    fn silent(&self) -> bool {
        self.quiet || self.json
    }

    fn options(&self) -> OpenOptions {
        OpenOptions {
            layout: self.dataset,
            sequence: self.sequence.clone(),
            cameras: self.images,
            bits: self.bits,
            stacking: self.stacked,
            calibration: self.calibration.clone(),
        }
    }

    fn open(&self, settings: &Settings) -> anyhow::Result<Box<dyn FrameSource>> {
        let dataset: Box<dyn FrameSource> = match &self.path {
            Some(path) => input::open(path, &self.options())?,
            None if self.dataset.is_some() || self.sequence.is_some() => {
                bail!("--dataset and --sequence need a data set. Give its path: `dynvox run PATH`")
            }
            None => super::synth::street(settings)?,
        };
        let dataset = depth::attach(dataset, &self.depth)?;
        let dataset = if self.scale == 1.0 { dataset } else { Box::new(Scaled::new(dataset, self.scale)?) };
        Ok(masks::attach(dataset, &self.instances)?)
    }
}

fn on_or_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("say on or off".to_owned()),
    }
}

/// What a run is to do.
fn plan(args: &RunArgs) -> anyhow::Result<Plan> {
    let mut settings = Settings::resolve(args.config.as_deref(), &args.set)?;
    let threads = args.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from).min(4));
    if threads == 0 || args.stride == 0 || args.frames == Some(0) {
        bail!("--threads, --stride and --frames begin at 1. Give a larger number");
    }
    let dataset = args.open(&settings)?;
    let (profile, capacity) = args.bounds.resolve(dataset.size(), settings.voxel_size_m())?;
    settings.fit(&capacity);
    let indices = run::frame_indices(dataset.len(), args.start, args.stride, args.frames)?;
    if let Some(interval_s) = run::frame_interval_s(dataset.as_ref(), &indices) {
        settings.set_frame_interval_s(interval_s);
    }
    if let Some(dynamic) = args.dynamic {
        settings.set_dynamic(dynamic);
    }
    if let Some(fuse_every) = args.fuse_every {
        settings.set_fuse_every(fuse_every);
    }
    let poses = match &args.egomotion {
        Some(choice) => choice.apply(&mut settings, dataset.as_ref(), &indices)?,
        None => None,
    };
    Ok(Plan {
        indices,
        poses,
        profile,
        capacity,
        config: settings.config(dataset.rig()),
        config_toml: settings.to_toml(args.path.is_none())?,
        threads,
        snapshots: None,
        streaming: (!args.no_stream).then_some(Streaming {
            most_bytes: args.stream_mib.map(|mib| mib.saturating_mul(MIB)),
            keep_file: args.keep_blocks,
        }),
        strict: args.strict,
        evaluate: args.evaluate,
        evaluation_delay: args.evaluation_delay,
        rss_limit_bytes: args.rss_limit_mib.map_or(capacity.bytes() as u64 + HOST_OVERHEAD_BYTES, |mib| mib.saturating_mul(MIB)),
        quiet: args.silent(),
        dataset,
    })
}

/// Maps into a folder, and tells what does not fit with what would.
fn map(plan: &Plan, folder: &RunFolder, stopped: Option<Stopped>) -> anyhow::Result<RunRecord> {
    run::run(plan, folder, stopped).map_err(|error| match error {
        RunError::ImageSize { .. } | RunError::Window { .. } => anyhow::anyhow!("{error}\n\n{}", super::budget::table(&plan.config.volume)),
        error @ (RunError::Resume(_) | RunError::Reopen(_)) => error.into(),
        error if folder.snapshot().is_file() => {
            anyhow::anyhow!(
                "{error}.\nWhat was mapped before is kept: `dynvox run --resume {}` lets the run go on",
                folder.target().display()
            )
        }
        error => error.into(),
    })
}

/// A run of which no folder stays.
pub fn record(args: &RunArgs, workshop: &Path) -> anyhow::Result<RunRecord> {
    map(&plan(args)?, &RunFolder::begin(workshop, true)?, None)
}

pub fn run(args: &RunArgs) -> anyhow::Result<()> {
    if let Some(target) = &args.resume {
        return resume::run(args, target);
    }
    let mut plan = plan(args)?;
    plan.snapshots = args.snapshot_every.map(|every| resume::snapshots(&plan, every)).transpose()?;
    let target = args.out.clone().unwrap_or_else(|| RunFolder::next_name(Path::new(DEFAULT_PARENT), plan.dataset.name()));
    let folder = RunFolder::begin(&target, args.overwrite)?;
    if !args.silent() {
        introduce(&plan);
        if plan.snapshots.is_some() {
            eprintln!("note: should it be stopped, `dynvox run --resume {}` lets it go on", target.display());
        }
    }
    finish(args, &plan, folder, None)
}

/// Maps, writes what there is to say of it, and puts the folder in its place.
fn finish(args: &RunArgs, plan: &Plan, folder: RunFolder, stopped: Option<Stopped>) -> anyhow::Result<()> {
    let record = map(plan, &folder, stopped)?;
    let summary = Summary::of(&record);
    write(&folder, &record, &summary)?;
    let place = folder.commit(&record.served())?;
    if args.json {
        println!("{}", serde_json::to_string_pretty(&summary)?);
    } else if !args.quiet {
        conclude(&record, &place);
    }
    Ok(())
}

fn write(folder: &RunFolder, run: &RunRecord, summary: &Summary) -> Result<(), FolderError> {
    let poses = run.poses();
    let times: Vec<f64> = run.rows.iter().map(|row| row.time_s).collect();
    folder.write("config.toml", |out| std::io::Write::write_all(out, run.config_toml.as_bytes()))?;
    folder.write("trajectory_kitti.txt", |out| formats::write_kitti(out, &poses))?;
    folder.write("trajectory_tum.txt", |out| formats::write_tum(out, &times, &poses))?;
    folder.write("frames.csv", |out| report::write_frames(out, &run.rows))?;
    folder.write("tracks.csv", |out| report::write_tracks(out, &run.rows))?;
    if !run.objects.judged.is_empty() {
        folder.write("tracks_truth.csv", |out| report::write_tracks_truth(out, &run.rows, &run.objects.judged))?;
    }
    if let Some(lidar) = &run.lidar {
        folder.write("lidar.csv", |out| report::write_lidar(out, &lidar.frames))?;
    }
    folder.write("report.html", |out| report::html::write(out, run))?;
    folder.write("summary.json", |out| Ok(serde_json::to_writer_pretty(out, summary)?))
}

fn introduce(plan: &Plan) {
    let (width, height) = plan.dataset.size();
    eprintln!(
        "{}: {} frames of {width} x {height} px, profile {}, {} thread{}",
        plan.dataset.name(),
        plan.indices.len(),
        plan.profile,
        plan.threads,
        if plan.threads == 1 { "" } else { "s" }
    );
    for note in plan.dataset.notes() {
        eprintln!("note: {note}");
    }
}

fn conclude(run: &RunRecord, place: &Path) {
    let line = |name: &str, value: String| println!("{name:<22}{value}");
    line("frames", format!("{} at {:.1} fps", run.rows.len(), run.fps()));
    if let Some(errors) = &run.errors {
        if let (Some(percent), Some(deg_per_m)) = (errors.t_err_percent, errors.r_err_deg_per_m) {
            line("trajectory error", format!("{percent:.3} %, {deg_per_m:.4} deg/m over pieces"));
        }
        line("", format!("{:.2} cm, {:.4} deg per frame; ATE {:.3} m", 100.0 * errors.rpe_t_m, errors.rpe_r_deg, errors.ate_m));
    }
    if let Some(exact) = &run.exact {
        line(
            "map against truth",
            format!("median {:.1} cm, {:.1} % complete within 20 m", 100.0 * exact.median_error_m, 100.0 * exact.completeness),
        );
    }
    if let Some(figures) = run.lidar.as_ref().and_then(|lidar| lidar.figures.as_ref()) {
        let percent = |share: Option<f64>| share.map_or("-".to_owned(), |share| format!("{:.1} %", 100.0 * share));
        for (name, of) in [("street", &figures.still), ("cars", &figures.dynamic)] {
            let (input, map) = (&of.input, &of.fused);
            if of.frames > 0 {
                let [right, there] = [&input.accuracy, &input.completeness].map(|share| percent(*share));
                line(
                    &format!("{} against {}", name, figures.source),
                    format!("input {right} right, {there} complete; map {} and {}", percent(map.accuracy), percent(map.completeness)),
                );
            }
        }
    }
    if let Some(figures) = &run.objects.figures {
        let (near, far) = (&figures.late_near, &figures.late_far);
        line(
            "tracks against truth",
            format!(
                "{} of {} late within 20 m, {} of {} at 20 to 32 m; {} flips",
                near.late, near.tracks, far.late, far.tracks, figures.flips
            ),
        );
        let error = |of: &Medians| match (of.t_m, of.r_deg) {
            (Some(t_m), Some(r_deg)) => format!("{:.1} cm, {r_deg:.2} deg", 100.0 * t_m),
            _ => "-".to_owned(),
        };
        line(
            "",
            format!("motion of what drives: {} within 20 m, {} at 20 to 32 m", error(&figures.moving_near), error(&figures.moving_far)),
        );
    }
    line("map", format!("{} triangles, {} of {} blocks used at most", run.mesh.triangles, run.blocks_peak(), run.capacity.blocks));
    let refused = run.blocks_refused();
    if refused > 0 {
        line(
            "",
            format!("{refused} blocks found no room: the map has holes. Give more bytes with --memory, or a larger volume.voxel_size_m"),
        );
    }
    if run.shelf.records > 0 {
        let (records, mib) = (run.shelf.records, run.shelf.bytes as f64 / MIB as f64);
        line("", format!("{records} blocks written to disk, {} brought back, {mib:.1} MiB", run.blocks_back()));
    }
    if run.blocks_lost() > 0 {
        line("", format!("{} blocks are lost: {}", run.blocks_lost(), lost_because(run)));
    }
    if let Some((failures, first, cause)) = run.tracking_failures() {
        line("tracking failure", format!("in {failures} of {} frames, first in frame {first}: {cause}", run.rows.len()));
        line("", "the poses of these frames are guesses, and they are not in the map. --egomotion stereo follows a drive".to_owned());
    } else if run.held_frames() > 0 {
        line("held motion", format!("{} frames had too few matches", run.held_frames()));
    }
    line("digest", format!("{:016x}", run.digest()));
    line("results", place.display().to_string());
}

/// Why blocks are lost, and what to do.
fn lost_because(run: &RunRecord) -> String {
    match &run.shelf_failure {
        Some(failure) => format!("map.blocks took no more ({failure}). Free the disk, or raise --stream-mib"),
        None if run.streaming.is_some() => "map.blocks could not be read back whole. Look after the disk".to_owned(),
        None => "the pool was full. Run without --no-stream, or give more bytes with --memory".to_owned(),
    }
}
