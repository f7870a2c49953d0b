//! Maps, writes the results, and gives the folder its name.

use super::{RunArgs, results};
use crate::formats::{FRAMES_FILE, MAP_FILE, TIMED_TRAJECTORY_FILE, TRAJECTORY_FILE};
use crate::report::{self, Summary, text::counted};
use crate::request::{Plan, RequestError, scale_sentence};
use crate::run::{
    self, BLOCKS_FILE, Checkpoint, FolderError, Incomplete, PREVIOUS_SNAPSHOT_FILE, RunError,
    RunFolder, RunRecord, SNAPSHOT_FILE, has_snapshot,
};
use crate::terminal::quoted;
use std::path::{Path, PathBuf};

/// A run whose results are written, and incomplete.
#[derive(Debug, thiserror::Error)]
#[error("{reason}.\nWhat was mapped until then is in {folder}{more}", folder = .folder.display())]
pub struct IncompleteRun {
    reason: String,
    folder: PathBuf,
    /// Sentence on what is missing in the folder, and how to go on.
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
            format!("; `dynvox run --resume {}` resumes the run", quoted(&folder))
        } else {
            String::new()
        };
        Self { reason: incomplete.reason.clone(), more: missing + &resume, folder }
    }

    /// Results without a summary, in a folder that kept its partial name.
    fn unwritten(error: &FolderError, partial: &Path) -> Self {
        let kept = [MAP_FILE, TRAJECTORY_FILE, TIMED_TRAJECTORY_FILE, FRAMES_FILE];
        let kept: Vec<&str> =
            kept.into_iter().filter(|name| partial.join(name).is_file()).collect();
        Self {
            reason: error.to_string(),
            folder: partial.to_path_buf(),
            more: format!(
                ", without its summary; {} can be read. Move the folder elsewhere",
                if kept.is_empty() { "nothing".to_owned() } else { kept.join(", ") }
            ),
        }
    }
}

/// Maps into a folder. An error about sizes lists the profiles; one that leaves a snapshot says how
/// to resume.
fn map(
    plan: Plan,
    folder: &RunFolder,
    checkpoint: Option<Checkpoint>,
) -> anyhow::Result<RunRecord> {
    plan.check().map_err(|error| match error {
        RequestError::ImageSize { .. } | RequestError::Window { .. } => {
            let table = crate::cli::budget::table(&plan.config.volume);
            anyhow::anyhow!("{error}\n\n{table}")
        }
        error => error.into(),
    })?;
    run::run(plan, folder, checkpoint).map_err(|error| match error {
        error @ (RunError::Resume(_) | RunError::Reopen(_)) => error.into(),
        error if folder.has_snapshot() => {
            anyhow::anyhow!(
                "{error}.\nThe last snapshot remains: `dynvox run --resume {}` resumes the run",
                quoted(folder.target())
            )
        }
        error => error.into(),
    })
}

/// A run without a folder: its files go to a scratch directory and are removed.
pub fn record(plan: Plan, scratch_dir: &Path) -> anyhow::Result<RunRecord> {
    let record = map(plan, &RunFolder::begin(scratch_dir, true)?, None)?;
    match &record.incomplete {
        None => Ok(record),
        Some(incomplete) => Err(anyhow::anyhow!("{}", incomplete.reason)),
    }
}

/// Files of a run that its results do not need, in the order in which they go: as long as a
/// snapshot is there, the run can be resumed.
pub fn temporary_files(blocks_stay: bool, snapshots_stay: bool) -> Vec<&'static str> {
    let snapshots = [SNAPSHOT_FILE, PREVIOUS_SNAPSHOT_FILE].map(|name| (name, snapshots_stay));
    let files = [(BLOCKS_FILE, blocks_stay)].into_iter().chain(snapshots);
    files.filter(|(_, stays)| !stays).map(|(name, _)| name).collect()
}

/// Maps, writes the results, renames the folder to its target, and prints what became of the run.
pub fn finish(
    args: &RunArgs,
    plan: Plan,
    folder: RunFolder,
    checkpoint: Option<Checkpoint>,
) -> anyhow::Result<()> {
    let (record, summary, target) = written(plan, folder, checkpoint)?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&summary)?);
    } else if !args.quiet {
        out!("{}", report::summary_lines(&record, &target));
    }
    let shows_map = record.plan.request.exports.map_disparity.is_some();
    if shows_map && record.sections.blocks.totals.stored > 0 {
        errln!(
            "warning: a part of the map was on disk in the end, and --save-map-disparity shows \
             what was in memory: choose a larger --profile"
        );
    }
    complete(&record, target)
}

/// Maps and writes the results without a word.
///
/// # Errors
/// The run fails, or is incomplete.
pub fn write(plan: Plan, folder: RunFolder) -> anyhow::Result<()> {
    let (record, _, target) = written(plan, folder, None)?;
    complete(&record, target)
}

/// Refuses an incomplete run.
fn complete(record: &RunRecord, target: PathBuf) -> anyhow::Result<()> {
    match &record.incomplete {
        None => Ok(()),
        Some(incomplete) => Err(IncompleteRun::new(incomplete, target).into()),
    }
}

/// Maps, writes the results, and renames the folder to its target.
fn written(
    plan: Plan,
    mut folder: RunFolder,
    checkpoint: Option<Checkpoint>,
) -> anyhow::Result<(RunRecord, Summary, PathBuf)> {
    let mut record = map(plan, &folder, checkpoint)?;
    // From here on there is something to lose.
    folder.keep();
    let summary = results::write(&folder, &mut record)
        .map_err(|error| IncompleteRun::unwritten(&error, folder.path()))?;
    let resumable = record.incomplete.is_some() && folder.has_snapshot();
    let blocks = resumable
        || record.keeps_blocks()
        || record
            .incomplete
            .as_ref()
            .is_some_and(|of| of.missing.iter().any(|name| name == MAP_FILE));
    let target = folder.commit(&temporary_files(blocks, resumable))?;
    Ok((record, summary, target))
}

/// Prints what is about to be mapped, and what is doubtful about it.
pub fn print_header(plan: &Plan) {
    let (width, height) = plan.dataset.size();
    let (name, threads) = (plan.dataset.name(), counted(plan.threads, "thread"));
    let frames = plan
        .frames
        .count()
        .map_or_else(|| "a stream".to_owned(), |count| format!("{count} frames"));
    errln!("{name}: {frames} of {width} x {height} px, profile {}, {threads}", plan.profile);
    errln!("{}", scale_sentence(&plan.config));
    plan.dataset.notes().iter().for_each(|note| errln!("note: {note}"));
    plan.warnings.iter().for_each(|warning| errln!("warning: {warning}"));
}
