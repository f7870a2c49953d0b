//! `dynvox run`: arguments, and the request they are.

mod finish;
mod results;
mod resume;

pub use finish::{IncompleteRun, record, write};

use crate::live::LiveView;
use crate::owned::check_overlap;
use crate::request::{Options, Plan, Request};
use crate::run::{RunError, RunFolder, check_outputs, keyframes_in};
use crate::terminal::quoted;
use anyhow::Context;
use finish::{finish, print_header};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// Folder in which run folders are made unless `--out` says otherwise.
const DEFAULT_PARENT: &str = "out";

#[derive(Debug, Default, clap::Args)]
pub struct RunArgs {
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    changeable: ChangeableArgs,
    #[command(flatten)]
    target: TargetArgs,
    /// Resume the interrupted run to RUN_FOLDER from its last snapshot, with its settings and data
    /// set; only --threads, --rss-limit-mib, --snapshot-every, --json, --quiet and --live can
    /// be changed
    #[arg(long, value_name = "RUN_FOLDER", conflicts_with_all = ["Options", "TargetArgs"], help_heading = "Results")]
    resume: Option<PathBuf>,
    /// Write the summary to standard output as JSON, and nothing else
    #[arg(long, help_heading = "Results")]
    json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Results")]
    quiet: bool,
    /// Show the run in a browser while it drives: map, pictures, figures. For this machine only
    #[arg(long, help_heading = "Results")]
    live: bool,
}

/// Options that do not change the result, and may be others when a run is resumed.
#[derive(Debug, Default, clap::Args)]
struct ChangeableArgs {
    /// Threads; the result does not depend on them [default: as many as the machine has, at most 4]
    #[arg(long, value_name = "N", help_heading = "Limits")]
    threads: Option<usize>,
    /// End when the process uses more than so many MiB
    /// [default: the slab, 256 MiB and 64 bytes for each pixel]
    #[arg(long, value_name = "MIB", help_heading = "Limits")]
    rss_limit_mib: Option<u64>,
    /// Write a snapshot every N frames, from which an interrupted run can be resumed. Cannot be
    /// combined with --evaluate
    #[arg(
        long,
        value_name = "N",
        conflicts_with_all = [
            "evaluate", "save_instances", "save_disparity", "save_map_disparity", "export", "mcap"
        ],
        help_heading = "Results"
    )]
    snapshot_every: Option<usize>,
}

/// The folder of a run.
#[derive(Debug, Default, clap::Args)]
struct TargetArgs {
    /// Folder for the results [default: out/<data set>-NNN]
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    out: Option<PathBuf>,
    /// Replace the run folder that is there
    #[arg(long, help_heading = "Results")]
    overwrite: bool,
    /// Go on with the map of an old run, made with --keyframes and --keep-blocks: once a place of
    /// it is recognised, the recording is mapped into a copy of it. The old folder stays as it is
    #[arg(
        long = "continue",
        value_name = "RUN_FOLDER",
        conflicts_with_all = ["no_stream", "egomotion"],
        help_heading = "Mapping"
    )]
    old: Option<PathBuf>,
}

/// Keyframes that a continued map may get on top of its own, unless `--keyframes` says otherwise.
const MORE_KEYFRAMES: usize = 1_000;
/// Most keyframes of a mapper.
const MAX_KEYFRAMES: usize = 65_536;

impl TargetArgs {
    /// The request with the old map that is continued, if one is.
    fn over(&self, mut request: Request) -> Result<Request, RunError> {
        let Some(old) = &self.old else { return Ok(request) };
        let keyframes = keyframes_in(old)? as usize;
        let Request { bounds, storage, .. } = &mut request;
        bounds.keyframes = if bounds.keyframes > 0 {
            bounds.keyframes.max(keyframes)
        } else {
            (keyframes + MORE_KEYFRAMES).min(MAX_KEYFRAMES)
        };
        storage.continues = Some(old.clone());
        storage.keep_blocks = true;
        Ok(request)
    }
}

/// The arguments of a run as a command line of their own.
#[derive(clap::Parser)]
struct RunCommand {
    #[command(flatten)]
    args: RunArgs,
}

/// The request of arguments of `dynvox run`, without the program's name.
pub fn request_of(arguments: &[String]) -> anyhow::Result<Request> {
    let line = std::iter::once("dynvox").chain(arguments.iter().map(String::as_str));
    Ok(<RunCommand as clap::Parser>::try_parse_from(line)?.args.request()?)
}

impl RunArgs {
    /// The arguments that map the synthetic street to `out`, over an earlier run there.
    pub fn of_demo(out: &Path, frames: Option<usize>) -> Self {
        Self {
            options: Options { frames, ..Options::default() },
            target: TargetArgs {
                out: Some(out.to_path_buf()),
                overwrite: true,
                ..TargetArgs::default()
            },
            ..Self::default()
        }
    }

    /// Request of these arguments.
    fn request(&self) -> Result<Request, RunError> {
        self.target.over(self.changeable.over(self.options.request()?))
    }

    fn silent(&self) -> bool {
        self.quiet || self.json
    }
}

impl ChangeableArgs {
    /// These arguments over what a request has.
    fn over(&self, mut request: Request) -> Request {
        let Request { limits, storage, .. } = &mut request;
        limits.threads = self.threads.or(limits.threads);
        limits.rss_mib = self.rss_limit_mib.or(limits.rss_mib);
        storage.snapshot_every = self.snapshot_every.or(storage.snapshot_every);
        request
    }
}

/// The live view of a run that is asked for one. Without a browser the address is there to open.
fn live_view(args: &RunArgs) -> anyhow::Result<Option<LiveView>> {
    if !args.live {
        return Ok(None);
    }
    let live = LiveView::begin().context("the live view cannot be served: run without --live")?;
    errln!("live view: {}", live.url());
    if std::io::stderr().is_terminal() && !args.silent() {
        // The address is printed: no browser is no failure of the run.
        let _ = open::that_detached(live.url());
    }
    Ok(Some(live))
}

/// Folder of a run without `--out`: below the current one, or beside the recording where the
/// current one lies within it.
fn default_target(plan: &Plan) -> PathBuf {
    let (name, inputs) = (plan.dataset.name(), plan.request.inputs());
    let below = RunFolder::next_name(Path::new(DEFAULT_PARENT), name);
    // The parent of `recording/..` is not known before links and dots are resolved.
    let real = inputs.iter().filter_map(|input| input.canonicalize().ok());
    let beside = real
        .filter_map(|input| Some(input.parent()?.join(DEFAULT_PARENT)))
        .map(|parent| RunFolder::next_name(&parent, name));
    let mut targets = std::iter::once(below.clone()).chain(beside);
    targets.find(|target| check_overlap(target, &inputs).is_ok()).unwrap_or(below)
}

pub fn run(args: &RunArgs) -> anyhow::Result<()> {
    let stop = super::signals::stop_request()?;
    if let Some(target) = &args.resume {
        return resume::run(args, target, &stop);
    }
    let mut plan = args.request()?.resolve_with(&stop)?;
    plan.progress = !args.silent();
    plan.live = live_view(args)?;
    let target = args.target.out.clone().unwrap_or_else(|| default_target(&plan));
    check_outputs(&plan, &target)?;
    check_overlap(&target, args.options.config.as_slice())?;
    let folder = RunFolder::begin(&target, args.target.overwrite)?;
    if plan.progress {
        print_header(&plan);
        if plan.request.storage.snapshot_every.is_some() {
            errln!(
                "note: if the run is interrupted, `dynvox run --resume {}` resumes it",
                quoted(&target)
            );
        }
    }
    finish(args, plan, folder, None)
}
