//! `dynvox localize`.

use crate::formats::tum_line;
use crate::owned;
use crate::request::Options;
use crate::run::{self, Localized};
use anyhow::Context as _;
use std::path::PathBuf;

/// Frames from one that is fused to the next where no map is wanted.
pub(super) const NEVER: u32 = u32::MAX;

/// Arguments of `dynvox localize`.
#[derive(Debug, clap::Args)]
pub struct LocalizeArgs {
    /// Folder of a finished run with --keyframes; nothing in it changes
    #[arg(long = "in", value_name = "RUN")]
    old: PathBuf,
    /// Write the poses of the placed frames to a new file, as TUM's rows: time, position,
    /// quaternion
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    out: Option<PathBuf>,
    /// Write the poses to standard output as JSON, and nothing else
    #[arg(long, help_heading = "Results")]
    json: bool,
    #[command(flatten)]
    options: Options,
}

pub fn run(args: &LocalizeArgs) -> anyhow::Result<()> {
    let mut request = args.options.request()?;
    request.settings.mapper.fuse_every = NEVER;
    request.bounds.keyframes = (run::keyframes_in(&args.old)? as usize).max(1);
    let localized = run::localize(&request.resolve()?, &args.old)?;
    if let Some(path) = &args.out {
        let rows: String =
            localized.placed.iter().map(|at| tum_line(at.time_ns, &at.t_world_camera)).collect();
        owned::write(path, rows.as_bytes())
            .with_context(|| format!("{} cannot be written", path.display()))?;
    }
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&localized)?);
    } else {
        print(&localized);
    }
    Ok(())
}

fn print(localized: &Localized) {
    let Localized { keyframes, frames, placed } = localized;
    let recognized = placed.iter().filter(|at| at.recognized).count();
    match placed.first() {
        None => outln!("none of {frames} frames is placed among {keyframes} keyframes"),
        Some(first) => outln!(
            "{} of {frames} frames are placed among {keyframes} keyframes, the first is frame {}; \
             a place was recognised in {recognized}",
            placed.len(),
            first.frame
        ),
    }
}
