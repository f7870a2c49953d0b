//! Bucketing: the best few matches of each cell, so that egomotion hears the whole picture and not
//! its busiest corner.

use super::{
    cells::{Cells, Shape},
    matches::Match,
};

/// Matches and how good each is.
#[derive(Clone, Copy)]
pub(super) struct Scored<'a> {
    pub matches: &'a [Match],
    /// Larger is better; 0 of a match beyond its end.
    pub score: &'a [f32],
}

/// Writes the positions of the `per_cell` best matches of each cell, cell by cell, best first (of
/// equals the earlier), to `selection` and returns how many those are.
pub(super) fn select(
    Scored { matches, score }: Scored<'_>,
    shape: Shape,
    per_cell: usize,
    cells: &mut Cells<'_>,
    selection: &mut [u32],
) -> usize {
    // Equal cells keep egomotion from following the most textured corner.
    let (start, order) = cells.sort(matches, shape);
    let mut slots = selection.iter_mut();
    let mut selected = 0;
    let score = |index: u32| score.get(index as usize).copied().unwrap_or(0.0);
    // Consecutive starts delimit one cell.
    for (&from, &to) in start.iter().zip(start.iter().skip(1)) {
        let Some(cell) = order.get_mut(from as usize..to as usize) else { continue };
        let mut rest = cell;
        for _ in 0..per_cell {
            let Some((best, others)) = rest.split_first_mut() else { break };
            let Some(slot) = slots.next() else { return selected };
            // Few are wanted of a cell, so each is sought among what is left: no sort, whose depth
            // would depend on the matches.
            for other in &mut *others {
                // A total order, even if a score were not a number; of equals the earlier match
                // comes first.
                if score(*other).total_cmp(&score(*best)).reverse().then((*other).cmp(best)).is_lt()
                {
                    core::mem::swap(other, best);
                }
            }
            *slot = *best;
            selected += 1;
            rest = others;
        }
    }
    selected
}
