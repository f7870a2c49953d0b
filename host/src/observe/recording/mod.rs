//! The run as an MCAP recording, written frame by frame: images, disparity, poses, objects, what
//! the map shows, the planner's window, and figures, in Foxglove's schemas as JSON. Memory: one
//! chunk of the file, and 100 bytes for each chunk before.

mod messages;
mod schemas;

use super::{
    EndContext, Finished, FrameContext, ObserveError, ObservedRun, Observer, PlanningLayers,
    frame_pictures, frame_pictures::Shown, pictures,
};
use crate::formats::shown_pose;
use crate::owned;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::view::RaycastView;
use mcap::records::MessageHeader;
use messages::Stamp;
use schemas::{TOPICS, Topic};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs::File;
use std::io::BufWriter;

/// Name of the file in the run folder.
pub const RECORDING_FILE: &str = "run.mcap";
/// Interval at which the map and the planner's window are recorded, frames.
const MAP_EVERY: usize = 10;
/// Poses in the trajectory at the end, at most.
const MAX_POSES: usize = 5_000;

/// Writes the recording. What the disk refuses ends it, and the run goes on without it.
#[derive(Default, Serialize, Deserialize)]
pub struct RecordingObserver {
    #[serde(skip)]
    recording: Option<Recording>,
    failure: Option<String>,
}

impl std::fmt::Debug for RecordingObserver {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("RecordingObserver")
            .field("failure", &self.failure)
            .finish_non_exhaustive()
    }
}

/// A file under construction.
struct Recording {
    writer: mcap::Writer<BufWriter<File>>,
    channels: [u16; TOPICS.len()],
    sequence: u32,
    /// Every so many frames' poses are in the trajectory, so that there are at most [`MAX_POSES`].
    poses_every: usize,
    poses: Vec<Transform>,
}

impl Recording {
    fn begin(run: &ObservedRun<'_>) -> Result<Self, mcap::McapError> {
        let file = BufWriter::new(owned::create_file(&run.folder.join(RECORDING_FILE))?);
        let mut writer = mcap::WriteOptions::new().library("dynvox").create(file)?;
        // Channels are added once, and found by the topic's number.
        let mut channels = [0; TOPICS.len()];
        for (channel, topic) in channels.iter_mut().zip(TOPICS) {
            let schema = writer.add_schema(
                topic.schema(),
                "jsonschema",
                topic.json_schema().to_string().as_bytes(),
            )?;
            *channel = writer.add_channel(schema, topic.name(), "json", &Default::default())?;
        }
        Ok(Self { writer, channels, sequence: 0, poses_every: 1, poses: Vec::new() })
    }

    fn write(
        &mut self,
        topic: Topic,
        time_ns: u64,
        message: &Value,
    ) -> Result<(), mcap::McapError> {
        self.sequence += 1;
        let channel_id = self.channels[topic as usize];
        let header = MessageHeader {
            channel_id,
            sequence: self.sequence,
            log_time: time_ns,
            // Both times are those of the data: a recording has no other clock.
            publish_time: time_ns,
        };
        self.writer.write_to_known_channel(&header, message.to_string().as_bytes())
    }

    /// Adds a pose to the trajectory, and thins it out when it is long.
    fn note_pose(&mut self, position: usize, t_world_camera: &Transform) {
        if position.is_multiple_of(self.poses_every) {
            self.poses.push(*t_world_camera);
        }
        if self.poses.len() > MAX_POSES {
            self.poses = self.poses.iter().step_by(2).copied().collect();
            self.poses_every *= 2;
        }
    }

    fn frame(
        &mut self,
        frame: &mut FrameContext<'_, '_>,
        run: &ObservedRun<'_>,
    ) -> Result<(), mcap::McapError> {
        let (time_ns, t_world_camera) = (frame.row.time_ns(), frame.row.report.t_world_camera);
        let (stamp, segment) = (Stamp(time_ns), frame.row.report.segment);
        let shown = frame.row.shown_t_world_camera();
        self.note_pose(frame.position, &shown);
        self.write(Topic::Transform, time_ns, &messages::camera(stamp, &shown))?;
        if run.plan.capacity.keyframes > 0 && segment == MapSegment::FIRST {
            let change = frame.view.mapper().t_closed_driven();
            self.write(Topic::Transform, time_ns, &messages::driven_world(stamp, &change))?;
        }
        self.write(Topic::Pose, time_ns, &messages::pose(stamp, &shown))?;
        // The picture may be missing, as in a run on depth only.
        if let Some(left) = frame_pictures::left(frame) {
            self.write(
                Topic::Calibration,
                time_ns,
                &messages::calibration(
                    stamp,
                    &run.plan.config.rig,
                    run.plan.dataset.size().0,
                    left.dimensions(),
                ),
            )?;
            self.write(Topic::Left, time_ns, &messages::image(stamp, &pictures::jpeg(&left)))?;
        }
        let disparity = frame.jpeg(Shown::Disparity);
        self.write(Topic::Disparity, time_ns, &messages::image(stamp, &disparity))?;
        self.write(
            Topic::Objects,
            time_ns,
            &messages::objects(stamp, segment, frame.view.mapper()),
        )?;
        self.write(Topic::Figures, time_ns, &messages::figures(stamp, frame.row))?;
        // Clouds are large: one every few frames.
        let view = RaycastView::from(&t_world_camera);
        if frame.position.is_multiple_of(MAP_EVERY)
            && let Some(seen) =
                frame.view.raycast(RaycastView { every: messages::POINT_EVERY, ..view })
            && let Some(cloud) = messages::cloud(stamp, seen, &run.plan.config.rig)
        {
            self.write(Topic::Map, time_ns, &cloud)?;
        }
        if frame.position.is_multiple_of(MAP_EVERY) && !frame.view.mapper().planning().is_empty() {
            frame.view.plan(0.0);
            let layers = PlanningLayers::from_planning(frame.view.mapper().planning());
            if let Some(mut layers) = layers {
                layers.t_world_corner = shown_pose(segment, &layers.t_world_corner);
                self.write(Topic::Planning, time_ns, &messages::planning(stamp, &layers))?;
            }
        }
        Ok(())
    }
}

impl RecordingObserver {
    /// Returns the reason why there is no recording, if so.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Does something with the recording, begun here if need be, unless it has failed.
    fn with(
        &mut self,
        run: &ObservedRun<'_>,
        write: impl FnOnce(&mut Recording) -> Result<(), mcap::McapError>,
    ) {
        // A recording that failed once is given up: the run itself goes on.
        if !run.plan.request.exports.record || self.failure.is_some() {
            return;
        }
        let done = match &mut self.recording {
            Some(recording) => write(recording),
            None => {
                Recording::begin(run).and_then(|recording| write(self.recording.insert(recording)))
            }
        };
        if let Err(error) = done {
            self.recording = None;
            self.failure = Some(error.to_string());
            // It may not exist.
            let _ = owned::remove_file(&run.folder.join(RECORDING_FILE));
        }
    }
}

impl Observer for RecordingObserver {
    /// Reason why there is no recording, if so.
    type Section = Option<String>;

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        self.with(run, |recording| recording.frame(frame, run));
        Ok(())
    }

    fn end(
        &mut self,
        run: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let Some(last) = end.last else { return Ok(()) };
        self.with(run, |recording| {
            let trajectory = messages::trajectory(Stamp(last.time_ns()), recording.poses.iter());
            recording.write(Topic::Trajectory, last.time_ns(), &trajectory)?;
            recording.writer.finish().map(drop)
        });
        Ok(())
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<Option<String>, ObserveError> {
        Ok(self.failure)
    }
}
