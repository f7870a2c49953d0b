//! Plan of a sweep: the runs it is made of. Points of different sweeps that mean the same run share
//! it.

use crate::input::depth::DepthChoice;
use crate::input::masks::MaskChoice;
use crate::request::{Reference, Request, Source};
use crate::run::program;
use dynvox_core::MotionSource;
use dynvox_core::digest::Digest;
use dynvox_core::volume::PruneBy;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;

/// Setting that a sweep varies.
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
    /// Separate objects, on or off.
    Dynamic,
    /// The three methods of Table I: depth tracker, stereo egomotion, stereo egomotion and objects;
    /// and objects without a detector.
    Methods,
}

impl Kind {
    /// Returns true if the map is evaluated at a frame's pose later, after pruning.
    const fn is_evaluated_late(self) -> bool {
        matches!(self, Self::PruneWeight | Self::FrameRate)
    }

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

/// One data set: a synthetic world, `PATH` or `PATH:SEQUENCE`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Data {
    /// Source of its images.
    pub source: Source,
    /// Sequence within it.
    pub sequence: Option<String>,
}

impl FromStr for Data {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Err("give street, room, yard, town, PATH or PATH:SEQUENCE".to_owned());
        }
        let world = match text {
            "street" => Some(Source::Street),
            "room" => Some(Source::Room),
            "yard" => Some(Source::Yard),
            "town" => Some(Source::Town),
            _ => None,
        };
        if let Some(source) = world {
            return Ok(Self { source, sequence: None });
        }
        // The colon of a Windows drive does not separate a sequence.
        let split = text.rsplit_once(':').filter(|(path, name)| {
            path.len() > 1 && !name.is_empty() && !name.contains(['/', '\\'])
        });
        Ok(match split {
            Some((path, sequence)) => {
                Self { source: Source::Recording(path.into()), sequence: Some(sequence.to_owned()) }
            }
            None => Self { source: Source::Recording(text.into()), sequence: None },
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
        match (&self.source, &self.sequence) {
            (Source::Street, _) => "street".to_owned(),
            (Source::Room, _) => "room".to_owned(),
            (Source::Yard, _) => "yard".to_owned(),
            (Source::Town, _) => "town".to_owned(),
            (Source::Stream, _) => "stream".to_owned(),
            (Source::Recording(_), Some(sequence)) => sequence.clone(),
            (Source::Recording(path), None) => name(path),
        }
    }

    /// Path of a recording; `None` for a synthetic world.
    pub fn path(&self) -> Option<&Path> {
        match &self.source {
            Source::Recording(path) => Some(path),
            _ => None,
        }
    }
}

/// Settings to vary, their values, and the data sets.
#[derive(Clone, Debug)]
pub struct SweepRequest {
    /// Data sets, and what each is evaluated against, if it can be.
    pub data: Vec<(Data, Option<Reference>)>,
    /// Sweeps.
    pub kinds: Vec<Kind>,
    /// Prune weights.
    pub weights: Vec<u8>,
    /// Frames from one that is fused to the next.
    pub rates: Vec<u32>,
    /// Scales, percent.
    pub scales: Vec<u32>,
    /// Sources of depth by name; [`DepthChoice::Exact`] is for the street alone.
    pub depths: Vec<(String, DepthChoice)>,
    /// Pruning lag of the first two sweeps, frames.
    pub prune_lag: u32,
    /// Frames after which the first two sweeps evaluate the map.
    pub evaluation_delay: usize,
    /// Request of every run.
    pub common: Request,
}

/// One point of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Setting that is varied.
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
    /// Requests of the runs by key, without data set and threads.
    pub runs: BTreeMap<String, Request>,
}

impl Plan {
    /// Lists points and runs of a request.
    ///
    /// # Errors
    /// A run cannot be stored: a path among its parts is not Unicode.
    pub fn new(request: &SweepRequest) -> Result<Self, serde_json::Error> {
        let mut plan = Self { points: Vec::new(), runs: BTreeMap::new() };
        for &kind in &request.kinds {
            for (data, reference) in &request.data {
                for (value, mut run) in values(kind, request, data) {
                    // A map that is pruned later is evaluated when pruning is through with the
                    // frame.
                    run.evaluation.reference = *reference;
                    if kind.is_evaluated_late() {
                        run.settings.volume.prune_lag = request.prune_lag;
                        run.evaluation.delay = request.evaluation_delay;
                    }
                    let label = data.label();
                    let mut digest = Digest::default();
                    // Figures of another version are not taken over.
                    digest.bytes(program().as_bytes());
                    digest.bytes(&serde_json::to_vec(&run)?);
                    // The name shows the data, the digest everything that can change the result.
                    let key = format!("{label}-{:016x}", digest.finish());
                    plan.points.push(Point { kind, data: label, value, run: key.clone() });
                    plan.runs.insert(key, run);
                }
            }
        }
        Ok(plan)
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

/// Values of one sweep on one data set: as shown, and what their runs ask for.
fn values(kind: Kind, request: &SweepRequest, data: &Data) -> Vec<(String, Request)> {
    let is_street = data.source.is_synthetic();
    let mut base = request.common.clone();
    // The street knows its masks: detections would only add their own errors.
    if is_street {
        base.masks.source = MaskChoice::Exact;
    }
    let one = |value: &dyn Display, change: &dyn Fn(&mut Request)| {
        let mut run = base.clone();
        change(&mut run);
        (value.to_string(), run)
    };
    let of = |values: &[u32], change: fn(&mut Request, u32)| {
        values.iter().map(|&value| one(&value, &|run| change(run, value))).collect()
    };
    match kind {
        Kind::PruneWeight => request
            .weights
            .iter()
            .map(|&weight| {
                let by_weight = |run: &mut Request| {
                    run.settings.volume.prune_weight = weight;
                    run.settings.volume.prune_rule = PruneBy::Weight;
                };
                one(&weight, &by_weight)
            })
            .collect(),
        Kind::FrameRate => of(&request.rates, |run, rate| run.settings.mapper.fuse_every = rate),
        Kind::Scale => {
            of(&request.scales, |run, percent| run.frames.scale = f64::from(percent) / 100.0)
        }
        Kind::Depth => request
            .depths
            .iter()
            .filter(|(_, depth)| is_street || *depth != DepthChoice::Exact)
            .map(|(name, depth)| one(name, &|run| run.depth = depth.clone()))
            .collect(),
        Kind::Dynamic => {
            vec![one(&"off", &|run| run.settings.tracking.dynamic = false), one(&"on", &|_| {})]
        }
        Kind::Methods => vec![
            one(&"depth tracker (ICP)", &|run| {
                run.settings.tracking.dynamic = false;
                run.settings.mapper.egomotion = MotionSource::Icp;
            }),
            one(&"stereo egomotion", &|run| run.settings.tracking.dynamic = false),
            one(&"stereo egomotion, separate objects", &|_| {}),
            // No masks: otherwise the street is swept with its exact ones.
            one(&"stereo egomotion, objects by motion alone", &|run| {
                run.masks.source = MaskChoice::Motion;
            }),
        ],
    }
}
