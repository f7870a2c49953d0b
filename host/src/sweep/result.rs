//! The result of a run: its summary, and per frame the numbers that boxes and curves show. One file
//! a run, written atomically.

use super::SweepError;
use crate::evaluate::reference::{EvaluatedFrame, PointOutcomes, Region};
use crate::formats::bounds::MANIFEST_TEXT;
use crate::formats::read_text_within;
use crate::report::Summary;
use crate::request::Request;
use crate::run::{RunRecord, write_whole};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::io::Write;
use std::path::Path;

/// A finished run of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// Request of the run, without data set and threads.
    pub request: Request,
    /// `summary.json` of the run.
    pub summary: Value,
    /// Evaluated frames.
    pub samples: Vec<FrameSample>,
    /// Outcomes of the points of the static map.
    #[serde(default)]
    pub outcomes: Vec<PointOutcomes>,
    /// Most blocks in use after each frame, or each few frames of a long run.
    pub blocks: Vec<u32>,
    /// Number of frames between two of these values.
    #[serde(default = "one")]
    pub blocks_every: usize,
}

/// Returns the value of `blocks_every` for results of earlier versions.
const fn one() -> usize {
    1
}

/// Accuracy and completeness of one evaluated frame, static region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameSample {
    /// Number of the frame.
    pub frame: usize,
    /// Accuracy of input and map.
    pub accuracy: [Option<f64>; 2],
    /// Completeness of input and map.
    pub completeness: [Option<f64>; 2],
}

impl FrameSample {
    fn new(frame: &EvaluatedFrame) -> Self {
        let counts = &frame.regions[Region::Static as usize];
        Self {
            frame: frame.frame,
            accuracy: [0, 1].map(|source| counts.accuracy(source, 0)),
            completeness: [0, 1].map(|source| counts.completeness(source)),
        }
    }
}

impl RunResult {
    /// The result of a finished run.
    ///
    /// # Errors
    /// The summary cannot be turned into JSON.
    pub fn from_run(request: &Request, run: &RunRecord) -> Result<Self, serde_json::Error> {
        // The charts of the page need a bounded number of values, however long the run was.
        let charts = run.frames.charts();
        Ok(Self {
            request: request.clone(),
            summary: serde_json::to_value(Summary::new(run))?,
            samples: run
                .sections
                .reference
                .iter()
                .flat_map(|reference| &reference.frames)
                .map(FrameSample::new)
                .collect(),
            outcomes: run
                .sections
                .reference
                .iter()
                .flat_map(|reference| &reference.outcomes)
                .cloned()
                .collect(),
            blocks: charts.series("blocks_used").into_iter().map(|blocks| blocks as u32).collect(),
            blocks_every: charts.frames_per_point(),
        })
    }

    /// Reads a result; `None` if the file does not exist.
    ///
    /// # Errors
    /// The file cannot be read, or is not a result.
    pub fn read(path: &Path) -> Result<Option<Self>, SweepError> {
        let text = match read_text_within(path, &MANIFEST_TEXT).map_err(std::io::Error::from) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(SweepError::Read { path: path.to_path_buf(), source }),
        };
        serde_json::from_str(&text).map(Some).map_err(|error| SweepError::Foreign {
            path: path.to_path_buf(),
            reason: error.to_string(),
        })
    }

    /// Writes it atomically.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), SweepError> {
        let text = serde_json::to_vec_pretty(self).map_err(|error| SweepError::Foreign {
            path: path.to_path_buf(),
            reason: error.to_string(),
        })?;
        Ok(write_whole(path, |file| file.write_all(&text))?)
    }

    /// A share by region (`static`, `dynamic`), source (`input`, `fused`) and name.
    pub fn share(&self, region: &str, source: &str, name: &str) -> Option<f64> {
        self.summary["lidar"][region][source][name].as_f64()
    }

    /// Frames the depth tracker lost, if any.
    pub fn tracking_failures(&self) -> Option<u64> {
        self.summary["egomotion"]["tracking_failures"].as_u64().filter(|failures| *failures > 0)
    }

    /// Blocks of the map at the end.
    pub fn final_blocks(&self) -> Option<f64> {
        self.summary["map"]["blocks"].as_f64()
    }
}
