//! Row difference of pairs under a calibration.

use super::rectified::PairRectifier;
use super::rows::RowError;
use super::{FEWEST_MATCHES, each_pair, patches};
use crate::formats::Image;
use crate::formats::calibration::{LARGEST_PX, StereoCalibration};
use crate::input::source::{FrameSource, InputError};
use dynvox_core::rectify::Sizing;

/// Median distance of matched rows after pairs are rectified by a calibration, px; `None` where the
/// calibration cannot rectify them or too little is matched.
pub fn row_difference_px(pairs: &[[Image<u8>; 2]], calibration: &StereoCalibration) -> Option<f64> {
    let [max_width, max_height] = LARGEST_PX;
    let sizing = Sizing::Automatic { max_width, max_height };
    let (rectification, rig) = calibration.rectify(sizing).ok()?;
    let mut rectifier = PairRectifier::new(&rectification, &rig).ok()?;
    let mut matches = Vec::new();
    for pair in pairs {
        let [left, right] = rectifier.rectify(pair)?;
        matches.extend(patches::matches(&left, &right, patches::step_px(pairs.len())));
    }
    let matches: Vec<_> = matches.iter().collect();
    (matches.len() >= FEWEST_MATCHES)
        .then(|| RowError::of(&matches, f64::from(rectification.width)).median_px)
}

/// Misalignment of the rows of a source's pairs as the mapper will see them; `None` where too
/// little is matched.
///
/// # Errors
/// A raw source cannot be rectified.
pub fn row_error(
    source: &dyn FrameSource,
    indices: &[usize],
) -> Result<Option<RowError>, InputError> {
    let (mut matches, mut width_px) = (Vec::new(), 0.0);
    each_pair(source, indices, |left, right, of| {
        width_px = left.width() as f64;
        matches.extend(patches::matches(left, right, patches::step_px(of)));
    })?;
    let matches: Vec<_> = matches.iter().collect();
    Ok((matches.len() >= FEWEST_MATCHES).then(|| RowError::of(&matches, width_px)))
}
