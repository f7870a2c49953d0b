//! Measurements during a run. Each observer sees every frame after its step, keeps plain data that
//! goes into checkpoints, and returns a section of the run's record in the end.

mod block_history;
mod blocks;
mod bounds;
mod chart_values;
mod closed_path;
mod depth_census;
mod disparity;
mod frame;
mod frame_log;
mod frame_pictures;
mod gallery;
mod growing_file;
mod health;
mod inertial;
mod instances;
mod keyframes;
mod live;
mod map_disparity;
mod mavlink;
mod objects;
mod overview;
pub mod pictures;
mod planning;
mod planning_layers;
mod planning_maps;
mod recording;
mod reference;
mod scene_export;
pub mod tables;
mod thumbnail;
mod tracks;
mod trajectory;
mod written_file;

pub use block_history::BlockHistoryObserver;
pub use blocks::{BlockTotals, BlocksObserver, BlocksSection, StoreStats};
pub use bounds::{BoundUse, BoundUses, BoundsObserver, BoundsSection};
pub use chart_values::ChartValues;
pub use closed_path::{ClosedLoops, LoopRow, LoopSection};
pub use depth_census::{DepthCensus, DepthTotals};
pub use disparity::DisparityObserver;
pub use frame::{FrameRow, STAGES, StageTime, StepTimes};
pub use frame_log::{FrameLog, StageStatistics};
pub use frame_pictures::FramePictures;
pub use gallery::GalleryObserver;
pub use growing_file::GrowingFile;
pub use health::{HealthObserver, HealthSection};
pub use inertial::InertialObserver;
pub use instances::{InstancesObserver, MOTION_FOLDER};
pub use keyframes::{Keyframe, KeyframesObserver, KeyframesSection};
pub use live::LiveObserver;
pub use map_disparity::MapDisparityObserver;
pub use mavlink::{MavlinkObserver, MavlinkSection};
pub use objects::{ObjectsObserver, ObjectsSection, ReconstructedObject};
pub use overview::overview;
pub use planning::{
    BoxDescription, PlanningObserver, WindowCamera, write_folder as write_planning,
};
pub use planning_layers::PlanningLayers;
pub use recording::{RECORDING_FILE, RecordingObserver};
pub use reference::{ErrorPictures, ReferenceObserver, ReferencePlan, ReferenceSection};
pub use scene_export::SceneExportObserver;
pub use tracks::{TrackRecord, TrackRow, TrackSpan, TracksObserver, TracksSection, state_name};
pub use trajectory::{
    ThinnedPath, TrackingFailures, TrajectoryObserver, TrajectorySection, from_first,
};
pub use written_file::WrittenFile;

use crate::evaluate::inertial::UnitFindings;
use crate::formats::Mesh;
use crate::input::{InputError, StereoImages};
use crate::request::Plan;
use crate::volume_copy::VolumeCopy;
use dynvox_core::Mapper;
use dynvox_core::memory::Region;
use dynvox_core::objects::ObjectSummary;
use dynvox_core::planning::PlanningReport;
use dynvox_core::view::{RaycastView, Raycaster};
use dynvox_core::volume::{BlockKey, PruneReport};
use hashbrown::HashSet;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Reason why an observer cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum ObserveError {
    /// A file of the run folder.
    #[error("{path} cannot be written: {source}. Check the disk and the permissions")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file that an earlier part of the run wrote.
    #[error("{path} is not as the run left it: {reason}. Start the run again with --overwrite")]
    Changed {
        /// The file.
        path: PathBuf,
        /// Difference, as it completes the message's sentence.
        reason: String,
    },
    /// The data set.
    #[error(transparent)]
    Dataset(#[from] InputError),
}

/// A run as its observers see it: the plan, and where files go.
pub struct ObservedRun<'p> {
    /// Plan of the run.
    pub plan: &'p Plan,
    /// The run folder under construction.
    pub folder: PathBuf,
    /// Folder that every frame's instances are saved to, if they are.
    pub instances_folder: Option<PathBuf>,
    /// Folder that every frame's disparity is saved to, if it is.
    pub disparity_folder: Option<PathBuf>,
    /// Folder that what the finished map shows at every frame's pose is saved to, if it is.
    pub map_disparity_folder: Option<PathBuf>,
    /// Folder that the scene is exported to, if it is.
    pub scene_folder: Option<PathBuf>,
    /// Reference against which the map is evaluated, and its frames.
    pub reference: Option<ReferencePlan>,
}

/// The map as an observer may look at it.
pub trait MapView<'s> {
    /// The mapper after the step.
    fn mapper(&self) -> &Mapper<'s>;

    /// The static map from a pose; `None` where the core refuses the pose.
    fn raycast(&mut self, view: RaycastView) -> Option<&Raycaster<'s>>;

    /// Raycasts the map with every object at its pose.
    fn raycast_with_objects(&mut self, view: RaycastView) -> Option<&Raycaster<'s>>;

    /// Makes the planner's window, with moving objects where they will be so many seconds later.
    fn plan(&mut self, ahead_s: f32) -> PlanningReport;
}

/// An object that left the mapper.
pub struct RetiredVolume {
    /// The mapper's summary of it.
    pub summary: ObjectSummary,
    /// Blocks of the object's volume.
    pub volume: VolumeCopy,
}

/// A frame after its step.
pub struct FrameContext<'a, 's> {
    /// Position of the frame among those that the run takes, skipped frames included.
    pub position: usize,
    /// Row that is recorded for the frame.
    pub row: &'a FrameRow,
    /// The images and ground truth of the data set.
    pub images: &'a StereoImages,
    /// Objects that left the mapper in this step.
    pub retired: &'a [RetiredVolume],
    /// Blocks of the static map that were evicted in this step.
    pub evicted: &'a HashSet<BlockKey>,
    /// The map.
    pub view: &'a mut dyn MapView<'s>,
    /// Pictures of it that were made already.
    pub pictures: FramePictures,
}

/// The end of a run: every frame is mapped, and the map is still in memory.
pub struct EndContext<'a, 's> {
    /// The last frame.
    pub last: Option<&'a FrameRow>,
    /// Objects that left the mapper at the end.
    pub retired: &'a [RetiredVolume],
    /// The finished map from behind and above the last camera, as a JPEG file; empty without
    /// frames.
    pub overview_jpeg: Vec<u8>,
    /// The map.
    pub view: &'a mut dyn MapView<'s>,
}

/// A finished run: the map is on disk.
pub struct Finished {
    /// The slab, region by region.
    pub regions: Vec<Region>,
    /// Blocks of the map in memory at the end.
    pub blocks: usize,
    /// Voxels and blocks pruned after the last frame.
    pub pruned: PruneReport,
    /// The mesh written.
    pub mesh: Mesh,
    /// The mesh file.
    pub mesh_path: PathBuf,
    /// The block store.
    pub store: StoreStats,
    /// Loops that the run closed.
    pub loops: ClosedLoops,
}

/// Sees every frame and sums up in the end. Its fields are its part of a checkpoint.
pub trait Observer {
    /// Contribution of the observer to the record of the run.
    type Section;

    /// Returns the observer's files that grow frame by frame.
    fn files(&mut self) -> Vec<&mut GrowingFile> {
        Vec::new()
    }

    /// A checkpoint is about to be written: waits until files written since the last one are on the
    /// disk.
    ///
    /// # Errors
    /// The disk refuses.
    fn checkpoint(&mut self, _run: &ObservedRun<'_>) -> Result<(), ObserveError> {
        Ok(())
    }

    /// The run is resumed from a checkpoint: checks files written before it, and removes those
    /// written after it.
    ///
    /// # Errors
    /// A file is missing or differs, or cannot be removed.
    fn resume(&mut self, _run: &ObservedRun<'_>) -> Result<(), ObserveError> {
        Ok(())
    }

    /// Takes in a frame.
    ///
    /// # Errors
    /// The data set or the disk refuses.
    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError>;

    /// Takes in the end.
    ///
    /// # Errors
    /// The disk refuses.
    fn end(
        &mut self,
        _run: &ObservedRun<'_>,
        _end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        Ok(())
    }

    /// Sums up.
    ///
    /// # Errors
    /// The disk refuses.
    fn finish(
        self,
        run: &ObservedRun<'_>,
        finished: &Finished,
    ) -> Result<Self::Section, ObserveError>;
}

/// All observers, in the order in which they see a frame.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Observers {
    trajectory: TrajectoryObserver,
    keyframes: KeyframesObserver,
    gallery: GalleryObserver,
    recording: RecordingObserver,
    reference: ReferenceObserver,
    tracks: TracksObserver,
    objects: ObjectsObserver,
    blocks: BlocksObserver,
    block_history: BlockHistoryObserver,
    bounds: BoundsObserver,
    health: HealthObserver,
    instances: InstancesObserver,
    disparity: DisparityObserver,
    map_disparity: MapDisparityObserver,
    planning: PlanningObserver,
    mavlink: MavlinkObserver,
    inertial: InertialObserver,
    scene_export: SceneExportObserver,
    live: LiveObserver,
}

/// Findings of all observers.
#[derive(Clone, Debug)]
pub struct Sections {
    /// Poses, and their errors against ground truth.
    pub trajectory: TrajectorySection,
    /// Pictures.
    pub keyframes: KeyframesSection,
    /// Reason why the pictures for the viewer could not be written, if so.
    pub gallery_failure: Option<String>,
    /// Reason why the recording could not be written, if so.
    pub recording_failure: Option<String>,
    /// Input and map against a reference depth; `None` where the run has none.
    pub reference: Option<ReferenceSection>,
    /// Tracks, and their errors against ground truth.
    pub tracks: TracksSection,
    /// Reconstructed objects.
    pub objects: ObjectsSection,
    /// Blocks of the map: made, pruned, evicted, stored.
    pub blocks: BlocksSection,
    /// Use of each bound.
    pub bounds: BoundsSection,
    /// Counts of everything refused.
    pub health: HealthSection,
    /// Messages to an autopilot; `None` where the run sends none.
    pub mavlink: Option<MavlinkSection>,
    /// The inertial unit against the camera's path; `None` where the source has none.
    pub inertial: Option<UnitFindings>,
}

impl Observers {
    /// Direction that points up in the world of the first camera, if an inertial unit tells.
    pub fn up_world(&self) -> Option<[f32; 3]> {
        self.inertial.up_world()
    }

    /// Returns the reason why a file of an observer could not be written, if so. The observer
    /// continues without the file.
    pub fn failure(&self) -> Option<&str> {
        self.objects.failure().or(self.gallery.failure()).or(self.recording.failure())
    }
}

impl Observer for Observers {
    type Section = Sections;

    fn files(&mut self) -> Vec<&mut GrowingFile> {
        self.trajectory
            .files()
            .into_iter()
            .chain(self.tracks.files())
            .chain(self.block_history.files())
            .collect()
    }

    fn checkpoint(&mut self, run: &ObservedRun<'_>) -> Result<(), ObserveError> {
        self.objects.checkpoint(run)
    }

    fn resume(&mut self, run: &ObservedRun<'_>) -> Result<(), ObserveError> {
        self.gallery.resume(run)?;
        self.objects.resume(run)
    }

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        // In the order of the fields. The first error ends the frame, and with it the run.
        self.trajectory.frame(run, frame)?;
        self.keyframes.frame(run, frame)?;
        self.gallery.frame(run, frame)?;
        self.recording.frame(run, frame)?;
        self.reference.frame(run, frame)?;
        self.tracks.frame(run, frame)?;
        self.objects.frame(run, frame)?;
        self.blocks.frame(run, frame)?;
        self.block_history.frame(run, frame)?;
        self.bounds.frame(run, frame)?;
        self.health.frame(run, frame)?;
        self.instances.frame(run, frame)?;
        self.disparity.frame(run, frame)?;
        self.map_disparity.frame(run, frame)?;
        self.mavlink.frame(run, frame)?;
        self.inertial.frame(run, frame)?;
        self.planning.frame(run, frame)?;
        self.scene_export.frame(run, frame)?;
        self.live.frame(run, frame)
    }

    fn end(
        &mut self,
        run: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        // One that fails does not keep the others from their ends.
        let ends = [
            self.keyframes.end(run, end),
            self.gallery.end(run, end),
            self.recording.end(run, end),
            self.objects.end(run, end),
            self.block_history.end(run, end),
            self.map_disparity.end(run, end),
            self.planning.end(run, end),
        ];
        ends.into_iter().collect()
    }

    fn finish(self, run: &ObservedRun<'_>, finished: &Finished) -> Result<Sections, ObserveError> {
        // Those without a section of the summary.
        self.planning.finish(run, finished)?;
        self.scene_export.finish(run, finished)?;
        self.block_history.finish(run, finished)?;
        self.live.finish(run, finished)?;
        Ok(Sections {
            trajectory: self.trajectory.finish(run, finished)?,
            keyframes: self.keyframes.finish(run, finished)?,
            gallery_failure: self.gallery.finish(run, finished)?,
            recording_failure: self.recording.finish(run, finished)?,
            reference: self.reference.finish(run, finished)?,
            tracks: self.tracks.finish(run, finished)?,
            objects: self.objects.finish(run, finished)?,
            blocks: self.blocks.finish(run, finished)?,
            bounds: self.bounds.finish(run, finished)?,
            health: self.health.finish(run, finished)?,
            mavlink: self.mavlink.finish(run, finished)?,
            inertial: self.inertial.finish(run, finished)?,
        })
    }
}

/// Chooses `count` of `frames` positions, evenly, the last among them.
fn spread(frames: usize, count: usize) -> impl Fn(usize) -> bool {
    let count = count.min(frames).max(1);
    move |at| ((at + 1) * count) / frames > (at * count) / frames
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
