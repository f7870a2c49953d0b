//! Tracks against truth: states, motions, speeds, and how well they stay with their things.
//!
//! A track seen in a frame belongs to the true thing whose box its own overlaps most, at least by [`OVERLAP_MIN`]. Its motion since the last
//! frame is compared in the thing's own frame, as DynoSAM's *motion error* (Morris, Wang, Kliniewski, Ila, *DynoSAM*, 2025; before it Zhang et al.,
//! *VDO-SLAM*, 2020): `E = (true_before^-1 true_now)^-1 (true_before^-1 M true_before)`, with `M` the estimated motion over ground, carried into the
//! truth's world by the camera's two poses, so that the camera's drift does not count. Both factors are motions of a rigid body: the difference
//! of two places in the camera, which the original took, lacks what a turn does to a place. The error's translation is that of the middle of
//! the thing's foot.

pub mod association;
mod figures;
mod late;
#[cfg(test)]
mod tests;
mod track;

pub use figures::{Medians, ObjectFigures};
pub use late::Late;
pub use track::TrackErrors;

use crate::input::{ObjectsTruth, TrueObject};
use association::Association;
use dynvox_core::geometry::Transform;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{State, TrackReport};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Least overlap of a track's box with a thing's.
pub const OVERLAP_MIN: f32 = 0.4;
/// Frames a state may take to become right.
pub const SETTLING_FRAMES: u32 = 5;
/// Up to where a thing is near, and up to where it is far, m.
pub const NEAR_M: f64 = 20.0;
/// See [`NEAR_M`].
pub const FAR_M: f64 = 32.0;

/// Width or height below which little can be known of a thing, px.
pub const SMALL_PX: i32 = 30;

/// How much of a thing a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Showing {
    /// All that nothing hides, and enough of it.
    Whole,
    /// Less than [`SMALL_PX`] of it across or down.
    Small,
    /// It reaches the picture's border.
    Cut,
}

impl Showing {
    /// Name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Small => "small",
            Self::Cut => "cut",
        }
    }

    fn of(thing: &PixelBox, size: (usize, usize)) -> Self {
        let (right, bottom) = (thing.left + thing.width, thing.top + thing.height);
        if thing.left <= 0 || thing.top <= 0 || right >= size.0 as i32 || bottom >= size.1 as i32 {
            Self::Cut
        } else if thing.width < SMALL_PX || thing.height < SMALL_PX {
            Self::Small
        } else {
            Self::Whole
        }
    }
}

/// A track in a frame, against its truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// The frame's position in the run.
    pub at: usize,
    /// Number of the true thing.
    pub truth: u32,
    /// Whether it moves.
    pub moving: bool,
    /// What the track's state is.
    pub state: State,
    /// Frames since it was first seen and since the truth last changed.
    pub settled: u32,
    /// Distance of the true thing along the camera's axis, m.
    pub distance_m: f64,
    /// How much of the true thing is in the picture.
    pub view: Showing,
    /// Error of the motion, m and degrees; `None` where none was estimated or the thing was not there before.
    pub error: Option<[f64; 2]>,
    /// True speed, m/s.
    pub true_speed_m_s: f64,
    /// Estimated speed, m/s.
    pub speed_m_s: Option<f64>,
}

impl Judged {
    /// Whether the state has had its time to settle.
    fn is_due(&self) -> bool {
        self.settled >= SETTLING_FRAMES
    }

    /// Whether the state is due and not the true one.
    fn is_late(&self) -> bool {
        self.is_due() && self.state != if self.moving { State::Dynamic } else { State::Static }
    }
}

/// Collects errors frame by frame.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct ObjectErrors {
    frame: u32,
    /// Poses of the frame before.
    before: BTreeMap<u32, Transform>,
    /// For each true thing whether it moved when last seen, and since which frame.
    truths: BTreeMap<u32, (bool, u32)>,
    tracks: BTreeMap<u32, Vec<Judged>>,
    first_seen: BTreeMap<u32, u32>,
    association: Association,
}

impl ObjectErrors {
    /// Compares the tracks seen in a frame, whose images have `size`; call it for every frame. `large_enough` tells which boxes are large
    /// enough for a detection: of others it is no fault to miss them.
    pub fn add(
        &mut self,
        tracks: &[TrackReport],
        t_world_camera: &Transform,
        truth: &ObjectsTruth,
        size: (usize, usize),
        large_enough: impl Fn(&PixelBox) -> bool,
    ) {
        let boxes: Vec<(u32, PixelBox)> = tracks.iter().filter(|track| track.seen).map(|track| (track.id, track.pixels)).collect();
        let things: Vec<_> = truth.objects.iter().map(|one| (one.id, one.pixels, large_enough(&one.pixels))).collect();
        self.association.add(&boxes, &things, &truth.unlabelled);
        let frame = self.frame;
        for object in &truth.objects {
            let known = self.truths.entry(object.id).or_insert((object.moving, frame));
            if known.0 != object.moving {
                *known = (object.moving, frame);
            }
        }
        let t_true_estimated = truth.t_world_camera * t_world_camera.inverse();
        for track in tracks.iter().filter(|track| track.seen) {
            let overlap = |object: &&TrueObject| object.pixels.overlap(&track.pixels);
            let best = truth.objects.iter().max_by(|a, b| overlap(a).total_cmp(&overlap(b)));
            let Some(object) = best.filter(|object| overlap(object) >= OVERLAP_MIN) else { continue };
            let first = *self.first_seen.entry(track.id).or_insert(frame);
            let changed = self.truths.get(&object.id).map_or(frame, |known| known.1);
            let estimated = track.measured || track.state != State::Uncertain;
            let error = self.before.get(&object.id).filter(|_| estimated).map(|before| {
                let estimate = t_true_estimated * track.motion_world * t_true_estimated.inverse();
                motion_error(before, &object.t_world_object, &estimate)
            });
            self.tracks.entry(track.id).or_default().push(Judged {
                at: frame as usize,
                truth: object.id,
                moving: object.moving,
                state: track.state,
                settled: frame - first.max(changed),
                distance_m: (truth.t_world_camera.inverse() * object.t_world_object).translation_m[2],
                view: Showing::of(&object.pixels, size),
                error,
                true_speed_m_s: object.speed_m_s,
                speed_m_s: track.speed_m_s.map(|[speed, _]| f64::from(speed)),
            });
        }
        self.before = truth.objects.iter().map(|object| (object.id, object.t_world_object)).collect();
        self.frame += 1;
    }

    /// The true thing a track belongs to in the frame added last.
    pub fn truth_of(&self, track: u32) -> Option<u32> {
        self.tracks.get(&track)?.last().filter(|judged| judged.at + 1 == self.frame as usize).map(|judged| judged.truth)
    }

    /// Each track's errors, by its number.
    pub fn tracks(&self) -> BTreeMap<u32, TrackErrors> {
        self.tracks.iter().map(|(&id, judged)| (id, TrackErrors::of(judged))).collect()
    }

    /// Every comparison, by frame and then by track.
    pub fn rows(&self) -> Vec<(u32, Judged)> {
        let mut rows: Vec<(u32, Judged)> = self.tracks.iter().flat_map(|(&id, judged)| judged.iter().map(move |one| (id, *one))).collect();
        rows.sort_by_key(|(id, one)| (one.at, *id));
        rows
    }

    /// Errors over all; `None` when nothing was compared.
    pub fn figures(&self) -> Option<ObjectFigures> {
        ObjectFigures::of(&self.tracks, self.association.figures())
    }
}

/// Error of a motion over ground in the thing's frame: translation in m, rotation in degrees.
fn motion_error(before: &Transform, now: &Transform, motion_world: &Transform) -> [f64; 2] {
    let truth = before.inverse() * now;
    let estimate = before.inverse() * motion_world * before;
    let error = truth.inverse() * estimate;
    [error.distance_m(), error.angle_rad().to_degrees()]
}

/// Median of finite values, the higher of the two in the middle; `None` of none.
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Root mean square of finite values; `None` of none.
fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.filter(|value| value.is_finite()).fold((0.0, 0u32), |(sum, count), value| (sum + value * value, count + 1));
    (count > 0).then(|| (sum / f64::from(count)).sqrt())
}
