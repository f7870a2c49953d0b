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

/// Cuts a slab into typed, zeroed regions, front to back, and remembers each by name.
///
/// Cutting does not fail one by one: from the first failure on what is cut is empty, and [`Carver::check`] tells of it. So
/// making rooms of regions takes no `Result` on the way, each of which would be a copy of the room on the stack.
#[derive(Debug)]
pub struct Carver<'s> {
    /// What is not cut yet; `None` without a slab.
    rest: Option<&'s mut [u8]>,
    footprint: Footprint,
    /// What regions are booked under, whatever they are called.
    name: Option<&'static str>,
    failure: Option<SlabError>,
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
        Ok(Self { rest: Some(slab), ..Self::without_slab() })
    }

    /// Only books: whatever is cut is empty.
    pub fn without_slab() -> Self {
        Self { rest: None, footprint: Footprint::default(), name: None, failure: None }
    }

    /// Cuts `count` zeroed items of `T` off the front and books them under `name`.
    pub fn cut<T: Pod>(&mut self, name: &'static str, count: usize) -> &'s mut [T] {
        let items = self.cut_as_found(name, count);
        items.fill(T::zeroed());
        items
    }

    /// As [`Carver::cut`], with whatever the slab holds: for big regions that are cleared piece by piece as they come into use, so that
    /// a slab much larger than the map costs neither time nor resident memory.
    pub fn cut_as_found<T: Pod>(&mut self, name: &'static str, count: usize) -> &'s mut [T] {
        let region = self.take(name, region_bytes::<T>(count));
        let items = region.get_mut(..count * size_of::<T>()).unwrap_or_default();
        let cast = bytemuck::try_cast_slice_mut(items);
        self.ask(cast.is_ok());
        cast.unwrap_or_default()
    }

    /// Moves `thing`, which is no plain data, into `bytes` of the slab: a stated number, not to depend on how wide a machine's pointers are. It is
    /// never dropped.
    pub fn put<T: 's>(&mut self, name: &'static str, bytes: usize, thing: T) -> Option<&'s mut T> {
        let put = Box::try_new_in(thing, OneShot::new(self.cut_as_found(name, bytes)));
        self.ask(put.is_ok());
        put.ok().map(Box::leak)
    }

    /// Takes `bytes` off the front and books them.
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
        if !self.footprint.book(self.name.unwrap_or(name), bytes) {
            self.failure = Some(SlabError::TooManyRegions);
        }
        region
    }

    /// Books all that `cut` cuts as one region: for many things alike, whose regions would have too many names.
    pub fn as_one<R>(&mut self, name: &'static str, cut: impl FnOnce(&mut Self) -> R) -> R {
        self.name = Some(name);
        let made = cut(self);
        self.name = None;
        made
    }

    /// Notes whether something fits the region cut for it. Without a slab there is none.
    pub(crate) fn ask(&mut self, fits: bool) {
        if self.rest.is_some() && !fits {
            self.failure.get_or_insert(SlabError::Misfit);
        }
    }

    /// Whether all was cut. Where it was not, what was made of it is not to be used.
    ///
    /// # Errors
    /// The first failure.
    pub fn check(&self) -> Result<(), SlabError> {
        self.failure.map_or(Ok(()), Err)
    }

    /// Ends the cutting; what was booked.
    pub fn into_footprint(self) -> Footprint {
        self.footprint
    }

    /// What has been booked so far.
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
        let a = carver.cut::<u16>("a", 5);
        let b = carver.cut::<u64>("b", 16);
        assert_eq!(a, [0; 5]);
        assert_eq!(b, [0; 16]);
        assert_eq!(b.as_ptr() as usize % SLAB_ALIGN, 0);
        assert_eq!(carver.cut_as_found::<u8>("c", 2), [7; 2]);
        let footprint = carver.footprint();
        assert_eq!(footprint.bytes(), 256);
        assert_eq!(footprint.region("b").unwrap().bytes, 128);
        assert_eq!(carver.check(), Ok(()));
    }

    #[test]
    fn after_the_first_failure_cuts_nothing_and_tells_of_that_one() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 192]));
        let mut carver = Carver::new(&mut slab.0, 192).unwrap();
        assert_eq!(carver.cut::<u8>("a", 64).len(), 64);
        assert_eq!(carver.cut::<u8>("b", 200).len(), 0);
        assert_eq!(carver.cut::<u8>("c", 1_000).len(), 0);
        assert_eq!(carver.cut::<u8>("d", 1).len(), 0, "although there is room");
        assert_eq!(carver.check(), Err(SlabError::TooSmall { missing: 256 - 128 }));
        assert_eq!(carver.footprint().bytes(), 64);
    }

    #[test]
    fn books_what_is_cut_as_one_or_by_one_name_in_a_row_as_one_region() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 512]));
        let mut carver = Carver::new(&mut slab.0, 512).unwrap();
        carver.cut::<u8>("a", 1);
        carver.cut::<u8>("a", 65);
        for _ in 0..2 {
            carver.as_one("both", |carver| (carver.cut::<u8>("b", 1).len(), carver.cut::<u8>("c", 1).len()));
        }
        carver.cut::<u8>("a", 1);
        let regions: std::vec::Vec<_> = carver.footprint().regions().iter().map(|region| (region.name, region.bytes)).collect();
        assert_eq!(regions, [("a", 192), ("both", 256), ("a", 64)]);
    }

    #[test]
    fn more_regions_than_have_names_are_a_failure() {
        let mut slab = std::boxed::Box::new(Slab([0u8; 64 * 128]));
        let mut carver = Carver::new(&mut slab.0, 0).unwrap();
        for name in ["a", "b"].into_iter().cycle().take(120) {
            carver.cut::<u8>(name, 1);
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
