//! Images of one camera brought to one brightness before they are matched.
//!
//! Features are peaks above a fixed response and descriptors are differences of levels, so that
//! images of unlike exposure have few matches. Where the brightness of two images differs by more
//! than ordinary control of the exposure does in a frame, the darker one is multiplied. Below
//! [`RATIO_MIN_Q8`] nothing changes, bit for bit; beyond [`RATIO_MAX_Q8`] too little is left of the
//! darker image.
//!
//! **Time.** One sum over each image. **Memory.** None.

use crate::image::View;

/// Ratio of mean levels from which the darker image is multiplied, in 1/256.
const RATIO_MIN_Q8: u64 = 410;
/// Largest such ratio, in 1/256.
const RATIO_MAX_Q8: u64 = 4 * 256;
/// Brightest mean level to which an image is multiplied: beyond it much is saturated.
const LEVEL_MAX: u64 = 170;

/// Number of levels whose sum 16 bits hold.
const SUMMED: usize = 256;

/// The image of a pair that is multiplied, and by how much, in 1/256.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gain {
    /// Both stay.
    None,
    /// The image before is the darker one.
    Previous(u32),
    /// The image that came last is the darker one.
    Current(u32),
}

/// Sum of an image's levels.
pub(super) fn brightness(image: View<'_, u8>) -> u64 {
    // Sums of 16 bits have four times as many lanes as the whole one.
    let sum = |levels: &[u8]| u64::from(levels.iter().map(|&level| u16::from(level)).sum::<u16>());
    image.rows().flat_map(|row| row.chunks(SUMMED)).map(sum).sum()
}

impl Gain {
    /// Compares the brightness of two images of so many pixels.
    pub(super) fn from_brightness(previous: u64, current: u64, pixels: usize) -> Self {
        let (dark, bright) =
            if previous < current { (previous, current) } else { (current, previous) };
        // A black image has nothing to be multiplied.
        let ratio_q8 = (256 * bright).checked_div(dark).unwrap_or(u64::MAX);
        if !(RATIO_MIN_Q8..=RATIO_MAX_Q8).contains(&ratio_q8) || bright > LEVEL_MAX * pixels as u64
        {
            Self::None
        } else if previous < current {
            Self::Previous(ratio_q8 as u32)
        } else {
            Self::Current(ratio_q8 as u32)
        }
    }
}

/// Multiplies levels.
pub(super) fn multiply(levels: &mut [u8], gain_q8: u32) {
    for level in levels {
        let product = (u32::from(*level) * gain_q8 + 128) >> 8;
        *level = if product > 255 { 255 } else { product as u8 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_step_of_exposure_that_can_be_undone_is() {
        let gain = |previous, current| Gain::from_brightness(previous, current, 1);
        // Control of the exposure, a third more or less, leaves the bits as they are.
        assert_eq!([gain(100, 133), gain(133, 100)], [Gain::None; 2]);
        assert_eq!(gain(100, 50), Gain::Current(512));
        assert_eq!(gain(50, 100), Gain::Previous(512));
        // Hardly anything is left of one, or the other is white.
        assert_eq!([gain(100, 0), gain(0, 100), gain(100, 20)], [Gain::None; 3]);
        assert_eq!(gain(100, 250), Gain::None);
    }

    #[test]
    fn the_brightness_is_the_sum_of_all_levels_at_any_width() {
        for width in [1, 255, 256, 257, 700] {
            // White, and columns beyond the image that do not count.
            let levels = std::vec![255; 2 * (width + 3)];
            let image = View::with_stride(&levels, width, 2, width + 3).unwrap();
            assert_eq!(brightness(image), 255 * 2 * width as u64);
        }
    }

    #[test]
    fn levels_saturate() {
        let mut levels = [0, 1, 100, 200];
        multiply(&mut levels, 512);
        assert_eq!(levels, [0, 2, 200, 255]);
    }
}
