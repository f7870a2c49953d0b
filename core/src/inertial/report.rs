//! Report of an inertial unit, as plain values.

use super::{InertialDoubt, Vertical};

/// Use of the unit in a frame, and what is known of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct InertialReport {
    /// Samples that came with the frame.
    pub samples: u32,
    /// Samples that were not read: beyond [`super::INERTIAL_SAMPLES_PER_FRAME`], not finite, or
    /// not later than those before.
    pub ignored: u32,
    /// Gaps of 0.05 s to 0.25 s between samples, and at the interval's ends, that were bridged.
    pub bridged: u32,
    /// True if the unit is trusted: its turns agree with those that images show.
    pub trusted: bool,
    /// Reason not to use it; `None` for a trusted unit, and before enough turns were compared.
    pub doubt: Option<InertialDoubt>,
    /// True if a pose that images did not give was turned by it.
    pub turned: bool,
    /// True if a turn that images showed was refused: it contradicts the unit's.
    pub refused: bool,
    /// Predicted turn since the frame before, as a rotation vector in the left camera's axes, rad:
    /// from the current camera's axes to those before. `None` where samples do not cover the time.
    pub turn_rad: Option<[f32; 3]>,
    /// Standard deviation of the predicted turn about one axis, rad.
    pub turn_sigma_rad: f32,
    /// Bias of the turn rates, in the unit's axes, rad/s.
    pub turn_bias: [f32; 3],
    /// Standard deviation of the bias, rad/s.
    pub turn_bias_sigma: f32,
    /// Seconds to add to the samples' times so that they are on the camera's clock, with the
    /// configured ones: below 0 where the camera's stamps are early.
    pub clock_offset_s: f32,
    /// Standard deviation of the offset, s: large until the camera changed its turn.
    pub clock_offset_sigma_s: f32,
    /// Vertical in the map's segment that the camera is in.
    pub vertical: Option<Vertical>,
}
