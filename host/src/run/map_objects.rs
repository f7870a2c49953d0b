//! Objects in `map.ply`, next to the static map.

use crate::formats::{PlyMesh, PlyVertex, PlyWriter, read_numbered};
use crate::request::MapObjects;
use crate::scene::{OBJECTS_FOLDER, object_files};
use dynvox_core::geometry::Transform;
use dynvox_core::view::Vertex;
use std::io;
use std::path::Path;

/// Adds the objects of a run folder.
///
/// # Errors
/// A file of an object cannot be read.
pub(super) fn add_objects(ply: &mut PlyWriter, run: &Path, which: MapObjects) -> io::Result<()> {
    let folder = run.join(OBJECTS_FOLDER);
    if which == MapObjects::None || !folder.is_dir() {
        return Ok(());
    }
    for (id, name) in object_files(&folder).map_err(io::Error::other)? {
        let poses =
            read_numbered(&folder.join(format!("{name}_kitti.txt"))).map_err(io::Error::other)?;
        let first = if which == MapObjects::All { 0 } else { poses.len().saturating_sub(1) };
        for (_, t_world_object) in &poses[first..] {
            ply.begin_object(id);
            let mesh =
                PlyMesh::open(&folder.join(format!("{name}.ply"))).map_err(io::Error::other)?;
            mesh.triangles(|corners| {
                ply.triangle(corners.map(|PlyVertex { vertex, .. }| Vertex {
                    position_m: moved(t_world_object, vertex.position_m),
                    ..vertex
                }));
            })?;
        }
    }
    Ok(())
}

/// A point in the frame that a pose leads to.
fn moved(pose: &Transform, position_m: [f32; 3]) -> [f32; 3] {
    pose.transform_point(position_m.map(f64::from)).map(|metres| metres as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axes;

    #[test]
    fn objects_stand_where_they_were_last_seen_and_say_which_they_are() {
        let folder = tempfile::TempDir::new().unwrap();
        drop(crate::owned::OwnedFolder::create(folder.path()).unwrap());
        let objects = folder.path().join(OBJECTS_FOLDER);
        std::fs::create_dir(&objects).unwrap();
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
            .map(|position_m| Vertex { position_m, ..Vertex::default() });
        let mut ply = PlyWriter::begin(&objects.join("7-2.ply")).unwrap();
        ply.triangle(corners);
        ply.finish().unwrap();
        std::fs::copy(objects.join("7-2.ply"), objects.join("7-2_world.ply")).unwrap();
        std::fs::write(
            objects.join("7-2_kitti.txt"),
            "3 1 0 0 5 0 1 0 0 0 0 1 0\n4 1 0 0 6 0 1 0 -1 0 0 1 20\n",
        )
        .unwrap();
        let path = folder.path().join("map.ply");
        let map = |which, axes| {
            let mut ply = PlyWriter::begin_in(&path, "a test", axes).unwrap();
            ply.triangle(corners);
            add_objects(&mut ply, folder.path(), which).unwrap();
            let (mesh, mut found) = (ply.finish().unwrap(), Vec::new());
            PlyMesh::open(&path)
                .unwrap()
                .triangles(|[first, ..]| found.push((first.object, first.vertex.position_m)))
                .unwrap();
            assert_eq!(
                (mesh.triangles, mesh.object_triangles),
                (found.len() as u64, found.len() as u64 - 1)
            );
            found
        };
        let [still, then, last] = [(0, [0.0; 3]), (7, [5.0, 0.0, 0.0]), (7, [6.0, -1.0, 20.0])];
        assert_eq!(map(MapObjects::None, Axes::Camera), [still]);
        assert_eq!(map(MapObjects::Last, Axes::Enu), [still, last], "readers turn the axes back");
        assert_eq!(map(MapObjects::All, Axes::Camera), [still, then, last]);
    }
}
