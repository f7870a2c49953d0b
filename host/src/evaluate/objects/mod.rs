//! Tracks against ground truth: motion states, motions, speeds, association.
//!
//! A track seen in a frame belongs to the true object whose box its own overlaps most, at least by
//! [`OVERLAP_MIN`]. Its motion since the last frame is compared in the object's own frame, as
//! DynoSAM's *motion error* (Morris, Wang, Kliniewski, Ila, *DynoSAM*, 2025; before it Zhang et
//! al., *VDO-SLAM*, 2020): `E = (true_before^-1 true_now)^-1 (true_before^-1 M true_before)`, with
//! `M` the estimated motion over ground, carried into the truth's world by the camera's two poses,
//! so that the camera's drift does not count. Both factors are motions of a rigid body: the
//! difference of two positions in the camera, which the original took, ignores the effect of
//! rotation. The error's translation is that of the middle of the object's foot.

pub mod association;
mod figures;
mod late;
#[cfg(test)]
mod tests;
mod track;

pub use figures::{Medians, ObjectFigures};
pub use late::LateStates;
pub use track::TrackErrors;

use crate::input::{ObjectsTruth, TrueObject};
use association::Association;
use dynvox_core::geometry::Transform;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{MotionState, TrackReport};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Least overlap of a track's box with an object's.
pub const OVERLAP_MIN: f32 = 0.4;
/// Frames a motion state may take to become right.
pub const SETTLING_FRAMES: u32 = 5;
/// Largest distance of a near object, m.
pub const NEAR_M: f64 = 20.0;
/// Largest distance of a far object, m.
pub const FAR_M: f64 = 32.0;

/// Width or height below which an object counts as small, px.
pub const SMALL_PX: i32 = 30;

/// Part of an object that the image shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Visibility {
    /// The object lies within the image and is not small.
    Whole,
    /// Less than [`SMALL_PX`] wide or high.
    Small,
    /// The object touches the image border.
    Cut,
}

impl Visibility {
    /// Name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Small => "small",
            Self::Cut => "cut",
        }
    }

    fn from_box(object: &PixelBox, size: (usize, usize)) -> Self {
        let (right, bottom) = (object.left + object.width, object.top + object.height);
        // A box that touches the border shows an object in part.
        if object.left <= 0 || object.top <= 0 || right >= size.0 as i32 || bottom >= size.1 as i32
        {
            Self::Cut
        } else if object.width < SMALL_PX || object.height < SMALL_PX {
            Self::Small
        } else {
            Self::Whole
        }
    }
}

/// A track in a frame, compared with its true object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackComparison {
    /// The frame's position in the run.
    pub at: usize,
    /// Number of the true object.
    pub truth: u32,
    /// True if the object moves.
    pub moving: bool,
    /// The track's motion state.
    pub state: MotionState,
    /// Frames since the track began and since the true state last changed.
    pub settled: u32,
    /// Distance of the true object along the camera's axis, m.
    pub distance_m: f64,
    /// Part of the true object that is in the image.
    pub view: Visibility,
    /// Error of the motion, m and degrees; `None` where none was estimated or the object was not
    /// there before.
    pub error: Option<[f64; 2]>,
    /// True speed, m/s.
    pub true_speed_m_s: f64,
    /// Estimated speed, m/s.
    pub speed_m_s: Option<f64>,
}

impl TrackComparison {
    /// Returns true once enough frames have passed for the state to be right.
    fn is_due(&self) -> bool {
        self.settled >= SETTLING_FRAMES
    }

    /// Returns true if the state should be right by now and is wrong.
    fn is_late(&self) -> bool {
        self.is_due()
            && self.state != if self.moving { MotionState::Dynamic } else { MotionState::Static }
    }
}

/// Collects errors frame by frame.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct ObjectErrors {
    frame: u32,
    /// Poses of the frame before.
    before: BTreeMap<u32, Transform>,
    /// For each true object whether it moved when last seen, and since which frame.
    truths: BTreeMap<u32, (bool, u32)>,
    tracks: BTreeMap<u32, Vec<TrackComparison>>,
    first_seen: BTreeMap<u32, u32>,
    association: Association,
}

/// Tracks of a frame to compare with the true objects.
pub struct TrackedFrame<'a> {
    /// Tracks seen in it.
    pub tracks: &'a [TrackReport],
    /// Estimated pose of the camera.
    pub t_world_camera: &'a Transform,
    /// True objects and pose.
    pub truth: &'a ObjectsTruth,
    /// Width and height of the images, px.
    pub size: (usize, usize),
}

impl ObjectErrors {
    /// Compares the tracks seen in a frame; call it for every frame. `large_enough` tells which
    /// boxes are large enough for a detection: others do not count as missed.
    pub fn add(
        &mut self,
        &TrackedFrame { tracks, t_world_camera, truth, size }: &TrackedFrame<'_>,
        large_enough: impl Fn(&PixelBox) -> bool,
    ) {
        // Only detected tracks have a box in this frame.
        let boxes: Vec<(u32, PixelBox)> = tracks
            .iter()
            .filter(|track| track.detected)
            .map(|track| (track.id, track.pixels))
            .collect();
        let objects: Vec<_> = truth
            .objects
            .iter()
            .map(|one| (one.id, one.pixels, large_enough(&one.pixels)))
            .collect();
        self.association.add(&boxes, &objects, &truth.unlabelled);
        // Frames are counted here, because runs may begin anywhere.
        let frame = self.frame;
        for object in &truth.objects {
            // An object that starts or stops gets time to be noticed.
            let known = self.truths.entry(object.id).or_insert((object.moving, frame));
            if known.0 != object.moving {
                *known = (object.moving, frame);
            }
        }
        // Motions are compared in the true world, so that the camera's drift does not count.
        let t_true_estimated = truth.t_world_camera * t_world_camera.inverse();
        for track in tracks.iter().filter(|track| track.detected) {
            let Some(object) = true_object(&track.pixels, truth) else { continue };
            let first = *self.first_seen.entry(track.id).or_insert(frame);
            let changed = self.truths.get(&object.id).map_or(frame, |known| known.1);
            // A motion is compared only if the tracker claims one.
            let estimated = track.measured || track.state != MotionState::Uncertain;
            let error = self.before.get(&object.id).filter(|_| estimated).map(|before| {
                let estimate = t_true_estimated * track.motion_world * t_true_estimated.inverse();
                motion_error(before, &object.t_world_object, &estimate)
            });
            self.tracks.entry(track.id).or_default().push(TrackComparison {
                at: frame as usize,
                truth: object.id,
                moving: object.moving,
                state: track.state,
                settled: frame - first.max(changed),
                distance_m: (truth.t_world_camera.inverse() * object.t_world_object).translation_m
                    [2],
                view: Visibility::from_box(&object.pixels, size),
                error,
                true_speed_m_s: object.speed_m_s,
                speed_m_s: track.speed_m_s.map(|[speed, _]| f64::from(speed)),
            });
        }
        // Motions lead from this frame's true poses to the next one's.
        self.before =
            truth.objects.iter().map(|object| (object.id, object.t_world_object)).collect();
        self.frame += 1;
    }

    /// Each track's errors, by its number.
    pub fn tracks(&self) -> BTreeMap<u32, TrackErrors> {
        self.tracks
            .iter()
            .map(|(&id, comparisons)| (id, TrackErrors::from_comparisons(comparisons)))
            .collect()
    }

    /// Every comparison, by frame and then by track.
    pub fn comparisons(&self) -> Vec<(u32, TrackComparison)> {
        let mut rows: Vec<(u32, TrackComparison)> = self
            .tracks
            .iter()
            .flat_map(|(&id, comparisons)| comparisons.iter().map(move |one| (id, *one)))
            .collect();
        rows.sort_by_key(|(id, one)| (one.at, *id));
        rows
    }

    /// Errors over all; `None` when nothing was compared.
    pub fn figures(&self) -> Option<ObjectFigures> {
        ObjectFigures::from_comparisons(&self.tracks, self.association.figures())
    }
}

/// The true object that a box belongs to: the one it overlaps most, at least by [`OVERLAP_MIN`].
pub fn true_object<'t>(pixels: &PixelBox, truth: &'t ObjectsTruth) -> Option<&'t TrueObject> {
    let overlap = |object: &&TrueObject| object.pixels.overlap(pixels);
    truth
        .objects
        .iter()
        .max_by(|a, b| overlap(a).total_cmp(&overlap(b)))
        .filter(|object| overlap(object) >= OVERLAP_MIN)
}

/// Error of a motion over ground in the object's frame: translation in m, rotation in degrees.
fn motion_error(before: &Transform, now: &Transform, motion_world: &Transform) -> [f64; 2] {
    let truth = before.inverse() * now;
    let estimate = before.inverse() * motion_world * before;
    let error = truth.inverse() * estimate;
    [error.distance_m(), error.angle_rad().to_degrees()]
}

/// Root mean square of finite values; `None` of none.
fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values
        .filter(|value| value.is_finite())
        .fold((0.0, 0u32), |(sum, count), value| (sum + value * value, count + 1));
    (count > 0).then(|| (sum / f64::from(count)).sqrt())
}
