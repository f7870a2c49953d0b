//! Times of images: those of their headers, or where headers tell none those of recording.

use super::recording::Entry;
use crate::input::source::InputError;
use std::path::Path;

/// Images of both topics in the order of their times, each time once.
pub struct TimedImages {
    /// Left and right images.
    pub sides: [Vec<Entry>; 2],
    /// Sentences about times that were not as they should be.
    pub notes: Vec<String>,
}

/// Orders the images of two topics.
///
/// # Errors
/// The times of headers and of recording repeat.
pub fn timed(
    mut sides: [Vec<Entry>; 2],
    topics: &[String; 2],
    path: &Path,
) -> Result<TimedImages, InputError> {
    let mut notes = Vec::new();
    // One clock for both cameras: a header's time and that of recording are not comparable.
    let silent =
        sides.iter().zip(topics).find(|(entries, _)| !distinguishes(entries, |one| one.header_ns));
    if let Some((entries, topic)) = silent {
        let what = if entries.iter().all(|entry| entry.header_ns == 0) {
            "are zero".to_owned()
        } else {
            format!("repeat: {} in {} images", times(entries, |one| one.header_ns), entries.len())
        };
        let recorded = sides.iter().all(|entries| distinguishes(entries, |one| one.log_ns));
        if !recorded {
            let reason = format!(
                "the times in the headers of {topic} {what}, and those of recording, too. Give \
                 the images as a folder with times.txt"
            );
            return Err(InputError::bag(path, reason));
        }
        notes.push(format!(
            "the times in the headers of {topic} {what}: times of recording are taken, which are \
             less even"
        ));
        sides.iter_mut().flatten().for_each(|entry| entry.time_ns = entry.log_ns);
    }
    let counts = sides.each_ref().map(Vec::len);
    for entries in &mut sides {
        // A simulator's clock begins at zero: the first image may bear it, none that come later.
        let first_ns = entries.iter().map(|entry| entry.log_ns).min();
        entries.retain(|entry| entry.time_ns != 0 || Some(entry.log_ns) == first_ns);
    }
    let unset = [0, 1].map(|side| counts[side] - sides[side].len());
    for entries in &mut sides {
        entries.sort_by_key(|entry| entry.time_ns);
        entries.dedup_by_key(|entry| entry.time_ns);
    }
    let equal = [0, 1].map(|side| counts[side] - unset[side] - sides[side].len());
    for ([left, right], what) in [(unset, "bear no time"), (equal, "repeat the time of another")] {
        if left + right > 0 {
            notes.push(format!("{left} left and {right} right images {what}: skipped"));
        }
    }
    Ok(TimedImages { sides, notes })
}

/// Number of times that differ and are not zero.
fn times(entries: &[Entry], time_ns: impl Fn(&Entry) -> u64) -> usize {
    let mut times: Vec<u64> = entries.iter().map(time_ns).filter(|ns| *ns != 0).collect();
    times.sort_unstable();
    times.dedup();
    times.len()
}

/// Returns true if most times differ.
fn distinguishes(entries: &[Entry], time_ns: impl Fn(&Entry) -> u64) -> bool {
    entries.len() < 2 || 2 * times(entries, time_ns) > entries.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(headers_ns: &[u64]) -> Vec<Entry> {
        let entry = |(at, &header_ns): (usize, &u64)| Entry {
            file: 0,
            log_ns: 1_000 + at as u64,
            header_ns,
            time_ns: header_ns,
        };
        headers_ns.iter().enumerate().map(entry).collect()
    }

    fn run(left: &[u64], right: &[u64]) -> Result<(Vec<u64>, Vec<u64>, String), String> {
        let topics = ["/left".to_owned(), "/right".to_owned()];
        let timed = timed([images(left), images(right)], &topics, Path::new("a.mcap"))
            .map_err(|error| error.to_string())?;
        let [left, right] =
            timed.sides.map(|side| side.iter().map(|entry| entry.time_ns).collect());
        Ok((left, right, timed.notes.join(" | ")))
    }

    #[test]
    fn headers_without_times_give_way_to_times_of_recording() {
        for (left, right) in [([0, 0, 0], [0, 0, 0]), ([7, 7, 7], [7, 8, 9]), ([5, 6, 7], [0; 3])] {
            let (left, right, notes) = run(&left, &right).unwrap();
            assert_eq!((left, right), (vec![1_000, 1_001, 1_002], vec![1_000, 1_001, 1_002]));
            assert!(notes.contains("times of recording are taken"), "{notes}");
        }
    }

    #[test]
    fn equal_times_and_missing_ones_are_counted() {
        let (left, right, notes) = run(&[5, 6, 6, 8, 0], &[5, 6, 7, 8, 9]).unwrap();
        assert_eq!((left, right), (vec![5, 6, 8], vec![5, 6, 7, 8, 9]));
        assert_eq!(
            notes,
            "1 left and 0 right images bear no time: skipped | 1 left and 0 right images repeat \
             the time of another: skipped"
        );
        assert_eq!(run(&[5, 6], &[5, 6]).unwrap().2, "");
        // A clock may begin at zero.
        assert_eq!(
            run(&[0, 6, 7], &[0, 6, 7]).unwrap(),
            (vec![0, 6, 7], vec![0, 6, 7], String::new())
        );
        // One pair needs no time.
        assert_eq!(run(&[0], &[0]).unwrap().0, [0]);
    }

    #[test]
    fn a_recording_without_any_time_is_refused() {
        let frozen = |at: u64| Entry { file: 0, log_ns: 9, header_ns: at, time_ns: at };
        let sides = [vec![frozen(0); 4], vec![frozen(0); 4]];
        let topics = ["/left".to_owned(), "/right".to_owned()];
        let error = timed(sides, &topics, Path::new("a.mcap")).err().unwrap().to_string();
        assert!(error.contains("folder with times.txt"), "{error}");
    }
}
