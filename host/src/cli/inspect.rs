//! `dynvox inspect`.

use crate::evaluate::stereo::{StereoSetError, find_stereo_set};
use crate::input::diagnosis;
use crate::input::{self, AvailableMasks, Found, FrameSource, InputError, Layout};
use dynvox_core::{BudgetError, BudgetOptions, Capacity};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct InspectArgs {
    /// Folder to inspect
    path: PathBuf,
    /// Layout of the data set; guessed from the path unless given
    #[arg(long, value_enum)]
    dataset: Option<Layout>,
}

pub fn run(args: &InspectArgs) -> anyhow::Result<()> {
    let (layout, found) = match input::survey(&args.path, args.dataset) {
        // A folder that cannot be mapped may be of another kind.
        Err(error @ InputError::Layout { .. }) => return other(&args.path).unwrap_or(Err(error.into())),
        survey => survey?,
    };
    outln!("{}: {} ({} sequence{})", args.path.display(), layout.name(), found.len(), if found.len() == 1 { "" } else { "s" });
    outln!("  {}", layout.describe(&args.path));
    for one in &found {
        outln!("");
        if let Some(sequence) = &one.sequence {
            outln!("sequence {sequence}");
        }
        match &one.opened {
            Ok(dataset) => describe(dataset.as_ref(), &command(&args.path, one)),
            Err(error) => outln!("  cannot be used: {error}"),
        }
    }
    if found.iter().all(|one| one.opened.is_err()) {
        anyhow::bail!("nothing at {} can be mapped. The reasons stand above", args.path.display());
    }
    Ok(())
}

/// Describes a folder that is not a data set: a run's results, a stereo benchmark; `None` for neither.
fn other(path: &Path) -> Option<anyhow::Result<()>> {
    let shown = path.display();
    if path.join("summary.json").is_file() {
        outln!("{shown}: the results of a run; report.html shows them in a browser");
        outln!("  evaluate its trajectory: dynvox evaluate trajectory {shown} TRUTH");
        outln!("  the same run again: dynvox run [PATH] --config {}", path.join("config.toml").display());
        return Some(Ok(()));
    }
    match find_stereo_set(path) {
        Ok(set) => {
            outln!("{shown}: {}, {} pairs with true disparity: single pairs, nothing to map", set.name, set.pairs.len());
            outln!("  evaluate the matcher: dynvox evaluate stereo {shown}");
            Some(Ok(()))
        }
        Err(error @ StereoSetError::NoTruth { .. }) => Some(Err(error.into())),
        Err(_) => None,
    }
}

fn command(path: &Path, found: &Found) -> String {
    let sequence = found.sequence.as_ref().map(|sequence| format!(" --sequence {sequence}")).unwrap_or_default();
    format!("dynvox run {}{sequence}", path.display())
}

fn describe(dataset: &dyn FrameSource, command: &str) {
    let ((width, height), rig) = (dataset.size(), dataset.rig());
    let last = dataset.len().saturating_sub(1);
    let seconds = dataset.time_s(last) - dataset.time_s(0);
    outln!("  {} stereo pairs of {width} x {height} px, {seconds:.1} s", dataset.len());
    outln!(
        "  focal length {:.2} px, principal point ({:.2}, {:.2}) px, baseline {:.4} m",
        rig.focal_px,
        rig.center_u_px,
        rig.center_v_px,
        rig.baseline_m
    );
    let first = dataset.frame(0);
    match &first {
        Ok(frame) => {
            outln!("  {}", if frame.colour.is_some() { "colour images: the map has colours" } else { "grey images: the map is grey" })
        }
        Err(error) => outln!("  the first frame cannot be read: {error}"),
    }
    outln!(
        "  {}",
        if dataset.truth().is_some() {
            "ground-truth poses: the trajectory is evaluated"
        } else {
            "no ground-truth poses: the trajectory is not evaluated"
        }
    );
    if first.is_ok_and(|frame| frame.objects.is_some()) {
        outln!("  object labels: motions, states and tracks are evaluated");
    }
    outln!("  {}", masks(dataset));
    let evaluate = lidar(dataset);
    match diagnosis::examine(dataset, &(0..dataset.len()).collect::<Vec<_>>()) {
        Ok(findings) => {
            for finding in findings {
                println!("  {}: {}", if finding.refused { "refused" } else { "warning" }, finding.message);
            }
        }
        Err(error) => println!("  the images cannot be examined: {error}"),
    }
    for note in dataset.notes() {
        outln!("  note: {note}");
    }
    match least_memory(width, height) {
        Ok(least) => outln!("  memory: 256 MiB by default; at least --memory {}MiB", least.div_ceil(1 << 20)),
        Err(error) => outln!("  cannot be mapped at this size: {error}. Shrink the images with --scale"),
    }
    outln!("  map it: {command}{}", if evaluate { " --evaluate lidar" } else { "" });
}

/// Bytes of the least slab for images of a size.
fn least_memory(width: usize, height: usize) -> Result<usize, BudgetError> {
    match Capacity::for_budget(0, width, height, &BudgetOptions::default()) {
        Ok(capacity) => Ok(capacity.bytes()),
        Err(BudgetError::TooSmall { least }) => Ok(least),
        Err(other) => Err(other),
    }
}

fn masks(dataset: &dyn FrameSource) -> String {
    match dataset.masks() {
        AvailableMasks::Folder(folder) => {
            let has = |index: &usize| dataset.stem(*index).is_some_and(|stem| folder.join(format!("{stem}.png")).is_file());
            let there = (0..dataset.len()).filter(has).count();
            match there {
                0 => format!("{} has no mask of any frame's name: objects are found only while they move", folder.display()),
                there if there == dataset.len() => format!("masks in {}: objects are separate from the static map", folder.display()),
                there => format!(
                    "masks in {} for {there} of {} frames: in the others objects are found only while they move",
                    folder.display(),
                    dataset.len()
                ),
            }
        }
        AvailableMasks::Exact => "exact masks, by --instances exact".to_owned(),
        AvailableMasks::Absent => "no masks: objects are found only while they move, unless --instances names some".to_owned(),
    }
}

/// Prints whether there are scans; returns whether input and map can be evaluated against them.
fn lidar(dataset: &dyn FrameSource) -> bool {
    let scans: Vec<usize> = (0..dataset.len()).filter(|&index| dataset.has_lidar(index)).collect();
    let Some(&first) = scans.first() else {
        outln!("  no LiDAR scans (velodyne/): accuracy and completeness stay unknown");
        return false;
    };
    match dataset.lidar(first) {
        Ok(_) => outln!("  LiDAR scans of {} frames: --evaluate lidar measures accuracy and completeness", scans.len()),
        Err(error) => outln!("  LiDAR scans of {} frames, but {error}", scans.len()),
    }
    dataset.lidar(first).is_ok()
}
