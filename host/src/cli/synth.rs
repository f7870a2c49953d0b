//! `dynvox synth`.

use crate::request::{Change, Settings, SyntheticWorld};
use crate::synth::write_kitti;
use crate::terminal;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct SynthArgs {
    /// Folder to write, in KITTI's layout
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Synthetic world to write
    #[arg(long, value_enum, default_value_t)]
    world: SyntheticWorld,
    /// Frames to write [default: those of the world's settings]
    #[arg(long, value_name = "N")]
    frames: Option<u32>,
    /// Settings from a file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One setting of the world, as street.seed=7; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

pub fn run(args: &SynthArgs) -> anyhow::Result<()> {
    let settings = Settings::resolve(args.config.as_deref(), &args.set)?;
    let change = Change { frames: args.frames, ..Change::default() };
    let world = args.world.build(&settings, &change)?;
    let bar = indicatif::ProgressBar::new(u64::from(world.frames()));
    let written =
        write_kitti(world.as_ref(), &args.out, |done, _| bar.set_position(u64::from(done)));
    bar.finish_and_clear();
    written?;
    let (folder, quoted) = (args.out.display(), terminal::quoted(&args.out));
    outln!(
        "{} frames with their truth in {folder}\nmap it: dynvox run {quoted} --images colour",
        world.frames()
    );
    Ok(())
}
