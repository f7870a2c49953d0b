//! Alignment of recordings in the world: maps that overlap are registered with one another, and a
//! pose graph gives each map its place.
//!
//! **Memory.** The distances of two maps, and 200,000 surface points of each recording, 48 bytes
//! each.

use super::distance_field::{DistanceField, SurfacePoint};
use super::georeference::Prior;
use super::manifest::{rows_of, transform};
use super::parts::{LINK_UNCERTAINTY, links, priors};
use super::pose_graph::{Edge, Node, solve, with_drift};
use super::register::{Fit, RegisteredMap, Registration, Uncertainty, register};
use super::submap::Submap;
use super::{FleetError, Job, Manifest, distance_m};
use crate::formats::bounds::MANIFEST_TEXT;
use crate::formats::read_text_within;
use crate::run::write_whole;
use dynvox_core::geometry::Transform;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::Path;

/// Name of what alignment found.
pub const ALIGNMENT_FILE: &str = "alignment.json";
/// Surface points of a recording.
const MAX_POINTS: usize = 200_000;
/// Weight of a voxel that takes part.
const MIN_WEIGHT: u8 = 3;
/// Factor on the uncertainty of the first recording's pose. The first pose defines the world, so
/// that maps and plans made earlier still fit. With an equal share, all recordings would move by
/// the mean of their errors.
const FIRST_SHARE: f64 = 1e-4;
/// Registrations of all pairs, each from the poses that the last one gave.
const ROUNDS: usize = 3;

/// Poses of all recordings after alignment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// In the order of the jobs.
    pub recordings: Vec<AlignedRecording>,
    /// Recordings that overlap.
    pub pairs: Vec<AlignedPair>,
}

/// Pose of a recording before and after alignment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlignedRecording {
    /// Name in tables and charts.
    pub name: String,
    /// Id of the recording's job.
    pub id: String,
    /// Given pose: the rows of a 3 x 4 matrix.
    pub given: [f64; 12],
    /// Aligned pose: the rows of a 3 x 4 matrix.
    pub t_world_camera: [f64; 12],
    /// Distance by which the map's centre was moved, m.
    pub moved_m: f64,
    /// Angle by which the map was rotated, degrees.
    pub turned_deg: f64,
}

/// Fit of two recordings that overlap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlignedPair {
    /// Names of the recordings.
    pub recordings: [String; 2],
    /// Quality of the fit after alignment.
    #[serde(flatten)]
    pub fit: Fit,
}

/// Samples of a recording's map that are kept while others are registered.
struct Sampled {
    points: Vec<SurfacePoint>,
    centre_m: [f64; 3],
    radius_m: f64,
}

impl Alignment {
    /// Aligns the maps of jobs that are all done.
    ///
    /// # Errors
    /// A map is damaged or missing.
    pub fn find(
        manifest: &Manifest,
        folder: &Path,
        uncertainty: &Uncertainty,
    ) -> Result<Self, FleetError> {
        // Poses as given, with what is known of their errors.
        let priors = priors(manifest, folder).into_iter().collect::<Result<Vec<_>, _>>()?;
        let links = links(manifest, folder)?;
        let sampled = manifest
            .jobs
            .iter()
            .map(|job| Sampled::of(job, folder))
            .collect::<Result<Vec<_>, _>>()?;
        // The first map is held tighter than its poses are known: it fixes the world for the
        // others.
        let node = |(at, (prior, of)): (usize, (&Prior, &Sampled))| {
            let share = if at == 0 { FIRST_SHARE } else { 1.0 };
            Node {
                given: prior.t_world_map,
                uncertainty: prior.uncertainty_or(&uncertainty.times(share)),
                centre_m: of.centre_m,
            }
        };
        let nodes: Vec<Node> = priors.iter().zip(&sampled).enumerate().map(node).collect();
        let allowed: Vec<Uncertainty> =
            priors.iter().map(|prior| prior.uncertainty_or(uncertainty)).collect();
        // How two maps should lie to one another, and how far they may be from there.
        let expected = |b: usize, a: usize| match links.iter().find(|(pair, _)| *pair == [b, a]) {
            Some((_, link)) => (link.t_part_before.inverse(), LINK_UNCERTAINTY),
            None => (nodes[b].given.inverse() * nodes[a].given, allowed[a].and(&allowed[b])),
        };
        let mut poses: Vec<Transform> = nodes.iter().map(|node| node.given).collect();
        let mut pairs: Vec<([usize; 2], AlignedPair)> = Vec::new();
        // Registration begins from the poses of the round before.
        for _ in 0..ROUNDS {
            let found = register_all(manifest, folder, &sampled, |b, a| {
                let (given, allowed) = expected(b, a);
                Expected { t_b_a: poses[b].inverse() * poses[a], given, allowed }
            })?;
            let accepted = || found.iter().filter(|(_, of)| of.fit.refused.is_none());
            let registered = accepted().map(|(nodes, of)| registered_edge(*nodes, of));
            // What two parts share says less than their registration, which errs alike.
            let linked = links
                .iter()
                .filter(|([before, part], _)| accepted().all(|(pair, _)| *pair != [*part, *before]))
                .map(|(pair, link)| link.edge(*pair));
            let edges: Vec<Edge> =
                registered.chain(linked).map(|edge| drifting(edge, &sampled)).collect();
            poses = solve(&nodes, &edges, &poses);
            // Pairs of the last round are those that are reported.
            pairs = found
                .iter()
                .map(|(nodes, of)| (*nodes, pair(manifest, *nodes, of, &pairs)))
                .collect();
        }
        let recordings = manifest
            .jobs
            .iter()
            .zip(&poses)
            .zip(&nodes)
            .map(|((job, pose), node)| recording(job, pose, node));
        Ok(Self {
            recordings: recordings.collect(),
            pairs: pairs.into_iter().map(|(_, pair)| pair).collect(),
        })
    }

    /// Writes it into the folder of the jobs.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn write(&self, folder: &Path) -> Result<(), FleetError> {
        let path = folder.join(ALIGNMENT_FILE);
        let text = serde_json::to_string_pretty(self).unwrap_or_default() + "\n";
        write_whole(&path, |file| file.write_all(text.as_bytes()))
            .map_err(|error| FleetError::content(&path, error.to_string()))
    }
}

/// Returns the poses of jobs' maps in the world: aligned, or as given if nothing was aligned. A job
/// with fixes needs its map.
///
/// # Errors
/// The alignment is not of these jobs.
pub fn poses(
    manifest: &Manifest,
    folder: &Path,
) -> Result<Vec<Result<Transform, FleetError>>, FleetError> {
    let path = folder.join(ALIGNMENT_FILE);
    // Poses as given hold until an alignment of these jobs replaces them.
    let given: Vec<_> =
        priors(manifest, folder).into_iter().map(|prior| Ok(prior?.t_world_map)).collect();
    if !path.is_file() {
        return Ok(given);
    }
    let text = read_text_within(&path, &MANIFEST_TEXT)?;
    let other = || {
        FleetError::content(
            &path,
            "is not of these jobs. Align again with `dynvox fleet align`, or remove it",
        )
    };
    let alignment: Alignment = serde_json::from_str(&text).map_err(|_| other())?;
    // Numbers read from JSON may differ in their last bit.
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
    let is_same =
        |((job, given), of): ((&Job, &Result<Transform, FleetError>), &AlignedRecording)| {
            job.id == of.id
                && given
                    .as_ref()
                    .is_ok_and(|given| rows_of(given).iter().zip(&of.given).all(is_near))
        };
    let jobs = manifest.jobs.iter().zip(&given);
    if alignment.recordings.len() != jobs.len() || !jobs.zip(&alignment.recordings).all(is_same) {
        return Err(other());
    }
    Ok(alignment
        .recordings
        .iter()
        .map(|of| transform(&of.t_world_camera).ok_or_else(other))
        .collect())
}

impl Sampled {
    fn of(job: &Job, folder: &Path) -> Result<Self, FleetError> {
        let points = field(job, folder)?.surface(MAX_POINTS);
        let mut centre_m = [0.0; 3];
        points.iter().for_each(|point| {
            (0..3).for_each(|axis| centre_m[axis] += point.at_m[axis] / points.len() as f64)
        });
        // How far rotations move the points at most.
        let radius_m =
            points.iter().map(|point| distance_m(&point.at_m, &centre_m)).fold(0.0, f64::max);
        Ok(Self { points, centre_m, radius_m })
    }
}

/// The distances of a recording's map.
fn field(job: &Job, folder: &Path) -> Result<DistanceField, FleetError> {
    let mut map = Submap::open(&job.submap(folder))?;
    Ok(DistanceField::of(&mut map.store, &map.lattice, MIN_WEIGHT))
}

/// Two maps before their registration: the first in the second.
struct Expected {
    /// Pose from which registration begins.
    t_b_a: Transform,
    /// Given pose, and how far registration may lead away from it.
    given: Transform,
    allowed: Uncertainty,
}

/// Registers all pairs that may overlap, in the order of the jobs.
fn register_all(
    manifest: &Manifest,
    folder: &Path,
    sampled: &[Sampled],
    expected: impl Fn(usize, usize) -> Expected,
) -> Result<Vec<([usize; 2], Registration)>, FleetError> {
    let load = |at: usize| -> Result<RegisteredMap, FleetError> {
        Ok(RegisteredMap {
            field: field(&manifest.jobs[at], folder)?,
            points: sampled[at].points.clone(),
        })
    };
    let mut found = Vec::new();
    for b in 0..sampled.len() {
        let mut map_b = None;
        for a in b + 1..sampled.len() {
            let Expected { t_b_a, given, allowed } = expected(b, a);
            // Maps that lie too far apart share no surface.
            let to_a = t_b_a.transform_point(sampled[a].centre_m);
            if distance_m(&to_a, &sampled[b].centre_m) > sampled[a].radius_m + sampled[b].radius_m {
                continue;
            }
            if map_b.is_none() {
                map_b = Some(load(b)?);
            }
            let Some(map_b) = &map_b else { continue };
            let registration = register((&load(a)?, map_b), (&given, &t_b_a), &allowed);
            found.extend(registration.map(|registration| ([a, b], registration)));
        }
    }
    Ok(found)
}

fn registered_edge(nodes: [usize; 2], of: &Registration) -> Edge {
    let Registration { t_b_a, information, centre_m, .. } = *of;
    Edge { nodes, t_b_a, information, centre_m }
}

/// Adds drift to an edge: it says how two maps lie where they overlap; how their centres lie
/// follows as far as the maps have no drift from there.
fn drifting(edge: Edge, sampled: &[Sampled]) -> Edge {
    let [a, b] = edge.nodes;
    // In the other map's frame, where its own centre is.
    let in_a_m = edge.t_b_a.inverse().transform_point(edge.centre_m);
    let way_m = distance_m(&edge.centre_m, &sampled[b].centre_m)
        .hypot(distance_m(&in_a_m, &sampled[a].centre_m));
    Edge { information: with_drift(&edge.information, way_m), ..edge }
}

fn pair(
    manifest: &Manifest,
    [a, b]: [usize; 2],
    of: &Registration,
    before: &[([usize; 2], AlignedPair)],
) -> AlignedPair {
    // The error before the first registration, not before the last one.
    let first = before.iter().find(|(nodes, _)| *nodes == [a, b]);
    let rms_before_m = first.map_or(of.fit.rms_before_m, |(_, pair)| pair.fit.rms_before_m);
    AlignedPair {
        recordings: [a, b].map(|at| manifest.jobs[at].name.clone()),
        fit: Fit { rms_before_m, ..of.fit.clone() },
    }
}

fn recording(job: &Job, pose: &Transform, node: &Node) -> AlignedRecording {
    let motion = *pose * node.given.inverse();
    let (from, to) =
        (node.given.transform_point(node.centre_m), pose.transform_point(node.centre_m));
    AlignedRecording {
        name: job.name.clone(),
        id: job.id.clone(),
        given: rows_of(&node.given),
        t_world_camera: rows_of(pose),
        moved_m: distance_m(&to, &from),
        turned_deg: motion.angle_rad().to_degrees(),
    }
}

#[cfg(test)]
mod tests;
