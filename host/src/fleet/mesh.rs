//! A merged map as triangles.

use super::FleetError;
use super::tile_file::TileReader;
use super::tile_folder::tiles;
use crate::formats::{Axes, DraftFolder, Mesh, PlyWriter};
use crate::run::store::{BlockFile, mesh::triangles};
use dynvox_core::Capacity;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::view::MeshConfig;
use dynvox_core::volume::{BlockStore, EvictedBlock, VolumeConfig};
use hashbrown::HashSet;
use std::path::Path;

/// What a mesh was made of.
#[derive(Clone, Copy, Debug)]
pub struct MeshedMap {
    /// The mesh.
    pub mesh: Mesh,
    /// Blocks of the map.
    pub blocks: u64,
    /// Voxels that were seen too often for their sums.
    pub overflowed: u64,
}

/// Writes the surface of a merged map as a PLY file; voxels below `min_weight` are left out. The averages lie in a file beside it meanwhile.
///
/// # Errors
/// A tile is damaged or of other voxels, or the disk refuses. Nothing half-written stays behind.
pub fn write_mesh(folder: &Path, out: &Path, min_weight: u8, axes: Axes) -> Result<MeshedMap, FleetError> {
    let files = tiles(folder)?;
    let Some(first) = files.values().next() else {
        return Err(FleetError::content(folder, "has no tile: nothing was mapped"));
    };
    let lattice = TileReader::open(first)?.lattice();
    let scratch = DraftFolder::of(&out.with_extension("blocks"));
    std::fs::create_dir_all(scratch.path()).map_err(FleetError::io(scratch.path()))?;
    let (mut store, _) = BlockFile::open(&scratch.path().join("map.blocks"), lattice.voxel_size_m, lattice.truncation_m)?;
    let (mut blocks, mut overflowed) = (0, 0);
    for path in files.values() {
        let mut reader = TileReader::open(path)?;
        let found = reader.lattice();
        if found != lattice {
            return Err(FleetError::OtherLattice { path: path.clone(), found, expected: lattice });
        }
        while let Some((coord, sums)) = reader.next()? {
            let average = sums.average();
            let block = EvictedBlock {
                coord,
                sdf: &average.sdf,
                weight: &average.weight,
                colour: average.colour.as_deref(),
            };
            if !store.store(block) {
                let source =
                    store.failure().map_or_else(|| std::io::ErrorKind::Other.into(), |error| std::io::Error::other(error.to_string()));
                return Err(FleetError::Io { path: scratch.path().to_path_buf(), source });
            }
            (blocks, overflowed) = (blocks + 1, overflowed + average.overflowed);
        }
    }
    let volume = VolumeConfig {
        voxel_size_m: lattice.voxel_size_m,
        truncation_m: lattice.truncation_m,
        ..VolumeConfig::default()
    };
    let how = (&volume, &MeshConfig { min_weight });
    // Any profile's slab holds a piece of the map.
    let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    let mut ply = PlyWriter::begin_in(out, "the world", axes).map_err(FleetError::io(out))?;
    let meshed = triangles(&mut store, how, (&mut slab, lattice.colour), &HashSet::new(), &mut |corners| ply.triangle(corners));
    meshed.map_err(|error| FleetError::content(out, format!("cannot be made: {error}")))?;
    let mesh = ply.finish().map_err(FleetError::io(out))?;
    Ok(MeshedMap { mesh, blocks, overflowed })
}
