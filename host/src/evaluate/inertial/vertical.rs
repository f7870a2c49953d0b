//! Direction that points up: the mean force of the unit with the camera's own acceleration taken
//! out by the images.
//!
//! Over a stretch of frames the mean of what the unit feels, turned into the world by the poses, is
//! gravity and the change of the camera's velocity over that time. The velocities at both ends come
//! from the poses.

use super::FramePose;
use crate::formats::GRAVITY_M_S2;
use crate::input::InertialUnitData;
use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

/// Frames over which the velocity at an end is measured, to both sides together.
const END_FRAMES: usize = 4;
/// Shortest time that says which way is up, s.
const SHORTEST_S: f64 = 1.0;
/// Parts of the time, whose differences tell how sure the mean is.
const PARTS: usize = 4;
/// Bias of an accelerometer's axis that is assumed at least, m/s2.
const BIAS_M_S2: f64 = 0.05;
/// Largest gap between two samples whose forces count, ns.
const LONGEST_GAP_NS: i64 = 120_000_000;

/// Direction that points up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertical {
    /// Unit vector in the world of the poses (x right, y down, z forward of the first camera).
    pub up_world: [f64; 3],
    /// One sigma, degrees.
    pub sigma_deg: f64,
    /// Time it was measured over, s.
    pub seconds: f64,
}

impl Vertical {
    /// Measures over the longest stretch of frames that were found in the images; `None` where it
    /// is too short. `offset_ns` is the time by which the unit's clock is ahead.
    pub fn new(unit: &InertialUnitData, frames: &[FramePose], offset_ns: i64) -> Option<Self> {
        let frames = longest_stretch(frames);
        let (mean, seconds) = up(unit, frames, offset_ns)?;
        if seconds < SHORTEST_S {
            return None;
        }
        let part = frames.len() / PARTS;
        let parts: Vec<Vector3<f64>> = frames
            .chunks(part.max(1))
            .filter_map(|frames| up(unit, frames, offset_ns))
            .map(|(part, _)| part.normalize())
            .collect();
        let up_world = mean.normalize();
        let spread = parts.iter().map(|part| (part - up_world).norm_squared()).sum::<f64>();
        let count = parts.len() as f64;
        let statistic = if count > 1.5 { spread / (count * (count - 1.0)) } else { 1e-4 };
        // A force that is not gravity's by its length has a bias at least so large to the side.
        let bias = (mean.norm() - GRAVITY_M_S2).abs().max(BIAS_M_S2) / GRAVITY_M_S2;
        Some(Self {
            up_world: up_world.into(),
            sigma_deg: (statistic + bias * bias).sqrt().to_degrees(),
            seconds,
        })
    }

    /// Angle between up and the first camera's own, degrees.
    pub fn lean_deg(&self) -> f64 {
        let [_, y, _] = self.up_world;
        libm::acos((-y).clamp(-1.0, 1.0)).to_degrees()
    }

    /// A part of a line.
    pub(super) fn sentence(&self) -> String {
        format!(
            "the first camera leans {:.1} degrees from upright (sigma {:.1})",
            self.lean_deg(),
            self.sigma_deg
        )
    }
}

/// The longest run of frames of one segment that were found in the images.
fn longest_stretch(frames: &[FramePose]) -> &[FramePose] {
    let joined = |a: &FramePose, b: &FramePose| {
        a.is_measured && b.is_measured && a.segment == b.segment && b.time_ns > a.time_ns
    };
    frames.chunk_by(joined).max_by_key(|frames| frames.len()).unwrap_or_default()
}

/// Mean force less the change of velocity, in the world, m/s2, and the time it is of, s.
fn up(
    unit: &InertialUnitData,
    frames: &[FramePose],
    offset_ns: i64,
) -> Option<(Vector3<f64>, f64)> {
    let first = frames.get(..=END_FRAMES)?;
    let last = frames.get(frames.len().checked_sub(END_FRAMES + 1)?..)?;
    let (begin_ns, begin_m_s) = velocity(unit, first)?;
    let (end_ns, end_m_s) = velocity(unit, last)?;
    let seconds = (end_ns - begin_ns) as f64 * 1e-9;
    if seconds <= 0.0 {
        return None;
    }
    let (mut sum, mut weight) = (Vector3::zeros(), 0.0);
    let (mut at, t_camera_unit) = (0, unit.t_camera_unit);
    for pair in unit.readings.windows(2) {
        let [a, b] = [&pair[0], &pair[1]];
        let middle_ns = a.time_ns / 2 + b.time_ns / 2 - offset_ns;
        let apart_ns = b.time_ns - a.time_ns;
        if middle_ns < begin_ns || middle_ns > end_ns || apart_ns > LONGEST_GAP_NS {
            continue;
        }
        while frames.get(at + 1).is_some_and(|frame| frame.time_ns < middle_ns) {
            at += 1;
        }
        let (before, after) = (frames.get(at)?, frames.get(at + 1)?);
        let t_world_unit = between(before, after, middle_ns) * t_camera_unit;
        let force = (Vector3::from(a.force) + Vector3::from(b.force)) * 0.5;
        let seconds = apart_ns as f64 * 1e-9;
        sum += Vector3::from(t_world_unit.rotate(<[f64; 3]>::from(force))) * seconds;
        weight += seconds;
    }
    // Samples of half the time say too little of the rest.
    (weight > 0.5 * seconds).then(|| (sum / weight - (end_m_s - begin_m_s) / seconds, seconds))
}

/// Velocity of the unit in the world in the middle of some frames, m/s.
fn velocity(unit: &InertialUnitData, frames: &[FramePose]) -> Option<(i64, Vector3<f64>)> {
    let (first, last) = (frames.first()?, frames.last()?);
    let seconds = (last.time_ns - first.time_ns) as f64 * 1e-9;
    let at = |frame: &FramePose| {
        Vector3::from((frame.t_world_camera * unit.t_camera_unit).translation_m)
    };
    (seconds > 0.0)
        .then(|| (first.time_ns / 2 + last.time_ns / 2, (at(last) - at(first)) / seconds))
}

/// Orientation between two frames.
fn between(before: &FramePose, after: &FramePose, time_ns: i64) -> Transform {
    let share = (time_ns - before.time_ns) as f64 / (after.time_ns - before.time_ns).max(1) as f64;
    let turn = before.t_world_camera.inverse() * after.t_world_camera;
    let vector = super::turns::rotation_vector(&turn) * share.clamp(0.0, 1.0);
    (before.t_world_camera * Transform::new(vector, [0.0; 3])).normalized()
}
