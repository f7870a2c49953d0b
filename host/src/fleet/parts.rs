//! Recordings that bend: a recording of several maps, each of some frames, which overlap. A map is
//! rigid; the drift of the whole recording lies between its maps, where alignment can take it out.
//!
//! The first part lies where the recording was given, each later one where the frames that it
//! shares with the one before say, unless it has fixes of its own.

use super::georeference::{Prior, prior};
use super::pose_graph::{Edge, drift_over, information_of};
use super::submap::Submap;
use super::{FleetError, Job, Manifest, Uncertainty, path_m};
use dynvox_core::geometry::Transform;
use std::path::Path;

/// Standard deviation of a part's place by the frames that it shares: stereo odometry over some
/// frames.
pub const LINK_UNCERTAINTY: Uncertainty = Uncertainty { position_m: 0.05, rotation_rad: 0.005 };

/// Relation of a part to the one before it, by a frame of both.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// The map before in that of the part.
    pub t_part_before: Transform,
    /// The camera of that frame, in the part's map.
    pub camera_m: [f64; 3],
    /// Way of the camera through the map before, m.
    pub way_before_m: f64,
}

impl Link {
    /// Finds the link of a part to the one before it.
    ///
    /// # Errors
    /// A map is damaged, or both share no frame because the camera was lost.
    pub fn of(before: &Job, part: &Job, folder: &Path) -> Result<Self, FleetError> {
        let earlier = Submap::cameras(&before.submap(folder))?;
        let later = Submap::cameras(&part.submap(folder))?;
        let shared: Vec<_> = later
            .iter()
            .filter_map(|of| {
                let same = earlier.iter().find(|before| before.frame == of.frame)?;
                Some([same.t_map_camera, of.t_map_camera])
            })
            .collect();
        // In the middle both maps know what lies around.
        let [t_before_camera, t_part_camera] = *shared.get(shared.len() / 2).ok_or_else(|| {
            FleetError::content(
                folder,
                format!(
                    "has no frame in the maps of both {} and {}: the camera was lost. Plan the \
                     rest as a recording of its own, with `--start`",
                    before.name, part.name
                ),
            )
        })?;
        let cameras_m: Vec<_> = earlier.iter().map(|of| of.t_map_camera.translation_m).collect();
        Ok(Self {
            t_part_before: t_part_camera * t_before_camera.inverse(),
            camera_m: t_part_camera.translation_m,
            way_before_m: path_m(&cameras_m),
        })
    }

    /// Returns an edge of the pose graph, known about the shared camera.
    pub fn edge(&self, nodes: [usize; 2]) -> Edge {
        Edge {
            nodes,
            t_b_a: self.t_part_before,
            information: information_of(&LINK_UNCERTAINTY),
            centre_m: self.camera_m,
        }
    }
}

/// Links of all parts with the part before them, and the numbers of both in the list of jobs.
///
/// # Errors
/// A map is damaged, or two parts share no frame.
pub fn links(manifest: &Manifest, folder: &Path) -> Result<Vec<([usize; 2], Link)>, FleetError> {
    let pairs = (0..manifest.jobs.len()).filter_map(|at| Some([before(manifest, at)?, at]));
    pairs
        .map(|pair| {
            let [before, part] = pair.map(|at| &manifest.jobs[at]);
            Ok((pair, Link::of(before, part, folder)?))
        })
        .collect()
}

/// Number of the part that comes before a job; `None` for the first and for whole recordings.
fn before(manifest: &Manifest, at: usize) -> Option<usize> {
    let id = manifest.jobs[at].given.follows()?;
    manifest.jobs[..at].iter().position(|job| job.id == id)
}

/// Given poses of the maps of all jobs. A part without a pose or fixes of its own has the pose of
/// the part before it, moved on.
pub fn priors(manifest: &Manifest, folder: &Path) -> Vec<Result<Prior, FleetError>> {
    let mut found: Vec<Result<Prior, FleetError>> = Vec::new();
    for (at, job) in manifest.jobs.iter().enumerate() {
        let own = prior(job, folder);
        let of = match (own, before(manifest, at)) {
            (Err(_), Some(before)) => match &found[before] {
                Ok(earlier) => Link::of(&manifest.jobs[before], job, folder)
                    .map(|link| earlier.moved_on(&link)),
                Err(_) => Err(FleetError::content(
                    folder,
                    format!("has no place for {}, nor for the part before it", job.name),
                )),
            },
            (own, _) => own,
        };
        found.push(of);
    }
    found
}

impl Prior {
    /// Given pose of the next part.
    fn moved_on(&self, link: &Link) -> Self {
        let way_m = self.way_m + link.way_before_m;
        Self { t_world_map: self.t_world_map * link.t_part_before.inverse(), way_m, ..*self }
    }

    /// Standard deviation of the pose: the known one or the one given here, with the drift since.
    pub fn uncertainty_or(&self, given: &Uncertainty) -> Uncertainty {
        self.uncertainty.unwrap_or(*given).and(&drift_over(self.way_m))
    }
}
