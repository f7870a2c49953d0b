//! The cameras of a recording, by their `CameraInfo`.
//!
//! The content tells raw images from rectified ones: without distortion and rotation they are both.
//! Programs that rectify publish `image_rect` with the raw camera's `CameraInfo`; the rows of such
//! pictures tell. Other names of topics tell nothing.

use super::messages::CameraInfo;
use super::recording::Recording;
use super::topics;
use crate::formats::Image;
use crate::formats::calibration::{CalibrationFiles, CalibrationHints, CameraGeometry};
use crate::input::data_set::OpenOptions;
use crate::input::diagnosis::row_difference_px;
use crate::input::source::InputError;

/// Part of the other reading's row difference below which a reading is the better one.
const BETTER: f64 = 0.6;

/// Cameras, with what was said about them.
pub struct Found {
    pub cameras: CameraGeometry,
    pub notes: Vec<String>,
}

/// Reading of `CameraInfo` messages.
struct Reading<'r> {
    recording: &'r Recording,
    infos: [CameraInfo; 2],
    hints: CalibrationHints,
}

/// The cameras as they are given, else by the `CameraInfo` of the recording. `pairs` are some
/// pictures as they lie there.
///
/// # Errors
/// The recording has no `CameraInfo`, or it cannot be used.
pub fn cameras(
    recording: &Recording,
    images: &[String; 2],
    options: &OpenOptions,
    pairs: &[[Image<u8>; 2]],
) -> Result<Found, InputError> {
    if !options.calibration.is_empty() {
        let cameras = options.cameras_of(&options.calibration)?;
        return Ok(Found { cameras, notes: Vec::new() });
    }
    let mut notes = Vec::new();
    let [left, right] = images.each_ref().map(|topic| info(recording, topic, &mut notes));
    let reading = Reading { recording, infos: [left?, right?], hints: options.hints };
    let undistorted = reading.infos.iter().all(CameraInfo::is_undistorted);
    let rectified = undistorted || reading.by_rows(images, pairs, &mut notes);
    let files = reading.files(rectified);
    // What is wrong with them is said here, and what only the images tell later.
    files.cameras(None)?;
    Ok(Found { cameras: CameraGeometry::Files(Box::new(files)), notes })
}

/// The calibration of an image topic.
fn info(
    recording: &Recording,
    images: &str,
    notes: &mut Vec<String>,
) -> Result<CameraInfo, InputError> {
    let refuse = |reason: String| {
        let reason = format!("{reason}. Give the calibration with --calibration FILE");
        InputError::bag(recording.path(), reason)
    };
    let topic = topics::info_of(recording, images)
        .ok_or_else(|| refuse(format!("there is no CameraInfo for {images}")))?;
    let info = recording.camera_info(&topic)?;
    if info.is_blank() {
        return Err(refuse(format!("the focal length in {topic} is 0: no one calibrated it")));
    }
    notes.push(format!("calibration of {topic}"));
    Ok(info)
}

impl Reading<'_> {
    fn files(&self, rectified: bool) -> CalibrationFiles {
        let texts = self.infos.each_ref().map(CameraInfo::as_yaml);
        CalibrationFiles::from_camera_infos(self.recording.path(), &texts, rectified, self.hints)
    }

    /// Row difference of pictures that are raw, or rectified, px.
    fn rows_px(&self, rectified: bool, pairs: &[[Image<u8>; 2]]) -> Option<f64> {
        let [left, _] = pairs.first()?;
        let size = [left.width(), left.height()].map(|side| u32::try_from(side).unwrap_or(0));
        let read = self.files(rectified).cameras(Some(size)).ok()?;
        row_difference_px(pairs, &read.raw(Some(size)).ok()?)
    }

    /// Tells by rows whether pictures with a raw camera's `CameraInfo` are rectified, and says so.
    fn by_rows(
        &self,
        images: &[String; 2],
        pairs: &[[Image<u8>; 2]],
        notes: &mut Vec<String>,
    ) -> bool {
        let (raw_px, plain_px) = (self.rows_px(false, pairs), self.rows_px(true, pairs));
        let better = match (raw_px, plain_px) {
            (Some(raw_px), Some(plain_px)) => plain_px < BETTER * raw_px,
            (None, Some(_)) => true,
            _ => false,
        };
        if !better {
            return false;
        }
        let px = |px: Option<f64>| px.map_or("no match".to_owned(), |px| format!("{px:.2} px"));
        let rows = format!(
            "the rows of the images agree better as they are ({}) than after the rectification of \
             their CameraInfo ({})",
            px(plain_px),
            px(raw_px)
        );
        let named = images.iter().all(|topic| is_named_rectified(topic));
        notes.push(if named {
            format!("{rows}: taken as rectified")
        } else {
            let [p0, p1] = self.infos.each_ref().map(projection);
            format!(
                "{rows}: if they are rectified, give --calibration with a file of the lines `P0: \
                 {p0}` and `P1: {p1}`"
            )
        });
        named
    }
}

/// Returns true if the last part of a topic is ROS's name for rectified images.
fn is_named_rectified(topic: &str) -> bool {
    let topic = topic.trim_end_matches("/compressed");
    topic.rsplit('/').next().is_some_and(|name| name.starts_with("image_rect"))
}

fn projection(info: &CameraInfo) -> String {
    info.projection.map(|number| number.to_string()).join(" ")
}
