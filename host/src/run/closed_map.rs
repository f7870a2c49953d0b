//! The map after all loops, as a file of the run's folder next to the map as it was driven.

use super::{FolderError, RunFolder};
use crate::formats::{CLOSED_MAP_FILE, MeshAxes, PlyWriter, ShownSegment};
use crate::owned;
use dynvox_core::Mapper;
use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::Slot;
use std::collections::BTreeSet;
use std::io;

/// Writes the mesh of the blocks in memory after all loops that were closed. Returns its triangles;
/// `None` where the camera came back to nothing: then it is the map as it was driven.
///
/// # Errors
/// The disk refuses; there is no file then.
pub(super) fn write(
    mapper: &Mapper<'_>,
    folder: &RunFolder,
    axes: MeshAxes,
) -> Result<Option<u64>, FolderError> {
    if !mapper.static_map().is_bent() {
        return Ok(None);
    }
    let path = folder.file(CLOSED_MAP_FILE);
    let written = PlyWriter::begin_with(&path, "the first camera", axes, has_colour(mapper))
        .and_then(|ply| triangles(mapper, ply));
    written.map(Some).map_err(|source| {
        // It may not exist.
        let _ = owned::remove_file(&path);
        FolderError::Write { path, source }
    })
}

fn triangles(mapper: &Mapper<'_>, mut ply: PlyWriter) -> io::Result<u64> {
    let volume = mapper.static_map();
    let keys = volume.pool().live().filter_map(|slot| volume.blocks().key(slot));
    let segments: BTreeSet<MapSegment> =
        keys.map(|key| volume.driven_segment(key.segment)).collect();
    for segment in segments {
        let mut shown = ShownSegment::new(segment, &mut ply);
        volume.closed_mesh(&mapper.config().mesh, segment, &mut shown);
    }
    Ok(ply.finish()?.triangles)
}

/// Returns true if the map has colour.
fn has_colour(mapper: &Mapper<'_>) -> bool {
    mapper.static_map().blocks().colour(Slot::new(0)).is_some()
}
