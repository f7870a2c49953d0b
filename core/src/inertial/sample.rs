//! One sample of an inertial unit.

use crate::digest::Digest;

/// Samples of one frame that are read; those after them are counted and ignored.
pub const INERTIAL_SAMPLES_PER_FRAME: usize = 1024;

/// Turn rate and specific force at one time, in the unit's own axes.
///
/// ```
/// use dynvox_core::inertial::InertialSample;
///
/// // A unit at rest whose third axis points up: it feels what holds it against gravity.
/// let sample = InertialSample { time_ns: 0, turn_rate: [0.0; 3], force: [0.0, 0.0, 9.81] };
/// assert!(sample.is_finite());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// Callers in C have an array of the same layout, which is read where it lies.
#[repr(C)]
pub struct InertialSample {
    /// Time, ns, on the clock of the frames' times.
    pub time_ns: u64,
    /// Turn rates about the unit's axes, rad/s.
    pub turn_rate: [f64; 3],
    /// Specific force along the unit's axes, m/s2: gravity included, so that a unit at rest shows
    /// 9.8 along the axis that points up.
    pub force: [f64; 3],
}

impl InertialSample {
    /// Returns true if all six numbers are finite; other samples are counted and ignored.
    pub fn is_finite(&self) -> bool {
        self.turn_rate.iter().chain(&self.force).all(|value| value.is_finite())
    }

    /// Adds the sample to a digest.
    pub(crate) fn hash_into(&self, digest: &mut Digest) {
        digest.u64(self.time_ns);
        self.turn_rate.iter().chain(&self.force).for_each(|&value| digest.f64(value));
    }
}
