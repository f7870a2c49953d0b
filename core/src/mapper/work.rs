//! Work of a step, counted in units that depend on no clock, and the bound on each unit.
//!
//! A count is the same on every machine and for every number of threads. The bound on it follows
//! from the capacity and the settings alone, like the bytes of [`Capacity::bytes`].

use super::{Config, MotionSource};
use crate::{
    Capacity, scene_flow, stereo,
    volume::{BLOCK_VOXELS, MAX_BLOCKS_PER_RAY, PIXEL_STEP},
};

/// Triangles of a triangulation, at most so many per point.
const TRIANGLES_PER_POINT: usize = 2;
/// Most pictures of the map that a frame of a search takes.
pub(super) const PICTURES: usize = 3;
/// Interval of a picture's pixels, px: brightness is compared at every second pixel.
pub(super) const PICTURE_EVERY: usize = 2;

/// Time of a unit, ps, in the order of [`WorkUnits::named`]: `dynvox bench` on KITTI 06. Where two
/// units explain one stage, one of them has its time.
const UNIT_PS: [u64; WorkUnits::COUNT] =
    [44_000, 0, 0, 160_000, 150, 0, 80_000, 50_000, 1_000_000, 2_700, 200];

/// Units of work, by kind: of one step in a report, the most of any step in [`Capacity::work`].
///
/// Not counted yet, and without a bound here: hypotheses of egomotion and segmentation, searches
/// for matches on objects, keyframes that places compare, and the voxels of objects.
///
/// ```
/// use dynvox_core::{Capacity, Config, geometry::StereoRig};
///
/// let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let bound = Capacity::TINY.work(&Config::for_rig(rig));
/// assert_eq!(bound.stereo_pixels, 320 * 96);
/// assert_eq!(bound.fused_voxels, 512 * Capacity::TINY.visible_blocks as u64);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct WorkUnits {
    /// Pixels of the rows that are matched densely; none where disparities are given.
    pub stereo_pixels: u64,
    /// Support points looked for, each over the whole range of disparities.
    pub support_candidates: u64,
    /// Triangles of the support points of both images.
    pub triangles: u64,
    /// Features kept in both images, of both passes.
    pub features: u64,
    /// Descriptors compared with that of a feature, of both passes.
    pub compared_descriptors: u64,
    /// Circles of matches that closed, of both passes.
    pub circles: u64,
    /// Pixels of the pictures that the step itself takes of the map, to find a camera again or to
    /// register depth. Pictures that a caller asks for are not among them.
    pub cast_pixels: u64,
    /// Blocks looked up because a ray ran through them. A block that several rays meet may count
    /// more than once.
    pub block_requests: u64,
    /// Blocks that left the pool for others, and blocks loaded from the store.
    pub moved_blocks: u64,
    /// Voxels of the blocks that a frame was fused into.
    pub fused_voxels: u64,
    /// Voxels of the blocks that pruning visited.
    pub pruned_voxels: u64,
}

/// Work that a step left undone because of its budget, `mapper.work_budget`.
///
/// ```
/// use dynvox_core::Report;
///
/// assert_eq!(Report::default().deferred.fused_blocks, 0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct DeferredWork {
    /// Visible blocks that the frame was not fused into, all of them farther than those it was.
    /// Planners learn nothing of free space at their depth and beyond in this frame.
    pub fused_blocks: u32,
    /// Blocks that pruning leaves to a later frame.
    pub pruned_blocks: u32,
}

impl WorkUnits {
    /// Number of units.
    pub const COUNT: usize = 11;

    /// Name and count of each unit, in pipeline order.
    ///
    /// ```
    /// use dynvox_core::WorkUnits;
    ///
    /// assert_eq!(WorkUnits::default().named()[0], ("stereo_pixels", 0));
    /// ```
    pub const fn named(&self) -> [(&'static str, u64); Self::COUNT] {
        let Self {
            stereo_pixels,
            support_candidates,
            triangles,
            features,
            compared_descriptors,
            circles,
            cast_pixels,
            block_requests,
            moved_blocks,
            fused_voxels,
            pruned_voxels,
        } = *self;
        [
            ("stereo_pixels", stereo_pixels),
            ("support_candidates", support_candidates),
            ("triangles", triangles),
            ("features", features),
            ("compared_descriptors", compared_descriptors),
            ("circles", circles),
            ("cast_pixels", cast_pixels),
            ("block_requests", block_requests),
            ("moved_blocks", moved_blocks),
            ("fused_voxels", fused_voxels),
            ("pruned_voxels", pruned_voxels),
        ]
    }

    /// About the time of the work, ns: the time of each unit on KITTI 06, one thread of a desktop
    /// processor. It is the same on every machine, and compares frames with one another.
    ///
    /// ```
    /// use dynvox_core::WorkUnits;
    ///
    /// let mut work = WorkUnits::default();
    /// assert_eq!(work.nominal_ns(), 0);
    /// work.fused_voxels = 512;
    /// assert_eq!(work.nominal_ns(), 1_382);
    /// ```
    pub fn nominal_ns(&self) -> u64 {
        let ps = self.named().into_iter().zip(UNIT_PS);
        let ps = ps.map(|((_, units), ps)| units.saturating_mul(ps));
        ps.fold(0, u64::saturating_add) / 1_000
    }
}

impl Capacity {
    /// The most units of work that any step of a mapper of this capacity does on any input.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, geometry::StereoRig};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let config = Config::for_rig(rig);
    /// let (tiny, small) = (Capacity::TINY.work(&config), Capacity::SMALL.work(&config));
    /// assert!(tiny.named().iter().zip(small.named()).all(|(tiny, small)| tiny.1 <= small.1));
    /// ```
    pub fn work(&self, config: &Config) -> WorkUnits {
        let points = stereo::max_points(self);
        let features: usize = scene_flow::most_features(self).iter().sum();
        let rays = self.image_width.div_ceil(PIXEL_STEP) * self.image_height.div_ceil(PIXEL_STEP);
        let requests = rays * MAX_BLOCKS_PER_RAY;
        let pruned = self.blocks.min(config.volume.prune_blocks_per_frame as usize);
        // A camera is found again by several thinned pictures; registering depth takes a whole one.
        let thinned = |side: usize| side.div_ceil(PICTURE_EVERY);
        let cast_pixels = match config.mapper.egomotion {
            MotionSource::Stereo => {
                PICTURES * thinned(self.image_width) * thinned(self.image_height)
            }
            MotionSource::Icp => self.pixels(),
        };
        WorkUnits {
            stereo_pixels: stereo::most_pixels(self, &config.stereo) as u64,
            support_candidates: points as u64,
            // Of both images.
            triangles: (2 * TRIANGLES_PER_POINT * points) as u64,
            features: (2 * features) as u64,
            compared_descriptors: scene_flow::most_compared(self, &config.scene_flow),
            // A feature of the previous left image begins one circle.
            circles: features as u64,
            cast_pixels: cast_pixels as u64,
            block_requests: requests as u64,
            // A request evicts one block at most, and loads one.
            moved_blocks: (2 * requests) as u64,
            fused_voxels: (self.visible_blocks * BLOCK_VOXELS) as u64,
            pruned_voxels: (pruned * BLOCK_VOXELS) as u64,
        }
    }
}
