//! The plan of a run: data set, bounds and settings of its command line.

use super::RunArgs;
use super::examine::{self, Examined};
use crate::cli::egomotion::EgomotionChoice;
use crate::formats::calibration::FittedGeometry;
use crate::input::StopRequest;
use crate::request::Settings;
use crate::run::{self, FrameNumbers, Plan, Streaming};
use anyhow::bail;
use dynvox_core::{Capacity, Config, MotionSource};

const MIB: u64 = 1 << 20;
/// Threads at most.
const MOST_THREADS: usize = 256;

/// The plan of a run.
pub fn plan(args: &RunArgs, stop: &StopRequest) -> anyhow::Result<Plan> {
    let mut settings = Settings::resolve(args.config.as_deref(), &args.set)?;
    let threads = threads(args)?;
    settings.set_rectified_size(args.rectified.over(settings.rectified_size()));
    let recorded = args.open(&settings, stop)?;
    // Before networks, which would run on every image that is examined.
    let Examined { warnings, interval_s } = examine::examine(args, recorded.as_ref())?;
    let dataset = args.dress(recorded)?;
    let (profile, capacity) =
        args.bounds.resolve(dataset.size(), dataset.rectification(), settings.voxel_size_m())?;
    choose(args, &mut settings, &capacity);
    let frames = FrameNumbers::of(dataset.as_ref(), args.start, args.stride, args.frames)?;
    if let Some(interval_s) = interval_s {
        settings.set_frame_interval_s(interval_s);
    }
    let poses = match &args.egomotion {
        Some(choice) => choice.apply(&mut settings, dataset.as_ref(), frames.listed())?,
        None => None,
    };
    Ok(Plan {
        warnings,
        frames,
        skip_bad_frames: args.skip_bad_frames,
        stop: stop.clone(),
        poses,
        profile,
        capacity,
        config: settings.config(dataset.rig(), dataset.rectification()),
        config_toml: settings.to_toml(args.path.is_none())?,
        threads,
        checkpoints: None,
        streaming: (!args.no_stream).then_some(Streaming {
            most_bytes: args.stream_mib.map(|mib| mib.saturating_mul(MIB)),
            keep_file: args.keep_blocks,
        }),
        export: args.export.options(),
        strict: args.strict,
        evaluate: args.evaluate,
        evaluation_delay: args.evaluation_delay,
        save_instances: None,
        save_map_disparity: None,
        rss_limit_bytes: args
            .rss_limit_mib
            .map_or(run::resident_limit_bytes(&capacity, dataset.size()), |mib| {
                mib.saturating_mul(MIB)
            }),
        quiet: args.silent(),
        dataset,
    })
}

/// The plan of a command line, the program's name first.
pub fn plan_of(line: &[String]) -> anyhow::Result<Plan> {
    plan(&RunArgs::parse(line)?, &StopRequest::default())
}

/// What a mapper alone is made of, for cameras that other programs read.
#[derive(Clone, Debug)]
pub struct MapperPlan {
    /// Name of the bounds.
    pub profile: String,
    /// The bounds.
    pub capacity: Capacity,
    /// The configuration.
    pub config: Config,
    /// The same as a file.
    pub config_toml: String,
    /// Threads at work.
    pub threads: usize,
}

/// What the bounds, settings and threads of a run's command line make of cameras, without a data
/// set; `interval_s` is the time between two frames.
///
/// # Errors
/// The sentences of `dynvox run`.
pub fn mapper_of(
    line: &[String],
    cameras: &FittedGeometry,
    interval_s: Option<f64>,
) -> anyhow::Result<MapperPlan> {
    let (args, mut settings, threads) = parsed(line)?;
    let (profile, capacity) = args.bounds.resolve(
        cameras.size,
        cameras.rectification.as_ref(),
        settings.voxel_size_m(),
    )?;
    choose(&args, &mut settings, &capacity);
    if let Some(interval_s) = interval_s {
        settings.set_frame_interval_s(interval_s);
    }
    match &args.egomotion {
        Some(EgomotionChoice::Stereo) => settings.set_motion_source(MotionSource::Stereo),
        Some(EgomotionChoice::Icp) => settings.set_motion_source(MotionSource::Icp),
        Some(EgomotionChoice::File(_)) => {
            bail!("--egomotion file:POSES needs a data set. Give each frame its pose")
        }
        None => {}
    }
    let config = settings.config(cameras.rig, cameras.rectification.as_ref());
    run::check_bounds(cameras.size, (&profile, &capacity), &config)?;
    Ok(MapperPlan { profile, capacity, config, config_toml: settings.to_toml(false)?, threads })
}

/// Checks what can be checked of such a command line before the pictures' size is known.
///
/// # Errors
/// The sentences of `dynvox run`.
pub fn check_options(line: &[String]) -> anyhow::Result<()> {
    parsed(line).map(drop)
}

fn parsed(line: &[String]) -> anyhow::Result<(RunArgs, Settings, usize)> {
    let args = RunArgs::parse(line)?;
    if !args.masks.need_no_recording() {
        bail!("masks from files and networks need a data set. Give each frame its detections");
    }
    let (settings, threads) =
        (Settings::resolve(args.config.as_deref(), &args.set)?, threads(&args)?);
    Ok((args, settings, threads))
}

/// Threads to work with.
fn threads(args: &RunArgs) -> anyhow::Result<usize> {
    let threads = args
        .threads
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from).min(4));
    if threads > MOST_THREADS {
        bail!(
            "--threads {threads} is more than {MOST_THREADS}. Give at most the number of processors"
        );
    }
    if threads == 0 || args.stride == 0 || args.frames == Some(0) {
        bail!("--threads, --stride and --frames must be at least 1. Give a larger number");
    }
    Ok(threads)
}

/// Settings that have an option of their own, and those that depend on the bounds.
fn choose(args: &RunArgs, settings: &mut Settings, capacity: &Capacity) {
    settings.fit(capacity);
    if let Some(finds_motion) = args.masks.instances.finds_motion() {
        settings.set_motion_segmentation(finds_motion);
    }
    if let Some(dynamic) = args.dynamic {
        settings.set_dynamic(dynamic);
    }
    if let Some(fuse_every) = args.fuse_every {
        settings.set_fuse_every(fuse_every);
    }
}
