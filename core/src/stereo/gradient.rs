//! Horizontal and vertical 3 x 3 Sobel responses, a quarter of their size about 128, in `u8`.
//!
//! Memory: two bytes a pixel, given by the caller. The outermost pixels have no gradient (128).

use crate::{image::View, parallel::Work};

/// The gradient of a pixel without any.
pub(super) const FLAT: u8 = 128;

/// Fills rows of `du` and `dv`, as wide as the image, that begin at its row `first`.
pub(super) struct GradientRows<'a> {
    pub image: View<'a, u8>,
    pub first: usize,
    pub du: &'a mut [u8],
    pub dv: &'a mut [u8],
}

impl Work for GradientRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { image, first, du, dv } = self;
        let width = image.width().max(1);
        for (v, (du, dv)) in
            (first..).zip(du.chunks_exact_mut(width).zip(dv.chunks_exact_mut(width)))
        {
            // The first and last row have no neighbours on one side.
            let is_inner = v > 0 && v + 1 < image.height();
            if !is_inner || row(image.row(v - 1), image.row(v), image.row(v + 1), du, dv).is_none()
            {
                du.fill(FLAT);
                dv.fill(FLAT);
            }
        }
    }
}

#[inline]
fn quarter(response: i16) -> u8 {
    ((response >> 2) + 128).clamp(0, 255) as u8
}

/// The gradients of an inner row. None where a row is too short.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "every slice is cut to n = width - 2 items, and i < n")]
fn row(above: &[u8], here: &[u8], below: &[u8], du: &mut [u8], dv: &mut [u8]) -> Option<()> {
    let n = du.len().checked_sub(2)?;
    let (a0, a1, a2) = (above.get(..n)?, above.get(1..)?.get(..n)?, above.get(2..)?.get(..n)?);
    let (h0, h2) = (here.get(..n)?, here.get(2..)?.get(..n)?);
    let (b0, b1, b2) = (below.get(..n)?, below.get(1..)?.get(..n)?, below.get(2..)?.get(..n)?);
    // The outer columns lack a neighbour: no gradient.
    for gradients in [&mut *du, &mut *dv] {
        *gradients.first_mut()? = FLAT;
        *gradients.last_mut()? = FLAT;
    }
    // All slices are n long, which lets the loop run without checks, many pixels at a time.
    let (du, dv) = (du.get_mut(1..)?.get_mut(..n)?, dv.get_mut(1..)?.get_mut(..n)?);
    let wide = i16::from;
    for i in 0..n {
        let (right, left) = (
            wide(a2[i]) + 2 * wide(h2[i]) + wide(b2[i]),
            wide(a0[i]) + 2 * wide(h0[i]) + wide(b0[i]),
        );
        du[i] = quarter(right - left);
        let (down, up) = (
            wide(b0[i]) + 2 * wide(b1[i]) + wide(b2[i]),
            wide(a0[i]) + 2 * wide(a1[i]) + wide(a2[i]),
        );
        dv[i] = quarter(down - up);
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_a_constant_gradient_and_an_edge_saturates() {
        // Nine columns that rise by 8 each.
        let ramp: std::vec::Vec<u8> = (0..5 * 9).map(|i| ((i % 9) * 8) as u8).collect();
        let (mut du, mut dv) = (std::vec![0; 45], std::vec![0; 45]);
        GradientRows { image: View::new(&ramp, 9, 5).unwrap(), first: 0, du: &mut du, dv: &mut dv }
            .run();
        assert!(
            du[9 + 1..9 + 8].iter().all(|&g| g == 128 + 16),
            "8 a pixel is a response of 64, a quarter of it 16"
        );
        assert!(dv.iter().all(|&g| g == FLAT));
        // White above, black below.
        let edge: std::vec::Vec<u8> = (0..45).map(|i| if i < 18 { 255 } else { 0 }).collect();
        GradientRows { image: View::new(&edge, 9, 5).unwrap(), first: 0, du: &mut du, dv: &mut dv }
            .run();
        assert_eq!(dv[9 + 4], 0, "-1020 / 4 + 128 saturates");
        assert_eq!(du[9 + 4], FLAT);
    }
}
