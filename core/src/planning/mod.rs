//! Maps for planners: what is free, occupied or unknown around the camera, how far the nearest
//! obstacle is, how high ground lies.
//!
//! | part | what | source |
//! |---|---|---|
//! | window | cells around the camera, turned upright: free, occupied, unknown, and the age of the last look | Elfes 1989; the map |
//! | ground | height, slope, roughness, step of each column, and what hangs over it | Himmelsbach et al. 2010 |
//! | boxes | moving objects with their velocity, at a chosen time ahead | the tracks |
//! | slice | the window's columns between two heights, as one picture | |
//! | distance fields | exact squared distances to the nearest obstacle, signed, over a slice and over the window | Maurer et al. 2003 |
//! | ways | how far a ray or a robot's path is free | the map |
//!
//! Free space is marked in every frame that is fused ([`Planning::observe`]); all else is read from
//! the map on request ([`Planning::update`]), so a mapper whose planner asks at 5 Hz pays for 5 Hz.
//! The window moves with the camera by whole cells, and what leaves it is forgotten. Cells whose
//! blocks leave a full map are unknown until they are seen again.
//!
//! Memory: nothing where [`Capacity::planning_width`] or another side is 0. Else 2 bytes for every
//! third pixel, 6 bytes a cell, 42 bytes a column and 16 for the longest side, and with
//! [`Capacity::planning_distance_3d`] 9 bytes a cell and 16 for the longest side more; 56 bytes a
//! track. Time: linear in cells, columns and blocks; see docs/measurements/speed.md. What can
//! go wrong: nothing; a window without ground, free space or obstacles says so.

mod boxes;
mod cells;
mod config;
mod distance;
mod fields;
mod free_space;
mod grid;
mod height_map;
mod lost;
mod plane_fit;
mod pyramid;
mod query;
mod slice;
mod surface;
#[cfg(test)]
mod tests;

pub(crate) use boxes::BoxFit;
pub use boxes::MovingBox;
pub use cells::{CellState, MAX_SIDE_CELLS};
pub use config::{MAX_CELL_VOXELS, PlanningConfig};
pub use distance::{DistanceField, NO_OBSTACLE};
pub use fields::{Distance, Limits};
pub use free_space::DepthView;
pub(crate) use free_space::MARGIN_PX;
pub use grid::{Cell, Grid};
pub use height_map::Column;
pub(crate) use lost::Watched;
pub use query::{FreePath, PathEnd, RobotCylinder};
pub(crate) use surface::crossings;

use crate::{
    digest::Digest,
    geometry::Transform,
    memory::{Capacity, Carver, region_bytes},
    state::Visitor,
    volume::Volume,
};
use cells::{Cells, OCCUPIED};
use height_map::{Growth, HeightMap, Level};
use pyramid::Pyramid;

/// Result of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct PlanningReport {
    /// Cells that a surface runs through, or that a moving object may be in.
    pub occupied: u32,
    /// Cells that were seen free.
    pub free: u32,
    /// Columns with ground.
    pub ground: u32,
    /// Columns of the slice that are obstacles.
    pub obstacles: u32,
    /// Moving objects drawn.
    pub boxes: u32,
    /// Moving objects that there was no box left for.
    pub boxes_refused: u32,
}

/// The window and what is made of it.
#[derive(Debug)]
pub struct Planning<'s> {
    config: PlanningConfig,
    grid: Grid,
    cells: Cells<'s>,
    pyramid: Pyramid<'s>,
    height_map: HeightMap<'s>,
    /// The state of each column, x fastest.
    slice: &'s mut [u8],
    /// Obstacle flags of each column, and of each cell: 0 or 1.
    slice_obstacle: &'s mut [u8],
    cell_obstacle: &'s mut [u8],
    slice_distance: DistanceField<'s>,
    cell_distance: DistanceField<'s>,
    boxes: &'s mut [MovingBox],
    box_count: usize,
    /// Ground as the last frame that showed any saw it, below the camera.
    level: Level,
    /// Column of the camera, from the window's first.
    camera: [usize; 2],
}

impl<'s> Planning<'s> {
    /// Bytes of the slab; 0 without cells.
    pub const fn bytes(capacity: &Capacity) -> usize {
        let [width, length, height] = Cells::sides(capacity);
        let columns = width * length;
        // Without columns not even the boxes have memory: no window costs nothing.
        if columns == 0 {
            return 0;
        }
        let cells = if capacity.planning_distance_3d { columns * height } else { 0 };
        let longest = if width > height { width } else { height };
        Cells::bytes(capacity)
            + Pyramid::bytes(capacity)
            + HeightMap::bytes(columns)
            + 2 * region_bytes::<u8>(columns)
            + region_bytes::<u8>(cells)
            + DistanceField::bytes(columns, longest)
            + DistanceField::bytes(cells, longest)
            + region_bytes::<MovingBox>(capacity.tracks)
    }

    /// Allocates an empty window for a map with voxels of that size.
    pub fn new_in(
        capacity: &Capacity,
        config: &PlanningConfig,
        voxel_size_m: f32,
        carver: &mut Carver<'s>,
    ) -> Self {
        if Self::bytes(capacity) == 0 {
            return carver.absent(|carver| Self::alloc(capacity, config, voxel_size_m, carver));
        }
        carver.group("planning", |carver| Self::alloc(capacity, config, voxel_size_m, carver))
    }

    fn alloc(
        capacity: &Capacity,
        config: &PlanningConfig,
        voxel_size_m: f32,
        carver: &mut Carver<'s>,
    ) -> Self {
        let [width, length, height] = Cells::sides(capacity);
        let columns = width * length;
        // The field in three dimensions is optional: without it no cell is allocated.
        let cells = if capacity.planning_distance_3d { columns * height } else { 0 };
        let longest = if width > height { width } else { height };
        Self {
            config: *config,
            grid: Grid::new(config, voxel_size_m),
            cells: Cells::new_in(capacity, carver),
            pyramid: Pyramid::new_in(capacity, carver),
            height_map: HeightMap::new_in(width, length, carver),
            slice: carver.alloc("planning.slice", columns),
            slice_obstacle: carver.alloc("planning.slice_obstacle", columns),
            cell_obstacle: carver.alloc("planning.cell_obstacle", cells),
            slice_distance: DistanceField::new_in(columns, longest, carver),
            cell_distance: DistanceField::new_in(cells, longest, carver),
            boxes: carver.alloc("planning.boxes", capacity.tracks),
            box_count: 0,
            level: Level::default(),
            camera: [0; 2],
        }
    }

    /// Tells that there is no window.
    pub fn is_empty(&self) -> bool {
        self.cells.observed_at.is_empty()
    }

    /// Returns true if the planner needs the ground plane of each frame it observes: there is a
    /// window, and no height of the camera is configured.
    pub fn seeks_ground(&self) -> bool {
        !self.is_empty() && f64::from(self.config.camera_height_m) <= 0.0
    }

    /// Moves the window to the camera and marks what a frame sees through. Nothing without a
    /// window, or where the pose lies beyond 2^24 cells.
    pub fn observe(&mut self, sight: &DepthView<'_>) {
        let camera = self.grid.of_camera(sight.t_world_camera).1;
        let Some(cell) = self.grid.cell_at(camera).filter(|_| !self.is_empty()) else { return };
        let [width, length, _] = self.cells.size;
        let below = libm::floor(f64::from(self.config.below_m) / self.grid.cell_m()) as i32;
        // Before new marks are made, those there are age by one frame.
        self.cells.advance();
        // The camera in the middle, and `below_m` beneath it.
        self.cells.move_to([
            cell[0] - width as i32 / 2,
            cell[1] - length as i32 / 2,
            cell[2] - below,
        ]);
        self.camera = [width / 2, length / 2];
        self.level_ground(sight);
        self.pyramid.build(sight.disparity_q8);
        free_space::mark(&self.config, &self.grid, sight, &self.pyramid, &mut self.cells);
    }

    /// Finds the plane that ground is expected in: what the disparity image shows, or the camera's
    /// height where that is configured. A frame that shows no ground leaves the plane where it was.
    fn level_ground(&mut self, sight: &DepthView<'_>) {
        let height_m = f64::from(self.config.camera_height_m);
        let shown = sight.ground.filter(|_| self.seeks_ground());
        let cell_m = self.grid.cell_m();
        // The grid coordinates of a point of the camera's frame, m.
        let in_grid = |point: [f64; 3]| {
            self.grid.of_world(sight.t_world_camera.transform_point(point)).map(|c| c * cell_m)
        };
        // Without a plane in view, the level stays; a given camera height replaces it.
        let Some(plane) = shown else {
            if height_m > 0.0 {
                let camera = in_grid([0.0; 3]);
                self.level = Level { height_m: (camera[2] - height_m) as f32, slope: [0.0; 2] };
            }
            return;
        };
        // Ground below the camera, and ten metres ahead and to the right of there: its plane holds
        // y for x and z.
        let ground = |x: f64, z: f64| in_grid([x, plane.above_m([x, 0.0, z]), z]);
        let (below, ahead, right) = (ground(0.0, 0.0), ground(0.0, 10.0), ground(10.0, 0.0));
        let [a, b] =
            [ahead, right].map(|to| [to[0] - below[0], to[1] - below[1], to[2] - below[2]]);
        let determinant = a[0] * b[1] - a[1] * b[0];
        // Two directions that are nearly parallel, as with a camera that looks straight down, span
        // no plane.
        if libm::fabs(determinant) > 1.0 {
            let slope = [
                (a[2] * b[1] - b[2] * a[1]) / determinant,
                (a[0] * b[2] - b[0] * a[2]) / determinant,
            ];
            // The level holds below the camera, from where growth begins.
            let camera = in_grid([0.0; 3]);
            let height_m =
                below[2] + slope[0] * (camera[0] - below[0]) + slope[1] * (camera[1] - below[1]);
            self.level = Level { height_m: height_m as f32, slope: slope.map(|c| c as f32) };
        }
    }

    /// Forgets what was observed, as when the camera enters another segment of the map.
    pub(crate) fn forget(&mut self) {
        self.cells.forget();
        (self.level, self.box_count) = (Level::default(), 0);
    }

    /// Reads the map into the window, finds the ground, and forgets the moving objects of the last
    /// update.
    pub(crate) fn read(&mut self, volume: &Volume<'_>) {
        surface::read(volume, &self.grid, self.config.min_weight, &mut self.cells);
        self.box_count = 0;
    }

    /// Adds the surface of an object that stands still: a map of its own, with its frame in the
    /// world.
    pub(crate) fn add_static(&mut self, volume: &Volume<'_>, t_world_object: &Transform) {
        let voxel_m = f64::from(volume.config().voxel_size_m);
        let Self { grid, cells, config, .. } = self;
        for (slot, coord) in volume.current_blocks() {
            crossings(volume, slot, coord, config.min_weight, |crossing| {
                // From the object's frame into the world's, and from there into the window's cells.
                let point = t_world_object.transform_point(crossing.point_m(voxel_m));
                let position = grid
                    .cell_at(grid.of_world(point))
                    .and_then(|cell| cells.position(cells.local(cell)?));
                if let Some(bits) = position.and_then(|at| cells.bits.get_mut(at)) {
                    *bits |= OCCUPIED;
                }
            });
        }
    }

    /// Takes in a moving object. `false` where there are more than tracks.
    pub(crate) fn add_moving(&mut self, moving: MovingBox) -> bool {
        let Some(entry) = self.boxes.get_mut(self.box_count) else { return false };
        *entry = moving;
        self.box_count += 1;
        true
    }

    /// Finds the ground and makes the slice and the distance fields, with moving objects where they
    /// will be `ahead_s` seconds after the last frame.
    pub(crate) fn finish(&mut self, ahead_s: f32) -> PlanningReport {
        let cell_m = self.grid.cell_m() as f32;
        let Self { config, cells, .. } = self;
        let growth = Growth { config, cell_m, center: self.camera, cells };
        self.height_map.find(self.level, &growth);
        self.predict(ahead_s)
    }

    /// Makes the whole of it from a map alone, without objects: as
    /// [`crate::Mapper::update_planning_maps`] does with them.
    pub fn update(&mut self, volume: &Volume<'_>) -> PlanningReport {
        self.read(volume);
        self.finish(0.0)
    }

    /// Visits what lives from frame to frame; nothing without a window.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            cells,
            level,
            // Told by the caller.
            config: _,
            grid: _,
            // Belongs to one frame.
            pyramid: _,
            // Made on request.
            height_map: _,
            slice: _,
            slice_obstacle: _,
            cell_obstacle: _,
            slice_distance: _,
            cell_distance: _,
            boxes: _,
            box_count: _,
            // Follows from the window's size.
            camera,
        } = self;
        if cells.observed_at.is_empty() {
            return;
        }
        cells.visit(visitor);
        let Level { height_m, slope: [right, ahead] } = level;
        [height_m, right, ahead].into_iter().for_each(|value| visitor.f32(value));
        *camera = [cells.size[0] / 2, cells.size[1] / 2];
    }

    /// Digest of the window, the ground and the distance fields, as they stand after the last
    /// update: the same on every machine.
    pub fn digest(&self) -> u64 {
        // The origin first: the same cells elsewhere are another window.
        let mut digest = Digest::default();
        self.cells.origin.iter().for_each(|c| digest.u64(*c as u64));
        self.cells.observed_at.iter().for_each(|stamp| digest.u64(u64::from(*stamp)));
        digest.bytes(self.cells.bits);
        for column in self.height_map.columns() {
            let values = [
                column.height_m,
                column.reference_m,
                column.slope[0],
                column.slope[1],
                column.roughness_m,
                column.step_m,
            ];
            values
                .iter()
                .chain([&column.clearance_m])
                .for_each(|value| digest.u64(u64::from(value.to_bits())));
        }
        digest.bytes(self.slice);
        self.slice_distance.digest(&mut digest);
        self.cell_distance.digest(&mut digest);
        digest.finish()
    }
}
