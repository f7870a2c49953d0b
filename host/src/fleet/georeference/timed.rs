//! Fixes at times of the receiver, joined with the camera's path.
//!
//! A receiver tells a position a second, or ten; a camera has more frames. So the path is taken at
//! the times of the fixes, between the two frames around each.

use super::Observation;
use crate::fleet::free_space::CameraPose;
use crate::formats::{LocalPlane, TimedFix};

/// Longest time between two frames that the path is taken between, s.
const GAP_MAX_S: f64 = 0.5;

/// The camera and the antenna at each fix that lies between two frames.
///
/// # Errors
/// Frames have no times, or times that no fix has.
pub fn observations(
    cameras: &[CameraPose],
    fixes: &[TimedFix],
    plane: &LocalPlane,
) -> Result<Vec<Observation>, String> {
    let timed: Option<Vec<(f64, &CameraPose)>> =
        cameras.iter().map(|camera| Some((camera.time_s?, camera))).collect();
    let timed = timed.filter(|timed| timed.is_sorted_by(|a, b| a.0 < b.0)).ok_or(
        "NMEA is joined with frames by their times, which its frames lack. Map it anew, or write \
         the fixes with a line for each frame",
    )?;
    let observed = |timed_fix: &TimedFix| {
        let after = timed.partition_point(|(time_s, _)| *time_s < timed_fix.time_s);
        let (to_s, to) = timed.get(after)?;
        let (from_s, from) = timed.get(after.saturating_sub(1))?;
        let gap_s = to_s - from_s;
        // The first frame has none before it, but may have the fix's time.
        let share = if gap_s > 0.0 { (timed_fix.time_s - from_s) / gap_s } else { 0.0 };
        if gap_s > GAP_MAX_S || (after == 0 && timed_fix.time_s < *to_s) {
            return None;
        }
        let [from, to] = [from, to].map(|camera| camera.t_map_camera);
        // Directions change little between two frames: the nearer one's is taken.
        let mut t_map_camera = if share < 0.5 { from } else { to };
        for axis in 0..3 {
            let way_m = to.translation_m[axis] - from.translation_m[axis];
            t_map_camera.translation_m[axis] = from.translation_m[axis] + share * way_m;
        }
        Some(Observation::of(&t_map_camera, &timed_fix.fix, plane))
    };
    let found: Vec<Observation> = fixes.iter().filter_map(observed).collect();
    if found.is_empty() {
        let range = |first: Option<f64>, last: Option<f64>| {
            format!("{:.0} to {:.0} s", first.unwrap_or(0.0), last.unwrap_or(0.0))
        };
        let of_frames =
            range(timed.first().map(|timed| timed.0), timed.last().map(|timed| timed.0));
        let of_fixes = range(fixes.first().map(|of| of.time_s), fixes.last().map(|of| of.time_s));
        return Err(format!(
            "no fix lies between two frames: fixes are of {of_fixes}, frames of {of_frames}, since \
             1970 in UTC. Give frames the time of a clock that the receiver sets, or write the \
             fixes with a line for each frame"
        ));
    }
    Ok(found)
}
