//! Objects that leave the mapper: their meshes and where they were, written as they go.

use crate::evaluation::surfaces::{SeenSide, SurfaceFigures};
use crate::export::{FolderError, PlyWriter, portrait, write_numbered};
use dynvox_core::geometry::Transform;
use dynvox_core::instances::{Class, ObjectSink, RetiredObject, State};
use dynvox_core::volume::{MeshConfig, Triangle};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Objects shown with a picture, at most: those fused most often.
const PORTRAITS: usize = 24;

/// An object handed over by the mapper.
#[derive(Clone, Debug)]
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

/// Takes objects that leave the mapper and writes their meshes.
pub struct Kept {
    folder: PathBuf,
    mesh: MeshConfig,
    /// Where each object that is still in the mapper was when it was fused: by track and chain.
    paths: BTreeMap<(u32, u32), Vec<(usize, Transform)>>,
    /// What was really there of each, where that is known.
    sides: BTreeMap<(u32, u32), SeenSide>,
    kept: Vec<KeptObject>,
    failed: Option<FolderError>,
}

impl ObjectSink for Kept {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        // The run ends with the first failure; there is nothing to be done about more.
        if self.failed.is_none() {
            self.failed = self.take(&object).err();
        }
    }
}

impl Kept {
    /// A sink that writes into `folder`, which is made with the first object.
    pub(super) fn new(folder: PathBuf, mesh: MeshConfig) -> Self {
        Self {
            folder,
            mesh,
            paths: BTreeMap::new(),
            sides: BTreeMap::new(),
            kept: Vec::new(),
            failed: None,
        }
    }

    /// Notes where an object is in a frame.
    pub(super) fn follow(&mut self, frame: usize, id: u32, chain: u32, t_world_object: Transform) {
        self.paths.entry((id, chain)).or_default().push((frame, t_world_object));
    }

    /// What was really there of an object.
    pub(super) fn side(&mut self, id: u32, chain: u32) -> &mut SeenSide {
        self.sides.entry((id, chain)).or_default()
    }

    /// All objects written, in that order.
    pub(super) fn finish(&mut self) -> Result<Vec<KeptObject>, FolderError> {
        match self.failed.take() {
            Some(failed) => Err(failed),
            None => Ok(std::mem::take(&mut self.kept)),
        }
    }

    fn take(&mut self, object: &RetiredObject<'_, '_>) -> Result<(), FolderError> {
        let summary = &object.summary;
        let poses = self.paths.remove(&(summary.id, summary.chain)).unwrap_or_default();
        let side = self.sides.remove(&(summary.id, summary.chain));
        let mut triangles: Vec<Triangle> = Vec::new();
        object.volume.triangles(&self.mesh, &mut |triangle| triangles.push(triangle));
        if triangles.is_empty() {
            return Ok(());
        }
        let before = self.kept.iter().filter(|known| known.id == summary.id).count();
        let name = if before == 0 { summary.id.to_string() } else { format!("{}-{}", summary.id, before + 1) };
        let path = self.folder.join(format!("{name}.ply"));
        let written = std::fs::create_dir_all(&self.folder).and_then(|()| {
            let mut ply = PlyWriter::begin_in(&path, "the object's own frame: the camera's when it was first seen")?;
            triangles.iter().for_each(|one| ply.triangle(one.vertices.map(|vertex| (vertex.position_m, vertex.colour))));
            ply.finish()
        });
        written.map_err(|source| FolderError::Write { path, source })?;
        let path = self.folder.join(format!("{name}_kitti.txt"));
        let mut text = Vec::new();
        let written = write_numbered(&mut text, &poses).and_then(|()| std::fs::write(&path, text));
        written.map_err(|source| FolderError::Write { path, source })?;
        self.kept.push(KeptObject {
            id: summary.id,
            chain: summary.chain,
            name,
            class: summary.class,
            state: summary.state,
            frames: summary.frames,
            blocks: object.volume.pool().len(),
            triangles: triangles.len() as u64,
            surface: side.and_then(|side| side.compare(&triangles, f64::from(object.volume.config().voxel_size_m))),
            portrait_png: portrait(&triangles),
        });
        self.thin_portraits();
        Ok(())
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
