//! Where the records of a store begin, in memory that does not grow with the blocks.
//!
//! Each segment's space is cut into tiles of 32 blocks a side. Each record names the one before it
//! in its tile, so of a tile only the newest record is remembered; the places of all its blocks are
//! read up along that chain when the camera comes back to it, and forgotten again when it has been
//! away. A camera that only moves ahead never reads.
//!
//! Memory: about 20 bytes per tile of the path (12.8 m a side at 5 cm), and 24 bytes or so per
//! block of the [`OPEN_TILES`] read last.

use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::BlockKey;
use hashbrown::HashMap;

/// A tile's side in blocks is 2 to this power.
const TILE_BITS: u32 = 5;
/// Tiles whose blocks' places are known at once: more than a look around needs.
const OPEN_TILES: usize = 64;

/// A cube of 32 blocks a side, in a segment of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tile {
    /// Segment of the map.
    pub segment: MapSegment,
    /// Coordinates in the segment's lattice, in tiles.
    pub at: [i16; 3],
}

/// The tile a block lies in.
pub(super) fn tile_of(BlockKey { segment, coord }: BlockKey) -> Tile {
    Tile { segment, at: [coord.x, coord.y, coord.z].map(|c| c >> TILE_BITS) }
}

#[derive(Debug)]
struct OpenTile {
    records: HashMap<BlockKey, u64>,
    last_use: u64,
}

/// The places.
#[derive(Debug, Default)]
pub(super) struct BlockIndexOnDisk {
    /// Offset of the newest record of each tile.
    newest: HashMap<Tile, u64>,
    open: HashMap<Tile, OpenTile>,
    uses: u64,
}

impl BlockIndexOnDisk {
    /// Returns the offset of a tile's newest record, if there is one.
    pub fn newest(&self, tile: Tile) -> Option<u64> {
        self.newest.get(&tile).copied()
    }

    /// Notes that the newest record of a block begins at `at`.
    pub fn enter(&mut self, key: BlockKey, at: u64) {
        let tile = tile_of(key);
        self.newest.insert(tile, at);
        if let Some(open) = self.open.get_mut(&tile) {
            open.records.insert(key, at);
        }
    }

    /// The places of an open tile's blocks.
    pub fn records(&mut self, tile: Tile) -> Option<&HashMap<BlockKey, u64>> {
        self.uses += 1;
        let open = self.open.get_mut(&tile)?;
        open.last_use = self.uses;
        Some(&open.records)
    }

    /// Opens a tile with the places read up; the one unused for longest is forgotten for it.
    pub fn open(&mut self, tile: Tile, records: HashMap<BlockKey, u64>) {
        if self.open.len() >= OPEN_TILES
            && let Some(oldest) =
                self.open.iter().min_by_key(|(_, open)| open.last_use).map(|(tile, _)| *tile)
        {
            self.open.remove(&oldest);
        }
        self.open.insert(tile, OpenTile { records, last_use: self.uses });
    }

    /// All tiles, ascending: segment by segment.
    pub fn tiles(&self) -> Vec<Tile> {
        let mut tiles: Vec<_> = self.newest.keys().copied().collect();
        tiles.sort_unstable();
        tiles
    }
}
