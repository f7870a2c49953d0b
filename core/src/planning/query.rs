//! Questions to the map itself, for which no window need be read: how far a ray is free, and
//! whether a robot fits along a path.
//!
//! Free space far from surfaces is not in the map, whose blocks lie around surfaces alone: there
//! the window's cells are asked, and outside the window what the map has not seen is unknown.

use super::{
    cells::{CellState, Cells, is_ghost},
    grid::Grid,
    surface::crossings,
};
use crate::volume::{BLOCK_SIDE, Volume};

/// End of a ray or a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PathEnd {
    /// The path does not end: it is free as far as was asked.
    Free,
    /// At a surface of the map.
    Surface,
    /// At a place that was never seen.
    Unknown,
}

/// Length by which a way is free.
///
/// ```
/// use dynvox_core::planning::PathEnd;
/// # use dynvox_core::{
/// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
/// #     image::View, memory::SLAB_ALIGN,
/// # };
/// # let rig =
/// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// # let capacity = Capacity {
/// #     planning_width: 60, planning_length: 60, planning_height: 20, ..Capacity::TINY
/// # };
/// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
/// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
/// # let (grey, wall) = ([90; 320 * 96], [25 << 8; 320 * 96]);
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
/// // From 1 m ahead of the camera on; a wall stands at 4 m.
/// let path = mapper.planning().ray(mapper.static_map(), [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], 9.0);
/// assert_eq!(path.end, PathEnd::Surface);
/// assert!((path.free_m - 3.0).abs() < 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FreePath {
    /// End of the free part.
    pub end: PathEnd,
    /// Length of the free part, m.
    pub free_m: f64,
}

/// A robot that moves along a path: an upright cylinder.
///
/// ```
/// use dynvox_core::planning::{PathEnd, RobotCylinder};
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
/// let robot = RobotCylinder { radius_m: 0.3, low_m: -0.2, high_m: 0.2, unknown_ends: false };
/// let path_m = [[0.0, 0.0, 2.0], [0.0, 0.0, 12.0]];
/// let path = mapper.planning().sweep(mapper.static_map(), &path_m, &robot);
/// assert_eq!(path.end, PathEnd::Surface);
/// assert!(path.free_m < 8.0, "the rim touches before the middle");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RobotCylinder {
    /// Radius, m.
    pub radius_m: f64,
    /// From this height over the path, m, on surfaces are in its way,
    pub low_m: f64,
    /// up to this one.
    pub high_m: f64,
    /// Places never seen are in its way as well.
    pub unknown_ends: bool,
}

/// Known space: the map, and the window around the camera.
#[derive(Clone, Copy)]
pub(super) struct KnownSpace<'a, 'v, 'c> {
    pub volume: &'a Volume<'v>,
    pub grid: &'a Grid,
    pub cells: &'a Cells<'c>,
}

/// Follows a ray from a point of the world in a direction of any length, at most `far_m`, to the
/// first surface or unknown place.
///
/// The surface is where the distance of the nearest lattice points falls to 0 or below, looked at
/// every half voxel: the map keeps at least two voxels behind each surface, so none is stepped
/// over. Time: linear in `far_m`.
pub(super) fn ray(
    &KnownSpace { volume, grid, cells }: &KnownSpace<'_, '_, '_>,
    origin_m: [f64; 3],
    direction: [f64; 3],
    far_m: f64,
) -> FreePath {
    let length = libm::sqrt(direction.iter().map(|c| c * c).sum::<f64>());
    let voxel_m = f64::from(volume.config().voxel_size_m);
    let step_m = 0.5 * voxel_m;
    let steps = far_m / step_m;
    // False for NaN as well.
    let is_usable = length > 0.0
        && length.is_finite()
        && origin_m.iter().all(|c| c.is_finite())
        && (0.0..1e7).contains(&steps);
    if !is_usable {
        return FreePath { end: PathEnd::Unknown, free_m: 0.0 };
    }
    // The map decides where it was observed, the window elsewhere.
    let mut sampler = volume.sampler();
    // Signed distance at the step before, if it was before a surface.
    let mut before: Option<f64> = None;
    for n in 0..=steps as u32 {
        let at_m = f64::from(n) * step_m;
        let mut point = origin_m;
        point.iter_mut().zip(direction).for_each(|(point, along)| *point += along * at_m / length);
        let lattice = point.map(|c| libm::floor(c / voxel_m + 0.5) as i32);
        let end = match sampler.voxel(lattice) {
            // Zero or below is behind the surface; ghosts of moved objects are no surface.
            Some(voxel) if voxel.sdf <= 0 && !bits_at(grid, cells, point).is_some_and(is_ghost) => {
                let now = f64::from(voxel.sdf);
                // Linear between the two samples: finer than the step.
                let back = before.map_or(0.0, |before| now / (now - before) * step_m);
                return FreePath {
                    end: PathEnd::Surface,
                    free_m: if back < at_m { at_m - back } else { 0.0 },
                };
            }
            Some(voxel) => {
                before = (voxel.sdf > 0).then(|| f64::from(voxel.sdf));
                continue;
            }
            None => state_at(grid, cells, point),
        };
        // A surface between two samples with unknown space between them has no position.
        before = None;
        // Unknown is never free.
        if end == CellState::Unknown {
            return FreePath { end: PathEnd::Unknown, free_m: at_m };
        }
    }
    FreePath { end: PathEnd::Free, free_m: far_m }
}

fn state_at(grid: &Grid, cells: &Cells<'_>, point_m: [f64; 3]) -> CellState {
    bits_at(grid, cells, point_m).map_or(CellState::Unknown, CellState::from_bits)
}

/// The bits of the cell that holds a point of the world; `None` outside the window.
fn bits_at(grid: &Grid, cells: &Cells<'_>, point_m: [f64; 3]) -> Option<u8> {
    let cell = grid.cell_at(grid.of_world(point_m))?;
    cells.bits.get(cells.position(cells.local(cell)?)?).copied()
}

/// Length by which a robot may follow a polyline, its points in world coordinates on the ground.
///
/// Every surface point within `radius_m` of the path and between the heights is found by the edges
/// of the map that it crosses, so the answer is as fine as the map, not as the window's cells; the
/// first place is where the robot's rim touches it. Unknown cells of the window are looked up at
/// the path's middle, every half cell. Time: linear in the map's blocks, and in the surface near
/// the path times its points.
pub(super) fn sweep(
    &KnownSpace { volume, grid, cells }: &KnownSpace<'_, '_, '_>,
    min_weight: u8,
    path_m: &[[f64; 3]],
    robot: &RobotCylinder,
) -> FreePath {
    let cell_m = grid.cell_m();
    let to_grid_m = |point: [f64; 3]| grid.of_world(point).map(|c| c * cell_m);
    let legs = || {
        path_m
            .iter()
            .zip(path_m.iter().skip(1))
            .map(move |(from, to)| Leg::new(to_grid_m(*from), to_grid_m(*to)))
    };
    let whole_m = legs().map(|leg| leg.length_m).sum::<f64>();
    if !whole_m.is_finite() {
        return FreePath { end: PathEnd::Unknown, free_m: 0.0 };
    }
    let mut way = FreePath { end: PathEnd::Free, free_m: whole_m };
    let voxel_m = f64::from(volume.config().voxel_size_m);
    let block_m = voxel_m * BLOCK_SIDE as f64;
    // Blocks in the order of the pool; the nearest touch wins, so that the order does not matter.
    for (slot, coord) in volume.current_blocks() {
        let center = to_grid_m(coord.origin().map(|c| f64::from(c) * voxel_m + 0.5 * block_m));
        // Half a block's diagonal, and a voxel.
        if !legs().any(|leg| leg.is_within(center, robot, block_m)) {
            continue;
        }
        crossings(volume, slot, coord, min_weight, |crossing| {
            let point_m = crossing.point_m(voxel_m);
            if bits_at(grid, cells, point_m).is_some_and(is_ghost) {
                return;
            }
            let point = to_grid_m(point_m);
            let mut start_m = 0.0;
            for leg in legs() {
                // Legs in order: the first that touches the point is where the robot meets it.
                if let Some(at_m) = leg.touches(point, robot) {
                    if start_m + at_m < way.free_m {
                        way = FreePath { end: PathEnd::Surface, free_m: start_m + at_m };
                    }
                    break;
                }
                start_m += leg.length_m;
            }
        });
    }
    // Cells never observed end the path as an obstacle would, when the caller asks for that.
    let unknown = robot.unknown_ends.then(|| {
        let mut start_m = 0.0;
        legs().find_map(|leg| {
            let found = leg.first_unknown(grid, cells, robot, way.free_m - start_m);
            let at_m = found.map(|at_m| start_m + at_m);
            start_m += leg.length_m;
            at_m
        })
    });
    unknown.flatten().map_or(way, |free_m| FreePath { end: PathEnd::Unknown, free_m })
}

/// A straight part of a path, in the grid's axes, m.
struct Leg {
    from: [f64; 3],
    /// A unit vector across the ground.
    along: [f64; 2],
    /// Length across the ground.
    length_m: f64,
    rise: f64,
}

impl Leg {
    fn new(from: [f64; 3], to: [f64; 3]) -> Self {
        let [dx, dy, dz] = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
        let length_m = libm::sqrt(dx * dx + dy * dy);
        let share = if length_m > 0.0 { 1.0 / length_m } else { 0.0 };
        Self { from, along: [dx * share, dy * share], length_m, rise: dz * share }
    }

    /// A point along the leg and beside it.
    fn local(&self, point: [f64; 3]) -> [f64; 2] {
        let [dx, dy] = [point[0] - self.from[0], point[1] - self.from[1]];
        [self.along[0] * dx + self.along[1] * dy, self.along[0] * dy - self.along[1] * dx]
    }

    /// Tells that something `reach_m` around a point may touch the robot.
    fn is_within(&self, point: [f64; 3], robot: &RobotCylinder, reach_m: f64) -> bool {
        let (reach_m, [along, beside]) = (reach_m + robot.radius_m, self.local(point));
        along > -reach_m && along < self.length_m + reach_m && libm::fabs(beside) < reach_m
    }

    /// Distance along the leg at which the robot touches a point first, m.
    fn touches(&self, point: [f64; 3], robot: &RobotCylinder) -> Option<f64> {
        let [along, beside] = self.local(point);
        let square = robot.radius_m * robot.radius_m - beside * beside;
        // The point passes beside the robot.
        if square < 0.0 {
            return None;
        }
        let half = libm::sqrt(square);
        // The robot's circle covers the point between these two positions of its centre.
        let (begins, leaves) = (along - half, along + half);
        if leaves < 0.0 || begins > self.length_m {
            return None;
        }
        // Where the leg begins within reach of the point, it touches at once.
        let at_m = if begins > 0.0 { begins } else { 0.0 };
        // Heights count from the path, which rises along the leg.
        let above_m = point[2] - (self.from[2] + self.rise * at_m);
        (above_m >= robot.low_m && above_m <= robot.high_m).then_some(at_m)
    }

    /// The first place on the leg, before `until_m`, that was never seen.
    fn first_unknown(
        &self,
        grid: &Grid,
        cells: &Cells<'_>,
        robot: &RobotCylinder,
        until_m: f64,
    ) -> Option<f64> {
        let cell_m = grid.cell_m();
        let until_m = if until_m < self.length_m { until_m } else { self.length_m };
        let middle = 0.5 * (robot.low_m + robot.high_m);
        let steps = until_m / (0.5 * cell_m);
        // Written so that NaN is refused; the bound keeps the cast exact.
        if !(0.0..1e7).contains(&steps) {
            return None;
        }
        (0..=steps as u32).map(|n| f64::from(n) * 0.5 * cell_m).find(|&at_m| {
            let point = [
                self.from[0] + self.along[0] * at_m,
                self.from[1] + self.along[1] * at_m,
                self.from[2] + self.rise * at_m + middle,
            ];
            let position = grid
                .cell_at(point.map(|c| c / cell_m))
                .and_then(|cell| cells.position(cells.local(cell)?));
            position
                .and_then(|at| cells.bits.get(at))
                .is_none_or(|bits| CellState::from_bits(*bits) == CellState::Unknown)
        })
    }
}
