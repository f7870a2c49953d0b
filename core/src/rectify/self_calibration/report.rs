//! Report of the self-calibration, and the verdict on it.

use super::APPLY_ABOVE_PX;
use crate::geometry::{DisparityCorrection, RowCorrection};

/// Calibration error that was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SelfCalibrationReport {
    /// Correction that must be added to disparities in the middle of the image, px; the part
    /// already added included.
    pub offset_px: f64,
    /// Standard deviation of the offset, px; with what all matches of a frame share, and with what
    /// stretches of the way differ by.
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
    /// Frames left out because part of what they show moves otherwise, and pulls the offset.
    pub frames_disturbed: u32,
    /// Number of independent frames that the others are worth: one in which the camera moves by a
    /// share of its baseline counts as that share.
    pub frames_independent: f64,
    /// Way driven in these frames, m.
    pub way_m: f64,
    /// True if frames contradicted the correction at which the search began: it began anew.
    pub start_refuted: bool,
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
