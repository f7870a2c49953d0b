//! Tracks frame by frame and over the whole run, and their errors against ground truth.

use super::{Finished, FrameContext, ObserveError, Observer, Setup};
use crate::evaluate::masks::{MovingErrors, MovingFigures, Overlaps};
use crate::evaluate::objects::{ObjectErrors, ObjectFigures, TrackComparison, TrackErrors};
use crate::evaluate::quantile::median;
use crate::formats::Image;
use dynvox_core::Mapper;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{Class, MotionState, TrackReport};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Name of a motion state in tables and files.
pub const fn state_name(state: MotionState) -> &'static str {
    match state {
        MotionState::Uncertain => "uncertain",
        MotionState::Static => "static",
        MotionState::Dynamic => "dynamic",
    }
}

/// A track seen in a frame. 64 bytes, so that a long run may have many.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackRow {
    /// Its number.
    pub id: u32,
    /// Its class.
    pub class: Class,
    /// Its motion state.
    pub state: MotionState,
    /// Whether its motion was measured in this frame.
    pub measured: bool,
    /// Score of its detection.
    pub score: f32,
    /// Its box in the left image.
    pub pixels: PixelBox,
    /// Speed over ground and its error, one sigma, m/s.
    pub speed_m_s: Option<[f32; 2]>,
    /// Matches on it.
    pub matches: u32,
    /// Matches among them that are inliers of its motion.
    pub inliers: u32,
    /// Blocks of its volume.
    pub blocks: u32,
}

const _: () = assert!(size_of::<TrackRow>() <= 64);

impl From<&TrackReport> for TrackRow {
    fn from(track: &TrackReport) -> Self {
        Self {
            id: track.id,
            class: track.class,
            state: track.state,
            measured: track.measured,
            score: track.score,
            pixels: track.pixels,
            speed_m_s: track.speed_m_s,
            matches: track.matches,
            inliers: track.inliers,
            blocks: track.blocks,
        }
    }
}

/// The tracks seen in a frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrameTracks {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Its tracks, by age.
    pub tracks: Vec<TrackRow>,
}

/// A track over the whole run.
#[derive(Clone, Debug)]
pub struct TrackRecord {
    /// Its number.
    pub id: u32,
    /// Its class.
    pub class: Class,
    /// First frame it was seen in, as the data set counts.
    pub first_frame: usize,
    /// Last frame it was seen in.
    pub last_frame: usize,
    /// Frames it was seen in.
    pub frames: usize,
    /// Frames among them in each state: uncertain, static, dynamic.
    pub states: [usize; 3],
    /// The more frequent of static and dynamic; uncertain if it was neither.
    pub state: MotionState,
    /// Median speed over the frames in that state, m/s.
    pub speed_m_s: Option<f64>,
    /// Most blocks of its volume.
    pub blocks: u32,
    /// Against ground truth, where it is known.
    pub errors: Option<TrackErrors>,
}

/// Tracks of a run.
#[derive(Clone, Debug)]
pub struct TracksSection {
    /// Frame by frame.
    pub frames: Vec<FrameTracks>,
    /// Each over the whole run, by number.
    pub tracks: Vec<TrackRecord>,
    /// All against ground truth, where it is known.
    pub figures: Option<ObjectFigures>,
    /// Masks of what moves against exact ones, where these are known.
    pub masks: Option<MovingFigures>,
    /// Every comparison with a true object, by frame and then by track.
    pub comparisons: Vec<(u32, TrackComparison)>,
}

/// Collects tracks.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct TracksObserver {
    frames: Vec<FrameTracks>,
    errors: ObjectErrors,
    masks: MovingErrors,
}

impl Observer for TracksObserver {
    type Section = TracksSection;

    fn frame(&mut self, setup: &Setup<'_>, frame: &mut FrameContext<'_, '_>) -> Result<(), ObserveError> {
        let tracks: Vec<TrackReport> = frame.view.mapper().tracks().filter(|track| track.detected).collect();
        if let Some(truth) = &frame.images.objects {
            let size = setup.dataset.size();
            let large_enough = |pixels: &PixelBox| setup.config.tracking.is_reconstructable(pixels.area(), size.0);
            self.errors.add(&tracks, &frame.row.report.t_world_camera, truth, size, large_enough);
            if let Some(exact) = &frame.images.exact {
                let (overlaps, by_motion) = overlaps(frame.view.mapper(), &exact.instances);
                let large_enough = |pixels: u64| setup.config.tracking.is_trackable(pixels as i64, size.0);
                self.masks.add(&overlaps, &truth.objects, &truth.t_world_camera, large_enough, |label| by_motion.contains(&label));
            }
        }
        self.frames.push(FrameTracks { frame: frame.row.frame, tracks: tracks.iter().map(TrackRow::from).collect() });
        Ok(())
    }

    fn finish(self, _: &Setup<'_>, _: &Finished<'_>) -> Result<TracksSection, ObserveError> {
        Ok(TracksSection {
            tracks: track_records(&self.frames, &self.errors.tracks()),
            figures: self.errors.figures(),
            masks: self.masks.figures(),
            comparisons: self.errors.comparisons(),
            frames: self.frames,
        })
    }
}

/// Overlaps of this frame's instances with the exact masks, and the labels of those found by motion. Labels number the instances.
fn overlaps(mapper: &Mapper<'_>, exact: &Image<u8>) -> (Overlaps, BTreeSet<u16>) {
    let (mut labels, mut by_motion) = (BTreeMap::<(Option<u32>, Class), u16>::new(), BTreeSet::new());
    let width = exact.width();
    let overlaps = Overlaps::of(exact.pixels().iter().enumerate().map(|(at, truth)| {
        let found = mapper.instance_at((at % width) as i32, (at / width) as i32).map_or(0, |instance| {
            let next = labels.len() as u16 + 1;
            *labels.entry((instance.track, instance.class)).or_insert(next)
        });
        (found, u16::from(*truth))
    }));
    let moving = labels.iter().filter(|((_, class), _)| *class == Class::MovingObject);
    by_motion.extend(moving.map(|(_, label)| *label));
    (overlaps, by_motion)
}

/// Every track over all frames.
fn track_records(frames: &[FrameTracks], errors: &BTreeMap<u32, TrackErrors>) -> Vec<TrackRecord> {
    let mut seen = BTreeMap::<u32, Vec<(usize, &TrackRow)>>::new();
    for (frame, track) in frames.iter().flat_map(|frame| frame.tracks.iter().map(|track| (frame.frame, track))) {
        seen.entry(track.id).or_default().push((frame, track));
    }
    let record = |(id, seen): (u32, Vec<(usize, &TrackRow)>)| {
        let of = |state: MotionState| seen.iter().filter(move |(_, track)| track.state == state);
        let states = [MotionState::Uncertain, MotionState::Static, MotionState::Dynamic].map(|state| of(state).count());
        let state = match states {
            [_, 0, 0] => MotionState::Uncertain,
            [_, still, moving] if moving > still => MotionState::Dynamic,
            _ => MotionState::Static,
        };
        let (first, last) = (seen.first()?, seen.last()?);
        Some(TrackRecord {
            id,
            class: last.1.class,
            first_frame: first.0,
            last_frame: last.0,
            frames: seen.len(),
            states,
            state,
            speed_m_s: median(of(state).filter_map(|(_, track)| track.speed_m_s.map(|[speed, _]| f64::from(speed)))),
            blocks: seen.iter().map(|(_, track)| track.blocks).max().unwrap_or_default(),
            errors: errors.get(&id).cloned(),
        })
    };
    seen.into_iter().filter_map(record).collect()
}
