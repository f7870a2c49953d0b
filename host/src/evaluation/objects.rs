//! Tracks against truth: states, motions, speeds.
//!
//! A track seen in a frame belongs to the true thing whose box its own overlaps most, at least by [`OVERLAP_MIN`]. Its motion since the last
//! frame is compared in the thing's own frame: `E = (true_before^-1 true_now)^-1 (true_before^-1 M true_before)`, with `M` the estimated
//! motion over ground, carried into the truth's world by the camera's two poses, so that the camera's drift does not count. The error's
//! translation is that of the middle of the thing's foot.

use crate::dataset::ObjectsTruth;
use dynvox_core::geometry::Transform;
use dynvox_core::instances::{State, TrackReport};
use serde::Serialize;
use std::collections::BTreeMap;

/// Least overlap of a track's box with a thing's.
pub const OVERLAP_MIN: f32 = 0.4;
/// Frames a state may take to become right.
pub const SETTLING_FRAMES: u32 = 5;
/// Up to where a thing is near, and up to where it is far, m.
pub const NEAR_M: f64 = 20.0;
/// See [`NEAR_M`].
pub const FAR_M: f64 = 32.0;

/// A track in a frame, against its truth.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Judged {
    truth: u32,
    moving: bool,
    state: State,
    /// Frames since it was first seen and since the truth last changed.
    settled: u32,
    distance_m: f64,
    /// Error of the motion, m and degrees.
    error: Option<[f64; 2]>,
    true_speed_m_s: f64,
    speed_m_s: Option<f64>,
}

/// A track's errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackErrors {
    /// The true thing it belongs to in most frames.
    pub truth: u32,
    /// Frames compared.
    pub frames: usize,
    /// Frames by truth (static, dynamic) and state (uncertain, static, dynamic).
    pub confusion: [[u32; 3]; 2],
    /// Frames in which the state was not the true one although it had time to settle, within [`FAR_M`].
    pub late_frames: u32,
    /// Changes from static to dynamic or back while the truth stayed the same.
    pub flips: u32,
    /// Median translation error of the motion of a frame, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub me_t_m: Option<f64>,
    /// Median rotation error, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub me_r_deg: Option<f64>,
    /// Median true speed, m/s.
    pub true_speed_m_s: f64,
    /// Median of the speed's error over the frames in which it is called dynamic, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_error_m_s: Option<f64>,
    /// Least distance, m.
    pub nearest_m: f64,
}

/// Errors over all tracks.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ObjectFigures {
    /// Tracks that belong to a true thing.
    pub tracks: usize,
    /// Frames by truth (static, dynamic) and state (uncertain, static, dynamic).
    pub confusion: [[u32; 3]; 2],
    /// Tracks with a state not right in time, within [`FAR_M`].
    pub tracks_late: usize,
    /// Changes between static and dynamic of things that did not change.
    pub flips: u32,
    /// Moving things within [`NEAR_M`]: frames, median translation error (m) and rotation error (degrees).
    pub moving_near: Medians,
    /// Moving things from [`NEAR_M`] to [`FAR_M`].
    pub moving_far: Medians,
    /// Standing things within [`NEAR_M`].
    pub standing_near: Medians,
    /// Most frames for which a standing thing was called dynamic.
    pub false_dynamic_frames: u32,
}

/// Median errors of motions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Medians {
    /// Motions compared.
    pub frames: usize,
    /// Translation, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t_m: Option<f64>,
    /// Rotation, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r_deg: Option<f64>,
}

/// Collects errors frame by frame.
#[derive(Debug, Default)]
pub struct ObjectErrors {
    frame: u32,
    /// Poses of the frame before.
    before: BTreeMap<u32, Transform>,
    /// For each true thing whether it moved when last seen, and since which frame.
    truths: BTreeMap<u32, (bool, u32)>,
    tracks: BTreeMap<u32, Vec<Judged>>,
    first_seen: BTreeMap<u32, u32>,
}

impl ObjectErrors {
    /// Compares the tracks seen in a frame; call it for every frame.
    pub fn add(&mut self, tracks: &[TrackReport], t_world_camera: &Transform, truth: &ObjectsTruth) {
        let frame = self.frame;
        for object in &truth.objects {
            let known = self.truths.entry(object.id).or_insert((object.moving, frame));
            if known.0 != object.moving {
                *known = (object.moving, frame);
            }
        }
        let t_true_estimated = truth.t_world_camera * t_world_camera.inverse();
        for track in tracks.iter().filter(|track| track.seen) {
            let overlap = |object: &&crate::dataset::TrueObject| object.pixels.overlap(&track.pixels);
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
                truth: object.id,
                moving: object.moving,
                state: track.state,
                settled: frame - first.max(changed),
                distance_m: (truth.t_world_camera.inverse() * object.t_world_object).translation.vector.z,
                error,
                true_speed_m_s: object.speed_m_s,
                speed_m_s: track.speed_m_s.map(|[speed, _]| f64::from(speed)),
            });
        }
        self.before = truth.objects.iter().map(|object| (object.id, object.t_world_object)).collect();
        self.frame += 1;
    }

    /// Each track's errors, by its number.
    pub fn tracks(&self) -> BTreeMap<u32, TrackErrors> {
        self.tracks.iter().map(|(&id, judged)| (id, track_errors(judged))).collect()
    }

    /// Errors over all; `None` when nothing was compared.
    pub fn figures(&self) -> Option<ObjectFigures> {
        let tracks = self.tracks();
        let all = || self.tracks.values().flatten();
        let medians = |moving: bool, from_m: f64, to_m: f64| {
            let within = all().filter(|one| one.moving == moving && (from_m..to_m).contains(&one.distance_m));
            let errors: Vec<[f64; 2]> = within.filter_map(|one| one.error).collect();
            let of = |at: usize| median(errors.iter().map(|error| error[at]));
            Medians { frames: errors.len(), t_m: of(0), r_deg: of(1) }
        };
        let mut figures = ObjectFigures {
            tracks: tracks.len(),
            tracks_late: tracks.values().filter(|track| track.late_frames > 0).count(),
            flips: tracks.values().map(|track| track.flips).sum(),
            moving_near: medians(true, 0.0, NEAR_M),
            moving_far: medians(true, NEAR_M, FAR_M),
            standing_near: medians(false, 0.0, NEAR_M),
            false_dynamic_frames: tracks.values().map(|track| track.confusion[0][2]).max().unwrap_or_default(),
            ..ObjectFigures::default()
        };
        for (sum, counts) in tracks.values().flat_map(|track| track.confusion.iter().enumerate()) {
            figures.confusion[sum].iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        }
        (!tracks.is_empty()).then_some(figures)
    }
}

/// Error of a motion over ground in the thing's frame: translation in m, rotation in degrees.
fn motion_error(before: &Transform, now: &Transform, motion_world: &Transform) -> [f64; 2] {
    let truth = before.inverse() * now;
    let estimate = before.inverse() * motion_world * before;
    let error = truth.inverse() * estimate;
    let q = error.rotation.quaternion();
    [error.translation.vector.norm(), (2.0 * q.imag().norm().atan2(q.w.abs())).to_degrees()]
}

fn track_errors(judged: &[Judged]) -> TrackErrors {
    let mut confusion = [[0; 3]; 2];
    let mut votes = BTreeMap::<u32, usize>::new();
    let (mut late_frames, mut flips) = (0, 0);
    let mut last: Option<&Judged> = None;
    for one in judged {
        let state = match one.state {
            State::Uncertain => 0,
            State::Static => 1,
            State::Dynamic => 2,
        };
        confusion[usize::from(one.moving)][state] += 1;
        *votes.entry(one.truth).or_default() += 1;
        let right = one.state == if one.moving { State::Dynamic } else { State::Static };
        late_frames += u32::from(!right && one.settled >= SETTLING_FRAMES && one.distance_m < FAR_M);
        if one.state != State::Uncertain {
            let same = |before: &&Judged| before.truth == one.truth && before.moving == one.moving && one.settled >= SETTLING_FRAMES;
            flips += u32::from(last.filter(same).is_some_and(|before| before.state != one.state));
            last = Some(one);
        }
    }
    let dynamic = judged.iter().filter(|one| one.state == State::Dynamic);
    TrackErrors {
        truth: votes.into_iter().max_by_key(|&(_, count)| count).map_or(0, |(truth, _)| truth),
        frames: judged.len(),
        confusion,
        late_frames,
        flips,
        me_t_m: median(judged.iter().filter_map(|one| Some(one.error?[0]))),
        me_r_deg: median(judged.iter().filter_map(|one| Some(one.error?[1]))),
        true_speed_m_s: median(judged.iter().map(|one| one.true_speed_m_s)).unwrap_or_default(),
        speed_error_m_s: median(dynamic.filter_map(|one| Some(one.speed_m_s? - one.true_speed_m_s))),
        nearest_m: judged.iter().map(|one| one.distance_m).fold(f64::MAX, f64::min),
    }
}

/// Median of finite values, the higher of the two in the middle; `None` of none.
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::TrueObject;
    use dynvox_core::geometry::exp;
    use dynvox_core::instances::{Class, PixelBox};
    use nalgebra::Vector3;

    const PIXELS: PixelBox = PixelBox { left: 100, top: 50, width: 80, height: 40 };

    fn truth(frame: u32, moving: bool) -> ObjectsTruth {
        // The camera drives and turns; the car drives 1 m a frame and turns by 0.02 rad.
        let f = f64::from(frame);
        let along = if moving { exp(Vector3::new(0.0, 0.02, 0.0) * f, Vector3::new(0.0, 0.0, 1.0) * f) } else { Transform::identity() };
        let object = TrueObject {
            id: 7,
            pixels: PIXELS,
            t_world_object: Transform::translation(3.0, 1.6, 12.0) * along,
            dimensions_m: [1.8, 1.5, 4.0],
            moving,
            speed_m_s: if moving { 10.0 } else { 0.0 },
        };
        ObjectsTruth {
            t_world_camera: exp(Vector3::new(0.0, 0.01, 0.0) * f, Vector3::new(0.0, 0.0, 0.8) * f),
            objects: vec![object],
        }
    }

    fn track(state: State, motion_world: Transform) -> TrackReport {
        TrackReport {
            id: 1,
            class: Class::Car,
            state,
            score: 1.0,
            seen: true,
            first_frame: 0,
            last_frame: 0,
            sightings: 1,
            pixels: PIXELS,
            speed_m_s: Some([10.5, 0.1]),
            measured: true,
            center_world_m: [0.0; 3],
            motion_world,
            t_world_object: None,
            matches: 50,
            inliers: 40,
            blocks: 0,
        }
    }

    /// Feeds a drive in which the estimated world is the true one moved by `drift`, and each motion is off by `error` in the car's frame.
    fn drive(states: &[State], moving: &[bool], drift: &Transform, error: &Transform) -> ObjectErrors {
        let mut errors = ObjectErrors::default();
        for (at, (&state, &moving)) in states.iter().zip(moving).enumerate() {
            let frame = at as u32;
            let now = truth(frame, moving);
            let before = truth(frame.saturating_sub(1), moving).objects[0].t_world_object;
            let motion = before * (before.inverse() * now.objects[0].t_world_object * error) * before.inverse();
            errors.add(&[track(state, drift * motion * drift.inverse())], &(drift * now.t_world_camera), &now);
        }
        errors
    }

    #[test]
    fn a_motion_off_by_two_centimetres_has_that_error_wherever_the_camera_believes_to_be() {
        let drift = exp(Vector3::new(0.1, -0.4, 0.05), Vector3::new(30.0, -2.0, 11.0));
        let off = exp(Vector3::new(0.0, 0.001, 0.0), Vector3::new(0.02, 0.0, 0.0));
        let errors = drive(&[State::Dynamic; 8], &[true; 8], &drift, &off).tracks()[&1].clone();
        assert!((errors.me_t_m.unwrap() - 0.02).abs() < 1e-4, "{errors:?}");
        assert!((errors.me_r_deg.unwrap() - 0.001f64.to_degrees()).abs() < 1e-6);
        assert!((errors.speed_error_m_s.unwrap() - 0.5).abs() < 1e-5);
        assert_eq!((errors.truth, errors.frames, errors.confusion), (7, 8, [[0; 3], [0, 0, 8]]));
    }

    #[test]
    fn a_state_may_take_five_frames_and_no_more() {
        use State::{Dynamic as D, Static as S, Uncertain as U};
        let of =
            |states: &[State], moving: &[bool]| drive(states, moving, &Transform::identity(), &Transform::identity()).tracks()[&1].clone();
        let (m, s) = (true, false);
        assert_eq!(of(&[U, U, U, U, U, D, D], &[m; 7]).late_frames, 0);
        assert_eq!(of(&[U, U, U, U, U, U, D], &[m; 7]).late_frames, 1);
        let starting = of(&[S, S, S, S, S, S, S, U, D, D], &[s, s, s, s, s, m, m, m, m, m]);
        assert_eq!((starting.late_frames, starting.flips), (0, 0), "{starting:?}");
        let flickering = of(&[S, S, S, S, S, S, D, S, U, D], &[s; 10]);
        assert_eq!((flickering.late_frames, flickering.flips, flickering.confusion[0]), (3, 3, [1, 7, 2]));
    }

    #[test]
    fn what_overlaps_nothing_true_is_not_compared() {
        let mut errors = ObjectErrors::default();
        let elsewhere = TrackReport { pixels: PIXELS.moved([70, 0]), ..track(State::Dynamic, Transform::identity()) };
        let unseen = TrackReport { seen: false, ..track(State::Dynamic, Transform::identity()) };
        errors.add(&[elsewhere, unseen], &Transform::identity(), &truth(0, true));
        assert!(errors.tracks().is_empty() && errors.figures().is_none());
    }
}
