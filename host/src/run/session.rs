//! A run under way: read, step, observe.

use super::checkpoint::{self, Checkpoint, ResumeError};
use super::disk_store::{BLOCKS_FILE, DiskStore};
use super::error::{RunError, refused, step_reason};
use super::state::RunState;
use super::view::LiveMap;
use super::{FolderError, Plan, Progress, RunFolder, Threads, read_ahead, resident_bytes};
use crate::input::InstanceMask;
use crate::input::StereoImages;
use crate::observe::{EndContext, FrameContext, FrameRow, Observer, RetiredVolume, STAGES, Setup, StageTime, VolumeCopy, from_first};
use dynvox_core::geometry::Transform;
use dynvox_core::objects::{ObjectSink, RetiredObject};
use dynvox_core::tracking::{Detection, MotionState};
use dynvox_core::volume::PruneReport;
use dynvox_core::{Mapper, Report, Severity, Stage, StereoFrame};
use std::time::Instant;

/// A run under way.
pub(super) struct Session<'p, 's> {
    plan: &'p Plan,
    folder: &'p RunFolder,
    pub setup: Setup<'p>,
    pub mapper: Mapper<'s>,
    threads: Threads,
    pub store: DiskStore,
    /// Given poses, the first at the origin.
    poses: Option<Vec<Transform>>,
    pub state: RunState,
    /// Time before this is in the timers.
    pub since: Instant,
}

/// Copies the objects that leave during a step.
#[derive(Default)]
struct RetiredVolumes(Vec<RetiredVolume>);

impl ObjectSink for RetiredVolumes {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        self.0.push(RetiredVolume { summary: object.summary, volume: VolumeCopy::of(object.volume) });
    }
}

impl<'p, 's> Session<'p, 's> {
    /// At the first frame.
    pub fn begin(plan: &'p Plan, folder: &'p RunFolder, slab: &'s mut [u8]) -> Result<Self, RunError> {
        let since = Instant::now();
        let mapper = Mapper::new(&plan.capacity, &plan.config, slab).map_err(|error| refused(&plan.profile, error))?;
        let store = DiskStore::begin(plan.streaming, folder, &plan.config).map_err(RunError::Store)?;
        Self::with(plan, folder, mapper, store, RunState::default(), since)
    }

    /// After the last frame of a checkpoint.
    pub fn resume(plan: &'p Plan, folder: &'p RunFolder, slab: &'s mut [u8], mut checkpoint: Checkpoint) -> Result<Self, RunError> {
        let since = Instant::now();
        let store = DiskStore::resume(plan.streaming, folder, &plan.config, checkpoint.blocks.as_ref()).map_err(RunError::Reopen)?;
        let mapper = checkpoint.mapper(plan, slab)?;
        let mut session = Self::with(plan, folder, mapper, store, checkpoint.state, since)?;
        session.check_last_frame()?;
        session.state.observers.resume(&session.setup)?;
        Ok(session)
    }

    fn with(
        plan: &'p Plan,
        folder: &'p RunFolder,
        mapper: Mapper<'s>,
        store: DiskStore,
        state: RunState,
        since: Instant,
    ) -> Result<Self, RunError> {
        Ok(Self {
            plan,
            folder,
            setup: plan.setup(folder),
            mapper,
            threads: Threads::new(plan.threads).map_err(|source| RunError::Threads { count: plan.threads, source })?,
            store,
            poses: plan.poses.as_ref().map(|poses| from_first(poses, &(0..poses.len()).collect::<Vec<_>>())),
            state,
            since,
        })
    }

    /// Refuses a data set whose last mapped frame changed since the checkpoint.
    fn check_last_frame(&self) -> Result<(), RunError> {
        let Some((at, row)) = self.state.rows.iter().enumerate().next_back() else { return Ok(()) };
        let images = self.plan.dataset.frame(row.frame)?;
        let detections: Vec<_> = images.masks.instances.iter().map(InstanceMask::detection).collect();
        let digest = self.stereo_frame(at, &images, &detections).map(|frame| frame.digest());
        if digest == Some(row.report.digests.input) {
            return Ok(());
        }
        Err(ResumeError::Different { differences: format!("frame {} of the data set has changed", row.frame) }.into())
    }

    /// The mapper's input at position `at`; `None` where an image is empty.
    fn stereo_frame<'f>(&self, at: usize, images: &'f StereoImages, detections: &'f [Detection<'f>]) -> Option<StereoFrame<'f>> {
        Some(StereoFrame {
            left: images.left.view()?,
            right: images.right.view()?,
            colour: images.colour.as_ref().and_then(|colour| colour.view()),
            class: None,
            disparity_q8: images.depth.as_ref().and_then(|depth| depth.disparity_q8.view()),
            t_world_camera: self.poses.as_ref().and_then(|poses| poses.get(at).copied()),
            time_ns: self.plan.indices.get(at).and_then(|&index| self.plan.dataset.stamp_ns(index)),
            detections,
        })
    }

    /// Maps the remaining frames.
    pub fn frames(&mut self) -> Result<(), RunError> {
        let (frames, done) = (self.plan.indices.len(), self.state.rows.len());
        let progress = Progress::new(frames, self.plan.quiet);
        let remaining = self.plan.indices.get(done..).unwrap_or_default();
        let mapped = read_ahead(self.plan.dataset.as_ref(), remaining, |decoded| {
            for (at, (index, images)) in (done..).zip(decoded.iter()) {
                self.frame(at, index, &images?, &progress)?;
                if let Some(row) = self.state.rows.last().filter(|_| at == done).cloned() {
                    // Memory for all rows is taken now, so that growth during the run is a leak.
                    self.state.rows.resize(frames, row);
                    self.state.rows.truncate(at + 1);
                }
            }
            Ok(())
        });
        progress.finish();
        mapped
    }

    /// Steps, observes, and writes a checkpoint where one is due.
    fn frame(&mut self, at: usize, index: usize, images: &StereoImages, progress: &Progress) -> Result<(), RunError> {
        let stored_before = self.store.failure().is_none();
        let (mut row, retired) = self.step(at, index, images)?;
        self.check_limits(&row)?;
        if let Some(failure) = self.store.failure().filter(|_| stored_before) {
            progress.warn(&format!("frame {index}: map.blocks cannot grow ({failure}). Blocks evicted from here on are lost"));
        }
        self.state.timers.add_since(&mut self.since);
        let (blocks, timers) = (row.report.blocks, &self.state.timers);
        let fps = (at + 1) as f64 / timers.mapping().as_secs_f64();
        progress.frame(at + 1, fps, f64::from(blocks.used) / f64::from(blocks.capacity), row.held());
        let mut view = LiveMap { mapper: &mut self.mapper, threads: &self.threads, first_raycast: None };
        let mut context = FrameContext { at, row: &row, images, retired: &retired, view: &mut view };
        self.state.observers.frame(&self.setup, &mut context)?;
        row.stages[Stage::Raycast as usize] = view.first_raycast.unwrap_or_default();
        self.state.rows.push(row);
        if let Some(failure) = self.write_checkpoint(at).err() {
            progress.warn(&format!("frame {index}: checkpoint not written ({failure}). A resumed run starts from the one before"));
        }
        self.state.timers.overhead += self.since.elapsed();
        Ok(())
    }

    fn step(&mut self, at: usize, index: usize, images: &StereoImages) -> Result<(FrameRow, Vec<RetiredVolume>), RunError> {
        let refused = |reason: String| RunError::Step { frame: index, reason };
        let detections: Vec<_> = images.masks.instances.iter().map(InstanceMask::detection).collect();
        let frame = self.stereo_frame(at, images, &detections).ok_or_else(|| refused("the images are empty".to_owned()))?;
        self.threads.take_times();
        let begin = Instant::now();
        let (mapper, threads, store) = (&mut self.mapper, &self.threads, &mut self.store);
        let mut retired = RetiredVolumes::default();
        let stepped = threads.run(|| mapper.step_with(&frame, threads, store, &mut retired));
        let report = stepped.map_err(|error| refused(step_reason(error)))?;
        let step_ms = begin.elapsed().as_secs_f64() * 1e3;
        let stages = self.threads.take_times();
        Ok((self.row(index, images, report, (step_ms, stages)), retired.0))
    }

    fn row(&self, index: usize, images: &StereoImages, report: Report, (step_ms, stages): (f64, [StageTime; STAGES])) -> FrameRow {
        let tracks_in = |state: MotionState| self.mapper.tracks().filter(|track| track.detected && track.state == state).count() as u32;
        FrameRow {
            frame: index,
            time_s: self.plan.dataset.time_s(index),
            report,
            history_frames: self.mapper.background().history().len(),
            track_states: [MotionState::Uncertain, MotionState::Static, MotionState::Dynamic].map(tracks_in),
            mask_refusals: images.masks.refusals,
            depth_refused: images.depth.as_ref().map_or(0, |depth| depth.refused.count()) + report.stereo.refused,
            step_ms,
            rss_bytes: resident_bytes().map(|(now, _)| now),
            stages,
        }
    }

    /// Refuses a frame beyond the limits of the run.
    fn check_limits(&self, row: &FrameRow) -> Result<(), RunError> {
        if self.plan.strict && row.severity() >= Severity::MapAffected {
            return Err(RunError::Strict { frame: row.frame, cause: row.cause() });
        }
        let limit_bytes = self.plan.rss_limit_bytes;
        match row.rss_bytes {
            Some(rss_bytes) if rss_bytes > limit_bytes => Err(RunError::Resident { frame: row.frame, rss_bytes, limit_bytes }),
            _ => Ok(()),
        }
    }

    /// Writes a checkpoint where one is due.
    fn write_checkpoint(&mut self, at: usize) -> Result<(), FolderError> {
        let Some(plan) = self.plan.checkpoints.as_ref().filter(|plan| (at + 1).is_multiple_of(plan.every)) else { return Ok(()) };
        let position = self.store.position();
        let blocks = position.map_err(|source| FolderError::Write { path: self.folder.file(BLOCKS_FILE), source })?;
        checkpoint::write(self.folder, &plan.manifest, blocks, &self.state, &mut self.mapper)
    }

    /// Ends the run: what is still in the pruning window is pruned, and objects leave.
    pub fn end(&mut self) -> Result<PruneReport, RunError> {
        let mut retired = RetiredVolumes::default();
        let pruned = self.mapper.finish_with(&mut retired);
        let mut view = LiveMap { mapper: &mut self.mapper, threads: &self.threads, first_raycast: None };
        let mut context = EndContext { rows: &self.state.rows, retired: &retired.0, view: &mut view };
        self.state.observers.end(&self.setup, &mut context)?;
        Ok(pruned)
    }
}
