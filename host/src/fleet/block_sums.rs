//! Sums of one block's voxels over maps.

use dynvox_core::volume::BLOCK_VOXELS;

/// Largest sum of weights of a voxel whose sum of weight times distance certainly fits 32 bits:
/// 65,538 times 32,767 does.
pub const MAX_WEIGHT: u32 = 65_535;

type Voxels<T> = [T; BLOCK_VOXELS];

/// Sums of one block's voxels. Additions wrap around, so that they can be done in any order; a
/// voxel with more than [`MAX_WEIGHT`] is counted and left out where its average is taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockSums {
    /// Weight times signed distance, in units of truncation / 32,767.
    pub distance: Box<Voxels<i32>>,
    /// Weight.
    pub weight: Box<Voxels<u32>>,
    /// Weight times red, green and blue, where the map has colour.
    pub colour: Option<Box<[Voxels<u32>; 3]>>,
}

/// Averages of one block, as a volume holds them.
pub struct BlockAverage {
    /// Signed distances.
    pub sdf: Box<Voxels<i16>>,
    /// Weights, at most 255.
    pub weight: Box<Voxels<u8>>,
    /// Red, green and blue, where the map has colour.
    pub colour: Option<Box<[Voxels<u8>; 3]>>,
    /// Voxels with more than [`MAX_WEIGHT`], which are left out.
    pub overflowed: u64,
}

impl BlockSums {
    /// Makes sums without observations.
    pub fn zero(colour: bool) -> Self {
        Self {
            distance: Box::new([0; BLOCK_VOXELS]),
            weight: Box::new([0; BLOCK_VOXELS]),
            colour: colour.then(|| Box::new([[0; BLOCK_VOXELS]; 3])),
        }
    }

    /// Returns true if no voxel was observed.
    pub fn is_empty(&self) -> bool {
        self.weight.iter().all(|weight| *weight == 0)
    }

    /// Adds an observation of a voxel.
    pub fn observe(&mut self, voxel: usize, sdf: i16, weight: u8, colour: [u8; 3]) {
        let of = u32::from(weight);
        // The sum of weight times distance; the average divides it again.
        self.distance[voxel] =
            self.distance[voxel].wrapping_add(i32::from(sdf) * i32::from(weight));
        self.weight[voxel] = self.weight[voxel].wrapping_add(of);
        if let Some(planes) = &mut self.colour {
            planes.iter_mut().zip(colour).for_each(|(plane, value)| {
                plane[voxel] = plane[voxel].wrapping_add(of * u32::from(value))
            });
        }
    }

    /// Adds the sums of another map. Both have colour, or neither.
    pub fn add(&mut self, other: &Self) {
        self.distance
            .iter_mut()
            .zip(&*other.distance)
            .for_each(|(sum, value)| *sum = sum.wrapping_add(*value));
        self.weight
            .iter_mut()
            .zip(&*other.weight)
            .for_each(|(sum, value)| *sum = sum.wrapping_add(*value));
        if let (Some(sums), Some(values)) = (&mut self.colour, &other.colour) {
            let pairs = sums.as_flattened_mut().iter_mut().zip(values.as_flattened());
            pairs.for_each(|(sum, value)| *sum = sum.wrapping_add(*value));
        }
    }

    /// The averages, rounded to the nearest, halves away from zero.
    pub fn average(&self) -> BlockAverage {
        let mut average = BlockAverage {
            sdf: Box::new([0; BLOCK_VOXELS]),
            weight: Box::new([0; BLOCK_VOXELS]),
            colour: self.colour.is_some().then(|| Box::new([[0; BLOCK_VOXELS]; 3])),
            overflowed: 0,
        };
        for (voxel, &weight) in self.weight.iter().enumerate() {
            // Never seen, or seen so often that the sums could have overflowed.
            if weight == 0 || weight > MAX_WEIGHT {
                average.overflowed += u64::from(weight > 0);
                continue;
            }
            average.sdf[voxel] = nearest(i64::from(self.distance[voxel]), weight) as i16;
            // A voxel's weight has 8 bits; more observations add little.
            average.weight[voxel] = weight.min(255) as u8;
            if let (Some(planes), Some(sums)) = (&mut average.colour, &self.colour) {
                planes.iter_mut().zip(&**sums).for_each(|(plane, sums)| {
                    plane[voxel] = nearest(i64::from(sums[voxel]), weight) as u8
                });
            }
        }
        average
    }

    /// The sums as bytes: for each array all lowest bytes, then the next ones, so that they
    /// compress.
    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        let weights = self.weight.iter().copied();
        // The buffer is used again for each block.
        bytes.clear();
        planes(bytes, self.distance.iter().map(|value| value.cast_unsigned()));
        planes(bytes, weights);
        self.colour
            .iter()
            .flat_map(|colour| colour.iter())
            .for_each(|plane| planes(bytes, plane.iter().copied()));
    }

    /// Sums from their bytes; `None` of another number of bytes.
    pub(super) fn read(bytes: &[u8], colour: bool) -> Option<Self> {
        let mut sums = Self::zero(colour);
        if bytes.len() != Self::bytes(colour) {
            return None;
        }
        // Arrays of one length, in the order of `write`.
        let mut arrays = bytes.chunks_exact(4 * BLOCK_VOXELS);
        let mut next = || arrays.next().map(numbers);
        sums.distance.iter_mut().zip(next()?).for_each(|(to, value)| *to = value.cast_signed());
        sums.weight.iter_mut().zip(next()?).for_each(|(to, value)| *to = value);
        for plane in sums.colour.iter_mut().flat_map(|colour| colour.iter_mut()) {
            plane.iter_mut().zip(next()?).for_each(|(to, value)| *to = value);
        }
        Some(sums)
    }

    /// Number of bytes.
    pub(super) const fn bytes(colour: bool) -> usize {
        BLOCK_VOXELS * 4 * if colour { 5 } else { 2 }
    }
}

/// The quotient, rounded to the nearest, halves away from zero.
fn nearest(sum: i64, weight: u32) -> i64 {
    let weight = i64::from(weight);
    (2 * sum + sum.signum() * weight) / (2 * weight)
}

fn planes(bytes: &mut Vec<u8>, values: impl Iterator<Item = u32> + Clone) {
    for shift in [0, 8, 16, 24] {
        bytes.extend(values.clone().map(|value| (value >> shift) as u8));
    }
}

fn numbers(bytes: &[u8]) -> impl Iterator<Item = u32> + '_ {
    let plane = |which: usize| &bytes[which * BLOCK_VOXELS..][..BLOCK_VOXELS];
    let planes = [plane(0), plane(1), plane(2), plane(3)];
    (0..BLOCK_VOXELS).map(move |voxel| u32::from_le_bytes(planes.map(|plane| plane[voxel])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(seed: u32) -> BlockSums {
        let mut sums = BlockSums::zero(true);
        for voxel in 0..BLOCK_VOXELS {
            // Spread over all bits, so that no two voxels are alike.
            let mixed = (voxel as u32 ^ seed).wrapping_mul(2_654_435_761);
            sums.observe(
                voxel,
                (mixed >> 16) as i16,
                (mixed >> 4) as u8,
                [mixed as u8, (mixed >> 8) as u8, 7],
            );
        }
        sums
    }

    #[test]
    fn sums_come_back_from_their_bytes() {
        let (sums, mut bytes) = (sums(5), Vec::new());
        sums.write(&mut bytes);
        assert_eq!(
            (bytes.len(), BlockSums::read(&bytes, true)),
            (BlockSums::bytes(true), Some(sums))
        );
        assert_eq!(BlockSums::read(&bytes, false), None);
    }

    #[test]
    fn any_order_gives_the_same_sums() {
        let maps: Vec<_> = (0..7).map(sums).collect();
        let added = |order: &[usize]| {
            let mut sum = BlockSums::zero(true);
            order.iter().for_each(|&map| sum.add(&maps[map]));
            sum
        };
        // Maps added in another order, and by way of two sums.
        let (mut left, right) = (added(&[6, 1, 3]), added(&[0, 5, 2, 4]));
        left.add(&right);
        assert_eq!(left, added(&[0, 1, 2, 3, 4, 5, 6]));
    }

    #[test]
    fn averages_are_rounded_and_overflow_is_counted() {
        let mut sums = BlockSums::zero(false);
        sums.observe(0, -3, 1, [0; 3]);
        sums.observe(0, -4, 1, [0; 3]);
        // With their weights: (2 * 100 - 50) / 3 is 50.
        sums.observe(1, 100, 2, [0; 3]);
        sums.observe(1, -50, 1, [0; 3]);
        // 257 times 255 is the greatest weight that is no overflow.
        for _ in 0..257 {
            sums.observe(2, i16::MIN, 255, [0; 3]);
        }
        assert_eq!(sums.weight[2], MAX_WEIGHT);
        sums.observe(3, 5, 255, [0; 3]);
        // An overflown voxel counts as never observed.
        sums.weight[3] += MAX_WEIGHT;
        let average = sums.average();
        assert_eq!(
            (average.sdf[0], average.weight[0], average.sdf[1], average.weight[1]),
            (-4, 2, 50, 3)
        );
        assert_eq!(
            (average.sdf[2], average.weight[2], average.weight[3], average.overflowed),
            (i16::MIN, 255, 0, 1)
        );
    }
}
