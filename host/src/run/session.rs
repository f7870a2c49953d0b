//! A run under way: frames go in one by one, and what only the report needs is done beside them.

use super::disk_store::{self, Shelf};
use super::error::{RunError, refused, step_reason};
use super::execute::from_first;
use super::state::Gathered;
use super::{FolderError, RunFolder};
use super::{FrameRow, Keyframe, Plan, Progress, ResumeError, Stopped, Threads, checkpoint, read_ahead, resident_bytes};
use crate::input::InstanceMask;
use crate::input::{ExactFrame, StereoImages};
use crate::observe::{LidarAtWork, Reference, evaluable, pictures};
use dynvox_core::geometry::Transform;
use dynvox_core::tracking::Detection;
use dynvox_core::volume::PruneReport;
use dynvox_core::{Mapper, Severity, Stage, StereoFrame};
use std::time::Instant;

/// Frames shown in the report.
const KEYFRAMES: usize = 5;
/// Frames whose exact depth is compared with the map, at most.
const EXACT_FRAMES: usize = 24;
/// Disparity shown in red, as a share of the image width.
const NEAR_SHARE: f32 = 0.08;

/// Where the overview's camera stands, as seen from the last camera, m: behind and above.
const OVERVIEW_PLACE_M: [f64; 3] = [0.0, -7.0, -15.0];
/// How far it looks down, rad.
const OVERVIEW_PITCH_RAD: f64 = 0.33;

/// `count` of `frames` positions, evenly, the last among them.
fn spread(frames: usize, count: usize) -> impl Fn(usize) -> bool {
    let count = count.min(frames).max(1);
    move |at| ((at + 1) * count) / frames > (at * count) / frames
}

/// Begins holding the map against a reference.
fn evaluation(plan: &Plan, reference: Reference) -> LidarAtWork {
    let evaluable = evaluable(plan.dataset.as_ref(), &plan.indices, reference, plan.evaluation_delay);
    let (size, full_size) = (plan.dataset.size(), plan.dataset.full_size());
    let enlarged = (full_size.0 as f64 / size.0 as f64) as f32;
    LidarAtWork::new(reference, plan.evaluation_delay, &plan.config, (size, enlarged), &evaluable)
}

/// A run under way.
pub(super) struct Course<'p, 's> {
    pub plan: &'p Plan,
    pub folder: &'p RunFolder,
    pub mapper: Mapper<'s>,
    pub threads: Threads,
    pub shelf: Shelf,
    /// Given poses, the first at the origin.
    pub poses: Option<Vec<Transform>>,
    pub lidar: Option<LidarAtWork>,
    pub gathered: Gathered,
    /// Up to when time is in `gathered`.
    pub since: Instant,
}

impl<'p, 's> Course<'p, 's> {
    /// At the first frame.
    pub fn begin(plan: &'p Plan, folder: &'p RunFolder, slab: &'s mut [u8]) -> Result<Self, RunError> {
        let since = Instant::now();
        let mapper = Mapper::new(&plan.capacity, &plan.config, slab).map_err(|error| refused(&plan.profile, error))?;
        let shelf = Shelf::begin(plan.streaming, folder, &plan.config).map_err(RunError::Store)?;
        Self::with(plan, folder, mapper, shelf, Gathered::default(), since)
    }

    /// Where it was stopped.
    pub fn resume(plan: &'p Plan, folder: &'p RunFolder, slab: &'s mut [u8], mut stopped: Stopped) -> Result<Self, RunError> {
        let since = Instant::now();
        let shelf = Shelf::resume(plan.streaming, folder, &plan.config, stopped.blocks.as_ref()).map_err(RunError::Reopen)?;
        let mapper = stopped.mapper(plan, slab)?;
        let course = Self::with(plan, folder, mapper, shelf, stopped.gathered, since)?;
        course.same_frames()?;
        course.gathered.objects.kept.tidy(folder)?;
        Ok(course)
    }

    fn with(
        plan: &'p Plan,
        folder: &'p RunFolder,
        mapper: Mapper<'s>,
        shelf: Shelf,
        gathered: Gathered,
        since: Instant,
    ) -> Result<Self, RunError> {
        Ok(Self {
            plan,
            folder,
            mapper,
            threads: Threads::new(plan.threads).map_err(|source| RunError::Threads { count: plan.threads, source })?,
            shelf,
            poses: plan.poses.as_ref().map(|poses| from_first(poses, &(0..poses.len()).collect::<Vec<_>>())),
            lidar: plan.evaluate.map(|reference| evaluation(plan, reference)),
            gathered,
            since,
        })
    }

    /// Whether the data set still holds the last frame that was mapped.
    fn same_frames(&self) -> Result<(), RunError> {
        let Some((at, row)) = self.gathered.rows.iter().enumerate().next_back() else { return Ok(()) };
        let images = self.plan.dataset.frame(row.frame)?;
        let detections: Vec<_> = images.masks.instances.iter().map(InstanceMask::detection).collect();
        let digest = self.stereo_frame(at, &images, &detections).map(|frame| frame.digest());
        if digest == Some(row.report.digests.input) {
            return Ok(());
        }
        Err(ResumeError::Unlike { differences: format!("the data set's frame {} is not what it was", row.frame) }.into())
    }

    /// What the mapper is handed of the frame at position `at`; `None` where an image is empty.
    fn stereo_frame<'f>(&self, at: usize, images: &'f StereoImages, detections: &'f [Detection<'f>]) -> Option<StereoFrame<'f>> {
        Some(StereoFrame {
            left: images.left.view()?,
            right: images.right.view()?,
            colour: images.colour.as_ref().and_then(|colour| colour.view()),
            class: None,
            disparity_q8: images.depth.as_ref().and_then(|depth| depth.disparity_q8.view()),
            t_world_camera: self.poses.as_ref().and_then(|poses| poses.get(at).copied()),
            detections,
        })
    }

    /// Takes the frames that are left.
    pub fn frames(&mut self) -> Result<(), RunError> {
        let (frames, done) = (self.plan.indices.len(), self.gathered.rows.len());
        let progress = Progress::new(frames, self.plan.quiet);
        let delay = self.plan.evaluation_delay;
        let (is_keyframe, is_compared) = (spread(frames, KEYFRAMES), spread(frames.saturating_sub(delay).max(1), EXACT_FRAMES));
        let left = self.plan.indices.get(done..).unwrap_or_default();
        read_ahead(self.plan.dataset.as_ref(), left, |decoded| {
            for (at, (index, images)) in (done..).zip(decoded.iter()) {
                let images = images?;
                let was_kept = self.shelf.failure().is_none();
                let row = self.step(index, &images)?;
                self.watch(&row)?;
                if let Some(failure) = self.shelf.failure().filter(|_| was_kept) {
                    progress.say(&format!(
                        "warning: frame {index}: map.blocks takes no more ({failure}). Blocks that leave the pool are lost from here on"
                    ));
                }
                self.gathered.spent.until_now(&mut self.since);
                let blocks = row.report.blocks;
                let fps = (at + 1) as f64 / self.gathered.spent.mapping().as_secs_f64();
                progress.frame(at + 1, fps, f64::from(blocks.used) / f64::from(blocks.capacity), row.held());
                let t_world_camera = row.report.t_world_camera;
                if at == done {
                    // Room for all rows now, so that what grows during the drive is a leak.
                    self.gathered.rows.resize(frames, row.clone());
                    self.gathered.rows.truncate(done);
                }
                self.gathered.rows.push(row);
                let exact = images.exact.as_ref().filter(|_| delay == 0 && is_compared(at));
                if is_keyframe(at) || exact.is_some() {
                    self.look(&images, &t_world_camera, exact, is_keyframe(at).then_some(index));
                }
                if let Some(past) = at.checked_sub(delay).filter(|&past| delay > 0 && is_compared(past)) {
                    self.look_back(past)?;
                }
                self.measure(at, index, &images, &t_world_camera)?;
                if let Some(failure) = self.snapshot(at).err() {
                    progress.say(&format!("warning: frame {index}: no snapshot ({failure}). A stopped run goes on from the one before"));
                }
                self.gathered.spent.aside += self.since.elapsed();
            }
            Ok(())
        })
        .inspect(|()| progress.finish())
        .inspect_err(|_: &RunError| progress.finish())?;
        self.gathered.spent.until_now(&mut self.since);
        Ok(())
    }

    fn step(&mut self, index: usize, images: &StereoImages) -> Result<FrameRow, RunError> {
        let refused = |reason: String| RunError::Step { frame: index, reason };
        let detections: Vec<_> = images.masks.instances.iter().map(InstanceMask::detection).collect();
        let frame = self.stereo_frame(self.gathered.rows.len(), images, &detections);
        let frame = frame.ok_or_else(|| refused("the images are empty".to_owned()))?;
        self.threads.take_times();
        let begin = Instant::now();
        let (mapper, threads, shelf) = (&mut self.mapper, &self.threads, &mut self.shelf);
        let mut sink = self.gathered.objects.kept.sink(self.folder, &self.plan.config.mesh);
        let stepped = threads.run(|| mapper.step_with(&frame, threads, shelf, &mut sink));
        let report = stepped.map_err(|error| refused(step_reason(error)))?;
        let step_ms = begin.elapsed().as_secs_f64() * 1e3;
        let aside = Instant::now();
        sink.end()?;
        self.gathered.spent.aside += aside.elapsed();
        let tracks = self.gathered.objects.note(&self.plan.config, index, &self.mapper, images, &report);
        Ok(FrameRow {
            frame: index,
            time_s: self.plan.dataset.time_s(index),
            report,
            history_frames: self.mapper.background().history().len(),
            step_ms,
            tracks,
            refusals: images.masks.refusals,
            depth_refused: images.depth.as_ref().map_or(0, |depth| depth.refused.count()) + report.stereo.refused,
            rss_bytes: resident_bytes().map(|(now, _)| now),
            stages: self.threads.take_times(),
        })
    }

    /// Raycasts the map from the camera's place: to compare it with exact depth, and to show it as the picture of frame `keyframe`.
    fn look(&mut self, images: &StereoImages, t_world_camera: &Transform, exact: Option<&ExactFrame>, keyframe: Option<usize>) {
        let near_px = NEAR_SHARE * images.left.width() as f32;
        let disparity_png = keyframe.map(|_| pictures::disparity(&self.mapper.disparity_q8(), near_px));
        let (mapper, threads) = (&mut self.mapper, &self.threads);
        let Ok(seen) = threads.run(|| mapper.raycast(t_world_camera, threads)) else { return };
        if let (Some(exact), Some(depth_m)) = (exact, seen.depth_m()) {
            let apart = |sighting: &InstanceMask, u, v| self.plan.config.instances.dynamic && sighting.contains(u, v);
            self.gathered.exact.add(&depth_m, exact, |u, v| images.masks.instances.iter().any(|one| apart(one, u as i32, v as i32)));
        }
        if let (Some(frame), Some(disparity_png), Some(grey)) = (keyframe, disparity_png, images.left.view()) {
            let input = images.colour.as_ref().and_then(|colour| colour.view());
            self.gathered.keyframes.push(Keyframe {
                frame,
                input_png: pictures::input(&grey, input.as_ref()),
                disparity_png,
                raycast_png: pictures::map(pictures::SMALL_PX, seen, |_| None),
                composed_png: Vec::new(),
            });
        }
        // The raycast's time belongs to the frame it looked from.
        let times = self.threads.take_times();
        if let Some(row) = self.gathered.rows.last_mut() {
            row.stages[Stage::Raycast as usize] = times[Stage::Raycast as usize];
        }
        if let (Some(_), Some(shown)) = (keyframe, self.gathered.keyframes.last_mut()) {
            shown.composed_png = pictures::composed(pictures::SMALL_PX, &mut self.mapper, &self.threads, t_world_camera);
        }
    }

    /// Compares the map with the exact depth of an earlier frame, which is decoded again.
    fn look_back(&mut self, past: usize) -> Result<(), RunError> {
        let (Some(row), Some(&index)) = (self.gathered.rows.get(past), self.plan.indices.get(past)) else { return Ok(()) };
        let t_world_camera = row.report.t_world_camera;
        let images = self.plan.dataset.frame(index)?;
        if let Some(exact) = &images.exact {
            self.look(&images, &t_world_camera, Some(exact), None);
        }
        Ok(())
    }

    /// Holds the map against the reference of the frame that is due.
    fn measure(&mut self, at: usize, index: usize, images: &StereoImages, t_world_camera: &Transform) -> Result<(), RunError> {
        let Some(lidar) = &mut self.lidar else { return Ok(()) };
        let Some(due) = lidar.due(at, index, images, &self.mapper, (self.plan.dataset.as_ref(), t_world_camera))? else { return Ok(()) };
        let (mapper, threads, present) = (&mut self.mapper, &self.threads, self.plan.evaluation_delay == 0);
        // Where objects were in a past frame is not kept: later the street is looked at alone.
        let seen = threads.run(|| {
            if present { mapper.raycast_composed(&due.t_world_camera, threads) } else { mapper.raycast(&due.t_world_camera, threads) }
        });
        if let Some(depth_m) = seen.ok().and_then(|seen| seen.depth_m()) {
            lidar.compare(&due, &depth_m);
        }
        Ok(())
    }

    /// Writes a snapshot where one is due.
    fn snapshot(&mut self, at: usize) -> Result<(), FolderError> {
        let Some(snapshots) = self.plan.snapshots.as_ref().filter(|snapshots| (at + 1).is_multiple_of(snapshots.every)) else {
            return Ok(());
        };
        let blocks = self.shelf.mark().map_err(|source| FolderError::Write { path: self.folder.file(disk_store::FILE), source })?;
        checkpoint::write(self.folder, &snapshots.begun, blocks, &self.gathered, &mut self.mapper)
    }

    /// Ends the drive: what is still in the pruning window is pruned, and objects leave.
    pub fn finish(&mut self) -> Result<PruneReport, RunError> {
        let mut sink = self.gathered.objects.kept.sink(self.folder, &self.plan.config.mesh);
        let pruned = self.mapper.finish_with(&mut sink);
        sink.end()?;
        Ok(pruned)
    }

    /// The map from behind and above the last camera.
    pub fn overview(&mut self) -> Vec<u8> {
        let Some(row) = self.gathered.rows.last() else { return Vec::new() };
        let down = nalgebra::Vector3::new(-OVERVIEW_PITCH_RAD, 0.0, 0.0);
        let t_world_camera = row.report.t_world_camera * Transform::new(down, OVERVIEW_PLACE_M);
        let (mapper, threads) = (&mut self.mapper, &self.threads);
        threads
            .run(|| mapper.raycast(&t_world_camera, threads))
            .map(|seen| pictures::map(pictures::LARGE_PX, seen, |_| None))
            .unwrap_or_default()
    }

    /// Ends the run where it may not go on.
    fn watch(&self, row: &FrameRow) -> Result<(), RunError> {
        if self.plan.strict && row.report.severity() >= Severity::MapAffected {
            return Err(RunError::Strict { frame: row.frame, cause: row.cause() });
        }
        let limit_bytes = self.plan.rss_limit_bytes;
        match row.rss_bytes {
            Some(rss_bytes) if rss_bytes > limit_bytes => Err(RunError::Resident { frame: row.frame, rss_bytes, limit_bytes }),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chosen_frames_are_spread_evenly_and_end_with_the_last() {
        for (frames, count) in [(100, 5), (7, 5), (3, 5), (1, 24)] {
            let chosen: Vec<usize> = (0..frames).filter(|&at| spread(frames, count)(at)).collect();
            assert_eq!(chosen.len(), count.min(frames));
            assert_eq!(chosen.last(), Some(&(frames - 1)));
        }
    }
}
