//! What is kept of a run: its summary, and per frame what boxes and curves are drawn of. One file a run, written at once or not at all.

use super::SweepError;
use crate::evaluate::lidar::{EvaluatedFrame, Layer};
use crate::report::Summary;
use crate::run::{RunRecord, write_whole};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::io::Write;
use std::path::Path;

/// A finished run of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// What made it: arguments without path and threads.
    pub arguments: Vec<String>,
    /// `summary.json` of the run.
    pub summary: Value,
    /// Evaluated frames.
    pub samples: Vec<FrameSample>,
    /// Blocks in use after each frame.
    pub blocks: Vec<u32>,
}

/// Shares of one evaluated frame, static layer.
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
    fn of(frame: &EvaluatedFrame) -> Self {
        let tally = &frame.layers[Layer::Static as usize];
        Self {
            frame: frame.frame,
            accuracy: [0, 1].map(|source| tally.accuracy(source, 0)),
            completeness: [0, 1].map(|source| tally.completeness(source)),
        }
    }
}

impl RunResult {
    /// What is kept of a run.
    ///
    /// # Errors
    /// The summary cannot be turned into JSON.
    pub fn of(arguments: &[String], run: &RunRecord) -> Result<Self, serde_json::Error> {
        Ok(Self {
            arguments: arguments.to_vec(),
            summary: serde_json::to_value(Summary::of(run))?,
            samples: run.lidar.iter().flat_map(|lidar| &lidar.frames).map(FrameSample::of).collect(),
            blocks: run.rows.iter().map(|row| row.report.blocks.used).collect(),
        })
    }

    /// Reads a result; `None` where there is none.
    ///
    /// # Errors
    /// The file cannot be read, or holds something else.
    pub fn read(path: &Path) -> Result<Option<Self>, SweepError> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(SweepError::Read { path: path.to_path_buf(), source }),
        };
        serde_json::from_str(&text).map(Some).map_err(|error| SweepError::Foreign { path: path.to_path_buf(), reason: error.to_string() })
    }

    /// Writes it beside its place, then puts it there.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), SweepError> {
        let text =
            serde_json::to_vec_pretty(self).map_err(|error| SweepError::Foreign { path: path.to_path_buf(), reason: error.to_string() })?;
        Ok(write_whole(path, |file| file.write_all(&text))?)
    }

    /// A share by layer (`static`, `dynamic`), source (`input`, `fused`) and name.
    pub fn share(&self, layer: &str, source: &str, name: &str) -> Option<f64> {
        self.summary["lidar"][layer][source][name].as_f64()
    }

    /// Whether the depth tracker was lost.
    pub fn lost(&self) -> Option<u64> {
        self.summary["egomotion"]["tracking_failures"].as_u64().filter(|failures| *failures > 0)
    }

    /// Blocks of the map in the end.
    pub fn blocks_in_the_end(&self) -> Option<f64> {
        self.summary["map"]["blocks"].as_f64()
    }
}
