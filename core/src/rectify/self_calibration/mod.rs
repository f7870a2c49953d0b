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
//! **What is applied.** What the lenses left once five independent frames have said something and
//! the offset is known to 0.06 px; the offset while it is above 0.1 px (and until it falls below
//! 0.06 px), or after two frames when it is four sigmas large. Changes are spread over frames, so
//! that surfaces in the map do not jump. `evidence` says what a frame is worth, which frames are
//! left out, and when a correction is taken back.
//!
//! **Rows.** Where both cameras see the same in different rows, the right image is moved before it
//! is matched, by a polynomial of second degree over the image.
//!
//! **What it cannot see.** The baseline: a wrong one scales everything. Standing still, turning on
//! the spot and far points say nothing; the filter waits. Cameras that expose at different times
//! look like an offset that grows with the flow.
//!
//! **Memory.** 1 KiB in the mapper, 3 KiB of stack. **Time.** About 0.4 µs a match.

mod config;
mod information;
mod offset_evidence;
mod report;
mod residuals;
mod rows;
#[cfg(test)]
mod tests;

pub use config::{CorrectionEvidence, RigConfig, SelfCalibrationMode};
pub use report::{CalibrationState, SelfCalibrationReport};

use crate::{
    geometry::{
        DisparityCorrection, PixelCorrection, RowShift, StereoObservation, StereoRig, Transform,
    },
    state::{Hasher, Visitor},
};
use information::{FrameInformation, Information, Prior, Sums};
use offset_evidence::{FrameEvidence, OffsetEvidence};
use residuals::Residuals;
use rows::RowCalibration;

/// Independent frames before the correction is applied.
const FRAMES_MIN: f64 = 5.0;
/// Error of the offset below which it is applied, px.
const SIGMA_MAX_PX: f64 = 0.06;
/// Independent frames before an offset is applied that is obvious.
const OBVIOUS_FRAMES_MIN: f64 = 2.0;
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

/// Finds the rig's disparity error.
#[derive(Clone, Debug)]
pub(crate) struct SelfCalibration {
    mode: SelfCalibrationMode,
    /// Correction at which the search began.
    start: DisparityCorrection,
    start_evidence: CorrectionEvidence,
    offset: Information<1>,
    sides: Information<4>,
    /// Terms of the sides from matches that one motion explains.
    sides_witness: Information<4>,
    applied: DisparityCorrection,
    /// True if the offset is large enough to be applied.
    offset_applies: bool,
    frames: u32,
    offset_evidence: OffsetEvidence,
    /// True if frames contradicted the correction at which the search began: it began anew from
    /// none.
    start_refuted: bool,
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
            sides_witness: Information::NONE,
            applied: start,
            offset_applies: libm::fabs(start.offset_px) > APPLY_UNTIL_PX,
            frames: 0,
            offset_evidence: OffsetEvidence::NONE,
            start_refuted: false,
            start_evidence: config.correction_evidence,
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
    // Never inlined: the sums of a frame take stack that a look at the map needs.
    #[inline(never)]
    pub(crate) fn update<O>(
        &mut self,
        rig: &StereoRig,
        observations: O,
        t_current_previous: &Transform,
    ) where
        O: IntoIterator<Item = [StereoObservation; 2]>,
    {
        // Errors are linearised where the correction is going, not where it is: far from there they
        // are curved.
        let report = self.findings();
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
        let (mut witness, mut sides_witness) = (Sums::<8>::ZERO, Sums::<11>::ZERO);
        for [previous, current] in observations {
            let Some(match_rows) = residuals.match_rows(&previous, &current) else { continue };
            let [middle, wide] = [OFFSET_KNEE, SIDES_KNEE].map(|knee| match_rows.weight(knee));
            let [strict, strict_wide] =
                [OFFSET_KNEE, SIDES_KNEE].map(|knee| match_rows.strict_weight(knee));
            for row in &match_rows.rows {
                let [a, b, c, d, e, f, constant, _, _, _, error] = *row;
                let middle_row = [a, b, c, d, e, f, constant, error];
                offset.add(&middle_row, middle);
                witness.add(&middle_row, strict);
                sides.add(row, wide);
                sides_witness.add(row, strict_wide);
            }
        }
        let (Some(filter), Some(witness), Some(sides), Some(sides_witness)) = (
            offset.without_motion::<1>(),
            witness.without_motion::<1>(),
            sides.without_motion::<4>(),
            sides_witness.without_motion::<4>(),
        ) else {
            return;
        };
        // A frame that hardly constrains the offset is left out.
        let [[information]] = filter.matrix;
        if information < INFORMATION_MIN {
            return;
        }
        let [way_m, share] = FrameEvidence::worth(rig, t_current_previous);
        let frame = FrameEvidence { filter, witness, at_px: at.offset_px, share, way_m };
        let at = [at.offset_px, at.slope_px, at.quartic_px, at.row_quadratic_px];
        self.take(&frame, [&sides, &sides_witness], at);
        self.apply();
    }

    /// Takes a frame in, unless it is disturbed; forgets all where frames speak against what is
    /// applied.
    fn take(&mut self, frame: &FrameEvidence, sides: [&FrameInformation<4>; 2], at: [f64; 4]) {
        if frame.is_disturbed() {
            self.offset_evidence.frames_disturbed =
                self.offset_evidence.frames_disturbed.saturating_add(1);
            return;
        }
        let prior = self.offset_prior();
        if !self.offset_evidence.take(&prior, frame, self.applied.offset_px) {
            (self.offset, self.sides) = (Information::NONE, Information::NONE);
            self.sides_witness = Information::NONE;
            (self.offset_evidence, self.frames, self.start_refuted) =
                (OffsetEvidence::NONE, 0, true);
            return;
        }
        let taken = self.offset.take(&prior, &frame.filter, [frame.at_px], frame.share);
        let sides_prior = self.sides_prior();
        let [sides, witness] = sides;
        let taken = taken.and_then(|()| self.sides.take(&sides_prior, sides, at, frame.share));
        let taken =
            taken.and_then(|()| self.sides_witness.take(&sides_prior, witness, at, frame.share));
        if taken.is_some() {
            self.frames = self.frames.saturating_add(1);
        }
    }

    /// Moves the applied correction towards what is known.
    fn apply(&mut self) {
        let report = self.findings();
        if self.mode != SelfCalibrationMode::Apply || !(report.known || self.start_refuted) {
            return;
        }
        // What was taken back goes the way it came, until something else is known.
        let report = if report.known { report } else { SelfCalibrationReport::default() };
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

    /// Returns the report. Where the error is not to be looked for, only an offset that affects the
    /// map is in it.
    pub(crate) fn report(&self) -> SelfCalibrationReport {
        let findings = self.findings();
        let left_px = libm::fabs(findings.offset_px - self.applied.offset_px);
        let affects = findings.known && left_px > SelfCalibrationReport::WARNING_PX;
        if self.mode == SelfCalibrationMode::Off && !affects {
            return SelfCalibrationReport {
                applied_offset_px: self.applied.offset_px,
                ..SelfCalibrationReport::default()
            };
        }
        findings
    }

    /// All that was found.
    fn findings(&self) -> SelfCalibrationReport {
        let prior = self.offset_prior();
        let ([offset_px], noise_px) = self.offset.estimate(&prior).unwrap_or_default();
        let offset_sigma_px = self.offset_evidence.sigma_px(&prior, offset_px, noise_px);
        let [_, slope_px, quartic_px, row_quadratic_px] =
            offset_evidence::supported(&self.sides_prior(), [&self.sides, &self.sides_witness]);
        // Known after many frames with a small deviation, or after fewer if the offset is many
        // deviations away from zero. Frames of an earlier run count.
        let CorrectionEvidence { frames: earlier, .. } = self.start_evidence();
        let independent = self.offset_evidence.frames_independent + f64::from(earlier);
        let is_certain = independent >= FRAMES_MIN && offset_sigma_px < SIGMA_MAX_PX;
        let obvious = independent >= OBVIOUS_FRAMES_MIN
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
            frames_disturbed: self.offset_evidence.frames_disturbed,
            frames_independent: self.offset_evidence.frames_independent,
            way_m: self.offset_evidence.way_m,
            start_refuted: self.start_refuted,
            known: is_certain || obvious,
            corrected: self.mode == SelfCalibrationMode::Apply,
        }
    }

    /// Correction at which the search began, and what it rests on; none where it was refuted.
    fn start(&self) -> DisparityCorrection {
        if self.start_refuted { DisparityCorrection::default() } else { self.start }
    }

    fn start_evidence(&self) -> CorrectionEvidence {
        if self.start_refuted { CorrectionEvidence::default() } else { self.start_evidence }
    }

    fn offset_prior(&self) -> Prior<1> {
        let Prior { mean: [mean, ..], sigma: [sigma, ..], frame_sigma: [frame_sigma, ..] } =
            self.sides_prior();
        Prior { mean: [mean], sigma: [sigma], frame_sigma: [frame_sigma] }
    }

    fn sides_prior(&self) -> Prior<4> {
        let DisparityCorrection { offset_px, slope_px, quartic_px, row_quadratic_px } =
            self.start();
        // What is known of the offset from an earlier run, the other terms are known by as well.
        let [offset_sigma_px, ..] = SIGMA_PX;
        let narrower = self.start_evidence().sigma_px / offset_sigma_px;
        Prior {
            mean: [offset_px, slope_px, quartic_px, row_quadratic_px],
            sigma: SIGMA_PX.map(|sigma| sigma * narrower),
            frame_sigma: FRAME_SIGMA_PX,
        }
    }

    /// Digest of what was found and applied. What it rests on is not in it, and shows where it acts;
    /// nor is an error that is not to be looked for.
    pub(crate) fn digest(&mut self) -> u64 {
        if self.mode == SelfCalibrationMode::Off {
            let (offset, sides) = (Information::NONE, Information::NONE);
            let mut unsought = Self { offset, sides, frames: 0, ..self.clone() };
            return Hasher::digest(|hasher| unsought.visit_found(hasher));
        }
        Hasher::digest(|hasher| self.visit_found(hasher))
    }

    fn visit_found(&mut self, visitor: &mut impl Visitor) {
        let Self { offset, sides, applied, offset_applies, frames, rows, .. } = self;
        let DisparityCorrection { offset_px, slope_px, quartic_px, row_quadratic_px } = applied;
        offset.visit(visitor);
        sides.visit(visitor);
        visitor.f64s([offset_px, slope_px, quartic_px, row_quadratic_px]);
        visitor.code(offset_applies, u32::from, |code| code == 1);
        visitor.u32(frames);
        rows.visit(visitor);
    }

    /// Visits every field but those the configuration gives.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        self.visit_found(visitor);
        // Without `..`, so that a new field must be visited to compile.
        let Self {
            mode: _,
            start: _,
            start_evidence: _,
            offset: _,
            sides: _,
            sides_witness,
            applied: _,
            offset_applies: _,
            frames: _,
            offset_evidence,
            start_refuted,
            rows: _,
        } = self;
        sides_witness.visit(visitor);
        offset_evidence.visit(visitor);
        visitor.code(start_refuted, u32::from, |code| code == 1);
    }
}
