//! What the sparse pass teaches the dense one: how far each side of a circle leads, for each bin of [`BIN_PX`].
//!
//! A bin takes the extremes over the supported sparse matches in it and in the eight bins around it, widened by [`SLACK_PX`] on
//! each side (so at least 20 px wide) and never beyond the configured radius. A bin without any searches the whole radius.
//!
//! Memory: 32 bytes per bin.

use super::{SceneFlowConfig, circle::Reach, matches::Match};
use crate::memory::Capacity;

/// Side of a bin, px.
pub(super) const BIN_PX: usize = 50;
const SLACK_PX: i16 = 10;
/// No match yet: smallest above largest.
const EMPTY: [i16; 4] = [i16::MAX, i16::MIN, i16::MAX, i16::MIN];

/// Bins of the largest image.
pub(super) const fn bins(capacity: &Capacity) -> usize {
    capacity.image_width.div_ceil(BIN_PX) * capacity.image_height.div_ceil(BIN_PX)
}

/// Fills the bins of an image of that size. Returns the bins in a row.
pub(super) fn learn(
    matches: impl Iterator<Item = Match>,
    width: usize,
    height: usize,
    config: &SceneFlowConfig,
    bins: &mut [Reach],
) -> usize {
    let (columns, rows) = (width.div_ceil(BIN_PX), height.div_ceil(BIN_PX));
    let nothing = Reach { to_previous_right: EMPTY, to_current_right: EMPTY, to_current_left: EMPTY, to_previous_left: EMPTY };
    bins.fill(nothing);
    for m in matches {
        let (column, row) = (m.previous_left[0] as usize / BIN_PX, m.previous_left[1] as usize / BIN_PX);
        let last_column = if column + 1 < columns { column + 1 } else { column };
        let last_row = if row + 1 < rows { row + 1 } else { row };
        for row in row.saturating_sub(1)..=last_row {
            for bin in bins.get_mut(row * columns + column.saturating_sub(1)..=row * columns + last_column).unwrap_or(&mut []) {
                extend(&mut bin.to_previous_right, m.previous_left, m.previous_right);
                extend(&mut bin.to_current_right, m.previous_right, m.current_right);
                extend(&mut bin.to_current_left, m.current_right, m.current_left);
                extend(&mut bin.to_previous_left, m.current_left, m.previous_left);
            }
        }
    }
    let widest = Reach::widest(config);
    for bin in bins {
        widen(&mut bin.to_previous_right, widest.to_previous_right);
        widen(&mut bin.to_current_right, widest.to_current_right);
        widen(&mut bin.to_current_left, widest.to_current_left);
        widen(&mut bin.to_previous_left, widest.to_previous_left);
    }
    columns
}

fn extend(side: &mut [i16; 4], from: [f32; 2], to: [f32; 2]) {
    let (du, dv) = ((to[0] - from[0]) as i16, (to[1] - from[1]) as i16);
    *side = [side[0].min(du), side[1].max(du), side[2].min(dv), side[3].max(dv)];
}

fn widen(side: &mut [i16; 4], widest: [i16; 4]) {
    *side = if side[0] > side[1] {
        widest
    } else {
        [
            widest[0].max(side[0] - SLACK_PX),
            widest[1].min(side[1] + SLACK_PX),
            widest[2].max(side[2] - SLACK_PX),
            widest[3].min(side[3] + SLACK_PX),
        ]
    };
}
