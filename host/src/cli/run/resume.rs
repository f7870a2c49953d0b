//! `dynvox run --resume`: a run that was stopped goes on as it was begun.

use super::{RunArgs, finish, introduce, plan};

use crate::run::{Begun, Plan, RunFolder, Snapshots, Stopped};
use anyhow::{Context, bail};
use std::path::Path;

/// Arguments a run is begun with; with `--resume` they are those it was begun with. The others change nothing in the result.
pub const BEGUN: [&str; 29] = [
    "path",
    "sequence",
    "dataset",
    "images",
    "bits",
    "stacked",
    "calibration",
    "profile",
    "memory",
    "capacity",
    "start",
    "frames",
    "stride",
    "scale",
    "depth",
    "instances",
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
    "out",
    "overwrite",
];

/// Snapshots of the run this command line begins.
pub fn snapshots(plan: &Plan, every: usize) -> anyhow::Result<Snapshots> {
    if every == 0 {
        bail!("--snapshot-every begins at 1. Give a larger number");
    }
    // Behind the program's name and `run`.
    let begun = Begun::of(plan, std::env::args_os().skip(2), &std::env::current_dir()?)?;
    Ok(Snapshots { every, begun })
}

/// Lets the run go on that was to end in `target`.
pub fn run(args: &RunArgs, target: &Path) -> anyhow::Result<()> {
    let target = std::path::absolute(target)?;
    let folder = RunFolder::reopen(&target)?;
    let stopped = Stopped::read(&folder)?;
    let begun = stopped.begun().clone();
    // Paths among the words begin where they were given.
    let place = begun.place();
    std::env::set_current_dir(&place).with_context(|| format!("the run was begun in {}, which cannot be entered", place.display()))?;
    let line: Vec<String> = std::iter::once("dynvox".to_owned()).chain(begun.words().iter().cloned()).collect();
    let mut as_begun = RunArgs::of(&line).context("the run was begun by another dynvox: this one does not take its command line")?;
    as_begun.threads = args.threads.or(as_begun.threads);
    as_begun.rss_limit_mib = args.rss_limit_mib.or(as_begun.rss_limit_mib);
    as_begun.snapshot_every = args.snapshot_every.or(as_begun.snapshot_every);
    (as_begun.json, as_begun.quiet) = (args.json, args.quiet);
    let mut plan = plan(&as_begun)?;
    begun.require(&plan)?;
    folder.has_room(as_begun.overwrite)?;
    plan.snapshots = as_begun.snapshot_every.map(|every| Snapshots { every, begun });
    if !args.silent() {
        introduce(&plan);
        eprintln!("note: goes on behind frame {} of {}", stopped.frames(), plan.indices.len());
    }
    finish(&as_begun, &plan, folder, Some(stopped))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn every_argument_is_either_one_a_run_is_begun_with_or_one_that_may_be_given_anew() {
        let anew = ["resume", "threads", "rss_limit_mib", "snapshot_every", "json", "quiet"];
        let mut all: Vec<String> = super::super::Alone::command().get_arguments().map(|one| one.get_id().to_string()).collect();
        all.sort();
        let mut said: Vec<&str> = BEGUN.into_iter().chain(anew).collect();
        said.sort();
        assert_eq!(all, said);
    }
}
