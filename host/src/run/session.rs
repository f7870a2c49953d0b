//! A run under way: read, step, observe.

use super::checkpoint::{self, Checkpoint, ResumeError, RunManifest};
use super::disk_store::{BLOCKS_FILE, DiskStore};
use super::error::{RunError, refused, step_reason};
use super::mask_effect::MaskEffect;
use super::resident::address_space;
use super::retired::RetiredVolumes;
use super::state::RunState;
use super::view::LiveMap;
use super::{
    Continued, FolderError, Incomplete, Progress, ReadFrame, RunFolder, Threads, inertial_samples,
    read_ahead, resident_bytes, stereo_frame,
};
use crate::input::{InputError, InstanceMask, PositionFix, StereoImages};
use crate::observe::{
    DepthCensus, EndContext, FrameContext, FramePictures, FrameRow, ObserveError, ObservedRun,
    Observer, RetiredVolume, StepTimes, from_first, overview,
};
use crate::request::Plan;
use dynvox_core::geometry::Transform;
use dynvox_core::tracking::{Detection, MotionState};
use dynvox_core::volume::PruneReport;
use dynvox_core::{Mapper, Report, Severity, Stage, StereoFrame};
use std::sync::mpsc::Receiver;
use std::time::Instant;

/// Address space that the end of a run needs: the mesh writer's window, the report, the viewer.
const END_BYTES: u64 = 64 << 20;

/// Position and time of a frame.
struct FrameTime {
    /// Position in the run.
    position: usize,
    /// Time stamp, ns.
    stamp_ns: Option<u64>,
    /// Time stamp of the frame that was mapped before it, ns.
    before_ns: Option<u64>,
}

/// A run under way.
pub(super) struct Session<'p, 's> {
    plan: &'p Plan,
    folder: &'p RunFolder,
    observed: &'p ObservedRun<'p>,
    /// Manifest of the run, if it writes checkpoints.
    manifest: Option<RunManifest>,
    pub mapper: Mapper<'s>,
    threads: Threads,
    pub store: DiskStore,
    /// Given poses, the first at the origin.
    poses: Option<Vec<Transform>>,
    pub state: RunState,
    /// Time before this is in the timers.
    pub since: Instant,
    masks: MaskEffect,
}

impl<'p, 's> Session<'p, 's> {
    /// At the first frame.
    pub fn begin(
        observed: &'p ObservedRun<'p>,
        folder: &'p RunFolder,
        slab: &'s mut [u8],
    ) -> Result<Self, RunError> {
        let (since, plan) = (Instant::now(), observed.plan);
        let mut mapper = Mapper::new(&plan.capacity, &plan.config, slab)
            .map_err(|error| refused(&plan.profile, error))?;
        let old = plan.request.storage.continues.as_ref();
        let continued = old.map(|old| Continued::begin(&mut mapper, old, folder)).transpose()?;
        // Blocks that were copied are in it.
        let store = DiskStore::begin(plan.request.storage.streaming(), folder, &plan.config)
            .map_err(RunError::Store)?;
        let state = RunState { continued, ..RunState::default() };
        Self::with(observed, folder, mapper, store, state, since)
    }

    /// After the last frame of a checkpoint.
    pub fn resume(
        observed: &'p ObservedRun<'p>,
        folder: &'p RunFolder,
        slab: &'s mut [u8],
        mut checkpoint: Checkpoint,
    ) -> Result<Self, RunError> {
        let (since, plan) = (Instant::now(), observed.plan);
        let store = DiskStore::resume(
            plan.request.storage.streaming(),
            folder,
            &plan.config,
            checkpoint.blocks.as_ref(),
        )
        .map_err(RunError::Reopen)?;
        let mapper = checkpoint.mapper(plan, slab)?;
        let mut session = Self::with(observed, folder, mapper, store, checkpoint.state, since)?;
        session.check_last_frame()?;
        session.state.observers.resume(session.observed)?;
        session.state.resume(&session.observed.folder)?;
        Ok(session)
    }

    fn with(
        observed: &'p ObservedRun<'p>,
        folder: &'p RunFolder,
        mapper: Mapper<'s>,
        store: DiskStore,
        state: RunState,
        since: Instant,
    ) -> Result<Self, RunError> {
        let plan = observed.plan;
        let manifest = match plan.request.storage.snapshot_every {
            Some(_) => Some(RunManifest::new(plan, folder.overwrites())?),
            None => None,
        };
        Ok(Self {
            plan,
            folder,
            observed,
            manifest,
            mapper,
            threads: Threads::new(plan.threads)
                .map_err(|source| RunError::Threads { count: plan.threads, source })?,
            store,
            poses: plan
                .poses
                .as_ref()
                .map(|poses| from_first(poses, &(0..poses.len()).collect::<Vec<_>>())),
            masks: MaskEffect::new(&plan.request.masks.source, plan.request.masks.every.get()),
            state,
            since,
        })
    }

    /// Refuses a data set whose last mapped frame changed since the checkpoint.
    fn check_last_frame(&self) -> Result<(), RunError> {
        let Some(row) = self.state.frames.last() else { return Ok(()) };
        let position = self.plan.frames.position_of(row.frame).unwrap_or_default();
        let images = self.plan.dataset.frame(row.frame)?;
        let detections: Vec<_> =
            images.masks.instances.iter().map(InstanceMask::detection).collect();
        let digest = self
            .stereo_frame(
                &FrameTime {
                    position,
                    stamp_ns: row.stamp_ns,
                    before_ns: self.state.before_last_ns,
                },
                &images,
                &detections,
            )
            .map(|frame| frame.digest());
        if digest == Some(row.report.digests.input) {
            return Ok(());
        }
        Err(ResumeError::Different {
            differences: format!("frame {} of the data set has changed", row.frame),
        }
        .into())
    }

    /// The mapper's input at a position and time; `None` where an image is empty.
    fn stereo_frame<'f>(
        &self,
        time: &FrameTime,
        images: &'f StereoImages,
        detections: &'f [Detection<'f>],
    ) -> Option<StereoFrame<'f>>
    where
        'p: 'f,
    {
        let poses = self.poses.as_ref();
        let plan: &'p Plan = self.plan;
        Some(StereoFrame {
            time_ns: time.stamp_ns,
            t_world_camera: poses.and_then(|poses| poses.get(time.position).copied()),
            inertial: inertial_samples(plan.dataset.as_ref(), time.before_ns, time.stamp_ns),
            ..stereo_frame(images, detections)?
        })
    }

    /// Maps the remaining frames. What ends the run early is returned once a frame is mapped;
    /// before, it is an error.
    pub fn frames(&mut self) -> Result<Option<Incomplete>, RunError> {
        let (plan, taken) = (self.plan, self.state.taken);
        let progress = Progress::new(plan.frames.count(), !plan.progress);
        let remaining = plan.frames.from_position(taken);
        let mapped =
            read_ahead(plan.dataset.as_ref(), remaining, plan.request.frames.skip_bad, |read| {
                self.take(read, &progress)
            });
        progress.finish();
        let Err(error) = mapped else {
            return if self.state.frames.is_empty() { Err(self.no_frame()) } else { Ok(None) };
        };
        if self.state.frames.is_empty() {
            return Err(error);
        }
        // After a failed observation the state is not that of one frame.
        if !matches!(error, RunError::Observe(_)) && self.manifest.is_some() {
            self.write_checkpoint_or_warn(&progress);
        }
        Ok(Some(Incomplete::of(
            &error,
            plan.frames.count().map(|count| count.saturating_sub(self.state.taken)),
        )))
    }

    /// Returns the loss of evicted blocks to a failing disk, if all frames were mapped.
    pub fn of_disk(&self) -> Option<Incomplete> {
        let failure = self.store.failure().filter(|_| self.store.disk_failed())?;
        Some(Incomplete::of_disk(format!(
            "map.blocks could not grow ({failure}), and blocks were lost. Free disk space and run \
             again"
        )))
    }

    /// Explains why no frame was mapped.
    fn no_frame(&self) -> RunError {
        let frames = self.state.taken;
        match self.state.skipped.first.first() {
            Some(first) => RunError::Step { frame: first.frame, reason: first.reason.clone() },
            None => RunError::Dataset(InputError::PastEnd { frames }),
        }
    }

    /// Maps frames as they are read, until they end or the run is asked to.
    fn take(&mut self, read: &Receiver<ReadFrame>, progress: &Progress) -> Result<(), RunError> {
        let plan = self.plan;
        let open = plan.frames.count().is_none();
        for frame in read {
            match plan.stop.signal() {
                // Of a stream this is the usual end.
                Some(_) if open => return Ok(()),
                Some(signal) => {
                    return Err(RunError::Signal { signal, frames: self.state.frames.len() });
                }
                None => {}
            }
            let (position, index) = (frame.position, frame.index);
            match self.frame(frame, progress) {
                Ok(()) => {}
                Err(RunError::Dataset(InputError::PastEnd { .. })) if open => return Ok(()),
                Err(error) if plan.request.frames.skip_bad && error.is_of_one_frame() => {
                    progress.warn(&format!("frame {index} is left out: {error}"));
                    self.state.skipped.add(index, error.to_string());
                    self.state.taken = position + 1;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Steps, observes, and writes a checkpoint where one is due.
    fn frame(&mut self, read: ReadFrame, progress: &Progress) -> Result<(), RunError> {
        let (position, index) = (read.position, read.index);
        let failed_before =
            (self.store.failure().is_some(), self.state.observers.failure().is_some());
        let (mut row, retired, images) = self.step(read)?;
        self.state.timers.add_since(&mut self.since);
        self.state.taken = position + 1;
        if let Some(continued) = &mut self.state.continued {
            continued.add(index, row.report.segment);
        }
        let RunState { frames, observers, timers, .. } = &mut self.state;
        let blocks = row.report.blocks;
        let fps = (frames.len() + 1) as f64 / timers.mapping().as_secs_f64();
        progress.frame(
            position + 1,
            fps,
            f64::from(blocks.used) / f64::from(blocks.capacity),
            row.is_extrapolated(),
        );
        let given = images.masks.instances.len();
        let warning = self.masks.add(&row, given, &self.plan.request.masks.source);
        warning.iter().for_each(|warning| progress.warn(warning));
        let evicted = self.store.take_evicted();
        let mut view =
            LiveMap { mapper: &mut self.mapper, threads: &self.threads, first_raycast: None };
        let mut context = FrameContext {
            position,
            row: &row,
            images: &images,
            retired: &retired,
            evicted: &evicted,
            view: &mut view,
            pictures: FramePictures::default(),
        };
        let observed = observers.frame(self.observed, &mut context);
        row.times.stages[Stage::Raycast as usize] = view.first_raycast.unwrap_or_default();
        frames.add(row).map_err(|source| ObserveError::Write {
            path: frames.file().path(&self.observed.folder),
            source,
        })?;
        observed?;
        self.state.write_due(&self.observed.folder)?;
        self.warn_of_disk(index, failed_before, progress);
        self.check_limits()?;
        if self
            .plan
            .request
            .storage
            .snapshot_every
            .is_some_and(|every| (position + 1).is_multiple_of(every))
        {
            self.write_checkpoint_or_warn(progress);
        }
        self.state.timers.overhead += self.since.elapsed();
        Ok(())
    }

    /// Warns of a disk that refused for the first time in this frame.
    fn warn_of_disk(
        &self,
        index: usize,
        (store_before, files_before): (bool, bool),
        progress: &Progress,
    ) {
        if let Some(failure) = self.store.failure().filter(|_| !store_before) {
            progress.warn(&format!(
                "frame {index}: map.blocks cannot grow ({failure}). Blocks \
                                    evicted from here on are lost"
            ));
        }
        if let Some(failure) = self.state.observers.failure().filter(|_| !files_before) {
            progress.warn(&format!("frame {index}: {failure}. The run continues without it"));
        }
    }

    fn step(
        &mut self,
        read: ReadFrame,
    ) -> Result<(FrameRow, Vec<RetiredVolume>, StereoImages), RunError> {
        let ReadFrame { position, index, stamp_ns, time_s, images } = read;
        let images = images?;
        let refused = |reason: String| RunError::Step { frame: index, reason };
        let detections: Vec<_> =
            images.masks.instances.iter().map(InstanceMask::detection).collect();
        // Samples of frames that were left out go to the next.
        let before_ns = self.state.frames.last().and_then(|row| row.stamp_ns);
        let time = FrameTime { position, stamp_ns, before_ns };
        let frame = self
            .stereo_frame(&time, &images, &detections)
            .ok_or_else(|| refused("the images are empty".to_owned()))?;
        self.threads.take_times();
        let begin = Instant::now();
        let (mapper, threads, store) = (&mut self.mapper, &self.threads, &mut self.store);
        let mut retired = RetiredVolumes::default();
        let stepped = threads.run(|| mapper.step_with(&frame, threads, store, &mut retired));
        let mut report = stepped.map_err(|error| refused(step_reason(error)))?;
        self.take_fix(index);
        self.state.before_last_ns = before_ns;
        let step_ms = begin.elapsed().as_secs_f64() * 1e3;
        report.allocate.eviction.lost += self.store.end_step();
        let times = self.threads.take_times();
        let row = FrameRow {
            frame: index,
            stamp_ns,
            time_s,
            step_ms,
            times,
            ..self.row(&images, report)
        };
        Ok((row, retired.0, images))
    }

    /// Hands the mapper the position that something else measured in a frame. One that is not taken
    /// (the camera is lost, or its keyframe has one) is missing in the count of those taken.
    fn take_fix(&mut self, index: usize) {
        let fixes = &self.plan.fixes;
        let found = fixes.binary_search_by_key(&index, |fix| fix.frame).ok();
        if let Some(PositionFix { position_m, sigma_m, .. }) = found.and_then(|at| fixes.get(at)) {
            self.mapper.add_position(*position_m, *sigma_m).ok();
        }
    }

    /// Makes a frame's row, without its number and times.
    fn row(&self, images: &StereoImages, report: Report) -> FrameRow {
        let tracks_in = |state: MotionState| {
            self.mapper.tracks().filter(|track| track.detected && track.state == state).count()
                as u32
        };
        FrameRow {
            frame: 0,
            stamp_ns: None,
            time_s: 0.0,
            report,
            history_frames: self.mapper.static_map().history().len(),
            track_states: [MotionState::Uncertain, MotionState::Static, MotionState::Dynamic]
                .map(tracks_in),
            depth: DepthCensus::new(self.mapper.disparity_q8(), self.mapper.config()),
            mask_refusals: images.masks.refusals,
            depth_refused: images.depth.as_ref().map_or(0, |depth| depth.refused.count())
                + report.stereo.refused,
            step_ms: 0.0,
            rss_bytes: resident_bytes().map(|(now, _)| now),
            times: StepTimes::default(),
        }
    }

    /// Ends a run whose last frame went beyond its limits.
    fn check_limits(&self) -> Result<(), RunError> {
        let Some(row) = self.state.frames.last() else { return Ok(()) };
        if self.plan.request.limits.strict && row.severity() >= Severity::MapAffected {
            return Err(RunError::Strict { frame: row.frame, cause: row.cause() });
        }
        if let Some((used_bytes, limit_bytes)) = address_space()
            && used_bytes + END_BYTES > limit_bytes
        {
            return Err(RunError::AddressSpace { frame: row.frame, used_bytes, limit_bytes });
        }
        let limit_bytes = self.plan.rss_limit_bytes;
        match row.rss_bytes {
            Some(rss_bytes) if rss_bytes > limit_bytes => {
                Err(RunError::Resident { frame: row.frame, rss_bytes, limit_bytes })
            }
            _ => Ok(()),
        }
    }

    /// Writes a checkpoint of the frames mapped so far. One that cannot be written leaves the one
    /// before.
    fn write_checkpoint_or_warn(&mut self, progress: &Progress) {
        if let Some(failure) = self.write_checkpoint().err() {
            progress.warn(&format!(
                "checkpoint not written ({failure}). A resumed run starts from the one before"
            ));
        }
    }

    fn write_checkpoint(&mut self) -> Result<(), FolderError> {
        let Some(manifest) = &self.manifest else { return Ok(()) };
        let refused =
            self.state.sync(&self.observed.folder).into_iter().next().map(|(_, error)| error);
        let refused = refused.or(self.state.observers.checkpoint(self.observed).err());
        if let Some(ObserveError::Write { path, source }) = refused {
            return Err(FolderError::Write { path, source });
        }
        let position = self.store.position();
        let blocks = position
            .map_err(|source| FolderError::Write { path: self.folder.file(BLOCKS_FILE), source })?;
        checkpoint::write(self.folder, manifest, blocks, &self.state, &mut self.mapper)
    }

    /// Ends the run: what is still in the pruning window is pruned, and objects leave.
    pub fn end(&mut self) -> Result<PruneReport, RunError> {
        let mut retired = RetiredVolumes::default();
        let pruned = self.mapper.finish_with(&mut retired);
        let RunState { frames, observers, .. } = &mut self.state;
        let mut view =
            LiveMap { mapper: &mut self.mapper, threads: &self.threads, first_raycast: None };
        let last = frames.last();
        let overview_jpeg =
            last.map(|row| overview(&mut view, &row.report.t_world_camera)).unwrap_or_default();
        let mut context = EndContext { last, retired: &retired.0, overview_jpeg, view: &mut view };
        observers.end(self.observed, &mut context)?;
        Ok(pruned)
    }
}
