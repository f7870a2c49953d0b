//! A run folder read as a scene.

use super::simplify::simplified;
use super::tables::{FrameColumns, TrackColumns, read_rows};
use super::{
    BlockHistory, IndexedMesh, OBJECTS_FOLDER, PICTURES_FOLDER, PICTURES_INDEX, PictureIndex,
    PlanningWindow, Scene, SceneFrame, SceneObject, SurfaceErrorMap,
};
use crate::formats::{
    FRAMES_FILE, FormatError, MAP_FILE, TRACKS_FILE, TRAJECTORY_FILE, TRUE_TRAJECTORY_FILE,
    read_numbered, read_poses, read_text,
};
use dynvox_core::geometry::Transform;
use std::collections::BTreeMap;
use std::path::Path;

/// Frames at most: of a longer run every second, third and so on is shown.
const MAX_FRAMES: usize = 5_000;
/// Objects may have this share of all triangles.
const OBJECT_SHARE: usize = 5;
/// Triangles of one object at most.
const MAX_OBJECT_TRIANGLES: usize = 20_000;
/// Triangles of one object that are always granted.
const LEAST_OBJECT_TRIANGLES: usize = 500;

impl Scene {
    /// Reads a run folder: its map, objects, trajectories, tables and list of pictures. What the
    /// run could not write is left out.
    ///
    /// # Errors
    /// There is no trajectory or no table of frames, or a file is damaged.
    pub fn read(folder: &Path, max_triangles: usize) -> Result<Self, FormatError> {
        // Objects first: the map gets the triangles that they leave.
        let objects = objects(&folder.join(OBJECTS_FOLDER), max_triangles / OBJECT_SHARE)?;
        let of_objects: usize = objects.iter().map(|object| object.mesh.triangles.len()).sum();
        let map = folder.join(MAP_FILE);
        let (static_map, static_triangles) = if map.is_file() {
            simplified(&map, true, max_triangles.saturating_sub(of_objects))?
        } else {
            (IndexedMesh::default(), 0)
        };
        let (frames, truth) = frames(folder)?;
        Ok(Self {
            frames,
            truth,
            static_map,
            static_triangles,
            blocks: BlockHistory::read(folder)?,
            errors: SurfaceErrorMap::read(folder)?,
            planning: PlanningWindow::read(folder)?,
            objects,
            pictures: pictures(folder)?,
        })
    }
}

/// Track and name of the objects in a folder, in this order.
///
/// # Errors
/// The folder cannot be read.
pub fn object_files(folder: &Path) -> Result<Vec<(u32, String)>, FormatError> {
    let mut names = Vec::new();
    for entry in folder.read_dir().map_err(FormatError::read(folder))? {
        let name =
            entry.map_err(FormatError::read(folder))?.file_name().to_string_lossy().into_owned();
        let name = name.strip_suffix(".ply").unwrap_or_default().to_owned();
        // The mesh in world coordinates has a word in its name.
        let numbers: Option<Vec<u32>> = name.split('-').map(|number| number.parse().ok()).collect();
        if let Some(&id) = numbers.as_deref().and_then(<[u32]>::first) {
            names.push((id, name));
        }
    }
    names.sort();
    Ok(names)
}

/// The objects in a folder, by track and then by name.
fn objects(folder: &Path, max_triangles: usize) -> Result<Vec<SceneObject>, FormatError> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let names = object_files(folder)?;
    // Objects share the triangles, but each has enough to be recognised.
    let each =
        (max_triangles / names.len().max(1)).clamp(LEAST_OBJECT_TRIANGLES, MAX_OBJECT_TRIANGLES);
    let object = |(id, name): (u32, String)| {
        let t_world_object = read_numbered(&folder.join(format!("{name}_kitti.txt")))?;
        let (mesh, _) = simplified(&folder.join(format!("{name}.ply")), false, each)?;
        Ok(SceneObject { name, id, t_world_object, mesh })
    };
    names.into_iter().map(object).collect()
}

/// The frames that are shown, and the true poses of the same.
fn frames(folder: &Path) -> Result<(Vec<SceneFrame>, Vec<Transform>), FormatError> {
    let mut rows: Vec<FrameColumns> = Vec::new();
    read_rows(&folder.join(FRAMES_FILE), |row| rows.push(row))?;
    let poses = read_poses(&folder.join(TRAJECTORY_FILE))?.poses;
    // Only recordings with true poses have this file.
    let truth_file = folder.join(TRUE_TRAJECTORY_FILE);
    let truth = if truth_file.is_file() { read_poses(&truth_file)?.poses } else { Vec::new() };
    // Every n-th frame, so that a long run still fits a page.
    let every = rows.len().div_ceil(MAX_FRAMES).max(1);
    let frame = |(row, t_world_camera): (FrameColumns, Transform)| SceneFrame {
        row,
        t_world_camera,
        tracks: Vec::new(),
    };
    let mut frames: Vec<SceneFrame> =
        rows.into_iter().zip(poses).map(frame).step_by(every).collect();
    // Rows of the tracks come by frame; those of frames left out are passed over.
    let position: BTreeMap<usize, usize> =
        frames.iter().enumerate().map(|(at, frame)| (frame.row.frame, at)).collect();
    let tracks = folder.join(TRACKS_FILE);
    if tracks.is_file() {
        read_rows(&tracks, |track: TrackColumns| {
            if let Some(&at) = position.get(&track.frame) {
                frames[at].tracks.push(track);
            }
        })?;
    }
    Ok((frames, truth.into_iter().step_by(every).collect()))
}

/// The list of pictures; an empty one of a run without.
fn pictures(folder: &Path) -> Result<PictureIndex, FormatError> {
    let path = folder.join(PICTURES_FOLDER).join(PICTURES_INDEX);
    if !path.is_file() {
        return Ok(PictureIndex::default());
    }
    serde_json::from_str(&read_text(&path)?)
        .map_err(|error| FormatError::content(&path, error.to_string(), "Make the run again"))
}
