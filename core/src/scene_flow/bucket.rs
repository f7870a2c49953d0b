//! Bucketing: the best few matches of each cell, so that egomotion hears the whole picture and not its busiest corner.

use super::{
    cells::{Cells, Shape},
    matches::Match,
};

/// Writes the positions of the `per_cell` best matches of each cell, cell by cell, best first (of equals the earlier), to `selection`
/// and returns how many those are.
pub(super) fn select(
    matches: &[Match],
    score: &[f32],
    shape: Shape,
    per_cell: usize,
    cells: &mut Cells<'_>,
    selection: &mut [u32],
) -> usize {
    let (start, order) = cells.sort(matches, shape);
    let mut slots = selection.iter_mut();
    let mut selected = 0;
    let score = |index: u32| score.get(index as usize).copied().unwrap_or(0.0);
    for (&from, &to) in start.iter().zip(start.iter().skip(1)) {
        let Some(cell) = order.get_mut(from as usize..to as usize) else { continue };
        cell.sort_unstable_by(|&a, &b| score(b).total_cmp(&score(a)).then(a.cmp(&b)));
        for (&index, slot) in cell.iter().take(per_cell).zip(&mut slots) {
            *slot = index;
            selected += 1;
        }
    }
    selected
}
