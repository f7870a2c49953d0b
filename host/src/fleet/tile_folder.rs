//! A folder of tiles, and which tile a block belongs to.

use super::FleetError;
use super::tile_file::Lattice;
use dynvox_core::volume::{BLOCK_SIDE, BlockCoord};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Side of a tile, m, to the nearest block.
const TILE_M: f64 = 64.0;
/// The end of a tile's name.
const EXTENSION: &str = "sums";

/// A tile's coordinates in the world, in tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorldTile(pub [i16; 3]);

impl WorldTile {
    /// The tile that a block lies in.
    pub fn of(coord: BlockCoord, lattice: &Lattice) -> Self {
        let blocks = (TILE_M / (f64::from(lattice.voxel_size_m) * BLOCK_SIDE as f64)).round().clamp(1.0, 32_767.0) as i16;
        Self([coord.x, coord.y, coord.z].map(|side| side.div_euclid(blocks)))
    }

    /// The name of its file.
    pub fn file_name(self) -> String {
        let [x, y, z] = self.0;
        format!("{x}_{y}_{z}.{EXTENSION}")
    }

    fn parse(name: &str) -> Option<Self> {
        let mut sides = name.strip_suffix(EXTENSION)?.strip_suffix('.')?.split('_').map(str::parse);
        let tile = Self([sides.next()?.ok()?, sides.next()?.ok()?, sides.next()?.ok()?]);
        (sides.next().is_none() && tile.file_name() == name).then_some(tile)
    }
}

/// The tiles in a folder with their files, ascending.
///
/// # Errors
/// The folder cannot be read, or has something else in it.
pub fn tiles(folder: &Path) -> Result<BTreeMap<WorldTile, PathBuf>, FleetError> {
    let mut tiles = BTreeMap::new();
    for entry in folder.read_dir().map_err(FleetError::io(folder))? {
        let path = entry.map_err(FleetError::io(folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let tile =
            WorldTile::parse(&name).ok_or_else(|| FleetError::content(&path, "is no tile. Give folders that `dynvox fleet` wrote"))?;
        tiles.insert(tile, path);
    }
    Ok(tiles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_named_by_their_coordinates_and_cover_the_world() {
        let lattice = Lattice { voxel_size_m: 0.05, truncation_m: 0.25, colour: false };
        let of = |x: i16| WorldTile::of(BlockCoord { x, y: 0, z: 0 }, &lattice).0[0];
        assert_eq!([-161, -160, -1, 0, 159, 160, i16::MAX].map(of), [-2, -1, -1, 0, 0, 1, 204]);
        let tile = WorldTile([-3, 0, 12]);
        assert_eq!((tile.file_name().as_str(), WorldTile::parse("-3_0_12.sums")), ("-3_0_12.sums", Some(tile)));
        assert!(["3_0.sums", "1_2_3_4.sums", "+1_2_3.sums", "1_2_3", "a_b_c.sums"].iter().all(|name| WorldTile::parse(name).is_none()));
    }
}
