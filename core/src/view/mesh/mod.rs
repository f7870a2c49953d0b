//! The map as triangles, handed out one by one: marching cubes (Lorensen, Cline, 1987) with a table
//! that cannot crack.
//!
//! A cell spans eight neighbouring lattice points. A cell with a corner that was never observed
//! gives nothing: the mesh ends where knowledge ends. A lattice point with a distance of 0 or below
//! lies inside. A vertex lies on the edge between an inside and an outside point, where the
//! distance between them is 0 if it runs straight; it is computed from the edge alone, always from
//! the lower point to the upper, so that all cells and blocks around an edge give the same bits.
//! Triangles with two equal corners, as distances of exactly 0 make them, are left out: their other
//! two sides coincide, so no crack opens.
//!
//! Memory: none of the slab; about 3 KiB of stack, and 512 names of the sink. Time: linear in live
//! blocks; triangles cost extra. Order: blocks by slot, cells by z, y, x, triangles by table,
//! vertices by the first triangle that has them.

mod cases;
mod closed;
mod config;
mod covered;
mod names;
mod sink;
#[cfg(test)]
mod tests;

pub use config::MeshConfig;
pub use sink::{MeshSink, Triangle, Vertex};

use crate::volume::{BLOCK_SIDE, BlockCoord, BlockKey, Blocks, Slot, Volume};
use cases::CASES;
use covered::{Covers, NotCovered};
use names::{CellEdge, VertexNames};

/// Lattice points along a block's side, with those of the next block that its last cells need.
const SIDE: usize = BLOCK_SIDE + 1;
/// Marks a lattice point that was not seen often enough. Fusion keeps within ±32,767.
const UNSEEN: i16 = i16::MIN;

impl Volume<'_> {
    /// Hands every triangle of the current segment to `sink` and returns how many there were.
    pub fn triangles(&self, config: &MeshConfig, sink: &mut impl FnMut(Triangle)) -> u64 {
        self.mesh(config, |key| key.segment == self.segment(), sink)
    }

    /// Hands the surface in the blocks that `is_selected` picks to `sink` and returns how many
    /// triangles it has; the other blocks only lend their points. So a map can be drawn piece by
    /// piece: a block's triangles need the blocks after it on each axis, and no more. Positions are
    /// in the frame of a block's segment.
    pub fn mesh(
        &self,
        config: &MeshConfig,
        is_selected: impl Fn(BlockKey) -> bool,
        sink: &mut impl MeshSink,
    ) -> u64 {
        let (mut count, mut names) = (0, VertexNames::new());
        // In the order of the pool, which is the same on every machine.
        for slot in self.pool().live() {
            if let Some(key) = self.blocks().key(slot).filter(|&key| is_selected(key)) {
                // The block and its seven neighbours on the far sides.
                let beside = |offset| self.find_key(key.offset(offset)?);
                let patch = Patch::load(self, slot, key.coord, beside);
                count += patch.draw(config, &mut names, &NotCovered, sink);
            }
        }
        count
    }
}

/// A block and the first layer of the blocks after it on each axis.
struct Patch<'v, 's> {
    blocks: &'v Blocks<'s>,
    /// Slots of the block (0) and of those after it in x (1), y (2), z (4) and combinations.
    slots: [Option<Slot>; 8],
    origin: [i32; 3],
    voxel_size_m: f32,
    /// Distances by `x + 9 y + 81 z`.
    sdf: [i16; SIDE * SIDE * SIDE],
}

/// Distance and weight at a lattice point.
struct LatticePoint {
    sdf: f32,
    weight: u8,
    /// If it has one.
    colour: Option<[u8; 3]>,
}

impl<'v, 's> Patch<'v, 's> {
    /// The patch of a block; `beside` tells the block so many blocks away, into which cubes reach
    /// by a voxel.
    fn load(
        volume: &'v Volume<'s>,
        slot: Slot,
        coord: BlockCoord,
        beside: impl Fn([i32; 3]) -> Option<Slot>,
    ) -> Self {
        let mut slots = [None; 8];
        for (n, entry) in (0i32..).zip(&mut slots) {
            *entry = if n == 0 { Some(slot) } else { beside([n & 1, n >> 1 & 1, n >> 2]) };
        }
        Self {
            blocks: volume.blocks(),
            slots,
            origin: coord.origin(),
            voxel_size_m: volume.config().voxel_size_m,
            sdf: [UNSEEN; SIDE * SIDE * SIDE],
        }
    }

    /// Hands the triangles that nothing covers to `sink` and returns their number.
    fn draw<S: MeshSink>(
        mut self,
        config: &MeshConfig,
        names: &mut VertexNames<S::Name>,
        covers: &impl Covers,
        sink: &mut S,
    ) -> u64 {
        // Voxels never observed have weight 0 and are no surface, also where any weight will do.
        let min_weight = if config.min_weight == 0 { 1 } else { config.min_weight };
        (0..8).for_each(|n| self.copy(n, min_weight));
        names.clear();
        let mut count = 0;
        self.cells(|cell, inside| {
            let triangles = CellTriangles { patch: &self, cell, inside, covers };
            count += triangles.polygonise(names, sink);
        });
        count
    }

    /// Copies what belongs to the patch from block `n` of `slots`.
    fn copy(&mut self, n: usize, min_weight: u8) {
        let Some(slot) = self.slots.get(n).copied().flatten() else { return };
        let (Some(sdf), Some(weight)) = (self.blocks.sdf(slot), self.blocks.weight(slot)) else {
            return;
        };
        // Bit by bit, n says on which axes the block lies after the patch's own; of such a block
        // only the first points are needed.
        let span = |axis: usize| if n >> axis & 1 == 1 { BLOCK_SIDE..SIDE } else { 0..BLOCK_SIDE };
        let columns = span(0);
        for z in span(2) {
            for y in span(1) {
                let from =
                    (y % BLOCK_SIDE) * BLOCK_SIDE + (z % BLOCK_SIDE) * BLOCK_SIDE * BLOCK_SIDE;
                let to = (y + z * SIDE) * SIDE;
                let Some(to) = self.sdf.get_mut(to + columns.start..to + columns.end) else {
                    return;
                };
                let (Some(sdf), Some(weight)) =
                    (sdf.get(from..from + to.len()), weight.get(from..from + to.len()))
                else {
                    return;
                };
                for ((to, &sdf), &weight) in to.iter_mut().zip(sdf).zip(weight) {
                    *to = if weight >= min_weight { sdf } else { UNSEEN };
                }
            }
        }
    }

    /// Visits the cells the surface runs through: their base and the bits of their inside corners.
    #[expect(
        clippy::indexing_slicing,
        reason = "y and z stay below 8, so the rows beside them below 81"
    )]
    fn cells(&self, mut visit: impl FnMut([usize; 3], usize)) {
        // Bit x of a row: the point was seen; it lies inside.
        let mut observed = [0u16; SIDE * SIDE];
        let mut inside = [0u16; SIDE * SIDE];
        for ((row, observed), inside) in
            self.sdf.as_chunks::<SIDE>().0.iter().zip(&mut observed).zip(&mut inside)
        {
            for (x, &sdf) in row.iter().enumerate() {
                *observed |= u16::from(sdf != UNSEEN) << x;
                *inside |= u16::from(sdf <= 0) << x;
            }
        }
        // Four rows of bits give the corners of a row of cells.
        for z in 0..BLOCK_SIDE {
            for y in 0..BLOCK_SIDE {
                let row = y + z * SIDE;
                let four = |bits: &[u16; SIDE * SIDE]| {
                    [bits[row], bits[row + 1], bits[row + SIDE], bits[row + SIDE + 1]]
                };
                let rows = four(&inside);
                let all_observed = four(&observed).iter().fold(u16::MAX, |all, bits| all & bits);
                let any = rows.iter().fold(0, |any, bits| any | bits);
                let all = rows.iter().fold(u16::MAX, |all, bits| all & bits);
                // Cells with all corners observed, and corners on both sides of the surface.
                let mut crossed =
                    all_observed & all_observed >> 1 & (any | any >> 1) & !(all & all >> 1) & 0xFF;
                while crossed != 0 {
                    let x = crossed.trailing_zeros() as usize;
                    crossed &= crossed - 1;
                    let corners = (0usize..)
                        .step_by(2)
                        .zip(rows)
                        .fold(0, |corners, (at, bits)| corners | usize::from(bits >> x & 3) << at);
                    visit([x, y, z], corners);
                }
            }
        }
    }

    /// The vertex on an edge.
    fn vertex(&self, edge: CellEdge) -> Vertex {
        let [low, high] = edge.ends().map(|point| self.point(point));
        // One is above 0 and the other is not, so they differ.
        let share = low.sdf / (low.sdf - high.sdf);
        let mut position = [0.0; 3];
        for ((position, origin), low) in position.iter_mut().zip(self.origin).zip(edge.low) {
            *position = (origin + low as i32) as f32;
        }
        if let Some(along) = position.get_mut(edge.axis) {
            *along += share;
        }
        Vertex {
            position_m: position.map(|c| self.voxel_size_m * c),
            colour: mix(low.colour, high.colour, share),
            weight: if share < 0.5 { low.weight } else { high.weight },
        }
    }

    /// Returns true if the surface meets an edge at one of its ends, where other edges have the
    /// same vertex.
    fn is_on_point(&self, edge: CellEdge) -> bool {
        edge.ends().iter().any(|point| self.sdf(*point) == 0)
    }

    /// The distance at a point of the patch.
    fn sdf(&self, [x, y, z]: [usize; 3]) -> i16 {
        // Cells lie below 8, so their corners within the 9 points a side.
        self.sdf.get(x + SIDE * (y + SIDE * z)).copied().unwrap_or(0)
    }

    /// Returns distance and weight at a point of the patch.
    // Never inlined: both ends of an edge ask for it, and two copies are 256 bytes of a Cortex-M7's
    // code.
    #[inline(never)]
    #[expect(clippy::indexing_slicing, reason = "voxels are below 512")]
    fn point(&self, at: [usize; 3]) -> LatticePoint {
        let sdf = self.sdf(at).into();
        // The lattice reaches one point into each neighbour.
        let [x, y, z] = at.map(|along| along / BLOCK_SIDE);
        let Some(slot) = self.slots.get(x + 2 * y + 4 * z).copied().flatten() else {
            return LatticePoint { sdf, weight: 0, colour: None };
        };
        let [x, y, z] = at.map(|along| along % BLOCK_SIDE);
        let voxel = x + BLOCK_SIDE * (y + BLOCK_SIDE * z);
        LatticePoint {
            sdf,
            weight: self.blocks.weight(slot).map_or(0, |weight| weight[voxel]),
            colour: self
                .blocks
                .colour(slot)
                .map(|planes| planes.each_ref().map(|plane| plane[voxel]))
                .filter(|colour| *colour != [0; 3]),
        }
    }
}

/// A cell that the surface runs through.
struct CellTriangles<'p, 'v, 's, C> {
    patch: &'p Patch<'v, 's>,
    cell: [usize; 3],
    /// Bits of its inside corners.
    inside: usize,
    covers: &'p C,
}

impl<C: Covers> CellTriangles<'_, '_, '_, C> {
    /// Hands the triangles of a cell to `sink` and returns their number.
    #[expect(clippy::indexing_slicing, reason = "masks keep edges below 16 and cases below 256")]
    fn polygonise<S: MeshSink>(&self, names: &mut VertexNames<S::Name>, sink: &mut S) -> u64 {
        let (patch, cell) = (self.patch, self.cell);
        let case = &CASES[self.inside & 0xFF];
        // As many as an edge's four bits can say.
        let mut vertices = [Vertex::default(); 16];
        // Vertices first: triangles of a cell share them.
        let mut left = case.edges;
        while left != 0 {
            let edge = left.trailing_zeros() as usize;
            left &= left - 1;
            vertices[edge & 15] = patch.vertex(CellEdge::new(cell, edge));
        }
        let mut count = 0;
        for edges in
            case.triangles.iter().take(case.count.into()).map(|edges| edges.map(usize::from))
        {
            // A triangle whose corners coincide has no area and is left out.
            let triangle = Triangle { vertices: edges.map(|edge| vertices[edge & 15]) };
            let [a, b, c] = triangle.vertices.map(|vertex| vertex.position_m);
            if a != b && b != c && c != a && !self.covers.covers(&triangle) {
                let names = edges.map(|edge| {
                    let (vertex, edge) = (&vertices[edge & 15], CellEdge::new(cell, edge));
                    names.name(edge, || {
                        sink.vertex(vertex, edge.is_at_border() || patch.is_on_point(edge))
                    })
                });
                sink.triangle(&triangle, names);
                count += 1;
            }
        }
        count
    }
}

/// The colour `share` of the way from `low` to `high`; where one has none, the other's.
fn mix(low: Option<[u8; 3]>, high: Option<[u8; 3]>, share: f32) -> [u8; 3] {
    let (Some(low), Some(high)) = (low, high) else { return low.or(high).unwrap_or_default() };
    let mut colour = [0; 3];
    for ((colour, low), high) in colour.iter_mut().zip(low).zip(high) {
        let (low, high) = (f32::from(low), f32::from(high));
        *colour = (low + (high - low) * share + 0.5) as u8;
    }
    colour
}
