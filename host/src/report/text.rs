//! Numbers and sentences that console and page share.

use crate::evaluate::masks::{FOUND_IOU, MovingFigures, RangeFigures};
use crate::evaluate::objects::{LateStates, Medians, SETTLING_FRAMES};
use crate::run::RunRecord;

/// Bytes of a MiB.
pub const MIB: f64 = 1_048_576.0;

/// 1234567 as 1,234,567.
pub fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// `1 thread`, `2 threads`.
pub fn counted(count: usize, name: &str) -> String {
    if count == 1 { format!("1 {name}") } else { format!("{count} {name}s") }
}

/// Writes how many tracks had the right motion state in time.
pub fn states_in_time(of: &LateStates) -> String {
    format!(
        "motion state correct within {SETTLING_FRAMES} frames: {} of {} tracks",
        of.tracks - of.late,
        of.tracks
    )
}

/// Median error of a frame's motion; `None` without one.
pub fn motion_error(of: &Medians) -> Option<String> {
    Some(format!("{:.1} cm, {:.2} deg", 100.0 * of.t_m?, of.r_deg?))
}

/// Writes how many moving objects were found, and how much of each.
pub fn moving_masks(masks: &MovingFigures) -> String {
    let range = |range: &RangeFigures| {
        let [begin_m, end_m] = range.distance_m;
        format!("{} of {} at {begin_m} to {end_m} m", range.found, range.objects)
    };
    let ranges: Vec<String> = masks.ranges.iter().map(range).collect();
    let mean_iou = masks.mean_iou.map_or_else(String::new, |iou| format!("; mean IoU {iou:.3}"));
    let false_masks = masks.false_masks;
    format!(
        "found with an IoU of {FOUND_IOU} or more: {}{mean_iou}; {false_masks} false masks in {} \
         frames",
        ranges.join(", "),
        masks.frames
    )
}

/// Writes why blocks are lost, and what to do.
pub fn lost_because(run: &RunRecord) -> String {
    match &run.sections.blocks.store.failure {
        Some(failure) => {
            format!("map.blocks could not grow ({failure}). Free disk space, or raise --stream-mib")
        }
        None if run.plan.request.storage.streaming().is_some() => {
            "records of map.blocks could not be read back. Check the disk".to_owned()
        }
        None => "the pool was full. Run without --no-stream, or give more bytes with --memory"
            .to_owned(),
    }
}
