//! `dynvox run --resume`: an interrupted run continues from its last snapshot, as it was started.

use super::RunArgs;
use super::finish::{finish, print_header, temporary_files};
use crate::input::StopRequest;
use crate::run::{Checkpoint, RunFolder};
use std::path::Path;

/// Resumes the interrupted run to `target`.
pub fn run(args: &RunArgs, target: &Path, stop: &StopRequest) -> anyhow::Result<()> {
    let mut folder = RunFolder::reopen(&std::path::absolute(target)?)?;
    let (checkpoint, damage) = Checkpoint::read(&folder)?;
    if let Some(damage) = damage {
        errln!("warning: {damage}. The snapshot before it is taken");
    }
    let manifest = checkpoint.manifest();
    if folder.is_complete() {
        let blocks_stay = manifest.request().storage.keep_blocks;
        let target = folder.commit(&temporary_files(blocks_stay, false))?;
        if !args.silent() {
            errln!(
                "note: {} was complete but for files that it no longer needs; they are removed",
                target.display()
            );
        }
        return Ok(());
    }
    let mut plan = args.changeable.over(manifest.request().clone()).resolve_with(stop)?;
    manifest.require(&plan)?;
    folder.check_target(manifest.overwrites())?;
    plan.progress = !args.silent();
    plan.live = super::live_view(args)?;
    if plan.progress {
        print_header(&plan);
        errln!(
            "note: resuming after frame {} of {}",
            checkpoint.frames(),
            plan.frames.listed().len()
        );
    }
    finish(args, plan, folder, Some(checkpoint))
}
