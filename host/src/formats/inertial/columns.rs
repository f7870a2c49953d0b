//! Columns of a table of inertial samples, by the names in its heading.
//!
//! A name has a quantity, an axis and at times a unit: `wx`, `gyro_x [deg/s]`, `acc_x_g`,
//! `w_RS_S_x [rad s^-1]`, `angular_velocity.x`, `Gyroscope x (rad/s)`. Columns of other names are
//! passed over.

use crate::formats::TimeUnit;

/// Names of the rate of turn, without axis.
const TURN: &[&str] = &[
    "w",
    "w_rs_s",
    "omega",
    "om",
    "g",
    "gyr",
    "gyro",
    "gyroscope",
    "rotation",
    "rotation_rate",
    "angular",
    "angular_velocity",
    "angular_rate",
    "angular_vel",
    "ang_vel",
    "turn_rate",
    "rate",
];
/// Names of the specific force, without axis.
const FORCE: &[&str] = &[
    "a",
    "a_rs_s",
    "acc",
    "accel",
    "acceleration",
    "accelerometer",
    "linear",
    "linear_acceleration",
    "linear_accel",
    "lin_acc",
    "specific_force",
    "force",
    "alpha",
];
/// Names of the time.
const TIME: &[&str] = &[
    "t",
    "time",
    "times",
    "timestamp",
    "timestamps",
    "stamp",
    "header_stamp",
    "time_stamp",
    "sensor_time",
    "epoch",
];
/// Names of whole seconds, and of the nanoseconds beyond them.
const PARTS: [&[&str]; 2] = [
    &["sec", "secs", "stamp_sec", "stamp_secs", "header_stamp_sec", "header_stamp_secs"],
    &[
        "nanosec",
        "nsec",
        "nsecs",
        "nanosecs",
        "stamp_nanosec",
        "stamp_nsec",
        "stamp_nsecs",
        "header_stamp_nanosec",
        "header_stamp_nsec",
        "header_stamp_nsecs",
    ],
];
/// Words before a name that say where it comes from.
const ORIGINS: &[&str] = &["field", "imu", "imu0", "msg", "data", "sensor", "raw", "body", "unit"];

/// Units of turn rates, and each in rad/s.
const TURN_UNITS: &[(&[&str], f64)] = &[
    (&["rad", "rads", "rad/s", "rps", "rads-1", "rads^-1", "rad*s^-1", "radps"], 1.0),
    (
        &["deg", "degs", "deg/s", "dps", "°/s", "degs^-1", "degs-1", "degps", "deg/sec"],
        std::f64::consts::PI / 180.0,
    ),
    (&["mrad/s", "mrad"], 1e-3),
    (&["mdps", "mdeg/s"], std::f64::consts::PI / 180_000.0),
];
/// Units of forces, and each in m/s2.
const FORCE_UNITS: &[(&[&str], f64)] = &[
    (&["m/s^2", "m/s2", "m/s²", "ms^-2", "ms-2", "mps2", "m*s^-2", "m/s/s", "ms2"], 1.0),
    (&["g"], STANDARD_GRAVITY),
    (&["mg"], 1e-3 * STANDARD_GRAVITY),
];
/// Standard gravity, m/s2.
const STANDARD_GRAVITY: f64 = 9.806_65;

/// Quantity of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Field {
    Time(Option<TimeUnit>),
    /// Whole seconds, or nanoseconds.
    Part(usize),
    /// Rate of turn about an axis; unit in rad/s.
    Turn(usize, Option<f64>),
    /// Force along an axis; unit in m/s2.
    Force(usize, Option<f64>),
}

/// Position of a value in a row, and what it is multiplied by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Column {
    /// Position from 0.
    pub at: usize,
    /// Unit in rad/s or m/s2.
    pub unit: f64,
}

/// Columns of the time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TimeColumns {
    /// One, in a unit that the heading may say.
    One(usize, Option<TimeUnit>),
    /// Seconds, and nanoseconds beyond them.
    Parts(usize, usize),
}

/// The columns that are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Columns {
    pub time: TimeColumns,
    pub turn: [Column; 3],
    pub force: [Column; 3],
    /// True if the heading says the unit of turn rates.
    pub turn_unit_said: bool,
    /// True if the heading says the unit of forces.
    pub force_unit_said: bool,
}

impl Columns {
    /// EuRoC's order, which tables without a heading have: time, turn rates, forces.
    pub const WITHOUT_HEADING: Self = {
        const fn at(at: usize) -> Column {
            Column { at, unit: 1.0 }
        }
        Self {
            time: TimeColumns::One(0, None),
            turn: [at(1), at(2), at(3)],
            force: [at(4), at(5), at(6)],
            turn_unit_said: false,
            force_unit_said: false,
        }
    };

    /// The columns of a heading's names. The error completes a sentence that begins with the file.
    pub fn named(names: &[&str]) -> Result<Self, String> {
        let fields: Vec<Option<Field>> = names.iter().map(|name| field(name)).collect();
        let find = |what: &str, matches: &dyn Fn(&Field) -> bool| {
            let mut found = (0..).zip(&fields).filter_map(|(at, field)| {
                field.as_ref().filter(|field| matches(field)).map(|field| (at, *field))
            });
            let first = found.next();
            match found.next() {
                Some((second, _)) => {
                    let [first, second] =
                        [first.map_or(0, |(at, _)| at), second].map(|at| names[at]);
                    Err(format!("its columns {first} and {second} are both {what}"))
                }
                None => Ok(first),
            }
        };
        let mut missing = Vec::new();
        let (mut turn, mut force) =
            ([Column { at: 0, unit: 1.0 }; 3], [Column { at: 0, unit: 1.0 }; 3]);
        let (mut turn_said, mut force_said) = (true, true);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let what = format!("the turn rate about {name}");
            match find(&what, &|field| matches!(field, Field::Turn(of, _) if *of == axis))? {
                Some((at, Field::Turn(_, unit))) => {
                    turn[axis] = Column { at, unit: unit.unwrap_or(1.0) };
                    turn_said &= unit.is_some();
                }
                _ => missing.push(format!("w{name}")),
            }
            let what = format!("the acceleration along {name}");
            match find(&what, &|field| matches!(field, Field::Force(of, _) if *of == axis))? {
                Some((at, Field::Force(_, unit))) => {
                    force[axis] = Column { at, unit: unit.unwrap_or(1.0) };
                    force_said &= unit.is_some();
                }
                _ => missing.push(format!("a{name}")),
            }
        }
        let one = time_of(names, &fields)?;
        let parts = [0, 1].map(|part| find("a part of the time", &|f| *f == Field::Part(part)));
        let [seconds, rest] = parts;
        let time = match (one, seconds?, rest?) {
            (Some((at, unit)), _, _) => Some(TimeColumns::One(at, unit)),
            (_, Some((seconds, _)), Some((rest, _))) => Some(TimeColumns::Parts(seconds, rest)),
            (_, Some((seconds, _)), None) => {
                Some(TimeColumns::One(seconds, Some(TimeUnit::Seconds)))
            }
            _ => {
                missing.insert(0, "time".to_owned());
                None
            }
        };
        match time.filter(|_| missing.is_empty()) {
            Some(time) => Ok(Self {
                time,
                turn,
                force,
                turn_unit_said: turn_said,
                force_unit_said: force_said,
            }),
            None => Err(format!(
                "its heading has no column {}; it has {}",
                missing.join(", "),
                names.join(", ")
            )),
        }
    }
}

/// The column of the time. Of several the stamp of a message's header is when it was measured.
fn time_of(
    names: &[&str],
    fields: &[Option<Field>],
) -> Result<Option<(usize, Option<TimeUnit>)>, String> {
    let times: Vec<(usize, Option<TimeUnit>)> = (0..)
        .zip(fields)
        .filter_map(|(at, field)| match field {
            Some(Field::Time(unit)) => Some((at, *unit)),
            _ => None,
        })
        .collect();
    let stamped: Vec<(usize, Option<TimeUnit>)> =
        times.iter().copied().filter(|(at, _)| names[*at].contains("stamp")).collect();
    match (times.as_slice(), stamped.as_slice()) {
        ([], _) => Ok(None),
        ([one], _) | (_, [one]) => Ok(Some(*one)),
        ([(first, _), (second, _), ..], _) => {
            Err(format!("its columns {} and {} are both the time", names[*first], names[*second]))
        }
    }
}

/// Quantity that a name says; `None` of another.
fn field(name: &str) -> Option<Field> {
    let name = name.trim().trim_matches(['"', '\'', '#', '%']).trim().to_lowercase();
    let (body, bracket) = match name.split_once(['[', '(']) {
        Some((body, unit)) => (body.trim(), Some(unit.trim_end_matches([']', ')']))),
        None => (name.as_str(), None),
    };
    let words: Vec<&str> = body
        .split(|c: char| "_.-/: ".contains(c))
        .filter(|word| !word.is_empty())
        .skip_while(|word| ORIGINS.contains(word))
        .collect();
    let unit_of = |rest: &[&str]| match bracket {
        Some(unit) => Some(squeezed(unit)),
        None if rest.is_empty() => None,
        None => Some(rest.join("/")),
    };
    // Time may end in its unit.
    let whole = words.join("_");
    if let Some(part) = PARTS.iter().position(|names| names.contains(&whole.as_str())) {
        return Some(Field::Part(part));
    }
    if TIME.contains(&whole.as_str()) {
        return Some(Field::Time(bracket.and_then(|unit| time_unit(&squeezed(unit)))));
    }
    if let [before @ .., last] = words.as_slice()
        && let Some(unit) = time_unit(last)
        && TIME.contains(&before.join("_").as_str())
    {
        return Some(Field::Time(Some(unit)));
    }
    // The axis is a word of its own, or the last letter of one.
    let at = words.iter().position(|word| axis_of(word).is_some())?;
    let (letters, axis) = axis_of(words[at])?;
    let stem: Vec<&str> =
        words[..at].iter().copied().chain((!letters.is_empty()).then_some(letters)).collect();
    let stem = stem.join("_");
    let unit = unit_of(&words[at + 1..]);
    if TURN.contains(&stem.as_str()) {
        let unit = unit.map(|unit| factor(TURN_UNITS, &unit));
        return Some(Field::Turn(axis, unit.unwrap_or(Some(None))?));
    }
    if FORCE.contains(&stem.as_str()) {
        let unit = unit.map(|unit| factor(FORCE_UNITS, &unit));
        return Some(Field::Force(axis, unit.unwrap_or(Some(None))?));
    }
    None
}

/// Letters before an axis, and the axis: `gyrox` is `gyro` and 0.
fn axis_of(word: &str) -> Option<(&str, usize)> {
    let (letters, axis) = word.split_at_checked(word.len().checked_sub(1)?)?;
    let axis = ["x", "y", "z"].iter().position(|name| *name == axis)?;
    let known = letters.is_empty() || TURN.contains(&letters) || FORCE.contains(&letters);
    known.then_some((letters, axis))
}

/// A unit in the table: `Some(Some(factor))`; `None` of an unknown one, whose column is not read.
fn factor(units: &[(&[&str], f64)], unit: &str) -> Option<Option<f64>> {
    units.iter().find(|(names, _)| names.contains(&unit)).map(|(_, factor)| Some(*factor))
}

fn time_unit(unit: &str) -> Option<TimeUnit> {
    match unit {
        "s" | "sec" | "secs" | "seconds" => Some(TimeUnit::Seconds),
        "ms" | "msec" | "milliseconds" => Some(TimeUnit::Milliseconds),
        "us" | "µs" | "usec" | "microseconds" => Some(TimeUnit::Microseconds),
        "ns" | "nsec" | "nanoseconds" => Some(TimeUnit::Nanoseconds),
        _ => None,
    }
}

/// A unit without blanks.
fn squeezed(unit: &str) -> String {
    unit.chars().filter(|c| !c.is_whitespace()).collect()
}
