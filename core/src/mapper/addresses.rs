//! Check that the bytes of a capacity can be counted where a `usize` has 32 bits.
//!
//! [`Capacity::bytes`] is a constant that sums up in `usize`: for every bound that 64 bits allow it
//! stays far below their end, and 32 bits end at 4 GiB. The bound here is summed up in 64 bits
//! without any overflow, and is never below that sum, nor below any part of it. Where it fits a
//! `usize` so does the sum. It counts some parts for twice what they take, so that it may refuse
//! bounds that need more than 1.5 GiB; a slice has at most 2 GiB there.

use crate::memory::Capacity;

/// Bytes that do not depend on any bound, at most.
const FIXED: u64 = 1 << 20;
/// Bytes of a volume of an object without blocks, at most.
const OBJECT: u64 = 1 << 18;
/// Bytes a unit of each bound, at most.
const PIXEL: u64 = 80;
const FEATURE: u64 = 256;
const MATCH: u64 = 128;
const BLOCK: u64 = 1_632;
const COLOUR_BLOCK: u64 = 3_200;
const VISIBLE_BLOCK: u64 = 512;
const DETECTION: u64 = 512;
const TRACK: u64 = 1_024;
const MASK_WORD: u64 = 16;
const CROP_PIXEL: u64 = 8;
const CELL: u64 = 16;
const COLUMN: u64 = 64;
const KEYFRAME: u64 = 12_288;

const fn product(units: usize, of: u64) -> u64 {
    (units as u64).saturating_mul(of)
}

impl Capacity {
    /// At least as many bytes as [`Capacity::bytes`] sums up; `u64::MAX` for bounds beyond all
    /// limits.
    const fn bytes_at_most(&self) -> u64 {
        let block = if self.colour { COLOUR_BLOCK } else { BLOCK };
        let history =
            product(self.history_frames, product(self.blocks / 64 + 1, 8).saturating_add(64));
        let object = product(self.object_blocks, block).saturating_add(OBJECT);
        let columns = product(self.planning_width, self.planning_length as u64);
        let cells = product(self.planning_height, columns);
        // Products and sums stop at the largest number instead of wrapping: too many is still too
        // many.
        FIXED
            .saturating_add(product(self.image_width, product(self.image_height, PIXEL)))
            .saturating_add(product(self.features, FEATURE))
            .saturating_add(product(self.matches, MATCH))
            .saturating_add(product(self.blocks, block))
            .saturating_add(history)
            .saturating_add(product(self.visible_blocks, VISIBLE_BLOCK))
            .saturating_add(product(self.detections, DETECTION))
            .saturating_add(product(self.tracks, TRACK.saturating_add(product(self.detections, 4))))
            .saturating_add(product(self.mask_words, MASK_WORD))
            .saturating_add(product(self.objects, object))
            .saturating_add(product(self.crop_pixels, CROP_PIXEL))
            .saturating_add(product(self.keyframes, KEYFRAME))
            .saturating_add(columns.saturating_mul(COLUMN))
            .saturating_add(cells.saturating_mul(CELL))
    }

    /// Returns true if [`Capacity::bytes`] can be counted in numbers up to `last`, which on this
    /// machine is `usize::MAX`.
    pub(super) const fn is_countable(&self, last: u64) -> bool {
        self.bytes_at_most() < last
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Config, Mapper, NewError, geometry::StereoRig, memory::SlabError, random::Random};

    const LAST_OF_32: u64 = u32::MAX as u64;

    /// Bounds of any size up to their limits, small ones as likely as large ones.
    fn random_capacity(random: &mut Random) -> Capacity {
        let mut up_to = |bits: u32| {
            // A random number of bits first, so that sizes are spread over their magnitudes.
            let bits = random.below(bits + 1);
            random.below(1 << bits) as usize
        };
        let blocks = 1 + up_to(21);
        Capacity {
            image_width: 64 + up_to(12),
            image_height: 32 + up_to(11),
            raw_width: up_to(12),
            raw_height: up_to(12),
            features: 1 + up_to(20),
            matches: 1 + up_to(20),
            blocks,
            visible_blocks: 1 + up_to(21) % blocks,
            history_frames: 1 + up_to(12),
            detections: up_to(6),
            mask_words: up_to(22),
            tracks: up_to(12),
            objects: up_to(4),
            object_blocks: 1 + up_to(14),
            crop_pixels: up_to(24),
            keyframes: up_to(12),
            planning_width: up_to(10),
            planning_length: up_to(10),
            planning_height: 1 + up_to(8),
            planning_distance_3d: up_to(1) > 0,
            colour: up_to(1) > 0,
        }
    }

    #[test]
    fn the_bound_is_above_the_sum_and_fits_32_bits() {
        let (mut random, mut passed) = (Random::new(4), [0u32; 2]);
        for _ in 0..200_000 {
            let capacity = random_capacity(&mut random);
            assert_eq!(capacity.validate(), Ok(()), "{capacity:?}");
            let (bytes, most) = (capacity.bytes() as u64, capacity.bytes_at_most());
            assert!(bytes <= most, "{bytes} of at most {most}: {capacity:?}");
            assert!(
                // A bound that is far above the sum would refuse capacities that fit.
                most < 3 * bytes + 2 * FIXED + 16 * OBJECT,
                "{bytes} of at most {most}, which says little: {capacity:?}"
            );
            passed[usize::from(capacity.is_countable(LAST_OF_32))] += 1;
        }
        // Without enough capacities on both sides the comparison would test one of them only.
        assert!(
            passed.iter().all(|count| *count > 500),
            "{passed:?} of them beyond and within 4 GiB"
        );
    }

    #[test]
    fn the_largest_bounds_alone_are_beyond_32_bits_and_within_64() {
        let largest: [fn(&mut Capacity); 6] = [
            |of| of.blocks = 1 << 28,
            |of| of.features = 1 << 28,
            |of| of.matches = 1 << 28,
            |of| of.tracks = 1 << 28,
            |of| (of.objects, of.object_blocks) = (16, 1 << 28),
            |of| {
                (of.planning_width, of.planning_length, of.planning_height) =
                    (1 << 10, 1 << 10, 1 << 10)
            },
        ];
        for (at, change) in largest.iter().enumerate() {
            let mut capacity = Capacity::TINY;
            change(&mut capacity);
            assert!(
                capacity.bytes() as u64 > LAST_OF_32 && !capacity.is_countable(LAST_OF_32),
                "bound {at}"
            );
            assert!(capacity.is_countable(u64::MAX) && capacity.validate().is_ok(), "bound {at}");
        }
        // These end in a small number where 32 bits are all there is: 1,400,000 x 3,128 and some.
        let wraps = Capacity { blocks: 1_400_000, colour: true, ..Capacity::TINY };
        assert!(
            (wraps.bytes() as u64 & LAST_OF_32) < 1 << 28 && !wraps.is_countable(LAST_OF_32),
            "{}",
            wraps.bytes()
        );
    }

    #[test]
    fn all_profiles_can_be_counted_in_32_bits() {
        for (name, capacity) in Capacity::PROFILES {
            assert!(capacity.is_countable(LAST_OF_32), "{name}");
        }
    }

    #[test]
    fn bounds_that_cannot_be_counted_are_refused_before_they_are_summed_up() {
        let beyond = Capacity { blocks: usize::MAX / 2, ..Capacity::TINY };
        assert_eq!(beyond.bytes_at_most(), u64::MAX);
        let rig =
            StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
        let refused = Mapper::new(&beyond, &Config::for_rig(rig), &mut []).err();
        assert_eq!(refused, Some(NewError::Slab(SlabError::TooSmall { missing: usize::MAX })));
    }
}
