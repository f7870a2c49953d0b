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
    BEFORE_FAR, BLOCK_SIDE, BlockCoord, BlockKey, BlockStore, EvictionReport, Slot, Viewpoint,
    Volume, VolumeConfig,
    request::{Band, Rays},
};
use crate::{
    geometry::{StereoRig, Transform},
    image::View,
    parallel::{Executor, each},
};
use nalgebra::{Point3, Rotation3, Vector3};

/// Frames over which all blocks of the pool are looked at once, whether they are seen through.
const LOOK_AGAIN_FRAMES: u32 = 4;

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
        self.see_through(view, depth_m, &mut report);
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
        let sight = Sight::new(&self.config, view);
        for i in 0.. {
            let Some(slot) = self.visible.before(i) else { break };
            // Listed in this frame already, or evicted meanwhile.
            if self.visible.is_marked(slot) || !self.pool.is_live(slot) {
                continue;
            }
            if self.current_coord(slot).is_some_and(|coord| sight.pixel(coord).is_some()) {
                self.list(slot, report);
            }
        }
    }

    /// Lists blocks that came back into the picture and are seen through: what stood there has
    /// gone. A share of the pool in each frame. Without pruning nothing: what was evicted cannot be
    /// looked at, and an unpruned map does not depend on the pool.
    fn see_through(
        &mut self,
        view: &Viewpoint,
        depth_m: View<'_, f32>,
        report: &mut AllocationReport,
    ) {
        if !self.config.prunes() {
            return;
        }
        let sight = Sight::new(&self.config, view);
        // In slots that follow each other, whose headers lie together in memory.
        let share = (self.pool.high_water() as u32).div_ceil(LOOK_AGAIN_FRAMES);
        let first = self.visible.frame() % LOOK_AGAIN_FRAMES * share;
        let mut next = first;
        while let Some(slot) = self.pool.next_live(next).filter(|slot| slot.get() < first + share) {
            next = slot.get() + 1;
            // A block that was left belongs to another look at the place.
            if self.visible.is_marked(slot) || self.is_left(slot) {
                continue;
            }
            let seen = self.current_coord(slot).and_then(|coord| sight.pixel(coord));
            // By its middle alone: its other parts are seen in later frames.
            let is_through = seen.is_some_and(|([u, v], z_m)| {
                let observed_m = depth_m.get(u, v).map_or(0.0, f64::from);
                z_m + sight.block_m < observed_m * (1.0 - f64::from(BEFORE_FAR))
            });
            if is_through {
                self.list(slot, report);
            }
        }
    }

    /// Coordinates of a block, if it belongs to the segment that the camera is in: blocks of
    /// another lie in a lattice of their own.
    fn current_coord(&self, slot: Slot) -> Option<BlockCoord> {
        let key = self.blocks.key(slot)?;
        (key.segment == self.segment).then_some(key.coord)
    }
}

/// A camera before the lattice of blocks.
struct Sight {
    camera_from_world: Rotation3<f64>,
    camera: Point3<f64>,
    rig: StereoRig,
    size: [f64; 2],
    voxel_m: f64,
    block_m: f64,
    farthest_m: f64,
}

impl Sight {
    fn new(config: &VolumeConfig, view: &Viewpoint) -> Self {
        let (camera_from_world, camera) = view.camera_from_world();
        let voxel_m = f64::from(config.voxel_size_m);
        Self {
            camera_from_world,
            camera,
            rig: view.rig,
            size: [view.width as f64, view.height as f64],
            voxel_m,
            block_m: voxel_m * BLOCK_SIDE as f64,
            // Behind the farthest surface the band is observed as well.
            farthest_m: f64::from(config.far_m + config.truncation_m),
        }
    }

    /// The pixel of a block's middle and its depth, m, if it lies in the picture.
    fn pixel(&self, coord: BlockCoord) -> Option<([usize; 2], f64)> {
        let center = Vector3::from(coord.origin().map(|c| (f64::from(c) + 3.5) * self.voxel_m));
        let at = self.camera_from_world * (center - self.camera.coords);
        let u = self.rig.focal_px * at.x + self.rig.center_u_px * at.z;
        let v = self.rig.focal_px * at.y + self.rig.center_v_px * at.z;
        let [width, height] = self.size;
        // Inside the picture, without dividing by a depth that may be 0.
        let inside = at.z > 0.0
            && at.z <= self.farthest_m
            && u >= 0.0
            && v >= 0.0
            && u < width * at.z
            && v < height * at.z;
        inside.then(|| ([(u / at.z) as usize, (v / at.z) as usize], at.z))
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
