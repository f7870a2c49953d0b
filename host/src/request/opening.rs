//! A first pass over a recording's opening frames, which finds the rig's disparity error before
//! anything is mapped.
//!
//! Only matches and the camera's motion are worked out, by a mapper that is given empty disparities
//! and fuses nothing. A correction found while mapping comes too late for the first frames: they
//! are in the map already, at the wrong depth.

use super::{Request, Settings};
use crate::input::FrameSource;
use crate::input::diagnosis::RectifiedSource;
use dynvox_core::geometry::{RowCorrection, StereoRig};
use dynvox_core::image::View;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::rectify::self_calibration::{
    CalibrationState, CorrectionEvidence, RigConfig, SelfCalibrationMode, SelfCalibrationReport,
};
use dynvox_core::{Capacity, Config, Mapper, MotionSource, Serial, StereoFrame};

/// Frames of the first pass at most.
const MAX_FRAMES: usize = 40;
/// Deviation of the offset at which the first pass ends, px.
const SIGMA_PX: f64 = 0.04;
/// Frames are mapped once more after the first pass, and must not count twice.
const TWICE: f64 = std::f64::consts::SQRT_2;
/// Difference of rows that is taken over, px.
const ROWS_PX: f64 = 0.1;

/// Finds an offset that affects the map; `None` if the rig is sound, or if nothing is to be found
/// out: of streams, of a rendered street, with given poses, or where an earlier run is the start.
pub(super) fn find(
    request: &Request,
    settings: &Settings,
    source: &dyn FrameSource,
    frames: &[usize],
) -> Option<SelfCalibrationReport> {
    let is_start_given = settings.rig.correction_evidence != CorrectionEvidence::default()
        || !settings.rig.disparity_correction.is_zero()
        || settings.rig.row_correction != RowCorrection::default();
    let is_estimated = settings.mapper.egomotion == MotionSource::Stereo
        && matches!(request.poses, super::Poses::Estimated);
    if is_start_given || !is_estimated || request.input.source.is_synthetic() {
        return None;
    }
    let found = search(settings, source, frames)?;
    (found.known && found.state() > CalibrationState::Sound).then_some(found)
}

/// Makes what was found the start of a run, as evidence.
pub(super) fn begin_with(found: &SelfCalibrationReport, rig: &mut RigConfig) {
    let (Some(correction), SelfCalibrationMode::Apply) = (found.found(), rig.self_calibration)
    else {
        return;
    };
    rig.disparity_correction = correction;
    if found.rows.largest_px() >= ROWS_PX {
        rig.row_correction = found.rows;
    }
    rig.correction_evidence = CorrectionEvidence {
        sigma_px: found.offset_sigma_px * TWICE,
        frames: found.frames_independent as u32,
        way_m: found.way_m,
    };
}

/// A sentence about an offset that is found and will not be taken out.
pub(super) fn warning(found: &SelfCalibrationReport, rig: &RigConfig) -> Option<String> {
    (rig.self_calibration != SelfCalibrationMode::Apply).then(|| {
        format!(
            "the cameras are off by a disparity offset of {:.1} px, sigma {:.2}: depth and way are \
             wrong by per cents, and it is not taken out. Set rig.self_calibration=\"apply\", or \
             calibrate the cameras",
            found.offset_px, found.offset_sigma_px
        )
    })
}

/// Self-calibration over the opening frames.
fn search(
    settings: &Settings,
    source: &dyn FrameSource,
    frames: &[usize],
) -> Option<SelfCalibrationReport> {
    let (capacity, config) = bounds(settings, source.rig(), source.size());
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&capacity, &config, &mut slab).ok()?;
    let mut pairs = RectifiedSource::new(source).ok()?;
    let ignored = source.info().ignored.clone();
    let no_disparity = vec![0; capacity.image_width * capacity.image_height];
    let mut last = None;
    for &index in frames.iter().take(MAX_FRAMES) {
        // A frame that cannot be read is left to the run.
        let [left, right] = pairs.pair(index).ok()??;
        let frame = StereoFrame {
            disparity_q8: View::new(&no_disparity, left.width(), left.height()),
            ignored: ignored.as_ref().and_then(|ignored| ignored.view()),
            time_ns: source.frame_info(index).stamp_ns,
            ..StereoFrame::pair(left.view()?, right.view()?)
        };
        let report = mapper.step(&frame, &Serial).ok()?;
        last = Some(report.self_calibration);
        if report.self_calibration.known && report.self_calibration.offset_sigma_px < SIGMA_PX {
            break;
        }
    }
    last
}

/// Bounds and settings of a mapper that only finds the camera's motion.
fn bounds(
    settings: &Settings,
    rig: StereoRig,
    (image_width, image_height): (usize, usize),
) -> (Capacity, Config) {
    let capacity = Capacity {
        image_width,
        image_height,
        features: Capacity::ONBOARD.features,
        matches: Capacity::ONBOARD.matches,
        colour: false,
        ..Capacity::TINY
    };
    let mut config = settings.config(rig, None);
    config.rig_settings.self_calibration = SelfCalibrationMode::Apply;
    config.segmentation.enabled = false;
    config.mapper.fuse_every = u32::MAX;
    (capacity, config)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::Source;
    use std::fs;
    use std::path::Path;

    /// A recording of a street, with the right images moved to the right by whole pixels.
    fn recording(by_px: i64) -> tempfile::TempDir {
        let street = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/street-320x96");
        let folder = tempfile::tempdir().unwrap();
        for side in ["left", "right"] {
            fs::create_dir(folder.path().join(side)).unwrap();
            for file in fs::read_dir(street.join(side)).unwrap().map(Result::unwrap) {
                let image = image::open(file.path()).unwrap().into_luma8();
                let by_px = if side == "right" { by_px } else { 0 };
                let moved = image::GrayImage::from_fn(image.width(), image.height(), |u, v| {
                    let source = (i64::from(u) - by_px).clamp(0, i64::from(image.width()) - 1);
                    *image.get_pixel(source as u32, v)
                });
                moved.save(folder.path().join(side).join(file.file_name())).unwrap();
            }
        }
        fs::copy(street.join("calib.txt"), folder.path().join("calib.txt")).unwrap();
        folder
    }

    fn request(folder: &Path, mode: SelfCalibrationMode) -> Request {
        let mut request = Request::default();
        request.input.source = Source::Recording(folder.to_path_buf());
        request.settings.rig.self_calibration = mode;
        request
    }

    #[test]
    fn a_rig_that_is_off_is_corrected_from_the_first_frame_on() {
        for planted in [-1, 1] {
            let folder = recording(planted);
            let plan = request(folder.path(), SelfCalibrationMode::Apply).resolve().unwrap();
            let rig = plan.config.rig_settings;
            let found = rig.disparity_correction.offset_px;
            assert!((found - planted as f64).abs() < 0.15, "{planted}: {rig:?}");
            let evidence = rig.correction_evidence;
            assert!(evidence.sigma_px < 0.2 && evidence.frames > 5, "{evidence:?}");
            assert!(
                plan.config_toml.contains("[rig.correction_evidence]"),
                "a run resumes with it"
            );
        }
    }

    #[test]
    fn a_rig_that_is_off_is_named_where_nothing_is_corrected() {
        let folder = recording(1);
        let plan = request(folder.path(), SelfCalibrationMode::Off).resolve().unwrap();
        let warnings = plan.warnings.join("; ");
        assert!(warnings.contains("disparity offset of 1.0 px"), "{warnings}");
        assert!(plan.config.rig_settings.disparity_correction.is_zero());
    }

    #[test]
    fn a_sound_rig_and_a_start_that_is_given_stay_as_they_are() {
        let sound = recording(0);
        let plan = request(sound.path(), SelfCalibrationMode::Apply).resolve().unwrap();
        assert_eq!(plan.config.rig_settings, RigConfig::default());
        let off = recording(1);
        let mut given = request(off.path(), SelfCalibrationMode::Apply);
        given.settings.rig.disparity_correction.offset_px = 0.5;
        let rig = given.settings.rig;
        assert_eq!(given.resolve().unwrap().config.rig_settings, rig);
    }
}
