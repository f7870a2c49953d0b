//! A merged map as triangles.

use super::{Averages, FleetError};
use crate::formats::{Axes, Mesh, PlyWriter};
use crate::run::store::mesh::triangles;
use dynvox_core::Capacity;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::view::MeshConfig;
use dynvox_core::volume::VolumeConfig;
use hashbrown::HashSet;
use std::path::Path;

/// Writes the surface of a map as a PLY file; voxels below `min_weight` are left out.
///
/// # Errors
/// The disk refuses. Nothing half-written stays behind.
pub fn write_mesh(
    map: &mut Averages,
    out: &Path,
    min_weight: u8,
    axes: Axes,
) -> Result<Mesh, FleetError> {
    let volume = VolumeConfig {
        voxel_size_m: map.lattice.voxel_size_m,
        truncation_m: map.lattice.truncation_m,
        ..VolumeConfig::default()
    };
    // Distances were averaged with the voxels and the truncation of the map.
    let how = (&volume, &MeshConfig { min_weight });
    // Any profile's slab holds a cube of the map.
    let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    let (store, colour) = (&mut map.store, map.lattice.colour);
    let mut ply =
        PlyWriter::begin_with(out, "the world", axes, colour).map_err(FleetError::io(out))?;
    // No block is left out here: the set is empty.
    let meshed = triangles(store, how, (&mut slab, colour), &HashSet::new(), &mut ply);
    meshed.map_err(|error| FleetError::content(out, format!("cannot be made: {error}")))?;
    ply.finish().map_err(FleetError::io(out))
}
