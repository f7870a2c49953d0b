//! Use of the slab: bytes of each region, and how much of it is used now and at most.

use super::Placement;
use heapless::Vec;

/// Most regions of one slab.
const MAX_REGIONS: usize = 108;

/// One named region of the slab. All figures in bytes.
///
/// ```
/// use dynvox_core::Capacity;
///
/// let footprint = Capacity::TINY.footprint();
/// let sum: usize = footprint.regions().iter().map(|region| region.bytes).sum();
/// assert_eq!(sum, footprint.bytes());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// `stage.what`, as `volume.sdf`.
    pub name: &'static str,
    /// Bytes allocated for it, padding to the next region included.
    pub bytes: usize,
    /// Bytes in use now. Working images count as used throughout.
    pub used: usize,
    /// The most bytes ever in use at once.
    pub peak: usize,
}

impl Region {
    /// Kind of memory that the region belongs in, where a machine has a fast and a large one.
    pub fn placement(&self) -> Placement {
        Placement::from_name(self.name)
    }
}

/// The list of all regions, in slab order.
///
/// ```
/// use dynvox_core::Capacity;
///
/// for region in Capacity::TINY.footprint().regions() {
///     println!("{:24} {:>9} bytes, at most {:>9} used", region.name, region.bytes, region.peak);
/// }
/// ```
#[derive(Clone, Debug, Default)]
pub struct Footprint {
    regions: Vec<Region, MAX_REGIONS>,
}

impl Footprint {
    /// Records so many bytes under a name: to the last region if that is its name, else to a new
    /// one. Whether the list holds it.
    pub(super) fn record(&mut self, name: &'static str, bytes: usize) -> bool {
        if let Some(last) = self.regions.last_mut().filter(|last| last.name == name) {
            (last.bytes, last.used, last.peak) =
                (last.bytes + bytes, last.used + bytes, last.peak + bytes);
            return true;
        }
        self.regions.push(Region { name, bytes, used: bytes, peak: bytes }).is_ok()
    }

    /// All regions, in slab order.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// The region of that name.
    ///
    /// ```
    /// use dynvox_core::Capacity;
    ///
    /// let footprint = Capacity::TINY.footprint();
    /// assert_eq!(footprint.region("depth_m").unwrap().bytes, 4 * Capacity::TINY.pixels());
    /// assert!(footprint.region("unknown").is_none());
    /// ```
    pub fn region(&self, name: &str) -> Option<&Region> {
        self.regions.iter().find(|region| region.name == name)
    }

    /// Bytes of all regions.
    pub fn bytes(&self) -> usize {
        self.regions.iter().map(|region| region.bytes).sum()
    }

    /// Sets the use of a region, as `items` of `T` now and `peak_items` at most.
    pub(crate) fn set_use<T>(&mut self, name: &str, items: usize, peak_items: usize) {
        if let Some(region) = self.regions.iter_mut().find(|region| region.name == name) {
            region.used = items * size_of::<T>();
            region.peak = peak_items * size_of::<T>();
        }
    }
}
