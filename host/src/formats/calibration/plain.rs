//! The calibration of a plain stereo folder: KITTI's lines, or a key and a value a line.

use super::{KittiCalibration, checked, unusable};
use crate::formats::bounds::CALIBRATION_TEXT;
use crate::formats::{FormatError, read_text_within};
use dynvox_core::geometry::StereoRig;
use std::path::Path;

const KEYS: [&str; 4] = ["focal_px", "center_u_px", "center_v_px", "baseline_m"];

/// Reads a plain stereo folder's calibration: KITTI's lines `P0:`, `P1:`, or one `key value` line
/// each for `focal_px`, `center_u_px`, `center_v_px` and `baseline_m`. `#` begins a comment.
///
/// # Errors
/// The file cannot be read, a line is neither, a key is missing, or the rig cannot be.
pub fn read_rig(path: &Path) -> Result<StereoRig, FormatError> {
    let text = read_text_within(path, &CALIBRATION_TEXT)?;
    if has_keys(&text) {
        return parse(&text, path).and_then(|rig| checked(rig, path));
    }
    KittiCalibration::parse(&without_comments(&text), path)?.rig(0, 1)
}

/// Tells whether a line begins with one of the keys.
pub(super) fn has_keys(text: &str) -> bool {
    text.lines().any(|line| KEYS.iter().any(|key| line.trim_start().starts_with(key)))
}

/// The text without comments from `#`.
pub(super) fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split('#').next().unwrap_or("").to_owned() + "\n").collect()
}

/// Reads lines `key value`.
pub(super) fn parse(text: &str, path: &Path) -> Result<StereoRig, FormatError> {
    let text = without_comments(text);
    let mut values = [None; 4];
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let mut words = line.split([' ', '\t', '=', ':']).filter(|word| !word.is_empty());
        let key = words.next().unwrap_or_default();
        let slot = KEYS.iter().position(|known| *known == key).and_then(|at| values.get_mut(at));
        let number = words.next().and_then(|word| word.parse::<f64>().ok());
        let (Some(slot), Some(number)) = (slot, number) else {
            let action = format!("Its lines are `key value` with the keys {}", KEYS.join(", "));
            return Err(unusable(path, format!("`{line}` is not a line of it"), action));
        };
        *slot = Some(number);
    }
    let [Some(focal_px), Some(center_u_px), Some(center_v_px), Some(baseline_m)] = values else {
        let missing: Vec<&str> = KEYS
            .iter()
            .zip(values)
            .filter(|(_, value)| value.is_none())
            .map(|(key, _)| *key)
            .collect();
        return Err(unusable(
            path,
            format!("{} is missing", missing.join(", ")),
            "Add one line `key value` for each",
        ));
    };
    Ok(StereoRig { focal_px, center_u_px, center_v_px, baseline_m })
}
