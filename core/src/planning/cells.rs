//! The window's cells: a ring in each direction, so that moving with the camera clears what enters
//! and moves nothing.
//!
//! Memory: 6 bytes a cell. Time of a move: linear in the cells that enter.

use super::grid::Cell;
use crate::{
    memory::{Capacity, Carver, region_bytes},
    state::Visitor,
};

/// The frame saw through the cell.
pub(super) const FREE: u8 = 1;
/// A surface of the map runs through the cell.
pub(super) const OCCUPIED: u8 = 2;
/// A moving object may be in the cell.
pub(super) const OBJECT: u8 = 4;

/// Above the flags of a cell: frames in a row that saw through all of it.
const THROUGH_SHIFT: u32 = 3;
/// Most that are counted.
const MAX_THROUGH: u8 = 31;
/// Frames in a row that saw through all of a cell, after which a surface in the map is not believed
/// any more: what moved there before it was known to move. The map forgets it as well, but by its
/// averages, which takes as many frames as it was seen in.
pub(super) const GHOST_FRAMES: u8 = 5;

/// The bits of a cell that a frame saw through as a whole.
pub(super) fn seen_through(bits: u8) -> u8 {
    let count = if is_lost(bits) { 0 } else { bits >> THROUGH_SHIFT };
    let more = if count < MAX_THROUGH { count + 1 } else { count };
    more << THROUGH_SHIFT | bits & (OCCUPIED | OBJECT) | FREE
}

/// The bits of a cell that a frame saw a surface in, or about it.
pub(super) fn seen_surface(bits: u8) -> u8 {
    bits & (OCCUPIED | OBJECT | FREE)
}

/// The bits of a cell whose block left the map: a count without [`FREE`], which no frame leaves.
const LOST: u8 = 1 << THROUGH_SHIFT;

/// Returns true if the cell's block left the map, and no frame has seen the cell since.
pub(super) fn is_lost(bits: u8) -> bool {
    bits & FREE == 0 && bits >> THROUGH_SHIFT != 0
}

/// Returns true if the map has a surface in the cell that is not believed any more.
pub(super) fn is_ghost(bits: u8) -> bool {
    bits & OCCUPIED != 0 && bits >> THROUGH_SHIFT >= GHOST_FRAMES
}

/// Stamps above this are lowered by [`STAMP_STEP`], so that ages up to it stay exact.
const MAX_STAMP: u16 = 65_000;
const STAMP_STEP: u16 = 32_500;

/// Most cells along a side of the window.
pub const MAX_SIDE_CELLS: usize = 1_024;

const fn shortened(side: usize) -> usize {
    if side < MAX_SIDE_CELLS { side } else { MAX_SIDE_CELLS }
}

/// State of a cell of the window.
///
/// ```
/// use dynvox_core::planning::CellState;
/// # use dynvox_core::{
/// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
/// #     image::View, memory::SLAB_ALIGN,
/// # };
/// # let rig =
/// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// # let capacity = Capacity {
/// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
/// # };
/// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
/// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
/// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
/// # let view = View::new(&grey, 320, 96).unwrap();
/// # let frame = StereoFrame {
/// #     disparity_q8: View::new(&wall, 320, 96),
/// #     t_world_camera: Some(Transform::IDENTITY),
/// #     ..StereoFrame::pair(view, view)
/// # };
/// # for _ in 0..3 {
/// #     mapper.step(&frame, &Serial)?;
/// # }
/// mapper.update_planning_maps(0.0);
/// let planning = mapper.planning();
/// let [x, y, z] = planning.origin();
/// assert_eq!(planning.cell([x - 1, y, z]), (CellState::Unknown, None), "outside the window");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CellState {
    /// Never seen, or outside the window.
    #[default]
    Unknown,
    /// Seen through, and no surface runs through it.
    Free,
    /// A surface of the map runs through it, or a moving object may be there.
    Occupied,
}

impl CellState {
    /// The state that the bits of a cell say.
    pub(super) fn from_bits(bits: u8) -> Self {
        match bits {
            bits if bits & OBJECT != 0 => Self::Occupied,
            bits if bits & OCCUPIED != 0 && !is_ghost(bits) => Self::Occupied,
            bits if bits & FREE != 0 => Self::Free,
            _ => Self::Unknown,
        }
    }
}

/// All cells, those above each other side by side.
#[derive(Debug)]
pub(super) struct Cells<'s> {
    /// Width, length and height, in cells.
    pub size: [usize; 3],
    /// The first cell on each axis.
    pub origin: Cell,
    /// Frames taken, less what stamps were lowered by.
    clock: u16,
    /// Clock value at which the cell was last observed; 0 never.
    pub observed_at: &'s mut [u16],
    pub bits: &'s mut [u8],
    /// Upward surface points of the map in the cell, and the sum of their heights above its floor,
    /// in 1/256 of its side.
    pub count: &'s mut [u8],
    pub sum: &'s mut [u16],
}

impl<'s> Cells<'s> {
    /// Cells along each side: as the capacity says, up to [`MAX_SIDE_CELLS`]; all 0 where one is.
    pub const fn sides(capacity: &Capacity) -> [usize; 3] {
        let [width, length, height] = [
            shortened(capacity.planning_width),
            shortened(capacity.planning_length),
            shortened(capacity.planning_height),
        ];
        if width * length * height == 0 { [0; 3] } else { [width, length, height] }
    }

    pub const fn count_of(capacity: &Capacity) -> usize {
        let [width, length, height] = Self::sides(capacity);
        width * length * height
    }

    pub const fn bytes(capacity: &Capacity) -> usize {
        let cells = Self::count_of(capacity);
        2 * region_bytes::<u16>(cells) + 2 * region_bytes::<u8>(cells)
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let cells = Self::count_of(capacity);
        Self {
            size: Self::sides(capacity),
            origin: [0; 3],
            clock: 0,
            observed_at: carver.alloc("planning.observed_at", cells),
            bits: carver.alloc("planning.bits", cells),
            count: carver.alloc("planning.count", cells),
            sum: carver.alloc("planning.sum", cells),
        }
    }

    /// Visits what lives from frame to frame. Surfaces are read from the map anew.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { size: _, origin, clock, observed_at, bits, count: _, sum: _ } = self;
        if observed_at.is_empty() {
            return;
        }
        visitor.i32s(origin);
        visitor.u16s(core::slice::from_mut(clock));
        visitor.u16s(observed_at);
        visitor.bytes(bits);
    }

    /// Makes every cell unknown.
    pub fn forget(&mut self) {
        self.observed_at.fill(0);
        self.bits.fill(0);
    }

    /// Starts the next frame.
    pub fn advance(&mut self) {
        if self.clock >= MAX_STAMP {
            self.clock -= STAMP_STEP;
            self.observed_at
                .iter_mut()
                .filter(|stamp| **stamp > 0)
                .for_each(|stamp| *stamp = stamp.saturating_sub(STAMP_STEP).max(1));
        }
        self.clock += 1;
    }

    /// The stamp of this frame.
    pub fn now(&self) -> u16 {
        self.clock
    }

    /// Frames since the stamp was set.
    pub fn age(&self, stamp: u16) -> u32 {
        u32::from(self.clock.saturating_sub(stamp))
    }

    /// Returns the offset of the cells at (x, y); x and y count from the window's first cell.
    #[inline]
    pub fn column(&self, x: usize, y: usize) -> usize {
        let [width, length, height] = self.size;
        (ring(self.origin[1], y, length) * width + ring(self.origin[0], x, width)) * height
    }

    /// Returns the offset of level z in a column.
    #[inline]
    pub fn level(&self, z: usize) -> usize {
        ring(self.origin[2], z, self.size[2])
    }

    /// Position of the cell that is (x, y, z) cells from the window's first; `None` outside.
    #[inline]
    pub fn position(&self, [x, y, z]: [usize; 3]) -> Option<usize> {
        let within = x < self.size[0] && y < self.size[1] && z < self.size[2];
        within.then(|| self.column(x, y) + self.level(z))
    }

    /// A cell counted from the window's first; `None` outside the window.
    #[inline]
    pub fn local(&self, cell: Cell) -> Option<[usize; 3]> {
        let mut local = [0; 3];
        for ((local, size), (cell, origin)) in
            local.iter_mut().zip(self.size).zip(cell.into_iter().zip(self.origin))
        {
            *local = usize::try_from(cell.checked_sub(origin)?).ok().filter(|at| *at < size)?;
        }
        Some(local)
    }

    /// Moves the window to begin at `origin`: cells that enter are unknown.
    pub fn move_to(&mut self, origin: Cell) {
        let before = core::mem::replace(&mut self.origin, origin);
        let shifts = [0, 1, 2].map(|axis: usize| {
            let of = |cell: Cell| i64::from(cell.get(axis).copied().unwrap_or_default());
            of(origin) - of(before)
        });
        // A jump of a whole window or more leaves no cell in common.
        let far =
            shifts.iter().zip(self.size).any(|(shift, size)| shift.unsigned_abs() >= size as u64);
        if far {
            self.forget();
            return;
        }
        let [dx, dy, dz] = shifts;
        let [width, length, height] = self.size;
        for y in 0..length {
            for x in 0..width {
                let column = self.column(x, y);
                // Cells wrap around in memory: only those that enter are cleared, and none is
                // moved.
                if is_new(dx, x, width) || is_new(dy, y, length) {
                    self.clear(column..column + height);
                } else if dz != 0 {
                    for z in (0..height).filter(|&z| is_new(dz, z, height)) {
                        let at = column + self.level(z);
                        self.clear(at..at + 1);
                    }
                }
            }
        }
    }

    /// Returns true if cells from the first to the last along each axis lie in the window.
    pub fn meets(&self, [first, last]: [Cell; 2]) -> bool {
        self.origin.iter().zip(self.size).zip(first.iter().zip(last)).all(
            |((origin, size), (first, last))| {
                *first < origin.saturating_add(size as i32) && last >= *origin
            },
        )
    }

    /// Makes a cell unknown whose block left the map. Nothing outside the window.
    pub fn lose(&mut self, cell: Cell) {
        let Some(position) = self.local(cell).and_then(|local| self.position(local)) else {
            return;
        };
        if let (Some(observed_at), Some(bits)) =
            (self.observed_at.get_mut(position), self.bits.get_mut(position))
        {
            (*observed_at, *bits) = (0, LOST);
        }
    }

    fn clear(&mut self, cells: core::ops::Range<usize>) {
        if let (Some(observed_at), Some(bits)) =
            (self.observed_at.get_mut(cells.clone()), self.bits.get_mut(cells))
        {
            observed_at.fill(0);
            bits.fill(0);
        }
    }
}

/// Position on a ring of the cell `at` cells after the window's first.
#[inline]
fn ring(origin: i32, at: usize, size: usize) -> usize {
    let first = origin.checked_rem_euclid(size as i32).unwrap_or(0) as usize;
    let sum = first + at;
    if sum >= size { sum - size } else { sum }
}

/// Returns true if a cell was outside a window that moved by `shift`.
fn is_new(shift: i64, at: usize, size: usize) -> bool {
    let before = at as i64 + shift;
    before < 0 || before >= size as i64
}
