//! Inertial unit: where it is mounted, its samples, and what a step says of it.

use crate::{
    DynvoxConfig, DynvoxPose, DynvoxStatus,
    given::{Owned, items, output, read},
};
use core::{mem::offset_of, slice};
use dynvox_core::{
    Problems, Report,
    inertial::{InertialDoubt, InertialSample, InertialUnit},
};

/// Inertial unit that is fixed to the left camera. In a zeroed struct `t_camera_unit` must be set;
/// 0 of any other number takes its default.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxInertialUnit {
    /// Unit's axes to those of the rectified left camera.
    pub t_camera_unit: DynvoxPose,
    /// Seconds to add to the samples' times so that they are on the camera's clock, -1 to 1; what
    /// remains is found from the turns.
    pub clock_offset_s: f64,
    /// Noise density of turn rates, rad/s/sqrt(Hz); 0.001 by default.
    pub turn_density: f64,
    /// Bias of turn rates that the unit may begin with, one sigma, rad/s; 0.1 by default.
    pub turn_bias_sigma: f64,
    /// Random walk of that bias, rad/s2/sqrt(Hz); 0.0001 by default.
    pub turn_walk: f64,
    /// Constant error of the specific force, one sigma, m/s2; 0.03 by default.
    pub force_bias_sigma: f64,
    /// Largest turn rate that an axis can show, rad/s; 34 by default.
    pub turn_range: f64,
    /// Largest specific force that an axis can show, m/s2; 150 by default.
    pub force_range: f64,
}

impl DynvoxInertialUnit {
    /// A rotation of length 0 is no unit.
    pub(crate) const NONE: Self = Self {
        t_camera_unit: DynvoxPose { rotation: [0.0; 4], translation_m: [0.0; 3] },
        clock_offset_s: 0.0,
        turn_density: 0.0,
        turn_bias_sigma: 0.0,
        turn_walk: 0.0,
        force_bias_sigma: 0.0,
        turn_range: 0.0,
        force_range: 0.0,
    };

    /// The unit as the core takes it, if one was named.
    pub(crate) fn unit(&self) -> Result<Option<InertialUnit>, DynvoxStatus> {
        if self.t_camera_unit.rotation == [0.0; 4] {
            return Ok(None);
        }
        // A caller who knows only where the unit sits gets a unit of the common kind.
        let known = InertialUnit::new(self.t_camera_unit.transform()?);
        let or = |given: f64, default: f64| if given == 0.0 { default } else { given };
        let unit = InertialUnit {
            clock_offset_s: self.clock_offset_s,
            turn_density: or(self.turn_density, known.turn_density),
            turn_bias_sigma: or(self.turn_bias_sigma, known.turn_bias_sigma),
            turn_walk: or(self.turn_walk, known.turn_walk),
            force_bias_sigma: or(self.force_bias_sigma, known.force_bias_sigma),
            turn_range: or(self.turn_range, known.turn_range),
            force_range: or(self.force_range, known.force_range),
            ..known
        };
        // Checked now, because a mapper that is made later cannot say which number was wrong.
        let mut problems = Problems::new();
        unit.validate(&mut problems);
        if problems.is_empty() { Ok(Some(unit)) } else { Err(DynvoxStatus::Config) }
    }
}

/// Adds an inertial unit to a configuration, whose frames then bring its samples. A unit that
/// cannot be used is DYNVOX_STATUS_POSE or DYNVOX_STATUS_CONFIG.
///
/// # Safety
/// `unit` is null or points to a unit, `config` is null or points to a configuration from
/// dynvox_config_default or dynvox_config_raw.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_config_inertial(
    unit: *const DynvoxInertialUnit,
    config: *mut DynvoxConfig,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let (unit, config) = match unsafe { (read(unit), output(config)) } {
        (Ok(unit), Ok(config)) => (unit, config),
        (Err(status), _) | (_, Err(status)) => return status,
    };
    match unit.unit() {
        Ok(Some(_)) => {
            // SAFETY: not null and aligned, as checked; of the right type, as promised.
            unsafe { (*config).inertial = unit };
            DynvoxStatus::Ok
        }
        // A rotation was forgotten.
        Ok(None) => DynvoxStatus::Pose,
        Err(status) => status,
    }
}

/// Turn rate and specific force at one time, in the unit's own axes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxInertialSample {
    /// Time, ns, on the clock of the frames' times.
    pub time_ns: u64,
    /// Turn rates about the unit's axes, rad/s.
    pub turn_rate: [f64; 3],
    /// Specific force along the unit's axes, m/s2, gravity included: a unit at rest shows 9.8 along
    /// the axis that points up.
    pub force: [f64; 3],
}

/// A frame's samples are read where they lie: copies of a thousand would not fit on the stack.
const _: () = {
    assert!(size_of::<DynvoxInertialSample>() == size_of::<InertialSample>());
    assert!(align_of::<DynvoxInertialSample>() == align_of::<InertialSample>());
    assert!(
        offset_of!(DynvoxInertialSample, turn_rate) == offset_of!(InertialSample, turn_rate)
            && offset_of!(DynvoxInertialSample, force) == offset_of!(InertialSample, force)
    );
};

/// The frame's samples.
///
/// # Safety
/// There are as many as `count` says.
pub(crate) unsafe fn samples<'a>(
    samples: *const DynvoxInertialSample,
    count: usize,
    buffer: &Owned,
) -> Result<&'a [InertialSample], DynvoxStatus> {
    // SAFETY: the caller's promise.
    let given: &[DynvoxInertialSample] = unsafe { items(samples, count, buffer)? };
    // SAFETY: both types have the same fields in the same places, as asserted.
    Ok(unsafe { slice::from_raw_parts(given.as_ptr().cast(), given.len()) })
}

/// Reason why the inertial unit is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum DynvoxInertialDoubt {
    /// No reason is known.
    None = 0,
    /// Turns contradict those of the images, for no reason that was found.
    Contradicts,
    /// Turns are as large as those of the images, about other axes.
    WrongAxes,
    /// Turn rates seem to be in degrees per second.
    Degrees,
    /// Samples repeat.
    Stuck,
    /// Samples lie at the end of the sensor's range.
    Saturated,
    /// Samples lie more than a second from the frames, or the clocks differ by more than can be
    /// corrected.
    ClocksApart,
}

/// Use of the inertial unit in a step, and what is known of it. All 0 without a unit.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxInertialReport {
    /// Samples that came with the frame.
    pub samples: u32,
    /// Samples that were not read: beyond 1,024, not finite, or not later than those before.
    pub ignored: u32,
    /// Gaps between samples that were bridged.
    pub bridged: u32,
    /// True if the unit is trusted: its turns agree with those that images show.
    pub trusted: bool,
    /// Reason not to use it.
    pub doubt: DynvoxInertialDoubt,
    /// True if a pose that images did not give was turned by it.
    pub turned: bool,
    /// True if a turn that images showed was refused: it contradicts the unit's.
    pub refused: bool,
    /// Bias of the turn rates, rad/s.
    pub turn_bias: [f32; 3],
    /// Standard deviation of the least known bias, rad/s.
    pub turn_bias_sigma: f32,
    /// Seconds to add to the samples' times.
    pub clock_offset_s: f32,
    /// Standard deviation of the offset, s: large until the camera changed its turn.
    pub clock_offset_sigma_s: f32,
    /// Unit vector that points up, in the world of `t_world_camera`; zeros while it is unknown.
    pub up_world: [f32; 3],
    /// Standard deviation of its angle, rad.
    pub up_sigma_rad: f32,
}

impl From<&Report> for DynvoxInertialReport {
    fn from(report: &Report) -> Self {
        use DynvoxInertialDoubt as Doubt;
        // Zeros tell the same as no unit: C has no options.
        let inertial = report.inertial.unwrap_or_default();
        let vertical = inertial.vertical.unwrap_or_default();
        Self {
            samples: inertial.samples,
            ignored: inertial.ignored,
            bridged: inertial.bridged,
            trusted: inertial.trusted,
            doubt: match inertial.doubt {
                None => Doubt::None,
                Some(InertialDoubt::WrongAxes) => Doubt::WrongAxes,
                Some(InertialDoubt::Degrees) => Doubt::Degrees,
                Some(InertialDoubt::Stuck) => Doubt::Stuck,
                Some(InertialDoubt::Saturated) => Doubt::Saturated,
                Some(InertialDoubt::ClocksApart) => Doubt::ClocksApart,
                // A doubt that a later core adds is a contradiction to older callers.
                Some(_) => Doubt::Contradicts,
            },
            turned: inertial.turned,
            refused: inertial.refused,
            turn_bias: inertial.turn_bias,
            turn_bias_sigma: inertial.turn_bias_sigma,
            clock_offset_s: inertial.clock_offset_s,
            clock_offset_sigma_s: inertial.clock_offset_sigma_s,
            up_world: vertical.up_world,
            up_sigma_rad: vertical.sigma_rad,
        }
    }
}
