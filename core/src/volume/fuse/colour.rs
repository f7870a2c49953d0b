//! Colours of a layer's voxels: read where there is one to average in, averaged 64 at a time.

use super::{
    Fusion,
    layer::{Scratch, averaged, share_of_one},
};
use crate::{
    flags::bits,
    volume::{
        NotedDepth,
        block::{LAYER_VOXELS, Layer},
    },
};
use bytemuck::TransparentWrapper;
use core::ops::Range;

/// Most that a voxel's past weighs when a colour is averaged in (the original's colour weight).
const MAX_PAST: usize = 5;
/// Voxels of a quarter of a layer.
const QUARTER: usize = LAYER_VOXELS / 4;
/// The shares of a colour seen for each weight of the past, times -32,768.
const COLOUR_SHARES: [i16; MAX_PAST + 1] = [
    share_of_one(0),
    share_of_one(1),
    share_of_one(2),
    share_of_one(3),
    share_of_one(4),
    share_of_one(5),
];

impl Fusion<'_> {
    /// Averages the colours at voxels near the surface in, after [`Fusion::layer`]. `weight` is
    /// that after this observation.
    #[expect(
        clippy::indexing_slicing,
        reason = "masks keep voxels below LAYER_VOXELS, the length of every layer"
    )]
    #[inline(always)]
    pub(super) fn colour_layer(
        &self,
        scratch: &mut Scratch,
        [red, green, blue]: [&mut Layer<u8>; 3],
        weight: &Layer<u8>,
    ) {
        // Away from the surface the colour would be that of something before or behind it.
        let near = self.near_surface(scratch);
        // Where none is near, no pixel need be read: a third of the quarters has none.
        let Some(shown) = quarters(&near) else { return };
        let (mut reds, mut greens, mut blues) =
            ([0; LAYER_VOXELS], [0; LAYER_VOXELS], [0; LAYER_VOXELS]);
        match self.seen.colour {
            Some(image) => scratch
                .pixels_at(bits(&near), image, |i, pixel| [reds[i], greens[i], blues[i]] = pixel),
            None => scratch.pixels(shown, self.seen.grey, &mut reds),
        }
        // In between, bytes stored one by one arrive where vectors read them.
        let share = self.colour_shares(scratch, &near, [red, green, blue], weight);
        // What was grey stays grey: one plane is the others.
        let grey = self.seen.colour.is_none() && red == green && green == blue;
        average(red, &reds, &share);
        if grey {
            (*green, *blue) = (*red, *red);
            return;
        }
        if self.seen.colour.is_none() {
            (greens, blues) = (reds, reds);
        }
        average(green, &greens, &share);
        average(blue, &blues, &share);
    }

    /// 1 for each voxel that is observed within the band about the surface, else 0.
    #[inline(always)]
    fn near_surface(&self, scratch: &Scratch) -> Layer<u8> {
        let mut near = [0; LAYER_VOXELS];
        let band_m = self.colour_band_m;
        for (near, ((distance_m, hit), gain)) in
            near.iter_mut().zip(scratch.distance_m.iter().zip(&scratch.hit).zip(&scratch.gain))
        {
            let is_near = (*distance_m <= band_m) & (*distance_m >= -band_m);
            *near = u8::from(is_near & (hit & gain != 0));
        }
        near
    }

    /// The share of the colours seen, times -32,768: all where there is no colour yet, none away
    /// from the surface and where another surface's may be seen.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "below LAYER_VOXELS, the length of every layer")]
    fn colour_shares(
        &self,
        scratch: &Scratch,
        near: &Layer<u8>,
        planes: [&Layer<u8>; 3],
        weight: &Layer<u8>,
    ) -> Layer<i16> {
        let [all, second, third, fourth, fifth, sixth] = COLOUR_SHARES;
        // Depths without notes say nothing of colours: all count.
        let is_noted = self.is_noted;
        let mut share = [0; LAYER_VOXELS];
        for (share, &weight) in share.iter_mut().zip(weight) {
            // By masks: a choice among five becomes branches.
            let from = |sum: i16, change: i16| change & -i16::from(i16::from(weight) >= sum);
            *share = second
                + from(3, third - second)
                + from(4, fourth - third)
                + from(5, fifth - fourth)
                + from(6, sixth - fifth);
        }
        for (share, &observed_m) in share.iter_mut().zip(&scratch.observed_m) {
            *share &= -i16::from(!is_noted | !NotedDepth::wrap(observed_m).has_unreliable_colour());
        }
        for i in 0..LAYER_VOXELS {
            // Black in all planes is what a voxel without colour has.
            let colourless = -i16::from(planes[0][i] | planes[1][i] | planes[2][i] == 0);
            share[i] = (all & colourless | share[i] & !colourless) & -i16::from(near[i]);
        }
        share
    }
}

/// The voxels from the first quarter of a layer that has any of these to the last. `None` without.
#[inline(always)]
fn quarters(voxels: &Layer<u8>) -> Option<Range<usize>> {
    let (quarters, _) = voxels.as_chunks::<QUARTER>();
    let has_any = |quarter: &[u8; QUARTER]| *quarter != [0; QUARTER];
    let first = quarters.iter().position(has_any)?;
    let last = quarters.iter().rposition(has_any)?;
    Some(first * QUARTER..(last + 1) * QUARTER)
}

/// Moves colours towards those seen.
#[inline(always)]
fn average(plane: &mut Layer<u8>, seen: &Layer<u8>, share: &Layer<i16>) {
    for ((colour, &seen), &share) in plane.iter_mut().zip(seen).zip(share) {
        // All 0 is "no colour yet".
        let seen = if seen == 0 { 1 } else { seen };
        *colour = averaged(i32::from(*colour), i32::from(seen), share) as u8;
    }
}
