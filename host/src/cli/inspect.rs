//! `dynvox inspect`.

mod unit;

use crate::evaluate::stereo::{StereoSetError, find_stereo_set};
use crate::formats::calibration::CalibrationHints;
use crate::formats::{SETTINGS_FILE, SUMMARY_FILE};
use crate::input::diagnosis;
use crate::input::{
    self, AvailableMasks, Found, FrameSource, InertialChoice, InputError, Layout, OpenOptions,
};
use crate::terminal::{name, quoted};
use dynvox_core::geometry::StereoRig;
use dynvox_core::{BudgetError, BudgetOptions, Capacity};
use serde::{Serialize, Serializer};
use serde_json::json;
use std::path::PathBuf;
use unit::UnitFound;

#[derive(Debug, clap::Args)]
pub struct InspectArgs {
    /// Folder to inspect
    path: PathBuf,
    /// Layout of the data set; guessed from the path unless given
    #[arg(long, value_enum)]
    dataset: Option<Layout>,
    /// Calibration instead of the recording's own, once or for each camera
    #[arg(long, value_name = "FILE")]
    calibration: Vec<PathBuf>,
    #[command(flatten)]
    hints: CalibrationHints,
    /// Samples of an inertial unit instead of the recording's own, or none
    #[arg(long, value_name = "FILE|none")]
    inertial: Option<InertialChoice>,
    /// Mounting of that unit on the left camera, once for each file
    #[arg(long, value_name = "FILE")]
    inertial_calibration: Vec<PathBuf>,
    /// Write what is found to standard output as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &InspectArgs) -> anyhow::Result<()> {
    let options = OpenOptions {
        layout: args.dataset,
        calibration: args.calibration.clone(),
        hints: args.hints,
        inertial: args.inertial.clone().unwrap_or_default(),
        inertial_calibration: args.inertial_calibration.clone(),
        ..OpenOptions::default()
    };
    let (layout, found) = match input::survey(&args.path, &options) {
        // A folder that cannot be mapped may be of another kind.
        Err(error @ InputError::Layout { .. }) => return other(args).unwrap_or(Err(error.into())),
        survey => survey?,
    };
    if !args.json {
        outln!(
            "{}: {} ({} sequence{})",
            args.path.display(),
            layout.name(),
            found.len(),
            if found.len() == 1 { "" } else { "s" }
        );
        outln!("  {}", layout.describe(&args.path));
    }
    let mut sequences = Vec::new();
    for one in &found {
        let sequence = SequenceFound {
            sequence: one.sequence.clone(),
            described: one
                .opened
                .as_ref()
                .map(|dataset| Description::of(dataset.as_ref(), &command(args, one)))
                .map_err(ToString::to_string),
        };
        // Line by line as they are examined, which takes its time.
        if !args.json {
            sequence.print();
        }
        sequences.push(sequence);
    }
    if args.json {
        let sequences: Vec<_> = sequences.iter().map(SequenceFound::json).collect();
        let found = json!({ "path": args.path, "layout": layout.name(), "sequences": sequences });
        outln!("{}", serde_json::to_string_pretty(&found)?);
    }
    if found.iter().all(|one| one.opened.is_err()) {
        let stand = if args.json { "under `error`" } else { "above" };
        anyhow::bail!(
            "nothing at {} can be mapped. The reasons stand {stand}",
            args.path.display()
        );
    }
    Ok(())
}

/// Describes a folder that is not a data set: a run's results, a stereo benchmark; `None` for
/// neither.
fn other(args: &InspectArgs) -> Option<anyhow::Result<()>> {
    let (path, shown) = (&args.path, args.path.display());
    if path.join(SUMMARY_FILE).is_file() {
        let (evaluate, again) = (
            format!("dynvox evaluate trajectory {} TRUTH", quoted(path)),
            format!("dynvox run [PATH] --config {}", quoted(&path.join(SETTINGS_FILE))),
        );
        if args.json {
            outln!("{:#}", json!({ "path": path, "layout": "run", "commands": [evaluate, again] }));
            return Some(Ok(()));
        }
        outln!("{shown}: the results of a run; report.html shows them in a browser");
        outln!("  evaluate its trajectory: {evaluate}");
        outln!("  the same run again: {again}");
        return Some(Ok(()));
    }
    match find_stereo_set(path) {
        Ok(set) => {
            let (pairs, evaluate) =
                (set.pairs.len(), format!("dynvox evaluate stereo {}", quoted(path)));
            if args.json {
                outln!(
                    "{:#}",
                    json!({ "path": path, "layout": set.name, "pairs": pairs, "commands": [evaluate] })
                );
                return Some(Ok(()));
            }
            outln!(
                "{shown}: {}, {pairs} pairs with true disparity: single pairs, nothing to map",
                set.name
            );
            outln!("  evaluate the matcher: {evaluate}");
            Some(Ok(()))
        }
        Err(error @ StereoSetError::NoTruth { .. }) => Some(Err(error.into())),
        Err(_) => None,
    }
}

/// Command that maps a sequence, with what was said of its calibration.
fn command(args: &InspectArgs, found: &Found) -> String {
    let sequence = found
        .sequence
        .as_ref()
        .map(|sequence| format!(" --sequence {}", quoted(sequence.as_ref())))
        .unwrap_or_default();
    let files = args.calibration.iter().map(|file| format!(" --calibration {}", quoted(file)));
    let hints = args.hints.options();
    let unit = match &args.inertial {
        None | Some(InertialChoice::Auto) => String::new(),
        Some(InertialChoice::None) => " --inertial none".to_owned(),
        Some(InertialChoice::File(path)) => format!(" --inertial {}", quoted(path)),
    };
    let mounting = args.inertial_calibration.iter();
    let mounting = mounting.map(|file| format!(" --inertial-calibration {}", quoted(file)));
    format!(
        "dynvox run {}{sequence}{}{hints}{unit}{}",
        quoted(&args.path),
        files.collect::<String>(),
        mounting.collect::<String>()
    )
}

/// One sequence, or why it cannot be used.
struct SequenceFound {
    sequence: Option<String>,
    described: Result<Description, String>,
}

impl SequenceFound {
    fn print(&self) {
        outln!("");
        if let Some(sequence) = &self.sequence {
            outln!("sequence {}", name(sequence));
        }
        match &self.described {
            Ok(description) => description.print(),
            Err(error) => outln!("  cannot be used: {error}"),
        }
    }

    fn json(&self) -> serde_json::Value {
        match &self.described {
            Ok(description) => json!({ "sequence": self.sequence, "dataset": description }),
            Err(error) => json!({ "sequence": self.sequence, "error": error }),
        }
    }
}

/// Contents of a sequence, and what can be made of them.
#[derive(Serialize)]
struct Description {
    pairs: usize,
    width: usize,
    height: usize,
    seconds: f64,
    #[serde(serialize_with = "rig_numbers")]
    rig: StereoRig,
    /// True if images have colour; absent if the first cannot be read.
    colour: Option<bool>,
    true_poses: bool,
    object_labels: bool,
    masks: &'static str,
    frames_with_masks: usize,
    frames_with_lidar: usize,
    /// Inertial unit in use; absent without one.
    inertial: Option<UnitFound>,
    /// Doubts about the images.
    findings: Vec<Doubt>,
    /// Files that exist and cannot be read.
    unreadable: Vec<String>,
    notes: Vec<String>,
    /// Least bytes of memory; absent where images of this size cannot be mapped.
    least_bytes: Option<usize>,
    command: String,
    #[serde(skip)]
    mask_sentence: String,
    #[serde(skip)]
    memory_sentence: String,
}

fn rig_numbers<S: Serializer>(rig: &StereoRig, serializer: S) -> Result<S::Ok, S::Error> {
    let StereoRig { focal_px, center_u_px, center_v_px, baseline_m } = rig;
    json!({ "focal_px": focal_px, "center_u_px": center_u_px, "center_v_px": center_v_px, "baseline_m": baseline_m }).serialize(serializer)
}

#[derive(Serialize)]
struct Doubt {
    refused: bool,
    message: String,
}

impl Description {
    fn of(dataset: &dyn FrameSource, command: &str) -> Self {
        let (width, height) = dataset.size();
        let first = dataset.frame(0);
        let mut unreadable: Vec<String> = first
            .as_ref()
            .err()
            .map(|error| format!("the first frame cannot be read: {error}"))
            .into_iter()
            .collect();
        let scans: Vec<usize> =
            (0..dataset.len()).filter(|&index| dataset.has_lidar(index)).collect();
        let scan = scans.first().map(|&index| dataset.lidar(index));
        if let Some(Err(error)) = &scan {
            unreadable.push(format!("the first LiDAR scan cannot be read: {error}"));
        }
        let findings = diagnosis::examine(dataset, &(0..dataset.len()).collect::<Vec<_>>())
            .unwrap_or_else(|error| {
                unreadable.push(format!("the images cannot be examined: {error}"));
                Vec::new()
            });
        let least = least_memory(width, height);
        let (masks, frames_with_masks, mask_sentence) = masks(dataset);
        let evaluate = if matches!(scan, Some(Ok(_))) { " --evaluate lidar" } else { "" };
        Self {
            pairs: dataset.len(),
            width,
            height,
            seconds: dataset.time_s(dataset.len().saturating_sub(1)) - dataset.time_s(0),
            rig: dataset.rig(),
            colour: first.as_ref().ok().map(|frame| frame.colour.is_some()),
            true_poses: dataset.truth().is_some(),
            object_labels: first.is_ok_and(|frame| frame.objects.is_some()),
            masks,
            frames_with_masks,
            frames_with_lidar: scans.len(),
            inertial: dataset.info().inertial.as_deref().map(UnitFound::new),
            findings: findings
                .into_iter()
                .map(|finding| Doubt { refused: finding.refused, message: finding.message })
                .collect(),
            unreadable,
            notes: dataset.notes().to_vec(),
            memory_sentence: match &least {
                Ok(least) => format!(
                    "memory: 256 MiB by default; at least --memory {}MiB",
                    least.div_ceil(1 << 20)
                ),
                Err(error) => format!(
                    "cannot be mapped at this size: {error}. Shrink the images with --scale"
                ),
            },
            least_bytes: least.ok(),
            command: format!("{command}{evaluate}"),
            mask_sentence,
        }
    }

    fn print(&self) {
        outln!(
            "  {} stereo pairs of {} x {} px, {:.1} s",
            self.pairs,
            self.width,
            self.height,
            self.seconds
        );
        let StereoRig { focal_px, center_u_px, center_v_px, baseline_m } = self.rig;
        outln!(
            "  focal length {focal_px:.2} px, principal point ({center_u_px:.2}, {center_v_px:.2}) \
             px, baseline {baseline_m:.4} m"
        );
        match self.colour {
            Some(true) => outln!("  colour images: the map has colours"),
            Some(false) => outln!("  grey images: the map is grey"),
            None => {}
        }
        let (poses, not) = if self.true_poses { ("", "") } else { ("no ", "not ") };
        outln!("  {poses}ground-truth poses: the trajectory is {not}evaluated");
        if self.object_labels {
            outln!("  object labels: motions, states and tracks are evaluated");
        }
        outln!("  {}", self.mask_sentence);
        match self.frames_with_lidar {
            0 => outln!("  no LiDAR scans (velodyne/): accuracy and completeness stay unknown"),
            frames => outln!(
                "  LiDAR scans of {frames} frames: --evaluate lidar measures accuracy and \
                 completeness"
            ),
        }
        match &self.inertial {
            Some(unit) => unit.print(),
            None => outln!("  no inertial unit in use"),
        }
        self.unreadable.iter().for_each(|what| outln!("  {what}"));
        for Doubt { refused, message } in &self.findings {
            outln!("  {}: {message}", if *refused { "refused" } else { "warning" });
        }
        self.notes.iter().for_each(|note| outln!("  note: {note}"));
        outln!("  {}", self.memory_sentence);
        outln!("  map it: {}", self.command);
    }
}

/// Bytes of the least slab for images of a size.
fn least_memory(width: usize, height: usize) -> Result<usize, BudgetError> {
    match Capacity::for_budget(0, width, height, &BudgetOptions::default()) {
        Ok(capacity) => Ok(capacity.bytes()),
        Err(BudgetError::TooSmall { least }) => Ok(least),
        Err(other) => Err(other),
    }
}

/// Returns the kind of masks, the number of frames that have them, and both as a sentence.
fn masks(dataset: &dyn FrameSource) -> (&'static str, usize, String) {
    match dataset.masks() {
        AvailableMasks::Folder(folder) => {
            let has = |index: &usize| {
                dataset
                    .stem(*index)
                    .is_some_and(|stem| folder.join(format!("{stem}.png")).is_file())
            };
            let there = (0..dataset.len()).filter(has).count();
            let sentence = match there {
                0 => format!(
                    "{} has no mask of any frame's name: objects are found only while they move",
                    folder.display()
                ),
                there if there == dataset.len() => format!(
                    "masks in {}: objects are separate from the static map",
                    folder.display()
                ),
                there => format!(
                    "masks in {} for {there} of {} frames: in the others objects are found only \
                     while they move",
                    folder.display(),
                    dataset.len()
                ),
            };
            ("files", there, sentence)
        }
        AvailableMasks::Exact => {
            ("exact", dataset.len(), "exact masks, by --instances exact".to_owned())
        }
        AvailableMasks::Absent => (
            "none",
            0,
            "no masks: objects are found only while they move, unless --instances names some"
                .to_owned(),
        ),
    }
}
