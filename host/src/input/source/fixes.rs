//! Positions of the camera that something else measured, from a table.

use super::{FrameSource, InputError};
use crate::formats::{FormatError, number_rows, read_text};
use std::path::Path;

/// A position this far in time from a frame is not its own, s.
const NEAR_S: f64 = 0.02;

/// Position of the left camera in a frame, in the first camera's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionFix {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// x to the right, y down, z ahead, m.
    pub position_m: [f64; 3],
    /// Standard deviations along these axes, m.
    pub sigma_m: [f64; 3],
}

/// Reads the positions of the chosen frames, in their order. A row has a time in seconds, on the
/// clock of the frames, a position, and one standard deviation or three; it belongs to the frame
/// whose time it is nearest to, and is left out where none is within 0.02 s.
///
/// # Errors
/// The file cannot be read, a row is no position, or none belongs to a frame.
pub fn read_position_fixes(
    path: &Path,
    source: &dyn FrameSource,
    indices: &[usize],
) -> Result<Vec<PositionFix>, InputError> {
    let text = read_text(path)?;
    let mut times: Vec<(f64, usize)> =
        indices.iter().map(|&index| (source.time_s(index), index)).collect();
    times.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut found = Vec::new();
    let mut rows = 0;
    for (line, numbers) in number_rows(&text) {
        let row = numbers.as_deref().and_then(fix_of).ok_or_else(|| {
            FormatError::content(
                path,
                format!("line {line} is no position"),
                "Give rows of time (s), x, y, z (m, in the first camera's axes) and the standard \
                 deviation, one for all axes or three",
            )
        })?;
        rows += 1;
        found.extend(nearest(&times, row.0).map(|frame| PositionFix { frame, ..row.1 }));
    }
    if found.is_empty() {
        return Err(InputError::Table {
            path: path.to_path_buf(),
            reason: format!("none of its {rows} positions is within {NEAR_S} s of a frame"),
            action: "Give times in seconds on the clock of the frames, as in the recording".into(),
        });
    }
    found.sort_by_key(|fix| fix.frame);
    found.dedup_by_key(|fix| fix.frame);
    Ok(found)
}

/// Time and position of a row.
fn fix_of(numbers: &[f64]) -> Option<(f64, PositionFix)> {
    let (&[time_s, x, y, z], sigmas) = numbers.split_first_chunk()?;
    let sigma_m = match *sigmas {
        [all] => [all; 3],
        [x, y, z] => [x, y, z],
        _ => return None,
    };
    let is_error = sigma_m.iter().all(|sigma| *sigma > 0.0 && sigma.is_finite());
    is_error.then_some((time_s, PositionFix { frame: 0, position_m: [x, y, z], sigma_m }))
}

/// Frame of the time nearest to another one.
fn nearest(times: &[(f64, usize)], time_s: f64) -> Option<usize> {
    let after = times.partition_point(|(time, _)| *time < time_s);
    let near = times[after.saturating_sub(1)..].iter().take(2);
    let off = |(time, _): &&(f64, usize)| (time - time_s).abs();
    near.min_by(|a, b| off(a).total_cmp(&off(b)))
        .filter(|near| off(near) <= NEAR_S)
        .map(|(_, index)| *index)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::StreetFrames;
    use crate::synth::StreetConfig;

    fn street() -> StreetFrames {
        StreetFrames::new(StreetConfig::static_street()).unwrap()
    }

    fn read(text: &str) -> Result<Vec<PositionFix>, InputError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_position_fixes(file.path(), &street(), &[2, 3, 4])
    }

    #[test]
    fn positions_go_to_the_frames_of_their_times() {
        let [two, three, four] = [2, 3, 4].map(|frame| street().time_s(frame));
        let text = format!(
            "time_s,x_m,y_m,z_m,sigma_m\n{four},0.1,0,3,0.05\n{},0,0,2,0.1,0.2,0.1\n{},9,9,9,1\n",
            three + 0.01,
            two - 0.05
        );
        let fixes = read(&text).unwrap();
        assert_eq!(fixes.iter().map(|fix| fix.frame).collect::<Vec<_>>(), [3, 4]);
        assert_eq!(fixes[0].sigma_m, [0.1, 0.2, 0.1]);
        assert_eq!((fixes[1].position_m, fixes[1].sigma_m), ([0.1, 0.0, 3.0], [0.05; 3]));
    }

    #[test]
    fn what_is_no_position_is_named() {
        for (text, words) in [
            ("0.2 1 2 3\n", "line 1 is no position"),
            ("0.2 1 2 3 0.1\n0.3 1 2 3 0\n", "line 2 is no position"),
            ("0.2 1 2 3 0.1\n0.3 1 2 three 0.1\n", "line 2 is no position"),
            ("1000 1 2 3 0.1\n", "none of its 1 positions"),
            ("", "none of its 0 positions"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text:?}: {error}");
        }
    }
}
