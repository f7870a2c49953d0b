//! The rig's disparity error, found while driving.
//!
//! A calibration that is off by a pixel of disparity makes a map too deep and a trajectory too long
//! by several per cent, and nothing in one pair shows it. Over two pairs it shows: points
//! triangulated with a wrong disparity do not move rigidly. Each frame's matches and the motion
//! egomotion found give normal equations of the reprojection errors by the motion and by the
//! error's parameters; the motion is eliminated, and an information filter adds the frames up.
//!
//! Two filters run over the same matches. One has a constant and weighs the middle of the image; it
//! gives the offset. The other has a constant, a slope and a fourth power over the columns and a
//! square over the rows; it gives what the lenses left at the sides, the top and the bottom. Krešo
//! and Šegvić (*Improving the Egomotion Estimation by Correcting the Calibration Bias*, VISAPP
//! 2015) correct the same error by a field learned beforehand.
//!
//! **What is applied.** What the lenses left once five frames have said something and the offset is
//! known to 0.06 px; the offset while it is above 0.1 px (and until it falls below 0.06 px), or
//! after two frames when it is four sigmas large. Changes are spread over frames, so that surfaces
//! in the map do not jump.
//!
//! **Rows.** Where both cameras see the same in different rows, the right image is moved before it
//! is matched, by a polynomial of second degree over the image.
//!
//! **What it cannot see.** The baseline: a wrong one scales everything. Standing still, turning on
//! the spot and far points say nothing; the filter waits. Cameras that expose at different times
//! look like an offset that grows with the flow.
//!
//! **Memory.** 700 bytes in the mapper, 2 KiB of stack. **Time.** About 0.3 µs a match.

mod config;
mod information;
mod residuals;
mod rows;
#[cfg(test)]
mod tests;

pub use config::{RigConfig, SelfCalibrationMode};

use crate::{
    geometry::{
        DisparityCorrection, PixelCorrection, RowCorrection, RowShift, StereoObservation,
        StereoRig, Transform,
    },
    state::Visitor,
};
use information::{Information, Prior, Sums};
use residuals::Residuals;
use rows::RowCalibration;

/// Frames with information before the correction is applied.
const FRAMES_MIN: u32 = 5;
/// Error of the offset below which it is applied, px.
const SIGMA_MAX_PX: f64 = 0.06;
/// Frames with information before an offset is applied that is obvious.
const OBVIOUS_FRAMES_MIN: u32 = 2;
/// Sigmas from 0 at which an offset is obvious.
const OBVIOUS_SIGMAS: f64 = 4.0;
/// Offset at which it is applied, px: below, the scale's own errors are as large.
const APPLY_ABOVE_PX: f64 = 0.1;
/// Offset below which it is no longer applied, px.
const APPLY_UNTIL_PX: f64 = 0.06;
/// Largest change of the applied correction from frame to frame, px.
const CHANGE_MAX_PX: f64 = 0.12;
/// Information about the offset below which a frame says nothing, 1/px².
const INFORMATION_MIN: f64 = 4.0;
/// Share of the distance to the side at which a match weighs half, for the offset.
const OFFSET_KNEE: f64 = 0.3;
/// Distance from the middle column, as a share, at which the error of the sides weighs as much as a
/// match's noise.
const SIDES_KNEE: f64 = 0.5;
/// Sigmas before the first frame and of what one frame may be off by, px: offset, slope, fourth
/// power, quadratic.
const SIGMA_PX: [f64; 4] = [0.5, 0.5, 2.0, 0.5];
const FRAME_SIGMA_PX: [f64; 4] = [0.1, 0.2, 0.5, 0.1];

/// Calibration error that was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SelfCalibrationReport {
    /// Correction that must be added to disparities in the middle of the image, px; the part
    /// already added included.
    pub offset_px: f64,
    /// Standard deviation of the offset, px.
    pub offset_sigma_px: f64,
    /// Growth towards the right side, px there.
    pub slope_px: f64,
    /// Growth with the fourth power of the distance from the middle, px at the sides.
    pub quartic_px: f64,
    /// Growth with the square of the distance from the middle row, px from there to the first row.
    pub row_quadratic_px: f64,
    /// Correction that must be added to the right image's rows, so that both cameras see a point in
    /// the same row; the part already added included. All 0 while it is not known.
    pub rows: RowCorrection,
    /// Offset added in this frame, px.
    pub applied_offset_px: f64,
    /// Frames that said something about it.
    pub frames: u32,
    /// True if enough is known to act on it.
    pub known: bool,
    /// True if the error is corrected in depth and motion.
    pub corrected: bool,
}

/// Verdict on a [`SelfCalibrationReport`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationState {
    /// Nothing is known yet, or what is known is small.
    #[default]
    Sound,
    /// The offset is above 0.3 px: depth at 20 m is off by 2 per cent and more without correction.
    Inaccurate,
    /// The offset is above 1 px: the cameras should be calibrated anew.
    Recalibrate,
}

impl SelfCalibrationReport {
    /// Returns true if the map suffers from an offset that is known and not corrected.
    pub fn is_uncorrected(&self) -> bool {
        self.state() > CalibrationState::Sound && !self.corrected
    }

    /// Offset that is worth a warning, px.
    pub(crate) const WARNING_PX: f64 = 0.3;
    /// Offset that asks for a new calibration, px.
    pub(crate) const RECALIBRATE_PX: f64 = 1.0;

    /// The correction as it was found; `None` while too little is known.
    pub fn found(&self) -> Option<DisparityCorrection> {
        let applies = self.applied_offset_px != 0.0 || libm::fabs(self.offset_px) > APPLY_ABOVE_PX;
        self.known.then_some(DisparityCorrection {
            offset_px: if applies { self.offset_px } else { 0.0 },
            slope_px: self.slope_px,
            quartic_px: self.quartic_px,
            row_quadratic_px: self.row_quadratic_px,
        })
    }

    /// Returns the verdict.
    pub fn state(&self) -> CalibrationState {
        let offset = libm::fabs(self.offset_px);
        if !self.known || offset <= Self::WARNING_PX {
            CalibrationState::Sound
        } else if offset <= Self::RECALIBRATE_PX {
            CalibrationState::Inaccurate
        } else {
            CalibrationState::Recalibrate
        }
    }
}

/// Finds the rig's disparity error.
#[derive(Clone, Debug)]
pub(crate) struct SelfCalibration {
    mode: SelfCalibrationMode,
    /// Correction at which the search began.
    start: DisparityCorrection,
    offset: Information<1>,
    sides: Information<4>,
    applied: DisparityCorrection,
    /// True if the offset is large enough to be applied.
    offset_applies: bool,
    frames: u32,
    rows: RowCalibration,
}

impl SelfCalibration {
    /// Before the first frame.
    pub(crate) fn new(config: &RigConfig) -> Self {
        let start = config.disparity_correction;
        Self {
            mode: config.self_calibration,
            start,
            offset: Information::NONE,
            sides: Information::NONE,
            applied: start,
            offset_applies: libm::fabs(start.offset_px) > APPLY_UNTIL_PX,
            frames: 0,
            rows: RowCalibration::new(config.row_correction),
        }
    }

    /// Returns the shift of the right image's rows that makes rows agree; `None` if they do.
    pub(crate) fn row_shift(&self, rig: &StereoRig) -> Option<RowShift> {
        let error = self.rows.applied();
        (error.largest_px() > 0.0).then(|| error.for_rig(rig))
    }

    /// Learns from a frame's matches: where the right camera sees each, and how far below that the
    /// left one does, px, with images moved as
    /// [`SelfCalibration::row_shift`] says. The camera need not move.
    pub(crate) fn update_rows(
        &mut self,
        rig: &StereoRig,
        matches: impl Iterator<Item = ([f64; 2], f64)> + Clone,
    ) {
        if self.mode == SelfCalibrationMode::Off {
            return;
        }
        self.rows.update(rig, matches);
        if self.mode == SelfCalibrationMode::Apply {
            self.rows.apply();
        }
    }

    /// Returns the correction by pixel for images moved as [`SelfCalibration::row_shift`] says;
    /// `None` if it is zero.
    pub(crate) fn pixel_correction(&self, rig: &StereoRig) -> Option<PixelCorrection> {
        let roll_rad = self.rows.applied().roll_rad(rig);
        let changes = !self.applied.is_zero() || roll_rad != 0.0;
        changes.then(|| self.applied.for_rig(rig).rolled(roll_rad))
    }

    /// Learns from a frame: what both cameras saw before and see now, corrected as
    /// [`SelfCalibration::pixel_correction`] says, in a stated order, and the motion in between as found
    /// from them. Observations no motion explains may be among them.
    pub(crate) fn update<O>(
        &mut self,
        rig: &StereoRig,
        observations: O,
        t_current_previous: &Transform,
    ) where
        O: IntoIterator<Item = [StereoObservation; 2]>,
    {
        if self.mode == SelfCalibrationMode::Off {
            return;
        }
        // Errors are linearised where the correction is going, not where it is: far from there they
        // are curved.
        let report = self.report();
        let at = if report.known {
            DisparityCorrection {
                offset_px: report.offset_px,
                slope_px: report.slope_px,
                quartic_px: report.quartic_px,
                row_quadratic_px: report.row_quadratic_px,
            }
        } else {
            self.applied
        };
        let residuals = Residuals::new(rig, t_current_previous, &self.applied, &at);
        // The middle of the image determines the offset, its sides the lenses' terms.
        let (mut offset, mut sides) = (Sums::<8>::ZERO, Sums::<11>::ZERO);
        for [previous, current] in observations {
            let Some(match_rows) = residuals.match_rows(&previous, &current) else { continue };
            let [middle, wide] = [OFFSET_KNEE, SIDES_KNEE].map(|knee| match_rows.weight(knee));
            for row in &match_rows.rows {
                let [a, b, c, d, e, f, constant, slope, quartic, quadratic, error] = *row;
                offset.add(&[a, b, c, d, e, f, constant, error], middle);
                sides.add(&[a, b, c, d, e, f, constant, slope, quartic, quadratic, error], wide);
            }
        }
        let (Some(offset), Some(sides)) =
            (offset.without_motion::<1>(), sides.without_motion::<4>())
        else {
            return;
        };
        // A frame that hardly constrains the offset is left out.
        let [[information]] = offset.matrix;
        if information < INFORMATION_MIN {
            return;
        }
        let at = [at.offset_px, at.slope_px, at.quartic_px, at.row_quadratic_px];
        let taken = self.offset.take(&self.offset_prior(), &offset, [at[0]]);
        let taken = taken.and_then(|()| self.sides.take(&self.sides_prior(), &sides, at));
        if taken.is_some() {
            self.frames = self.frames.saturating_add(1);
        }
        self.apply();
    }

    /// Moves the applied correction towards what is known.
    fn apply(&mut self) {
        let report = self.report();
        if self.mode != SelfCalibrationMode::Apply || !report.known {
            return;
        }
        let offset = libm::fabs(report.offset_px);
        // Two thresholds: an offset near one of them does not switch the correction on and off.
        self.offset_applies =
            offset > if self.offset_applies { APPLY_UNTIL_PX } else { APPLY_ABOVE_PX };
        let offset_px = if self.offset_applies { report.offset_px } else { 0.0 };
        // Limited steps, so that depths do not jump between frames.
        let toward = |now: f64, target: f64| {
            let change = target - now;
            if libm::fabs(change) <= CHANGE_MAX_PX {
                target
            } else {
                now + libm::copysign(CHANGE_MAX_PX, change)
            }
        };
        self.applied = DisparityCorrection {
            offset_px: toward(self.applied.offset_px, offset_px),
            slope_px: toward(self.applied.slope_px, report.slope_px),
            quartic_px: toward(self.applied.quartic_px, report.quartic_px),
            row_quadratic_px: toward(self.applied.row_quadratic_px, report.row_quadratic_px),
        };
    }

    /// Returns the report.
    pub(crate) fn report(&self) -> SelfCalibrationReport {
        if self.mode == SelfCalibrationMode::Off {
            return SelfCalibrationReport {
                applied_offset_px: self.applied.offset_px,
                ..SelfCalibrationReport::default()
            };
        }
        let ([offset_px], offset_sigma_px) =
            self.offset.estimate(&self.offset_prior()).unwrap_or_default();
        let ([_, slope_px, quartic_px, row_quadratic_px], _) =
            self.sides.estimate(&self.sides_prior()).unwrap_or_default();
        // Known after many frames with a small deviation, or after fewer if the offset is many
        // deviations away from zero.
        let is_certain = self.frames >= FRAMES_MIN && offset_sigma_px < SIGMA_MAX_PX;
        let obvious = self.frames >= OBVIOUS_FRAMES_MIN
            && libm::fabs(offset_px) > OBVIOUS_SIGMAS * offset_sigma_px;
        SelfCalibrationReport {
            offset_px,
            offset_sigma_px,
            slope_px,
            quartic_px,
            row_quadratic_px,
            rows: self.rows.known().unwrap_or_default(),
            applied_offset_px: self.applied.offset_px,
            frames: self.frames,
            known: is_certain || obvious,
            corrected: self.mode == SelfCalibrationMode::Apply,
        }
    }

    fn offset_prior(&self) -> Prior<1> {
        let ([sigma, ..], [frame_sigma, ..]) = (SIGMA_PX, FRAME_SIGMA_PX);
        Prior { mean: [self.start.offset_px], sigma: [sigma], frame_sigma: [frame_sigma] }
    }

    fn sides_prior(&self) -> Prior<4> {
        let DisparityCorrection { offset_px, slope_px, quartic_px, row_quadratic_px } = self.start;
        Prior {
            mean: [offset_px, slope_px, quartic_px, row_quadratic_px],
            sigma: SIGMA_PX,
            frame_sigma: FRAME_SIGMA_PX,
        }
    }

    /// Visits every field but those the configuration gives.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { mode: _, start: _, offset, sides, applied, offset_applies, frames, rows } = self;
        let DisparityCorrection { offset_px, slope_px, quartic_px, row_quadratic_px } = applied;
        offset.visit(visitor);
        sides.visit(visitor);
        visitor.f64s([offset_px, slope_px, quartic_px, row_quadratic_px]);
        visitor.code(offset_applies, u32::from, |code| code == 1);
        visitor.u32(frames);
        rows.visit(visitor);
    }
}
