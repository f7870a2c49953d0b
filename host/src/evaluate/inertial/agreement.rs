//! Turns of the unit against those of the camera: clock offset, bias, and whether they agree.

use super::FramePose;
use super::doubt::{UnitDoubt, doubt};
use super::fit::{Interval, fit, mean_square};
use super::turns::{TurnIntegral, rotation_vector};
use crate::input::InertialUnitData;
use nalgebra::Vector3;

/// Offsets of the clocks that are tried, ns: from minus to plus this, in steps.
const WIDEST_NS: i64 = 150_000_000;
const STEP_NS: i64 = 2_000_000;
/// Intervals compared at most, spread over the run.
const MOST: usize = 1_500;
/// Longest interval between two frames, ns.
const LONGEST_NS: i64 = 1_000_000_000;
/// Largest sigma of an offset that is told, s.
const KNOWN_SIGMA_S: f64 = 0.01;
/// Turn of the images from frame to frame below which agreement says nothing, rad, as root mean
/// square.
const LEAST_TURN_RAD: f64 = 1e-3;

/// Comparison of a unit's turns with those of the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitAgreement {
    /// Intervals between frames that were compared.
    pub intervals: usize,
    /// Time by which the unit's clock is ahead of the cameras', ms; `None` where turns are too slow
    /// or too steady to tell.
    pub clock_offset_ms: Option<f64>,
    /// One sigma of the offset, ms.
    pub clock_offset_sigma_ms: f64,
    /// Bias of the turn rates, rad/s.
    pub turn_bias_rad_s: [f64; 3],
    /// Difference of turns from frame to frame with both taken out, degrees, root mean square.
    pub difference_deg: f64,
    /// Turn from frame to frame in the images, degrees, root mean square.
    pub turn_deg: f64,
    /// Fault of the unit that explains a difference; `None` where both agree.
    pub doubt: Option<UnitDoubt>,
}

impl UnitAgreement {
    /// Compares a unit with the poses of its camera; `None` of too few.
    pub fn new(unit: &InertialUnitData, frames: &[FramePose]) -> Option<Self> {
        let intervals = intervals(unit, frames);
        let integral = TurnIntegral::new(&unit.readings);
        let tried = -WIDEST_NS / STEP_NS..=WIDEST_NS / STEP_NS;
        let costs: Vec<(i64, f64)> = tried
            .filter_map(|step| Some((step, fit(&integral, &intervals, step * STEP_NS)?.cost)))
            .collect();
        let (best, least) = costs.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let cost = |step| costs.iter().find(|(at, _)| *at == step).map(|(_, cost)| *cost);
        // The minimum of a parabola through the three costs around the least.
        let around = cost(best - 1).zip(cost(best + 1));
        let part = around.map_or(0.0, |(before, after)| {
            let bend = before - 2.0 * least + after;
            if bend > 0.0 { 0.5 * (before - after) / bend } else { 0.0 }
        });
        let offset_ns = ((best as f64 + part) * STEP_NS as f64) as i64;
        let sigma_s = sigma_s(&integral, &intervals, offset_ns, least);
        let known = around.is_some() && sigma_s < KNOWN_SIGMA_S;
        let fit = fit(&integral, &intervals, if known { offset_ns } else { 0 })?;
        let turn = mean_square(fit.pairs.iter().map(|[_, camera]| *camera)).sqrt();
        let is_telling = turn > LEAST_TURN_RAD;
        let doubt = is_telling.then(|| doubt(&unit.readings, &fit)).flatten();
        Some(Self {
            intervals: fit.pairs.len(),
            clock_offset_ms: (known && doubt.is_none()).then_some(offset_ns as f64 * 1e-6),
            clock_offset_sigma_ms: sigma_s * 1e3,
            turn_bias_rad_s: fit.bias.into(),
            difference_deg: fit.cost.sqrt().to_degrees(),
            turn_deg: turn.to_degrees(),
            doubt,
        })
    }

    /// A part of a line.
    pub(super) fn sentence(&self) -> String {
        if let Some(doubt) = &self.doubt {
            return doubt.sentence();
        }
        let bias = Vector3::from(self.turn_bias_rad_s).norm();
        let offset = match self.clock_offset_ms {
            Some(offset_ms) => format!(
                "its clock is {:.1} ms {} the cameras' (sigma {:.1})",
                offset_ms.abs(),
                if offset_ms < 0.0 { "behind" } else { "ahead of" },
                self.clock_offset_sigma_ms
            ),
            None => "its clock could not be compared with the cameras'".to_owned(),
        };
        format!(
            "turns agree to {:.3} degrees of {:.2} a frame; bias {bias:.4} rad/s; {offset}",
            self.difference_deg, self.turn_deg
        )
    }
}

/// Turns of the camera between neighbours that were both found in the images.
fn intervals(unit: &InertialUnitData, frames: &[FramePose]) -> Vec<Interval> {
    let t_unit_camera = unit.t_camera_unit.inverse();
    let interval = |pair: &[FramePose]| {
        let [before, now] = [pair[0], pair[1]];
        let apart_ns = now.time_ns - before.time_ns;
        let usable = now.is_measured
            && before.is_measured
            && now.segment == before.segment
            && (1..=LONGEST_NS).contains(&apart_ns);
        usable.then(|| {
            let turn = rotation_vector(&(before.t_world_camera.inverse() * now.t_world_camera));
            let turn = Vector3::from(t_unit_camera.rotate(<[f64; 3]>::from(turn)));
            Interval { from_ns: before.time_ns, to_ns: now.time_ns, turn }
        })
    };
    let all: Vec<Interval> = frames.windows(2).filter_map(interval).collect();
    let step = all.len().div_ceil(MOST).max(1);
    all.into_iter().step_by(step).collect()
}

/// One sigma of the offset, s: the difference that is left over the rate at which turns change.
fn sigma_s(integral: &TurnIntegral<'_>, intervals: &[Interval], offset_ns: i64, cost: f64) -> f64 {
    let change = |interval: &Interval| {
        let at = |by_ns: i64| {
            let by_ns = offset_ns + by_ns;
            integral.between(interval.from_ns + by_ns, interval.to_ns + by_ns)
        };
        let (before, after) = (at(-STEP_NS)?, at(STEP_NS)?);
        Some((after - before) / (2.0 * STEP_NS as f64 * 1e-9))
    };
    let energy: f64 = intervals.iter().filter_map(change).map(|change| change.norm_squared()).sum();
    // Three components share the cost. Turns of neighbours share a pose: twice the variance.
    if energy > 0.0 { (2.0 * cost / 3.0 / energy).sqrt() } else { f64::INFINITY }
}
