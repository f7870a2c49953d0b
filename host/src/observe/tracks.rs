//! Tracks frame by frame and over the whole run, and their errors against ground truth.

mod sums;

use super::tables::track_rows;
use super::{Finished, FrameContext, GrowingFile, ObserveError, ObservedRun, Observer};
use crate::evaluate::masks::{ComparedMasks, MovingErrors, MovingFigures, Overlaps};
use crate::evaluate::objects::{
    ObjectErrors, ObjectFigures, TrackComparison, TrackErrors, TrackedFrame,
};
use crate::formats::{Image, TRACKS_FILE};
use dynvox_core::Mapper;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{Class, MotionState, TrackReport};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use sums::TrackSums;

/// Name of a motion state in tables and files.
pub const fn state_name(state: MotionState) -> &'static str {
    match state {
        MotionState::Uncertain => "uncertain",
        MotionState::Static => "static",
        MotionState::Dynamic => "dynamic",
    }
}

/// A track seen in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackRow {
    /// Id of the track.
    pub id: u32,
    /// Class of the object.
    pub class: Class,
    /// Motion state of the track.
    pub state: MotionState,
    /// True if the motion was measured in this frame.
    pub measured: bool,
    /// Score of its detection.
    pub score: f32,
    /// Box in the left image, px.
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

/// A track's frames in a row that look alike in the report.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackSpan {
    /// Position of the first frame in the run.
    pub from: usize,
    /// Position after the last one.
    pub to: usize,
    /// The motion state.
    pub state: MotionState,
    /// True if the motion was measured.
    pub measured: bool,
    /// Speed over ground in the last of them, m/s.
    pub speed_m_s: Option<f32>,
}

/// A track over the whole run.
#[derive(Clone, Debug)]
pub struct TrackRecord {
    /// Id of the track.
    pub id: u32,
    /// Class of the object.
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
    /// Spans of frames in which the track's state stayed the same.
    pub spans: Vec<TrackSpan>,
    /// Against ground truth, where it is known.
    pub errors: Option<TrackErrors>,
}

/// Tracks of a run.
#[derive(Clone, Debug)]
pub struct TracksSection {
    /// Each over the whole run, by number.
    pub tracks: Vec<TrackRecord>,
    /// All against ground truth, where it is known.
    pub figures: Option<ObjectFigures>,
    /// Masks of what moves against exact ones, where these are known.
    pub masks: Option<MovingFigures>,
    /// Every comparison with a true object, by frame and then by track.
    pub comparisons: Vec<(u32, TrackComparison)>,
    /// Numbers of the frames compared, by position.
    pub compared_frames: Vec<usize>,
}

/// Collects tracks: their rows go to `tracks.csv`.
#[derive(Debug, Serialize, Deserialize)]
pub struct TracksObserver {
    file: GrowingFile,
    frames: usize,
    tracks: BTreeMap<u32, TrackSums>,
    errors: ObjectErrors,
    compared_frames: Vec<usize>,
    masks: MovingErrors,
}

impl Default for TracksObserver {
    fn default() -> Self {
        Self {
            file: GrowingFile::new(TRACKS_FILE),
            frames: 0,
            tracks: BTreeMap::new(),
            errors: ObjectErrors::default(),
            compared_frames: Vec::new(),
            masks: MovingErrors::default(),
        }
    }
}

impl Observer for TracksObserver {
    type Section = TracksSection;

    fn files(&mut self) -> Vec<&mut GrowingFile> {
        vec![&mut self.file]
    }

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        // Tracks without a detection in this frame have no box to compare.
        let tracks: Vec<TrackReport> =
            frame.view.mapper().tracks().filter(|track| track.detected).collect();
        if let Some(truth) = &frame.images.objects {
            let size = run.plan.dataset.size();
            let large_enough = |pixels: &PixelBox| {
                run.plan.config.tracking.instances.is_reconstructable(pixels.area(), size.0)
            };
            let t_world_camera = &frame.row.report.t_world_camera;
            let compared = TrackedFrame { tracks: &tracks, t_world_camera, truth, size };
            self.errors.add(&compared, large_enough);
            self.compared_frames.push(frame.row.frame);
            // With exact instances masks are compared as well.
            if let Some(exact) = &frame.images.exact {
                let (overlaps, by_motion) = overlaps(frame.view.mapper(), &exact.instances);
                let large_enough = |pixels: u64| {
                    run.plan.config.tracking.instances.is_trackable(pixels as i64, size.0)
                };
                let compared = ComparedMasks {
                    overlaps: &overlaps,
                    objects: &truth.objects,
                    t_world_camera: &truth.t_world_camera,
                };
                self.masks.add(&compared, large_enough, |label| by_motion.contains(&label));
            }
        }
        let rows: Vec<TrackRow> = tracks.iter().map(TrackRow::from).collect();
        let text = track_rows(frame.row.frame, &rows, self.file.is_empty());
        self.file.append(
            &text.map_err(|source| ObserveError::Write {
                path: self.file.path(&run.folder),
                source,
            })?,
        );
        // Sums over the run, which end in the summary.
        for row in &rows {
            let sums =
                self.tracks.entry(row.id).or_insert_with(|| TrackSums::begin(frame.row.frame));
            sums.add(frame.row.frame, self.frames, row);
        }
        self.frames += 1;
        Ok(())
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<TracksSection, ObserveError> {
        // By the track's id; a track that no true object was near has none.
        let errors = self.errors.tracks();
        Ok(TracksSection {
            tracks: self
                .tracks
                .into_iter()
                .map(|(id, sums)| sums.record(id, errors.get(&id)))
                .collect(),
            figures: self.errors.figures(),
            masks: self.masks.figures(),
            comparisons: self.errors.comparisons(),
            compared_frames: self.compared_frames,
        })
    }
}

/// Overlaps of this frame's instances with the exact masks, and the labels of those found by
/// motion. Labels number the instances.
fn overlaps(mapper: &Mapper<'_>, exact: &Image<u8>) -> (Overlaps, BTreeSet<u16>) {
    let (mut labels, mut by_motion) =
        (BTreeMap::<(Option<u32>, Class), u16>::new(), BTreeSet::new());
    let width = exact.width();
    let overlaps = Overlaps::from_pairs(exact.pixels().iter().enumerate().map(|(at, truth)| {
        let found =
            mapper.instance_at((at % width) as i32, (at / width) as i32).map_or(0, |instance| {
                // Pixels of one track and class have one label, those without a track one for
                // each class.
                let next = labels.len() as u16 + 1;
                *labels.entry((instance.track, instance.class)).or_insert(next)
            });
        (found, u16::from(*truth))
    }));
    // Found by motion are those of this class, which no detector gives.
    let moving = labels.iter().filter(|((_, class), _)| *class == Class::MovingObject);
    by_motion.extend(moving.map(|(_, label)| *label));
    (overlaps, by_motion)
}
