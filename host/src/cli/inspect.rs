//! `dynvox inspect`.

use crate::dataset::{self, Dataset, Found, Kind, Masks};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct InspectArgs {
    /// Folder to look at
    path: PathBuf,
    /// Layout of the data set; guessed from the path unless given
    #[arg(long, value_enum)]
    dataset: Option<Kind>,
}

pub fn run(args: &InspectArgs) -> anyhow::Result<()> {
    let (kind, found) = dataset::survey(&args.path, args.dataset)?;
    println!("{}: {} ({} sequence{})", args.path.display(), kind.name(), found.len(), if found.len() == 1 { "" } else { "s" });
    for one in &found {
        println!();
        if let Some(sequence) = &one.sequence {
            println!("sequence {sequence}");
        }
        match &one.opened {
            Ok(dataset) => describe(dataset.as_ref(), &command(&args.path, one)),
            Err(error) => println!("  cannot be used: {error}"),
        }
    }
    if found.iter().all(|one| one.opened.is_err()) {
        anyhow::bail!("nothing at {} can be mapped. The reasons stand above", args.path.display());
    }
    Ok(())
}

fn command(path: &Path, found: &Found) -> String {
    let sequence = found.sequence.as_ref().map(|sequence| format!(" --sequence {sequence}")).unwrap_or_default();
    format!("dynvox run {}{sequence}", path.display())
}

fn describe(dataset: &dyn Dataset, command: &str) {
    let ((width, height), rig) = (dataset.size(), dataset.rig());
    let last = dataset.len().saturating_sub(1);
    let seconds = dataset.time_s(last) - dataset.time_s(0);
    println!("  {} stereo pairs of {width} x {height} px, {seconds:.1} s", dataset.len());
    println!(
        "  focal length {:.2} px, principal point ({:.2}, {:.2}) px, baseline {:.4} m",
        rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m
    );
    match dataset.frame(0) {
        Ok(frame) => {
            println!("  {}", if frame.colour.is_some() { "colour images: the map has colours" } else { "grey images: the map is grey" })
        }
        Err(error) => println!("  the first frame cannot be read: {error}"),
    }
    println!(
        "  {}",
        if dataset.truth().is_some() {
            "true poses: the trajectory's errors are measured"
        } else {
            "no true poses: the trajectory's errors stay unknown"
        }
    );
    println!(
        "  {}",
        match dataset.masks() {
            Masks::Folder(folder) => format!("masks in {}: what moves is kept apart", folder.display()),
            Masks::Exact => "exact masks: what moves is kept apart".to_owned(),
            Masks::Absent => "no masks: cars go into the static map, unless --instances names some".to_owned(),
        }
    );
    for note in dataset.notes() {
        println!("  note: {note}");
    }
    let fits = |capacity: &dynvox_core::Capacity| width <= capacity.image_width && height <= capacity.image_height;
    let profiles: Vec<&str> =
        dynvox_core::Capacity::PROFILES.iter().filter(|(_, capacity)| fits(capacity)).map(|(name, _)| *name).collect();
    if profiles.is_empty() {
        println!("  no profile takes images of this size: shrink them with --scale");
    } else {
        println!("  fits the profiles {}", profiles.join(", "));
    }
    println!("  map it: {command}");
}
