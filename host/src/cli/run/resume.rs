//! `dynvox run --resume`: an interrupted run continues from its last snapshot, as it was started.

use super::{RunArgs, finish, plan, print_header, temporary_files};
use crate::input::StopRequest;
use crate::run::{Checkpoint, CheckpointPlan, Plan, RunFolder, RunManifest};
use anyhow::{Context, bail};
use std::path::Path;

/// Arguments that are fixed when a run is resumed. The others do not change the result.
pub const FIXED_ARGUMENTS: [&str; 46] = [
    "path",
    "sequence",
    "dataset",
    "images",
    "bits",
    "topics",
    "side_by_side",
    "top_bottom",
    "rate",
    "when_late",
    "calibration",
    "rectified",
    "rectified_focal",
    "profile",
    "memory",
    "capacity",
    "planning",
    "planning_3d",
    "start",
    "frames",
    "stride",
    "scale",
    "depth",
    "instances",
    "instances_every",
    "save_instances",
    "save_map_disparity",
    "dynamic",
    "egomotion",
    "fuse_every",
    "config",
    "set",
    "no_stream",
    "stream_mib",
    "keep_blocks",
    "evaluate",
    "evaluation_delay",
    "strict",
    "skip_bad_frames",
    "force",
    "faults",
    "map_objects",
    "axes",
    "mcap",
    "out",
    "overwrite",
];

/// The checkpoints of the run that this command line starts.
pub fn checkpoints(plan: &Plan, every: usize) -> anyhow::Result<CheckpointPlan> {
    if every == 0 {
        bail!("--snapshot-every must be at least 1. Give a larger number");
    }
    // After the program's name and `run`.
    let manifest = RunManifest::of(plan, std::env::args_os().skip(2), &std::env::current_dir()?)?;
    Ok(CheckpointPlan { every, manifest })
}

/// Resumes the interrupted run to `target`.
pub fn run(args: &RunArgs, target: &Path, stop: &StopRequest) -> anyhow::Result<()> {
    let target = std::path::absolute(target)?;
    let mut folder = RunFolder::reopen(&target)?;
    let (checkpoint, damage) = Checkpoint::read(&folder)?;
    if let Some(damage) = damage {
        eprintln!("warning: {damage}. The snapshot before it is taken");
    }
    let manifest = checkpoint.manifest().clone();
    // Relative paths among the arguments start at the working directory of the run.
    let working_dir = manifest.working_dir();
    std::env::set_current_dir(&working_dir).with_context(|| {
        format!("the run was started in {}, which cannot be entered", working_dir.display())
    })?;
    let line: Vec<String> =
        std::iter::once("dynvox".to_owned()).chain(manifest.arguments().iter().cloned()).collect();
    let mut original = RunArgs::parse(&line)
        .context("another dynvox started the run: this one does not accept its command line")?;
    if folder.is_complete() {
        let target = folder.commit(&temporary_files(original.keep_blocks, false))?;
        if !args.silent() {
            eprintln!(
                "note: {} was complete but for files that it no longer needs; they are removed",
                target.display()
            );
        }
        return Ok(());
    }
    original.threads = args.threads.or(original.threads);
    original.rss_limit_mib = args.rss_limit_mib.or(original.rss_limit_mib);
    original.snapshot_every = args.snapshot_every.or(original.snapshot_every);
    (original.json, original.quiet) = (args.json, args.quiet);
    let mut plan = plan(&original, stop)?;
    manifest.require(&plan)?;
    folder.check_target(original.overwrite)?;
    plan.checkpoints = original.snapshot_every.map(|every| CheckpointPlan { every, manifest });
    if !args.silent() {
        print_header(&plan);
        eprintln!(
            "note: resuming after frame {} of {}",
            checkpoint.frames(),
            plan.frames.listed().len()
        );
    }
    finish(&original, &plan, folder, Some(checkpoint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn every_argument_is_either_fixed_or_may_change_on_resume() {
        let changeable = ["resume", "threads", "rss_limit_mib", "snapshot_every", "json", "quiet"];
        let mut all: Vec<String> = super::super::RunCommand::command()
            .get_arguments()
            .map(|one| one.get_id().to_string())
            .collect();
        all.sort();
        let mut listed: Vec<&str> = FIXED_ARGUMENTS.into_iter().chain(changeable).collect();
        listed.sort();
        assert_eq!(all, listed);
    }
}
