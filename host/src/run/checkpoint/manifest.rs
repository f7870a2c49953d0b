//! Start of a run: enough to start it again, and to check that it is the same.

use super::ResumeError;
use crate::request::{Plan, Request};
use crate::run::settings::{Setting, differing, settings};
use dynvox_core::digest::Digest;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Differences listed at most.
const MAX_DIFFERENCES: usize = 5;

/// Start of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// Request of the run.
    request: Request,
    /// The run's folder replaces earlier results.
    overwrites: bool,
    /// The resolved settings, and what identifies the data set.
    fingerprint: BTreeMap<String, String>,
}

impl RunManifest {
    /// The manifest of a plan's run into a folder.
    ///
    /// # Errors
    /// A path of the request is not Unicode.
    pub fn new(plan: &Plan, overwrites: bool) -> Result<Self, ResumeError> {
        let request = plan.request.clone();
        serde_json::to_value(&request)
            .map_err(|error| ResumeError::NotStorable { reason: error.to_string() })?;
        Ok(Self { request, overwrites, fingerprint: fingerprint(plan) })
    }

    /// Request of the run.
    pub fn request(&self) -> &Request {
        &self.request
    }

    /// Returns true if the run's folder replaces earlier results.
    pub fn overwrites(&self) -> bool {
        self.overwrites
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
        let mut sentences: Vec<String> = all.iter().take(MAX_DIFFERENCES).map(sentence).collect();
        if all.len() > MAX_DIFFERENCES {
            sentences.push(format!("and {} more", all.len() - MAX_DIFFERENCES));
        }
        Err(ResumeError::Different { differences: sentences.join("; ") })
    }
}

/// The resolved settings of a plan, and what identifies its data set, by name.
pub fn fingerprint(plan: &Plan) -> BTreeMap<String, String> {
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
