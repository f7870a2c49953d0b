//! `dynvox demo`: the synthetic street, mapped.

use super::run::{self, RunArgs};
use crate::formats::REPORT_FILE;
use std::path::PathBuf;

/// Folder of the demo.
const DEMO_FOLDER: &str = "dynvox-demo";

#[derive(Debug, clap::Args)]
pub struct DemoArgs {
    /// Folder for the results; an earlier demo in it is replaced
    #[arg(long, value_name = "DIR", default_value = DEMO_FOLDER)]
    out: PathBuf,
    /// Frames to map at most [default: 120, the whole street]
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Show the map in the browser when it is done
    #[arg(long)]
    open: bool,
}

pub fn run(args: &DemoArgs) -> anyhow::Result<()> {
    run::run(&RunArgs::of_demo(&args.out, args.frames))?;
    if args.open {
        super::view::show(&args.out.join(REPORT_FILE))?;
    }
    Ok(())
}
