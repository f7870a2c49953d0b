//! NMEA 0183, as receivers write it: `GGA` has positions, `GST` their standard deviations, `RMC` or
//! `ZDA` the date. Times are UTC.
//!
//! Sentences of an epoch share a time of day and stand in any order. A sentence that is cut off, or
//! whose checksum is wrong, is passed over, as are those of other kinds.

use super::{Fix, TimedFix};
use crate::formats::{FormatError, parse_date};
use std::collections::BTreeMap;
use std::path::Path;

const NS_PER_S: u64 = 1_000_000_000;
const NS_PER_DAY: u64 = 86_400 * NS_PER_S;
/// Years of a date in two digits begin here.
const CENTURY: u64 = 2_000;

/// Returns true if a text's first line is a sentence.
pub fn is_nmea(text: &str) -> bool {
    text.lines().map(str::trim).find(|line| !line.is_empty()).is_some_and(|line| {
        sentence(line).is_some() || line.starts_with("$GP") || line.starts_with("$GN")
    })
}

/// Reads the fixes by their times.
///
/// # Errors
/// There is no position, or no date.
pub fn read(path: &Path, text: &str) -> Result<Vec<TimedFix>, FormatError> {
    let mut positions: Vec<(u64, [f64; 3])> = Vec::new();
    let mut sigmas: BTreeMap<u64, [f64; 3]> = BTreeMap::new();
    let mut date = None;
    for fields in text.lines().filter_map(|line| sentence(line.trim())) {
        let kind = fields[0].get(2..).unwrap_or_default();
        match kind {
            "GGA" => positions.extend(position(&fields)),
            "GST" => sigmas.extend(deviations(&fields)),
            "RMC" | "ZDA" if date.is_none() => date = date_of(&fields),
            _ => {}
        }
    }
    let refuse =
        |reason: &str, action: &str| Err(FormatError::content(path, reason.to_owned(), action));
    let Some(&(first_ns, _)) = positions.first() else {
        return refuse(
            "it is NMEA without a position (GGA with a fix)",
            "Let the receiver write GGA sentences, or give latitude, longitude and altitude",
        );
    };
    let Some((day_ns, dated_ns)) = date else {
        return refuse(
            "it is NMEA without a date",
            "Let the receiver write RMC or ZDA sentences besides GGA",
        );
    };
    // The sentence with the date may be of the day after, or before, the first position's.
    let mut day_ns = match half_days_apart(first_ns, dated_ns) {
        1 => day_ns.saturating_sub(NS_PER_DAY),
        -1 => day_ns + NS_PER_DAY,
        _ => day_ns,
    };
    let mut before_ns = first_ns;
    let mut fixes: Vec<TimedFix> = Vec::with_capacity(positions.len());
    for (time_ns, geodetic) in positions {
        if half_days_apart(before_ns, time_ns) == 1 {
            day_ns += NS_PER_DAY;
        }
        before_ns = time_ns;
        let fix = Fix { geodetic, angles_rad: None, sigma_m: sigmas.get(&time_ns).copied() };
        let at_ns = day_ns + time_ns;
        let time_s = (at_ns / NS_PER_S) as f64 + (at_ns % NS_PER_S) as f64 / NS_PER_S as f64;
        // Times of two receivers in one file, or of one that was set: those that go on count.
        if fixes.last().is_none_or(|last| time_s > last.time_s) {
            fixes.push(TimedFix { time_s, fix });
        }
    }
    Ok(fixes)
}

/// 1 where a time of day lies more than half a day before an earlier one, so that midnight lies
/// between them; -1 the other way round.
fn half_days_apart(earlier_ns: u64, later_ns: u64) -> i32 {
    if earlier_ns > later_ns + NS_PER_DAY / 2 {
        1
    } else if later_ns > earlier_ns + NS_PER_DAY / 2 {
        -1
    } else {
        0
    }
}

/// The fields of a whole sentence, its kind first, with the sender's two letters.
fn sentence(line: &str) -> Option<Vec<&str>> {
    let line = &line[line.find('$')?..];
    let (body, checksum) = line.strip_prefix('$')?.split_once('*')?;
    let stated = u8::from_str_radix(checksum.get(..2)?, 16).ok()?;
    let found = body.bytes().fold(0, |sum, byte| sum ^ byte);
    let fields: Vec<&str> = body.split(',').collect();
    (found == stated && fields[0].len() == 5 && fields[0].is_ascii()).then_some(fields)
}

/// Time of day, `hhmmss.ss`, ns.
fn time_of_day_ns(text: &str) -> Option<u64> {
    let (clock, fraction) = text.split_once('.').unwrap_or((text, "0"));
    if clock.len() != 6 || !text.is_ascii() || fraction.len() > 9 {
        return None;
    }
    let part = |from: usize| clock.get(from..from + 2)?.parse::<u64>().ok();
    let (hour, minute, second) = (part(0)?, part(2)?, part(4)?);
    // A leap second is the sixty-first.
    if hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    let fraction_ns: u64 = format!("{fraction:0<9}").parse().ok()?;
    Some(((hour * 60 + minute) * 60 + second) * NS_PER_S + fraction_ns)
}

fn number(fields: &[&str], at: usize) -> Option<f64> {
    fields.get(at)?.parse().ok().filter(|value: &f64| value.is_finite())
}

/// Degrees of `dddmm.mmmm` and the letter behind it.
fn degrees(fields: &[&str], at: usize, negative: &str, most: f64) -> Option<f64> {
    let value = number(fields, at).filter(|value| *value >= 0.0)?;
    let whole = (value / 100.0).floor();
    let minutes = value - 100.0 * whole;
    let degrees = whole + minutes / 60.0;
    if minutes >= 60.0 || degrees > most {
        return None;
    }
    Some(if *fields.get(at + 1)? == negative { -degrees } else { degrees })
}

/// Time of day and position of a `GGA` with a fix. Its altitude is above the geoid.
fn position(fields: &[&str]) -> Option<(u64, [f64; 3])> {
    let quality = number(fields, 6)?;
    if quality < 1.0 {
        return None;
    }
    let (latitude, longitude) = (degrees(fields, 2, "S", 90.0)?, degrees(fields, 4, "W", 180.0)?);
    // Some receivers leave the geoid's height out.
    let altitude_m = number(fields, 9)? + number(fields, 11).unwrap_or(0.0);
    Some((time_of_day_ns(fields.get(1)?)?, [latitude, longitude, altitude_m]))
}

/// Time of day and standard deviations of a `GST`: east, north, up, m.
fn deviations(fields: &[&str]) -> Option<(u64, [f64; 3])> {
    let [north, east, up] = [6, 7, 8].map(|at| number(fields, at).filter(|sigma| *sigma > 0.0));
    Some((time_of_day_ns(fields.get(1)?)?, [east?, north?, up?]))
}

/// Begin of the day, ns since 1970, and time of day of a sentence with a date.
fn date_of(fields: &[&str]) -> Option<(u64, u64)> {
    let time_ns = time_of_day_ns(fields.get(1)?)?;
    let (day, month, year) = if fields[0].ends_with("ZDA") {
        let part = |at: usize| fields.get(at)?.parse::<u64>().ok();
        (part(2)?, part(3)?, part(4)?)
    } else {
        let date = fields.get(9).filter(|date| date.len() == 6)?;
        let part = |from: usize| date.get(from..from + 2)?.parse::<u64>().ok();
        (part(0)?, part(2)?, CENTURY + part(4)?)
    };
    Some((parse_date(&format!("{year}-{month}-{day} 0:0:0"))?, time_ns))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sentence with its checksum.
    fn with_sum(body: &str) -> String {
        format!("${body}*{:02X}\r\n", body.bytes().fold(0, |sum, byte| sum ^ byte))
    }

    fn fixes(sentences: &[&str]) -> Result<Vec<TimedFix>, String> {
        let text: String = sentences.iter().map(|body| with_sum(body)).collect();
        read(Path::new("a.nmea"), &text).map_err(|error| error.to_string())
    }

    const GGA: &str = "GPGGA,123519.25,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,";

    #[test]
    fn a_receivers_epoch_is_a_fix_with_its_deviations() {
        // The sentence of the manuals, with its published checksum.
        let manual = "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47";
        assert!(is_nmea(manual) && sentence(manual).is_some());
        let found = fixes(&[
            "GPGST,123519.25,1.2,2.1,1.4,30.0,0.8,0.6,1.9",
            GGA,
            "GPRMC,123519.25,A,4807.038,N,01131.000,E,022.4,084.4,230324,003.1,W",
        ])
        .unwrap();
        let [TimedFix { time_s, fix }] = found.as_slice() else { panic!("{found:?}") };
        // 23 March 2024, 12:35:19.25 UTC.
        assert_eq!(*time_s, 1_711_197_319.25);
        assert!((fix.geodetic[0] - 48.1173).abs() < 1e-9);
        assert!((fix.geodetic[1] - 11.516_666_666_7).abs() < 1e-9);
        assert!((fix.geodetic[2] - 592.3).abs() < 1e-9, "above the ellipsoid");
        assert_eq!(fix.sigma_m, Some([0.6, 0.8, 1.9]), "east, north, up");
    }

    #[test]
    fn south_and_west_are_negative_and_midnight_begins_a_day() {
        let at = |time: &str| format!("GNGGA,{time},3345.6,S,15112.0,W,4,12,0.6,10,M,,M,,");
        let (before, after) = (at("235959.90"), at("000000.10"));
        let found = fixes(&[&before, "GNZDA,235959.90,31,12,2023,00,00", &after]).unwrap();
        assert_eq!(found[0].fix.geodetic, [-33.76, -151.2, 10.0]);
        assert!((found[1].time_s - found[0].time_s - 0.2).abs() < 1e-6);
        // A date that comes only after midnight is that of the second day.
        let late = fixes(&[&before, &after, "GNZDA,000000.10,01,01,2024,00,00"]).unwrap();
        assert_eq!(late, found);
    }

    #[test]
    fn damaged_sentences_and_rows_without_a_fix_are_passed_over() {
        let date = "GPRMC,123519.25,A,,,,,,,230324,,";
        let none = GGA.replace("E,1,08", "E,0,00").replace("123519", "123520");
        let wrong = GGA.replace("4807.038", "4867.038").replace("123519", "123521");
        let text = [with_sum(GGA), with_sum(date), with_sum(&none), with_sum(&wrong)].concat();
        let damaged = with_sum(&GGA.replace("123519", "123522")).replace("4807", "4806");
        let text = format!("{text}{damaged}$GPGGA,12\nnoise\n");
        assert_eq!(read(Path::new("a"), &text).unwrap().len(), 1);
        assert!(fixes(&[GGA]).unwrap_err().contains("without a date. Let the receiver write RMC"));
        assert!(fixes(&[date]).unwrap_err().contains("without a position"));
        // Bytes of any kind are no sentence.
        for text in ["$", "$*", "$*00", "$ü*00", "$GPGGA*zz", "é$GPGGA,é*é"] {
            assert!(sentence(text).is_none() && read(Path::new("a"), text).is_err(), "{text}");
        }
    }
}
