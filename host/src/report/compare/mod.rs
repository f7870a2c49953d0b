//! Two runs compared: the first frame and stage in which they diverge.

mod distance;

pub use distance::{Distance, Outcome};

use crate::formats::bounds::SETTINGS_TEXT;
use crate::formats::{
    FRAMES_FILE, FormatError, SETTINGS_FILE, SUMMARY_FILE, TRAJECTORY_FILE, read_poses,
    read_text_within, rows_of_file,
};
use crate::observe::tables::{FrameDigests, read_frame_digests};
use crate::run::settings::{Setting, differing, settings};
use dynvox_core::StageDigests;
use dynvox_core::{Digested, ObjectDigest, ObjectDigests};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A run folder that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// It is not a run folder.
    #[error(
        "{path} is not a run folder: its {file} cannot be read ({source}). Give a folder that \
         `dynvox run` wrote"
    )]
    NoRun {
        /// Path as given.
        path: PathBuf,
        /// The file that is missing.
        file: &'static str,
        /// The system's error.
        source: std::io::Error,
    },
    /// A column is missing: an older build wrote it.
    #[error("{path} has no column {column}: an older dynvox wrote it. Run again")]
    Column {
        /// The table.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// A file is damaged.
    #[error("{path}: {reason}. Run again")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// The runs have no frame in common.
    #[error(
        "the runs share no frame: one has frames {a}, the other {b}. Compare runs with the same \
         --start and --stride"
    )]
    NothingShared {
        /// Frames of the first.
        a: String,
        /// Frames of the second.
        b: String,
    },
}

/// Values of a frame that are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Digest of all stages.
    pub digest: u64,
    /// Digest of each stage.
    pub stages: StageDigests,
    /// The outcome that they are of.
    pub outcome: Outcome,
}

/// A run, as far as it can be compared.
#[derive(Clone, Debug, PartialEq)]
pub struct RunDigests {
    /// The frames, by number.
    pub rows: BTreeMap<usize, Row>,
    /// The settings by dotted key, and data set and profile of the summary.
    pub settings: BTreeMap<String, String>,
}

/// The first difference of two runs, and how far they are apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// The first frame that differs.
    pub frame: usize,
    /// The first stage that differs in it; `None` where only the digest of all does.
    pub stage: Option<Digested>,
    /// Distance between the outcomes in that frame.
    pub there: Distance,
    /// Largest distance between the outcomes in any frame.
    pub most: Distance,
}

/// Two runs compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Settings that differ.
    pub settings: Vec<Setting>,
    /// First frame and stage in which the runs diverge; `None` if they agree in every frame they
    /// share.
    pub divergence: Option<Divergence>,
    /// Frames they share.
    pub shared: usize,
    /// First and last frame, and how many there are, of either.
    pub frames: [[usize; 3]; 2],
}

impl Comparison {
    /// Returns true if the same frames gave the same bits.
    pub fn equal(&self) -> bool {
        self.divergence.is_none() && self.frames.iter().all(|&[_, _, count]| count == self.shared)
    }

    /// Returns the run, 0 or 1, that is a prefix of the other, if one is.
    pub fn prefix(&self) -> Option<usize> {
        let [a, b] = self.frames;
        // All of its frames are shared, the other has more, and both begin together.
        let begins = |short: [usize; 3], long: [usize; 3]| {
            short[2] == self.shared
                && long[2] > self.shared
                && short[0] == long[0]
                && short[1] < long[1]
        };
        // Neither may be: then they only overlap.
        let which = if begins(a, b) { Some(0) } else { begins(b, a).then_some(1) };
        // Runs that diverge are no prefix of each other.
        which.filter(|_| self.divergence.is_none())
    }
}

impl RunDigests {
    /// Reads a run folder.
    ///
    /// # Errors
    /// It is not a run folder, is damaged, or an older build wrote it.
    pub fn read(folder: &Path) -> Result<Self, CompareError> {
        let no_run = |file: &'static str| {
            let path = folder.to_path_buf();
            move |error: FormatError| CompareError::NoRun { path, file, source: error.into() }
        };
        let text = |file: &'static str| {
            read_text_within(&folder.join(file), &SETTINGS_TEXT).map_err(no_run(file))
        };
        let frames = rows_of_file(&folder.join(FRAMES_FILE)).map_err(no_run(FRAMES_FILE))?;
        let (config, summary) = (text(SETTINGS_FILE)?, text(SUMMARY_FILE)?);
        let damaged =
            |file: &str, reason: String| CompareError::Damaged { path: folder.join(file), reason };
        let mut settings = settings(&config)
            .map_err(|error| damaged(SETTINGS_FILE, error.message().to_owned()))?;
        let summary: serde_json::Value = serde_json::from_str(&summary)
            .map_err(|error| damaged(SUMMARY_FILE, error.to_string()))?;
        // What a run was made from counts as a setting: runs of two data sets differ in it.
        for key in ["dataset", "profile"] {
            if let Some(value) = summary.get(key).and_then(serde_json::Value::as_str) {
                settings.insert(format!("({key})"), value.to_owned());
            }
        }
        let mut rows = read_rows(frames, &folder.join(FRAMES_FILE))?;
        let poses = read_poses(&folder.join(TRAJECTORY_FILE))
            .map(|trajectory| trajectory.poses)
            .unwrap_or_default();
        // A trajectory of another length does not belong to the table.
        if poses.len() == rows.len() {
            rows.values_mut().zip(poses).for_each(|(row, pose)| row.outcome.pose = Some(pose));
        }
        Ok(Self { rows, settings })
    }

    fn frames(&self) -> [usize; 3] {
        // A run without frames has neither a first nor a last one.
        let ends = self
            .rows
            .keys()
            .next()
            .zip(self.rows.keys().next_back())
            .map_or([0, 0], |(first, last)| [*first, *last]);
        [ends[0], ends[1], self.rows.len()]
    }
}

/// Compares two runs in the frames they share.
///
/// # Errors
/// The runs share no frame.
pub fn compare(a: &RunDigests, b: &RunDigests) -> Result<Comparison, CompareError> {
    // Frames by number: one run may have begun later or ended earlier.
    let shared =
        || a.rows.iter().filter_map(|(frame, row)| Some((*frame, row, b.rows.get(frame)?)));
    // The first frame that differs: what follows differs because of it.
    let divergence =
        shared().find(|(_, one, other)| (one.digest, one.stages) != (other.digest, other.stages));
    let most = || {
        shared()
            .map(|(_, one, other)| Distance::between(&one.outcome, &other.outcome))
            .fold(Distance::default(), Distance::max)
    };
    let comparison = Comparison {
        settings: differing(&a.settings, &b.settings),
        divergence: divergence.map(|(frame, one, other)| Divergence {
            frame,
            stage: one.stages.first_difference(&other.stages),
            there: Distance::between(&one.outcome, &other.outcome),
            most: most(),
        }),
        shared: shared().count(),
        frames: [a.frames(), b.frames()],
    };
    // Runs without a common frame say nothing about each other.
    if comparison.shared == 0 {
        let range = |[first, last, count]: [usize; 3]| {
            if count == 0 { "none".to_owned() } else { format!("{first} to {last}") }
        };
        return Err(CompareError::NothingShared { a: range(a.frames()), b: range(b.frames()) });
    }
    Ok(comparison)
}

/// The rows of `frames.csv`, by frame.
fn read_rows(table: impl Read, path: &Path) -> Result<BTreeMap<usize, Row>, CompareError> {
    let damaged = |reason: String| CompareError::Damaged { path: path.to_path_buf(), reason };
    // Of an older dynvox, or damaged: the next action differs.
    let rows = read_frame_digests(table).map_err(|error| match missing_column(&error) {
        Some(column) => CompareError::Column { path: path.to_path_buf(), column },
        None => damaged(match error.position() {
            Some(position) => format!("line {} cannot be read", position.line()),
            None => error.to_string(),
        }),
    })?;
    let row = |(at, row): (usize, &FrameDigests)| {
        let digests =
            // The first line is the header, and lines count from 1.
            row_of(row).ok_or_else(|| damaged(format!("line {} cannot be read", at + 2)))?;
        Ok((row.frame, digests))
    };
    rows.iter().enumerate().map(row).collect()
}

/// The column that an error says is missing.
fn missing_column(error: &csv::Error) -> Option<String> {
    let csv::ErrorKind::Deserialize { err, .. } = error.kind() else { return None };
    let csv::DeserializeErrorKind::Message(message) = err.kind() else { return None };
    Some(message.strip_prefix("missing field `")?.trim_end_matches('`').to_owned())
}

/// The digests of a row from their text.
fn row_of(row: &FrameDigests) -> Option<Row> {
    let hex = |text: &str| u64::from_str_radix(text, 16).ok();
    let object = |text: &str| {
        let (id, digest) = text.split_once(':')?;
        Some(ObjectDigest { id: id.parse().ok()?, digest: hex(digest)? })
    };
    // A dash stands for no objects, as an empty cell would be ambiguous.
    let objects: Vec<ObjectDigest> = match row.objects_digest.as_str() {
        "-" => Vec::new(),
        objects => objects.split(';').map(object).collect::<Option<_>>()?,
    };
    let stages = StageDigests {
        input: hex(&row.input_digest)?,
        stereo: hex(&row.stereo_digest)?,
        scene_flow: hex(&row.scene_flow_digest)?,
        egomotion: hex(&row.egomotion_digest)?,
        tracking: hex(&row.tracking_digest)?,
        static_map: hex(&row.static_map_digest)?,
        objects: ObjectDigests::from_objects(objects.into_iter()),
    };
    let outcome = Outcome {
        pose: None,
        density: row.stereo_density,
        disparity_px: row.disparity_mean_px,
        blocks: row.blocks_used,
    };
    Some(Row { digest: hex(&row.digest)?, stages, outcome })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::geometry::Transform;

    fn run(
        frames: std::ops::Range<usize>,
        change: impl Fn(usize, &mut StageDigests),
    ) -> RunDigests {
        let rows = frames.map(|frame| {
            // Two objects, so that one of them can be missing.
            let objects = ObjectDigests::from_objects(
                [ObjectDigest { id: 3, digest: 7 }, ObjectDigest { id: 9, digest: 8 }].into_iter(),
            );
            let mut stages = StageDigests {
                input: frame as u64,
                tracking: 5,
                objects,
                ..StageDigests::default()
            };
            change(frame, &mut stages);
            (frame, Row { digest: stages.whole(frame as u32), stages, outcome: Outcome::default() })
        });
        RunDigests {
            rows: rows.collect(),
            settings: BTreeMap::from([("volume.far_m".to_owned(), "20".to_owned())]),
        }
    }

    #[test]
    fn names_the_first_frame_and_the_first_stage_in_it() {
        let clean = run(0..5, |_, _| {});
        let divergence = |change: &dyn Fn(usize, &mut StageDigests)| {
            compare(&clean, &run(0..5, change)).unwrap().divergence.map(|of| (of.frame, of.stage))
        };
        assert_eq!(divergence(&|_, _| {}), None);
        let late = |frame: usize, stages: &mut StageDigests| {
            if frame >= 3 {
                // Two stages differ, and the one that runs first is the cause.
                (stages.static_map, stages.scene_flow) = (1, 1);
            }
        };
        assert_eq!(divergence(&late), Some((3, Some(Digested::SceneFlow))));
        let object = |frame: usize, stages: &mut StageDigests| {
            if frame == 4 {
                // Object 9 is gone.
                stages.objects =
                    ObjectDigests::from_objects([ObjectDigest { id: 3, digest: 7 }].into_iter());
            }
        };
        assert_eq!(divergence(&object), Some((4, Some(Digested::Object(9)))));
    }

    #[test]
    fn says_how_far_apart_outcomes_are_where_they_diverge_and_at_most() {
        let clean = run(0..5, |_, _| {});
        let mut drifting = run(0..5, |frame, stages| stages.egomotion = u64::from(frame >= 2));
        // Two metres apart at first, and further with each frame.
        for (frame, row) in &mut drifting.rows {
            let by_m = if *frame >= 2 { *frame as f64 } else { 0.0 };
            row.outcome = Outcome {
                pose: Some(Transform::from_translation([by_m, 0.0, 0.0])),
                blocks: 10,
                ..Outcome::default()
            };
        }
        let mut still = clean;
        still.rows.values_mut().for_each(|row| row.outcome.pose = Some(Transform::IDENTITY));
        let found = compare(&still, &drifting).unwrap().divergence.unwrap();
        assert_eq!(
            (found.frame, found.there.position_m, found.most.position_m, found.most.blocks),
            (2, 2.0, 4.0, 10)
        );
        assert!(
            found
                .there
                .to_string()
                .starts_with("pose 2.0000 m, 0.0000 deg; mean disparity 0.000 px"),
            "{}",
            found.there
        );
    }

    #[test]
    fn tells_a_beginning_from_an_end_and_both_from_the_same() {
        let (whole, start, end) =
            (run(0..5, |_, _| {}), run(0..3, |_, _| {}), run(2..5, |_, _| {}));
        let of = |a: &RunDigests, b: &RunDigests| {
            let found = compare(a, b).unwrap();
            (found.equal(), found.prefix(), found.shared)
        };
        assert_eq!(
            // The second number tells which of the two is the beginning.
            [of(&whole, &whole), of(&start, &whole), of(&whole, &start)],
            [(true, None, 5), (false, Some(0), 3), (false, Some(1), 3)]
        );
        assert_eq!([of(&end, &whole), of(&start, &end)], [(false, None, 3), (false, None, 1)]);
        assert!(
            compare(&run(0..2, |_, _| {}), &end)
                .unwrap_err()
                .to_string()
                .contains("0 to 1, the other 2 to 4")
        );
    }

    #[test]
    fn settings_that_differ_are_named() {
        let (a, mut b) = (run(0..1, |_, _| {}), run(0..1, |_, _| {}));
        // A value that differs, and a key that one of them has.
        b.settings = BTreeMap::from([
            ("volume.far_m".to_owned(), "30".to_owned()),
            ("volume.near_m".to_owned(), "1".to_owned()),
        ]);
        let keys: Vec<String> =
            compare(&a, &b).unwrap().settings.into_iter().map(|setting| setting.key).collect();
        assert_eq!(keys, ["volume.far_m", "volume.near_m"]);
    }
}
