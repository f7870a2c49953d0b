//! One aligned run of bytes, and the cutter that turns it into typed regions.

use super::{Footprint, OneShot};
use allocator_api2::boxed::Box;
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
    /// Something did not fit the region computed for it: a bug of the core, not of the caller.
    Misfit,
    /// More regions than the footprint can name: a bug of the core, not of the caller.
    TooManyRegions,
}

/// Bytes that `count` items of `T` occupy in the slab: their size, rounded up to [`SLAB_ALIGN`].
pub const fn region_bytes<T>(count: usize) -> usize {
    (count * size_of::<T>()).next_multiple_of(SLAB_ALIGN)
}

/// Allocates typed, zeroed regions from a slab, front to back, and records each by name.
///
/// A single allocation returns no error: from the first failure on every region is empty, and [`Carver::check`] returns the
/// failure. So a stage is built of its regions without a `Result` at each, which would be a copy of the stage on the stack.
#[derive(Debug)]
pub struct Carver<'s> {
    /// What is not allocated yet; `None` without a slab.
    rest: Option<&'s mut [u8]>,
    footprint: Footprint,
    /// Replaces the names of regions while a group is allocated.
    name: Option<&'static str>,
    failure: Option<SlabError>,
}

impl<'s> Carver<'s> {
    /// Starts at the front of `slab`, of which `wanted` bytes will be used.
    pub fn new(slab: &'s mut [u8], wanted: usize) -> Result<Self, SlabError> {
        if !(slab.as_ptr() as usize).is_multiple_of(SLAB_ALIGN) {
            return Err(SlabError::Misaligned);
        }
        if slab.len() < wanted {
            return Err(SlabError::TooSmall { missing: wanted - slab.len() });
        }
        Ok(Self { rest: Some(slab), ..Self::without_slab() })
    }

    /// Records regions without memory: every region is empty.
    pub fn without_slab() -> Self {
        Self { rest: None, footprint: Footprint::default(), name: None, failure: None }
    }

    /// Allocates `count` zeroed items of `T` and records them under `name`.
    pub fn alloc<T: Pod>(&mut self, name: &'static str, count: usize) -> &'s mut [T] {
        let items = self.alloc_as_found(name, count);
        items.fill(T::zeroed());
        items
    }

    /// As [`Carver::alloc`], without clearing: for big regions whose items are cleared as they come into use, so that a slab
    /// much larger than the map costs neither time nor resident memory.
    pub fn alloc_as_found<T: Pod>(&mut self, name: &'static str, count: usize) -> &'s mut [T] {
        let region = self.take(name, region_bytes::<T>(count));
        let items = region.get_mut(..count * size_of::<T>()).unwrap_or_default();
        let cast = bytemuck::try_cast_slice_mut(items);
        self.require_fit(cast.is_ok());
        cast.unwrap_or_default()
    }

    /// Moves `value`, which is not plain data, into `bytes` of the slab: a stated number, which must not depend on the width of
    /// pointers. The value is never dropped.
    pub fn alloc_value<T: 's>(&mut self, name: &'static str, bytes: usize, value: T) -> Option<&'s mut T> {
        let made = Box::try_new_in(value, OneShot::new(self.alloc_as_found(name, bytes)));
        self.require_fit(made.is_ok());
        made.ok().map(Box::leak)
    }

    /// Takes `bytes` off the front and records them.
    fn take(&mut self, name: &'static str, bytes: usize) -> &'s mut [u8] {
        if self.failure.is_some() {
            return &mut [];
        }
        let region = match &mut self.rest {
            Some(rest) if rest.len() < bytes => {
                self.failure = Some(SlabError::TooSmall { missing: bytes - rest.len() });
                return &mut [];
            }
            Some(rest) => rest.split_off_mut(..bytes).unwrap_or_default(),
            None => &mut [],
        };
        if !self.footprint.record(self.name.unwrap_or(name), bytes) {
            self.failure = Some(SlabError::TooManyRegions);
        }
        region
    }

    /// Records all that `alloc` allocates as one region: for arrays of stages, whose regions would have too many names.
    pub fn group<R>(&mut self, name: &'static str, alloc: impl FnOnce(&mut Self) -> R) -> R {
        self.name = Some(name);
        let made = alloc(self);
        self.name = None;
        made
    }

    /// Records a failure unless a value fits its region. Without a slab there is no region.
    pub(crate) fn require_fit(&mut self, fits: bool) {
        if self.rest.is_some() && !fits {
            self.failure.get_or_insert(SlabError::Misfit);
        }
    }

    /// Whether every region was allocated. After a failure nothing built from the regions may be used.
    ///
    /// # Errors
    /// The first failure.
    pub fn check(&self) -> Result<(), SlabError> {
        self.failure.map_or(Ok(()), Err)
    }

    /// The recorded regions.
    pub fn into_footprint(self) -> Footprint {
        self.footprint
    }

    /// The regions recorded so far.
    pub fn footprint(&self) -> &Footprint {
        &self.footprint
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn allocates_aligned_zeroed_regions_and_records_them() {
        let mut slab = std::boxed::Box::new(Slab([7u8; 256]));
        let mut carver = Carver::new(&mut slab.0, 256).unwrap();
        let a = carver.alloc::<u16>("a", 5);
        let b = carver.alloc::<u64>("b", 16);
        assert_eq!(a, [0; 5]);
        assert_eq!(b, [0; 16]);
        assert_eq!(b.as_ptr() as usize % SLAB_ALIGN, 0);
        assert_eq!(carver.alloc_as_found::<u8>("c", 2), [7; 2]);
        let footprint = carver.footprint();
        assert_eq!(footprint.bytes(), 256);
        assert_eq!(footprint.region("b").unwrap().bytes, 128);
        assert_eq!(carver.check(), Ok(()));
    }

    #[test]
    fn after_the_first_failure_allocates_nothing_and_returns_that_failure() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 192]));
        let mut carver = Carver::new(&mut slab.0, 192).unwrap();
        assert_eq!(carver.alloc::<u8>("a", 64).len(), 64);
        assert_eq!(carver.alloc::<u8>("b", 200).len(), 0);
        assert_eq!(carver.alloc::<u8>("c", 1_000).len(), 0);
        assert_eq!(carver.alloc::<u8>("d", 1).len(), 0, "although there is room");
        assert_eq!(carver.check(), Err(SlabError::TooSmall { missing: 256 - 128 }));
        assert_eq!(carver.footprint().bytes(), 64);
    }

    #[test]
    fn records_a_group_or_one_name_in_a_row_as_one_region() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 512]));
        let mut carver = Carver::new(&mut slab.0, 512).unwrap();
        carver.alloc::<u8>("a", 1);
        carver.alloc::<u8>("a", 65);
        for _ in 0..2 {
            carver.group("both", |carver| (carver.alloc::<u8>("b", 1).len(), carver.alloc::<u8>("c", 1).len()));
        }
        carver.alloc::<u8>("a", 1);
        let regions: std::vec::Vec<_> = carver.footprint().regions().iter().map(|region| (region.name, region.bytes)).collect();
        assert_eq!(regions, [("a", 192), ("both", 256), ("a", 64)]);
    }

    #[test]
    fn more_regions_than_have_names_are_a_failure() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 64 * 128]));
        let mut carver = Carver::new(&mut slab.0, 0).unwrap();
        for name in ["a", "b"].into_iter().cycle().take(120) {
            carver.alloc::<u8>(name, 1);
        }
        assert_eq!(carver.check(), Err(SlabError::TooManyRegions));
    }

    #[test]
    fn names_the_bytes_it_lacks() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 128]));
        assert_eq!(Carver::new(&mut slab.0, 200).unwrap_err(), SlabError::TooSmall { missing: 72 });
        assert_eq!(Carver::new(&mut slab.0[1..], 64).unwrap_err(), SlabError::Misaligned);
    }
}
