//! Settings of the rig in addition to its calibration.

use crate::{
    geometry::{DisparityCorrection, RowCorrection},
    problem::{Problems, require},
};

/// What is done with the disparity error found while driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum SelfCalibrationMode {
    /// It is found, reported and taken out.
    #[default]
    Apply,
    /// It is found and reported.
    Report,
    /// It is not looked for.
    Off,
}

/// Settings of the rig in addition to its calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct RigConfig {
    /// What is done with the disparity error found while driving; `apply`.
    pub self_calibration: SelfCalibrationMode,
    /// Factor on the calibrated baseline; in 0.5..=2; 1. No picture shows the baseline, so nothing
    /// checks it: compare with a distance known from elsewhere. KITTI's 0.5372 m are 0.54 m in
    /// truth.
    pub baseline_scale: f64,
    /// What is added to disparities from the first frame on, as another run found it; each of the
    /// four within 5 px; all 0. With self-calibration the search begins there.
    pub disparity_correction: DisparityCorrection,
    /// What is added to the right image's rows from the first frame on, as another run found it;
    /// each of the six within 5 px; all 0. With self-calibration the search begins there.
    pub row_correction: RowCorrection,
}

impl Default for RigConfig {
    fn default() -> Self {
        Self {
            self_calibration: SelfCalibrationMode::Apply,
            baseline_scale: 1.0,
            disparity_correction: DisparityCorrection::default(),
            row_correction: RowCorrection::default(),
        }
    }
}

impl RigConfig {
    /// Largest part of a correction to begin with, px.
    pub(crate) const CORRECTION_MAX_PX: f64 = 5.0;

    /// Notes what is wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        require(
            problems,
            (0.5..=2.0).contains(&self.baseline_scale),
            "rig.baseline_scale",
            "must be in 0.5..=2",
        );
        let DisparityCorrection { offset_px, slope_px, quartic_px, row_quadratic_px } =
            self.disparity_correction;
        let rows = self.row_correction;
        for (key, part) in [
            ("rig.disparity_correction.offset_px", offset_px),
            ("rig.disparity_correction.slope_px", slope_px),
            ("rig.disparity_correction.quartic_px", quartic_px),
            ("rig.disparity_correction.row_quadratic_px", row_quadratic_px),
            ("rig.row_correction.constant_px", rows.constant_px),
            ("rig.row_correction.column_px", rows.column_px),
            ("rig.row_correction.row_px", rows.row_px),
            ("rig.row_correction.column_quadratic_px", rows.column_quadratic_px),
            ("rig.row_correction.product_px", rows.product_px),
            ("rig.row_correction.row_quadratic_px", rows.row_quadratic_px),
        ] {
            let within = (-Self::CORRECTION_MAX_PX..=Self::CORRECTION_MAX_PX).contains(&part);
            require(problems, within, key, "must be in -5..=5");
        }
    }
}
