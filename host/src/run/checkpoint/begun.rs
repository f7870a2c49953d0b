//! How a run was begun: what it takes to begin it alike, and to see whether it is alike.

use super::ResumeError;
use crate::report::compare::{Setting, differing, settings};
use crate::run::Plan;
use dynvox_core::digest::Digest;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Differences told at most.
const MOST_DIFFERENCES: usize = 5;

/// How a run was begun.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Begun {
    /// The command line behind the program's name.
    words: Vec<String>,
    /// The folder it was given in: paths in it may begin there.
    place: String,
    /// The resolved settings, and what tells the data set from another.
    likeness: BTreeMap<String, String>,
}

impl Begun {
    /// Notes how the run of `plan` is begun: with these words, in this folder.
    ///
    /// # Errors
    /// They are not Unicode.
    pub fn of(plan: &Plan, words: impl Iterator<Item = OsString>, place: &Path) -> Result<Self, ResumeError> {
        let text =
            |word: OsString| word.into_string().map_err(|word| ResumeError::NotUnicode { what: word.to_string_lossy().into_owned() });
        Ok(Self {
            words: words.map(text).collect::<Result<_, _>>()?,
            place: text(place.to_path_buf().into_os_string())?,
            likeness: likeness(plan),
        })
    }

    /// The command line behind the program's name.
    pub fn words(&self) -> &[String] {
        &self.words
    }

    /// The folder the command line was given in.
    pub fn place(&self) -> PathBuf {
        PathBuf::from(&self.place)
    }

    /// Whether a plan is the one the run was begun with.
    ///
    /// # Errors
    /// What differs, by name.
    pub fn require(&self, plan: &Plan) -> Result<(), ResumeError> {
        let all = differing(&self.likeness, &likeness(plan));
        if all.is_empty() {
            return Ok(());
        }
        let tell = |one: &Setting| {
            let [then, now] = one.values.each_ref().map(|value| value.as_deref().unwrap_or("nothing"));
            format!("{} was {then} and is {now}", one.key)
        };
        let mut told: Vec<String> = all.iter().take(MOST_DIFFERENCES).map(tell).collect();
        if all.len() > MOST_DIFFERENCES {
            told.push(format!("and {} more", all.len() - MOST_DIFFERENCES));
        }
        Err(ResumeError::Unlike { differences: told.join("; ") })
    }
}

/// Settings and data set of a plan, by name.
fn likeness(plan: &Plan) -> BTreeMap<String, String> {
    let mut likeness = settings(&plan.config_toml).unwrap_or_default();
    likeness.insert("profile".to_owned(), plan.profile.clone());
    let dataset = plan.dataset.as_ref();
    let digest = |values: &mut dyn Iterator<Item = f64>| {
        let mut digest = Digest::default();
        values.for_each(|value| digest.f64(value));
        format!("{:016x}", digest.finish())
    };
    let poses = plan.poses.iter().flatten().flat_map(|pose| pose.rotation.into_iter().chain(pose.translation_m));
    let (width, height) = dataset.size();
    let rows = [
        ("name", dataset.name().to_owned()),
        ("rig", format!("{:?}", dataset.rig())),
        ("image size", format!("{width} x {height} px")),
        ("number of frames", plan.indices.len().to_string()),
        ("digest of the frames' numbers", digest(&mut plan.indices.iter().map(|&index| index as f64))),
        ("digest of the frames' times", digest(&mut plan.indices.iter().map(|&index| dataset.time_s(index)))),
        ("digest of the given poses", digest(&mut poses.collect::<Vec<_>>().into_iter())),
    ];
    likeness.extend(rows.map(|(name, value)| (format!("the data set's {name}"), value)));
    likeness
}
