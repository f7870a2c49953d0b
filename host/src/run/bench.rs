//! What a step costs, stage by stage: work, span, and the bound on two threads, over the frames of
//! a plan.

use super::error::{RunError, failed_step};
use super::frames::{each_frame, with_mapper};
use super::spans::{Cost, Spans};
use crate::evaluate::quantile::median;
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

/// Costs of a step, by stage.
#[derive(Clone, Debug, Serialize)]
pub struct Bench {
    /// Frames stepped.
    pub frames: usize,
    /// Vector instructions that kernels used.
    pub vectors: &'static str,
    /// Each stage that took time, then the step, then a raycast of the map from each frame's pose.
    pub stages: Vec<StageBench>,
}

/// Steps through the frames of a plan, without results of any kind, and takes the costs. The first
/// frame, which has none before it, is left out of the medians where there are more.
///
/// # Errors
/// The plan cannot be run, or a frame cannot be read or mapped.
pub fn bench(plan: &Plan, vectors: Vectors) -> Result<Bench, RunError> {
    let spans = Spans::new(vectors);
    let mut costs = Vec::new();
    with_mapper(plan, |mapper| {
        each_frame(plan, |index, frame| {
            let (report, step, mut stages) = spans.measure(|| mapper.step(frame, &spans));
            let report = report.map_err(|error| failed_step(index, error))?;
            let pose = report.t_world_camera;
            let (_, _, raycast) = spans.measure(|| mapper.raycast(&pose, &spans).is_ok());
            stages[Stage::Raycast as usize] = raycast[Stage::Raycast as usize];
            costs.push((step, stages));
            Ok(())
        })
    })?;
    let counted = costs.get(1..).filter(|rest| !rest.is_empty()).unwrap_or(&costs);
    let of_stage = |stage: Stage| {
        medians(stage.name(), counted.iter().map(|(_, stages)| stages[stage as usize]))
    };
    let [before @ .., raycast] = Stage::ALL;
    let mut stages: Vec<_> =
        before.into_iter().map(of_stage).filter(|stage| stage.work_ms > 0.0).collect();
    stages.push(medians("step", counted.iter().map(|(step, _)| *step)));
    stages.push(of_stage(raycast));
    Ok(Bench { frames: costs.len(), vectors: vectors.name(), stages })
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
