//! Callbacks: evicted and loaded blocks, triangles.

use core::ffi::c_void;
use dynvox_core::view::Triangle;
use dynvox_core::volume::{BlockKey, BlockStore, EvictedBlock, LoadedBlock};

/// An evicted block of 8 x 8 x 8 voxels; x runs fastest, then y, then z. Valid during the call.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxBlock {
    /// Coordinates in the segment's lattice, blocks.
    pub coord: [i16; 3],
    /// Number of the map's segment that the block is of; a segment has a lattice of its own.
    pub segment: u16,
    /// 512 signed distances, 1/32767 of the truncation.
    pub sdf: *const i16,
    /// 512 weights.
    pub weight: *const u8,
    /// 512 reds, greens and blues, plane by plane; null where the map has no colour.
    pub colour: *const u8,
}

/// A block that becomes visible again, all zero, to be filled from the store. Valid during the
/// call.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxLoadedBlock {
    /// Coordinates in the segment's lattice, blocks.
    pub coord: [i16; 3],
    /// Number of the map's segment that the block is of; a segment has a lattice of its own.
    pub segment: u16,
    /// 512 signed distances.
    pub sdf: *mut i16,
    /// 512 weights.
    pub weight: *mut u8,
    /// 512 reds, greens and blues, plane by plane; null where the map has no colour.
    pub colour: *mut u8,
}

/// The caller's store of blocks. Called on the thread of the step, which waits for it; must not
/// call the same mapper, which answers DYNVOX_STATUS_BUSY then.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxStore {
    /// Handed to both functions.
    pub context: *mut c_void,
    /// Stores an evicted block; the last one stored with its segment and coordinates counts. False
    /// when it cannot: the block is lost, and counted. Null: all are lost.
    pub store: Option<extern "C" fn(context: *mut c_void, block: *const DynvoxBlock) -> bool>,
    /// Fills a block; false when none is stored with its segment and coordinates. Null: none is.
    pub load: Option<extern "C" fn(context: *mut c_void, block: *const DynvoxLoadedBlock) -> bool>,
}

impl DynvoxStore {
    pub(crate) const NONE: Self = Self { context: core::ptr::null_mut(), store: None, load: None };
}

impl BlockStore for DynvoxStore {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        let Some(store) = self.store else { return false };
        let block = DynvoxBlock {
            coord: coordinates(block.key),
            segment: block.key.segment.get(),
            sdf: block.sdf.as_ptr(),
            weight: block.weight.as_ptr(),
            colour: block.colour.map_or(core::ptr::null(), |planes| planes.as_ptr().cast()),
        };
        store(self.context, &raw const block)
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        let Some(load) = self.load else { return false };
        let block = DynvoxLoadedBlock {
            coord: coordinates(block.key),
            segment: block.key.segment.get(),
            sdf: block.sdf.as_mut_ptr(),
            weight: block.weight.as_mut_ptr(),
            colour: block.colour.map_or(core::ptr::null_mut(), |planes| planes.as_mut_ptr().cast()),
        };
        load(self.context, &raw const block)
    }
}

fn coordinates(BlockKey { coord, .. }: BlockKey) -> [i16; 3] {
    [coord.x, coord.y, coord.z]
}

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxVertex {
    /// Position in the world of the camera's segment, m.
    pub position_m: [f32; 3],
    /// Red, green, blue.
    pub colour: [u8; 3],
}

/// A triangle of the map's surface, its corners counter-clockwise seen from free space.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxTriangle {
    /// The corners.
    pub vertices: [DynvoxVertex; 3],
}

impl From<Triangle> for DynvoxTriangle {
    fn from(triangle: Triangle) -> Self {
        Self {
            vertices: triangle.vertices.map(|vertex| DynvoxVertex {
                position_m: vertex.position_m,
                colour: vertex.colour,
            }),
        }
    }
}

/// Takes triangles one by one. Must not call the same mapper.
pub type DynvoxTriangleSink =
    Option<extern "C" fn(context: *mut c_void, triangle: *const DynvoxTriangle)>;
