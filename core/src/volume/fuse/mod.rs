//! Fusing a depth image into the visible blocks: integer running averages (Curless, Levoy: *A
//! Volumetric Method for Building Complex Models from Range Images*, 1996, projective along the
//! camera's z as in Newcombe et al., *KinectFusion*, 2011).
//!
//! A lattice point at depth z that projects onto a pixel of depth d observes
//! `o = min((d - z) / truncation, 1)`, unless `o < -1`: then it is hidden. Where the depth has
//! notes (`observed`), `d - z` is then taken along the surface's normal. Neither is what lies
//! farther than `behind_m` behind the surface observed, for it may belong to another. With weight w
//! and observation weight v, in units of 1 / 32,767:
//!
//! `sdf += round((o - sdf) * v / (p + v))`, `w = min(w + v, max_weight)`, where the past counts
//! `p = min(w, d / 2 m)` (`volume.observation_weight`),
//!
//! where `v / (p + v)` is a 15-bit fraction from a table. Colour is averaged likewise within
//! [`COLOUR_BAND`] of the surface, with a weight of at most 5, so that its 8 bits keep following.
//!
//! A surface farther than `far_m` is not fused. It says that what is before it is free, up to
//! [`BEFORE_FAR`] of its depth: so what stood there and has gone is cleared.
//!
//! Blocks behind all that is observed where they can fall are left out (`horizon`); of the others
//! 64 voxels are fused at a time (`layer`).
//!
//! Time: linear in visible blocks. Blocks are taken in slot order in four fixed bands; no block's
//! result depends on another's.

mod band;
mod colour;
mod horizon;
mod layer;
mod nearest;

use self::{
    band::Band,
    horizon::Horizon,
    layer::{LayerAt, Scratch, Shares},
};
use nearest::BlockDepth;
pub(crate) use nearest::FusedBlocks;

use super::block::{Colour, Voxels, colour_layer_mut, least_weight};
use super::{BLOCK_SIDE, BlockCoord, BlockKey, DepthImage, Viewpoint, Volume, VolumeConfig};
use crate::{
    digest::Digest,
    geometry::scalar::{floor_i32, max_f32, min_f32},
    image::View,
    parallel::{Executor, Work, each},
};
use nalgebra::{Point3, Rotation3, Vector3};

/// Blocks nearer than this are never left out, m.
const NEAREST_CULLED_M: f32 = 0.1;
/// Share of the truncation on either side of the surface within which colour is averaged.
pub(super) const COLOUR_BAND: f32 = 0.25;
/// Share of its depth before a surface farther than `far_m` within which it tells nothing: its
/// depth is known too badly.
pub(super) const BEFORE_FAR: f32 = 0.25;
/// Corners of a block.
const CORNERS: usize = 8;

/// Depth and colour of a camera, as the map takes them.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// Depths. Without padding between rows.
    pub depth: DepthImage<'a>,
    /// Grey image of the same size, fused as colour where `colour` is absent.
    pub grey: View<'a, u8>,
    /// Colour image of the same size.
    pub colour: Option<View<'a, [u8; 3]>>,
    /// Semantic class per pixel.
    pub class: Option<View<'a, u8>>,
}

/// Everything about a frame that blocks share.
struct Fusion<'a> {
    seen: Observation<'a>,
    config: &'a VolumeConfig,
    camera_from_world: Rotation3<f64>,
    camera: Point3<f64>,
    /// Change of the camera coordinates per lattice step along x, y, z, m.
    steps: [Vector3<f32>; 3],
    /// The change of each coordinate from a row's first voxel to each of its voxels, m.
    along_x: [[f32; BLOCK_SIDE]; 3],
    /// The change of each coordinate from a block's first voxel to those at its corners, m.
    corners: [[f32; CORNERS]; 3],
    horizon: Option<Horizon<'a>>,
    focal_px: f32,
    center_u_px: f32,
    center_v_px: f32,
    /// Depth of blocks, and the greatest one of those that are fused, m; `None` fuses all.
    nearest: Option<(BlockDepth, f64)>,
    shares: Shares,
    plain_weights: bool,
    /// The most that the past weighs against an observation, by its depth, 1/m.
    past_per_m: f32,
    /// Distance before the surface from which on an observation weighs a quarter, m.
    free_m: f32,
    /// The depth image, without padding.
    depth_m: &'a [f32],
    /// True if the lowest bits of the depths are notes.
    is_noted: bool,
    width: u32,
    height: u32,
    /// Units of signed distance per metre.
    scale: f32,
    colour_band_m: f32,
    behind_m: f32,
}

impl<'a> Fusion<'a> {
    // Never inlined: the copies of its tables must not stay in the caller's frame.
    #[inline(never)]
    fn new(
        config: &'a VolumeConfig,
        view: &Viewpoint,
        seen: Observation<'a>,
        horizon: Option<Horizon<'a>>,
    ) -> Self {
        let (camera_from_world, camera) = view.camera_from_world();
        let (voxel_m, depth_m) = (f64::from(config.voxel_size_m), seen.depth.depth_m());
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        // Voxels are projected by adding steps along the block's axes.
        let steps = axes.map(|axis| (camera_from_world * (axis * voxel_m)).cast::<f32>());
        Self {
            seen,
            config,
            camera_from_world,
            camera,
            steps,
            along_x: [steps[0].x, steps[0].y, steps[0].z]
                .map(|step| core::array::from_fn(|x| step * x as f32)),
            corners: corners(&steps),
            horizon,
            focal_px: view.rig.focal_px as f32,
            center_u_px: view.rig.center_u_px as f32,
            center_v_px: view.rig.center_v_px as f32,
            nearest: None,
            shares: Shares::new(),
            plain_weights: config.observation_weight.most() == 1 && seen.class.is_none(),
            past_per_m: config.observation_weight.past_per_m(),
            free_m: config.observation_weight.free_m(config.voxel_size_m),
            depth_m: depth_m.pixels(),
            is_noted: seen.depth.is_noted(),
            width: depth_m.width() as u32,
            height: depth_m.height() as u32,
            // The truncation takes all 16 bits of a distance.
            scale: 32_767.0 / config.truncation_m,
            colour_band_m: COLOUR_BAND * config.truncation_m,
            // At least two voxels, so that the surface's own far side is observed.
            behind_m: max_f32(config.behind_m, 2.0 * config.voxel_size_m),
        }
    }
}

impl Volume<'_> {
    /// Averages an observation from `view` into every visible block.
    pub fn fuse<E: Executor>(&mut self, view: &Viewpoint, seen: Observation<'_>, executor: &E) {
        self.fuse_nearest(view, seen, usize::MAX, executor);
    }

    /// Averages an observation into at most so many visible blocks, the nearest ones.
    pub(crate) fn fuse_nearest<E: Executor>(
        &mut self,
        view: &Viewpoint,
        seen: Observation<'_>,
        most: usize,
        executor: &E,
    ) -> FusedBlocks {
        let within_m = self.nearest_m(view, most);
        let visible = self.visible.slots().len() as u32;
        // The buffers of the block requests are free now.
        let horizon = Horizon::new(seen.depth.depth_m(), self.requested.scratch());
        let mut fusion = Fusion::new(&self.config, view, seen, horizon);
        fusion.nearest =
            (within_m < f64::MAX).then(|| (BlockDepth::new(&self.config, view), within_m));
        let (low, high) = Band::whole(self.visible.slots(), &mut self.blocks).halves();
        let ((a, b), (c, d)) = (low.halves(), high.halves());
        let changes = each(executor, [a, b, c, d], |band| {
            executor.vectors().run(FuseBand { fusion: &fusion, band })
        });
        // A wrapping sum: the order of the bands does not matter.
        let mut deferred = 0;
        for (change, skipped) in changes {
            self.digest = self.digest.wrapping_add(change);
            deferred += skipped;
        }
        FusedBlocks { count: visible - deferred, deferred, within_m }
    }
}

/// One of four bands of blocks.
struct FuseBand<'a, 'b> {
    fusion: &'a Fusion<'a>,
    band: Band<'b>,
}

impl Work for FuseBand<'_, '_> {
    /// Difference of the sum of block digests, and blocks that were too far away to be fused.
    type Output = (u64, u32);

    #[inline(always)]
    fn run(self) -> (u64, u32) {
        let Self { fusion, band } = self;
        // What the map's digest changes by.
        let (mut change, mut skipped) = (0u64, 0);
        let mut scratch = Scratch::new();
        for &slot in band.slots {
            let at = slot.index().wrapping_sub(band.first);
            let (Some(header), Some(least), Some(voxels)) =
                (band.header.get_mut(at), band.min_weight.get_mut(at), band.voxels.get_mut(at))
            else {
                continue;
            };
            let mut colour = band.colour.get_mut(at);
            let key = header.key();
            if fusion.is_deferred(key.coord) {
                skipped += 1;
                continue;
            }
            if fusion.block(key.coord, &mut scratch, voxels, colour.as_deref_mut()) {
                let new = block_digest(key, voxels, colour.as_deref());
                change = change.wrapping_add(new).wrapping_sub(header.digest);
                header.digest = new;
                *least = least_weight(&voxels.weight);
            }
        }
        (change, skipped)
    }
}

impl Fusion<'_> {
    /// Returns true if the budget does not reach as far as a block.
    fn is_deferred(&self, coord: BlockCoord) -> bool {
        self.nearest.as_ref().is_some_and(|(depth, within_m)| depth.of_block(coord) > *within_m)
    }

    /// Fuses one block. Whether any voxel changed.
    #[inline(always)]
    fn block(
        &self,
        coord: BlockCoord,
        scratch: &mut Scratch,
        voxels: &mut Voxels,
        mut colour: Option<&mut Colour>,
    ) -> bool {
        let voxel_m = f64::from(self.config.voxel_size_m);
        // In f64 up to the difference, which is small and keeps its digits in f32.
        let origin_m = Vector3::from(coord.origin().map(|c| f64::from(c) * voxel_m));
        let corner = (self.camera_from_world * (origin_m - self.camera.coords)).cast::<f32>();
        if self.is_hidden(corner) {
            return false;
        }
        let mut changed = false;
        for (z, (sdf, weight)) in voxels.layers_mut().enumerate() {
            if self.layer(LayerAt { corner, z }, scratch, sdf, weight) {
                changed = true;
                if let Some(planes) =
                    colour.as_deref_mut().and_then(|colour| colour_layer_mut(colour, z))
                {
                    self.colour_layer(scratch, planes, weight);
                }
            }
        }
        changed
    }

    /// Returns true if no voxel of the block whose first one lies at `corner` can be observed: it
    /// is outside the image, or behind all observed surfaces where it projects.
    #[inline(always)]
    fn is_hidden(&self, corner: Vector3<f32>) -> bool {
        let Some(horizon) = self.horizon else { return false };
        let [x_m, y_m, z_m] = &self.corners;
        let [mut columns, mut rows, mut depths_m] = [[0.0; CORNERS]; 3];
        let seen = columns.iter_mut().zip(&mut rows).zip(&mut depths_m);
        for (((column, row), depth_m), ((&x_m, &y_m), &z_m)) in
            seen.zip(x_m.iter().zip(y_m).zip(z_m))
        {
            *depth_m = corner.z + z_m;
            let scale = self.focal_px / *depth_m;
            *column = (corner.x + x_m) * scale + self.center_u_px;
            *row = (corner.y + y_m) * scale + self.center_v_px;
        }
        // The block is hidden if its nearest point lies behind the farthest surface in its span.
        let nearest_m = least(&depths_m);
        // So near, what is between the corners need not be seen between them.
        if nearest_m < NEAREST_CULLED_M {
            return false;
        }
        // A pixel more, so that no rounding hides what is seen.
        let span = |seen: &[f32; CORNERS], size: u32| {
            let (first, last) = (floor_i32(least(seen)) - 1, floor_i32(greatest(seen)) + 2);
            (last >= 0 && first < size as i32)
                .then(|| [first.max(0) as usize, last.min(size as i32 - 1) as usize])
        };
        let (Some(columns), Some(rows)) = (span(&columns, self.width), span(&rows, self.height))
        else {
            return true;
        };
        // A twentieth of a voxel more, for the same reason.
        horizon.greatest_m(columns, rows) + self.config.truncation_m
            < nearest_m - 0.05 * self.config.voxel_size_m
    }
}

/// The coordinates of a block's corners, from its first voxel's, m.
fn corners(steps: &[Vector3<f32>; 3]) -> [[f32; CORNERS]; 3] {
    let side = (BLOCK_SIDE - 1) as f32;
    [0, 1, 2].map(|axis| {
        core::array::from_fn(|n| {
            // Bit by bit of the corner's number: along x, y, z.
            steps
                .iter()
                .enumerate()
                .filter(|(along, _)| n >> along & 1 == 1)
                .map(|(_, step)| step[axis] * side)
                .sum()
        })
    })
}

/// The least of a coordinate of a block's corners.
#[inline(always)]
fn least(corners: &[f32; CORNERS]) -> f32 {
    corners.iter().fold(f32::MAX, |least, &corner| min_f32(least, corner))
}

/// The greatest of a coordinate of a block's corners.
#[inline(always)]
fn greatest(corners: &[f32; CORNERS]) -> f32 {
    corners.iter().fold(f32::MIN, |greatest, &corner| max_f32(greatest, corner))
}

/// Digest of a block's segment, coordinates and content.
#[inline(always)]
pub(super) fn block_digest(
    BlockKey { segment, coord }: BlockKey,
    Voxels { sdf, weight }: &Voxels,
    colour: Option<&Colour>,
) -> u64 {
    let mut digest = Digest::default();
    // 16 bits for each coordinate and for the segment.
    digest.u64(
        [coord.x as u16, coord.y as u16, coord.z as u16, segment.get()]
            .iter()
            .fold(0, |packed, &along| packed << 16 | u64::from(along)),
    );
    digest.whole_i16s(sdf);
    digest.whole_bytes(weight);
    for plane in colour.into_iter().flatten() {
        digest.whole_bytes(plane);
    }
    digest.finish()
}
