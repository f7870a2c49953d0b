//! `blocks.csv` as a viewer shows it: when each place was last seen, and which blocks pruning took.

use super::{neighbourhood, tables::read_rows};
use crate::formats::{BLOCKS_TABLE_FILE, FormatError, SEGMENT_GAP_M, SETTINGS_FILE, read_text};
use hashbrown::HashMap;
use serde::Deserialize;
use std::path::Path;

/// Voxels along a block's side.
const BLOCK_VOXELS: f32 = 8.0;

/// A row of `blocks.csv`.
#[derive(Debug, Deserialize)]
struct BlockColumns {
    #[serde(default)]
    segment: u16,
    x: i32,
    y: i32,
    z: i32,
    last_frame: usize,
    fate: String,
}

/// The setting that says how large a block is.
#[derive(Debug, Deserialize)]
struct Settings {
    volume: VolumeSettings,
}

#[derive(Debug, Deserialize)]
struct VolumeSettings {
    voxel_size_m: f32,
}

/// The blocks of the static map.
#[derive(Clone, Debug, Default)]
pub struct BlockHistory {
    /// Side of a block, m.
    pub side_m: f32,
    /// Blocks of the map: the frame each was last visible in.
    last_seen: HashMap<[i32; 3], usize>,
    /// Middles of the blocks that pruning took and that did not come back, in the order in which
    /// they went, m.
    pub pruned_m: Vec<[f32; 3]>,
}

impl BlockHistory {
    /// Reads it from a run folder; an empty one of a run without.
    ///
    /// # Errors
    /// A file is damaged.
    pub fn read(folder: &Path) -> Result<Self, FormatError> {
        let (table, config) = (folder.join(BLOCKS_TABLE_FILE), folder.join(SETTINGS_FILE));
        // Runs without the table are shown without its layer.
        if !table.is_file() || !config.is_file() {
            return Ok(Self::default());
        }
        let settings: Settings = toml::from_str(&read_text(&config)?).map_err(|error| {
            FormatError::content(&config, error.to_string(), "Make the run again")
        })?;
        let side_m = BLOCK_VOXELS * settings.volume.voxel_size_m;
        let (mut last_seen, mut pruned) = (HashMap::new(), Vec::new());
        read_rows(&table, |row: BlockColumns| {
            // The mesh shows later segments higher up.
            let above = (SEGMENT_GAP_M as f32 * f32::from(row.segment) / side_m).round() as i32;
            let coord = [row.x, row.y - above, row.z];
            // The last row of a block says what became of it.
            if row.fate == "pruned" {
                last_seen.remove(&coord);
                pruned.push(coord);
            } else {
                last_seen.insert(coord, row.last_frame);
            }
        })?;
        // A block that came back is no longer pruned, and one pruned twice is listed once.
        let mut known = hashbrown::HashSet::new();
        pruned.retain(|coord| !last_seen.contains_key(coord) && known.insert(*coord));
        let pruned_m =
            pruned.into_iter().map(|coord| coord.map(|at| (at as f32 + 0.5) * side_m)).collect();
        Ok(Self { side_m, last_seen, pruned_m })
    }

    /// The frame in which a place of the map was last visible. A vertex of a simplified mesh can
    /// lie just outside the blocks it was made of: then that of a block beside them.
    pub fn last_frame(&self, position_m: [f32; 3]) -> Option<usize> {
        let at = position_m.map(|metres| (metres / self.side_m).floor() as i32);
        let of = |coord: [i32; 3]| self.last_seen.get(&coord).copied();
        of(at).or_else(|| neighbourhood(at).filter_map(of).max())
    }

    /// Returns true if no block is known.
    pub fn is_empty(&self) -> bool {
        self.last_seen.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_row_of_a_block_says_what_became_of_it() {
        let folder = tempfile::TempDir::new().unwrap();
        assert!(BlockHistory::read(folder.path()).unwrap().is_empty());
        std::fs::write(
            folder.path().join(SETTINGS_FILE),
            "[volume]\nvoxel_size_m = 0.05\nfar_m = 20\n",
        )
        .unwrap();
        // Block 0 was evicted and came back; block 1 was pruned and came back; block 9 was pruned
        // twice.
        let rows = "x,y,z,last_frame,fate\n0,0,0,7,evicted\n1,0,0,5,pruned\n9,0,0,5,pruned\n0,0,0,9,map\n9,0,0,6,pruned\n1,0,0,8,map\n";
        std::fs::write(folder.path().join(BLOCKS_TABLE_FILE), rows).unwrap();
        let history = BlockHistory::read(folder.path()).unwrap();
        let at = |x: f32| history.last_frame([x, 0.1, 0.1]);
        // A block of 0.05 m voxels has 0.4 m.
        assert_eq!(
            [at(0.1), at(0.5), at(0.9), at(-0.1), at(3.7)],
            [Some(9), Some(8), Some(8), Some(9), None]
        );
        assert_eq!(history.pruned_m.len(), 1, "once, and not what came back");
        assert!(
            (0..3).all(|axis| (history.pruned_m[0][axis] - [3.8, 0.2, 0.2][axis]).abs() < 1e-5),
            "{:?}",
            history.pruned_m
        );
        std::fs::write(folder.path().join(BLOCKS_TABLE_FILE), "x,y\n1,2\n").unwrap();
        assert!(
            BlockHistory::read(folder.path())
                .unwrap_err()
                .to_string()
                .contains("blocks.csv cannot be used")
        );
    }
}
