//! Reading the window: cells, columns, distances, ways.

use super::{
    CellState, Column, FreePath, Grid, MovingBox, Planning, PlanningConfig, PlanningReport,
    RobotCylinder,
    cells::OBJECT,
    grid::Cell,
    query::{self, KnownSpace},
    slice,
};
use crate::volume::Volume;

/// Between which heights a slice looks for obstacles, m.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// The lower one.
    pub low_m: f32,
    /// The upper one.
    pub high_m: f32,
    /// True if heights are counted from the ground below the camera rather than from that of each
    /// column.
    pub level: bool,
}

/// The distance from a cell's centre to the nearest centre of a cell of the other kind.
///
/// ```
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
/// let cells = (0..40).flat_map(|row| (0..40).map(move |column| [x + column, y + row, z]));
/// let cell_m = planning.grid().cell_m() as f32;
/// for distance in cells.filter_map(|cell| planning.slice_distance(cell)) {
///     assert!(distance.squared_cells > 0 && distance.distance_m.abs() >= 0.5 * cell_m);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Distance {
    /// Square of the distance, in cells: exact.
    pub squared_cells: u32,
    /// In metres: below 0 inside an obstacle.
    pub distance_m: f32,
    /// The nearest cell.
    pub nearest: Cell,
}

impl Planning<'_> {
    /// Draws the moving objects where they will be `ahead_s` seconds after the last frame, and
    /// makes the slice and the distance fields anew. The window beneath stays as it is: another
    /// time can be asked for next.
    pub fn predict(&mut self, ahead_s: f32) -> PlanningReport {
        let Self { cells, boxes, grid, config, box_count, .. } = self;
        // Boxes of an earlier prediction leave no trace.
        cells.bits.iter_mut().for_each(|bits| *bits &= !OBJECT);
        for moving in boxes.iter().take(*box_count) {
            moving.predicted(ahead_s).draw(grid, config.object_sigmas, cells);
        }
        let limits = Limits { low_m: config.low_m, high_m: config.high_m, level: config.level };
        self.cut_slice(&limits);
        self.fill_distances();
        let count = |state: CellState| {
            self.cells.bits.iter().filter(|bits| CellState::from_bits(**bits) == state).count()
                as u32
        };
        PlanningReport {
            occupied: count(CellState::Occupied),
            free: count(CellState::Free),
            ground: self
                .height_map
                .columns()
                .iter()
                .filter(|column| column.has(Column::GROUND))
                .count() as u32,
            obstacles: self
                .slice
                .iter()
                .filter(|state| **state == CellState::Occupied as u8)
                .count() as u32,
            boxes: self.box_count as u32,
            boxes_refused: 0,
        }
    }

    /// Makes the slice between other heights and its distance field; another slice is made by
    /// another call, and the last one stands.
    pub fn cut_slice(&mut self, limits: &Limits) {
        let Self { config, cells, height_map, slice, slice_obstacle, slice_distance, grid, .. } =
            self;
        // The other settings stay, such as whether unknown cells are obstacles.
        let config = PlanningConfig {
            low_m: limits.low_m,
            high_m: limits.high_m,
            level: limits.level,
            ..*config
        };
        slice::reduce(&config, grid.cell_m() as f32, cells, height_map, slice);
        for (obstacle, state) in slice_obstacle.iter_mut().zip(&**slice) {
            *obstacle = u8::from(is_obstacle(&config, *state));
        }
        let [width, length, _] = cells.size;
        slice_distance.transform(slice_obstacle, [width, length, 1]);
    }

    /// Makes the distance field over all cells, if there is memory for it.
    fn fill_distances(&mut self) {
        let Self { config, cells, cell_obstacle, cell_distance, .. } = self;
        let [width, length, height] = cells.size;
        if cell_obstacle.is_empty() {
            return;
        }
        // The field has its cells column by column, from the lowest up, without the ring of the
        // window.
        for (at, column) in cell_obstacle.chunks_mut(height.max(1)).enumerate() {
            let first = cells.column(at % width.max(1), at / width.max(1));
            // The window is a ring in height as well.
            for (z, obstacle) in column.iter_mut().enumerate() {
                let bits = cells.bits.get(first + cells.level(z)).copied().unwrap_or_default();
                *obstacle = u8::from(is_obstacle(config, CellState::from_bits(bits) as u8));
            }
        }
        cell_distance.transform(cell_obstacle, [width, length, height]);
    }

    /// Position of the cells in the world.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Cells along each side: to the right, ahead, upwards.
    ///
    /// ```
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
    /// assert_eq!(mapper.planning().size(), [40, 40, 10]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn size(&self) -> [usize; 3] {
        self.cells.size
    }

    /// The window's first cell.
    pub fn origin(&self) -> Cell {
        self.cells.origin
    }

    /// Returns the state of a cell, and the frames since it was last observed; `None` if it never
    /// was, or lies outside.
    pub fn cell(&self, cell: Cell) -> (CellState, Option<u32>) {
        let Some(position) = self.cells.local(cell).and_then(|local| self.cells.position(local))
        else {
            return (CellState::Unknown, None);
        };
        let state = self
            .cells
            .bits
            .get(position)
            .map_or(CellState::Unknown, |bits| CellState::from_bits(*bits));
        let stamp = self.cells.observed_at.get(position).copied().filter(|stamp| *stamp > 0);
        (state, stamp.map(|stamp| self.cells.age(stamp)))
    }

    /// The ground of a column; the cell's height does not matter. `None` outside the window.
    pub fn column(&self, [x, y, _]: Cell) -> Option<Column> {
        let [x, y, _] = self.cells.local([x, y, self.cells.origin[2]])?;
        Some(self.height_map.get(x, y))
    }

    /// The state of a column in the slice.
    pub fn slice_state(&self, [x, y, _]: Cell) -> CellState {
        let local = self.cells.local([x, y, self.cells.origin[2]]);
        let state = local.and_then(|[x, y, _]| self.slice.get(y * self.cells.size[0] + x));
        state.map_or(CellState::Unknown, |state| state_of(*state))
    }

    /// The distance from a column of the slice to the nearest of the other kind. `None` outside,
    /// and where all are of one kind.
    pub fn slice_distance(&self, [x, y, _]: Cell) -> Option<Distance> {
        let [x, y, _] = self.cells.local([x, y, self.cells.origin[2]])?;
        let width = self.cells.size[0].max(1);
        let position = y * width + x;
        let (squared, nearest) = self.slice_distance.get(position)?;
        let origin = self.cells.origin;
        let nearest =
            [origin[0] + (nearest % width) as i32, origin[1] + (nearest / width) as i32, origin[2]];
        Some(self.distance(self.slice_obstacle.get(position), squared, nearest))
    }

    /// The distance from a cell to the nearest of the other kind. `None` outside, where all are of
    /// one kind, and without
    /// [`crate::Capacity::planning_distance_3d`].
    pub fn cell_distance(&self, cell: Cell) -> Option<Distance> {
        let [x, y, z] = self.cells.local(cell)?;
        let [width, _, height] = self.cells.size.map(|side| side.max(1));
        // The order of `fill_distances`.
        let position = (y * width + x) * height + z;
        let (squared, nearest) = self.cell_distance.get(position)?;
        let column = nearest / height;
        let [ox, oy, oz] = self.cells.origin;
        let nearest = [
            ox + (column % width) as i32,
            oy + (column / width) as i32,
            oz + (nearest % height) as i32,
        ];
        Some(self.distance(self.cell_obstacle.get(position), squared, nearest))
    }

    fn distance(&self, is_obstacle: Option<&u8>, squared_cells: u32, nearest: Cell) -> Distance {
        let length_m = libm::sqrt(f64::from(squared_cells)) * self.grid.cell_m();
        let is_inside = is_obstacle.is_some_and(|obstacle| *obstacle != 0);
        Distance {
            squared_cells,
            distance_m: (if is_inside { -length_m } else { length_m }) as f32,
            nearest,
        }
    }

    /// Returns the slice's distance gradient to the right and ahead, m per m: by central
    /// differences, by one-sided ones at the window's edge. `None` if there is no distance.
    pub fn slice_gradient(&self, [x, y, z]: Cell) -> Option<[f32; 2]> {
        let along = |dx: i32, dy: i32| {
            self.difference(|n| self.slice_distance([x + n * dx, y + n * dy, z]))
        };
        Some([along(1, 0)?, along(0, 1)?])
    }

    /// Returns the gradient like [`Planning::slice_gradient`], of the field over all cells: to the
    /// right, ahead, upwards.
    pub fn cell_gradient(&self, [x, y, z]: Cell) -> Option<[f32; 3]> {
        let along = |dx: i32, dy: i32, dz: i32| {
            self.difference(|n| self.cell_distance([x + n * dx, y + n * dy, z + n * dz]))
        };
        Some([along(1, 0, 0)?, along(0, 1, 0)?, along(0, 0, 1)?])
    }

    fn difference(&self, at: impl Fn(i32) -> Option<Distance>) -> Option<f32> {
        let here = at(0)?.distance_m;
        let (low, high) = (at(-1), at(1));
        let sides = f32::from(u8::from(low.is_some()) + u8::from(high.is_some()));
        let [low, high] = [low, high].map(|side| side.map_or(here, |side| side.distance_m));
        Some(if sides > 0.0 { (high - low) / (sides * self.grid.cell_m() as f32) } else { 0.0 })
    }

    /// The moving objects of the last update, where they were in the last frame.
    pub fn boxes(&self) -> &[MovingBox] {
        self.boxes.get(..self.box_count).unwrap_or_default()
    }

    /// Length by which a ray is free: from a point of the world, in a direction of any length, at
    /// most `far_m`. See [`FreePath`].
    pub fn ray(
        &self,
        volume: &Volume<'_>,
        origin_m: [f64; 3],
        direction: [f64; 3],
        far_m: f64,
    ) -> FreePath {
        query::ray(&self.known_space(volume), origin_m, direction, far_m)
    }

    /// Length by which a robot may follow a polyline of world points on the ground.
    pub fn sweep(
        &self,
        volume: &Volume<'_>,
        path_m: &[[f64; 3]],
        robot: &RobotCylinder,
    ) -> FreePath {
        query::sweep(&self.known_space(volume), self.config.min_weight, path_m, robot)
    }

    fn known_space<'a, 'v>(&'a self, volume: &'a Volume<'v>) -> KnownSpace<'a, 'v, 'a> {
        KnownSpace { volume, grid: &self.grid, cells: &self.cells }
    }
}

fn state_of(state: u8) -> CellState {
    match state {
        1 => CellState::Free,
        2 => CellState::Occupied,
        _ => CellState::Unknown,
    }
}

fn is_obstacle(config: &PlanningConfig, state: u8) -> bool {
    match state_of(state) {
        CellState::Occupied => true,
        CellState::Unknown => config.unknown_is_obstacle,
        CellState::Free => false,
    }
}
