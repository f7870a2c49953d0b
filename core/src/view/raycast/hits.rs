//! Hits of rays in the cells that stop them, computed for many rays at a time.

use super::{
    cell::{Faces, Field, along, depths_m, mean, position},
    cell_index::CellId,
    colour::{self, Colours},
    crossed::{CrossedCell, CrossedCells},
    ray_camera::{AXES, RowOfRays},
};
use crate::{
    geometry::scalar::{max_f32, min_f32},
    lanes::{Eight, LANES, at_lane, set},
    parallel::{Vectors, Work},
};

/// Most steps towards a root; the first hits it where the field is linear.
pub(super) const MAX_REFINEMENTS: usize = 6;
/// A root is good when the field is this near 0, in units of truncation / 32,767.
pub(super) const GOOD_ENOUGH: f32 = 8.0;

/// Surface point that a ray meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub depth_m: f32,
    /// Unit normal in camera axes, towards the camera.
    pub normal: [f32; 3],
    pub colour: [u8; 3],
    /// Weight of the nearest lattice point.
    pub weight: u8,
}

/// Pixels of a row whose rays meet the surface.
pub(super) struct Hits<'a> {
    len: usize,
    ids: Eight<CellId>,
    cells: Eight<Option<CrossedCell<'a>>>,
    crossings: Crossings,
}

impl<'a> Hits<'a> {
    /// None yet.
    pub fn none() -> Self {
        Self {
            len: 0,
            ids: [CellId::NONE; LANES],
            cells: [None; LANES],
            crossings: Crossings::default(),
        }
    }

    /// Adds a column whose ray meets the surface in a cell: there is space where not
    /// [`Self::is_full`].
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    pub fn push(&mut self, cells: &CrossedCells<'a, '_>, u: usize, id: CellId) {
        // The lane before, which for the first lane is the last one of the eight before.
        let [before, lane] = [(self.len + LANES - 1) % LANES, self.len % LANES];
        if id == self.ids[before] {
            // Rays side by side often meet the surface in the same cell.
            self.cells[lane] = self.cells[before];
            self.crossings.repeat(before, lane);
        } else if let Some(cell) = cells.get(id)
            && let Some(corners) = cells.corners(&cell)
        {
            self.cells[lane] = Some(cell);
            self.crossings.set(lane, &cells.faces(&cell), &corners, &cells.colours(&cell));
        } else {
            return;
        }
        self.crossings.columns[lane] = u as f32;
        self.ids[lane] = id;
        self.len += 1;
    }

    /// Returns true if all have to be taken before one more is added.
    pub fn is_full(&self) -> bool {
        self.len >= LANES
    }

    /// Hands what the rays meet no farther than `far_m` away to `show`, each with its column.
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    pub fn take(
        &mut self,
        row: &RowToHit<'_, '_>,
        vectors: Vectors,
        mut show: impl FnMut(usize, Hit),
    ) {
        let &RowToHit { cells, rays, limits_m: [near_m, far_m], rotation } = row;
        if self.len == 0 {
            return;
        }
        // Eight crossings are refined at once.
        let met = vectors.run(Meet { crossings: &self.crossings, rays, near_m, rotation });
        for lane in 0..self.len.min(LANES) {
            let depth_m = met.depth_m[lane];
            if let Some(cell) = &self.cells[lane]
                && depth_m <= far_m
            {
                let hit = hit(cells, cell, &met.meeting(lane));
                show(self.crossings.columns[lane] as usize, hit);
            }
        }
        self.len = 0;
    }
}

/// The row of pixels whose rays are met with cells.
pub(super) struct RowToHit<'a, 's> {
    pub cells: &'a CrossedCells<'a, 's>,
    pub rays: &'a RowOfRays,
    /// Nearest and farthest depth that is shown, m.
    pub limits_m: [f32; 2],
    /// Camera from world.
    pub rotation: &'a [[f32; 3]; 3],
}

/// Returns the hit at a point of a cell, given the direction in which the field rises there, in
/// camera axes.
#[inline]
#[expect(clippy::indexing_slicing, reason = "axes are below 3")]
fn hit(cells: &CrossedCells<'_, '_>, cell: &CrossedCell<'_>, meeting: &Meeting) -> Hit {
    let &Meeting { depth_m, point, direction: [right, down, forward], colour } = meeting;
    let length = libm::sqrtf(right * right + down * down + forward * forward);
    // Where all corners are alike there is no direction: the normal is 0.
    let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
    let mut nearest = cell.at.first();
    for axis in AXES {
        let next = nearest.plus(cell.at.edge(axis));
        // The corner nearest to the point: its voxel tells the weight.
        nearest = if point[axis] >= 0.5 { next } else { nearest };
    }
    Hit {
        depth_m,
        normal: [right * scale, down * scale, forward * scale],
        colour,
        weight: cells.weight(cell.slots, nearest),
    }
}

/// Input of the kernel: values of one kind next to each other.
#[derive(Default)]
struct Crossings {
    columns: Eight<f32>,
    /// The faces of the cells.
    faces: [[Eight<f32>; 3]; 2],
    /// Distances at their corners.
    corners: [Eight<f32>; 8],
    /// And colours.
    colours: [Eight<u32>; 16],
}

impl Crossings {
    /// Sets one lane's cell.
    #[inline(always)]
    fn set(&mut self, lane: usize, [lower, upper]: &Faces, corners: &[f32; 8], colours: &Colours) {
        set(&mut self.faces[0], lane, lower);
        set(&mut self.faces[1], lane, upper);
        set(&mut self.corners, lane, corners);
        set(&mut self.colours, lane, colours);
    }

    /// Sets one lane's cell to another's.
    #[inline(always)]
    fn repeat(&mut self, from: usize, to: usize) {
        let faces = self.faces(from);
        self.set(to, &faces, &at_lane(&self.corners, from), &at_lane(&self.colours, from));
    }

    /// One lane's faces.
    #[inline(always)]
    fn faces(&self, lane: usize) -> Faces {
        [at_lane(&self.faces[0], lane), at_lane(&self.faces[1], lane)]
    }
}

/// Depth and normal at which the surface is met.
#[derive(Default)]
struct Met {
    depth_m: Eight<f32>,
    /// In a cell's coordinates.
    point: [Eight<f32>; 3],
    /// Direction in which the field rises, in camera axes.
    direction: [Eight<f32>; 3],
    colour: [Eight<i32>; 3],
}

impl Met {
    /// Returns the point at which one lane's ray meets the surface.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    fn meeting(&self, lane: usize) -> Meeting {
        Meeting {
            depth_m: self.depth_m[lane],
            point: at_lane(&self.point, lane),
            direction: at_lane(&self.direction, lane),
            colour: at_lane(&self.colour, lane).map(|channel| channel as u8),
        }
    }
}

/// One ray's meeting with the surface.
struct Meeting {
    depth_m: f32,
    /// In the cell's coordinates.
    point: [f32; 3],
    /// Direction in which the field rises, in camera axes.
    direction: [f32; 3],
    colour: [u8; 3],
}

/// The work on these rays: false position, which halves the weight of an end that stays (the
/// Illinois rule), so that both ends close in; then the field's gradient.
struct Meet<'a> {
    crossings: &'a Crossings,
    rays: &'a RowOfRays,
    near_m: f32,
    /// Camera from world.
    rotation: &'a [[f32; 3]; 3],
}

impl Work for Meet<'_> {
    type Output = Met;

    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    fn run(self) -> Met {
        let Self { crossings, rays, .. } = self;
        let mut fields = [[0.0; LANES]; 8];
        let (mut from, mut to, mut depths, mut values) =
            ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [[0.0; LANES]; 2], [[0.0; LANES]; 2]);
        for lane in 0..LANES {
            let corners = at_lane(&crossings.corners, lane);
            let (ray, faces) = (rays.ray(crossings.columns[lane]), crossings.faces(lane));
            let [enters_m, leaves_m] = depths_m(&ray, &faces, self.near_m);
            let [entry, exit] =
                [position(&ray, &faces, enters_m), position(&ray, &faces, leaves_m)];
            set(&mut from, lane, &entry);
            set(&mut to, lane, &exit);
            set(&mut depths, lane, &[enters_m, leaves_m]);
            set(&mut values, lane, &[mean(&corners, entry), mean(&corners, exit)]);
        }
        for lane in 0..LANES {
            set(&mut fields, lane, &Field::new(&at_lane(&crossings.corners, lane)).0);
        }
        let ends = |lane: usize| [at_lane(&from, lane), at_lane(&to, lane)];
        // Regula falsi in the Illinois form: an end that stays twice is halved.
        let ([mut low, mut low_value], [mut high, mut high_value]) =
            ([[0.0; LANES], values[0]], [[1.0; LANES], values[1]]);
        // A ray that is good enough keeps its share, while the other lanes go on.
        let (mut share, mut side, mut is_open) = ([0.0; LANES], [0i32; LANES], [1i32; LANES]);
        for _ in 0..MAX_REFINEMENTS {
            let mut open = 0;
            for lane in 0..LANES {
                let next = low[lane]
                    + (high[lane] - low[lane])
                        * (low_value[lane] / (low_value[lane] - high_value[lane]));
                let value = Field(at_lane(&fields, lane)).at(along(ends(lane), next));
                share[lane] = if is_open[lane] != 0 { next } else { share[lane] };
                is_open[lane] &= i32::from((value >= GOOD_ENOUGH) | (value <= -GOOD_ENOUGH));
                open |= is_open[lane];
                let is_before = value > 0.0;
                let [high_stays, low_stays] =
                    [is_before & (side[lane] > 0), !is_before & (side[lane] < 0)];
                (low[lane], high[lane]) =
                    if is_before { (next, high[lane]) } else { (low[lane], next) };
                let (lower, higher) = (low_value[lane], high_value[lane]);
                low_value[lane] =
                    if is_before { value } else { lower * if low_stays { 0.5 } else { 1.0 } };
                high_value[lane] =
                    if is_before { higher * if high_stays { 0.5 } else { 1.0 } } else { value };
                side[lane] = if is_before { 1 } else { -1 };
            }
            if open == 0 {
                break;
            }
        }
        self.seen(&Passages { fields, from, to, depths, share })
    }
}

/// Rays through their cells: the field there, where and at which depths they enter and leave, and
/// the share of that way at which the surface lies.
struct Passages {
    fields: [Eight<f32>; 8],
    from: [Eight<f32>; 3],
    to: [Eight<f32>; 3],
    depths: [Eight<f32>; 2],
    share: Eight<f32>,
}

impl Meet<'_> {
    /// Returns depth, normal and colour where the rays meet the surface.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    fn seen(&self, passages: &Passages) -> Met {
        let Passages { fields, from, to, depths, share } = passages;
        let mut met = Met::default();
        for lane in 0..LANES {
            // The last secant may overshoot by rounding.
            let share = max_f32(0.0, min_f32(share[lane], 1.0));
            let point = along([at_lane(from, lane), at_lane(to, lane)], share);
            let gradient = Field(at_lane(fields, lane)).gradient(point);
            met.depth_m[lane] = depths[0][lane] + (depths[1][lane] - depths[0][lane]) * share;
            let colour = colour::mean(&at_lane(&self.crossings.colours, lane), point);
            for axis in AXES {
                let row = self.rotation[axis];
                met.colour[axis][lane] = colour[axis];
                met.point[axis][lane] = point[axis];
                met.direction[axis][lane] =
                    row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2];
            }
        }
        met
    }
}
