//! Time of a unit of work on this machine, fitted to frames and checked on others.
//!
//! A stage's time is taken to be proportional to one of its units. Frames are fitted in turn: of
//! each two the first sets the time of a unit, the second tells how far the prediction is off.

use crate::evaluate::quantile::{ascending, quantile};
use dynvox_core::{Stage, WorkUnits};
use serde::Serialize;

/// Units that may explain a stage's time, most telling first. Stages without units are not here.
const EXPLAINED: [(Stage, &[&str]); 5] = [
    (Stage::Stereo, &["stereo_pixels", "support_candidates", "triangles"]),
    (Stage::SceneFlow, &["features", "circles", "compared_descriptors"]),
    (Stage::Allocate, &["block_requests"]),
    (Stage::Fuse, &["fused_voxels"]),
    (Stage::Prune, &["pruned_voxels"]),
];

/// Least frames of a fit: fewer tell nothing of its error.
const MIN_FRAMES: usize = 4;

/// Work and CPU time of one frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameWork {
    /// Units that the step counted.
    pub work: WorkUnits,
    /// CPU time of each stage in the order of [`Stage::ALL`], ms.
    pub stages_ms: [f64; Stage::ALL.len()],
}

/// Time of a stage by its units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnitTime {
    /// The stage.
    pub stage: &'static str,
    /// The unit that explains its time best.
    pub unit: &'static str,
    /// Time of one unit, ns.
    pub ns: f64,
    /// Median error of the predicted times of frames that were not fitted, relative to their own.
    pub error: f64,
    /// Largest such error.
    pub error_max: f64,
    /// The most units of any step, by the capacity and the settings.
    pub bound_units: u64,
    /// Time of so many units, ms.
    pub bound_ms: f64,
}

/// Fits the stages that have units; leaves out those that did nothing, and all if there are fewer
/// than four frames.
pub fn fit(frames: &[FrameWork], bound: &WorkUnits) -> Vec<UnitTime> {
    if frames.len() < MIN_FRAMES {
        return Vec::new();
    }
    EXPLAINED.iter().filter_map(|(stage, units)| fit_stage(frames, *stage, units, bound)).collect()
}

/// The unit whose fit is best where it was fitted, and its error elsewhere.
fn fit_stage(
    frames: &[FrameWork],
    stage: Stage,
    units: &[&'static str],
    bound: &WorkUnits,
) -> Option<UnitTime> {
    let samples = |unit: &str, half: usize| -> Vec<[f64; 2]> {
        let half = frames.iter().skip(half).step_by(2);
        half.map(|frame| [count(&frame.work, unit) as f64, frame.stages_ms[stage as usize]])
            // A stage that did nothing in a frame tells nothing of its units.
            .filter(|[units, ms]| *units > 0.0 && *ms > 0.0)
            .collect()
    };
    let mut best: Option<(f64, &'static str, f64)> = None;
    for &unit in units {
        let fitted = samples(unit, 0);
        let Some(ms) = ratio(&fitted) else { continue };
        let error = quantile(&errors(&fitted, ms), 0.5)?;
        // Of equal ones the first: units of a constant image size explain equally well.
        if best.is_none_or(|(least, ..)| error < least) {
            best = Some((error, unit, ms));
        }
    }
    let (_, unit, ms) = best?;
    // Errors of the frames that set it would be too kind.
    let errors = errors(&samples(unit, 1), ms);
    let bound_units = count(bound, unit);
    Some(UnitTime {
        stage: stage.name(),
        unit,
        ns: ms * 1e6,
        error: quantile(&errors, 0.5)?,
        error_max: quantile(&errors, 1.0)?,
        bound_units,
        bound_ms: ms * bound_units as f64,
    })
}

/// Time of a unit, ms: that of all samples by their units.
fn ratio(samples: &[[f64; 2]]) -> Option<f64> {
    let [units, ms] = samples.iter().fold([0.0; 2], |sum, [a, b]| [sum[0] + a, sum[1] + b]);
    (units > 0.0).then(|| ms / units)
}

/// Relative errors of predictions, ascending.
fn errors(samples: &[[f64; 2]], ms_a_unit: f64) -> Vec<f64> {
    ascending(samples.iter().map(|[units, ms]| (ms_a_unit * units / ms - 1.0).abs()))
}

/// Count of the unit of that name.
fn count(work: &WorkUnits, unit: &str) -> u64 {
    work.named().iter().find(|(name, _)| *name == unit).map_or(0, |(_, count)| *count)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames whose stages take a time a unit, and `noise` of it more in every second pair.
    fn frames(count: u64, noise: f64) -> Vec<FrameWork> {
        let frame = |i: u64| {
            let mut work = WorkUnits::default();
            (work.stereo_pixels, work.triangles) = (30_000, 200 + 10 * i);
            (work.features, work.circles) = (1_000 + 37 * (i % 7), 300 + 50 * (i % 3));
            (work.fused_voxels, work.block_requests) = (512 * (400 + i), 5_000);
            let more = 1.0 + if i % 4 == 3 { noise } else { 0.0 };
            let mut stages_ms = [0.0; Stage::ALL.len()];
            stages_ms[Stage::Stereo as usize] = 5.0 * more;
            stages_ms[Stage::SceneFlow as usize] = 0.004 * work.circles as f64 * more;
            stages_ms[Stage::Fuse as usize] = 8e-6 * work.fused_voxels as f64 * more;
            FrameWork { work, stages_ms }
        };
        (0..count).map(frame).collect()
    }

    #[test]
    fn a_unit_has_the_time_its_stage_takes_for_it() {
        let mut bound = WorkUnits::default();
        bound.fused_voxels = 1_024_000;
        let times = fit(&frames(20, 0.0), &bound);
        let named: Vec<_> = times.iter().map(|time| (time.stage, time.unit)).collect();
        // Allocation took no time, pruning did nothing; pixels are constant like stereo's time.
        assert_eq!(
            named,
            [("stereo", "stereo_pixels"), ("scene_flow", "circles"), ("fuse", "fused_voxels")]
        );
        assert!((times[1].ns - 4_000.0).abs() < 1e-6 && times[1].error_max < 1e-9);
        assert!((times[2].ns - 8.0).abs() < 1e-9);
        assert!((times[2].bound_ms - 8.192).abs() < 1e-9);
    }

    #[test]
    fn errors_are_those_of_frames_that_were_not_fitted() {
        // One frame in four takes a quarter longer; no such frame is among those fitted.
        let times = fit(&frames(40, 0.25), &WorkUnits::default());
        for time in times {
            assert!((time.error_max - 0.2).abs() < 1e-9, "{time:?}");
        }
    }

    #[test]
    fn three_frames_are_too_few() {
        assert!(fit(&frames(3, 0.0), &WorkUnits::default()).is_empty());
    }
}
