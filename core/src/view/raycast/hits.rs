//! What rays meet, worked out for eight of them at a time.
//!
//! Which cells a ray passes is a matter of branches. Where in the last of them it meets the surface, and which way the surface faces
//! there, is none, so that crossings wait until there are as many as a vector has lanes.

use super::{
    cell::{Field, along},
    cell_index::CellIndex,
    colour::{self, Colours},
    ray_camera::AXES,
};
use crate::{
    geometry::scalar::{max_f32, min_f32},
    parallel::{Vectors, Work},
    volume::{Blocks, Slot},
};

/// Crossings worked out at once.
const LANES: usize = 8;
/// One value for each of them.
type Eight<T> = [T; LANES];

/// Most steps towards a root; the first hits it where the field is linear.
pub(super) const MAX_REFINEMENTS: usize = 6;
/// A root is good when the field is this near 0, in units of truncation / 32,767.
pub(super) const GOOD_ENOUGH: f32 = 8.0;

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub depth_m: f32,
    /// Unit normal in camera axes, towards the camera.
    pub normal: [f32; 3],
    pub colour: [u8; 3],
    /// Weight of the nearest lattice point.
    pub weight: u8,
}

/// A cell in which a ray passes from free space through the surface.
#[derive(Clone, Copy)]
struct CrossedCell<'a> {
    /// The slots of its block and of those after it.
    slots: &'a [Slot; 8],
    cell: CellIndex,
}

/// How a ray passes it.
#[derive(Clone, Copy)]
pub(super) struct RaySegment {
    /// Where the ray enters and leaves, in the cell's coordinates.
    pub ends: [[f32; 3]; 2],
    /// And at which depths, m.
    pub depths_m: [f32; 2],
    /// The field there: above 0, and 0 or below.
    pub values: [f32; 2],
}

/// Crossings of a row's rays that wait to be worked out.
pub(super) struct Hits<'a> {
    len: usize,
    cells: Eight<Option<CrossedCell<'a>>>,
    columns: Eight<usize>,
    far_m: Eight<f32>,
    crossings: Crossings,
}

impl<'a> Hits<'a> {
    /// None yet.
    pub fn none() -> Self {
        Self {
            len: 0,
            cells: [None; LANES],
            columns: [0; LANES],
            far_m: [0.0; LANES],
            crossings: Crossings::default(),
        }
    }

    /// Sets the cell of the next crossing to that of the one before, if it is this one: rays of pixels side by side often meet the surface in
    /// the same.
    #[inline(always)]
    pub fn repeat_cell(&mut self, slots: &[Slot; 8], cell: CellIndex) -> bool {
        let [before, lane] = [(self.len + LANES - 1) % LANES, self.len % LANES];
        let known = self.cells.get(before).copied().flatten();
        let is_known = known.is_some_and(|known| known.slots[0] == slots[0] && known.cell == cell);
        if is_known && let Some(to) = self.cells.get_mut(lane) {
            *to = known;
            self.crossings.repeat(before, lane);
        }
        is_known
    }

    /// Sets the cell of the next crossing. There is one where not [`Self::is_full`].
    #[inline(always)]
    pub fn set_cell(&mut self, slots: &'a [Slot; 8], cell: CellIndex, corners: &[f32; 8], colours: &Colours) {
        let lane = self.len % LANES;
        if let Some(to) = self.cells.get_mut(lane) {
            *to = Some(CrossedCell { slots, cell });
        }
        set(&mut self.crossings.corners, lane, corners);
        set(&mut self.crossings.colours, lane, colours);
    }

    /// Sets how the next crossing's ray passes its cell.
    #[inline(always)]
    pub fn set_segment(&mut self, segment: &RaySegment) {
        let lane = self.len % LANES;
        set(&mut self.crossings.ends[0], lane, &segment.ends[0]);
        set(&mut self.crossings.ends[1], lane, &segment.ends[1]);
        set(&mut self.crossings.depths_m, lane, &segment.depths_m);
        set(&mut self.crossings.values, lane, &segment.values);
    }

    /// Adds the crossing that is set: that of a column's ray; farther than `far_m` away it counts as none.
    #[inline(always)]
    pub fn confirm(&mut self, u: usize, far_m: f32) {
        let lane = self.len % LANES;
        if let (Some(column), Some(limit_m)) = (self.columns.get_mut(lane), self.far_m.get_mut(lane)) {
            (*column, *limit_m) = (u, far_m);
        }
        self.len += 1;
    }

    /// Whether all have to be taken before one more is added.
    pub fn is_full(&self) -> bool {
        self.len >= LANES
    }

    /// Hands all that are within reach to `show`, each with its column.
    pub fn take(&mut self, blocks: &Blocks<'_>, rotation: &[[f32; 3]; 3], vectors: Vectors, mut show: impl FnMut(usize, Hit)) {
        if self.len == 0 {
            return;
        }
        let met = vectors.run(Meet { crossings: &self.crossings, rotation });
        let lanes = self.cells.iter().flatten().zip(self.columns.iter().zip(&self.far_m)).take(self.len).enumerate();
        for (lane, (cell, (&column, &far_m))) in lanes {
            let depth_m = met.depth_m.get(lane).copied().unwrap_or(f32::MAX);
            if depth_m <= far_m {
                let colour = at_lane(&met.colour, lane).map(|channel| channel as u8);
                show(column, cell.hit(blocks, depth_m, at_lane(&met.point, lane), at_lane(&met.direction, lane), colour));
            }
        }
        self.len = 0;
    }
}

impl CrossedCell<'_> {
    /// What is seen at a point of the cell, given in which direction from there, in camera axes, the field rises.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3, blocks below 8 and voxels below 512")]
    fn hit(&self, blocks: &Blocks<'_>, depth_m: f32, point: [f32; 3], [right, down, forward]: [f32; 3], colour: [u8; 3]) -> Hit {
        let length = libm::sqrtf(right * right + down * down + forward * forward);
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        let mut nearest = self.cell.first();
        for axis in AXES {
            let next = nearest.plus(self.cell.edge(axis));
            nearest = if point[axis] >= 0.5 { next } else { nearest };
        }
        let weight = blocks.weight(self.slots[nearest.block()]).map_or(0, |weights| weights[nearest.voxel()]);
        Hit { depth_m, normal: [right * scale, down * scale, forward * scale], colour, weight }
    }
}

/// What the kernel reads: figures of one kind side by side.
#[derive(Default)]
struct Crossings {
    /// Distances at the corners of the cells.
    corners: [Eight<f32>; 8],
    /// Where rays enter and leave them, in their coordinates.
    ends: [[Eight<f32>; 3]; 2],
    depths_m: [Eight<f32>; 2],
    values: [Eight<f32>; 2],
    /// At the corners of the cells.
    colours: [Eight<u32>; 16],
}

impl Crossings {
    /// Sets one lane's cell to another's.
    #[inline(always)]
    fn repeat(&mut self, from: usize, to: usize) {
        let (corners, colours) = (at_lane(&self.corners, from), at_lane(&self.colours, from));
        set(&mut self.corners, to, &corners);
        set(&mut self.colours, to, &colours);
    }
}

/// Sets one lane's figures.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
fn set<T: Copy, const N: usize>(all: &mut [Eight<T>; N], lane: usize, one: &[T; N]) {
    for (all, one) in all.iter_mut().zip(one) {
        all[lane] = *one;
    }
}

/// Where the surface is met, and how it lies there.
struct Met {
    depth_m: Eight<f32>,
    /// In a cell's coordinates.
    point: [Eight<f32>; 3],
    /// Where the field rises to, in camera axes.
    direction: [Eight<f32>; 3],
    colour: [Eight<i32>; 3],
}

/// The work on eight crossings: false position, which halves the weight of an end that stays (the Illinois rule), so that both ends close
/// in; then the field's gradient.
struct Meet<'a> {
    crossings: &'a Crossings,
    /// Camera from world.
    rotation: &'a [[f32; 3]; 3],
}

impl Work for Meet<'_> {
    type Output = Met;

    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    fn run(self) -> Met {
        let Crossings { corners, ends, depths_m, values, colours } = self.crossings;
        let mut fields = [[0.0; LANES]; 8];
        for lane in 0..LANES {
            let Field(coefficients) = Field::new(&at_lane(corners, lane));
            for (field, coefficient) in fields.iter_mut().zip(coefficients) {
                field[lane] = coefficient;
            }
        }
        let ends = |lane: usize| [at_lane(&ends[0], lane), at_lane(&ends[1], lane)];
        let ([mut low, mut low_value], [mut high, mut high_value]) = ([[0.0; LANES], values[0]], [[1.0; LANES], values[1]]);
        let (mut share, mut side, mut is_open) = ([0.0; LANES], [0i32; LANES], [1i32; LANES]);
        for _ in 0..MAX_REFINEMENTS {
            let mut open = 0;
            for lane in 0..LANES {
                let next = low[lane] + (high[lane] - low[lane]) * (low_value[lane] / (low_value[lane] - high_value[lane]));
                let value = Field(at_lane(&fields, lane)).at(along(ends(lane), next));
                share[lane] = if is_open[lane] != 0 { next } else { share[lane] };
                is_open[lane] &= i32::from((value >= GOOD_ENOUGH) | (value <= -GOOD_ENOUGH));
                open |= is_open[lane];
                let is_before = value > 0.0;
                let [high_stays, low_stays] = [is_before & (side[lane] > 0), !is_before & (side[lane] < 0)];
                (low[lane], high[lane]) = if is_before { (next, high[lane]) } else { (low[lane], next) };
                let (lower, higher) = (low_value[lane], high_value[lane]);
                low_value[lane] = if is_before { value } else { lower * if low_stays { 0.5 } else { 1.0 } };
                high_value[lane] = if is_before { higher * if high_stays { 0.5 } else { 1.0 } } else { value };
                side[lane] = if is_before { 1 } else { -1 };
            }
            if open == 0 {
                break;
            }
        }
        let mut met = Met {
            depth_m: [0.0; LANES],
            point: [[0.0; LANES]; 3],
            direction: [[0.0; LANES]; 3],
            colour: [[0; LANES]; 3],
        };
        for lane in 0..LANES {
            let share = max_f32(0.0, min_f32(share[lane], 1.0));
            let point = along(ends(lane), share);
            let gradient = Field(at_lane(&fields, lane)).gradient(point);
            met.depth_m[lane] = depths_m[0][lane] + (depths_m[1][lane] - depths_m[0][lane]) * share;
            let colour = colour::mean(&at_lane(colours, lane), point);
            for axis in AXES {
                let row = self.rotation[axis];
                met.colour[axis][lane] = colour[axis];
                met.point[axis][lane] = point[axis];
                met.direction[axis][lane] = row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2];
            }
        }
        met
    }
}

/// One lane's figures.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
fn at_lane<T: Copy + Default, const N: usize>(all: &[Eight<T>; N], lane: usize) -> [T; N] {
    let mut one = [T::default(); N];
    for i in 0..N {
        one[i] = all[i][lane];
    }
    one
}
