//! Choice of the nearest visible blocks, where a budget of work does not suffice for all.
//!
//! Time: a pass over the visible blocks for each of [`ROUNDS`] bits. Nothing where all fit.

use super::super::{BLOCK_SIDE, BlockCoord, Viewpoint, Volume, VolumeConfig};
use nalgebra::{Point3, Rotation3, Vector3};

/// Bits of a depth in voxels: 3 km of voxels of 5 cm.
const ROUNDS: u32 = 16;

/// Depth of blocks as a camera sees them.
pub(super) struct BlockDepth {
    camera_from_world: Rotation3<f64>,
    camera: Point3<f64>,
    voxel_m: f64,
}

impl BlockDepth {
    pub(super) fn new(config: &VolumeConfig, view: &Viewpoint) -> Self {
        let (camera_from_world, camera) = view.camera_from_world();
        Self { camera_from_world, camera, voxel_m: f64::from(config.voxel_size_m) }
    }

    /// Depth of a block's middle, m.
    pub(super) fn of_block(&self, coord: BlockCoord) -> f64 {
        let half = BLOCK_SIDE as f64 / 2.0;
        let middle_m = Vector3::from(coord.origin().map(|c| (f64::from(c) + half) * self.voxel_m));
        (self.camera_from_world * (middle_m - self.camera.coords)).z
    }
}

/// Blocks that a frame was fused into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FusedBlocks {
    /// Blocks fused.
    pub count: u32,
    /// Visible blocks left out, all of them farther.
    pub deferred: u32,
    /// Greatest depth of a fused block's middle, m; the largest float where none was left out.
    pub within_m: f64,
}

impl Volume<'_> {
    /// The depth within which at most so many of the visible blocks have their middle, m: a whole
    /// number of voxels. The largest float where all of them may be fused, the least where none.
    pub(super) fn nearest_m(&self, view: &Viewpoint, most: usize) -> f64 {
        let slots = self.visible.slots();
        if slots.len() <= most {
            return f64::MAX;
        }
        let depth = BlockDepth::new(&self.config, view);
        let count = |limit_m: f64| {
            let coords = slots.iter().filter_map(|slot| self.blocks.coord(*slot));
            coords.filter(|coord| depth.of_block(*coord) <= limit_m).count()
        };
        let in_m = |voxels: u32| f64::from(voxels) * depth.voxel_m;
        if count(0.0) > most {
            return f64::MIN;
        }
        // Blocks within a depth only grow in number with it: its bits are found from the highest.
        let mut voxels = 0;
        for bit in (0..ROUNDS).rev() {
            let more = voxels | 1 << bit;
            if count(in_m(more)) <= most {
                voxels = more;
            }
        }
        in_m(voxels)
    }
}
