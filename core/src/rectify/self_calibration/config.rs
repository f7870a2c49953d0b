//! Settings of the rig in addition to its calibration.

use crate::{
    geometry::{DisparityCorrection, RowCorrection},
    settings::{
        Problems, Range, Rule, Setting,
        Value::{Choice, F64, U32},
        check, choices, rules,
    },
};

/// Use of the disparity error that is found while driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum SelfCalibrationMode {
    /// The error is found, reported and taken out.
    #[default]
    Apply,
    /// The error is found and reported.
    Report,
    /// The error is not taken out, nor reported unless it affects the map.
    Off,
}

choices! { SelfCalibrationMode { "apply" = Apply, "report" = Report, "off" = Off } }

/// Evidence on which a correction of disparities rests, as another run found it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct CorrectionEvidence {
    /// Standard deviation of the offset, px: how firmly the search begins with it.
    pub sigma_px: f64,
    /// Independent frames.
    pub frames: u32,
    /// Way driven in these frames, m.
    pub way_m: f64,
}

impl Default for CorrectionEvidence {
    /// No evidence: the offset is within half a pixel of what it begins with.
    fn default() -> Self {
        Self { sigma_px: 0.5, frames: 0, way_m: 0.0 }
    }
}

/// Settings of the rig in addition to its calibration. [`RigConfig::SETTINGS`] has their ranges.
///
/// ```
/// use dynvox_core::{Config, geometry::StereoRig};
///
/// let rig =
///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut config = Config::for_rig(rig);
/// config.set("rig.self_calibration", "apply")?;
/// assert!(config.validate().is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct RigConfig {
    /// Use of the disparity error found while driving.
    pub self_calibration: SelfCalibrationMode,
    /// Factor on the calibrated baseline.
    pub baseline_scale: f64,
    /// Correction of disparities from the first frame on, as another run found it; with
    /// self-calibration the search begins there.
    pub disparity_correction: DisparityCorrection,
    /// Evidence on which the correction of disparities rests.
    pub correction_evidence: CorrectionEvidence,
    /// Correction of the right image's rows from the first frame on, as another run found it; with
    /// self-calibration the search begins there.
    pub row_correction: RowCorrection,
}

impl Default for RigConfig {
    fn default() -> Self {
        Self {
            self_calibration: SelfCalibrationMode::Apply,
            baseline_scale: 1.0,
            disparity_correction: DisparityCorrection::default(),
            correction_evidence: CorrectionEvidence::default(),
            row_correction: RowCorrection::default(),
        }
    }
}

type Row = Setting<RigConfig>;

/// Range of each part of a correction to begin with, px.
const CORRECTION: Range =
    Range::Within(-RigConfig::CORRECTION_MAX_PX as f32, RigConfig::CORRECTION_MAX_PX as f32);

impl RigConfig {
    /// Largest part of a correction to begin with, px.
    pub(crate) const CORRECTION_MAX_PX: f64 = 5.0;

    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("rig.self_calibration", "", |c| Choice(&mut c.self_calibration)).text(
            "Use of the disparity error found while driving: it is found, reported and taken out; \
             found and reported; or only reported where it affects the map.",
        ),
        Row::user("rig.baseline_scale", "", |c| F64(&mut c.baseline_scale))
            .range(Range::Within(0.5, 2.0))
            .text(
                "Factor on the calibrated baseline. No picture shows the baseline, so nothing \
                 checks it: compare with a distance known from elsewhere. KITTI's 0.5372 m are \
                 0.54 m in truth.",
            ),
        Row::expert("rig.disparity_correction.offset_px", "px", |c| {
            F64(&mut c.disparity_correction.offset_px)
        })
        .range(CORRECTION)
        .text("Added to disparities from the first frame on, as another run found it: everywhere \
               alike."),
        Row::expert("rig.disparity_correction.slope_px", "px", |c| {
            F64(&mut c.disparity_correction.slope_px)
        })
        .range(CORRECTION)
        .text("Added to disparities: growth with the column, at the right side."),
        Row::expert("rig.disparity_correction.quartic_px", "px", |c| {
            F64(&mut c.disparity_correction.quartic_px)
        })
        .range(CORRECTION)
        .text(
            "Added to disparities: growth with the fourth power of the distance from the middle \
             column, at the sides.",
        ),
        Row::expert("rig.disparity_correction.row_quadratic_px", "px", |c| {
            F64(&mut c.disparity_correction.row_quadratic_px)
        })
        .range(CORRECTION)
        .text(
            "Added to disparities: growth with the square of the distance from the middle row, from \
             there to the first row.",
        ),
        Row::expert("rig.correction_evidence.sigma_px", "px", |c| {
            F64(&mut c.correction_evidence.sigma_px)
        })
            .range(Range::Within(0.001, 5.0))
            .text(
                "Standard deviation of the offset to begin with: self-calibration leaves it the \
                 less, the smaller this is.",
            ),
        Row::expert("rig.correction_evidence.frames", "", |c| {
            U32(&mut c.correction_evidence.frames)
        })
        .text(
            "Independent frames on which the correction to begin with rests. With five, and a \
             deviation below 0.06 px, it counts as known.",
        ),
        Row::expert("rig.correction_evidence.way_m", "m", |c| F64(&mut c.correction_evidence.way_m))
            .range(Range::NOT_NEGATIVE)
            .text("Way on which the correction to begin with was found."),
        Row::expert("rig.row_correction.constant_px", "px", |c| {
            F64(&mut c.row_correction.constant_px)
        })
        .range(CORRECTION)
        .text(
            "Added to the right image's rows from the first frame on, as another run found it: \
             everywhere alike.",
        ),
        Row::expert("rig.row_correction.column_px", "px", |c| {
            F64(&mut c.row_correction.column_px)
        })
        .range(CORRECTION)
        .text("Added to the right image's rows: growth with the column, at the right side."),
        Row::expert("rig.row_correction.row_px", "px", |c| {
            F64(&mut c.row_correction.row_px)
        })
        .range(CORRECTION)
        .text(
            "Added to the right image's rows: growth from the middle row to the first one, there.",
        ),
        Row::expert("rig.row_correction.column_quadratic_px", "px", |c| {
            F64(&mut c.row_correction.column_quadratic_px)
        })
        .range(CORRECTION)
        .text(
            "Added to the right image's rows: growth with the square of the distance from the \
             middle column, at the sides.",
        ),
        Row::expert("rig.row_correction.product_px", "px", |c| {
            F64(&mut c.row_correction.product_px)
        })
        .range(CORRECTION)
        .text(
            "Added to the right image's rows: growth with column and row, in the last column of \
             the first row.",
        ),
        Row::expert("rig.row_correction.row_quadratic_px", "px", |c| {
            F64(&mut c.row_correction.row_quadratic_px)
        })
        .range(CORRECTION)
        .text(
            "Added to the right image's rows: growth with the square of the distance from the \
             middle row, at the first row.",
        ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
