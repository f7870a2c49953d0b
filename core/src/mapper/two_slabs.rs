//! A mapper in memory of two kinds: a fast one on the chip, and a large one outside.

use super::{Config, Localization, Mapper, NewError, Planning, StaticMap};
use crate::{
    Capacity,
    memory::{Carver, TwoSlabs},
    objects::Objects,
};

const _: () = assert!(Capacity::TINY.hot_bytes() < 4 << 20);

impl Capacity {
    /// Bytes of the regions that belong in fast memory:
    /// [`Placement::Hot`](crate::memory::Placement::Hot).
    ///
    /// ```
    /// use dynvox_core::Capacity;
    ///
    /// assert!(Capacity::TINY.hot_bytes() < 4 << 20, "fits the memory on larger chips");
    /// ```
    pub const fn hot_bytes(&self) -> usize {
        self.bytes() - self.cold_bytes()
    }

    /// Bytes of the regions that belong in large memory:
    /// [`Placement::Cold`](crate::memory::Placement::Cold).
    ///
    /// ```
    /// use dynvox_core::Capacity;
    ///
    /// let capacity = Capacity::SMALL;
    /// assert_eq!(capacity.hot_bytes() + capacity.cold_bytes(), capacity.bytes());
    /// ```
    pub const fn cold_bytes(&self) -> usize {
        StaticMap::cold_bytes(self)
            + Objects::cold_bytes(self)
            + Localization::cold_bytes(self)
            + Planning::bytes(self)
    }
}

impl<'s> Mapper<'s> {
    /// Makes a mapper like [`Mapper::new`], its hot regions in one slab and its cold ones in
    /// another. Each slab may begin anywhere; up to
    /// [`SLAB_ALIGN`](crate::memory::SLAB_ALIGN)` - 1` bytes at its front are skipped. No result
    /// depends on it.
    ///
    /// # Errors
    /// Returns the errors of [`Mapper::new`]; of two slabs that are too small it names what the hot
    /// one lacks.
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, Mapper, Slab, geometry::StereoRig, memory::TwoSlabs,
    /// };
    /// use static_cell::ConstStaticCell;
    ///
    /// const TINY: Capacity = Capacity::TINY;
    /// // #[link_section = ".axisram"] and ".psram" on a chip.
    /// type Cell<const BYTES: usize> = ConstStaticCell<Slab<BYTES>>;
    /// static HOT: Cell<{ TINY.hot_bytes() }> = Cell::new(Slab::ZERO);
    /// static COLD: Cell<{ TINY.cold_bytes() }> = Cell::new(Slab::ZERO);
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let slabs = TwoSlabs { hot: HOT.take(), cold: COLD.take() };
    /// let mapper = Mapper::new_in_two(&TINY, &Config::for_rig(rig), slabs)?;
    /// assert_eq!(mapper.footprint().bytes(), TINY.bytes());
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    // Never inlined: what it needs of the stack must not stay in its caller's frame.
    #[inline(never)]
    pub fn new_in_two(
        capacity: &Capacity,
        config: &Config,
        slabs: TwoSlabs<'s>,
    ) -> Result<Self, NewError> {
        Self::check_bounds(capacity, config)?;
        let needed = [capacity.hot_bytes(), capacity.cold_bytes()];
        let mut carver = Carver::new_in_two(slabs, needed)?;
        Self::prepared_in(capacity, config, &mut carver)
    }
}
