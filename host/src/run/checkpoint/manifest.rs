//! How a run was started: enough to start it again, and to check that it is the same.

use super::ResumeError;
use crate::run::Plan;
use crate::run::settings::{Setting, differing, settings};
use dynvox_core::digest::Digest;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Differences listed at most.
const MOST_DIFFERENCES: usize = 5;

/// How a run was started.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunManifest {
    /// The command line after `dynvox run`.
    arguments: Vec<String>,
    /// The working directory: relative paths start there.
    working_dir: String,
    /// The resolved settings, and what identifies the data set.
    fingerprint: BTreeMap<String, String>,
}

impl RunManifest {
    /// Of the run of `plan`, started with these arguments in this folder.
    ///
    /// # Errors
    /// They are not Unicode.
    pub fn of(
        plan: &Plan,
        arguments: impl Iterator<Item = OsString>,
        working_dir: &Path,
    ) -> Result<Self, ResumeError> {
        let text = |word: OsString| {
            word.into_string().map_err(|word| ResumeError::NotUnicode {
                what: word.to_string_lossy().into_owned(),
            })
        };
        Ok(Self {
            arguments: arguments.map(text).collect::<Result<_, _>>()?,
            working_dir: text(working_dir.to_path_buf().into_os_string())?,
            fingerprint: fingerprint(plan),
        })
    }

    /// The command line after `dynvox run`.
    pub fn arguments(&self) -> &[String] {
        &self.arguments
    }

    /// The resolved settings, and what identifies the data set, by name.
    pub fn fingerprint(&self) -> &BTreeMap<String, String> {
        &self.fingerprint
    }

    /// The working directory of the command line.
    pub fn working_dir(&self) -> PathBuf {
        PathBuf::from(&self.working_dir)
    }

    /// Checks that a plan is the one the run was started with.
    ///
    /// # Errors
    /// What differs, by name.
    pub fn require(&self, plan: &Plan) -> Result<(), ResumeError> {
        let all = differing(&self.fingerprint, &fingerprint(plan));
        if all.is_empty() {
            return Ok(());
        }
        let sentence = |one: &Setting| {
            let [then, now] =
                one.values.each_ref().map(|value| value.as_deref().unwrap_or("not set"));
            format!("{} was {then} and is {now}", one.key)
        };
        let mut sentences: Vec<String> = all.iter().take(MOST_DIFFERENCES).map(sentence).collect();
        if all.len() > MOST_DIFFERENCES {
            sentences.push(format!("and {} more", all.len() - MOST_DIFFERENCES));
        }
        Err(ResumeError::Different { differences: sentences.join("; ") })
    }
}

/// Settings and data set of a plan, by name.
fn fingerprint(plan: &Plan) -> BTreeMap<String, String> {
    let mut fingerprint = settings(&plan.config_toml).unwrap_or_default();
    fingerprint.insert("profile".to_owned(), plan.profile.clone());
    let dataset = plan.dataset.as_ref();
    let digest = |values: &mut dyn Iterator<Item = f64>| {
        let mut digest = Digest::default();
        values.for_each(|value| digest.f64(value));
        format!("{:016x}", digest.finish())
    };
    let poses = plan
        .poses
        .iter()
        .flatten()
        .flat_map(|pose| pose.rotation.into_iter().chain(pose.translation_m));
    let (width, height) = dataset.size();
    let rows = [
        ("name", dataset.name().to_owned()),
        ("rig", format!("{:?}", dataset.rig())),
        ("image size", format!("{width} x {height} px")),
        ("number of frames", plan.frames.listed().len().to_string()),
        (
            "digest of the frames' numbers",
            digest(&mut plan.frames.listed().iter().map(|&index| index as f64)),
        ),
        (
            "digest of the frames' times",
            digest(&mut plan.frames.listed().iter().map(|&index| dataset.time_s(index))),
        ),
        ("digest of the given poses", digest(&mut poses.collect::<Vec<_>>().into_iter())),
    ];
    fingerprint.extend(rows.map(|(name, value)| (format!("the data set's {name}"), value)));
    fingerprint
}
