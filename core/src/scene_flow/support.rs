//! Outlier removal: a match without neighbours that move alike is removed.
//!
//! The paper asks for agreement along the edges of a Delaunay triangulation, where four of about
//! six nearest neighbours must agree. Here a match's neighbours are those in the square of cells
//! around it, which grows ring by ring until it holds [`NEIGHBOURS`] or reaches [`RINGS`]; a match
//! is kept when at least `support_min` of them, and at least half of them, agree in disparity and
//! flow. No mesh, bounded work, and where matches stand dense more neighbours than a triangulation
//! has. Flow that a predicted turn explains is left out: in a wide image it differs by more between
//! neighbours than they may.

use crate::slices::clipped;

use super::{
    cells::{Cells, Shape},
    matches::Match,
    turned::TurnFlow,
};

/// Neighbours after which the square stops growing.
const NEIGHBOURS: usize = 8;
/// Largest distance to a neighbour, in cells.
const RINGS: usize = 4;
/// Largest difference of the disparities of neighbours that support each other, px, as in DynSLAM.
const DISPARITY_TOLERANCE_PX: f32 = 5.0;
/// Largest difference of their flow in each direction, px, as in DynSLAM.
const FLOW_TOLERANCE_PX: f32 = 5.0;

/// Values that must agree: disparity and flow in u and v, px. The fourth keeps rows of four.
pub(super) type Motion = [f32; 4];

/// Memory of matches sorted into cells.
pub(super) struct SortedMotions<'a, 's> {
    pub cells: &'a mut Cells<'s>,
    /// Motions in the order of the cells; space for as many as there are matches.
    pub motion: &'a mut [Motion],
}

/// Condition that a match must meet.
#[derive(Clone, Copy)]
pub(super) struct SupportRule<'a> {
    /// Fewest neighbours that must agree; 0 takes every match.
    pub support_min: u8,
    /// Flow that is expected of all matches.
    pub turn: &'a TurnFlow,
}

/// Writes 1 to `supported` for each supported match, else 0.
pub(super) fn support(
    matches: &[Match],
    shape: Shape,
    rule: &SupportRule<'_>,
    SortedMotions { cells, motion }: SortedMotions<'_, '_>,
    supported: &mut [u8],
) {
    let (start, order) = cells.sort(matches, shape);
    // Motions in the order of cells: neighbouring cells of a row are one run.
    for (motion, m) in
        motion.iter_mut().zip(order.iter().filter_map(|&index| matches.get(index as usize)))
    {
        let ([du, dv], [turn_u, turn_v]) = (m.flow_px(), rule.turn.at(m.previous_left));
        *motion = [m.previous_disparity_px(), du - turn_u, dv - turn_v, 0.0];
    }
    let motion = clipped(motion, ..matches.len());
    let neighbours = Neighbours { shape, rule, start, motion };
    for (&index, own) in order.iter().zip(motion) {
        if let (Some(m), Some(supported)) =
            (matches.get(index as usize), supported.get_mut(index as usize))
        {
            *supported = u8::from(neighbours.support(*own, shape.cell(m)));
        }
    }
}

/// Motions of all matches, cell by cell.
struct Neighbours<'a> {
    shape: Shape,
    rule: &'a SupportRule<'a>,
    /// First motion of each cell, and the end of the last.
    start: &'a [u32],
    motion: &'a [Motion],
}

impl Neighbours<'_> {
    /// Tells that enough matches around a cell move like one in it.
    fn support(&self, own: Motion, [column, row]: [usize; 2]) -> bool {
        let &Self { shape, rule, start, motion } = self;
        let needed = usize::from(rule.support_min);
        if needed == 0 {
            return true;
        }
        let (mut neighbours, mut agreeing) = (0, 0);
        // The neighbourhood grows until enough matches lie in it.
        for ring in 1..=RINGS {
            (neighbours, agreeing) = (0, 0);
            let (left, right) =
                (column.saturating_sub(ring), (column + ring).min(shape.columns - 1));
            for row in row.saturating_sub(ring)..=(row + ring).min(shape.rows - 1) {
                let (first, last) = (row * shape.columns + left, row * shape.columns + right);
                let (Some(&from), Some(&to)) = (start.get(first), start.get(last + 1)) else {
                    continue;
                };
                let run = clipped(motion, from as usize..to as usize);
                neighbours += run.len();
                agreeing += run.iter().map(|other| usize::from(agree(own, *other))).sum::<usize>();
            }
            if neighbours > NEIGHBOURS {
                break;
            }
        }
        // The match itself is among its neighbours, and agrees.
        agreeing > needed && 2 * (agreeing - 1) >= neighbours - 1
    }
}

fn agree(a: Motion, b: Motion) -> bool {
    let near = |a: f32, b: f32, tolerance: f32| (a - b < tolerance) & (b - a < tolerance);
    near(a[0], b[0], DISPARITY_TOLERANCE_PX)
        & near(a[1], b[1], FLOW_TOLERANCE_PX)
        & near(a[2], b[2], FLOW_TOLERANCE_PX)
}
