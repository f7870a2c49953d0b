//! Fusing a depth image into the visible blocks: integer running averages (Curless, Levoy: *A Volumetric Method for Building Complex
//! Models from Range Images*, 1996, projective along the camera's z as in Newcombe et al., *KinectFusion*, 2011).
//!
//! A lattice point at depth z that projects onto a pixel of depth d observes `o = min((d - z) / truncation, 1)`, unless `o < -1`: then it
//! is hidden. With weight w and observation weight v, in units of 1 / 32,767:
//!
//! `sdf += round((o - sdf) * v / (w + v))`, `w = min(w + v, max_weight)`
//!
//! where `v / (w + v)` is a 15-bit fraction from a table. Colour is averaged likewise within `colour_band` of the surface, with a weight
//! of at most [`COLOUR_WEIGHT`], so that its 8 bits keep following.
//!
//! Time: linear in visible blocks. Blocks are taken in slot order in four fixed bands; no block's result depends on another's.

use super::{BLOCK_SIDE, BLOCK_VOXELS, BlockCoord, Blocks, CLASS_COUNT, ObservationWeight, Viewpoint, Volume, VolumeConfig};
use crate::{
    digest::Digest,
    executor::{Executor, join4},
    image::View,
};
use nalgebra::{Point3, Rotation3, Vector3};

/// Most that a voxel's past weighs when a colour is averaged in (the original's colour weight).
const COLOUR_WEIGHT: i32 = 5;
/// Observation weights run up to this.
const MAX_OBSERVATION_WEIGHT: i32 = 255;
/// Sums of a voxel's weight and an observation's run below this.
const SHARES: usize = 512;

/// What a camera saw, as the map takes it.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// Depth, m; 0 none.
    pub depth_m: View<'a, f32>,
    /// Grey image of the same size, fused as colour where `colour` is absent.
    pub grey: View<'a, u8>,
    /// Colour image of the same size.
    pub colour: Option<View<'a, [u8; 3]>>,
    /// Semantic class per pixel.
    pub class: Option<View<'a, u8>>,
}

impl Observation<'_> {
    fn colour_at(&self, u: usize, v: usize) -> [u8; 3] {
        let colour = match self.colour {
            Some(image) => image.get(u, v).unwrap_or_default(),
            None => [self.grey.get(u, v).unwrap_or_default(); 3],
        };
        // All 0 is "no colour yet".
        colour.map(|channel| if channel == 0 { 1 } else { channel })
    }
}

/// A run of blocks that one worker owns: the payload of slots `first..`, and which of them to visit.
struct Band<'b> {
    slots: &'b [u32],
    first: usize,
    coord: &'b [[i16; 4]],
    sdf: &'b mut [[i16; BLOCK_VOXELS]],
    weight: &'b mut [[u8; BLOCK_VOXELS]],
    colour: &'b mut [[[u8; BLOCK_VOXELS]; 3]],
    digest: &'b mut [u64],
}

impl<'b> Band<'b> {
    fn whole(slots: &'b [u32], blocks: &'b mut Blocks<'_>) -> Self {
        Self { slots, first: 0, coord: blocks.coord, sdf: blocks.sdf, weight: blocks.weight, colour: blocks.colour, digest: blocks.digest }
    }

    /// Splits before the block in the middle of the list.
    fn halves(self) -> (Self, Self) {
        let (low, high) = self.slots.split_at(self.slots.len() / 2);
        let border = high.first().map_or(self.first, |&slot| slot as usize);
        let at = (border - self.first).min(self.sdf.len());
        let coloured = at.min(self.colour.len());
        let (sdf, sdf_high) = self.sdf.split_at_mut(at);
        let (weight, weight_high) = self.weight.split_at_mut(at);
        let (colour, colour_high) = self.colour.split_at_mut(coloured);
        let (digest, digest_high) = self.digest.split_at_mut(at);
        (
            Band { slots: low, first: self.first, coord: self.coord, sdf, weight, colour, digest },
            Band {
                slots: high,
                first: border,
                coord: self.coord,
                sdf: sdf_high,
                weight: weight_high,
                colour: colour_high,
                digest: digest_high,
            },
        )
    }
}

/// Everything about a frame that blocks share.
struct Fusion<'a> {
    seen: Observation<'a>,
    config: &'a VolumeConfig,
    camera_from_world: Rotation3<f64>,
    camera: Point3<f64>,
    /// Change of the camera coordinates per lattice step along x, y, z, m.
    steps: [Vector3<f32>; 3],
    focal_px: f32,
    center_u_px: f32,
    center_v_px: f32,
    /// Share of a new observation by the sum of weights, times 2^23: `round(2^23 / sum)`.
    shares: [i32; SHARES],
    plain_weights: bool,
}

impl<'a> Fusion<'a> {
    fn new(config: &'a VolumeConfig, view: &Viewpoint, seen: Observation<'a>) -> Self {
        let (camera_from_world, camera) = view.camera_from_world();
        let voxel_m = f64::from(config.voxel_size_m);
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut shares = [0; SHARES];
        for (sum, share) in (0i32..).zip(&mut shares).skip(1) {
            *share = ((1 << 23) + sum / 2) / sum;
        }
        Self {
            seen,
            config,
            camera_from_world,
            camera,
            steps: axes.map(|axis| (camera_from_world * (axis * voxel_m)).cast::<f32>()),
            focal_px: view.rig.focal_px as f32,
            center_u_px: view.rig.center_u_px as f32,
            center_v_px: view.rig.center_v_px as f32,
            shares,
            plain_weights: config.observation_weight == ObservationWeight::One && seen.class.is_none(),
        }
    }

    /// Weight of an observation at pixel (u, v) of that depth; 0 keeps it out.
    fn observation_weight(&self, u: usize, v: usize, depth_m: f32) -> i32 {
        let by_depth = match self.config.observation_weight {
            ObservationWeight::One => 1,
            ObservationWeight::Depth => ((100.0 / depth_m) as i32).clamp(1, 10),
        };
        let class = self.seen.class.and_then(|image| image.get(u, v)).map(usize::from);
        let by_class = class.and_then(|class| self.config.class_weight.get(class % CLASS_COUNT)).copied().unwrap_or(1);
        (by_depth * i32::from(by_class)).min(MAX_OBSERVATION_WEIGHT)
    }
}

/// Rounds to the nearest integer, ties to even, by the float format itself: exact for magnitudes below 2^22, and any bits at all beyond.
#[inline]
fn rounded(value: f32) -> i32 {
    const MAGIC: f32 = 12_582_912.0;
    ((value + MAGIC).to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32)
}

/// `current` moved towards `target` by `share` / 32,768, rounded.
#[inline]
fn blended(current: i32, target: i32, share: i32) -> i32 {
    current + (((target - current) * share + (1 << 14)) >> 15)
}

impl Volume<'_> {
    /// Averages an observation from `view` into every visible block.
    pub fn fuse<E: Executor>(&mut self, view: &Viewpoint, seen: Observation<'_>, executor: &E) {
        let fusion = Fusion::new(&self.config, view, seen);
        let (low, high) = Band::whole(self.visible.slots(), &mut self.blocks).halves();
        let ((a, b), (c, d)) = (low.halves(), high.halves());
        let mut changes = [0u64; 4];
        let [change_a, change_b, change_c, change_d] = &mut changes;
        join4(
            executor,
            || *change_a = fusion.band(a),
            || *change_b = fusion.band(b),
            || *change_c = fusion.band(c),
            || *change_d = fusion.band(d),
        );
        self.digest = changes.iter().fold(self.digest, |sum, change| sum.wrapping_add(*change));
    }
}

impl Fusion<'_> {
    /// Fuses one band and returns by how much the sum of block digests changes.
    fn band(&self, band: Band<'_>) -> u64 {
        let mut change = 0u64;
        for &slot in band.slots {
            let at = (slot as usize).wrapping_sub(band.first);
            let (Some(coord), Some(sdf), Some(weight), Some(digest)) =
                (band.coord.get(slot as usize), band.sdf.get_mut(at), band.weight.get_mut(at), band.digest.get_mut(at))
            else {
                continue;
            };
            let coord = BlockCoord::unpacked(*coord);
            let mut colour = band.colour.get_mut(at);
            if self.block(coord, sdf, weight, colour.as_deref_mut()) {
                let new = block_digest(coord, sdf, weight, colour.as_deref());
                change = change.wrapping_add(new).wrapping_sub(*digest);
                *digest = new;
            }
        }
        change
    }

    /// Fuses one block. Whether any voxel changed.
    fn block(
        &self,
        coord: BlockCoord,
        sdf: &mut [i16; BLOCK_VOXELS],
        weight: &mut [u8; BLOCK_VOXELS],
        mut colour: Option<&mut [[u8; BLOCK_VOXELS]; 3]>,
    ) -> bool {
        let voxel_m = f64::from(self.config.voxel_size_m);
        let origin_m = Vector3::from(coord.origin().map(|c| f64::from(c) * voxel_m));
        let corner = (self.camera_from_world * (origin_m - self.camera.coords)).cast::<f32>();
        let [_, step_y, step_z] = self.steps;
        let mut changed = false;
        let rows = sdf.as_chunks_mut::<BLOCK_SIDE>().0.iter_mut().zip(weight.as_chunks_mut::<BLOCK_SIDE>().0);
        for (row, (sdf, weight)) in rows.enumerate() {
            let first = corner + step_y * (row % BLOCK_SIDE) as f32 + step_z * (row / BLOCK_SIDE) as f32;
            let (hits, near) = self.row(first, sdf, weight);
            changed |= hits;
            if let (Some(near), Some(planes)) = (near, colour.as_deref_mut()) {
                self.colour_row(row, &near, planes, weight);
            }
        }
        changed
    }
}

/// Pixels seen by the voxels of a row that lie near the surface, `u + v << 16`, or [`NO_PIXEL`].
type NearPixels = [u32; BLOCK_SIDE];
const NO_PIXEL: u32 = u32::MAX;

impl Fusion<'_> {
    /// Fuses one row of eight voxels whose first lies at `first` in the camera. Whether any changed, and the pixels of those near the surface.
    #[inline]
    fn row(&self, first: Vector3<f32>, sdf: &mut [i16; BLOCK_SIDE], weight: &mut [u8; BLOCK_SIDE]) -> (bool, Option<NearPixels>) {
        let (depths_m, observed_m, pixels, any) = self.observe(first);
        if !any {
            return (false, None);
        }
        let truncation_m = self.config.truncation_m;
        let scale = 32_767.0 / truncation_m;
        let band_m = self.config.colour_band * truncation_m;
        let max_weight = i32::from(self.config.max_weight);
        let mut near = [NO_PIXEL; BLOCK_SIDE];
        let (mut any_hit, mut any_near) = (false, false);
        let voxels = sdf.iter_mut().zip(weight.iter_mut()).zip(&mut near);
        for ((((sdf, weight), near), (&depth_m, &observed_m)), &pixel) in voxels.zip(depths_m.iter().zip(&observed_m)).zip(&pixels) {
            let distance_m = observed_m - depth_m;
            let gain = self.gain(pixel, observed_m);
            if !(observed_m > 0.0 && distance_m >= -truncation_m) || gain == 0 {
                continue;
            }
            let target = rounded(if distance_m < truncation_m { distance_m * scale } else { 32_767.0 });
            let old = i32::from(*weight);
            let share = self.shares.get((old + gain) as usize).map_or(0, |share| (gain * share + 128) >> 8);
            *sdf = blended(i32::from(*sdf), target, share) as i16;
            *weight = (old + gain).min(max_weight) as u8;
            any_hit = true;
            if distance_m <= band_m && distance_m >= -band_m {
                *near = pixel;
                any_near = true;
            }
        }
        (any_hit, any_near.then_some(near))
    }

    #[inline]
    fn gain(&self, pixel: u32, observed_m: f32) -> i32 {
        if self.plain_weights { 1 } else { self.observation_weight((pixel & 0xFFFF) as usize, (pixel >> 16) as usize, observed_m) }
    }

    /// Where eight voxels fall in the image: their depths, the depths observed there (0 none), the pixels, and whether any was observed.
    #[inline]
    fn observe(&self, first: Vector3<f32>) -> ([f32; BLOCK_SIDE], [f32; BLOCK_SIDE], [u32; BLOCK_SIDE], bool) {
        let step = self.steps[0];
        let mut depths_m = [0.0; BLOCK_SIDE];
        let mut columns = [0i32; BLOCK_SIDE];
        let mut rows = [0i32; BLOCK_SIDE];
        for (i, ((depth_m, column), row)) in (0u8..).zip(depths_m.iter_mut().zip(&mut columns).zip(&mut rows)) {
            let i = f32::from(i);
            let (x, y, z) = (first.x + step.x * i, first.y + step.y * i, first.z + step.z * i);
            let scale = self.focal_px / z;
            *depth_m = z;
            *column = rounded(x * scale + self.center_u_px);
            *row = rounded(y * scale + self.center_v_px);
        }
        let mut observed_m = [0.0; BLOCK_SIDE];
        let mut pixels = [NO_PIXEL; BLOCK_SIDE];
        let mut any = false;
        let spots = columns.iter().zip(&rows).zip(&depths_m);
        for ((observed_m, pixel), ((&column, &row), &depth_m)) in observed_m.iter_mut().zip(&mut pixels).zip(spots) {
            // A voxel behind the camera, or so near that its column is nonsense, is outside.
            if depth_m > 0.0
                && let Some(depth) = self.seen.depth_m.get(column as u32 as usize, row as u32 as usize)
            {
                *observed_m = depth;
                *pixel = (column as u32 & 0xFFFF) | (row as u32) << 16;
                any |= depth > 0.0;
            }
        }
        (depths_m, observed_m, pixels, any)
    }

    /// Averages the colours of a row's pixels near the surface in. `weight` is that after this observation.
    fn colour_row(&self, row: usize, near: &NearPixels, planes: &mut [[u8; BLOCK_VOXELS]; 3], weight: &[u8; BLOCK_SIDE]) {
        for (i, (&pixel, &weight)) in near.iter().zip(weight).enumerate() {
            if pixel == NO_PIXEL {
                continue;
            }
            let target = self.seen.colour_at((pixel & 0xFFFF) as usize, (pixel >> 16) as usize);
            let voxel = row * BLOCK_SIDE + i;
            let blank = planes.iter().all(|plane| plane.get(voxel) == Some(&0));
            let sum = if blank { 1 } else { i32::from(weight).clamp(2, COLOUR_WEIGHT + 1) };
            let share = self.shares.get(sum as usize).map_or(0, |share| (share + 128) >> 8);
            for (plane, target) in planes.iter_mut().zip(target) {
                if let Some(channel) = plane.get_mut(voxel) {
                    *channel = blended(i32::from(*channel), i32::from(target), share) as u8;
                }
            }
        }
    }
}

/// Digest of a block's place and content.
pub(super) fn block_digest(
    coord: BlockCoord,
    sdf: &[i16; BLOCK_VOXELS],
    weight: &[u8; BLOCK_VOXELS],
    colour: Option<&[[u8; BLOCK_VOXELS]; 3]>,
) -> u64 {
    let mut digest = Digest::default();
    digest.i16s(&coord.packed());
    digest.i16s(sdf);
    digest.bytes(weight);
    colour.into_iter().flatten().for_each(|plane| digest.bytes(plane));
    digest.finish()
}
