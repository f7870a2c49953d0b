//! `dynvox synth`.

use crate::input::InputError;
use crate::request::Settings;
use crate::synth::{Street, write_kitti};
use crate::terminal;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct SynthArgs {
    /// Folder to write, in KITTI's layout
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Frames to write [default: street.frames]
    #[arg(long, value_name = "N")]
    frames: Option<u32>,
    /// Settings from a file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One setting of the street, as street.seed=7; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

pub fn run(args: &SynthArgs) -> anyhow::Result<()> {
    let mut config = Settings::resolve(args.config.as_deref(), &args.set)?.street();
    config.frames = args.frames.unwrap_or(config.frames);
    let street =
        Street::new(config).map_err(|error| InputError::Street { reason: error.to_string() })?;
    let bar = indicatif::ProgressBar::new(u64::from(street.config().frames));
    let written = write_kitti(&street, &args.out, |done, _| bar.set_position(u64::from(done)));
    bar.finish_and_clear();
    written?;
    let (folder, quoted) = (args.out.display(), terminal::quoted(&args.out));
    outln!(
        "{} frames with their truth in {folder}\nmap it: dynvox run {quoted} --images colour",
        street.config().frames
    );
    Ok(())
}
