//! A folder of tiles, and which tile a block belongs to. Each epoch has tiles of its own.

use super::FleetError;
use super::tile_file::Lattice;
use crate::owned::MARKER_FILE;
use dynvox_core::volume::{BLOCK_SIDE, BlockCoord};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Side of a tile, m, to the nearest block.
const TILE_M: f64 = 64.0;
/// The end of a tile's name.
const EXTENSION: &str = "sums";

/// A tile of an epoch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorldTile {
    /// Coordinates in the world, in tiles.
    pub sides: [i16; 3],
    /// The epoch.
    pub epoch: u32,
}

impl WorldTile {
    /// The tile that a block of an epoch lies in.
    pub fn of(coord: BlockCoord, lattice: &Lattice, epoch: u32) -> Self {
        let blocks = (TILE_M / (f64::from(lattice.voxel_size_m) * BLOCK_SIDE as f64))
            .round()
            .clamp(1.0, 32_767.0) as i16;
        Self { sides: [coord.x, coord.y, coord.z].map(|side| side.div_euclid(blocks)), epoch }
    }

    /// The name of its file.
    pub fn file_name(self) -> String {
        let Self { sides: [x, y, z], epoch } = self;
        format!("{x}_{y}_{z}_{epoch}.{EXTENSION}")
    }

    fn parse(name: &str) -> Option<Self> {
        let mut sides =
            name.strip_suffix(EXTENSION)?.strip_suffix('.')?.split('_').map(str::parse::<i64>);
        let mut side = || i16::try_from(sides.next()?.ok()?).ok();
        let coordinates = [side()?, side()?, side()?];
        let tile = Self { sides: coordinates, epoch: u32::try_from(sides.next()?.ok()?).ok()? };
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
        // The marker is dynvox's own and no tile.
        if name == MARKER_FILE {
            continue;
        }
        let tile = WorldTile::parse(&name).ok_or_else(|| {
            FleetError::content(&path, "is no tile. Give folders that `dynvox fleet` wrote")
        })?;
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
        let of = |x: i16| WorldTile::of(BlockCoord { x, y: 0, z: 0 }, &lattice, 7).sides[0];
        // 160 blocks of 0.4 m are a tile, and block -1 lies in tile -1.
        assert_eq!([-161, -160, -1, 0, 159, 160, i16::MAX].map(of), [-2, -1, -1, 0, 0, 1, 204]);
        let tile = WorldTile { sides: [-3, 0, 12], epoch: 20_261_122 };
        assert_eq!(
            (tile.file_name().as_str(), WorldTile::parse("-3_0_12_20261122.sums")),
            ("-3_0_12_20261122.sums", Some(tile))
        );
        assert!(
            [
                // A number too few, one too many, a plus, no ending, letters, and an epoch below 0.
                "3_0_1.sums",
                "1_2_3_4_5.sums",
                "+1_2_3_0.sums",
                "1_2_3_0",
                "a_b_c_d.sums",
                "1_2_3_-1.sums"
            ]
            .iter()
            .all(|name| WorldTile::parse(name).is_none())
        );
    }
}
