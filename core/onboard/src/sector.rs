//! Directions around a vehicle: what comes first in each.

use crate::columns::{ColumnState, Levels, state};
use crate::vehicle::{OnGrid, Vehicle};
use dynvox_core::planning::Planning;

/// Number of directions, as MAVLink's `OBSTACLE_DISTANCE` has them.
pub const SECTORS: usize = 72;
/// Width of a direction, degrees.
pub const SECTOR_DEG: f64 = 360.0 / SECTORS as f64;
/// Most columns looked at to each side of the vehicle.
const REACH_MAX_CELLS: i32 = 1024;

/// Space around the vehicle that counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Radius of the vehicle, m: what is nearer is the vehicle itself.
    pub body_m: f32,
    /// Distance from which on the camera sees, m: nearer columns that were never seen count for
    /// nothing. What the map holds there is in the way all the same.
    pub near_m: f32,
    /// Distance up to which a direction is looked along, m; at most 655 m in messages.
    pub far_m: f32,
    /// Height above the vehicle that must be free, m.
    pub up_m: f32,
    /// Height below the vehicle that must be free, m.
    pub down_m: f32,
    /// Frames after which a look at a free cell is too old.
    pub stale_frames: u32,
}

/// State of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Direction {
    /// Unseen, seen too long ago, or seen from a pose that is a guess, before any obstacle; or not
    /// free for sure, with no obstacle behind it.
    #[default]
    Unknown,
    /// Free as far as was asked.
    Free,
    /// An obstacle, with everything before it seen.
    Obstacle {
        /// Distance up to which all is free, m: to the nearest edge that the obstacle's cell may
        /// have, or that of a cell before it in which depth's error could have put it.
        distance_m: f32,
    },
}

/// All directions, clockwise from straight ahead; direction `i` is [`SECTOR_DEG`] wide, and `i`
/// times that is its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sectors {
    directions: [Direction; SECTORS],
    age_frames: [u32; SECTORS],
    points_m: [Option<[f32; 3]>; SECTORS],
    band: Band,
}

/// The nearest of each kind in one direction.
#[derive(Clone, Copy)]
struct Nearest {
    occupied: f64,
    in_doubt: f64,
    unknown: f64,
    cell: [i32; 3],
}

impl Sectors {
    /// The directions, clockwise from straight ahead.
    pub fn directions(&self) -> &[Direction; SECTORS] {
        &self.directions
    }

    /// Frames since the oldest look that a direction rests on, of the free cells before its
    /// obstacle, or of all. 0 where it is unknown.
    pub fn age_frames(&self) -> &[u32; SECTORS] {
        &self.age_frames
    }

    /// The space that was looked at.
    pub fn band(&self) -> &Band {
        &self.band
    }

    /// Returns the directions with the nearer of two obstacles in each: what is there now, and what
    /// will be there `later`, by maps for a time ahead ([`Mapper::update_planning_maps`]). A
    /// direction that is unknown now stays unknown.
    ///
    /// [`Mapper::update_planning_maps`]: dynvox_core::Mapper::update_planning_maps
    pub fn or_nearer(mut self, later: &Self) -> Self {
        let now = self.directions.iter_mut().zip(&mut self.points_m);
        for ((direction, point), (then, to)) in
            now.zip(later.directions.iter().zip(&later.points_m))
        {
            // What is unknown stops a vehicle anyhow, and nothing that is told of later frees it.
            let is_nearer = match (*direction, *then) {
                (Direction::Free, Direction::Obstacle { .. }) => true,
                (Direction::Obstacle { distance_m: now_m }, Direction::Obstacle { distance_m }) => {
                    distance_m < now_m
                }
                _ => false,
            };
            if is_nearer {
                (*direction, *point) = (*then, *to);
            }
        }
        self
    }

    /// Number of directions in which nothing is known.
    pub fn unknown(&self) -> usize {
        self.directions.iter().filter(|direction| **direction == Direction::Unknown).count()
    }
}

/// Looks around a vehicle. Time: linear in the cells within reach.
pub fn sectors(planning: &Planning<'_>, vehicle: &Vehicle, band: &Band) -> Sectors {
    let mut found = Sectors {
        directions: [Direction::Unknown; SECTORS],
        age_frames: [0; SECTORS],
        points_m: [None; SECTORS],
        band: *band,
    };
    let Some(here) = vehicle.on_grid(planning) else { return found };
    let levels = Levels::new(&here, band);
    let far = f64::INFINITY;
    let none = Nearest { occupied: far, in_doubt: far, unknown: far, cell: [0; 3] };
    let mut nearest = [none; SECTORS];
    each_column(&here, band, |column, [x, y]| {
        match state(planning, [x, y], levels, band.stale_frames) {
            ColumnState::Free { .. } => {}
            ColumnState::Occupied { z } => column.visit(&mut nearest, |one| {
                if column.distance_m < one.occupied {
                    (one.occupied, one.cell) = (column.distance_m, [x, y, z]);
                }
            }),
            ColumnState::InDoubt | ColumnState::Unknown if !column.is_seen => {}
            ColumnState::InDoubt => {
                column.visit(&mut nearest, |one| lower(&mut one.in_doubt, column.distance_m))
            }
            ColumnState::Unknown => {
                column.visit(&mut nearest, |one| lower(&mut one.unknown, column.distance_m))
            }
        }
    });
    for ((direction, point), one) in
        found.directions.iter_mut().zip(&mut found.points_m).zip(&mut nearest)
    {
        *direction = if one.occupied.is_finite() && one.occupied <= one.unknown {
            let center = one.cell.map(|c| f64::from(c) + 0.5);
            *point = Some(vehicle.in_body(planning.grid().to_world(center)).map(|c| c as f32));
            // Cells in doubt lie before every far surface: the vehicle keeps clear of them as well.
            lower(&mut one.occupied, one.in_doubt);
            Direction::Obstacle { distance_m: one.occupied as f32 }
        } else if one.unknown.is_finite() || one.in_doubt.is_finite() {
            Direction::Unknown
        } else {
            Direction::Free
        };
    }
    // What a direction rests on are the free cells before its end.
    each_column(&here, band, |column, at| {
        if let ColumnState::Free { age } = state(planning, at, levels, band.stale_frames) {
            let ends = found.directions;
            column.visit_with(&mut found.age_frames, |oldest, sector| {
                let counts = match ends.get(sector) {
                    Some(Direction::Obstacle { distance_m }) => {
                        column.distance_m <= f64::from(*distance_m)
                    }
                    Some(Direction::Free) => true,
                    _ => false,
                };
                if counts && age > *oldest {
                    *oldest = age;
                }
            });
        }
    });
    found
}

/// Lowers a distance to another one that is less.
fn lower(least_m: &mut f64, distance_m: f64) {
    if distance_m < *least_m {
        *least_m = distance_m;
    }
}

/// The nearest obstacles as points in the vehicle's axes (x ahead, y right, z down, m), one for
/// each direction that ends at one.
pub fn points(sectors: &Sectors) -> impl Iterator<Item = [f32; 3]> + '_ {
    sectors.points_m.iter().filter_map(|point| *point)
}

/// A column as the vehicle sees it.
struct SeenColumn {
    /// Distance of the circle around the column, m.
    distance_m: f64,
    /// The camera sees so near.
    is_seen: bool,
    /// Angle of its centre from straight ahead, clockwise, in sectors.
    angle: f64,
    /// Half the angle that the circle covers, in sectors.
    half: f64,
}

impl SeenColumn {
    /// Visits the entries of all sectors that the column may lie in.
    fn visit<T>(&self, entries: &mut [T; SECTORS], mut with: impl FnMut(&mut T)) {
        self.visit_with(entries, |entry, _| with(entry));
    }

    fn visit_with<T>(&self, entries: &mut [T; SECTORS], mut with: impl FnMut(&mut T, usize)) {
        // Sector i covers the angles from i - 1/2 to i + 1/2.
        let first = libm::floor(self.angle - self.half + 0.5) as i32;
        let last = libm::floor(self.angle + self.half + 0.5) as i32;
        let count = (last - first).clamp(0, SECTORS as i32 - 1);
        for at in first..=first + count {
            let sector = at.rem_euclid(SECTORS as i32) as usize;
            if let Some(entry) = entries.get_mut(sector) {
                with(entry, sector);
            }
        }
    }
}

/// Visits every column within the band, those outside the window among them.
fn each_column(here: &OnGrid, band: &Band, mut with: impl FnMut(&SeenColumn, [i32; 2])) {
    let cell_m = here.cell_m;
    let [cx, cy, _] = here.center;
    let [hx, hy] = here.heading;
    let reach = libm::ceil(f64::from(band.far_m) / cell_m) + 1.0;
    let reach = if reach < f64::from(REACH_MAX_CELLS) { reach as i32 } else { REACH_MAX_CELLS };
    let (x0, y0) = (libm::floor(cx) as i32, libm::floor(cy) as i32);
    // The circle around a cell: nothing of the cell is nearer.
    let radius_m = 0.5 * core::f64::consts::SQRT_2 * cell_m;
    for y in y0 - reach..=y0 + reach {
        for x in x0 - reach..=x0 + reach {
            let dx = (f64::from(x) + 0.5 - cx) * cell_m;
            let dy = (f64::from(y) + 0.5 - cy) * cell_m;
            let center_m = libm::hypot(dx, dy);
            let distance_m = center_m - radius_m;
            if center_m + radius_m < f64::from(band.body_m) || distance_m > f64::from(band.far_m) {
                continue;
            }
            // Clockwise from the heading: to the right is positive.
            let (right, ahead) = (dx * hy - dy * hx, dx * hx + dy * hy);
            let angle = libm::atan2(right, ahead);
            let half = if center_m > radius_m {
                libm::asin(radius_m / center_m)
            } else {
                core::f64::consts::PI
            };
            let to_sectors = 180.0 / core::f64::consts::PI / SECTOR_DEG;
            let column = SeenColumn {
                distance_m: if distance_m > 0.0 { distance_m } else { 0.0 },
                is_seen: center_m + radius_m >= f64::from(band.near_m),
                angle: angle * to_sectors,
                half: half * to_sectors,
            };
            with(&column, [x, y]);
        }
    }
}
