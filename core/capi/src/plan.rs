//! Maps for planners: the window, moving objects, rays and paths.

use crate::{
    DynvoxMapper, DynvoxStatus,
    given::{Owned, items, items_mut, output, read},
    handle::with,
};
use dynvox_core::planning::{CellState, FreePath, MovingBox, PathEnd, Planning, RobotCylinder};

/// The planner's window from above: buffers of the caller, any may be null. Columns are in rows
/// from the nearest ahead to the farthest, in each row from left to right; cells of a column follow
/// each other upwards.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxWindow {
    /// Columns that each buffer of columns holds, unless it is null.
    pub columns_capacity: usize,
    /// Cells that `cells` holds, unless it is null.
    pub cells_capacity: usize,
    /// State of each column between the configured heights: 0 unknown, 1 free, 2 occupied.
    pub state: *mut u8,
    /// Distance to the nearest obstacle, m, below 0 inside one; the largest float without an
    /// obstacle.
    pub distance_m: *mut f32,
    /// Height of the ground, m; the largest float where none was found.
    pub height_m: *mut f32,
    /// Rise over run of the ground; the largest float where it is not known.
    pub slope: *mut f32,
    /// Height of the step through the column, m.
    pub step_m: *mut f32,
    /// State of each cell: 0 unknown, 1 free, 2 occupied.
    pub cells: *mut u8,
    /// Written: cells to the right, ahead and upwards.
    pub size: [usize; 3],
    /// Written: a cell's side, m.
    pub cell_m: f64,
    /// Written: where the first cell begins, m to the right, ahead and upwards of the world's
    /// origin.
    pub origin_m: [f64; 3],
    /// Written: the world's coordinates of a metre to the right, ahead and upwards, in this order.
    pub axes_world: [[f64; 3]; 3],
}

/// A moving object in the window's axes: to the right, ahead, upwards of the world's origin.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxMovingBox {
    /// Number of its track.
    pub id: u32,
    /// Frames since it was last seen.
    pub unseen_frames: u32,
    /// Centre, m.
    pub center_m: [f32; 3],
    /// Half its sides, m: along its heading, across it, upwards.
    pub half_m: [f32; 3],
    /// Heading, a unit vector: right, ahead.
    pub heading: [f32; 2],
    /// Velocity, m/s: right, ahead.
    pub velocity_m_s: [f32; 2],
    /// Error of the centre, one sigma, m.
    pub sigma_m: f32,
    /// Error of the velocity, one sigma, m/s.
    pub sigma_m_s: f32,
}

/// End of a ray or a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum DynvoxPathEnd {
    /// The way is free as far as was asked.
    Free = 0,
    /// At a surface of the map.
    Surface,
    /// Cell that was never observed.
    Unknown,
}

/// A ray or a path, as far as it is free.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxFreePath {
    /// End of the free part.
    pub end: DynvoxPathEnd,
    /// Length of the free part, m.
    pub free_m: f64,
}

/// A robot that moves along a path: an upright cylinder.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxRobotCylinder {
    /// Radius of the robot, m.
    pub radius_m: f64,
    /// From this height over the path, m, on surfaces are in its way.
    pub low_m: f64,
    /// Up to this one.
    pub high_m: f64,
    /// 1 if cells that were never observed end the path as well, else 0.
    pub unknown_ends: u8,
}

impl From<&MovingBox> for DynvoxMovingBox {
    fn from(of: &MovingBox) -> Self {
        let &MovingBox {
            id,
            unseen_frames,
            center_m,
            half_m,
            heading,
            velocity_m_s,
            sigma_m,
            sigma_m_s,
        } = of;
        Self { id, unseen_frames, center_m, half_m, heading, velocity_m_s, sigma_m, sigma_m_s }
    }
}

impl From<FreePath> for DynvoxFreePath {
    fn from(way: FreePath) -> Self {
        let end = match way.end {
            PathEnd::Free => DynvoxPathEnd::Free,
            PathEnd::Surface => DynvoxPathEnd::Surface,
            PathEnd::Unknown => DynvoxPathEnd::Unknown,
        };
        Self { end, free_m: way.free_m }
    }
}

const fn code(state: CellState) -> u8 {
    match state {
        CellState::Unknown => 0,
        CellState::Free => 1,
        CellState::Occupied => 2,
    }
}

/// Reads the map into the planner's window, with moving objects where they will be `ahead_s`
/// seconds after the last frame, and copies it to `window`. Of a capacity without a window its size
/// is 0.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `window` is null or points to a window whose buffers are as large as it says and
/// overlap nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_update_planning_maps(
    mapper: *mut DynvoxMapper,
    ahead_s: f32,
    window: *mut DynvoxWindow,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, buffer| {
            let mut to = read(window.cast_const())?;
            mapper.update_planning_maps(ahead_s);
            let planning = mapper.planning();
            let (grid, cell_m) = (planning.grid(), planning.grid().cell_m());
            (to.size, to.cell_m) = (planning.size(), cell_m);
            to.origin_m = planning.origin().map(|c| f64::from(c) * cell_m);
            to.axes_world = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|axis: [f64; 3]| grid.to_world(axis.map(|c| c / cell_m)));
            copy_window(planning, &to, buffer)?;
            window.write(to);
            Ok(())
        })
    }
}

/// Copies what the caller has buffers for.
///
/// # Safety
/// Each buffer is null or as large as the window says, and nothing else uses it.
unsafe fn copy_window(
    planning: &Planning<'_>,
    to: &DynvoxWindow,
    buffer: &Owned,
) -> Result<(), DynvoxStatus> {
    let [width, length, height] = planning.size();
    let [x, y, z] = planning.origin();
    let at = move |column: usize| {
        [x + (column % width.max(1)) as i32, y + (column / width.max(1)) as i32, z]
    };
    let columns = width * length;
    let column = |at| planning.column(at).unwrap_or_default();
    // C has no optional numbers: the largest one stands for none.
    let none = |value: Option<f32>| value.unwrap_or(f32::MAX);
    let has_columns =
        [to.distance_m, to.height_m, to.slope, to.step_m].iter().any(|of| !of.is_null())
            || !to.state.is_null();
    if (has_columns && to.columns_capacity < columns)
        || (!to.cells.is_null() && to.cells_capacity < columns * height)
    {
        return Err(DynvoxStatus::TooSmall);
    }
    // SAFETY: the caller's promise; sizes were checked.
    unsafe {
        fill(to.state, columns, buffer, |n| code(planning.slice_state(at(n))))?;
        fill(to.distance_m, columns, buffer, |n| {
            none(planning.slice_distance(at(n)).map(|distance| distance.distance_m))
        })?;
        fill(to.height_m, columns, buffer, |n| none(column(at(n)).ground_m()))?;
        fill(to.slope, columns, buffer, |n| none(column(at(n)).slope()))?;
        fill(to.step_m, columns, buffer, |n| column(at(n)).step_m)?;
        fill(to.cells, columns * height, buffer, |n| {
            let [x, y, z] = at(n / height.max(1));
            code(planning.cell([x, y, z + (n % height.max(1)) as i32]).0)
        })
    }
}

/// Fills a buffer, unless it is null.
///
/// # Safety
/// `output` is null or points to as many items, which nothing else uses.
unsafe fn fill<T>(
    output: *mut T,
    count: usize,
    mapper: &Owned,
    value: impl Fn(usize) -> T,
) -> Result<(), DynvoxStatus> {
    if output.is_null() {
        return Ok(());
    }
    // SAFETY: the caller's promise.
    let items = unsafe { items_mut(output, count, mapper)? };
    items.iter_mut().enumerate().for_each(|(at, item)| *item = value(at));
    Ok(())
}

/// Writes the moving objects of the last dynvox_update_planning_maps, where they were in the last
/// frame, at most `capacity` of them, and to `count` how many there are.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `boxes` is null or points to `capacity` boxes, `count` is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_moving_boxes(
    mapper: *mut DynvoxMapper,
    boxes: *mut DynvoxMovingBox,
    capacity: usize,
    count: *mut usize,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, buffer| {
            let count = output(count)?;
            let to = items_mut(boxes, capacity, buffer)?;
            let known = mapper.planning().boxes();
            // As many as fit; the count tells how many there were.
            to.iter_mut().zip(known).for_each(|(to, from)| *to = from.into());
            count.write(known.len());
            Ok(())
        })
    }
}

/// Follows a ray of the world from `origin_m` in `direction` (three numbers each, the direction of
/// any length), at most `far_m`, to the first surface or unknown place.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `origin_m` and `direction` are null or point to three numbers, `free_path` is null or
/// points to a free path.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_ray(
    mapper: *mut DynvoxMapper,
    origin_m: *const f64,
    direction: *const f64,
    far_m: f64,
    free_path: *mut DynvoxFreePath,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            let free_path = output(free_path)?;
            let (origin_m, direction) =
                (read(origin_m.cast::<[f64; 3]>())?, read(direction.cast::<[f64; 3]>())?);
            free_path.write(
                mapper.planning().ray(mapper.static_map(), origin_m, direction, far_m).into(),
            );
            Ok(())
        })
    }
}

/// Measures how far a robot may follow a polyline of `count` world points on the ground, three
/// numbers each, before it touches a surface.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `points_m` is null or points to three times `count` numbers, `robot` is null or points
/// to a robot, `free_path` is null or points to a free path.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_sweep(
    mapper: *mut DynvoxMapper,
    points_m: *const f64,
    count: usize,
    robot: *const DynvoxRobotCylinder,
    free_path: *mut DynvoxFreePath,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, buffer| {
            let (free_path, robot) = (output(free_path)?, read(robot)?);
            let path = items(points_m.cast::<[f64; 3]>(), count, buffer)?;
            let DynvoxRobotCylinder { radius_m, low_m, high_m, unknown_ends } = robot;
            let robot = RobotCylinder { radius_m, low_m, high_m, unknown_ends: unknown_ends != 0 };
            free_path.write(mapper.planning().sweep(mapper.static_map(), path, &robot).into());
            Ok(())
        })
    }
}
