//! What a mapper hands to its caller piece by piece.

use core::ffi::c_void;
use dynvox_core::view::Triangle;
use dynvox_core::volume::{BlockStore, LeavingBlock, ReturningBlock};

/// A block of 8 x 8 x 8 voxels that leaves the map; x runs fastest, then y, then z. For the length of the call alone.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxBlock {
    /// Its place, blocks.
    pub coord: [i16; 3],
    /// 512 signed distances, 1/32767 of the truncation.
    pub sdf: *const i16,
    /// 512 weights.
    pub weight: *const u8,
    /// 512 reds, greens and blues, plane by plane; null where the map has no colour.
    pub colour: *const u8,
}

/// A block that is made again, to be filled in with what was kept of it. All zero as it comes. For the length of the call alone.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxReturningBlock {
    /// Its place, blocks.
    pub coord: [i16; 3],
    /// 512 signed distances.
    pub sdf: *mut i16,
    /// 512 weights.
    pub weight: *mut u8,
    /// 512 reds, greens and blues, plane by plane; null where the map has no colour.
    pub colour: *mut u8,
}

/// The caller's memory for blocks. Called on the thread of the step, which waits for it; must not call the same mapper, which answers
/// DYNVOX_STATUS_BUSY then.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxStore {
    /// Handed to both functions.
    pub context: *mut c_void,
    /// Keeps a block that leaves; keeping it again replaces what was kept. False when it cannot: then it is lost, and counted. Null: all are.
    pub keep: Option<extern "C" fn(context: *mut c_void, block: *const DynvoxBlock) -> bool>,
    /// Fills in a block that is made again; false when nothing was kept of it. Null: nothing ever was.
    pub bring_back: Option<extern "C" fn(context: *mut c_void, block: *const DynvoxReturningBlock) -> bool>,
}

impl DynvoxStore {
    pub(crate) const NONE: Self = Self { context: core::ptr::null_mut(), keep: None, bring_back: None };
}

impl BlockStore for DynvoxStore {
    fn keep(&mut self, block: LeavingBlock<'_>) -> bool {
        let Some(keep) = self.keep else { return false };
        let block = DynvoxBlock {
            coord: [block.coord.x, block.coord.y, block.coord.z],
            sdf: block.sdf.as_ptr(),
            weight: block.weight.as_ptr(),
            colour: block.colour.map_or(core::ptr::null(), |planes| planes.as_ptr().cast()),
        };
        keep(self.context, &raw const block)
    }

    fn bring_back(&mut self, block: ReturningBlock<'_>) -> bool {
        let Some(bring_back) = self.bring_back else { return false };
        let block = DynvoxReturningBlock {
            coord: [block.coord.x, block.coord.y, block.coord.z],
            sdf: block.sdf.as_mut_ptr(),
            weight: block.weight.as_mut_ptr(),
            colour: block.colour.map_or(core::ptr::null_mut(), |planes| planes.as_mut_ptr().cast()),
        };
        bring_back(self.context, &raw const block)
    }
}

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxVertex {
    /// Place in the world, m.
    pub position_m: [f32; 3],
    /// Red, green, blue.
    pub colour: [u8; 3],
}

/// A piece of the map's surface, its corners counter-clockwise seen from free space.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxTriangle {
    /// The corners.
    pub vertices: [DynvoxVertex; 3],
}

impl From<Triangle> for DynvoxTriangle {
    fn from(triangle: Triangle) -> Self {
        Self {
            vertices: triangle.vertices.map(|vertex| DynvoxVertex { position_m: vertex.position_m, colour: vertex.colour }),
        }
    }
}

/// Takes triangles one by one. Must not call the same mapper.
pub type DynvoxTriangleSink = Option<extern "C" fn(context: *mut c_void, triangle: *const DynvoxTriangle)>;
