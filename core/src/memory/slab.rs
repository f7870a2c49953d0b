//! The slab a caller hands over, and the carver that turns it into typed regions.

use super::{Footprint, Placement, in_place::in_place};
use bytemuck::Pod;
use core::{
    fmt,
    ops::{Deref, DerefMut},
};

/// Alignment of every region of a slab, in bytes: a cache line.
///
/// A slab itself may begin anywhere: up to `SLAB_ALIGN - 1` bytes at its front are skipped.
pub const SLAB_ALIGN: usize = 64;

/// An aligned slab of `N` bytes, all zero, for a `static`: it lands in `.bss` and never touches the
/// stack, in debug builds either.
///
/// With an allocator a `vec![0u8; capacity.bytes() + SLAB_ALIGN]` does as well: see
/// [`Mapper::new`](crate::Mapper::new).
///
/// ```
/// use dynvox_core::{Capacity, Slab};
/// use static_cell::ConstStaticCell;
///
/// static SLAB: ConstStaticCell<Slab<{ Capacity::TINY.bytes() }>> = ConstStaticCell::new(Slab::ZERO);
///
/// let slab: &'static mut [u8] = SLAB.take(); // once: a second call panics, `try_take` returns `None`
/// assert_eq!(slab.len(), Capacity::TINY.bytes());
/// ```
#[repr(C, align(64))]
pub struct Slab<const N: usize>(pub [u8; N]);

impl<const N: usize> Slab<N> {
    /// A slab of zeros.
    pub const ZERO: Self = Self([0; N]);
}

impl<const N: usize> Deref for Slab<N> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl<const N: usize> DerefMut for Slab<N> {
    fn deref_mut(&mut self) -> &mut [u8] {
        &mut self.0
    }
}

/// Reason why a slab cannot be used.
///
/// ```
/// use dynvox_core::{Capacity, Config, Mapper, NewError, geometry::StereoRig, memory::SlabError};
///
/// let rig = StereoRig { focal_px: 500.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let error = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut []).unwrap_err();
/// let NewError::Slab(SlabError::TooSmall { missing }) = error else { panic!("{error}") };
/// assert!(missing >= Capacity::TINY.bytes());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SlabError {
    /// The slab is too short for the capacity.
    TooSmall {
        /// Bytes lacking: a slab longer by exactly this many, with the same alignment, is enough.
        missing: usize,
    },
    /// A value did not fit the region computed for it: a bug of the core, not of the caller.
    RegionTooSmall,
    /// More regions than the footprint can name: a bug of the core, not of the caller.
    TooManyRegions,
}

impl fmt::Display for SlabError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooSmall { missing } => write!(f, "the slab is {missing} bytes too small"),
            Self::RegionTooSmall => {
                f.write_str("a value does not fit its region of the slab: a bug of dynvox-core")
            }
            Self::TooManyRegions => {
                f.write_str("more regions than a footprint can name: a bug of dynvox-core")
            }
        }
    }
}

impl core::error::Error for SlabError {}

/// Bytes that `count` items of `T` occupy in the slab: their size, rounded up to [`SLAB_ALIGN`].
///
/// ```
/// assert_eq!(dynvox_core::memory::region_bytes::<u16>(33), 128);
/// ```
pub const fn region_bytes<T>(count: usize) -> usize {
    (count * size_of::<T>()).next_multiple_of(SLAB_ALIGN)
}

/// Memory of two kinds for one mapper: see [`Mapper::new_in_two`](crate::Mapper::new_in_two).
#[derive(Debug)]
pub struct TwoSlabs<'s> {
    /// Fast memory, at least [`Capacity::hot_bytes`](crate::Capacity::hot_bytes).
    pub hot: &'s mut [u8],
    /// Large memory, at least [`Capacity::cold_bytes`](crate::Capacity::cold_bytes).
    pub cold: &'s mut [u8],
}

/// Memory of a mapper: one slab, or a fast and a large one.
#[derive(Debug)]
pub enum Slabs<'s> {
    /// All regions in one slab, at least [`Capacity::bytes`](crate::Capacity::bytes).
    One(&'s mut [u8]),
    /// Hot regions in one slab, cold ones in another.
    Two(TwoSlabs<'s>),
}

/// Allocates typed, zeroed regions from a slab, front to back, and records each by name.
///
/// A single allocation returns no error: from the first failure on every region is empty, and
/// [`Carver::check`] returns the failure. So a stage is built of its regions without a `Result` at
/// each, which would be a copy of the stage on the stack.
///
/// ```
/// use dynvox_core::memory::{Carver, SLAB_ALIGN, region_bytes};
///
/// let bytes = region_bytes::<u16>(100) + region_bytes::<f32>(10);
/// let mut slab = vec![0; bytes + SLAB_ALIGN];
/// let mut carver = Carver::new(&mut slab, bytes)?;
/// let disparity: &mut [u16] = carver.alloc("disparity", 100);
/// let depth_m: &mut [f32] = carver.alloc("depth_m", 10);
/// carver.check()?; // once, after all of them
/// assert_eq!((disparity.len(), depth_m.len(), carver.footprint().bytes()), (100, 10, bytes));
/// # Ok::<(), dynvox_core::memory::SlabError>(())
/// ```
#[derive(Debug)]
pub struct Carver<'s> {
    /// Bytes that are not allocated yet; `None` without a slab.
    rest: Option<&'s mut [u8]>,
    /// Bytes for cold regions, where they have memory of their own.
    cold: Option<&'s mut [u8]>,
    footprint: Footprint,
    /// Replaces the names of regions while a group is allocated.
    name: Option<&'static str>,
    /// A stage is made that is not used.
    absent: bool,
    failure: Option<SlabError>,
}

impl<'s> Carver<'s> {
    /// Starts at the first aligned byte of `slab` and will use `needed` bytes.
    ///
    /// # Errors
    /// [`SlabError::TooSmall`]: fewer than `needed` bytes follow the first aligned one.
    ///
    /// ```
    /// use dynvox_core::memory::{Carver, SlabError};
    ///
    /// let mut slab = [0; 16];
    /// let too_short = Carver::new(&mut slab, 4_096);
    /// assert!(matches!(too_short, Err(SlabError::TooSmall { missing }) if missing >= 4_080));
    /// ```
    pub fn new(slab: &'s mut [u8], needed: usize) -> Result<Self, SlabError> {
        let skipped = Self::check_fit(slab, needed)?;
        Ok(Self { rest: slab.get_mut(skipped..), ..Self::without_slab() })
    }

    /// Starts like [`Carver::new`] with a slab for hot regions and one for cold ones, and the bytes
    /// needed of each.
    ///
    /// # Errors
    /// [`SlabError::TooSmall`]: the first of them that is too small, the hot one first.
    pub fn new_in_two(slabs: TwoSlabs<'s>, needed: [usize; 2]) -> Result<Self, SlabError> {
        let TwoSlabs { hot, cold } = slabs;
        let skipped = Self::check_fit(cold, needed[1]);
        let carver = Self::new(hot, needed[0])?;
        Ok(Self { cold: cold.get_mut(skipped?..), ..carver })
    }

    /// Returns the number of bytes of `slab` before its first aligned one, if `needed` bytes follow.
    ///
    /// # Errors
    /// [`SlabError::TooSmall`]: fewer do.
    pub(crate) fn check_fit(slab: &[u8], needed: usize) -> Result<usize, SlabError> {
        let skipped = slab.as_ptr().align_offset(SLAB_ALIGN);
        let end = skipped.saturating_add(needed);
        match end.checked_sub(slab.len()) {
            None | Some(0) => Ok(skipped),
            Some(missing) => Err(SlabError::TooSmall { missing }),
        }
    }

    /// Records regions without memory: every region is empty.
    ///
    /// ```
    /// use dynvox_core::{Capacity, memory::Carver, stereo::StereoMatcher};
    ///
    /// // Counts the bytes of a stage without cutting any.
    /// let mut carver = Carver::without_slab();
    /// StereoMatcher::new_in(&Capacity::TINY, &mut carver);
    /// assert_eq!(carver.footprint().bytes(), StereoMatcher::bytes(&Capacity::TINY));
    /// ```
    pub fn without_slab() -> Self {
        Self {
            rest: None,
            cold: None,
            footprint: Footprint::default(),
            name: None,
            absent: false,
            failure: None,
        }
    }

    /// Allocates `count` zeroed items of `T` and records them under `name`.
    ///
    /// ```
    /// use dynvox_core::memory::{Carver, SLAB_ALIGN, region_bytes};
    ///
    /// let bytes = region_bytes::<u32>(100);
    /// let mut slab = vec![1; bytes + SLAB_ALIGN];
    /// let mut carver = Carver::new(&mut slab, bytes)?;
    /// assert_eq!(carver.alloc::<u32>("example.numbers", 100), [0; 100], "zeroed");
    /// carver.check()?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn alloc<T: Pod>(&mut self, name: &'static str, count: usize) -> &'s mut [T] {
        let items = self.alloc_as_found(name, count);
        items.fill(T::zeroed());
        items
    }

    /// Allocates like [`Carver::alloc`], without clearing: for big regions whose items are cleared
    /// as they come into use, so that a slab much larger than the map costs neither time nor
    /// resident memory.
    pub(crate) fn alloc_as_found<T: Pod>(
        &mut self,
        name: &'static str,
        count: usize,
    ) -> &'s mut [T] {
        let region = self.take(name, region_bytes::<T>(count));
        let items = region.get_mut(..count * size_of::<T>()).unwrap_or_default();
        let cast = bytemuck::try_cast_slice_mut(items);
        self.require_fit(cast.is_ok());
        cast.unwrap_or_default()
    }

    /// Moves `value`, which is not plain data, into `bytes` of the slab: a stated number, which
    /// must not depend on the width of pointers. The value is never dropped.
    pub(crate) fn alloc_value<T: 's>(
        &mut self,
        name: &'static str,
        bytes: usize,
        value: T,
    ) -> Option<&'s mut T> {
        // The size of a value with pointers differs by target; the stated bytes hold it on all.
        let made = in_place(self.alloc_as_found(name, bytes), value);
        self.require_fit(made.is_some());
        made
    }

    /// Takes `bytes` off the front and records them.
    fn take(&mut self, name: &'static str, bytes: usize) -> &'s mut [u8] {
        // After the first failure everything is empty: constructors need not check each region,
        // only the carver at the end.
        if self.failure.is_some() || self.absent {
            return &mut [];
        }
        let name = self.name.unwrap_or(name);
        let is_cold = self.cold.is_some() && Placement::from_name(name) == Placement::Cold;
        let region = match if is_cold { &mut self.cold } else { &mut self.rest } {
            Some(rest) if rest.len() < bytes => {
                self.failure = Some(SlabError::TooSmall { missing: bytes - rest.len() });
                return &mut [];
            }
            Some(rest) => rest.split_off_mut(..bytes).unwrap_or_default(),
            // A footprint is counted without memory behind it.
            None => &mut [],
        };
        if !self.footprint.record(name, bytes) {
            self.failure = Some(SlabError::TooManyRegions);
        }
        region
    }

    /// Records all that `alloc` allocates as one region: for arrays of stages, whose regions would
    /// have too many names.
    ///
    /// ```
    /// use dynvox_core::memory::Carver;
    ///
    /// let mut carver = Carver::without_slab();
    /// carver.group("volumes", |carver| (carver.alloc::<u8>("a", 64).len(), carver.alloc::<u8>("b", 64).len()));
    /// assert_eq!(carver.footprint().region("volumes").unwrap().bytes, 128);
    /// ```
    pub fn group<R>(&mut self, name: &'static str, alloc: impl FnOnce(&mut Self) -> R) -> R {
        self.name = Some(name);
        let made = alloc(self);
        self.name = None;
        made
    }

    /// Makes a stage that is not used: each of its regions is empty, and none is recorded. A second
    /// carver would do as well, but lists all regions, which is too much for a small stack.
    pub(crate) fn absent<R>(&mut self, make: impl FnOnce(&mut Self) -> R) -> R {
        self.absent = true;
        let made = make(self);
        self.absent = false;
        made
    }

    /// Records a failure unless a value fits its region. Without a slab, or in a stage that is not
    /// used, there is no region.
    pub(crate) fn require_fit(&mut self, fits: bool) {
        if self.rest.is_some() && !self.absent && !fits {
            self.failure.get_or_insert(SlabError::RegionTooSmall);
        }
    }

    /// Checks that every region was allocated. After a failure nothing built from the regions may
    /// be used.
    ///
    /// # Errors
    /// The first failure.
    ///
    /// ```
    /// use dynvox_core::memory::{Carver, SLAB_ALIGN};
    ///
    /// let mut slab = vec![0; 64 + SLAB_ALIGN];
    /// let mut carver = Carver::new(&mut slab, 64)?;
    /// assert!(carver.alloc::<u8>("example.bytes", 4_096).is_empty(), "no space");
    /// assert!(carver.check().is_err(), "and noticed");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn check(&self) -> Result<(), SlabError> {
        self.failure.map_or(Ok(()), Err)
    }

    /// The recorded regions.
    pub(crate) fn into_footprint(self) -> Footprint {
        self.footprint
    }

    /// The regions recorded so far.
    pub fn footprint(&self) -> &Footprint {
        &self.footprint
    }
}

#[cfg(test)]
mod tests;
