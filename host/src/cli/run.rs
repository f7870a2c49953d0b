//! `dynvox run`.

mod examine;
mod instances;
mod plan;
mod results;
mod resume;
mod saved;
mod stream;

use super::capacity::CapacityArgs;
use super::egomotion::EgomotionChoice;
use super::export::ExportArgs;
use super::rectified::RectifiedArgs;
use crate::formats::MAP_FILE;
use crate::input::bags::Topics;
use crate::input::depth::{self, DepthChoice};
use crate::input::faults::{self, Faults};
use crate::input::stream::WhenLate;
use crate::input::{
    self, CameraPair, FrameSource, Layout, OpenOptions, Scaled, Stacking, StopRequest,
};
use crate::observe::Reference;
use crate::report;
use crate::report::text::counted;
use crate::request::Settings;
use crate::run::{
    self, BLOCKS_FILE, Checkpoint, Incomplete, PREVIOUS_SNAPSHOT_FILE, Plan, RunError, RunFolder,
    RunRecord, SNAPSHOT_FILE, has_snapshot,
};
use anyhow::bail;
use instances::InstancesArgs;
use plan::plan;
pub use plan::{MapperPlan, check_options, mapper_of, plan_of};
use saved::Saved;
use std::path::{Path, PathBuf};

/// Where run folders go unless `--out` says otherwise.
const DEFAULT_PARENT: &str = "out";

#[derive(Debug, clap::Args)]
pub struct RunArgs {
    /// Data set to map; - for a stream of PGM or PPM images from standard input, left and right in
    /// turn; the synthetic street without one
    path: Option<PathBuf>,
    /// Sequence within the data set: 06, 0003
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    sequence: Option<String>,
    /// Layout of the data set; guessed from the path unless given
    #[arg(long, value_enum, help_heading = "Input")]
    dataset: Option<Layout>,
    /// Camera pair of KITTI odometry
    #[arg(long, value_enum, default_value_t, help_heading = "Input")]
    images: CameraPair,
    /// Significant bits of 16-bit images, 8 to 16; told from the largest value of some of them
    /// otherwise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=16), help_heading = "Input")]
    bits: Option<u32>,
    /// Topics of both cameras in a recording of ROS [default: told by their names]
    #[arg(long, value_name = "LEFT,RIGHT", help_heading = "Input")]
    topics: Option<Topics>,
    /// Both images of a pair lie in one, the left one left [default: told from the calibration]
    #[arg(long, help_heading = "Input")]
    side_by_side: bool,
    /// Both images of a pair lie in one, the left one above
    #[arg(long, conflicts_with = "side_by_side", help_heading = "Input")]
    top_bottom: bool,
    /// Frames a second of a stream
    #[arg(long, value_name = "HZ", value_parser = rate_hz, help_heading = "Input")]
    rate: Option<f64>,
    /// Frames of a stream that come while the mapper is busy: wait lets the stream wait, drop drops
    /// the oldest and counts it [default: wait]
    #[arg(long, value_enum, value_name = "HOW", help_heading = "Input")]
    when_late: Option<WhenLate>,
    /// Calibration in place of the recording's own: of raw images in any format
    /// `dynvox calibration` reads (give it twice where each camera has a file), of rectified ones
    /// KITTI's P0 and P1 lines, or focal_px, center_u_px, center_v_px, baseline_m
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    calibration: Vec<PathBuf>,
    #[command(flatten)]
    rectified: RectifiedArgs,
    #[command(flatten)]
    bounds: CapacityArgs,
    /// Threads; the result does not depend on them [default: as many as the machine has, at most 4]
    #[arg(long, value_name = "N", help_heading = "Limits")]
    threads: Option<usize>,
    /// First frame
    #[arg(long, default_value_t = 0, value_name = "N", help_heading = "Frames")]
    start: usize,
    /// Frames to map at most
    #[arg(long, value_name = "N", help_heading = "Frames")]
    frames: Option<usize>,
    /// Take every N-th frame
    #[arg(long, default_value_t = 1, value_name = "N", help_heading = "Frames")]
    stride: usize,
    /// Shrink the images, above 0 and up to 1
    #[arg(long, default_value_t = 1.0, value_name = "S", help_heading = "Frames")]
    scale: f64,
    /// Source of depth: elas (stereo matching), files:DIR (PNG, PFM or OpenCV XML named as the
    /// images; depth where DIR's name says depth and not disparity), disparity:DIR, depth:DIR, or
    /// exact (the synthetic street)
    #[arg(long, default_value = "elas", value_name = "SOURCE", help_heading = "Mapping")]
    depth: DepthChoice,
    #[command(flatten, next_help_heading = "Mapping")]
    masks: InstancesArgs,
    /// Whether objects are masked out of the static map and reconstructed separately; off fuses
    /// everything into one map [default: on]
    #[arg(long, value_name = "on|off", value_parser = on_or_off, help_heading = "Mapping")]
    dynamic: Option<bool>,
    /// Source of the camera's motion: stereo (matches over two pairs), icp (depth against the map,
    /// the baseline of hand-held mappers: expected to fail at driving speed), or file:POSES (KITTI
    /// or TUM) [default: stereo]
    #[arg(long, value_name = "SOURCE", help_heading = "Mapping")]
    egomotion: Option<EgomotionChoice>,
    /// Fuse every K-th frame; the camera is tracked in all [default: 1]
    #[arg(long, value_name = "K", help_heading = "Mapping")]
    fuse_every: Option<u32>,
    /// Settings from a file; config.toml of an earlier run is one
    #[arg(long, value_name = "FILE", help_heading = "Mapping")]
    config: Option<PathBuf>,
    /// One setting, over those of the file; may be repeated
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Mapping")]
    set: Vec<String>,
    /// Lose blocks evicted from the full pool; otherwise they are stored in map.blocks, loaded back
    /// when seen again, and included in map.ply
    #[arg(long, help_heading = "Limits")]
    no_stream: bool,
    /// Limit map.blocks to so many MiB [default: the disk's space]
    #[arg(long, value_name = "MIB", conflicts_with = "no_stream", help_heading = "Limits")]
    stream_mib: Option<u64>,
    /// Keep map.blocks in the run folder after the mesh is written
    #[arg(long, conflicts_with = "no_stream", help_heading = "Results")]
    keep_blocks: bool,
    /// Evaluate input and map, static and of objects, against LiDAR scans or the synthetic street's
    /// exact depth
    #[arg(long, value_enum, value_name = "REFERENCE", help_heading = "Evaluation")]
    evaluate: Option<Reference>,
    /// Evaluate the map at a frame's pose N frames later, after pruning
    #[arg(
        long,
        default_value_t = 0,
        value_name = "N",
        requires = "evaluate",
        help_heading = "Evaluation"
    )]
    evaluation_delay: usize,
    /// Save what the finished map shows at every frame's pose to a new folder: 16-bit PNG named as
    /// the images, disparity in 1/256 px, 0 none
    #[arg(
        long,
        value_name = "DIR",
        conflicts_with = "snapshot_every",
        help_heading = "Evaluation"
    )]
    save_map_disparity: Option<PathBuf>,
    /// End at the first frame that affects the map: an extrapolated pose, anything refused or lost
    #[arg(long, help_heading = "Limits")]
    strict: bool,
    /// Leave out frames that cannot be read or mapped, and count them; otherwise the run ends
    /// before the first of them
    #[arg(long, help_heading = "Frames")]
    skip_bad_frames: bool,
    /// Inject faults, to see what becomes of them:
    /// NAME[:left|:right][=AMOUNT][@FIRST[..[END]]][%PERCENT], separated by commas; drop,
    /// duplicate, swap, jump=FRAMES, exchange, freeze, delay, black, noise=GREY_LEVELS,
    /// occlude=SHARE, brightness=FACTOR, masks; seed=N
    #[arg(long, value_name = "SPEC")]
    faults: Option<Faults>,
    /// Map images that are refused as exchanged, unrectified, out of order, black or the same in
    /// both cameras
    #[arg(long, help_heading = "Frames")]
    force: bool,
    /// End when the process uses more than so many MiB
    /// [default: the slab, 256 MiB and 64 bytes for each pixel]
    #[arg(long, value_name = "MIB", help_heading = "Limits")]
    rss_limit_mib: Option<u64>,
    /// Write a snapshot every N frames, from which an interrupted run can be resumed. Cannot be
    /// combined with --evaluate
    #[arg(long, value_name = "N", conflicts_with = "evaluate", help_heading = "Results")]
    snapshot_every: Option<usize>,
    /// Resume the interrupted run to RUN_FOLDER from its last snapshot, with its settings and data
    /// set; only --threads, --rss-limit-mib, --snapshot-every, --json and --quiet can be changed
    #[arg(long, value_name = "RUN_FOLDER", conflicts_with_all = resume::FIXED_ARGUMENTS, help_heading = "Results")]
    resume: Option<PathBuf>,
    /// Folder for the results [default: out/<data set>-NNN]
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    out: Option<PathBuf>,
    /// Replace the run folder that is there
    #[arg(long, help_heading = "Results")]
    overwrite: bool,
    #[command(flatten)]
    export: ExportArgs,
    /// Write the summary to standard output as JSON, and nothing else
    #[arg(long, help_heading = "Results")]
    json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Results")]
    quiet: bool,
}

/// The arguments of a run as a command line of their own.
#[derive(clap::Parser)]
struct RunCommand {
    #[command(flatten)]
    args: RunArgs,
}

impl RunArgs {
    /// The defaults: a run of `dynvox` without arguments.
    pub fn without_arguments() -> Self {
        <RunCommand as clap::Parser>::parse_from(["dynvox"]).args
    }

    /// Parses a command line, the program's name first.
    pub fn parse(line: &[String]) -> Result<Self, clap::Error> {
        Ok(<RunCommand as clap::Parser>::try_parse_from(line)?.args)
    }

    fn silent(&self) -> bool {
        self.quiet || self.json
    }

    fn options(&self, settings: &Settings) -> OpenOptions {
        OpenOptions {
            layout: self.dataset,
            sequence: self.sequence.clone(),
            cameras: self.images,
            bits: self.bits,
            stacking: self.stacking(),
            topics: self.topics.clone(),
            calibration: self.calibration.clone(),
            rectified: settings.rectified_size(),
        }
    }

    fn stacking(&self) -> Option<Stacking> {
        match (self.side_by_side, self.top_bottom) {
            (true, _) => Some(Stacking::SideBySide),
            (_, true) => Some(Stacking::TopBottom),
            _ => None,
        }
    }

    fn open(
        &self,
        settings: &Settings,
        stop: &StopRequest,
    ) -> anyhow::Result<Box<dyn FrameSource>> {
        let dataset: Box<dyn FrameSource> = match &self.path {
            Some(path) if stream::is_stream(path) => {
                stream::open(self, settings.rectified_size(), stop)?
            }
            _ if self.rate.is_some() || self.when_late.is_some() => {
                bail!("--rate and --when-late are for a stream: `dynvox run -`")
            }
            Some(path) => input::open(path, &self.options(settings))?,
            None if self.dataset.is_some() || self.sequence.is_some() => {
                bail!("--dataset and --sequence need a data set. Give its path: `dynvox run PATH`")
            }
            None => super::synth::street(settings)?,
        };
        let dataset = depth::attach(dataset, &self.depth)?;
        Ok(if self.scale == 1.0 { dataset } else { Box::new(Scaled::new(dataset, self.scale)?) })
    }

    /// With the masks and faults that are asked for.
    fn dress(&self, dataset: Box<dyn FrameSource>) -> anyhow::Result<Box<dyn FrameSource>> {
        faults::attach(self.masks.attach(dataset)?, self.faults.as_ref())
            .map_err(anyhow::Error::msg)
    }
}

/// The value of a switch on the command line.
fn on_or_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("must be on or off".to_owned()),
    }
}

fn rate_hz(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
    rate.ok_or_else(|| "must be a number above 0".to_owned())
}

/// Maps into a folder. An error about sizes lists the profiles; one that leaves a snapshot says how
/// to resume.
fn map(
    plan: &Plan,
    folder: &RunFolder,
    checkpoint: Option<Checkpoint>,
) -> anyhow::Result<RunRecord> {
    run::run(plan, folder, checkpoint).map_err(|error| match error {
        RunError::ImageSize { .. } | RunError::Window { .. } => {
            anyhow::anyhow!("{error}\n\n{}", super::budget::table(&plan.config.volume))
        }
        error @ (RunError::Resume(_) | RunError::Reopen(_)) => error.into(),
        error if folder.has_snapshot() => {
            anyhow::anyhow!(
                "{error}.\nThe last snapshot remains: `dynvox run --resume {}` resumes the run",
                folder.target().display()
            )
        }
        error => error.into(),
    })
}

/// A run without a folder: its files go to a scratch directory and are removed.
pub fn record(args: &RunArgs, scratch_dir: &Path) -> anyhow::Result<RunRecord> {
    let record =
        map(&plan(args, &StopRequest::default())?, &RunFolder::begin(scratch_dir, true)?, None)?;
    record
        .incomplete
        .as_ref()
        .map_or(Ok(()), |incomplete| Err(anyhow::anyhow!("{}", incomplete.reason)))?;
    Ok(record)
}

pub fn run(args: &RunArgs) -> anyhow::Result<()> {
    let stop = super::signals::stop_request()?;
    if let Some(target) = &args.resume {
        return resume::run(args, target, &stop);
    }
    let mut plan = plan(args, &stop)?;
    plan.checkpoints =
        args.snapshot_every.map(|every| resume::checkpoints(&plan, every)).transpose()?;
    let target = args
        .out
        .clone()
        .unwrap_or_else(|| RunFolder::next_name(Path::new(DEFAULT_PARENT), plan.dataset.name()));
    let folder = RunFolder::begin(&target, args.overwrite)?;
    let saved = [
        Saved::begin(args.masks.save_instances.as_deref(), "--save-instances")?,
        Saved::begin(args.save_map_disparity.as_deref(), "--save-map-disparity")?,
    ];
    [plan.save_instances, plan.save_map_disparity] = saved.each_ref().map(Saved::path);
    if !args.silent() {
        print_header(&plan);
        if plan.checkpoints.is_some() {
            eprintln!(
                "note: if the run is interrupted, `dynvox run --resume {}` resumes it",
                target.display()
            );
        }
    }
    finish(args, &plan, folder, None)?;
    saved.into_iter().try_for_each(Saved::commit)?;
    Ok(())
}

/// A run whose results are written, and incomplete.
#[derive(Debug, thiserror::Error)]
#[error("{reason}.\nWhat was mapped until then is in {folder}{more}", folder = .folder.display())]
pub struct IncompleteRun {
    reason: String,
    folder: PathBuf,
    /// What is missing there, and how to go on.
    more: String,
}

impl IncompleteRun {
    fn new(incomplete: &Incomplete, folder: PathBuf) -> Self {
        let missing = if incomplete.missing.is_empty() {
            String::new()
        } else {
            format!(", without {}", incomplete.missing.join(", "))
        };
        let resume = if has_snapshot(&folder) {
            format!("; `dynvox run --resume {}` resumes the run", folder.display())
        } else {
            String::new()
        };
        Self { reason: incomplete.reason.clone(), more: missing + &resume, folder }
    }
}

/// Files of a run that its results do not need, in the order in which they go: as long as a
/// snapshot is there, the run can be resumed.
fn temporary_files(blocks_stay: bool, snapshots_stay: bool) -> Vec<&'static str> {
    let snapshots = [SNAPSHOT_FILE, PREVIOUS_SNAPSHOT_FILE].map(|name| (name, snapshots_stay));
    let files = [(BLOCKS_FILE, blocks_stay)].into_iter().chain(snapshots);
    files.filter(|(_, stays)| !stays).map(|(name, _)| name).collect()
}

/// Maps, writes the results, and renames the folder to its target.
fn finish(
    args: &RunArgs,
    plan: &Plan,
    mut folder: RunFolder,
    checkpoint: Option<Checkpoint>,
) -> anyhow::Result<()> {
    let mut record = map(plan, &folder, checkpoint)?;
    // From here on there is something to lose.
    folder.keep();
    let summary = results::write(&folder, &mut record)?;
    let resumable = record.incomplete.is_some() && folder.has_snapshot();
    let blocks = resumable
        || record.keeps_blocks()
        || record
            .incomplete
            .as_ref()
            .is_some_and(|of| of.missing.iter().any(|name| name == MAP_FILE));
    let target = folder.commit(&temporary_files(blocks, resumable))?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&summary)?);
    } else if !args.quiet {
        out!("{}", report::summary_lines(&record, &target));
    }
    if plan.save_map_disparity.is_some() && record.sections.blocks.totals.stored > 0 {
        eprintln!(
            "warning: a part of the map was on disk in the end, and --save-map-disparity shows what was in memory: choose a larger --profile"
        );
    }
    record
        .incomplete
        .map_or(Ok(()), |incomplete| Err(IncompleteRun::new(&incomplete, target).into()))
}

fn print_header(plan: &Plan) {
    let (width, height) = plan.dataset.size();
    let (name, threads) = (plan.dataset.name(), counted(plan.threads, "thread"));
    let frames = plan
        .frames
        .count()
        .map_or_else(|| "a stream".to_owned(), |count| format!("{count} frames"));
    eprintln!("{name}: {frames} of {width} x {height} px, profile {}, {threads}", plan.profile);
    plan.dataset.notes().iter().for_each(|note| eprintln!("note: {note}"));
    plan.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
}
