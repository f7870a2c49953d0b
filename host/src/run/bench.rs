//! Costs of a step, stage by stage: work, span, and the bound on two threads, over the frames of a
//! plan; and the time of a unit of work.

use super::error::{RunError, failed_step};
use super::frames::{each_frame, with_mapper};
use super::spans::{Cost, Spans};
use super::unit_times::{FrameWork, UnitTime, fit};
use crate::evaluate::quantile::{ascending, median, quantile};
use crate::request::Plan;
use dynvox_core::Stage;
use dynvox_core::parallel::Vectors;
use serde::Serialize;
use std::time::Duration;

/// Medians over the frames, ms of CPU time.
#[derive(Clone, Debug, Serialize)]
pub struct StageBench {
    /// The stage, or `step` for all but raycasts.
    pub name: &'static str,
    /// All of the work: one thread.
    pub work_ms: f64,
    /// At least so much on two threads.
    pub two_threads_ms: f64,
    /// The longest chain: at least so much on any number of threads.
    pub span_ms: f64,
}

/// Steps that cost most, beside the usual one.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Tail {
    /// Kind of cost: `cpu`, the CPU time of a step here; `work`, the time that its units stand for
    /// ([`dynvox_core::WorkUnits::nominal_ns`]), the same on every machine.
    pub cost: &'static str,
    /// Median, ms.
    pub median_ms: f64,
    /// Percentile 99, ms.
    pub p99_ms: f64,
    /// Percentile 99.9, ms.
    pub p999_ms: f64,
    /// The most expensive step, ms.
    pub worst_ms: f64,
}

/// Costs of a step, by stage.
#[derive(Clone, Debug, Serialize)]
pub struct Bench {
    /// Frames stepped.
    pub frames: usize,
    /// Vector instructions that kernels used.
    pub vectors: &'static str,
    /// Digest of the last frame, 16 hexadecimal digits: the same on every machine.
    pub digest: String,
    /// Each stage that took time, then the step, then a raycast of the map from each frame's pose.
    pub stages: Vec<StageBench>,
    /// Most expensive steps, by CPU time and by counted work.
    pub tails: [Tail; 2],
    /// Time of a unit of work, for the stages that count any; empty with fewer than five frames.
    pub units: Vec<UnitTime>,
}

/// Steps through the frames of a plan, without results of any kind, and takes the costs. The first
/// frame, which has none before it, is left out of the medians where there are more.
///
/// # Errors
/// The plan cannot be run, or a frame cannot be read or mapped.
pub fn bench(plan: &Plan, vectors: Vectors) -> Result<Bench, RunError> {
    let spans = Spans::new(vectors);
    let (mut costs, mut work, mut digest) = (Vec::new(), Vec::new(), 0);
    with_mapper(plan, |mapper| {
        each_frame(plan, |index, frame| {
            let (report, step, mut stages) = spans.measure(|| mapper.step(frame, &spans));
            let report = report.map_err(|error| failed_step(index, error))?;
            let stages_ms = stages.map(|cost| cost.work.as_secs_f64() * 1e3);
            work.push(FrameWork { work: report.work, stages_ms });
            digest = report.digest;
            let pose = report.t_world_camera;
            let (_, _, raycast) = spans.measure(|| mapper.raycast(&pose, &spans).is_ok());
            stages[Stage::Raycast as usize] = raycast[Stage::Raycast as usize];
            costs.push((step, stages));
            Ok(())
        })
    })?;
    let counted = without_first(&costs);
    let of_stage = |stage: Stage| {
        medians(stage.name(), counted.iter().map(|(_, stages)| stages[stage as usize]))
    };
    let [before @ .., raycast] = Stage::ALL;
    let mut stages: Vec<_> =
        before.into_iter().map(of_stage).filter(|stage| stage.work_ms > 0.0).collect();
    stages.push(medians("step", counted.iter().map(|(step, _)| *step)));
    stages.push(of_stage(raycast));
    // The first frame does half of the work that its units would tell.
    let usual = without_first(&work);
    let tails = [
        tail("cpu", counted.iter().map(|(step, _)| step.work.as_secs_f64() * 1e3)),
        tail("work", usual.iter().map(|frame| frame.work.nominal_ns() as f64 / 1e6)),
    ];
    let units = fit(usual, &plan.capacity.work(&plan.config));
    let digest = format!("{digest:016x}");
    Ok(Bench { frames: costs.len(), vectors: vectors.name(), digest, stages, tails, units })
}

/// All frames but the first, where there are more.
fn without_first<T>(frames: &[T]) -> &[T] {
    frames.get(1..).filter(|rest| !rest.is_empty()).unwrap_or(frames)
}

fn tail(cost: &'static str, steps_ms: impl Iterator<Item = f64>) -> Tail {
    let ascending = ascending(steps_ms);
    let at = |share| quantile(&ascending, share).unwrap_or_default();
    let [median_ms, p99_ms, p999_ms, worst_ms] = [0.5, 0.99, 0.999, 1.0].map(at);
    Tail { cost, median_ms, p99_ms, p999_ms, worst_ms }
}

fn medians(name: &'static str, costs: impl Iterator<Item = Cost> + Clone) -> StageBench {
    let of = |part: fn(&Cost) -> Duration| {
        median(costs.clone().map(|cost| part(&cost).as_secs_f64() * 1e3)).unwrap_or_default()
    };
    StageBench {
        name,
        work_ms: of(|cost| cost.work),
        two_threads_ms: of(|cost| cost.two_threads),
        span_ms: of(|cost| cost.span),
    }
}
