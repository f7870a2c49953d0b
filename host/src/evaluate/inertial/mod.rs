//! An inertial unit after a run: what the mapper learned of it, how well its turns agree with those
//! of the images, and which fault explains a difference.
//!
//! Bias, clock, vertical and doubt are the mapper's own ([`InertialReport`]). Added here is what
//! only all turns of a run tell: orders and signs of the axes that fit better.

mod doubt;
#[cfg(test)]
mod tests;

pub use doubt::UnitDoubt;

use crate::input::InertialUnitData;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::inertial::{InertialReport, Vertical};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Fewest turns that say something.
const LEAST: usize = 8;
/// Share of turns that count: the others may be wrong in the images.
const COUNTED: f64 = 0.8;
/// Sigma of a clock offset up to which also a small one is told, s.
const KNOWN_SIGMA_S: f64 = 0.025;

/// Pose of a frame with its time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct FramePose {
    /// Time of the frame, ns.
    pub time_ns: i64,
    /// Segment of the map that the pose is in.
    pub segment: MapSegment,
    /// Camera to world.
    pub t_world_camera: Transform,
    /// True if the pose was found in the images.
    pub is_measured: bool,
}

/// Turn of the camera from one frame to the next as rotation vectors in its axes, rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameTurn {
    /// By the images.
    pub measured: [f64; 3],
    /// By the unit, with bias and clock offset taken out.
    pub predicted: [f64; 3],
    /// Turn that the bias taken out would make, in the unit's axes, rad.
    pub bias: [f64; 3],
    /// Time between the frames, s.
    pub span_s: f64,
}

impl FrameTurn {
    /// The turn between two frames, `None` unless both poses were found in the images of one
    /// segment and the unit's samples cover the time between.
    pub fn between(
        before: &FramePose,
        now: &FramePose,
        report: Option<&InertialReport>,
    ) -> Option<Self> {
        let is_measured = before.is_measured && now.is_measured && before.segment == now.segment;
        let span_s = (now.time_ns - before.time_ns) as f64 * 1e-9;
        let report = report.filter(|_| is_measured && span_s > 0.0)?;
        Some(Self {
            measured: rotation_vector(&(before.t_world_camera.inverse() * now.t_world_camera)),
            predicted: report.turn_rad?.map(f64::from),
            bias: report.turn_bias.map(|bias| f64::from(bias) * span_s),
            span_s,
        })
    }
}

/// Agreement of a unit's turns with those of the images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnAgreement {
    /// Turns from frame to frame that were compared.
    pub intervals: usize,
    /// Difference of the turns that count, degrees, root mean square.
    pub difference_deg: f64,
    /// Turn in the images, degrees, root mean square.
    pub turn_deg: f64,
}

/// Findings about a unit.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitFindings {
    /// Samples between the first and the last frame.
    pub samples: usize,
    /// Frames without a sample since the one before.
    pub frames_without: usize,
    /// Longest time between two samples, s.
    pub longest_gap_s: f64,
    /// Turns of the unit against those of the images; `None` where too few could be compared.
    pub agreement: Option<TurnAgreement>,
    /// Report of the last frame: bias and clock.
    pub last: InertialReport,
    /// Direction that points up in the first segment; `None` where it is not known, or the unit is
    /// doubted.
    pub vertical: Option<Vertical>,
    /// Fault of the unit; `None` where it agrees.
    pub doubt: Option<UnitDoubt>,
}

/// Collection of what a run tells of its unit, frame by frame.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct UnitRecord {
    turns: Vec<FrameTurn>,
    frames_without: usize,
    before: Option<FramePose>,
    last: InertialReport,
    vertical: Option<Vertical>,
}

impl UnitRecord {
    /// Adds a frame with the mapper's report of the unit.
    pub fn add(&mut self, now: &FramePose, report: Option<&InertialReport>) {
        if let Some(before) = self.before.replace(*now) {
            self.turns.extend(FrameTurn::between(&before, now, report));
            self.frames_without += usize::from(report.is_none_or(|report| report.samples == 0));
        }
        if let Some(report) = report {
            self.last = *report;
            // The first camera is the world of the first segment only.
            if now.segment == MapSegment::FIRST && report.vertical.is_some() {
                self.vertical = report.vertical;
            }
        }
    }

    /// Direction that points up in the first segment, as the mapper says; `None` of a unit that it
    /// doubts.
    pub fn up_world(&self) -> Option<[f32; 3]> {
        let vertical = self.vertical.filter(|_| self.last.doubt.is_none())?;
        Some(vertical.up_world)
    }

    /// Findings about the unit.
    pub fn findings(&self, unit: &InertialUnitData) -> UnitFindings {
        let t_unit_camera = unit.t_camera_unit.inverse();
        let in_unit = |turn: [f64; 3]| Vector3::from(t_unit_camera.rotate::<[f64; 3]>(turn));
        let pairs: Vec<[Vector3<f64>; 2]> = self
            .turns
            .iter()
            .map(|turn| [in_unit(turn.predicted), in_unit(turn.measured)])
            .collect();
        // A few turns may agree or disagree by chance.
        let is_enough = pairs.len() >= LEAST;
        let agreement = is_enough.then(|| TurnAgreement {
            intervals: pairs.len(),
            difference_deg: trimmed(
                pairs.iter().map(|[unit, camera]| (unit - camera).norm_squared()),
            )
            .sqrt()
            .to_degrees(),
            turn_deg: mean_square(pairs.iter().map(|[_, camera]| *camera)).sqrt().to_degrees(),
        });
        // Of rates as they were read: a bias may have been learned from what is none.
        let raw: Vec<RawTurn> = pairs
            .iter()
            .zip(&self.turns)
            .map(|(&[unit, camera], turn)| RawTurn {
                unit: unit + Vector3::from(turn.bias),
                camera,
                span_s: turn.span_s,
            })
            .collect();
        let doubt = doubt::doubt(self.last.doubt, if is_enough { &raw } else { &[] });
        UnitFindings {
            samples: unit.within_frames,
            frames_without: self.frames_without,
            longest_gap_s: unit.longest_gap_s,
            agreement,
            last: self.last,
            vertical: self.vertical.filter(|_| doubt.is_none()),
            doubt,
        }
    }
}

/// A turn in the unit's axes, the unit's without any correction, rad.
#[derive(Clone, Copy, Debug)]
struct RawTurn {
    unit: Vector3<f64>,
    camera: Vector3<f64>,
    span_s: f64,
}

impl UnitFindings {
    /// Time by which the unit's clock is ahead of the cameras' and its sigma, ms; `None` where
    /// turns are too slow or too steady to tell.
    pub fn clock_ms(&self) -> Option<[f64; 2]> {
        let [offset_s, sigma_s] =
            [self.last.clock_offset_s, self.last.clock_offset_sigma_s].map(f64::from);
        // A large offset is worth telling even where it is known only roughly.
        let is_known = sigma_s < KNOWN_SIGMA_S || offset_s.abs() > 2.0 * sigma_s;
        (is_known && self.doubt.is_none() && self.agreement.is_some())
            .then_some([-offset_s * 1e3, sigma_s * 1e3])
    }

    /// Angle between up and the first camera's own, degrees.
    fn lean_deg(vertical: &Vertical) -> f64 {
        let [_, y, _] = vertical.up_world.map(f64::from);
        libm::acos((-y).clamp(-1.0, 1.0)).to_degrees()
    }

    /// A line about the unit.
    pub fn sentence(&self) -> String {
        let mut parts = vec![format!("{} samples", self.samples)];
        if self.frames_without > 0 {
            let without = self.frames_without;
            let gap_s = self.longest_gap_s;
            parts.push(format!("{without} frames without (longest gap {gap_s:.2} s)"));
        }
        // A doubted unit's bias and clock are of no use to anyone.
        match (&self.doubt, &self.agreement) {
            (Some(doubt), _) => parts.push(doubt.sentence()),
            (None, None) => parts.push("too few turns to compare with the images".to_owned()),
            (None, Some(agreement)) => {
                let TurnAgreement { difference_deg, turn_deg, .. } = agreement;
                let bias = Vector3::from(self.last.turn_bias.map(f64::from)).norm();
                parts.push(format!(
                    "turns agree to {difference_deg:.3} degrees of {turn_deg:.2} a frame"
                ));
                parts.push(format!("bias {bias:.4} rad/s"));
                parts.push(match self.clock_ms() {
                    Some([offset_ms, sigma_ms]) => format!(
                        "its clock is {:.1} ms {} the cameras' (sigma {sigma_ms:.1})",
                        offset_ms.abs(),
                        if offset_ms < 0.0 { "behind" } else { "ahead of" },
                    ),
                    None => "its clock could not be compared with the cameras'".to_owned(),
                });
            }
        }
        parts.extend(self.vertical.as_ref().map(|vertical| {
            format!(
                "the first camera leans {:.1} degrees from upright (sigma {:.1})",
                Self::lean_deg(vertical),
                vertical.sigma_rad.to_degrees()
            )
        }));
        parts.join("; ")
    }

    /// True if the unit is doubted.
    pub fn is_doubted(&self) -> bool {
        self.doubt.is_some()
    }
}

/// Mean of the least squares that count.
fn trimmed(squares: impl Iterator<Item = f64>) -> f64 {
    let mut squares: Vec<f64> = squares.collect();
    squares.sort_by(f64::total_cmp);
    let counted = ((squares.len() as f64 * COUNTED) as usize).max(1);
    squares.iter().take(counted).sum::<f64>() / counted as f64
}

/// Mean square of some vectors.
fn mean_square(vectors: impl ExactSizeIterator<Item = Vector3<f64>>) -> f64 {
    let count = vectors.len().max(1) as f64;
    vectors.map(|vector| vector.norm_squared()).sum::<f64>() / count
}

/// Axis times angle of a rotation, rad.
fn rotation_vector(turn: &Transform) -> [f64; 3] {
    let [x, y, z, w] = turn.rotation;
    let axis = Vector3::new(x, y, z) * if w < 0.0 { -1.0 } else { 1.0 };
    let sine = axis.norm();
    let scale = if sine < 1e-12 { 2.0 } else { 2.0 * libm::atan2(sine, w.abs()) / sine };
    (axis * scale).into()
}
