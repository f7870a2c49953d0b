//! One flight: pictures are rendered from where the vehicle is, the mapper sees them, and the
//! autopilot's rule lets the vehicle go as fast as the directions allow.

use super::route::{FlightWorld, Route, RoutePose};
use super::rule::{Allowed, Limits};
use super::vehicle::{FOLLOWS_S, Multirotor};
use super::{BODY_M, IMAGE, RATE_HZ, REACH_M, truth};
use crate::synth::{FlownView, SynthFrame};
use dynvox_core::geometry::StereoRig;
use dynvox_core::image::View;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::{Capacity, Config, Mapper, PoseOrigin, Serial, StereoFrame};
use dynvox_onboard::{Band, Direction, SECTOR_DEG, SECTORS, Vehicle, sectors};
use serde::Serialize;

/// Steps of the vehicle between two pictures.
const SUBSTEPS: u32 = 5;
/// Strength of gusts, m/s², 1 sigma.
const GUSTS_M_S2: f64 = 0.3;
/// Standing longer than this while the way is clear is a needless stop, s.
const NEEDLESS_S: f64 = 1.0;
/// Frames before the vehicle is let go: the mapper sees where it stands.
const READY_FRAMES: u32 = 5;
/// Age of a distance when the next one replaces it, s: a message takes one frame, and lasts one.
const TOLD_S: f64 = 2.0 / RATE_HZ;
/// Limits that the autopilot counts on. The delay is that of a message and of the vehicle, which
/// follows a speed late: PX4's guide asks for both in `CP_DELAY`.
const LIMITS: Limits = Limits {
    keep_m: 1.5,
    delay_s: TOLD_S + FOLLOWS_S,
    deceleration_m_s2: 2.5,
    jerk_m_s3: 15.0,
    guide_deg: 30.0,
};
/// Speed that the rule allows on a way that is clear, m/s.
const CLEAR_M_S: f64 = 1.0;
/// Below this speed the vehicle stands, m/s.
const STANDS_M_S: f64 = 0.3;
/// Way by which a surface came nearer since the last picture if it moves by itself, m.
const COMES_M: f64 = 0.02;

/// Pictures before a collision at which a vehicle might have stopped, and after it for which it
/// would have stood there: a second.
const ANYWAY_FRAMES: usize = 10;

/// Conditions of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// World that is flown through.
    pub world: FlightWorld,
    /// Chooses the world, start, course, gusts and black pictures.
    pub seed: u64,
    /// Speed that the vehicle would like to fly at, m/s.
    pub speed_m_s: f64,
    /// Share of pictures that come black.
    pub black: f64,
    /// Flying time, s.
    pub seconds: f64,
}

/// Outcome of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Flight {
    /// The vehicle flew into something.
    pub collided: bool,
    /// A car drove into the vehicle while it stood, from where its camera does not look, or would
    /// have, had the vehicle stopped a second before.
    pub run_over: bool,
    /// Stops of more than a second where the rule would not stop, had it been told the truth.
    pub needless_stops: u32,
    /// Distance flown, m.
    pub flown_m: f64,
    /// Least distance to a surface, less the vehicle's radius, m.
    pub clearance_m: f64,
    /// Pictures whose pose was extrapolated.
    pub extrapolated: u32,
    /// True if the vehicle stood before an obstacle in the end.
    pub stopped: bool,
}

/// One picture of a flight: where the vehicle was, and what it was told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FlightFrame {
    /// Number of the picture.
    pub frame: u32,
    /// Distance ahead of the start, m.
    pub ahead_m: f64,
    /// Speed when the picture was taken, m/s.
    pub speed_m_s: f64,
    /// Speed that the rule allows until the next picture, m/s.
    pub allowed_m_s: f64,
    /// Direction that allows no more, degrees clockwise from straight ahead, or straight ahead.
    pub by_deg: f64,
    /// Distance told in that direction, m: negative where it is unknown, infinite where it is free.
    pub told_m: f32,
    /// Free way in that direction in truth, m, up to the reach of the band.
    pub free_m: f64,
    /// Least distance to a surface until the next picture, less the vehicle's radius, m.
    pub clearance_m: f64,
    /// The picture came black.
    pub is_black: bool,
    /// The pose was estimated.
    pub is_placed: bool,
}

/// Side of the window's cells, m: four voxels of the street's size.
const CELL_M: f64 = 0.2;
/// Most cells along a side of the window.
const SIDE_CELLS: f64 = 200.0;

/// Way in which a vehicle at a speed stops, and a second more, m.
fn reach_m(speed_m_s: f64) -> f64 {
    let brakes_m = speed_m_s * speed_m_s / (2.0 * LIMITS.deceleration_m_s2);
    LIMITS.keep_m + speed_m_s * LIMITS.delay_s + brakes_m + speed_m_s
}

/// Bounds of a small mapper with a vehicle's window: as far to each side as it looks, 4 m high. The
/// map must hold all that the window shows: a block that leaves a full map takes its obstacle
/// along, and the vehicle flies into it.
fn capacity(speed_m_s: f64) -> Capacity {
    // To both sides, in steps of 40 cells.
    let side = (40.0 * (reach_m(speed_m_s) / (20.0 * CELL_M)).ceil()).min(SIDE_CELLS) as usize;
    Capacity {
        image_width: IMAGE[0] as usize,
        image_height: IMAGE[1] as usize,
        planning_width: side,
        planning_length: side,
        planning_height: 20,
        blocks: 20_000,
        visible_blocks: 8_000,
        ..Capacity::TINY
    }
}

/// Space that the vehicle looks at: as far as it must, and up to a metre from the window's end.
fn band(speed_m_s: f64, capacity: &Capacity) -> Band {
    let half_m = 0.5 * capacity.planning_width as f64 * CELL_M;
    Band {
        body_m: BODY_M as f32,
        near_m: 2.0,
        far_m: reach_m(speed_m_s).min(half_m - 1.0) as f32,
        up_m: BODY_M as f32,
        down_m: BODY_M as f32,
        stale_frames: (3.0 * RATE_HZ) as u32,
    }
}

/// The mapper aboard, with what it told last.
struct Aboard<'s> {
    mapper: Mapper<'s>,
    band: Band,
    directions: [Direction; SECTORS],
}

impl Aboard<'_> {
    /// Maps a frame and looks around; returns true if the pose is no guess.
    ///
    /// # Errors
    /// The pictures have another size than the world's.
    fn map(&mut self, index: u32, pictures: &SynthFrame, is_black: bool) -> anyhow::Result<bool> {
        let [width, height] = IMAGE.map(|side| side as usize);
        let black = vec![0; width * height];
        let grey = |image| View::new(if is_black { &black } else { image }, width, height);
        let (Some(left), Some(right)) = (grey(&pictures.left_grey), grey(&pictures.right_grey))
        else {
            anyhow::bail!("the world gives no pair of {width} x {height} px");
        };
        let time_ns = Some((f64::from(index) / RATE_HZ * 1e9) as u64);
        let frame = StereoFrame { time_ns, ..StereoFrame::pair(left, right) };
        let report = self.mapper.step(&frame, &Serial)?;
        let is_placed = report.pose != PoseOrigin::Extrapolated;
        let body = Vehicle::new(&report.t_world_camera, is_placed);
        // What comes nearer counts where it will be.
        let [now, later] = [0.0, LIMITS.delay_s as f32].map(|ahead_s| {
            self.mapper.update_planning_maps(ahead_s);
            sectors(self.mapper.planning(), &body, &self.band)
        });
        self.directions = *now.or_nearer(&later).directions();
        Ok(is_placed)
    }
}

/// Flies once, and hands out what happened at each picture.
///
/// # Errors
/// A world that cannot be made, or a mapper that cannot be.
pub fn fly(conditions: &Conditions, mut seen: impl FnMut(&FlightFrame)) -> anyhow::Result<Flight> {
    let mut route = Route::draw(conditions.world, conditions.seed)?;
    let capacity = capacity(conditions.speed_m_s);
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    // No network says what moves: its motion does.
    let mut config = Config::for_rig(route.rig());
    config.segmentation.enabled = true;
    let mapper = Mapper::new(&capacity, &config, &mut slab)?;
    let directions = [Direction::Unknown; SECTORS];
    let mut aboard = Aboard { mapper, band: band(conditions.speed_m_s, &capacity), directions };
    let mut vehicle = Multirotor::hovering(GUSTS_M_S2, conditions.seed);
    let mut flight = Flight { clearance_m: f64::INFINITY, ..Flight::default() };
    let (mut stood_s, mut way_m) = (0.0, [vehicle.position_m; ANYWAY_FRAMES]);
    for index in 0..(conditions.seconds * RATE_HZ) as u32 {
        let pose = route.pose(&vehicle, f64::from(index) / RATE_HZ);
        let is_black = index > READY_FRAMES && route.chance(conditions.black);
        let view = route.view(index, &pose);
        // The vehicle goes by what was told of the frame before: a message takes its time.
        let is_ready = index >= READY_FRAMES;
        let wanted = if is_ready { conditions.speed_m_s } else { 0.0 };
        let allowed = LIMITS.guided(&aboard.directions, wanted);
        let by = allowed.by.unwrap_or(0);
        let told_m = distance_m(aboard.directions[by]);
        let far_m = f64::from(aboard.band.far_m);
        let speed_m_s = vehicle.speed_m_s();
        let is_placed = aboard.map(index, &view.frame(), is_black)?;
        flight.extrapolated += u32::from(!is_placed);
        let from = vehicle.position_m;
        let ahead_m = from[1];
        way_m.rotate_left(1);
        way_m[ANYWAY_FRAMES - 1] = from;
        let clearance_m = flight.advance(&mut vehicle, &view, &allowed);
        seen(&FlightFrame {
            frame: index,
            ahead_m,
            speed_m_s,
            allowed_m_s: allowed.speed_m_s,
            by_deg: (by as f64 * SECTOR_DEG + 180.0) % 360.0 - 180.0,
            told_m,
            free_m: truth::distance_m(&view, by, far_m),
            clearance_m,
            is_black,
            is_placed,
        });
        if flight.clearance_m < 0.0 {
            let before = route.view(index.saturating_sub(1), &pose);
            let at = [0, 1].map(|axis| vehicle.position_m[axis] - from[axis]);
            let was_m = [0, 1].map(|axis| way_m[0][axis] - from[axis]);
            flight.run_over = vehicle.speed_m_s() < STANDS_M_S
                || is_met_unseen([&before, &view], at, &route.rig())
                || is_met_anyway(&route, index, &pose, was_m);
            flight.collided = !flight.run_over;
            break;
        }
        let stands = is_ready && vehicle.speed_m_s() < STANDS_M_S;
        // Told the truth of this picture, the rule would let the vehicle go.
        let is_needless = stands && {
            let truth = truth::directions(&view, far_m);
            LIMITS.guided(&truth, wanted).speed_m_s >= CLEAR_M_S
        };
        stood_s = if is_needless { stood_s + 1.0 / RATE_HZ } else { 0.0 };
        flight.needless_stops += u32::from((stood_s - NEEDLESS_S).abs() < 0.5 / RATE_HZ);
        flight.stopped = stands && !is_needless;
    }
    Ok(flight)
}

impl Flight {
    /// Flies until the next picture, notes how near anything came and returns it, m.
    fn advance(
        &mut self,
        vehicle: &mut Multirotor,
        view: &FlownView<'_>,
        allowed: &Allowed,
    ) -> f64 {
        let from = vehicle.position_m;
        let (right, ahead) = allowed.course_deg.to_radians().sin_cos();
        let wanted_m_s = [right, ahead].map(|part| part * allowed.speed_m_s);
        let mut least_m = f64::INFINITY;
        for _ in 0..SUBSTEPS {
            vehicle.fly(wanted_m_s, 1.0 / (RATE_HZ * f64::from(SUBSTEPS)));
            let [right, ahead] = [0, 1].map(|axis| vehicle.position_m[axis] - from[axis]);
            let clearance_m = view.clearance_m([right, 0.0, ahead], REACH_M) - BODY_M;
            least_m = least_m.min(clearance_m);
        }
        self.clearance_m = self.clearance_m.min(least_m);
        self.flown_m += (vehicle.position_m[0] - from[0]).hypot(vehicle.position_m[1] - from[1]);
        least_m
    }
}

/// Distance to what is told in a direction, m: negative where it is unknown, infinite where it is
/// free.
fn distance_m(direction: Direction) -> f32 {
    match direction {
        Direction::Unknown => -1.0,
        Direction::Free => f32::INFINITY,
        Direction::Obstacle { distance_m } => distance_m,
    }
}

/// Tells that what is nearest to a place, right and ahead of the camera, lies outside of the
/// camera's view, and came there by itself since the picture before. Both views are from one pose.
fn is_met_unseen(
    [before, now]: [&FlownView<'_>; 2],
    [right, ahead]: [f64; 2],
    rig: &StereoRig,
) -> bool {
    let to_nearest = |axis: usize| {
        let side = |step: f64| {
            let mut at = [right, 0.0, ahead];
            at[axis] += step;
            now.clearance_m(at, REACH_M)
        };
        side(-0.02) - side(0.02)
    };
    let bearing_rad = libm::atan2(to_nearest(0).abs(), to_nearest(2));
    let is_seen = bearing_rad < libm::atan2(rig.center_u_px, rig.focal_px);
    let [was_m, is_m] = [before, now].map(|view| view.clearance_m([right, 0.0, ahead], REACH_M));
    !is_seen && was_m - is_m > COMES_M
}

/// Tells that something comes to a place, right and ahead of the camera, within a second before and
/// after a picture.
fn is_met_anyway(route: &Route, index: u32, pose: &RoutePose, [right, ahead]: [f64; 2]) -> bool {
    let frames = ANYWAY_FRAMES as u32;
    (index.saturating_sub(frames)..=index + frames)
        .any(|index| route.view(index, pose).clearance_m([right, 0.0, ahead], REACH_M) < BODY_M)
}

#[cfg(test)]
mod tests {
    use super::super::route::HEIGHT_M;
    use super::*;
    use crate::synth::{Street, StreetConfig};

    const CONDITIONS: Conditions = Conditions {
        world: FlightWorld::Street,
        seed: 0,
        speed_m_s: 4.0,
        black: 0.0,
        seconds: 2.5,
    };

    #[test]
    fn a_vehicle_flies_down_the_street_and_touches_nothing() {
        let flight = fly(&CONDITIONS, |_| {}).unwrap();
        assert!(!flight.collided && !flight.run_over && flight.clearance_m > 0.3, "{flight:?}");
        // Let go after half a second, at 4 m/s.
        assert!((2.0..8.5).contains(&flight.flown_m), "{flight:?}");
        assert_eq!(fly(&CONDITIONS, |_| {}).unwrap(), flight, "one seed, one flight");
    }

    #[test]
    fn a_vehicle_flies_across_a_yard_and_touches_no_one() {
        let world = FlightWorld::Yard;
        let conditions = Conditions { world, speed_m_s: 2.0, seconds: 3.0, ..CONDITIONS };
        let flight = fly(&conditions, |_| {}).unwrap();
        assert!(!flight.collided && !flight.run_over && flight.clearance_m > 0.3, "{flight:?}");
        assert!(flight.flown_m > 1.0, "{flight:?}");
    }

    #[dynvox_needs::long]
    #[test]
    fn a_car_that_crosses_runs_a_vehicle_over() {
        let conditions = Conditions { seed: 14, seconds: 12.0, ..CONDITIONS };
        let flight = fly(&conditions, |_| {}).unwrap();
        assert!(flight.run_over && !flight.collided, "{flight:?}");
    }

    #[test]
    fn a_wall_beside_the_camera_did_not_come_by_itself() {
        let street = Street::new(StreetConfig::static_street()).unwrap();
        // Towards the houses on the right, seen from beside the road.
        let pose = street.pose_above_road(30.0, 3.0, HEIGHT_M, 0.0);
        let view = street.seen_from(0, &pose);
        let at = (0..400).map(|step| [0.05 * f64::from(step), 0.0]);
        let touching = at.filter(|[right, _]| view.clearance_m([*right, 0.0, 0.0], 5.0) < 0.3);
        let mut count = 0;
        for at in touching {
            count += 1;
            assert!(!is_met_unseen([&view, &view], at, &street.rig()), "{at:?}");
        }
        assert!(count > 0, "something stands beside the road");
    }

    #[dynvox_needs::long]
    #[test]
    fn a_vehicle_whose_pictures_are_black_does_not_fly_on() {
        let conditions = Conditions { black: 1.0, ..CONDITIONS };
        let flight = fly(&conditions, |_| {}).unwrap();
        assert!(flight.flown_m < 1.0 && flight.extrapolated > 15, "{flight:?}");
    }
}
