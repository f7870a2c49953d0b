//! The right image moved along its columns, so that rows agree with the left one's.
//!
//! Memory: one byte a pixel. Time: two reads and two products a pixel.

use crate::{
    geometry::RowShift,
    image::View,
    memory::{Capacity, Carver, region_bytes},
    parallel::{Bands, Executor, Work, each, zip2},
    slices::clipped_mut,
};

/// Columns that move by the same: over so few, what a calibration leaves changes by a few
/// hundredths of a pixel.
const BLOCK: usize = 16;
/// Parts of a row, and the shift that makes rows of them.
const ONE_ROW: i32 = 1 << ROW_SHIFT;
const ROW_SHIFT: u32 = 8;

/// Memory of the right image with rows that agree.
#[derive(Debug, Default)]
pub(crate) struct AlignedImage<'s>(&'s mut [u8]);

impl<'s> AlignedImage<'s> {
    pub(crate) const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<u8>(capacity.pixels())
    }

    pub(crate) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self(carver.alloc("rectify.aligned", capacity.pixels()))
    }

    /// Moves every pixel of the right image down by what `shift` says there; rows beyond the image
    /// are its first and last ones.
    pub(crate) fn align<E: Executor>(
        &mut self,
        right: View<'_, u8>,
        shift: &RowShift,
        executor: &E,
    ) -> Option<View<'_, u8>> {
        let (width, height) = (right.width(), right.height());
        let bands = Bands::new(height);
        // The buffer is for the capacity's largest image.
        let rows = clipped_mut(self.0, ..width * height);
        each(executor, zip2(bands.first(), bands.split_mut(rows, width)), |(first, rows)| {
            executor.vectors().run(AlignRows { right, shift, first, rows });
        });
        View::new(self.0, width, height)
    }
}

/// Some rows of the moved image, from `first` on.
struct AlignRows<'a> {
    right: View<'a, u8>,
    shift: &'a RowShift,
    first: usize,
    rows: &'a mut [u8],
}

impl Work for AlignRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { right, shift, first, rows } = self;
        for (v, row) in (first..).zip(rows.chunks_exact_mut(right.width().max(1))) {
            for (block, pixels) in row.chunks_mut(BLOCK).enumerate() {
                let u = block * BLOCK;
                // One shift for a block: it changes little from pixel to pixel.
                let (upper, lower, share) =
                    source(right.height(), v, shift.at([(u + BLOCK / 2) as f32, v as f32]));
                let (upper, lower) = (right.row(upper), right.row(lower));
                let (Some(upper), Some(lower)) =
                    (upper.get(u..u + pixels.len()), lower.get(u..u + pixels.len()))
                else {
                    return;
                };
                for (pixel, (&upper, &lower)) in pixels.iter_mut().zip(upper.iter().zip(lower)) {
                    // Fixed point, halves rounded up: the same on every machine.
                    let sum =
                        u16::from(upper) * (ONE_ROW as u16 - share) + u16::from(lower) * share;
                    *pixel = ((sum + ONE_ROW as u16 / 2) >> ROW_SHIFT) as u8;
                }
            }
        }
    }
}

/// The two rows between which row `v` comes from, and how far it lies towards the lower one, in
/// parts of [`ONE_ROW`].
#[inline(always)]
fn source(height: usize, v: usize, shift_px: f32) -> (usize, usize, u16) {
    let last = (height as i32 - 1) << ROW_SHIFT;
    // A cast saturates, and no number becomes 0.
    let at = ((v as i32) << ROW_SHIFT)
        .saturating_sub((shift_px * ONE_ROW as f32) as i32)
        .max(0)
        .min(last);
    let upper = (at >> ROW_SHIFT) as usize;
    (upper, (upper + 1).min(height - 1), (at & (ONE_ROW - 1)) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Serial,
        geometry::{RowCorrection, StereoRig},
        memory::SLAB_ALIGN,
    };
    use std::{vec, vec::Vec};

    const CAPACITY: Capacity = Capacity { image_width: 70, image_height: 40, ..Capacity::TINY };
    const RIG: StereoRig =
        StereoRig { focal_px: 60.0, center_u_px: 35.0, center_v_px: 20.0, baseline_m: 0.5 };

    /// An image whose grey values are four times their row, moved.
    fn moved(terms: [f64; 6]) -> Vec<u8> {
        let bytes = AlignedImage::bytes(&CAPACITY);
        let mut slab = vec![0; bytes + SLAB_ALIGN];
        let mut carver = Carver::new(&mut slab, bytes).unwrap();
        let mut aligned = AlignedImage::new_in(&CAPACITY, &mut carver);
        let pixels: Vec<u8> = (0..70 * 40).map(|at| (at / 70 * 4) as u8).collect();
        let shift = RowCorrection::of_terms(terms).for_rig(&RIG);
        aligned
            .align(View::new(&pixels, 70, 40).unwrap(), &shift, &Serial)
            .unwrap()
            .pixels()
            .to_vec()
    }

    #[test]
    fn rows_move_by_parts_of_a_pixel_and_end_at_the_borders() {
        let at = |image: &[u8], u: usize, v: usize| image[v * 70 + u];
        // The image's rows rise by 4 grey levels each: half a row is two levels.
        let down = moved([1.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(
            [at(&down, 3, 0), at(&down, 3, 1), at(&down, 3, 10), at(&down, 69, 39)],
            [0, 0, 34, 150]
        );
        let up = moved([-1.25, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(
            [at(&up, 3, 0), at(&up, 3, 10), at(&up, 69, 38), at(&up, 69, 39)],
            [5, 45, 156, 156]
        );
        // However wrong the shift, rows are taken from within the image.
        for nonsense in [f64::NAN, f64::INFINITY, -1e30, 1e30] {
            assert_eq!(moved([nonsense, 0.0, 0.0, 0.0, 0.0, 0.0]).len(), 70 * 40);
        }
    }

    #[test]
    fn a_turn_moves_both_sides_against_each_other() {
        let turned = moved([0.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
        let row = |u: usize| i32::from(turned[20 * 70 + u]);
        assert!(row(0) > 84 && row(69) < 76, "{} {}", row(0), row(69));
        assert!((row(34) - 80).abs() <= 2);
    }
}
