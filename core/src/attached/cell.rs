//! Matches in one cell, over the frames.

use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};

/// Frames in which a cell stayed, after which it is attached.
pub(super) const EARNED: i8 = 20;
/// Frames in which a cell stayed, after which its matches that stay say nothing of the camera.
const DOUBTED: i8 = 4;
/// Score below which a cell is let go.
const LOST: i8 = 8;
/// Bounds of the score: what was seen longer ago does not count.
const MOST: i8 = 36;
const LEAST: i8 = -12;
/// Weight of a frame in which something in the cell moves.
const MOVED: i8 = 2;
/// Weight of a frame in which an attached cell's pixels change.
const CHANGED: i8 = 4;
/// Largest change of the cell's disparity since its score began, in 1/16 px.
const DRIFT_Q4: u16 = 8;

/// Counts of a frame's matches in a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct MatchCounts {
    /// Sum of the disparities of those that stay, 1/16 px.
    disparity_q4: u32,
    still: u16,
    moved: u16,
}

impl MatchCounts {
    /// Adds a match that stays in place.
    pub fn add_still(&mut self, disparity_px: f32) {
        // The cast holds at the ends.
        self.disparity_q4 = self.disparity_q4.saturating_add((16.0 * disparity_px) as u32);
        self.still = self.still.saturating_add(1);
    }

    /// Adds a match that moves.
    pub fn add_moved(&mut self) {
        self.moved = self.moved.saturating_add(1);
    }

    /// Tells that there is no match.
    pub fn is_empty(&self) -> bool {
        self.still == 0 && self.moved == 0
    }
}

/// One cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Cell {
    /// Frames in which it stayed, less those in which it did not.
    score: i8,
    /// 1 if it is attached, 0 if not.
    attached: u8,
    /// Mean disparity of its matches when the score began, 1/16 px.
    disparity_q4: u16,
}

impl Cell {
    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { score, attached, disparity_q4 } = self;
        let [mut a, mut b] = [*score as u8, *attached];
        visitor.u8(&mut a);
        visitor.u8(&mut b);
        (*score, *attached) = (a as i8, b);
        visitor.u16s(core::slice::from_mut(disparity_q4));
    }

    /// Takes a frame's matches. A little of a cell at the border of a bonnet may move.
    pub fn count(&mut self, counts: &MatchCounts) {
        if counts.moved > 0 && counts.moved >= counts.still {
            self.add(-MOVED);
        } else if counts.still > 0 && 2 * counts.moved <= counts.still {
            let disparity_q4 = (counts.disparity_q4 / u32::from(counts.still)) as u16;
            // A vehicle ahead comes nearer or falls back; a part of the camera does neither.
            if self.score <= 0 || self.disparity_q4.abs_diff(disparity_q4) > DRIFT_Q4 {
                (self.disparity_q4, self.score) = (disparity_q4, 0);
            }
            self.add(1);
        }
    }

    /// Counts a frame in which an attached cell's pixels were compared.
    pub fn count_change(&mut self, is_changed: bool) {
        self.add(if is_changed { -CHANGED } else { 1 });
    }

    fn add(&mut self, frames: i8) {
        self.score = self.score.saturating_add(frames).clamp(LEAST, MOST);
    }

    /// Tells that the cell has stayed for half of the frames it takes.
    pub fn stays(&self) -> bool {
        self.score >= EARNED / 2
    }

    /// Tells that the cell has stayed for so long that it may be attached.
    pub fn is_doubted(&self) -> bool {
        self.score >= DOUBTED
    }

    pub fn is_attached(&self) -> bool {
        self.attached != 0
    }

    /// Attaches a cell that earned it and is not alone, and lets go of one that lost it.
    pub fn decide(&mut self, has_neighbours: bool) {
        if self.score >= EARNED && has_neighbours {
            self.attached = 1;
        } else if self.score < LOST {
            self.attached = 0;
        }
    }

    /// Attaches a hole, as long as nothing in it moves.
    pub fn fill_hole(&mut self) {
        if self.score >= 0 && self.attached == 0 {
            (self.attached, self.score) = (1, EARNED);
        }
    }
}
