//! Reconstructed objects: meshes of those that leave the mapper, and their poses. An object leaves
//! within a step, which must not wait for its mesh: its blocks are copied there, and meshed here,
//! after the step.

use super::thumbnail::thumbnail;
use super::{
    EndContext, Finished, FrameContext, ObserveError, ObservedRun, Observer, RetiredVolume,
    WrittenFile,
};
use crate::evaluate::objects::true_object;
use crate::evaluate::surfaces::{SeenSide, SurfaceFigures, TrueView};
use crate::evaluate::swept::Swept;
use crate::formats::{Axes, Mesh, PlyWriter, shown_pose, tum_line, write_numbered};
use crate::owned;
use crate::scene::OBJECTS_FOLDER;
use dynvox_core::geometry::Transform;
use dynvox_core::objects::ObjectSummary;
use dynvox_core::tracking::{Class, MotionState, TrackReport};
use dynvox_core::view::{Triangle, Vertex};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Objects shown with a thumbnail, at most: those fused most often.
const THUMBNAILS: usize = 24;

/// An object handed over by the mapper.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReconstructedObject {
    /// Number of its track.
    pub id: u32,
    /// Number of the trajectory segment within the track.
    pub segment: u32,
    /// Name of its files: the track's number; `7-2` for the second object of track 7.
    pub name: String,
    /// Class of the object.
    pub class: Class,
    /// Last motion state of the object.
    pub state: MotionState,
    /// Frames fused.
    pub frames: u32,
    /// Blocks of its volume.
    pub blocks: usize,
    /// Triangles of its mesh.
    pub triangles: u64,
    /// Errors of the object's mesh against the true surface, where that is known.
    pub surface: Option<SurfaceFigures>,
    /// Views of the object's mesh from three sides, as a JPEG file; empty for objects beyond the
    /// number shown.
    pub thumbnail_jpeg: Vec<u8>,
}

/// Objects of a run.
#[derive(Clone, Debug)]
pub struct ObjectsSection {
    /// All objects handed over, in that order.
    pub objects: Vec<ReconstructedObject>,
    /// Names of objects whose files could not be written.
    pub unwritten: Vec<String>,
    /// Triangles of the static map in the volume that moving objects swept; known where the truth
    /// is exact.
    pub swept_triangles: Option<u64>,
}

/// A pose of an object in a frame.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct PosedAt {
    /// Number of the frame.
    frame: usize,
    /// Time of the pose, ns.
    time_ns: u64,
    t_world_object: Transform,
}

/// Collects objects.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct ObjectsObserver {
    /// Poses of each object that is still in the mapper, in the frames it was fused in: by track
    /// and segment.
    paths: BTreeMap<(u32, u32), Vec<PosedAt>>,
    /// The true surface seen of each, where that is known.
    sides: BTreeMap<(u32, u32), SeenSide>,
    retired: Vec<ReconstructedObject>,
    /// Files of the object at the last checkpoint.
    files: Vec<WrittenFile>,
    /// Names of files written since then.
    unsynced: Vec<String>,
    /// Names of objects whose files could not be written, and why the first of them could not.
    unwritten: Vec<String>,
    failure: Option<String>,
    swept: Option<Swept>,
}

impl Observer for ObjectsObserver {
    type Section = ObjectsSection;

    fn checkpoint(&mut self, run: &ObservedRun<'_>) -> Result<(), ObserveError> {
        while let Some(name) = self.unsynced.last() {
            self.files.push(WrittenFile::synced(&run.folder, name.clone())?);
            self.unsynced.pop();
        }
        Ok(())
    }

    /// Removes files of objects that left after the checkpoint: they will leave again.
    fn resume(&mut self, run: &ObservedRun<'_>) -> Result<(), ObserveError> {
        self.files.iter().try_for_each(|file| file.check(&run.folder))?;
        let folder = run.folder.join(OBJECTS_FOLDER);
        let failed = |source| ObserveError::Write { path: folder.clone(), source };
        if !folder.is_dir() {
            return Ok(());
        }
        for entry in folder.read_dir().map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let known = |one: &ReconstructedObject| {
                files(&one.name).iter().any(|file| entry.file_name() == file.as_str())
            };
            if !self.retired.iter().any(known) {
                owned::remove_own(&entry.path()).map_err(failed)?;
            }
        }
        // Where none is left there is no folder either.
        if self.retired.is_empty() { owned::remove_folder(&folder).map_err(failed) } else { Ok(()) }
    }

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        // First those that left: their tables end before this frame.
        self.write_all(run, frame.retired);
        for object in fused(frame) {
            self.paths.entry((object.id, object.segment_id)).or_default().push(PosedAt {
                frame: frame.row.frame,
                time_ns: frame.row.time_ns(),
                t_world_object: shown_pose(frame.row.report.segment, &object.t_world_object),
            });
        }
        self.note_truth(run, frame);
        Ok(())
    }

    fn end(
        &mut self,
        run: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        self.write_all(run, end.retired);
        Ok(())
    }

    fn finish(
        self,
        _: &ObservedRun<'_>,
        finished: &Finished,
    ) -> Result<ObjectsSection, ObserveError> {
        // Swept triangles are counted in the mesh as written: without it there is no figure.
        let mesh = finished.mesh_path.is_file();
        let swept = self
            .swept
            .as_ref()
            .filter(|_| mesh)
            .and_then(|swept| swept.triangles(&finished.mesh_path).ok());
        // A mesh that cannot be read again has no such figure, and the run keeps the rest.
        Ok(ObjectsSection {
            objects: self.retired,
            unwritten: self.unwritten,
            swept_triangles: swept,
        })
    }
}

/// Objects fused in a frame.
fn fused(frame: &FrameContext<'_, '_>) -> Vec<ObjectSummary> {
    let all = frame.view.mapper().objects().map(|(summary, _)| *summary);
    all.filter(|summary| summary.last_frame == frame.row.report.frame).collect()
}

impl ObjectsObserver {
    /// Notes what is really there, where the truth is exact: the volume moving objects sweep, and
    /// the surfaces that are seen.
    fn note_truth(&mut self, run: &ObservedRun<'_>, frame: &FrameContext<'_, '_>) {
        // Only synthetic recordings know the truth.
        let (Some(truth), Some(exact)) = (&frame.images.objects, &frame.images.exact) else {
            return;
        };
        // The map's world and the true one differ by the drift so far.
        let t_map_world = frame.row.report.t_world_camera * truth.t_world_camera.inverse();
        // What was swept is compared with the mesh's file.
        let t_shown_world = shown_pose(frame.row.report.segment, &t_map_world);
        let swept = self.swept.get_or_insert_default();
        truth.objects.iter().for_each(|object| swept.add(object, &t_shown_world));
        let Some(depth_m) = exact.depth_m.view() else { return };
        let view = TrueView {
            rig: &run.plan.config.rig,
            depth_m,
            t_world_camera: truth.t_world_camera,
            far_m: f64::from(run.plan.config.objects.far_m),
        };
        let tracks: Vec<TrackReport> =
            frame.view.mapper().tracks().filter(|track| track.detected).collect();
        // Only objects fused in this frame have a pose to compare.
        for object in fused(frame) {
            let track = tracks.iter().find(|track| track.id == object.id);
            if let Some(truth) = track.and_then(|track| true_object(&track.pixels, truth)) {
                let t_truth_object =
                    truth.t_world_object.inverse() * t_map_world.inverse() * object.t_world_object;
                self.sides.entry((object.id, object.segment_id)).or_default().add(
                    &view,
                    truth,
                    &t_truth_object,
                );
            }
        }
    }

    /// Returns the reason why an object's files could not be written, if so.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Writes objects. One that cannot be written is noted, and the run goes on without it.
    fn write_all(&mut self, run: &ObservedRun<'_>, retired: &[RetiredVolume]) {
        for one in retired {
            let name = self.name_of(one);
            // Half of an object's files would look like a whole object.
            if let Err(error) = self.write(run, one, &name) {
                files(&name).iter().for_each(|file| {
                    drop(owned::remove_file(&run.folder.join(OBJECTS_FOLDER).join(file)))
                });
                self.unwritten.push(name);
                self.failure.get_or_insert_with(|| error.to_string());
            }
        }
    }

    /// The track's number; `7-2` for the second object of track 7.
    fn name_of(&self, RetiredVolume { summary, .. }: &RetiredVolume) -> String {
        let before = self.retired.iter().filter(|known| known.id == summary.id).count();
        if before == 0 { summary.id.to_string() } else { format!("{}-{}", summary.id, before + 1) }
    }

    /// Writes an object's mesh and poses. One without triangles leaves no file.
    fn write(
        &mut self,
        run: &ObservedRun<'_>,
        RetiredVolume { summary, volume }: &RetiredVolume,
        name: &str,
    ) -> Result<(), ObserveError> {
        let poses = self.paths.remove(&(summary.id, summary.segment_id)).unwrap_or_default();
        let side = self.sides.remove(&(summary.id, summary.segment_id));
        let folder = run.folder.join(OBJECTS_FOLDER);
        let mut triangles = Vec::new();
        let meshed = volume
            .triangles(&run.plan.config.mesh, &mut |triangle: Triangle| triangles.push(triangle));
        meshed.map_err(|source| ObserveError::Write { path: folder.clone(), source })?;
        // Too small a part was seen for a surface.
        if triangles.is_empty() {
            return Ok(());
        }
        let object = MeshedObject { id: summary.id, name, triangles: &triangles };
        write_files(&folder, &object, run.plan.request.exports.axes, &poses)?;
        // Synchronised with the disk at the next checkpoint, not one by one.
        self.unsynced.extend(files(name).map(|file| format!("{OBJECTS_FOLDER}/{file}")));
        self.retired.push(ReconstructedObject {
            id: summary.id,
            segment: summary.segment_id,
            name: name.to_owned(),
            class: summary.class,
            state: summary.state,
            frames: summary.frames,
            blocks: volume.blocks(),
            triangles: triangles.len() as u64,
            surface: side
                .and_then(|side| side.compare(&triangles, f64::from(volume.config().voxel_size_m))),
            thumbnail_jpeg: thumbnail(&triangles),
        });
        self.limit_thumbnails();
        Ok(())
    }

    /// Drops the thumbnail of the object fused least often when there are too many.
    fn limit_thumbnails(&mut self) {
        // The newest one has its thumbnail already, so that it may be the one to go.
        let mut shown: Vec<_> =
            self.retired.iter_mut().filter(|one| !one.thumbnail_jpeg.is_empty()).collect();
        if shown.len() > THUMBNAILS
            && let Some(least) = shown.iter_mut().min_by_key(|one| one.frames)
        {
            least.thumbnail_jpeg = Vec::new();
        }
    }
}

/// The files of an object: its mesh in its own frame and where it was last seen, its poses by frame
/// and by time.
fn files(name: &str) -> [String; 4] {
    [
        format!("{name}.ply"),
        format!("{name}_world.ply"),
        format!("{name}_kitti.txt"),
        format!("{name}_tum.txt"),
    ]
}

/// An object as its files show it.
struct MeshedObject<'a> {
    id: u32,
    /// Name of its files.
    name: &'a str,
    /// Surface, in the object's own frame.
    triangles: &'a [Triangle],
}

/// The frame of reference of a mesh.
struct MeshFrame<'a> {
    /// Name, for the file's head.
    name: &'a str,
    axes: Axes,
    /// The object's own frame to this one.
    t_frame_object: &'a Transform,
}

/// Writes an object's files; those in the world in the axes given.
fn write_files(
    folder: &Path,
    object: &MeshedObject<'_>,
    axes: Axes,
    poses: &[PosedAt],
) -> Result<(), ObserveError> {
    let [mesh, world_mesh, kitti, tum] = files(object.name).map(|file| folder.join(file));
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |source| ObserveError::Write { path, source }
    };
    // In the world the mesh stands where the object was last.
    owned::create_folder(folder).map_err(failed(folder))?;
    let last = poses.last().map(|pose| pose.t_world_object).unwrap_or_default();
    let own = MeshFrame {
        name: "the object's own frame: the camera's when it was first seen",
        axes: Axes::Camera,
        t_frame_object: &Transform::IDENTITY,
    };
    let world = MeshFrame { name: "the first camera", axes, t_frame_object: &last };
    write_mesh(&mesh, object, &own).map_err(failed(&mesh))?;
    write_mesh(&world_mesh, object, &world).map_err(failed(&world_mesh))?;
    // Both forms of poses: by frame number, and by time.
    let mut by_frame = Vec::new();
    let numbered: Vec<_> = poses.iter().map(|pose| (pose.frame, pose.t_world_object)).collect();
    write_numbered(&mut by_frame, &numbered)
        .and_then(|()| owned::write(&kitti, &by_frame))
        .map_err(failed(&kitti))?;
    let by_time: String =
        poses.iter().map(|pose| tum_line(pose.time_ns, &pose.t_world_object)).collect();
    owned::write(&tum, by_time.as_bytes()).map_err(failed(&tum))
}

/// Writes an object's mesh in a frame of reference.
fn write_mesh(
    path: &Path,
    object: &MeshedObject<'_>,
    frame: &MeshFrame<'_>,
) -> std::io::Result<Mesh> {
    // The mesh is in the object's frame, in f32; the pose is applied in f64, since the world is
    // large.
    let moved = |position_m: [f32; 3]| {
        frame.t_frame_object.transform_point(position_m.map(f64::from)).map(|metres| metres as f32)
    };
    let mut ply = PlyWriter::begin_in(path, frame.name, frame.axes)?;
    ply.begin_object(object.id);
    for Triangle { vertices } in object.triangles {
        ply.triangle(
            vertices.map(|vertex| Vertex { position_m: moved(vertex.position_m), ..vertex }),
        );
    }
    ply.finish()
}
