//! Samples of an inertial unit in a recording: `sensor_msgs/Imu`.
//!
//! Cameras with two sensors publish turn rates and accelerations on topics of their own, each with
//! zeros for what it does not measure: accelerations are then taken at the times of the turn rates,
//! between the two that are next to each.

use super::recording::Recording;
use crate::formats::bounds::{MAX_INERTIAL_SAMPLES, thousands};
use crate::formats::{InertialTable, TimedReading};
use crate::input::source::{InputError, OwnUnit, UnitSamples};

/// Message type of samples.
const KIND: &str = "sensor_msgs/Imu";
/// Topics of inertial samples that are read at most.
const MAX_TOPICS: usize = 8;
/// Longest time between two accelerations that one is taken between, ns.
const BETWEEN_NS: i64 = 100_000_000;
/// Name of the format in messages.
const FORMAT: &str = "sensor_msgs/Imu";

/// Samples of one topic.
struct TopicSamples {
    name: String,
    readings: Vec<TimedReading>,
}

impl TopicSamples {
    fn has(&self, quantity: impl Fn(&TimedReading) -> [f64; 3]) -> bool {
        self.readings.iter().any(|reading| quantity(reading) != [0.0; 3])
    }

    fn has_turn(&self) -> bool {
        self.has(|reading| reading.turn_rate)
    }

    fn has_force(&self) -> bool {
        self.has(|reading| reading.force)
    }
}

/// The unit of a recording, next to the camera of a topic where there are several; `None` without
/// messages of one.
///
/// # Errors
/// A file is damaged, or has too many samples.
pub fn unit(recording: &Recording, left: &str) -> Result<Option<OwnUnit>, InputError> {
    let names: Vec<String> = recording
        .topics()
        .iter()
        .filter(|topic| topic.kind == KIND)
        .map(|topic| topic.name.clone())
        .take(MAX_TOPICS)
        .collect();
    let mut topics = Vec::new();
    for name in names {
        let readings = recording.inertial(&name)?;
        if readings.len() > MAX_INERTIAL_SAMPLES {
            let most = thousands(MAX_INERTIAL_SAMPLES);
            let reason = format!(
                "{name} has more than the {most} samples that are read. Split the recording, or \
                 give --inertial none"
            );
            return Err(InputError::bag(recording.path(), reason));
        }
        topics.push(TopicSamples { name, readings });
    }
    let Some((name, readings)) = chosen(&topics, left) else { return Ok(None) };
    let mut notes = Vec::new();
    if topics.len() > 1 {
        notes.push(format!("inertial samples of {name}"));
    }
    let table = InertialTable::from_readings(recording.path(), FORMAT, readings, notes);
    let samples = match table {
        Ok(table) => UnitSamples::Read(table),
        Err(error) => UnitSamples::Refused(error.to_string()),
    };
    Ok(Some(OwnUnit { samples, calibration: Vec::new() }))
}

/// The samples of the topic that has both quantities, else of two that have one each.
fn chosen(topics: &[TopicSamples], left: &str) -> Option<(String, Vec<TimedReading>)> {
    let space = |name: &str| name.trim_start_matches('/').split('/').next().map(str::to_owned);
    let is_near = |topic: &&TopicSamples| space(&topic.name) == space(left);
    let of = |has: &dyn Fn(&TopicSamples) -> bool| {
        let mut found = topics.iter().filter(|topic| has(topic));
        let near = topics.iter().filter(|topic| has(topic)).find(is_near);
        near.or_else(|| found.next())
    };
    if let Some(both) = of(&|topic| topic.has_turn() && topic.has_force()) {
        return Some((both.name.clone(), both.readings.clone()));
    }
    let (turn, force) = (of(&TopicSamples::has_turn)?, of(&TopicSamples::has_force)?);
    Some((format!("{} and {}", turn.name, force.name), merged(&turn.readings, &force.readings)))
}

/// Turn rates with the accelerations at their times.
fn merged(turn: &[TimedReading], force: &[TimedReading]) -> Vec<TimedReading> {
    let mut force = force.to_vec();
    force.sort_by_key(|reading| reading.time_ns);
    let at = |reading: &TimedReading| {
        let after = force.partition_point(|other| other.time_ns < reading.time_ns);
        let [a, b] = [force.get(after.checked_sub(1)?)?, force.get(after)?];
        let apart = b.time_ns - a.time_ns;
        if apart > BETWEEN_NS {
            return None;
        }
        let share = (reading.time_ns - a.time_ns) as f64 / apart.max(1) as f64;
        let between = |axis: usize| a.force[axis] + share * (b.force[axis] - a.force[axis]);
        Some(TimedReading { force: [between(0), between(1), between(2)], ..*reading })
    };
    turn.iter().filter_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(name: &str, step_ns: i64, turn: f64, force: f64) -> TopicSamples {
        let reading = |at: i64| TimedReading {
            time_ns: at * step_ns,
            turn_rate: [turn * at as f64, 0.0, 0.0],
            force: [0.0, force * at as f64, force],
        };
        TopicSamples { name: name.to_owned(), readings: (0..40).map(reading).collect() }
    }

    #[test]
    fn two_topics_of_one_sensor_each_become_one_unit() {
        let topics = [
            topic("/camera/accel/sample", 10_000_000, 0.0, 9.8),
            topic("/camera/gyro/sample", 4_000_000, 0.1, 0.0),
        ];
        let (name, readings) = chosen(&topics, "/camera/infra1/image_rect_raw").unwrap();
        assert_eq!(name, "/camera/gyro/sample and /camera/accel/sample");
        // The first has no acceleration before it.
        assert_eq!(readings.len(), 39);
        let third = readings[2];
        assert_eq!((third.time_ns, third.turn_rate[0]), (12_000_000, 0.1 * 3.0));
        // 12 ms lie a fifth of the way from 10 to 20 ms.
        assert!((third.force[1] - 9.8 * 1.2).abs() < 1e-9, "{third:?}");
        let alone = &topics[..1];
        assert!(chosen(alone, "/camera/left").is_none(), "half a unit is none");
    }

    #[test]
    fn of_several_units_that_next_to_the_camera_is_taken() {
        let topics =
            [topic("/car/imu", 5_000_000, 0.1, 9.8), topic("/rig/imu", 5_000_000, 0.2, 9.8)];
        assert_eq!(chosen(&topics, "/rig/left/image_raw").unwrap().0, "/rig/imu");
        assert_eq!(chosen(&topics, "/left/image_raw").unwrap().0, "/car/imu");
        // Accelerations 200 ms apart say nothing about the time between.
        let sparse = [topic("/a", 200_000_000, 0.0, 9.8), topic("/g", 4_000_000, 0.1, 0.0)];
        assert!(chosen(&sparse, "/left").unwrap().1.is_empty());
    }
}
