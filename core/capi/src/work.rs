//! Work of a step in units that depend on no clock, and the most of each.

use crate::{
    DynvoxCapacity, DynvoxConfig, DynvoxStatus,
    capacity::given,
    given::{output, read},
};
use dynvox_core::WorkUnits;

/// Units of work by kind: of one step in a report, the most of any step from dynvox_work_bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct DynvoxWork {
    /// Pixels of the rows that are matched densely; none where disparities are given.
    pub stereo_pixels: u64,
    /// Support points looked for, each over the whole range of disparities.
    pub support_candidates: u64,
    /// Triangles of the support points of both images.
    pub triangles: u64,
    /// Features kept in both images.
    pub features: u64,
    /// Descriptors compared with that of a feature.
    pub compared_descriptors: u64,
    /// Circles of matches that closed.
    pub circles: u64,
    /// Pixels of pictures of the map that the step itself takes.
    pub cast_pixels: u64,
    /// Blocks looked up because a ray ran through them.
    pub block_requests: u64,
    /// Blocks that left the pool for others, and blocks loaded from the store.
    pub moved_blocks: u64,
    /// Voxels of the blocks that a frame was fused into.
    pub fused_voxels: u64,
    /// Voxels of the blocks that pruning visited.
    pub pruned_voxels: u64,
}

impl From<WorkUnits> for DynvoxWork {
    fn from(units: WorkUnits) -> Self {
        Self {
            stereo_pixels: units.stereo_pixels,
            support_candidates: units.support_candidates,
            triangles: units.triangles,
            features: units.features,
            compared_descriptors: units.compared_descriptors,
            circles: units.circles,
            cast_pixels: units.cast_pixels,
            block_requests: units.block_requests,
            moved_blocks: units.moved_blocks,
            fused_voxels: units.fused_voxels,
            pruned_voxels: units.pruned_voxels,
        }
    }
}

/// A unit that the core counts and this interface does not would be missing from every report.
const _: () = assert!(size_of::<DynvoxWork>() == WorkUnits::COUNT * size_of::<u64>());

/// Writes the most units of work that any step of such a mapper does on any input.
///
/// # Safety
/// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
/// `bound` is null or points to units of work.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_work_bound(
    capacity: *const DynvoxCapacity,
    config: *const DynvoxConfig,
    bound: *mut DynvoxWork,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let given = unsafe {
        (given(capacity), read(config).and_then(|config| config.resolved()), output(bound))
    };
    match given {
        (Ok(capacity), Ok(config), Ok(bound)) => {
            // SAFETY: checked; of the right type by the caller's promise.
            unsafe { bound.write(capacity.work(&config).into()) };
            DynvoxStatus::Ok
        }
        (Err(status), ..) | (_, Err(status), _) | (_, _, Err(status)) => status,
    }
}
