//! Pixels that show nothing: they have no texture to be matched by, and no disparity.

use super::gradient::FLAT;
use crate::image::{DISPARITY_ONE_PX, InvalidPair, InvalidPixels};

/// Levels a plane of gradients at the pixels that are not to be used: descriptors of nothing but
/// such pixels match nothing.
pub(super) fn flatten(invalid: &InvalidPixels<'_>, width: usize, plane: &mut [u8]) {
    for (v, row) in plane.chunks_exact_mut(width.max(1)).enumerate() {
        for u in invalid.in_row(v) {
            if let Some(gradient) = row.get_mut(u) {
                *gradient = FLAT;
            }
        }
    }
}

/// Takes away the disparities (1/256 px) of left pixels that are not to be used, or whose partner
/// is not.
pub(super) fn remove(invalid: &InvalidPair<'_>, width: usize, disparity_q8: &mut [u16]) {
    for (v, row) in disparity_q8.chunks_exact_mut(width.max(1)).enumerate() {
        for (u, disparity) in row.iter_mut().enumerate().filter(|(_, disparity)| **disparity != 0) {
            let pixels = usize::from((*disparity + DISPARITY_ONE_PX / 2) / DISPARITY_ONE_PX);
            let is_unused = |partner| invalid.right.is_some_and(|right| right.contains(partner, v));
            let partner = u.checked_sub(pixels).is_none_or(is_unused);
            if partner || invalid.left.contains(u, v) {
                *disparity = 0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disparity_needs_both_its_pixels() {
        // Left column 5 and right column 1 are not to be used.
        let (left, right) = ([1 << 5], [1 << 1]);
        let [left, right] = [&left, &right].map(|words| InvalidPixels::new(words, 8, 1).unwrap());
        let mut row = [0, 0, 300, 600, 3 * 256, 256, 256, 0];
        remove(&InvalidPair { left, right: Some(right) }, 8, &mut row);
        assert_eq!(row, [0, 0, 0, 0, 0, 0, 256, 0], "2 - 1, 3 - 2 and 4 - 3 are 1");
        let mut row = [0, 0, 300, 600, 3 * 256, 256, 256, 0];
        remove(&InvalidPair { left, right: None }, 8, &mut row);
        assert_eq!(row, [0, 0, 300, 600, 3 * 256, 0, 256, 0], "all of the right image is used");
        let mut plane = [7; 8];
        flatten(&left, 8, &mut plane);
        assert_eq!(plane, [7, 7, 7, 7, 7, FLAT, 7, 7]);
    }
}
