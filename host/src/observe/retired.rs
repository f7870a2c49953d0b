//! Objects that leave the mapper: their meshes and where they were. An object leaves within a step, which must not wait for its mesh: what its
//! volume holds is copied, and the rest is done after the step.

use super::thumbnail::portrait;
use super::volume_copy::VolumeCopy;
use crate::evaluate::surfaces::{SeenSide, SurfaceFigures};
use crate::formats::{PlyWriter, write_numbered};
use crate::run::{FolderError, RunFolder};
use dynvox_core::geometry::Transform;
use dynvox_core::objects::{ObjectSink, ObjectSummary, RetiredObject};
use dynvox_core::tracking::{Class, State};
use dynvox_core::view::{MeshConfig, Triangle};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Name of their folder in the run folder.
const FOLDER: &str = "objects";
/// Objects shown with a picture, at most: those fused most often.
const PORTRAITS: usize = 24;

/// An object handed over by the mapper.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct KeptObject {
    /// Number of its track.
    pub id: u32,
    /// Chain of poses within the track.
    pub chain: u32,
    /// Name of its files: the track's number; `7-2` for the second object of track 7.
    pub name: String,
    /// What it is.
    pub class: Class,
    /// What was last known of its motion.
    pub state: State,
    /// Frames fused.
    pub frames: u32,
    /// Blocks of its volume.
    pub blocks: usize,
    /// Triangles of its mesh.
    pub triangles: u64,
    /// Its mesh against the true surface, where that is known.
    pub surface: Option<SurfaceFigures>,
    /// Its mesh from three sides, as a PNG file; empty where there are enough others.
    pub portrait_png: Vec<u8>,
}

/// Objects that left the mapper, and what is known of those still in it.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Kept {
    /// Where each object that is still in the mapper was when it was fused: by track and chain.
    paths: BTreeMap<(u32, u32), Vec<(usize, Transform)>>,
    /// What was really there of each, where that is known.
    sides: BTreeMap<(u32, u32), SeenSide>,
    kept: Vec<KeptObject>,
}

/// Takes objects as they leave, and writes their meshes in the end.
pub struct KeptSink<'r> {
    into: &'r mut Kept,
    /// Made with the first object.
    folder: PathBuf,
    mesh: &'r MeshConfig,
    left: Vec<(ObjectSummary, VolumeCopy)>,
}

impl ObjectSink for KeptSink<'_> {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        self.left.push((object.summary, VolumeCopy::of(object.volume)));
    }
}

impl Kept {
    /// A sink for the objects that leave during a step, whose meshes go into the run folder.
    pub(crate) fn sink<'r>(&'r mut self, run: &RunFolder, mesh: &'r MeshConfig) -> KeptSink<'r> {
        KeptSink { into: self, folder: run.file(FOLDER), mesh, left: Vec::new() }
    }

    /// Removes files of objects that left after the run had been stopped: they will leave again.
    pub(crate) fn tidy(&self, run: &RunFolder) -> Result<(), FolderError> {
        let folder = run.file(FOLDER);
        let failed = |source| FolderError::Write { path: folder.clone(), source };
        if !folder.is_dir() {
            return Ok(());
        }
        for entry in folder.read_dir().map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let known = |one: &KeptObject| files(&one.name).iter().any(|file| entry.file_name() == file.as_str());
            if !self.kept.iter().any(known) {
                std::fs::remove_file(entry.path()).map_err(failed)?;
            }
        }
        // Where none is left there is no folder either.
        if self.kept.is_empty() { std::fs::remove_dir(&folder).map_err(failed) } else { Ok(()) }
    }

    /// Notes where an object is in a frame.
    pub(crate) fn follow(&mut self, frame: usize, id: u32, chain: u32, t_world_object: Transform) {
        self.paths.entry((id, chain)).or_default().push((frame, t_world_object));
    }

    /// What was really there of an object.
    pub(crate) fn side(&mut self, id: u32, chain: u32) -> &mut SeenSide {
        self.sides.entry((id, chain)).or_default()
    }

    /// All objects written, in that order.
    pub(crate) fn finish(&mut self) -> Vec<KeptObject> {
        std::mem::take(&mut self.kept)
    }

    /// Lets the picture of the object fused least often go when there are too many.
    fn thin_portraits(&mut self) {
        let shown = self.kept.iter_mut().filter(|one| !one.portrait_png.is_empty());
        let mut shown: Vec<_> = shown.collect();
        if shown.len() > PORTRAITS
            && let Some(least) = shown.iter_mut().min_by_key(|one| one.frames)
        {
            least.portrait_png = Vec::new();
        }
    }
}

impl KeptSink<'_> {
    /// Writes all that left.
    pub(crate) fn end(mut self) -> Result<(), FolderError> {
        let left = std::mem::take(&mut self.left);
        left.iter().try_for_each(|(summary, volume)| self.take(summary, volume))
    }

    fn take(&mut self, summary: &ObjectSummary, volume: &VolumeCopy) -> Result<(), FolderError> {
        let poses = self.into.paths.remove(&(summary.id, summary.chain)).unwrap_or_default();
        let side = self.into.sides.remove(&(summary.id, summary.chain));
        let mut triangles: Vec<Triangle> = Vec::new();
        let meshed = volume.triangles(self.mesh, &mut |triangle| triangles.push(triangle));
        meshed.map_err(|source| FolderError::Write { path: self.folder.clone(), source })?;
        if triangles.is_empty() {
            return Ok(());
        }
        let before = self.into.kept.iter().filter(|known| known.id == summary.id).count();
        let name = if before == 0 { summary.id.to_string() } else { format!("{}-{}", summary.id, before + 1) };
        let [mesh, poses_file] = files(&name);
        let path = self.folder.join(mesh);
        let written = std::fs::create_dir_all(&self.folder).and_then(|()| {
            let mut ply = PlyWriter::begin_in(&path, "the object's own frame: the camera's when it was first seen")?;
            triangles.iter().for_each(|one| ply.triangle(one.vertices.map(|vertex| (vertex.position_m, vertex.colour))));
            ply.finish()
        });
        written.map_err(|source| FolderError::Write { path, source })?;
        let path = self.folder.join(poses_file);
        let mut text = Vec::new();
        let written = write_numbered(&mut text, &poses).and_then(|()| std::fs::write(&path, text));
        written.map_err(|source| FolderError::Write { path, source })?;
        self.into.kept.push(KeptObject {
            id: summary.id,
            chain: summary.chain,
            name,
            class: summary.class,
            state: summary.state,
            frames: summary.frames,
            blocks: volume.blocks(),
            triangles: triangles.len() as u64,
            surface: side.and_then(|side| side.compare(&triangles, f64::from(volume.config().voxel_size_m))),
            portrait_png: portrait(&triangles),
        });
        self.into.thin_portraits();
        Ok(())
    }
}

/// The files of an object: its mesh, and where it was.
fn files(name: &str) -> [String; 2] {
    [format!("{name}.ply"), format!("{name}_kitti.txt")]
}
