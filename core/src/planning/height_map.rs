//! The height map: which surface of a column is ground, how high it lies, how it slopes and steps,
//! and what hangs over it.
//!
//! Ground grows outwards from below the camera, ring by ring of columns. A column's reference is
//! the height of its neighbour in the ring before (of the three nearest, the one closest to known
//! ground); its ground is the upward surface nearest to that reference, unless it is farther from
//! it than a step and the steepest slope allow. Where none is, the reference is carried on, and
//! what is allowed grows by a tenth of the distance, up to one more step. The first reference is
//! the plane that the disparity image shows below and before the camera, or the camera's height
//! where that is configured: the camera cannot see the ground below itself. This is the growing of
//! ground from the sensor outwards of Himmelsbach, v. Hundelshausen, Wuensche (*Fast Segmentation
//! of 3D Point Clouds for Ground Vehicles*, 2010), on a height grid.
//!
//! Slope and roughness are those of a plane fitted to the columns around (least squares). A step is
//! how far the surfaces on either side miss each other where they are drawn on to the column in
//! between, so a slope is no step.
//!
//! Memory: 32 bytes a column. Time: linear in cells and columns. Order: rings outwards, each by y,
//! then x.

use super::{
    PlanningConfig,
    cells::{CellState, Cells, is_ghost},
    plane_fit::PlaneFit,
};
use crate::{
    geometry::scalar::{max_f32, min_f32},
    memory::{Carver, region_bytes},
};
use bytemuck::{Pod, Zeroable};

/// A plane is fitted to every second column up to four away: twice as far as its neighbours, so
/// half the error at the same cost.
const FIT_OFFSETS: [i32; 5] = [-4, -2, 0, 2, 4];
/// Growth of what is allowed where no ground is seen, rise over run.
const DRIFT: f32 = 0.1;

/// A column of the height map. Heights are along up, from the world's origin.
///
/// ```
/// use dynvox_core::planning::Column;
///
/// let unknown = Column::default();
/// assert_eq!((unknown.ground_m(), unknown.slope()), (None, None));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Column {
    /// Height of the ground, m; meaningless where [`Column::ground_m`] is `None`.
    pub height_m: f32,
    /// Height at which ground would be expected, m: its height where it was found.
    pub reference_m: f32,
    /// Rise over run to the right and ahead; 0 where too little is known around.
    pub slope: [f32; 2],
    /// Root mean square distance of the ground around from its plane, m.
    pub roughness_m: f32,
    /// Height of the step through the column, m; 0 where one side is not known.
    pub step_m: f32,
    /// Height of what hangs over the ground, m above it; 0 where nothing is.
    pub clearance_m: f32,
    /// Known parts: [`Column::GROUND`], [`Column::FITTED`].
    flags: u16,
    /// Columns since ground was last found on the way from the camera.
    gap: u16,
}

impl Column {
    /// Ground was found.
    pub(super) const GROUND: u16 = 1;
    /// A plane was fitted: slope and roughness are known.
    const FITTED: u16 = 2;

    pub(super) fn has(&self, flag: u16) -> bool {
        self.flags & flag != 0
    }

    /// Height of the ground, m; `None` where none was found.
    pub fn ground_m(&self) -> Option<f32> {
        self.has(Self::GROUND).then_some(self.height_m)
    }

    /// Rise over run along the steepest way; `None` where too little is known around.
    pub fn slope(&self) -> Option<f32> {
        self.has(Self::FITTED)
            .then(|| libm::sqrtf(self.slope[0] * self.slope[0] + self.slope[1] * self.slope[1]))
    }
}

/// The plane ground is expected in around the camera: its height below the camera, m, and its rise
/// over run to the right and ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Level {
    pub height_m: f32,
    pub slope: [f32; 2],
}

/// Cells that ground grows through.
pub(super) struct Growth<'a, 's> {
    pub config: &'a PlanningConfig,
    /// Side of a cell, m.
    pub cell_m: f32,
    /// Column of the camera, where growth begins.
    pub center: [usize; 2],
    pub cells: &'a Cells<'s>,
}

/// All columns.
#[derive(Debug)]
pub(super) struct HeightMap<'s> {
    columns: &'s mut [Column],
    width: usize,
    level: Level,
}

impl<'s> HeightMap<'s> {
    pub const fn bytes(columns: usize) -> usize {
        region_bytes::<Column>(columns)
    }

    pub fn new_in(width: usize, length: usize, carver: &mut Carver<'s>) -> Self {
        Self {
            columns: carver.alloc("planning.columns", width * length),
            width,
            level: Level::default(),
        }
    }

    /// A column, counted from the window's first.
    pub fn get(&self, x: usize, y: usize) -> Column {
        if x < self.width {
            self.columns.get(y * self.width + x).copied().unwrap_or_default()
        } else {
            Column::default()
        }
    }

    /// All columns, x fastest.
    pub fn columns(&self) -> &[Column] {
        self.columns
    }

    /// Height of the ground below the camera, m.
    pub fn level_m(&self) -> f32 {
        self.level.height_m
    }

    /// Finds the ground anew, outwards from where growth begins, at the level expected there.
    pub fn find(&mut self, level: Level, growth: &Growth<'_, '_>) {
        self.level = level;
        let &Growth { center, cells, .. } = growth;
        let [width, length, _] = cells.size;
        let rings = [
            center[0],
            center[1],
            width.saturating_sub(center[0]),
            length.saturating_sub(center[1]),
        ]
        .into_iter()
        .max();
        // Ring by ring from the camera: each column's reference lies in the ring before.
        for ring in 0..=rings.unwrap_or(0) {
            let rows = center[1].saturating_sub(ring)..length.min(center[1] + ring + 1);
            for y in rows {
                let is_edge = y.abs_diff(center[1]) == ring;
                let columns = center[0].saturating_sub(ring)..width.min(center[0] + ring + 1);
                let step = if is_edge { 1 } else { (2 * ring).max(1) };
                // Between the ring's first row and its last only its two ends belong to it.
                let first =
                    if is_edge || center[0] >= ring { columns.start } else { center[0] + ring };
                for x in (first..columns.end).step_by(step) {
                    let column = self.grow([x, y], growth);
                    if let Some(entry) = self.columns.get_mut(y * self.width + x) {
                        *entry = column;
                    }
                }
            }
        }
        // Slope and steps need the neighbours' heights, so they come second.
        for y in 0..length {
            for x in 0..width {
                let described = self.describe([x, y], growth);
                if let Some(entry) = self.columns.get_mut(y * self.width + x) {
                    *entry = described;
                }
            }
        }
    }

    /// The column at a position, from its neighbours in the ring before.
    fn grow(&self, at: [usize; 2], growth: &Growth<'_, '_>) -> Column {
        let &Growth { config, cell_m, cells, .. } = growth;
        let (reference_m, gap) = self.reference(at, growth);
        let gap_m = f32::from(gap) * cell_m;
        // Real ground may differ from the expected height by a step, by a slope over one cell, and
        // by a drift that grows with the columns without ground.
        let allowed_m = config.ground_step_m
            + config.slope_max * cell_m
            + min_f32(DRIFT * gap_m, config.ground_step_m);
        // The surface nearest to the expected height is the ground.
        let mut best: Option<(f32, f32)> = None;
        for height_m in surfaces(at, cell_m, cells) {
            let off_m = (height_m - reference_m).abs();
            if off_m <= allowed_m && best.is_none_or(|(_, least)| off_m < least) {
                best = Some((height_m, off_m));
            }
        }
        match best {
            Some((height_m, _)) => Column {
                height_m,
                // The next ring starts from what was found, not from what was expected.
                reference_m: height_m,
                flags: Column::GROUND,
                ..Column::default()
            },
            None => Column {
                height_m: 0.0,
                reference_m,
                gap: gap.saturating_add(1),
                ..Column::default()
            },
        }
    }

    /// The height to expect at a column, and the columns since ground was found.
    fn reference(&self, at: [usize; 2], growth: &Growth<'_, '_>) -> (f32, u16) {
        let &Growth { cell_m, center, .. } = growth;
        let [dx, dy] = [0, 1].map(|axis| offset(at, center, axis));
        let ring = if dx.abs() > dy.abs() { dx.abs() } else { dy.abs() };
        let plane = |dx: i32, dy: i32| {
            self.level.height_m
                + (self.level.slope[0] * dx as f32 + self.level.slope[1] * dy as f32) * cell_m
        };
        // Below the camera the ground plane is the reference.
        if ring == 0 {
            return (self.level.height_m, 0);
        }
        // The column in the ring before that lies straight towards the camera, and those beside it.
        // Rounded division brings a column of this ring to the nearest one of the ring before.
        let towards =
            |d: i32| (2 * d * (ring - 1) + d.signum() * ring).checked_div(2 * ring).unwrap_or(0);
        let side = if dx.abs() > dy.abs() { [0, 1] } else { [1, 0] };
        let mut best: Option<(Column, [i32; 2])> = None;
        // Of equal gaps the straightest column counts.
        for beside in [0, -1, 1] {
            let inner = [towards(dx) + beside * side[0], towards(dy) + beside * side[1]];
            let ring_of =
                if inner[0].abs() > inner[1].abs() { inner[0].abs() } else { inner[1].abs() };
            let column_at = [center[0] as i32 + inner[0], center[1] as i32 + inner[1]]
                .map(|c| usize::try_from(c).ok());
            let [Some(x), Some(y)] = column_at else { continue };
            let Some(column) =
                self.columns.get(y * self.width + x).filter(|_| x < self.width && ring_of < ring)
            else {
                continue;
            };
            if best.is_none_or(|(least, _)| column.gap < least.gap) {
                best = Some((*column, inner));
            }
        }
        match best {
            // Nothing was found since the camera: the plane goes on.
            Some((column, _)) if i32::from(column.gap) >= ring => (plane(dx, dy), column.gap),
            Some((column, _)) => (column.reference_m, column.gap),
            None => (plane(dx, dy), ring as u16),
        }
    }

    /// A column with what its surroundings say about it.
    fn describe(&self, [x, y]: [usize; 2], growth: &Growth<'_, '_>) -> Column {
        let cell_m = growth.cell_m;
        let mut column = self.get(x, y);
        let Some(height_m) = column.ground_m() else { return column };
        // Differences to the column's own height keep the sums small.
        let mut fit = PlaneFit::default();
        for dy in FIT_OFFSETS {
            for dx in FIT_OFFSETS {
                if let Some(other_m) = self.ground_beside([x, y], [dx, dy]) {
                    fit.add(dx as f32, dy as f32, other_m - height_m);
                }
            }
        }
        if let Some(([slope_x, slope_y], roughness)) = fit.solve() {
            (column.slope, column.roughness_m) = ([slope_x / cell_m, slope_y / cell_m], roughness);
            column.flags |= Column::FITTED;
        }
        let steps = [[1, 0], [0, 1]].map(|along| self.step_along([x, y], along));
        column.step_m = max_f32(steps[0], steps[1]);
        column.clearance_m = clearance([x, y], height_m, growth);
        column
    }

    fn ground_beside(&self, [x, y]: [usize; 2], [dx, dy]: [i32; 2]) -> Option<f32> {
        let [x, y] = [x.checked_add_signed(dx as isize)?, y.checked_add_signed(dy as isize)?];
        self.get(x, y).ground_m()
    }

    /// By how much the surfaces on both sides miss each other, each drawn on from its first and
    /// third column.
    fn step_along(&self, at: [usize; 2], [dx, dy]: [i32; 2]) -> f32 {
        let side = |sign: i32| {
            let beside = |n: i32| self.ground_beside(at, [sign * n * dx, sign * n * dy]);
            let near = beside(1)?;
            Some(beside(3).map_or(near, |far| near + 0.5 * (near - far)))
        };
        match (side(-1), side(1)) {
            (Some(low), Some(high)) => (high - low).abs(),
            _ => 0.0,
        }
    }
}

fn offset(at: [usize; 2], center: [usize; 2], axis: usize) -> i32 {
    let of = |column: [usize; 2]| column.get(axis).copied().unwrap_or_default() as i32;
    of(at) - of(center)
}

/// The upward surfaces of a column, from below: the heights of cells with some, m. What lies on
/// either side of a cell's border is one surface.
fn surfaces([x, y]: [usize; 2], cell_m: f32, cells: &Cells<'_>) -> impl Iterator<Item = f32> {
    let column = cells.column(x, y);
    let read = move |z: usize| -> Option<(u32, i32)> {
        let position = (z < cells.size[2]).then(|| column + cells.level(z))?;
        let count = u32::from(*cells.count.get(position)?);
        if is_ghost(*cells.bits.get(position)?) {
            return None;
        }
        (count > 0).then_some((count, i32::from(*cells.sum.get(position)?)))
    };
    // Sums are read from below, so that the surfaces come out in order of height.
    let mut z = 0;
    core::iter::from_fn(move || {
        while z < cells.size[2] {
            let (at, own) = (z, read(z));
            z += 1;
            let Some((count, sum)) = own else { continue };
            // Sums count from the floor of the lower cell, 256 to its ceiling.
            let (mut total, mut points) = (sum, count);
            if let Some((count, sum)) = read(z) {
                let mean = |sum: i32, count: u32| sum.checked_div(count as i32).unwrap_or(0);
                let gap = 256 + mean(sum, count) - mean(total, points);
                if gap < 128 {
                    (total, points) = (total + sum + 256 * count as i32, points + count);
                    z += 1;
                }
            }
            let above = total as f32 / (256 * points) as f32;
            return Some(((cells.origin[2] + at as i32) as f32 + above) * cell_m);
        }
        None
    })
}

/// Height above ground of the lowest cell that is occupied and hangs over it as a whole; 0 where
/// none does.
fn clearance([x, y]: [usize; 2], ground_m: f32, growth: &Growth<'_, '_>) -> f32 {
    let &Growth { config, cell_m, cells, .. } = growth;
    let (column, floor_m) = (cells.column(x, y), cells.origin[2] as f32 * cell_m);
    // A cell less than its own height above the ground may hold the ground itself.
    let from = max_f32(config.low_m, cell_m);
    let above = (0..cells.size[2])
        .map(|z| (z, floor_m + z as f32 * cell_m - ground_m))
        .filter(|(_, above_m)| *above_m >= from);
    let is_occupied = |z: usize| {
        cells
            .bits
            .get(column + cells.level(z))
            .is_some_and(|bits| CellState::from_bits(*bits) == CellState::Occupied)
    };
    above.into_iter().find(|(z, _)| is_occupied(*z)).map_or(0.0, |(_, above_m)| above_m)
}
