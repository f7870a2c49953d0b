//! Findings of a run about its rig: figures, a sentence, and a file to begin another run with.

use crate::run::RunRecord;
use dynvox_core::geometry::RowCorrection;
use dynvox_core::rectify::self_calibration::{
    CalibrationState, CorrectionEvidence, SelfCalibrationReport,
};
use serde::Serialize;

/// Difference of rows that is worth a word, px.
const ROWS_WORTH_A_WORD_PX: f64 = 0.1;

/// Least deviation that is written, px: below, a rig's own changes from day to day are larger.
const SIGMA_MIN_PX: f64 = 0.02;

/// The rig's part of `summary.json`.
#[derive(Debug, Serialize)]
pub struct RigSummary {
    /// Correction that must be added to disparities in the middle of the image, px.
    disparity_offset_px: f64,
    disparity_offset_sigma_px: f64,
    /// Growth of that towards the right side, px there.
    disparity_slope_px: f64,
    /// Growth of that with the fourth power of the distance from the middle, px at the sides.
    disparity_quartic_px: f64,
    /// Growth of that with the square of the distance from the middle row, px from there to the
    /// first row.
    disparity_row_quadratic_px: f64,
    /// Largest difference of the rows in which both cameras see the same, px.
    row_error_px: f64,
    /// Frames that said something about it.
    disparity_frames: u32,
    /// Frames left out because part of what they show moves otherwise.
    disparity_frames_disturbed: u32,
    /// Independent frames that those which count are worth.
    disparity_frames_independent: f64,
    /// Way driven in these frames, m.
    disparity_way_m: f64,
    /// `sound`, `inaccurate` or `recalibrate`.
    calibration: &'static str,
    /// True if the correction was applied to depth and motion.
    corrected: bool,
}

/// Returns the rig's state after the last frame, if it is known.
fn found(run: &RunRecord) -> Option<SelfCalibrationReport> {
    run.frames.last().map(|row| row.report.self_calibration).filter(|report| report.known)
}

/// The figures; `None` where too little moved to tell.
pub fn summary(run: &RunRecord) -> Option<RigSummary> {
    found(run).map(|report| RigSummary {
        disparity_offset_px: report.offset_px,
        disparity_offset_sigma_px: report.offset_sigma_px,
        disparity_slope_px: report.slope_px,
        disparity_quartic_px: report.quartic_px,
        disparity_row_quadratic_px: report.row_quadratic_px,
        row_error_px: report.rows.largest_px(),
        disparity_frames: report.frames,
        disparity_frames_disturbed: report.frames_disturbed,
        disparity_frames_independent: report.frames_independent,
        disparity_way_m: report.way_m,
        calibration: match report.state() {
            CalibrationState::Sound => "sound",
            CalibrationState::Inaccurate => "inaccurate",
            CalibrationState::Recalibrate => "recalibrate",
        },
        corrected: report.corrected,
    })
}

/// The correction of rows, where it is worth a word.
fn rows_apart(report: &SelfCalibrationReport) -> Option<RowCorrection> {
    Some(report.rows).filter(|rows| rows.largest_px() >= ROWS_WORTH_A_WORD_PX)
}

/// Writes what self-calibration found and what to do about it.
pub fn sentence(run: &RunRecord) -> String {
    let Some(report) = found(run) else {
        return "disparity offset unknown: the camera has to move past something within about 30 m"
            .to_owned();
    };
    // Rows apart are mentioned only where they matter.
    let rows = rows_apart(&report).map_or_else(String::new, |rows| {
        let moved = if report.corrected { ", aligned" } else { "" };
        format!("; rows up to {:.1} px apart{moved}", rows.largest_px())
    });
    let value = format!(
        "{:+.3} px of disparity, sigma {:.3} px{rows}",
        report.offset_px, report.offset_sigma_px
    );
    let done = if report.corrected {
        "taken out"
    } else {
        "not taken out: set rig.self_calibration=\"apply\""
    };
    // Each state says what to do next.
    match report.state() {
        CalibrationState::Sound => format!("sound: {value}"),
        CalibrationState::Inaccurate => {
            format!("{value}, {done}; another run begins with it: --config calibration.toml")
        }
        CalibrationState::Recalibrate => {
            format!(
                "{value}, {done}. Recalibrate the cameras: more than 1 px is more than they should \
                 be off"
            )
        }
    }
}

/// Returns true if the sentence about the rig is a warning.
pub fn is_warning(run: &RunRecord) -> bool {
    found(run).is_some_and(|report| report.state() > CalibrationState::Sound)
}

/// Settings that begin another run with what was found; `None` where there is nothing to correct.
pub fn calibration_toml(run: &RunRecord) -> Option<String> {
    begin_with(
        &run.frames.last()?.report.self_calibration,
        &run.plan.config.rig_settings.correction_evidence,
    )
}

/// Evidence of a run and of the one it began with.
fn evidence_of(report: &SelfCalibrationReport, earlier: &CorrectionEvidence) -> CorrectionEvidence {
    // Where frames contradicted the start, what it rested on is no evidence.
    let earlier = if report.start_refuted { CorrectionEvidence::default() } else { *earlier };
    CorrectionEvidence {
        sigma_px: report.offset_sigma_px.max(SIGMA_MIN_PX),
        frames: earlier.frames.saturating_add(report.frames_independent as u32),
        way_m: earlier.way_m + report.way_m,
    }
}

fn begin_with(report: &SelfCalibrationReport, earlier: &CorrectionEvidence) -> Option<String> {
    // Only what differs from zero: an empty correction would look like a finding.
    let disparity = report.found().filter(|found| !found.is_zero()).map(|found| {
        format!(
            "[rig.disparity_correction]\noffset_px = {:.4}\nslope_px = {:.4}\nquartic_px = \
             {:.4}\nrow_quadratic_px = {:.4}\n",
            found.offset_px, found.slope_px, found.quartic_px, found.row_quadratic_px
        )
    });
    let CorrectionEvidence { sigma_px, frames, way_m } = evidence_of(report, earlier);
    let disparity = disparity.map(|disparity| {
        format!(
            "{disparity}# What it rests on: the deviation of the offset, independent frames, and \
             the way in them.\n[rig.correction_evidence]\nsigma_px = \
             {sigma_px:.4}\nframes = {frames}\nway_m = {way_m:.1}\n"
        )
    });
    let rows = rows_apart(report).map(|rows| {
        format!(
            "[rig.row_correction]\nconstant_px = {:.4}\ncolumn_px = {:.4}\nrow_px = {:.4}\n\
             column_quadratic_px = {:.4}\nproduct_px = {:.4}\nrow_quadratic_px = {:.4}\n",
            rows.constant_px,
            rows.column_px,
            rows.row_px,
            rows.column_quadratic_px,
            rows.product_px,
            rows.row_quadratic_px
        )
    });
    (disparity.is_some() || rows.is_some()).then(|| {
        format!(
            "# What must be added to the disparities of this rig and to the rows of its right \
             images, px, as a run found it.\n# Another run of the same rig begins with it, and \
             leaves it if its frames say otherwise: dynvox run PATH --config calibration.toml\n{}{}",
            disparity.unwrap_or_default(),
            rows.unwrap_or_default()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::geometry::DisparityCorrection;
    use dynvox_core::rectify::self_calibration::RigConfig;

    #[derive(serde::Deserialize)]
    struct SettingsFile {
        rig: RigConfig,
    }

    #[test]
    fn another_run_begins_with_what_was_found() {
        let mut report = SelfCalibrationReport::default();
        // Nothing was found: no lines to begin with.
        let none = CorrectionEvidence::default();
        assert_eq!(begin_with(&report, &none), None);
        // Binary fractions come back from TOML bit for bit.
        (
            report.known,
            report.corrected,
            report.offset_px,
            report.applied_offset_px,
            report.quartic_px,
        ) = (true, true, 0.25, 0.25, 1.5);
        (report.offset_sigma_px, report.frames_independent, report.way_m) = (0.03125, 12.5, 20.5);
        report.rows = RowCorrection {
            constant_px: 0.5,
            product_px: -1.25,
            row_px: 0.125,
            ..RowCorrection::default()
        };
        let SettingsFile { rig } = toml::from_str(&begin_with(&report, &none).unwrap()).unwrap();
        assert_eq!(
            rig.disparity_correction,
            DisparityCorrection {
                offset_px: 0.25,
                quartic_px: 1.5,
                ..DisparityCorrection::default()
            }
        );
        assert_eq!(rig.row_correction, report.rows);
        let first = CorrectionEvidence { sigma_px: 0.0312, frames: 12, way_m: 20.5 };
        assert_eq!(rig.correction_evidence, first);
        // A second run adds its own to it, unless it refuted it.
        let again = |report: &SelfCalibrationReport| {
            let text = begin_with(report, &first).unwrap();
            toml::from_str::<SettingsFile>(&text).unwrap().rig.correction_evidence
        };
        assert_eq!((again(&report).frames, again(&report).way_m), (24, 41.0));
        report.start_refuted = true;
        assert_eq!((again(&report).frames, again(&report).way_m), (12, 20.5));
        // The disparity's correction needs motion, which the rows' does not.
        report.known = false;
        let text = begin_with(&report, &none).unwrap();
        assert!(
            !text.contains("disparity_correction") && text.contains("row_correction"),
            "rows are known from pictures alone: {text}"
        );
    }
}
