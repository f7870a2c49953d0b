//! Which runs a sweep is made of. Points of different sweeps that mean the same run share it.

use crate::run::program;
use dynvox_core::digest::Digest;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What is varied.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The weight up to which voxels are pruned.
    PruneWeight,
    /// Every k-th frame is fused.
    FrameRate,
    /// The images' size.
    Scale,
    /// The source of depth.
    Depth,
    /// Whether objects are separate from the static map.
    Dynamic,
    /// The three methods of Table I: depth tracker, stereo egomotion, stereo egomotion and objects;
    /// and objects without a detector.
    Methods,
}

impl Kind {
    /// Name on the command line, and of its table.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PruneWeight => "prune-weight",
            Self::FrameRate => "frame-rate",
            Self::Scale => "scale",
            Self::Depth => "depth",
            Self::Dynamic => "dynamic",
            Self::Methods => "methods",
        }
    }
}

/// One data set: `street`, `PATH` or `PATH:SEQUENCE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Data {
    /// Where it is; the synthetic street where absent.
    pub path: Option<PathBuf>,
    /// Sequence within it.
    pub sequence: Option<String>,
}

impl FromStr for Data {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Err("give street, PATH or PATH:SEQUENCE".to_owned());
        }
        if text == "street" {
            return Ok(Self { path: None, sequence: None });
        }
        // The colon of a Windows drive does not separate a sequence.
        let split = text.rsplit_once(':').filter(|(path, name)| {
            path.len() > 1 && !name.is_empty() && !name.contains(['/', '\\'])
        });
        Ok(match split {
            Some((path, sequence)) => {
                Self { path: Some(path.into()), sequence: Some(sequence.to_owned()) }
            }
            None => Self { path: Some(text.into()), sequence: None },
        })
    }
}

impl Data {
    /// A short name, the same on every machine.
    pub fn label(&self) -> String {
        let name = |path: &Path| {
            path.file_name()
                .map_or_else(|| "data".to_owned(), |name| name.to_string_lossy().into_owned())
        };
        match (&self.path, &self.sequence) {
            (None, _) => "street".to_owned(),
            (Some(_), Some(sequence)) => sequence.clone(),
            (Some(path), None) => name(path),
        }
    }
}

/// What to vary, and its values.
#[derive(Clone, Debug)]
pub struct SweepRequest {
    /// Data sets, and what each is evaluated against: `lidar`, `exact` or nothing.
    pub data: Vec<(Data, Option<&'static str>)>,
    /// Sweeps.
    pub kinds: Vec<Kind>,
    /// Prune weights.
    pub weights: Vec<u32>,
    /// Frames from one that is fused to the next.
    pub rates: Vec<u32>,
    /// Scales, percent.
    pub scales: Vec<u32>,
    /// Sources of depth; `exact` is for the street alone.
    pub depths: Vec<String>,
    /// Pruning lag and evaluation delay of the first two sweeps, frames.
    pub lag_and_delay: [usize; 2],
    /// Arguments of every run.
    pub common: Vec<String>,
}

/// One point of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// What is varied.
    pub kind: Kind,
    /// Name of the data set.
    pub data: String,
    /// The value, as it is shown.
    pub value: String,
    /// Key of the run.
    pub run: String,
}

/// All points, and the runs they need: the same on every machine that makes a part of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// In the order shown.
    pub points: Vec<Point>,
    /// What makes a run, by its key: its arguments without path and threads.
    pub runs: BTreeMap<String, Vec<String>>,
}

impl Plan {
    /// Lists points and runs of a request.
    pub fn new(request: &SweepRequest) -> Self {
        let mut plan = Self { points: Vec::new(), runs: BTreeMap::new() };
        for &kind in &request.kinds {
            for (data, reference) in &request.data {
                for (value, more, delayed) in values(kind, request, data) {
                    let mut arguments = request.common.clone();
                    if data.path.is_none() && !more.contains(&MOTION[0].to_owned()) {
                        arguments.extend(["--instances", "exact"].map(str::to_owned));
                    }
                    arguments.extend(more);
                    if let Some(reference) = reference {
                        arguments.extend(["--evaluate", reference].map(str::to_owned));
                    }
                    if delayed {
                        let [lag, delay] = request.lag_and_delay;
                        arguments.extend(["--set".to_owned(), format!("volume.prune_lag={lag}")]);
                        arguments.extend(["--evaluation-delay".to_owned(), delay.to_string()]);
                    }
                    let label = data.label();
                    let mut digest = Digest::default();
                    // Figures of another version are not taken over.
                    digest.bytes(program().as_bytes());
                    arguments.iter().for_each(|argument| digest.bytes(argument.as_bytes()));
                    let run = format!("{label}-{:016x}", digest.finish());
                    plan.points.push(Point { kind, data: label, value, run: run.clone() });
                    plan.runs.insert(run, arguments);
                }
            }
        }
        plan
    }

    /// Keys of the runs, in the order in which points need them.
    pub fn keys(&self) -> Vec<&str> {
        let mut keys: Vec<&str> = Vec::new();
        for point in &self.points {
            if !keys.contains(&point.run.as_str()) {
                keys.push(&point.run);
            }
        }
        keys
    }

    /// The points of one sweep on one data set.
    pub fn of<'p>(&'p self, kind: Kind, data: &'p str) -> impl Iterator<Item = &'p Point> {
        self.points.iter().filter(move |point| point.kind == kind && point.data == data)
    }

    /// Sweeps there are.
    pub fn kinds(&self) -> Vec<Kind> {
        let mut kinds: Vec<Kind> = self.points.iter().map(|point| point.kind).collect();
        kinds.dedup();
        kinds
    }

    /// Data sets of a sweep.
    pub fn data(&self, kind: Kind) -> Vec<&str> {
        let mut names: Vec<&str> = self
            .points
            .iter()
            .filter(|point| point.kind == kind)
            .map(|point| point.data.as_str())
            .collect();
        names.dedup();
        names
    }
}

/// No masks: objects are found by their motion. Otherwise the street is swept with its exact masks.
const MOTION: [&str; 2] = ["--instances", "motion"];

/// Values of one sweep on one data set: as shown, as arguments, and whether the map is evaluated
/// later.
fn values(kind: Kind, request: &SweepRequest, data: &Data) -> Vec<(String, Vec<String>, bool)> {
    let one = |value: &dyn std::fmt::Display, arguments: &[&str], delayed: bool| {
        (
            value.to_string(),
            arguments.iter().map(|argument| (*argument).to_owned()).collect::<Vec<_>>(),
            delayed,
        )
    };
    // Defaults are not listed as arguments, so that sweeps share the runs they have in common.
    match kind {
        Kind::PruneWeight => request
            .weights
            .iter()
            .map(|weight| match weight {
                1 => one(weight, &[], true),
                _ => one(weight, &["--set", &format!("volume.prune_weight={weight}")], true),
            })
            .collect(),
        Kind::FrameRate => request
            .rates
            .iter()
            .map(|rate| match rate {
                1 => one(rate, &[], true),
                _ => one(rate, &["--fuse-every", &rate.to_string()], true),
            })
            .collect(),
        Kind::Scale => request
            .scales
            .iter()
            .map(|percent| match percent {
                100 => one(percent, &[], false),
                _ => one(percent, &["--scale", &(f64::from(*percent) / 100.0).to_string()], false),
            })
            .collect(),
        Kind::Depth => {
            let fits = |source: &&String| source.as_str() != "exact" || data.path.is_none();
            request
                .depths
                .iter()
                .filter(fits)
                .map(|source| match source.as_str() {
                    "elas" => one(source, &[], false),
                    _ => one(source, &["--depth", source], false),
                })
                .collect()
        }
        Kind::Dynamic => vec![one(&"off", &["--dynamic", "off"], false), one(&"on", &[], false)],
        Kind::Methods => vec![
            one(&"depth tracker (ICP)", &["--dynamic", "off", "--egomotion", "icp"], false),
            one(&"stereo egomotion", &["--dynamic", "off"], false),
            one(&"stereo egomotion, separate objects", &[], false),
            one(&"stereo egomotion, objects by motion alone", &MOTION, false),
        ],
    }
}
