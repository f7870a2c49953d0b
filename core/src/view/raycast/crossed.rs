//! The cells that the surface runs through, with what the map has at their corners.

use super::{
    cell::{Corners, Faces},
    cell_index::{CellId, CellIndex, Point},
    colour::{self, Colours},
    ray_camera::AXES,
    surface::Surface,
};
use crate::volume::{BLOCK_SIDE, BLOCK_VOXELS, Blocks, Slot};

/// Reads the cells in view.
#[derive(Clone, Copy)]
pub(super) struct CrossedCells<'a, 's> {
    pub surface: &'a Surface<'s>,
    pub blocks: &'a Blocks<'s>,
    /// The camera, in local lattice units.
    pub origin: [f32; 3],
    pub min_weight: u8,
}

/// A cell and where its corners are.
#[derive(Clone, Copy)]
pub(super) struct CrossedCell<'a> {
    /// Block of the cell, relative to the camera's.
    pub block: [i32; 3],
    /// The slots of its block and of those after it.
    pub slots: &'a [Slot; 8],
    pub at: CellIndex,
    /// True if all corners were observed.
    pub fully_observed: bool,
}

impl<'a> CrossedCells<'a, '_> {
    /// The cell of an id.
    #[inline]
    pub fn get(&self, CellId(id): CellId) -> Option<CrossedCell<'a>> {
        let (entry, at) =
            (id as usize / BLOCK_VOXELS, CellIndex::of_voxel(id % BLOCK_VOXELS as u32));
        let block = self.surface.block(entry)?;
        let (layer, bit) = at.bit();
        let fully_observed = block.cells.get(layer)?.fully_observed >> bit & 1 == 1;
        Some(CrossedCell { block: block.local, slots: block.slots, at, fully_observed })
    }

    /// Returns the distances of a cell's faces.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn faces(&self, cell: &CrossedCell<'_>) -> Faces {
        let mut faces = [[0.0; 3]; 2];
        for axis in AXES {
            let lower = cell.block[axis] * BLOCK_SIDE as i32 + cell.at.coordinate(axis) as i32;
            faces[0][axis] = lower as f32 - self.origin[axis];
            faces[1][axis] = (lower + 1) as f32 - self.origin[axis];
        }
        faces
    }

    /// Distances at the corners of a cell; those that were not seen are on the plane through the
    /// others. `None` where nothing tells that plane.
    #[inline(always)]
    pub fn corners(&self, cell: &CrossedCell<'_>) -> Option<[f32; 8]> {
        if cell.fully_observed && cell.at.is_inner() {
            return Some(cell.at.corner_values(self.blocks.sdf(cell.slots[0])?)?.map(f32::from));
        }
        self.corners_of_several_blocks(cell)
    }

    /// Returns the corners like [`Self::corners`], of cells whose corners are in several blocks or
    /// not all observed.
    #[inline(never)]
    fn corners_of_several_blocks(&self, cell: &CrossedCell<'_>) -> Option<[f32; 8]> {
        let mut corners = Corners::default();
        for (corner, (sdf, point)) in corners.sdf.iter_mut().zip(cell.at.corners()).enumerate() {
            *sdf = self.sdf(cell.slots, point);
            corners.observed |=
                u8::from(cell.fully_observed || self.weight(cell.slots, point) >= self.min_weight)
                    << corner;
        }
        if cell.fully_observed { Some(corners.sdf) } else { corners.complete() }
    }

    /// The distance at a point; 0 where there is no block.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "blocks are below 8 and voxels below 512")]
    fn sdf(&self, slots: &[Slot; 8], point: Point) -> f32 {
        self.blocks.sdf(slots[point.block()]).map_or(0.0, |sdf| f32::from(sdf[point.voxel()]))
    }

    /// Observations at a point; 0 where there is no block.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "blocks are below 8 and voxels below 512")]
    pub fn weight(&self, slots: &[Slot; 8], point: Point) -> u8 {
        self.blocks.weight(slots[point.block()]).map_or(0, |weights| weights[point.voxel()])
    }

    /// The colours at the corners of a cell.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "blocks are below 8 and voxels below 512")]
    pub fn colours(&self, cell: &CrossedCell<'_>) -> Colours {
        let mut colours = Colours::default();
        for (words, point) in colours.as_chunks_mut::<2>().0.iter_mut().zip(cell.at.corners()) {
            if let Some([red, green, blue]) = self.blocks.colour(cell.slots[point.block()]) {
                *words =
                    colour::words([red[point.voxel()], green[point.voxel()], blue[point.voxel()]]);
            }
        }
        colours
    }
}
