//! One aligned run of bytes, and the cutter that turns it into typed regions.

use super::{Footprint, Region};
use bytemuck::Pod;

/// Alignment of the slab and of every region in it, in bytes: a cache line.
pub const SLAB_ALIGN: usize = 64;

/// An aligned slab of `N` bytes, all zero. Put it in a `static` (it lands in `.bss`): a slab on the stack would overflow it.
#[repr(C, align(64))]
pub struct Slab<const N: usize>(pub [u8; N]);

impl<const N: usize> Slab<N> {
    /// A slab of zeros.
    pub const ZERO: Self = Self([0; N]);
}

/// Why a slab cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlabError {
    /// The slab ends `missing` bytes too early for the capacity asked of it.
    TooSmall {
        /// Bytes lacking: a slab longer by exactly this many is enough.
        missing: usize,
    },
    /// The slab does not begin at a multiple of [`SLAB_ALIGN`] bytes.
    Misaligned,
    /// The block index did not fit the region computed for it: a bug of the core, not of the caller.
    IndexRegion,
    /// More regions than the footprint can name: a bug of the core, not of the caller.
    TooManyRegions,
}

/// Bytes that `count` items of `T` occupy in the slab: their size, rounded up to [`SLAB_ALIGN`].
pub const fn region_bytes<T>(count: usize) -> usize {
    (count * size_of::<T>()).next_multiple_of(SLAB_ALIGN)
}

/// Cuts a slab into typed, zeroed regions, front to back, and remembers each by name.
#[derive(Debug)]
pub struct Carver<'s> {
    rest: &'s mut [u8],
    footprint: Footprint,
}

impl<'s> Carver<'s> {
    /// Begins to cut `slab`, of which `wanted` bytes will be used.
    pub fn new(slab: &'s mut [u8], wanted: usize) -> Result<Self, SlabError> {
        if !(slab.as_ptr() as usize).is_multiple_of(SLAB_ALIGN) {
            return Err(SlabError::Misaligned);
        }
        if slab.len() < wanted {
            return Err(SlabError::TooSmall { missing: wanted - slab.len() });
        }
        Ok(Self { rest: slab, footprint: Footprint::default() })
    }

    /// Cuts `count` zeroed items of `T` off the front and books them under `name`.
    pub fn cut<T: Pod>(&mut self, name: &'static str, count: usize) -> Result<&'s mut [T], SlabError> {
        let items = self.cut_as_found(name, count)?;
        items.fill(T::zeroed());
        Ok(items)
    }

    /// As [`Carver::cut`], with whatever the slab holds: for big regions that are cleared piece by piece as they come into use, so that
    /// a slab much larger than the map costs neither time nor resident memory.
    pub fn cut_as_found<T: Pod>(&mut self, name: &'static str, count: usize) -> Result<&'s mut [T], SlabError> {
        let bytes = region_bytes::<T>(count);
        let missing = bytes.saturating_sub(self.rest.len());
        let region = self.rest.split_off_mut(..bytes).ok_or(SlabError::TooSmall { missing })?;
        self.footprint.add(Region { name, bytes, used: bytes, peak: bytes }).map_err(|_| SlabError::TooManyRegions)?;
        let items = region.get_mut(..count * size_of::<T>()).unwrap_or_default();
        bytemuck::try_cast_slice_mut(items).map_err(|_| SlabError::Misaligned)
    }

    /// Ends the cutting; what was cut.
    pub fn into_footprint(self) -> Footprint {
        self.footprint
    }

    /// What has been cut so far.
    pub fn footprint(&self) -> &Footprint {
        &self.footprint
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_aligned_zeroed_regions_and_books_them() {
        let mut slab = std::boxed::Box::new(Slab([7u8; 256]));
        let mut carver = Carver::new(&mut slab.0, 256).unwrap();
        let a = carver.cut::<u16>("a", 5).unwrap();
        let b = carver.cut::<u64>("b", 16).unwrap();
        assert_eq!(a, [0; 5]);
        assert_eq!(b, [0; 16]);
        assert_eq!(b.as_ptr() as usize % SLAB_ALIGN, 0);
        assert_eq!(carver.cut_as_found::<u8>("c", 2).unwrap(), [7; 2]);
        let footprint = carver.footprint();
        assert_eq!(footprint.bytes(), 256);
        assert_eq!(footprint.region("b").unwrap().bytes, 128);
    }

    #[test]
    fn names_the_bytes_it_lacks() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 128]));
        assert_eq!(Carver::new(&mut slab.0, 200).unwrap_err(), SlabError::TooSmall { missing: 72 });
        assert_eq!(Carver::new(&mut slab.0[1..], 64).unwrap_err(), SlabError::Misaligned);
    }
}
