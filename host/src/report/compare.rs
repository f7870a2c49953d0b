//! Two runs held against each other: where they part first, frame by frame and stage by stage.

use dynvox_core::StageDigests;
use dynvox_core::{Digested, ObjectDigest, ObjectDigests};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A run folder that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// It is none.
    #[error("{path} is no run folder: it has no {file} that can be read ({source}). Give a folder that `dynvox run` wrote")]
    NoRun {
        /// Path as given.
        path: PathBuf,
        /// The file that is missing.
        file: &'static str,
        /// What the machine says.
        source: std::io::Error,
    },
    /// A column is missing: an older build wrote it.
    #[error("{path} has no column {column}: it is of an older dynvox. Make the run again")]
    Column {
        /// The table.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// A file is damaged.
    #[error("{path}: {reason}. Make the run again")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The runs have no frame in common.
    #[error("the runs share no frame: one has {a}, the other {b}. Compare runs with the same --start and --stride")]
    NothingShared {
        /// Frames of the first.
        a: String,
        /// Frames of the second.
        b: String,
    },
}

/// What a run left of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Of all stages.
    pub digest: u64,
    /// Of each.
    pub stages: StageDigests,
}

/// A run, as far as it can be compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// The frames, by number.
    pub rows: BTreeMap<usize, Row>,
    /// The settings by dotted key, and what the summary says of the run: data set, profile.
    pub settings: BTreeMap<String, String>,
}

/// A setting that differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Its dotted key.
    pub key: String,
    /// Its value in either run, where it has one.
    pub values: [Option<String>; 2],
}

/// Where two runs part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parting {
    /// The first frame that differs.
    pub frame: usize,
    /// The first stage that differs in it; `None` where only the digest of all does.
    pub stage: Option<Digested>,
}

/// What two runs are to each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Comparison {
    /// Settings that differ.
    pub settings: Vec<Setting>,
    /// Where they part; `None` where they agree in every frame they share.
    pub parting: Option<Parting>,
    /// Frames they share.
    pub shared: usize,
    /// First and last frame, and how many there are, of either.
    pub frames: [[usize; 3]; 2],
}

impl Comparison {
    /// Whether the same frames gave the same bits.
    pub fn equal(&self) -> bool {
        self.parting.is_none() && self.frames.iter().all(|&[_, _, count]| count == self.shared)
    }

    /// Which run, 0 or 1, is the beginning of the other, if one is.
    pub fn prefix(&self) -> Option<usize> {
        let [a, b] = self.frames;
        let begins = |short: [usize; 3], long: [usize; 3]| {
            short[2] == self.shared && long[2] > self.shared && short[0] == long[0] && short[1] < long[1]
        };
        let which = if begins(a, b) { Some(0) } else { begins(b, a).then_some(1) };
        which.filter(|_| self.parting.is_none())
    }
}

impl Run {
    /// Reads a run folder.
    ///
    /// # Errors
    /// It is none, is damaged, or of an older build.
    pub fn read(folder: &Path) -> Result<Self, CompareError> {
        let text = |file: &'static str| {
            std::fs::read_to_string(folder.join(file)).map_err(|source| CompareError::NoRun { path: folder.to_path_buf(), file, source })
        };
        let (frames, config, summary) = (text("frames.csv")?, text("config.toml")?, text("summary.json")?);
        let damaged = |file: &str, reason: String| CompareError::Damaged { path: folder.join(file), reason };
        let mut settings = settings(&config).map_err(|error| damaged("config.toml", error.message().to_owned()))?;
        let summary: serde_json::Value = serde_json::from_str(&summary).map_err(|error| damaged("summary.json", error.to_string()))?;
        for key in ["dataset", "profile"] {
            if let Some(value) = summary.get(key).and_then(serde_json::Value::as_str) {
                settings.insert(format!("({key})"), value.to_owned());
            }
        }
        Ok(Self { rows: read_rows(&frames, &folder.join("frames.csv"))?, settings })
    }

    fn frames(&self) -> [usize; 3] {
        let ends = self.rows.keys().next().zip(self.rows.keys().next_back()).map_or([0, 0], |(first, last)| [*first, *last]);
        [ends[0], ends[1], self.rows.len()]
    }
}

/// Holds two runs against each other, in the frames they share.
///
/// # Errors
/// They share none.
pub fn compare(a: &Run, b: &Run) -> Result<Comparison, CompareError> {
    let shared = || a.rows.iter().filter_map(|(frame, row)| Some((*frame, row, b.rows.get(frame)?)));
    let parting = shared().find(|(_, one, other)| one != other);
    let comparison = Comparison {
        settings: differing(&a.settings, &b.settings),
        parting: parting.map(|(frame, one, other)| Parting { frame, stage: one.stages.first_difference(&other.stages) }),
        shared: shared().count(),
        frames: [a.frames(), b.frames()],
    };
    if comparison.shared == 0 {
        let said = |[first, last, count]: [usize; 3]| if count == 0 { "none".to_owned() } else { format!("{first} to {last}") };
        return Err(CompareError::NothingShared { a: said(a.frames()), b: said(b.frames()) });
    }
    Ok(comparison)
}

/// The settings of two runs that differ, by key.
pub(crate) fn differing(a: &BTreeMap<String, String>, b: &BTreeMap<String, String>) -> Vec<Setting> {
    let keys: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let pairs = keys.into_iter().map(|key| Setting { key: key.clone(), values: [a.get(key).cloned(), b.get(key).cloned()] });
    pairs.filter(|setting| setting.values[0] != setting.values[1]).collect()
}

/// The settings in a `config.toml`, by dotted key.
pub(crate) fn settings(config_toml: &str) -> Result<BTreeMap<String, String>, toml::de::Error> {
    let mut settings = BTreeMap::new();
    flatten("", &toml::from_str(config_toml)?, &mut settings);
    Ok(settings)
}

fn flatten(prefix: &str, table: &toml::Table, settings: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let key = format!("{prefix}{key}");
        match value {
            toml::Value::Table(inner) => flatten(&format!("{key}."), inner, settings),
            value => drop(settings.insert(key, value.to_string())),
        }
    }
}

/// Reads `frames.csv`; columns are found by name.
fn read_rows(text: &str, path: &Path) -> Result<BTreeMap<usize, Row>, CompareError> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let place = |column: String| {
        let at = names.iter().position(|name| *name == column);
        at.ok_or_else(|| CompareError::Column { path: path.to_path_buf(), column })
    };
    let (frame_at, digest_at) = (place("frame".to_owned())?, place("digest".to_owned())?);
    let stages_at = Digested::COLUMNS.iter().map(|column| place(format!("{column}_digest"))).collect::<Result<Vec<_>, _>>()?;
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let stages: Vec<&str> = stages_at.iter().map(|&at| cells.get(at).copied()).collect::<Option<_>>()?;
        let digest = u64::from_str_radix(cells.get(digest_at)?, 16).ok()?;
        Some((cells.get(frame_at)?.parse().ok()?, Row { digest, stages: stages_of(&stages)? }))
    };
    lines
        .enumerate()
        .map(|(at, line)| {
            row(line).ok_or_else(|| CompareError::Damaged { path: path.to_path_buf(), reason: format!("line {} cannot be read", at + 2) })
        })
        .collect()
}

/// The digests of the stages from their text, in the order of [`Digested::COLUMNS`].
fn stages_of(cells: &[&str]) -> Option<StageDigests> {
    let &[input, disparity, matches, egomotion, tracks, background, objects] = cells else { return None };
    let hex = |text: &str| u64::from_str_radix(text, 16).ok();
    let object = |text: &str| {
        let (id, digest) = text.split_once(':')?;
        Some(ObjectDigest { id: id.parse().ok()?, digest: hex(digest)? })
    };
    let objects: Vec<ObjectDigest> = match objects {
        "-" => Vec::new(),
        objects => objects.split(';').map(object).collect::<Option<_>>()?,
    };
    Some(StageDigests {
        input: hex(input)?,
        disparity: hex(disparity)?,
        matches: hex(matches)?,
        egomotion: hex(egomotion)?,
        tracks: hex(tracks)?,
        background: hex(background)?,
        objects: ObjectDigests::of(objects.into_iter()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(frames: std::ops::Range<usize>, change: impl Fn(usize, &mut StageDigests)) -> Run {
        let rows = frames.map(|frame| {
            let objects = ObjectDigests::of([ObjectDigest { id: 3, digest: 7 }, ObjectDigest { id: 9, digest: 8 }].into_iter());
            let mut stages = StageDigests { input: frame as u64, tracks: 5, objects, ..StageDigests::default() };
            change(frame, &mut stages);
            (frame, Row { digest: stages.whole(frame as u32), stages })
        });
        Run {
            rows: rows.collect(),
            settings: BTreeMap::from([("volume.far_m".to_owned(), "20".to_owned())]),
        }
    }

    #[test]
    fn names_the_first_frame_and_the_first_stage_in_it() {
        let clean = run(0..5, |_, _| {});
        let parting = |change: &dyn Fn(usize, &mut StageDigests)| compare(&clean, &run(0..5, change)).unwrap().parting;
        assert_eq!(parting(&|_, _| {}), None);
        let late = |frame: usize, stages: &mut StageDigests| {
            if frame >= 3 {
                (stages.background, stages.matches) = (1, 1);
            }
        };
        assert_eq!(parting(&late), Some(Parting { frame: 3, stage: Some(Digested::Matches) }));
        let object = |frame: usize, stages: &mut StageDigests| {
            if frame == 4 {
                stages.objects = ObjectDigests::of([ObjectDigest { id: 3, digest: 7 }].into_iter());
            }
        };
        assert_eq!(parting(&object), Some(Parting { frame: 4, stage: Some(Digested::Object(9)) }));
    }

    #[test]
    fn tells_a_beginning_from_an_end_and_both_from_the_same() {
        let (whole, start, end) = (run(0..5, |_, _| {}), run(0..3, |_, _| {}), run(2..5, |_, _| {}));
        let of = |a: &Run, b: &Run| {
            let found = compare(a, b).unwrap();
            (found.equal(), found.prefix(), found.shared)
        };
        assert_eq!(
            [of(&whole, &whole), of(&start, &whole), of(&whole, &start)],
            [(true, None, 5), (false, Some(0), 3), (false, Some(1), 3)]
        );
        assert_eq!([of(&end, &whole), of(&start, &end)], [(false, None, 3), (false, None, 1)]);
        assert!(compare(&run(0..2, |_, _| {}), &end).unwrap_err().to_string().contains("0 to 1, the other 2 to 4"));
    }

    #[test]
    fn settings_that_differ_are_named() {
        let (a, mut b) = (run(0..1, |_, _| {}), run(0..1, |_, _| {}));
        b.settings = BTreeMap::from([("volume.far_m".to_owned(), "30".to_owned()), ("volume.near_m".to_owned(), "1".to_owned())]);
        let keys: Vec<String> = compare(&a, &b).unwrap().settings.into_iter().map(|setting| setting.key).collect();
        assert_eq!(keys, ["volume.far_m", "volume.near_m"]);
    }
}
