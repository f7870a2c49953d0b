//! Collision prevention on an autopilot: the speed that obstacle distances allow.
//!
//! The rule is the one that PX4's guide to collision prevention states: in each direction a vehicle
//! may be as fast as lets it stop `keep_m` before the obstacle, after a delay, with a bounded jerk
//! and deceleration; a direction without data stops it. Within an angle to both sides of the course
//! the vehicle may leave it for one that is better.

use dynvox_onboard::{Direction, SECTOR_DEG, SECTORS};

/// Limits of the vehicle that the rule counts on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Distance kept to obstacles, m (`CP_DIST`).
    pub keep_m: f64,
    /// Age of a distance when it takes effect, and the time that the vehicle is behind a speed it
    /// is told, s (`CP_DELAY`).
    pub delay_s: f64,
    /// Deceleration counted on, m/s² (`MPC_ACC_HOR`).
    pub deceleration_m_s2: f64,
    /// Jerk counted on, m/s³ (`MPC_JERK_AUTO`).
    pub jerk_m_s3: f64,
    /// Angle to both sides of the course by which the vehicle may leave it, degrees
    /// (`CP_GUIDE_ANG`).
    pub guide_deg: f64,
}

/// Speed that directions allow, and the course on which they do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowed {
    /// Course, degrees clockwise from straight ahead.
    pub course_deg: f64,
    /// Fastest speed on it, m/s.
    pub speed_m_s: f64,
    /// The direction that allows no more; `None` at the speed that is wanted.
    pub by: Option<usize>,
}

/// Sectors to each side of the course that must have data.
const COURSE_SECTORS: i32 = 1;

impl Limits {
    /// Fastest speed from which a vehicle stops `keep_m` before an obstacle, m/s.
    ///
    /// It travels `v delay` before it brakes, `v a / (2 j)` while the deceleration builds up, and
    /// `v² / (2 a)` while it brakes.
    pub fn speed_m_s(&self, distance_m: f64) -> f64 {
        let way_m = distance_m - self.keep_m;
        if way_m <= 0.0 {
            return 0.0;
        }
        let a = self.deceleration_m_s2;
        let lag_s = self.delay_s + a / (2.0 * self.jerk_m_s3);
        // v² / (2 a) + v lag = way.
        a * ((lag_s * lag_s + 2.0 * way_m / a).sqrt() - lag_s)
    }

    /// The course about straight ahead on which the vehicle comes ahead fastest, at no more than
    /// `wanted_m_s`; of several the one that turns least.
    pub fn guided(&self, directions: &[Direction; SECTORS], wanted_m_s: f64) -> Allowed {
        let straight = self.along(directions, 0.0, wanted_m_s);
        let turns = (self.guide_deg / SECTOR_DEG) as i32;
        let courses = (1..=turns).flat_map(|turn| [turn, -turn]);
        let ahead_m_s = |one: &Allowed| one.speed_m_s * one.course_deg.to_radians().cos();
        courses.fold(straight, |best, turn| {
            let other = self.along(directions, f64::from(turn) * SECTOR_DEG, wanted_m_s);
            if ahead_m_s(&other) > ahead_m_s(&best) { other } else { best }
        })
    }

    /// Fastest speed on a course, at most `wanted_m_s`.
    fn along(
        &self,
        directions: &[Direction; SECTORS],
        course_deg: f64,
        wanted_m_s: f64,
    ) -> Allowed {
        let ahead = (course_deg / SECTOR_DEG).round() as i32;
        let unknown = (ahead - COURSE_SECTORS..=ahead + COURSE_SECTORS)
            .map(|sector| sector.rem_euclid(SECTORS as i32) as usize)
            .find(|sector| directions[*sector] == Direction::Unknown);
        if unknown.is_some() {
            return Allowed { course_deg, speed_m_s: 0.0, by: unknown };
        }
        let wanted = Allowed { course_deg, speed_m_s: wanted_m_s, by: None };
        directions.iter().enumerate().fold(wanted, |allowed, (sector, direction)| {
            let Direction::Obstacle { distance_m } = direction else { return allowed };
            let towards = (sector as f64 * SECTOR_DEG - course_deg).to_radians().cos();
            // Sideways and behind nothing comes nearer.
            if towards <= 1e-3 {
                return allowed;
            }
            let speed_m_s = self.speed_m_s(f64::from(*distance_m)) / towards;
            if speed_m_s < allowed.speed_m_s {
                Allowed { course_deg, speed_m_s, by: Some(sector) }
            } else {
                allowed
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::vehicle::{FOLLOWS_S, Multirotor};
    use super::*;

    const LIMITS: Limits = Limits {
        keep_m: 2.0,
        delay_s: 0.4,
        deceleration_m_s2: 3.0,
        jerk_m_s3: 10.0,
        guide_deg: 30.0,
    };

    #[test]
    fn a_vehicle_at_the_allowed_speed_stops_where_it_should() {
        for distance_m in [2.5, 4.0, 8.0, 30.0] {
            let mut speed = LIMITS.speed_m_s(distance_m);
            // The delay passes, then the deceleration grows with the jerk.
            let (mut way, mut braking, step) = (speed * LIMITS.delay_s, 0.0f64, 1e-4);
            while speed > 0.0 {
                braking = (braking + LIMITS.jerk_m_s3 * step).min(LIMITS.deceleration_m_s2);
                way += speed * step;
                speed -= braking * step;
            }
            // Slow vehicles stop before the deceleration is built up, which the formula leaves out.
            let left = distance_m - LIMITS.keep_m - way;
            assert!((-0.05..0.35).contains(&left), "{distance_m}: {left}");
        }
        assert_eq!(LIMITS.speed_m_s(2.0), 0.0);
    }

    #[test]
    fn a_vehicle_among_gusts_stops_before_a_wall_that_is_told_late() {
        // Distances are as old as one frame of 10 Hz; some frames tell nothing.
        let limits = Limits {
            keep_m: 1.5,
            delay_s: 0.2 + FOLLOWS_S,
            deceleration_m_s2: 2.5,
            jerk_m_s3: 15.0,
            guide_deg: 0.0,
        };
        for seed in 0..60 {
            let mut vehicle = Multirotor::hovering(0.3, seed);
            let mut told_m_s = 0.0;
            for frame in 0..150 {
                let left_m = 20.0 - vehicle.position_m[1];
                let is_told = (frame * 7 + seed) % 10 > 0;
                let next_m_s = if is_told { limits.speed_m_s(left_m).min(4.0) } else { 0.0 };
                (0..5).for_each(|_| vehicle.fly([0.0, told_m_s], 0.02));
                told_m_s = next_m_s;
                assert!(20.0 - vehicle.position_m[1] > 0.7, "seed {seed}, frame {frame}");
            }
            assert!(20.0 - vehicle.position_m[1] < 2.5, "seed {seed} came near the wall");
        }
    }

    #[test]
    fn unknown_stops_and_what_stands_aside_does_not() {
        let limits = Limits { guide_deg: 0.0, ..LIMITS };
        let mut directions = [Direction::Free; SECTORS];
        let free = Allowed { course_deg: 0.0, speed_m_s: 4.0, by: None };
        assert_eq!(limits.guided(&directions, 4.0), free);
        directions[18] = Direction::Obstacle { distance_m: 0.5 };
        assert_eq!(limits.guided(&directions, 4.0), free);
        directions[12] = Direction::Obstacle { distance_m: 3.0 };
        let limited = limits.guided(&directions, 4.0);
        assert_eq!(limited.by, Some(12));
        assert!((limited.speed_m_s - 2.0 * limits.speed_m_s(3.0)).abs() < 1e-9);
        directions[71] = Direction::Unknown;
        let stopped = Allowed { speed_m_s: 0.0, by: Some(71), ..free };
        assert_eq!(limits.guided(&directions, 4.0), stopped);
        assert!(limits.along(&directions, -30.0, 4.0).speed_m_s > 0.0, "another course");
    }

    #[test]
    fn the_course_turns_from_a_wall_beside_it_and_not_into_what_is_unknown() {
        let mut directions = [Direction::Free; SECTORS];
        // 20 degrees to the left, nearer than is kept: straight ahead the vehicle comes nearer.
        directions[68] = Direction::Obstacle { distance_m: 1.8 };
        let guided = LIMITS.guided(&directions, 4.0);
        assert_eq!(LIMITS.along(&directions, 0.0, 4.0).speed_m_s, 0.0);
        assert_eq!(guided, Allowed { course_deg: 0.0, speed_m_s: 0.0, by: Some(68) });
        // Along a wall that is a little nearer on the left, 75 degrees away and more.
        directions[68] = Direction::Free;
        directions[57] = Direction::Obstacle { distance_m: 1.8 };
        let guided = LIMITS.guided(&directions, 4.0);
        assert_eq!((guided.course_deg, guided.speed_m_s), (15.0, 4.0));
        // To the right nothing is known: the vehicle stays.
        (1..12).for_each(|right| directions[right] = Direction::Unknown);
        let guided = LIMITS.guided(&directions, 4.0);
        assert_eq!((guided.course_deg, guided.speed_m_s), (0.0, 0.0));
    }
}
