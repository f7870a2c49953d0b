//! The kernel: eight voxels at a time.

use super::{Fusion, SHARES};
use crate::{
    geometry::scalar::clamp_f32,
    volume::{BLOCK_SIDE, block::Colour},
};
use nalgebra::Vector3;

/// Most that a voxel's past weighs when a colour is averaged in (the original's colour weight).
const COLOUR_WEIGHT: i32 = 5;
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

/// No pixel near the surface.
const NO_PIXEL: u32 = u32::MAX;

/// One value for each voxel of a row.
type Row<T> = [T; BLOCK_SIDE];

/// Where the voxels of a row fall in the image.
struct Spots {
    /// Depth of each voxel, m.
    depth_m: Row<f32>,
    /// Depth observed at its pixel, m; 0 none.
    observed_m: Row<f32>,
    /// Its pixel, as an index into the image; nonsense where nothing is observed.
    pixel: Row<u32>,
    /// Whether any is observed.
    any: bool,
}

impl Fusion<'_> {
    /// Fuses one row of eight voxels whose first lies at `first` in the camera. Whether any changed, and the pixels of those near the
    /// surface, [`NO_PIXEL`] for the others. Loops without branches, one thing each, so that they become vectors.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "i < BLOCK_SIDE, the length of every row")]
    pub(super) fn row(&self, first: Vector3<f32>, sdf: &mut Row<i16>, weight: &mut Row<u8>) -> (bool, Option<Row<u32>>) {
        let spots = self.observe(first);
        if !spots.any {
            return (false, None);
        }
        let truncation_m = self.config.truncation_m;
        let mut distance_m = [0.0f32; BLOCK_SIDE];
        let mut target = [0i32; BLOCK_SIDE];
        let mut hit = [0i32; BLOCK_SIDE];
        for i in 0..BLOCK_SIDE {
            let distance = spots.observed_m[i] - spots.depth_m[i];
            distance_m[i] = distance;
            target[i] = rounded(clamp_f32(distance, -truncation_m, truncation_m) * self.scale);
            hit[i] = i32::from((spots.observed_m[i] > 0.0) & (distance >= -truncation_m));
        }
        if hit == [0; BLOCK_SIDE] {
            return (false, None);
        }
        let (gain, share) = self.shares(&spots, weight);
        for i in 0..BLOCK_SIDE {
            let old = i32::from(sdf[i]);
            let new = blended(old, target[i], share[i]);
            let kept = if hit[i] != 0 { new } else { old };
            sdf[i] = kept as i16;
            let seen = (i32::from(weight[i]) + gain[i] * hit[i]).min(self.max_weight);
            weight[i] = seen as u8;
        }
        let mut near = [NO_PIXEL; BLOCK_SIDE];
        let mut any = false;
        for i in 0..BLOCK_SIDE {
            let is_near = (distance_m[i] <= self.colour_band_m) & (distance_m[i] >= -self.colour_band_m) & (hit[i] & gain[i] != 0);
            near[i] = if is_near { spots.pixel[i] } else { NO_PIXEL };
            any |= is_near;
        }
        (true, any.then_some(near))
    }

    /// What each voxel's observation weighs, and its share of the average.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "i < BLOCK_SIDE, the length of every row; the table's index is held below its length")]
    fn shares(&self, spots: &Spots, weight: &Row<u8>) -> (Row<i32>, Row<i32>) {
        let mut gain = [1; BLOCK_SIDE];
        if !self.plain_weights {
            for (gain, (&pixel, &observed_m)) in gain.iter_mut().zip(spots.pixel.iter().zip(&spots.observed_m)) {
                *gain = self.observation_weight(pixel as usize, observed_m);
            }
        }
        let mut share = [0; BLOCK_SIDE];
        for i in 0..BLOCK_SIDE {
            let sum = i32::from(weight[i]) + gain[i];
            share[i] = (gain[i] * self.shares[sum as usize % SHARES] + 128) >> 8;
        }
        (gain, share)
    }

    /// Where eight voxels fall in the image, the first of them at `first` in the camera.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "i < BLOCK_SIDE, the length of every row")]
    fn observe(&self, first: Vector3<f32>) -> Spots {
        let step = self.steps[0];
        let mut depth_m = [0.0f32; BLOCK_SIDE];
        let mut column = [0i32; BLOCK_SIDE];
        let mut row = [0i32; BLOCK_SIDE];
        for i in 0..BLOCK_SIDE {
            let along = i as f32;
            let z = first.z + step.z * along;
            let scale = self.focal_px / z;
            depth_m[i] = z;
            column[i] = rounded((first.x + step.x * along) * scale + self.center_u_px);
            row[i] = rounded((first.y + step.y * along) * scale + self.center_v_px);
        }
        let mut spots = Spots { depth_m, observed_m: [0.0; BLOCK_SIDE], pixel: [0; BLOCK_SIDE], any: false };
        for i in 0..BLOCK_SIDE {
            // A voxel behind the camera, or so near that its column is nonsense, is outside.
            if (depth_m[i] > 0.0) & ((column[i] as u32) < self.width) & ((row[i] as u32) < self.height) {
                let pixel = row[i] as u32 * self.width + column[i] as u32;
                let observed = self.depth_m.get(pixel as usize).copied().unwrap_or(0.0);
                spots.observed_m[i] = observed;
                spots.pixel[i] = pixel;
                spots.any |= observed > 0.0;
            }
        }
        spots
    }

    /// Averages the colours of a row's pixels near the surface in. `weight` is that after this observation.
    pub(super) fn colour_row(&self, row: usize, near: &Row<u32>, planes: &mut Colour, weight: &Row<u8>) {
        for (i, (&pixel, &weight)) in near.iter().zip(weight).enumerate() {
            if pixel == NO_PIXEL {
                continue;
            }
            let target = self.seen.colour_at(pixel as usize);
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
