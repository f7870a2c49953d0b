//! The edges of a block, and the names of their vertices for as long as cells may ask for them.

use super::{
    SIDE,
    cases::{EDGE_START, edge_axis},
};
use crate::volume::BLOCK_SIDE;

/// Entries for the edges that begin in two layers of points: as many as there are, or a few more,
/// so that a mask keeps an index in bounds.
const ENTRIES: usize = (2 * 3 * SIDE * SIDE).next_power_of_two();

/// An edge between two lattice points of a block and of those after it.
#[derive(Clone, Copy)]
pub(super) struct CellEdge {
    /// Lower end: x, y, z, each at most 8.
    pub low: [usize; 3],
    /// Along which axis it runs.
    pub axis: usize,
}

impl CellEdge {
    /// An edge of a cell, by its number.
    pub fn new([x, y, z]: [usize; 3], edge: usize) -> Self {
        let start = EDGE_START.get(edge).copied().unwrap_or(0);
        Self {
            low: [x + (start & 1), y + (start >> 1 & 1), z + (start >> 2)],
            axis: edge_axis(edge),
        }
    }

    /// Returns both ends.
    pub fn ends(self) -> [[usize; 3]; 2] {
        let mut high = self.low;
        if let Some(along) = high.get_mut(self.axis) {
            *along += 1;
        }
        [self.low, high]
    }

    /// Returns the edge's number among those of two layers, below [`ENTRIES`].
    #[inline]
    fn index(self) -> usize {
        let [x, y, z] = self.low;
        (x + SIDE * (y + SIDE * (self.axis + 3 * (z & 1)))) & (ENTRIES - 1)
    }

    /// Returns true if cells of other blocks have the edge too.
    pub fn is_at_border(self) -> bool {
        (0..).zip(self.low).any(|(axis, at)| axis != self.axis && at % BLOCK_SIDE == 0)
    }
}

/// Names of vertices on the edges of two layers of points: a layer of cells has edges that begin in
/// the two around it.
pub(super) struct VertexNames<N> {
    /// The layer in which the edge begins that a name belongs to, plus 1; 0 is none.
    layer: [u8; ENTRIES],
    name: [N; ENTRIES],
}

impl<N: Copy + Default> VertexNames<N> {
    /// No vertex has a name yet.
    pub fn new() -> Self {
        Self { layer: [0; ENTRIES], name: [N::default(); ENTRIES] }
    }

    /// Forgets all: edges are another block's from here on.
    pub fn clear(&mut self) {
        self.layer = [0; ENTRIES];
    }

    /// The name of the vertex on an edge, given where it has none.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "numbers of edges are below ENTRIES")]
    pub fn name(&mut self, edge: CellEdge, give: impl FnOnce() -> N) -> N {
        let (index, layer) = (edge.index(), edge.low[2] as u8 + 1);
        if self.layer[index] != layer {
            (self.layer[index], self.name[index]) = (layer, give());
        }
        self.name[index]
    }
}
