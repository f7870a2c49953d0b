//! The kernel: 64 voxels at a time, those of a block with one z.
//!
//! Each loop goes over all of them and has no branches: that is what becomes vector instructions.
//! Loops over eight voxels are unrolled before they can. What is 32 bits wide is done in as few
//! loops as possible; 16 bits have their own, for twice as many fit into a vector.

use super::Fusion;
use crate::{
    geometry::scalar::{clamp_f32, floored_i32, min_f32, rounded_i32},
    image::View,
    slices::{clipped, clipped_mut},
    volume::{
        BEFORE_FAR, BLOCK_SIDE, CLASS_COUNT, NotedDepth,
        block::{LAYER_VOXELS, Layer},
    },
};
use bytemuck::TransparentWrapper;
use core::ops::Range;
use nalgebra::Vector3;

/// Observation weights run up to this.
const MAX_OBSERVATION_WEIGHT: i16 = 255;
/// Sums of a voxel's weight and an observation's run below this.
const SHARES: usize = 512;
/// No pixel of the image.
const OUTSIDE: u32 = u32::MAX;

/// Shares of an average, by the sum of weights.
pub(super) struct Shares {
    /// Share of a new observation of weight 1, times 2^23: `round(2^23 / sum)`.
    units: [i32; SHARES],
}

impl Shares {
    pub fn new() -> Self {
        let mut shares = Self { units: [0; SHARES] };
        for (sum, unit) in (0i32..).zip(&mut shares.units) {
            *unit = ((1i32 << 23) + sum / 2).checked_div(sum).unwrap_or(0);
        }
        shares
    }

    /// Share of an observation of weight `gain`, times -32,768.
    #[inline(always)]
    fn of(&self, sum: i32, gain: i32) -> i16 {
        let unit = self.units.get(sum as usize).copied().unwrap_or(0);
        -((gain * unit + 128) >> 8) as i16
    }
}

/// Share of one observation where the past weighs `past`, up to 255, times -32,768: so it fits its
/// type even where it is all. A division has vectors, a table has none.
#[inline(always)]
pub(super) const fn share_of_one(past: i32) -> i16 {
    -rounded_i32(32_768.0 / (past as f32 + 1.0)) as i16
}

/// Intermediate values of a layer.
pub(super) struct Scratch {
    /// Camera coordinates of each voxel, m.
    x_m: Layer<f32>,
    y_m: Layer<f32>,
    z_m: Layer<f32>,
    /// The pixel it falls on.
    pub(super) column: Layer<i32>,
    pub(super) row: Layer<i32>,
    /// Index of each voxel's pixel in the depth image, or [`OUTSIDE`].
    pixel: Layer<u32>,
    /// Index of each voxel's pixel in an image with padding between its rows.
    padded: Layer<u32>,
    /// Depth observed there, m; 0 none.
    pub(super) observed_m: Layer<f32>,
    /// Distance of the voxel before the observed surface, m.
    pub(super) distance_m: Layer<f32>,
    /// Distance limited to the truncation, in its units.
    target: Layer<i16>,
    /// -1 where the voxel is observed, else 0.
    pub(super) hit: Layer<i16>,
    /// Weight of the observation.
    pub(super) gain: Layer<i16>,
    /// Weight of the past against one observation.
    past: Layer<u8>,
    /// Share of the average, times -32,768.
    share: Layer<i16>,
}

impl Scratch {
    pub const fn new() -> Self {
        Self {
            x_m: [0.0; LAYER_VOXELS],
            y_m: [0.0; LAYER_VOXELS],
            z_m: [0.0; LAYER_VOXELS],
            column: [0; LAYER_VOXELS],
            row: [0; LAYER_VOXELS],
            pixel: [0; LAYER_VOXELS],
            padded: [0; LAYER_VOXELS],
            observed_m: [0.0; LAYER_VOXELS],
            distance_m: [0.0; LAYER_VOXELS],
            target: [0; LAYER_VOXELS],
            hit: [0; LAYER_VOXELS],
            gain: [1; LAYER_VOXELS],
            past: [0; LAYER_VOXELS],
            share: [0; LAYER_VOXELS],
        }
    }

    /// The pixels of an image of the depths' size at some voxels, whole rows of them. What those
    /// show that fall outside means nothing.
    #[inline(always)]
    pub(super) fn pixels<T: Copy + Default>(
        &mut self,
        voxels: Range<usize>,
        image: View<'_, T>,
        shown: &mut Layer<T>,
    ) {
        let (pixels, index) = self.indexed(image);
        let (shown, index) = (clipped_mut(shown, voxels.clone()), clipped(index, voxels));
        // Eight loads in a row: a loop of single ones is all jumps.
        for (shown, index) in shown.as_chunks_mut().0.iter_mut().zip(index.as_chunks().0) {
            *shown = loaded(pixels, index);
        }
    }

    /// Reads the pixels only at the voxels of these bits, which fall into the image: faster where a
    /// pixel is several items.
    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "the mask keeps voxels below LAYER_VOXELS, the length of every layer"
    )]
    pub(super) fn pixels_at<T: Copy + Default>(
        &mut self,
        mut bits: u64,
        image: View<'_, T>,
        mut visit: impl FnMut(usize, T),
    ) {
        let (pixels, index) = self.indexed(image);
        while bits != 0 {
            let i = bits.trailing_zeros() as usize & (LAYER_VOXELS - 1);
            bits &= bits - 1;
            visit(i, pixels.get(index[i] as usize).copied().unwrap_or_default());
        }
    }

    /// An image of the depths' size, and where in it the voxels fall.
    #[inline(always)]
    fn indexed<'i, T>(&'i mut self, image: View<'i, T>) -> (&'i [T], &'i Layer<u32>) {
        let (pixels, stride) = image.strided();
        let padding = (stride as u32).wrapping_sub(image.width() as u32);
        if padding == 0 {
            // The usual image has no padding, and needs no second index.
            return (pixels, &self.pixel);
        }
        for (padded, (&pixel, &row)) in self.padded.iter_mut().zip(self.pixel.iter().zip(&self.row))
        {
            *padded = pixel.wrapping_add(padding.wrapping_mul(row as u32));
        }
        (pixels, &self.padded)
    }
}

/// Eight items of a slice, the default for what is beyond it.
#[inline(always)]
fn loaded<T: Copy + Default>(items: &[T], index: &[u32; BLOCK_SIDE]) -> [T; BLOCK_SIDE] {
    let mut loaded = [T::default(); BLOCK_SIDE];
    for (loaded, &index) in loaded.iter_mut().zip(index) {
        *loaded = items.get(index as usize).copied().unwrap_or_default();
    }
    loaded
}

/// Place of a layer of voxels.
#[derive(Clone, Copy)]
pub(super) struct LayerAt {
    /// The block's first voxel in camera coordinates, m.
    pub corner: Vector3<f32>,
    /// Layer of the block.
    pub z: usize,
}

impl Fusion<'_> {
    /// Fuses layer `z` of a block whose first voxel lies at `corner` in the camera. Whether any
    /// voxel changed; then `scratch` tells
    /// [`Fusion::colour_layer`] which.
    #[inline(always)]
    pub(super) fn layer(
        &self,
        at: LayerAt,
        scratch: &mut Scratch,
        sdf: &mut Layer<i16>,
        weight: &mut Layer<u8>,
    ) -> bool {
        // First where the voxels fall, then what is seen there, then what they differ by: where
        // nothing is to be changed, the rest is left out.
        self.project(at.corner, at.z, scratch);
        self.observe(scratch);
        if !self.measure(scratch) {
            return false;
        }
        self.share(scratch, weight);
        average(scratch, sdf);
        self.count(scratch, weight);
        true
    }

    /// Projects the voxels into the image.
    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "below LAYER_VOXELS, the length of every layer; axes are below 3"
    )]
    fn project(&self, corner: Vector3<f32>, z: usize, scratch: &mut Scratch) {
        let starts =
            // The first voxels of the layer's rows; the others follow along x.
            core::array::from_fn(|y| corner + self.steps[1] * y as f32 + self.steps[2] * z as f32);
        let layers = [&mut scratch.x_m, &mut scratch.y_m, &mut scratch.z_m];
        for (axis, layer) in layers.into_iter().enumerate() {
            fill(layer, &starts, axis, &self.along_x[axis]);
        }
        for i in 0..LAYER_VOXELS {
            let scale = self.focal_px / scratch.z_m[i];
            scratch.column[i] = rounded_i32(scratch.x_m[i] * scale + self.center_u_px);
            scratch.row[i] = rounded_i32(scratch.y_m[i] * scale + self.center_v_px);
            let (column, row) = (scratch.column[i] as u32, scratch.row[i] as u32);
            // A voxel behind the camera, or so near that its column is nonsense, is outside.
            let inside = (scratch.z_m[i] > 0.0) & (column < self.width) & (row < self.height);
            let pixel = row.wrapping_mul(self.width).wrapping_add(column);
            scratch.pixel[i] = if inside { pixel } else { OUTSIDE };
        }
    }

    /// Reads the depths observed.
    #[inline(always)]
    fn observe(&self, scratch: &mut Scratch) {
        for (observed_m, pixel) in
            scratch.observed_m.as_chunks_mut().0.iter_mut().zip(scratch.pixel.as_chunks().0)
        {
            *observed_m = loaded(self.depth_m, pixel);
        }
    }

    /// Compares voxels with what is observed. Whether any is neither unobserved nor hidden.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "below LAYER_VOXELS, the length of every layer")]
    fn measure(&self, scratch: &mut Scratch) -> bool {
        let (truncation_m, behind_m, scale, is_noted) =
            (self.config.truncation_m, self.behind_m, self.scale, self.is_noted);
        let far_m = self.config.far_m;
        let mut any = 0;
        for i in 0..LAYER_VOXELS {
            let observed_m = scratch.observed_m[i];
            let along_z_m = observed_m - scratch.z_m[i];
            // The distance along the normal is that along the ray times the cosine between them.
            let distance_m = if is_noted {
                along_z_m * NotedDepth::wrap(observed_m).obliqueness()
            } else {
                along_z_m
            };
            // A surface too far to be fused tells only what is well before it.
            let least_m = if observed_m > far_m { observed_m * BEFORE_FAR } else { -truncation_m };
            let hit = -i16::from(
                // Behind a surface nothing is known beyond the truncation, nor beyond `behind_m`
                // across it.
                (observed_m > 0.0) & (along_z_m >= least_m) & (distance_m >= -behind_m),
            );
            scratch.hit[i] = hit;
            scratch.distance_m[i] = distance_m;
            scratch.target[i] =
                rounded_i32(clamp_f32(distance_m, -truncation_m, truncation_m) * scale) as i16;
            any |= hit;
        }
        any != 0
    }

    /// Computes the weight of each observation, and its share of the average.
    #[inline(always)]
    fn share(&self, scratch: &mut Scratch, weight: &Layer<u8>) {
        let pasts = weight
            .iter()
            .zip(&scratch.observed_m)
            .map(|(&weight, &observed_m)| self.past(weight, observed_m));
        // Every observation counts one: shares come from the past alone.
        if self.plain_weights {
            scratch
                .share
                .iter_mut()
                .zip(pasts)
                .for_each(|(share, past)| *share = share_of_one(past));
            return;
        }
        // A weight has 8 bits, and the past is at most that.
        scratch.past.iter_mut().zip(pasts).for_each(|(to, past)| *to = past as u8);
        self.weigh(scratch);
        for ((share, &gain), &past) in
            scratch.share.iter_mut().zip(&scratch.gain).zip(&scratch.past)
        {
            *share = self.shares.of(i32::from(past) + i32::from(gain), i32::from(gain));
        }
    }

    /// Weights of the observations; 0 keeps one out.
    #[inline(always)]
    fn weigh(&self, scratch: &mut Scratch) {
        let most = self.config.observation_weight.most() as f32;
        for (gain, (&observed_m, &distance_m)) in
            scratch.gain.iter_mut().zip(scratch.observed_m.iter().zip(&scratch.distance_m))
        {
            // A quarter in the free space before the surface's band.
            let at_1_m = if distance_m >= self.free_m { 25.0 } else { 100.0 };
            let weight = floored_i32(clamp_f32(at_1_m / observed_m, 1.0, most));
            *gain = weight as i16 & -i16::from(observed_m > 0.0);
        }
        let Some(class) = self.seen.class else { return };
        for (gain, (&column, &row)) in scratch
            .gain
            .iter_mut()
            .zip(scratch.column.iter().zip(&scratch.row))
            .filter(|(gain, _)| **gain > 0)
        {
            let class = class.get(column as usize, row as usize).map(usize::from);
            let by_class = class
                .and_then(|class| self.config.class_weight.get(class % CLASS_COUNT))
                .copied()
                .unwrap_or(1);
            *gain = (*gain * i16::from(by_class)).min(MAX_OBSERVATION_WEIGHT);
        }
    }

    /// Returns the weight of a voxel's past against an observation at a depth.
    #[inline(always)]
    fn past(&self, weight: u8, observed_m: f32) -> i32 {
        let most = rounded_i32(min_f32(observed_m * self.past_per_m, 255.0));
        if most < i32::from(weight) { most } else { i32::from(weight) }
    }

    /// Counts the observations.
    #[inline(always)]
    fn count(&self, scratch: &Scratch, weight: &mut Layer<u8>) {
        let most = self.config.max_weight;
        for (weight, (gain, hit)) in weight.iter_mut().zip(scratch.gain.iter().zip(&scratch.hit)) {
            let sum = weight.saturating_add((gain & hit) as u8);
            *weight = if sum < most { sum } else { most };
        }
    }
}

/// Sets a coordinate of all voxels, from those of the first voxels of its rows on.
#[inline(always)]
fn fill(
    layer: &mut Layer<f32>,
    starts: &[Vector3<f32>; BLOCK_SIDE],
    axis: usize,
    along: &[f32; BLOCK_SIDE],
) {
    for (row, start) in layer.as_chunks_mut::<BLOCK_SIDE>().0.iter_mut().zip(starts) {
        let start = start[axis];
        for (coordinate, along) in row.iter_mut().zip(along) {
            *coordinate = start + along;
        }
    }
}

/// `old + round((seen - old) * share)` of a share times -32,768, as a sum of two products of 16
/// bits.
#[inline(always)]
pub(super) fn averaged(old: i32, seen: i32, share: i16) -> i32 {
    // Both shares are negative, and add up to -32,768.
    let rest = i16::MIN.wrapping_sub(share);
    ((1 << 14) - (old * i32::from(rest) + seen * i32::from(share))) >> 15
}

/// Moves distances towards what is observed.
#[inline(always)]
fn average(scratch: &Scratch, sdf: &mut Layer<i16>) {
    let observed = scratch.share.iter().zip(&scratch.target).zip(&scratch.hit);
    for (sdf, ((&share, &target), &hit)) in sdf.iter_mut().zip(observed) {
        let new = averaged(i32::from(*sdf), i32::from(target), share) as i16;
        *sdf = (new & hit) | (*sdf & !hit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_one_observation_is_that_of_a_gain_of_one() {
        let shares = Shares::new();
        for past in 0..=255 {
            assert_eq!(share_of_one(past), shares.of(past + 1, 1), "{past}");
        }
    }
}
