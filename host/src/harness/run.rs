//! One run: frames in, map, trajectory and figures out.

use super::error::{RunError, refused, step_reason};
use super::lidar::{LidarAtWork, LidarRecord, Reference, evaluable};
use super::objects::{ObjectsAtWork, ObjectsRecord};
use super::shelf::{MeshOutput, Shelf, Streaming};
use super::{FrameRow, HostSlab, Keyframe, Progress, RunRecord, Threads, pictures, read_ahead, resident_bytes};
use crate::dataset::{Dataset, ExactFrame, StereoImages};
use crate::evaluation::exact::ExactErrors;
use crate::export::RunFolder;
use crate::segmentation::Sighting;
use dynvox_core::geometry::{Transform, exp};
use dynvox_core::mapper::MotionSource;
use dynvox_core::memory::Region;
use dynvox_core::volume::PruneReport;
use dynvox_core::{Capacity, Config, Mapper, Severity, Stage, StereoFrame};
use std::time::{Duration, Instant};

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

/// Bytes the host may hold beside the slab unless a run says otherwise: decoded images, the synthetic street, a row per frame, pictures for
/// the report, the block file's places.
pub const HOST_OVERHEAD_BYTES: u64 = 256 << 20;

/// What to run.
pub struct Plan {
    /// The frames.
    pub dataset: Box<dyn Dataset>,
    /// Numbers of the frames to take.
    pub indices: Vec<usize>,
    /// Poses of these frames to take in place of the camera's own motion.
    pub poses: Option<Vec<Transform>>,
    /// Name of the profile.
    pub profile: String,
    /// Its bounds.
    pub capacity: Capacity,
    /// The mapper's configuration.
    pub config: Config,
    /// The same as a file.
    pub config_toml: String,
    /// Threads at work.
    pub threads: usize,
    /// How blocks that leave the pool are kept; they are lost when absent.
    pub streaming: Option<Streaming>,
    /// Whether the run fails at the first frame that harms the map.
    pub strict: bool,
    /// Resident memory above which the run fails.
    pub rss_limit_bytes: u64,
    /// What the map is held against, frame by frame.
    pub evaluate: Option<Reference>,
    /// Frames after which the map is held against a frame's reference and exact depth, from where it was taken.
    pub evaluation_delay: usize,
    /// Whether to show no progress.
    pub quiet: bool,
}

/// The frames a run takes: from `start`, every `stride`-th, at most `frames`.
pub fn frame_indices(len: usize, start: usize, stride: usize, frames: Option<usize>) -> Result<Vec<usize>, RunError> {
    let indices: Vec<usize> = (start..len).step_by(stride.max(1)).take(frames.unwrap_or(usize::MAX)).collect();
    if indices.is_empty() { Err(RunError::NoFrames { start, len }) } else { Ok(indices) }
}

/// Median time between two of the frames, s; `None` where there is only one.
pub fn frame_interval_s(dataset: &dyn Dataset, indices: &[usize]) -> Option<f64> {
    let mut steps: Vec<f64> = indices.windows(2).map(|pair| dataset.time_s(pair[1]) - dataset.time_s(pair[0])).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied()
}

/// Maps the planned frames and writes the mesh into the folder.
pub fn run(plan: &Plan, folder: &RunFolder) -> Result<RunRecord, RunError> {
    let begin = Instant::now();
    check(plan)?;
    let slab_bytes = plan.capacity.bytes();
    let mut slab = HostSlab::map(slab_bytes).ok_or_else(|| RunError::NoMemory { bytes: slab_bytes, profile: plan.profile.clone() })?;
    let (drive, output) = drive(plan, slab.bytes_mut(), folder)?;
    // The mapper is gone: its slab serves to read the map piece by piece.
    let keep_file = plan.streaming.is_some_and(|streaming| streaming.keep_file);
    let (mesh, shelf) = output.finish(slab.bytes_mut(), (&plan.capacity, &plan.config), keep_file, folder)?;
    let Drive {
        rows,
        keyframes,
        exact,
        lidar,
        overview_png,
        regions,
        blocks,
        finish,
        shelf_failure,
        mapping,
        mut objects,
        at_work,
    } = drive;
    objects.swept_triangles = at_work.swept_triangles(&folder.file("map.ply"))?;
    let truth = plan.dataset.truth().map(|truth| from_first(truth, &plan.indices));
    let poses: Vec<Transform> = rows.iter().map(|row| row.report.t_world_camera).collect();
    Ok(RunRecord {
        name: plan.dataset.name().to_owned(),
        notes: plan.dataset.notes().to_vec(),
        motion_source: match (&plan.poses, plan.config.mapper.egomotion) {
            (Some(_), _) => "file",
            (None, MotionSource::Stereo) => "stereo",
            (None, MotionSource::Icp) => "icp",
        },
        profile: plan.profile.clone(),
        capacity: plan.capacity,
        threads: plan.threads,
        size: plan.dataset.size(),
        rig: plan.dataset.rig(),
        config_toml: plan.config_toml.clone(),
        errors: truth.as_ref().and_then(|truth| crate::evaluation::trajectory::errors(truth, &poses)),
        truth,
        exact: exact.figures(),
        lidar,
        regions,
        slab_bytes,
        rss_peak_bytes: resident_bytes().map(|(_, peak)| peak),
        blocks,
        streaming: plan.streaming.is_some(),
        shelf,
        shelf_failure,
        rss_limit_bytes: plan.rss_limit_bytes,
        finish,
        mesh,
        seconds: begin.elapsed().as_secs_f64(),
        mapping_seconds: mapping.as_secs_f64(),
        rows,
        objects,
        keyframes,
        overview_png,
    })
}

/// What a drive leaves besides the mesh.
struct Drive {
    rows: Vec<FrameRow>,
    keyframes: Vec<Keyframe>,
    exact: ExactErrors,
    lidar: Option<LidarRecord>,
    overview_png: Vec<u8>,
    regions: Vec<Region>,
    blocks: usize,
    finish: PruneReport,
    shelf_failure: Option<String>,
    /// Time that went into mapping.
    mapping: Duration,
    objects: ObjectsRecord,
    at_work: ObjectsAtWork,
}

/// Maps the planned frames in `slab`.
fn drive(plan: &Plan, slab: &mut [u8], folder: &RunFolder) -> Result<(Drive, MeshOutput), RunError> {
    let begin = Instant::now();
    let mut course = Course {
        plan,
        mapper: Mapper::new(&plan.capacity, &plan.config, slab).map_err(|error| refused(&plan.profile, error))?,
        threads: Threads::new(plan.threads).map_err(|source| RunError::Threads { count: plan.threads, source })?,
        shelf: Shelf::begin(plan.streaming, folder, &plan.config)?,
        poses: plan.poses.as_ref().map(|poses| from_first(poses, &(0..poses.len()).collect::<Vec<_>>())),
        rows: Vec::new(),
        keyframes: Vec::new(),
        exact: ExactErrors::default(),
        lidar: plan.evaluate.map(|reference| evaluation(plan, reference)),
        objects: ObjectsAtWork::new(folder, plan),
        aside: Duration::ZERO,
    };
    course.frames()?;
    let mapping = begin.elapsed() - course.aside;
    let finish = course.mapper.finish_with(&mut course.objects.sink);
    let objects = course.objects.finish(&course.rows)?;
    let overview_png = course.overview();
    let Course { mut mapper, shelf, rows, keyframes, exact, lidar, objects: at_work, .. } = course;
    let (regions, blocks) = (mapper.footprint().regions().to_vec(), mapper.background().pool().len());
    let failed_before = shelf.failure().is_some();
    let output = MeshOutput::begin(&mut mapper, shelf, folder)?;
    let shelf_failure = output.failure();
    if let Some(failure) = shelf_failure.as_ref().filter(|_| !failed_before) {
        eprintln!("warning: at the end: map.blocks takes no more ({failure}). The rest of the map is lost");
    }
    Ok((
        Drive {
            rows,
            keyframes,
            exact,
            lidar: lidar.map(LidarAtWork::finish),
            overview_png,
            regions,
            blocks,
            finish,
            shelf_failure,
            mapping,
            objects,
            at_work,
        },
        output,
    ))
}

/// Begins holding the map against a reference.
fn evaluation(plan: &Plan, reference: Reference) -> LidarAtWork {
    let evaluable = evaluable(plan.dataset.as_ref(), &plan.indices, reference, plan.evaluation_delay);
    let (size, full_size) = (plan.dataset.size(), plan.dataset.full_size());
    let enlarged = (full_size.0 as f64 / size.0 as f64) as f32;
    LidarAtWork::new(reference, plan.evaluation_delay, &plan.config, (size, enlarged), &evaluable)
}

/// Refuses what cannot run before any memory is taken.
fn check(plan: &Plan) -> Result<(), RunError> {
    let (width, height) = plan.dataset.size();
    if let Some(reference) = plan.evaluate
        && evaluable(plan.dataset.as_ref(), &plan.indices, reference, plan.evaluation_delay).is_empty()
    {
        return Err(RunError::NoReference { reference, frames: plan.indices.len(), delay: plan.evaluation_delay });
    }
    let fits = |capacity: &Capacity| width <= capacity.image_width && height <= capacity.image_height;
    if !fits(&plan.capacity) {
        let scale = (plan.capacity.image_width as f64 / width as f64).min(plan.capacity.image_height as f64 / height as f64);
        let scale = (scale * 100.0).floor() / 100.0;
        let larger = Capacity::PROFILES.iter().find(|(_, capacity)| fits(capacity));
        return Err(RunError::ImageSize {
            width,
            height,
            profile: plan.profile.clone(),
            fits_width: plan.capacity.image_width,
            fits_height: plan.capacity.image_height,
            action: match larger {
                Some((name, _)) => format!("Choose --profile {name}, or shrink the images with --scale {scale}"),
                None => format!("Shrink the images with --scale {scale}"),
            },
        });
    }
    let problems = plan.config.validate();
    let (prune_lag, history_frames) = (plan.config.volume.prune_lag, plan.capacity.history_frames);
    if problems.is_empty() && plan.config.volume.prune_weight > 0 && prune_lag as usize > history_frames {
        return Err(RunError::Window { prune_lag, history_frames, profile: plan.profile.clone() });
    }
    if problems.is_empty() {
        return Ok(());
    }
    let problems: Vec<String> = problems.iter().map(|problem| format!("{} {}", problem.key, problem.rule)).collect();
    Err(RunError::Config { problems: problems.join("; ") })
}

/// Poses of the chosen frames, seen from the first of them.
fn from_first(poses: &[Transform], indices: &[usize]) -> Vec<Transform> {
    let chosen: Vec<Transform> = indices.iter().filter_map(|&index| poses.get(index).copied()).collect();
    let Some(first) = chosen.first().map(Transform::inverse) else { return Vec::new() };
    chosen.iter().map(|pose| first * pose).collect()
}

/// `count` of `frames` positions, evenly, the last among them.
fn spread(frames: usize, count: usize) -> impl Fn(usize) -> bool {
    let count = count.min(frames).max(1);
    move |at| ((at + 1) * count) / frames > (at * count) / frames
}

/// A run under way.
struct Course<'p, 's> {
    plan: &'p Plan,
    mapper: Mapper<'s>,
    threads: Threads,
    shelf: Shelf,
    /// Given poses, the first at the origin.
    poses: Option<Vec<Transform>>,
    rows: Vec<FrameRow>,
    keyframes: Vec<Keyframe>,
    exact: ExactErrors,
    lidar: Option<LidarAtWork>,
    objects: ObjectsAtWork,
    /// Time that only the report needed.
    aside: Duration,
}

impl Course<'_, '_> {
    fn frames(&mut self) -> Result<(), RunError> {
        let frames = self.plan.indices.len();
        let progress = Progress::new(frames, self.plan.quiet);
        let delay = self.plan.evaluation_delay;
        let (is_keyframe, is_compared) = (spread(frames, KEYFRAMES), spread(frames.saturating_sub(delay).max(1), EXACT_FRAMES));
        let begin = Instant::now();
        read_ahead(self.plan.dataset.as_ref(), &self.plan.indices, |decoded| {
            for (at, (index, images)) in decoded.iter().enumerate() {
                let images = images?;
                let was_kept = self.shelf.failure().is_none();
                let row = self.step(index, &images)?;
                self.watch(&row)?;
                if let Some(failure) = self.shelf.failure().filter(|_| was_kept) {
                    progress.say(&format!(
                        "warning: frame {index}: map.blocks takes no more ({failure}). Blocks that leave the pool are lost from here on"
                    ));
                }
                let seconds = (begin.elapsed() - self.aside).as_secs_f64();
                let blocks = row.report.blocks;
                progress.frame(at + 1, (at + 1) as f64 / seconds, f64::from(blocks.used) / f64::from(blocks.capacity), row.held());
                let aside = Instant::now();
                let t_world_camera = row.report.t_world_camera;
                if at == 0 {
                    // Room for all rows now, so that what grows during the drive is a leak.
                    self.rows.resize(frames, row.clone());
                    self.rows.clear();
                }
                self.rows.push(row);
                let exact = images.exact.as_ref().filter(|_| delay == 0 && is_compared(at));
                if is_keyframe(at) || exact.is_some() {
                    self.look(&images, &t_world_camera, exact, is_keyframe(at).then_some(index));
                }
                if let Some(past) = at.checked_sub(delay).filter(|&past| delay > 0 && is_compared(past)) {
                    self.look_back(past)?;
                }
                self.measure(at, index, &images, &t_world_camera)?;
                self.aside += aside.elapsed();
            }
            Ok(())
        })
        .inspect(|()| progress.finish())
        .inspect_err(|_: &RunError| progress.finish())
    }

    fn step(&mut self, index: usize, images: &StereoImages) -> Result<FrameRow, RunError> {
        let refused = |reason: String| RunError::Step { frame: index, reason };
        let empty = || refused("the images are empty".to_owned());
        let detections: Vec<_> = images.sightings.all.iter().map(Sighting::detection).collect();
        let frame = StereoFrame {
            left: images.left.view().ok_or_else(empty)?,
            right: images.right.view().ok_or_else(empty)?,
            colour: images.colour.as_ref().and_then(|colour| colour.view()),
            class: None,
            disparity_q8: images.depth.as_ref().and_then(|depth| depth.disparity_q8.view()),
            t_world_camera: self.poses.as_ref().and_then(|poses| poses.get(self.rows.len()).copied()),
            detections: &detections,
        };
        self.threads.take_times();
        let begin = Instant::now();
        let (mapper, threads, shelf, sink) = (&mut self.mapper, &self.threads, &mut self.shelf, &mut self.objects.sink);
        let stepped = threads.run(|| mapper.step_with(&frame, threads, shelf, sink));
        let report = stepped.map_err(|error| refused(step_reason(error)))?;
        let step_ms = begin.elapsed().as_secs_f64() * 1e3;
        let tracks = self.objects.note(index, &self.mapper, images, &report);
        Ok(FrameRow {
            frame: index,
            time_s: self.plan.dataset.time_s(index),
            report,
            history_frames: self.mapper.background().history().len(),
            step_ms,
            tracks,
            refusals: images.sightings.refusals,
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
            let apart = |sighting: &Sighting, u, v| self.plan.config.instances.dynamic && sighting.contains(u, v);
            self.exact.add(&depth_m, exact, |u, v| images.sightings.all.iter().any(|one| apart(one, u as i32, v as i32)));
        }
        if let (Some(frame), Some(disparity_png), Some(grey)) = (keyframe, disparity_png, images.left.view()) {
            let input = images.colour.as_ref().and_then(|colour| colour.view());
            self.keyframes.push(Keyframe {
                frame,
                input_png: pictures::input(&grey, input.as_ref()),
                disparity_png,
                raycast_png: pictures::map(pictures::SMALL_PX, seen, |_| None),
                composed_png: Vec::new(),
            });
        }
        // The raycast's time belongs to the frame it looked from.
        let times = self.threads.take_times();
        if let Some(row) = self.rows.last_mut() {
            row.stages[Stage::Raycast as usize] = times[Stage::Raycast as usize];
        }
        if let (Some(_), Some(shown)) = (keyframe, self.keyframes.last_mut()) {
            shown.composed_png = pictures::composed(pictures::SMALL_PX, &mut self.mapper, &self.threads, t_world_camera);
        }
    }

    /// Compares the map with the exact depth of an earlier frame, which is decoded again.
    fn look_back(&mut self, past: usize) -> Result<(), RunError> {
        let (Some(row), Some(&index)) = (self.rows.get(past), self.plan.indices.get(past)) else { return Ok(()) };
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

    /// The map from behind and above the last camera.
    fn overview(&mut self) -> Vec<u8> {
        let Some(row) = self.rows.last() else { return Vec::new() };
        let down = nalgebra::Vector3::new(-OVERVIEW_PITCH_RAD, 0.0, 0.0);
        let t_world_camera = row.report.t_world_camera * exp(down, OVERVIEW_PLACE_M.into());
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
    fn frames_are_taken_from_start_by_stride_up_to_a_number() {
        assert_eq!(frame_indices(10, 2, 3, None).unwrap(), [2, 5, 8]);
        assert_eq!(frame_indices(10, 0, 1, Some(2)).unwrap(), [0, 1]);
        assert!(frame_indices(10, 10, 1, None).unwrap_err().to_string().contains("leaves none of the 10 frames"));
    }

    #[test]
    fn chosen_frames_are_spread_evenly_and_end_with_the_last() {
        for (frames, count) in [(100, 5), (7, 5), (3, 5), (1, 24)] {
            let chosen: Vec<usize> = (0..frames).filter(|&at| spread(frames, count)(at)).collect();
            assert_eq!(chosen.len(), count.min(frames));
            assert_eq!(chosen.last(), Some(&(frames - 1)));
        }
    }
}
