//! Making the blocks that a depth image runs through, and finding which are visible.
//!
//! Along the ray of every second pixel of every second row, staggered, each block within
//! `allocation_m` of the depth is visited exactly once, farther where the next rays end farther
//! off, by walking the block grid (Amanatides, Woo: *A Fast Voxel Traversal Algorithm for Ray
//! Tracing*, 1987). Near surfaces, whose blocks are many pixels wide, have a quarter or a sixteenth
//! of these rays. Which pixels are taken changes from frame to frame
//! (docs/decisions/0018-allocation-from-every-fourth-pixel.md,
//! 0047-fewer-rays-where-blocks-are-wide.md). A point belongs to the block of its nearest lattice
//! point: a block's lattice points are its centre of mass, so nothing is shifted by half a voxel.
//! Blocks farther from the surface hold none of it
//! (docs/decisions/0046-blocks-near-the-surface.md).
//!
//! Rows are walked in four fixed bands; what they ask for is made band by band, in the order in
//! which it was met.
//!
//! Memory: 128 KiB, half of it a direct-mapped cache of the blocks met, which spares the index most
//! look-ups, half for requests. Time: linear in pixels times blocks per ray, at most
//! [`MAX_BLOCKS_PER_RAY`](super::MAX_BLOCKS_PER_RAY).

use super::{
    BLOCK_SIDE, BlockCoord, BlockKey, BlockStore, EvictionReport, Slot, Viewpoint, Volume,
    request::{Band, Rays},
};
use crate::{
    geometry::Transform,
    image::View,
    parallel::{Executor, each},
};
use nalgebra::Vector3;

/// Counts of one frame's allocation. Requests refused repeat when several rays ask for the same
/// block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct AllocationReport {
    /// Blocks made.
    pub made: u32,
    /// Requests refused because the pool or the index was full.
    pub refused: u32,
    /// Requests refused because they lie beyond 16-bit block coordinates.
    pub beyond: u32,
    /// Visible blocks left out of the list because it was full.
    pub unlisted: u32,
    /// Requests for blocks that rays ran through. A block may be requested more than once.
    pub requests: u32,
    /// Most blocks the index had to compare to find one, or to find it missing.
    pub probes_most: u32,
    /// Blocks evicted for others, and blocks loaded again.
    pub eviction: EvictionReport,
}

impl Volume<'_> {
    /// Makes the blocks around the surface that `depth_m` (0 none) shows from `view`, and lists
    /// what is visible. Blocks that must leave go to `store`, and those it kept come back.
    pub fn allocate<S: BlockStore, E: Executor>(
        &mut self,
        view: &Viewpoint,
        depth_m: View<'_, f32>,
        store: &mut S,
        executor: &E,
    ) -> AllocationReport {
        let mut report = AllocationReport::default();
        self.visible.begin_frame();

        // Block coordinates relative to the camera's block keep their precision however far the
        // camera has come.
        let camera = camera_in_blocks(&view.t_world_camera, self.config.voxel_size_m);
        let Some(base) = base_block(&camera) else {
            // So far from the origin coordinates have no 16 bits: all pixels are beyond the map.
            report.beyond = depth_m.rows().flatten().filter(|&&depth| depth > 0.0).count() as u32;
            return report;
        };
        // Where in its own block the camera stands, in blocks.
        let start = (camera
            - Vector3::new(f64::from(base[0]), f64::from(base[1]), f64::from(base[2])))
        .cast::<f32>();
        let rays = Rays::new(&self.config, view, depth_m, start, self.visible.frame());
        // Out of the volume while its bands ask for blocks.
        let mut requested = core::mem::take(&mut self.requested);
        let mut bands = requested.bands(depth_m.height());
        // Bands fill their lists in parallel; requests are then served one after the other, so that
        // slots do not depend on the threads.
        while !bands.iter().all(Band::is_done) {
            each(executor, bands.each_mut(), |band| rays.walk(band));
            for band in &mut bands {
                report.requests += band.len() as u32;
                band.drain().for_each(|block| self.request(block, base, store, &mut report));
            }
        }
        self.requested = requested;
        self.keep_in_view(view, &mut report);
        self.visible.sort(self.pool.high_water());
        report
    }

    /// Finds or makes the block `base + block` and lists it.
    pub(super) fn request<S: BlockStore>(
        &mut self,
        block: [i32; 3],
        base: [i32; 3],
        store: &mut S,
        report: &mut AllocationReport,
    ) {
        let Some(coord) =
            BlockCoord::new(base[0] + block[0], base[1] + block[1], base[2] + block[2])
        else {
            report.beyond += 1;
            return;
        };
        let key = self.key(coord);
        // Asking again for a block that exists costs one probe.
        let (found, probes) = self.index.probe(key, |slot| self.blocks.key(slot));
        if probes > report.probes_most {
            report.probes_most = probes;
        }
        let slot = match found {
            // The camera came back: by now its pose has another error than then.
            Some(slot) if self.is_left(slot) => match self.replace_left(slot, store, report) {
                Some(made) => made,
                None => slot,
            },
            Some(slot) => slot,
            // A full pool evicts the block unseen for longest, or refuses.
            None => {
                if self.pool.is_full() && !self.evict(store, &mut report.eviction) {
                    report.refused += 1;
                    return;
                }
                let Some(slot) = self.make(key) else {
                    report.refused += 1;
                    return;
                };
                report.made += 1;
                report.eviction.loaded += u32::from(self.load_into(slot, key, store));
                slot
            }
        };
        self.list(slot, report);
    }

    /// Enters a slot into the visible list.
    fn list(&mut self, slot: Slot, report: &mut AllocationReport) {
        if self.visible.mark(slot).is_err() {
            report.unlisted += 1;
        }
        self.lru.touch(slot);
        self.enter_submap(slot);
    }

    /// Takes a slot for a new, empty block.
    pub(super) fn make(&mut self, key: BlockKey) -> Option<Slot> {
        let slot = self.pool.take().ok()?;
        self.blocks.clear(slot, key);
        if self.index.insert(key, slot, |slot| self.blocks.key(slot)).is_err() {
            self.pool.free(slot);
            return None;
        }
        self.history.allocated_at(slot, self.visible.frame());
        self.submaps.insert(slot, key.coord);
        Some(slot)
    }

    /// Lists the blocks visible in the last frame that still lie in the picture.
    fn keep_in_view(&mut self, view: &Viewpoint, report: &mut AllocationReport) {
        let (camera_from_world, camera) = view.camera_from_world();
        let voxel_m = f64::from(self.config.voxel_size_m);
        let [width, height] = [view.width as f64, view.height as f64];
        // Behind the farthest surface the band is observed as well.
        let farthest = f64::from(self.config.far_m + self.config.truncation_m);
        for i in 0.. {
            let Some(slot) = self.visible.before(i) else { break };
            // Listed in this frame already, or evicted meanwhile.
            if self.visible.is_marked(slot) || !self.pool.is_live(slot) {
                continue;
            }
            // Blocks of another segment lie in a lattice of their own.
            let current = |key: &BlockKey| key.segment == self.segment;
            let Some(key) = self.blocks.key(slot).filter(current) else { continue };
            let center = Vector3::from(key.coord.origin().map(|c| (f64::from(c) + 3.5) * voxel_m));
            let at = camera_from_world * (center - camera.coords);
            let u = view.rig.focal_px * at.x + view.rig.center_u_px * at.z;
            let v = view.rig.focal_px * at.y + view.rig.center_v_px * at.z;
            // Inside the picture, without dividing by a depth that may be 0.
            let inside = at.z > 0.0
                && at.z <= farthest
                && u >= 0.0
                && v >= 0.0
                && u < width * at.z
                && v < height * at.z;
            if inside {
                self.list(slot, report);
            }
        }
    }
}

/// Returns true if a camera at that pose is in a block that the map can have: elsewhere nothing it
/// sees is fused.
pub(crate) fn is_within_map(t_world_camera: &Transform, voxel_size_m: f32) -> bool {
    base_block(&camera_in_blocks(t_world_camera, voxel_size_m)).is_some()
}

/// The camera's place in blocks, from the lower corner of the first block's cells.
fn camera_in_blocks(t_world_camera: &Transform, voxel_size_m: f32) -> Vector3<f64> {
    let block_m = f64::from(voxel_size_m) * BLOCK_SIDE as f64;
    let half_voxel = 0.5 / BLOCK_SIDE as f64;
    t_world_camera.translation() / block_m + Vector3::repeat(half_voxel)
}

/// The block the camera is in; `None` beyond the map.
fn base_block(camera: &Vector3<f64>) -> Option<[i32; 3]> {
    let bound = f64::from(i16::MAX);
    let inside = camera.iter().all(|c| *c > -bound && *c < bound);
    inside.then(|| [camera.x, camera.y, camera.z].map(|c| libm::floor(c) as i32))
}
