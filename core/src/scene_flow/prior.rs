//! Prior that the sparse pass learns for the dense one: how far each side of a circle leads, for
//! each bin of [`BIN_PX`].
//!
//! A bin takes the extremes over the supported sparse matches in it and in the eight bins around
//! it, widened by [`SLACK_PX`] on each side (so at least 20 px wide) and never beyond the
//! configured radius. A bin without any takes those of the nearest bins that have some to its left,
//! right, top and bottom; where no bin has any, the whole radius is searched.
//!
//! The radius lies around the flow of the turn that an inertial unit predicts, if there is one.
//!
//! Memory: 64 bytes per bin, and 64 bytes.

use super::{SceneFlowConfig, circle::Reach, matches::Match, turned::TurnFlow};
use crate::{
    memory::{Capacity, Carver, region_bytes},
    slices::clipped_mut,
};

/// Side of a bin, px.
const BIN_PX: usize = 50;
const SLACK_PX: i16 = 10;
/// No match yet: smallest above largest.
const EMPTY: [i16; 4] = [i16::MAX, i16::MIN, i16::MAX, i16::MIN];
const NOTHING: Reach = Reach {
    to_previous_right: EMPTY,
    to_current_right: EMPTY,
    to_current_left: EMPTY,
    to_previous_left: EMPTY,
};

/// Bins of the largest image.
const fn bins(capacity: &Capacity) -> usize {
    capacity.image_width.div_ceil(BIN_PX) * capacity.image_height.div_ceil(BIN_PX)
}

/// The bins of an image.
#[derive(Debug)]
pub(super) struct Prior<'s> {
    /// Extremes over matches.
    learned: &'s mut [Reach],
    /// Reach of the search in each bin.
    reach: &'s mut [Reach],
    columns: usize,
    rows: usize,
    /// One item: the flow that is expected of the frame.
    turn: &'s mut [TurnFlow],
}

impl<'s> Prior<'s> {
    pub(super) const fn bytes(capacity: &Capacity) -> usize {
        2 * region_bytes::<Reach>(bins(capacity)) + region_bytes::<TurnFlow>(1)
    }

    pub(super) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            learned: carver.alloc("scene_flow.learned", bins(capacity)),
            reach: carver.alloc("scene_flow.reach", bins(capacity)),
            columns: 0,
            rows: 0,
            turn: carver.alloc("scene_flow.turn", 1),
        }
    }

    /// Sets the flow that is expected of the next frame.
    pub(super) fn expect(&mut self, turn: &TurnFlow) {
        self.turn.fill(*turn);
    }

    /// Returns the flow that is expected of the frame.
    pub(super) fn turn(&self) -> &TurnFlow {
        self.turn.first().unwrap_or(&TurnFlow::NONE)
    }

    /// Returns the widest reach of the search for partners of a previous-left feature.
    pub(super) fn widest(config: &SceneFlowConfig, turn: &TurnFlow, at: [f32; 2]) -> Reach {
        Reach::widest(config).moved_by(turn.at(at))
    }

    /// Returns the reach of the search for partners of a previous-left feature at (u, v).
    pub(super) fn reach(&self, [u, v]: [u16; 2]) -> Option<Reach> {
        self.reach.get(usize::from(v) / BIN_PX * self.columns + usize::from(u) / BIN_PX).copied()
    }

    /// Learns from the supported sparse matches of an image of that size.
    pub(super) fn learn(
        &mut self,
        matches: impl Iterator<Item = Match>,
        width: usize,
        height: usize,
        config: &SceneFlowConfig,
    ) {
        (self.columns, self.rows) = (width.div_ceil(BIN_PX), height.div_ceil(BIN_PX));
        self.learned.fill(NOTHING);
        // A match teaches its own bin and the eight around it.
        for m in matches {
            // Previous left positions are inside the image, so the casts are exact.
            let (column, row) =
                (m.previous_left[0] as usize / BIN_PX, m.previous_left[1] as usize / BIN_PX);
            let last_column = if column + 1 < self.columns { column + 1 } else { column };
            for row in row.saturating_sub(1)..=(row + 1).min(self.rows.saturating_sub(1)) {
                let bins = row * self.columns + column.saturating_sub(1)
                    ..=row * self.columns + last_column;
                for bin in clipped_mut(self.learned, bins) {
                    bin.to_previous_right =
                        extended(bin.to_previous_right, m.previous_left, m.previous_right);
                    bin.to_current_right =
                        extended(bin.to_current_right, m.previous_right, m.current_right);
                    bin.to_current_left =
                        extended(bin.to_current_left, m.current_right, m.current_left);
                    bin.to_previous_left =
                        extended(bin.to_previous_left, m.current_left, m.previous_left);
                }
            }
        }
        // Each bin's reach is widened, and never beyond what the configuration allows.
        for row in 0..self.rows {
            for column in 0..self.columns {
                let near = self.near(column, row);
                let middle = [column, row].map(|bin| (bin * BIN_PX + BIN_PX / 2) as f32);
                let widest = Self::widest(config, self.turn(), middle);
                if let Some(reach) = self.reach.get_mut(row * self.columns + column) {
                    *reach = Reach {
                        to_previous_right: widened(
                            near.to_previous_right,
                            widest.to_previous_right,
                        ),
                        to_current_right: widened(near.to_current_right, widest.to_current_right),
                        to_current_left: widened(near.to_current_left, widest.to_current_left),
                        to_previous_left: widened(near.to_previous_left, widest.to_previous_left),
                    };
                }
            }
        }
    }

    /// Returns the reach that a bin learned itself, or else that of the nearest bins in the four
    /// directions.
    fn near(&self, column: usize, row: usize) -> Reach {
        // A bin without a single match of its own has an empty range.
        let taught = |column: usize, row: usize| {
            self.learned
                .get(row * self.columns + column)
                .copied()
                .filter(|bin| bin.to_previous_right != EMPTY)
        };
        if let Some(own) = taught(column, row) {
            return own;
        }
        let sides = [
            (0..column).rev().find_map(|column| taught(column, row)),
            (column + 1..self.columns).find_map(|column| taught(column, row)),
            (0..row).rev().find_map(|row| taught(column, row)),
            (row + 1..self.rows).find_map(|row| taught(column, row)),
        ];
        // A reach that holds all four: a search too wide only costs time.
        sides.into_iter().flatten().fold(NOTHING, |a, b| Reach {
            to_previous_right: united(a.to_previous_right, b.to_previous_right),
            to_current_right: united(a.to_current_right, b.to_current_right),
            to_current_left: united(a.to_current_left, b.to_current_left),
            to_previous_left: united(a.to_previous_left, b.to_previous_left),
        })
    }
}

fn extended(side: [i16; 4], from: [f32; 2], to: [f32; 2]) -> [i16; 4] {
    let (du, dv) = ((to[0] - from[0]) as i16, (to[1] - from[1]) as i16);
    united(side, [du, du, dv, dv])
}

fn united(a: [i16; 4], b: [i16; 4]) -> [i16; 4] {
    [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]
}

fn widened(side: [i16; 4], widest: [i16; 4]) -> [i16; 4] {
    // Nothing was learned of this side.
    if side == EMPTY {
        return widest;
    }
    // What was learned, with slack, and never beyond the widest.
    [
        widest[0].max(side[0] - SLACK_PX),
        widest[1].min(side[1] + SLACK_PX),
        widest[2].max(side[2] - SLACK_PX),
        widest[3].min(side[3] + SLACK_PX),
    ]
}
