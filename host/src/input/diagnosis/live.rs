//! Pairs that come one by one, as a program hands them to a mapper: each is measured before it is
//! mapped, until enough were.
//!
//! Memory: the measurements of [`PAIRS`] pairs, no image. Time: that of matching a pair's patches.

use super::rectified::PairRectifier;
use super::{Fault, Finding, PAIRS, Pair, check_baseline, diagnose};
use crate::formats::Image;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::Rectification;

/// Examination of the first pairs of a camera.
pub struct LiveExamination {
    rectifier: Option<PairRectifier>,
    baseline: Option<Finding>,
    pairs: Vec<Pair>,
}

impl LiveExamination {
    /// Takes memory for the maps of raw cameras.
    ///
    /// # Errors
    /// The reason why raw cameras cannot be rectified.
    pub fn new(rig: &StereoRig, raw: Option<&Rectification>) -> Result<Self, String> {
        let rectifier = raw.map(|raw| PairRectifier::new(raw, rig)).transpose()?;
        Ok(Self { rectifier, baseline: check_baseline(rig), pairs: Vec::new() })
    }

    /// Returns true if another pair would be one too many.
    pub fn is_done(&self) -> bool {
        self.pairs.len() >= PAIRS
    }

    /// Measures a pair, and returns what all pairs so far show. A pair after which something is
    /// refused does not count, so that a corrected one may follow.
    pub fn take(&mut self, pair: [Image<u8>; 2]) -> Vec<Finding> {
        let pair = match &mut self.rectifier {
            None => Some(pair),
            Some(rectifier) => rectifier.rectify(&pair),
        };
        if let Some([left, right]) = pair {
            // The first pair has to be enough for a verdict, the others only add to it.
            let of = if self.pairs.is_empty() { 1 } else { PAIRS };
            self.pairs.push(Pair::new(&left, &right, of));
        }
        let mut findings: Vec<Finding> = self.baseline.iter().cloned().collect();
        // More matches may come with the pairs that follow.
        let is_told = |finding: &Finding| finding.fault != Fault::Unknown || self.is_done();
        findings.extend(diagnose(&self.pairs).into_iter().filter(is_told));
        if findings.iter().any(Finding::is_refused_live) {
            self.pairs.pop();
        }
        findings
    }
}

impl Finding {
    /// Returns true if pairs that come one by one are refused for it: a camera may begin in the
    /// dark.
    pub fn is_refused_live(&self) -> bool {
        self.refused && self.fault != Fault::Black
    }
}
