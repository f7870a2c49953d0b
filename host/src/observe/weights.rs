//! A volume's surface with how often it was observed.

use crate::formats::MeshVertex;
use dynvox_core::view::MeshConfig;
use dynvox_core::volume::{BlockCoord, Volume};

/// Hands the triangles of the blocks that `is_selected` picks to `sink`, in the volume's order. A corner's weight is that of the lattice point nearest
/// to it. Returns how many triangles there were.
pub fn weighed_triangles(
    volume: &Volume<'_>,
    mesh: &MeshConfig,
    is_selected: impl Fn(BlockCoord) -> bool,
    sink: &mut impl FnMut([MeshVertex; 3]),
) -> u64 {
    let (mut sampler, voxel_size_m) = (volume.sampler(), volume.config().voxel_size_m);
    // Triangles of a cell share corners.
    let mut last: Option<[MeshVertex; 3]> = None;
    volume.triangles_of(mesh, is_selected, &mut |triangle| {
        let corners = triangle.vertices.map(|vertex| {
            let known = last.iter().flatten().find(|known| known.position_m == vertex.position_m);
            let weight = known.map_or_else(
                || {
                    // A corner lies between two points that were observed, so the nearest was.
                    let point = vertex.position_m.map(|metres| (metres / voxel_size_m).round() as i32);
                    sampler.voxel(point).map_or(0, |voxel| voxel.weight)
                },
                |known| known.weight,
            );
            MeshVertex { position_m: vertex.position_m, colour: vertex.colour, weight }
        });
        last = Some(corners);
        sink(corners);
    })
}
