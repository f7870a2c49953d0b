//! Changes between epochs: blocks that changed alike and touch one another are one change.
//!
//! Of a surface that only lies elsewhere, for depth or pose were off, the epoch with free space has
//! one as well, half a truncation away or more. Where an object came or went, that epoch has none
//! near, at least about what stands out by more than the truncation. So a change is listed when
//! that is said of [`CLEAR_MIN`] of its voxels.

use super::resolve::BlockChange;
use super::tile_file::Lattice;
use dynvox_core::volume::{BLOCK_SIDE, BlockCoord};
use serde::Serialize;
use std::collections::BTreeMap;

/// Direction of a change: a surface appeared or disappeared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ChangeKind {
    /// Free space, then a surface.
    Appeared,
    /// A surface, then free space.
    Gone,
}

impl ChangeKind {
    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Appeared => "appeared",
            Self::Gone => "gone",
        }
    }
}

/// A place in the world that has changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Direction of the change.
    pub kind: ChangeKind,
    /// The epoch before.
    pub from_epoch: u32,
    /// The epoch after.
    pub to_epoch: u32,
    /// The epoch that the map shows; of blocks that differ, most of them.
    pub believed_epoch: u32,
    /// Centre of the voxels, m, as that of their blocks.
    pub centre_m: [f64; 3],
    /// Sides of the box around the blocks, m.
    pub extent_m: [f64; 3],
    /// Volume of the voxels that contradict, m3: a layer 0.4 truncations thick behind the surface.
    pub volume_m3: f64,
}

/// Least share of a change's voxels without a surface near in the epoch with free space.
const CLEAR_MIN: f64 = 0.3;

type Kind = (ChangeKind, u32, u32);

/// Changes of at least `least_m3`, the largest first.
pub fn changes(blocks: &[BlockChange], lattice: &Lattice, least_m3: f64) -> Vec<Change> {
    // By kind and pair of epochs: blocks of different changes are never joined.
    let mut kinds: BTreeMap<Kind, BTreeMap<BlockCoord, BlockChange>> = BTreeMap::new();
    for &block in blocks {
        let kind = if block.surface < block.free { ChangeKind::Gone } else { ChangeKind::Appeared };
        let epochs = (block.surface.min(block.free), block.surface.max(block.free));
        kinds.entry((kind, epochs.0, epochs.1)).or_default().insert(block.coord, block);
    }
    let mut changes: Vec<Change> = Vec::new();
    for (kind, mut left) in kinds {
        // Neighbouring blocks of one kind are one change.
        while let Some((_, first)) = left.pop_first() {
            let blocks = connected(first, &mut left);
            let total = |of: fn(&BlockChange) -> u32| {
                blocks.iter().map(|block| f64::from(of(block))).sum::<f64>()
            };
            // A change counts if most of its voxels were clearly seen through.
            let is_clear = total(|block| block.clear) >= CLEAR_MIN * total(|block| block.voxels);
            let change = summed(kind, &blocks, lattice);
            changes.extend((is_clear && change.volume_m3 >= least_m3).then_some(change));
        }
    }
    changes.sort_by(|a, b| b.volume_m3.total_cmp(&a.volume_m3));
    changes
}

/// The blocks that touch `first`, directly or by others, taken out of `left`.
fn connected(first: BlockChange, left: &mut BTreeMap<BlockCoord, BlockChange>) -> Vec<BlockChange> {
    let (mut found, mut at) = (vec![first], 0);
    while let Some(BlockChange { coord, .. }) = found.get(at).copied() {
        at += 1;
        // All 26 neighbours, and the block itself, which is not left any more.
        for neighbour in 0..27 {
            let side = |c: i16, by: i32| i32::from(c) + by - 1;
            let coord = BlockCoord::new(
                side(coord.x, neighbour % 3),
                side(coord.y, neighbour / 3 % 3),
                side(coord.z, neighbour / 9),
            );
            found.extend(coord.and_then(|coord| left.remove(&coord)));
        }
    }
    found
}

fn summed((kind, from_epoch, to_epoch): Kind, blocks: &[BlockChange], lattice: &Lattice) -> Change {
    let voxel_m = f64::from(lattice.voxel_size_m);
    let block_m = voxel_m * BLOCK_SIDE as f64;
    let (mut voxels, mut centre_m) = (0.0, [0.0; 3]);
    // The centre by voxels, the extent by whole blocks.
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for block in blocks {
        let count = f64::from(block.voxels);
        for (axis, side) in [block.coord.x, block.coord.y, block.coord.z].into_iter().enumerate() {
            let from_m = f64::from(side) * block_m;
            centre_m[axis] += count * (from_m + 0.5 * block_m);
            (low[axis], high[axis]) = (low[axis].min(from_m), high[axis].max(from_m + block_m));
        }
        voxels += count;
    }
    // Most blocks decide which epoch is believed.
    let for_later = blocks.iter().filter(|block| block.believed == to_epoch).count();
    Change {
        kind,
        from_epoch,
        to_epoch,
        believed_epoch: if 2 * for_later >= blocks.len() { to_epoch } else { from_epoch },
        centre_m: centre_m.map(|sum| sum / voxels),
        extent_m: std::array::from_fn(|axis| high[axis] - low[axis]),
        volume_m3: voxels * voxel_m.powi(3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::block_sums::BlockSums;
    use crate::fleet::resolve::{ResolvedBlock, resolve};
    use crate::fleet::tile_file;
    use crate::fleet::tile_folder::WorldTile;
    use dynvox_core::volume::BLOCK_VOXELS;
    use std::path::Path;

    const LATTICE: Lattice = Lattice { voxel_size_m: 0.1, truncation_m: 0.5, colour: false };

    /// Distance, in voxels, from the ground below y = 2, and from a box on it that is 8 x 8 x 12
    /// voxels about (8, 6, 10), where it is there.
    fn distance(at: [i32; 3], has_box: bool) -> f64 {
        let [x, y, z] = at.map(f64::from);
        let ground = y - 2.0;
        let outside = [(x - 8.0).abs() - 4.0, (y - 6.0).abs() - 4.0, (z - 10.0).abs() - 6.0];
        let side = outside.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if has_box { ground.min(side) } else { ground }
    }

    fn write(folder: &Path, epoch: u32, has_box: bool, weight: u8) {
        write_of(folder, epoch, weight, |at| distance(at, has_box));
    }

    /// A map of four by two by four blocks.
    fn write_of(folder: &Path, epoch: u32, weight: u8, distance: impl Fn([i32; 3]) -> f64) {
        std::fs::create_dir_all(folder).unwrap();
        let mut coords = Vec::new();
        for x in 0..4 {
            for y in 0..2 {
                coords.extend((0..4).map(|z| BlockCoord { x, y, z }));
            }
        }
        let block = |coord: BlockCoord| {
            let mut sums = BlockSums::zero(false);
            for voxel in 0..BLOCK_VOXELS {
                let offset = [voxel % 8, voxel / 8 % 8, voxel / 64];
                let at = std::array::from_fn(|axis| {
                    i32::from([coord.x, coord.y, coord.z][axis]) * 8 + offset[axis] as i32
                });
                // Distances are clamped at five voxels, as a map has them.
                let units = (distance(at) / 5.0).clamp(-1.0, 1.0) * 32_767.0;
                sums.observe(voxel, units as i16, weight, [0; 3]);
            }
            (coord, sums)
        };
        let mut blocks = coords.into_iter().map(block);
        let tile = WorldTile { sides: [0; 3], epoch };
        tile_file::write(&folder.join(tile.file_name()), &LATTICE, || Ok(blocks.next())).unwrap();
    }

    fn resolved(folder: &Path) -> (Vec<ResolvedBlock>, Vec<Change>) {
        let mut blocks = Vec::new();
        let map = resolve(folder, |block| {
            blocks.push(block);
            Ok(())
        })
        .unwrap();
        (blocks, changes(&map.changes, &map.lattice, 0.05))
    }

    /// Returns true if the map has a surface in the middle of the box's top.
    fn shows_box(blocks: &[ResolvedBlock]) -> bool {
        let block =
            blocks.iter().find(|block| block.coord == BlockCoord { x: 1, y: 1, z: 1 }).unwrap();
        // (8, 9, 10): a voxel below the top.
        block.average.sdf[8 * (1 + 8 * 2)] <= 0
    }

    #[test]
    fn a_box_that_was_there_once_is_gone_and_listed() {
        let root = tempfile::TempDir::new().unwrap();
        write(root.path(), 3, true, 20);
        write(root.path(), 5, false, 6);
        let (blocks, changes) = resolved(root.path());
        assert!(!shows_box(&blocks));
        let [change] = &changes[..] else { panic!("{changes:?}") };
        assert_eq!(
            (change.kind, change.from_epoch, change.to_epoch, change.believed_epoch),
            (ChangeKind::Gone, 3, 5, 5)
        );
        let near = |a: f64, b: f64| (a - b).abs() < 0.25;
        assert!(near(change.centre_m[0], 0.8) && near(change.centre_m[2], 1.0), "{change:?}");
        // The box without its ground, and without its inside that lies deeper than two voxels.
        assert!(change.volume_m3 > 0.3 && change.volume_m3 < 0.768, "{change:?}");
        // What agrees is averaged over both.
        let ground =
            blocks.iter().find(|block| block.coord == BlockCoord { x: 3, y: 0, z: 0 }).unwrap();
        assert!(ground.average.weight.iter().all(|&weight| weight == 26));
    }

    #[test]
    fn a_box_that_came_is_shown_and_one_seen_too_rarely_is_not() {
        let root = tempfile::TempDir::new().unwrap();
        drop(crate::owned::OwnedFolder::create(root.path()).unwrap());
        // The box comes in the second epoch, and is seen six times there.
        write(root.path(), 0, false, 20);
        write(root.path(), 1, true, 6);
        let (blocks, changes) = resolved(root.path());
        assert!(shows_box(&blocks));
        assert_eq!(
            (changes.len(), changes[0].kind, changes[0].believed_epoch),
            (1, ChangeKind::Appeared, 1)
        );
        write(root.path(), 1, true, 3);
        let (blocks, changes) = resolved(root.path());
        assert!(!shows_box(&blocks));
        assert_eq!(
            (changes.len(), changes[0].kind, changes[0].believed_epoch),
            (1, ChangeKind::Appeared, 0)
        );
    }

    #[test]
    fn a_surface_that_lies_elsewhere_is_no_change() {
        let root = tempfile::TempDir::new().unwrap();
        let map = |epoch: u32, shift: i32| {
            write_of(root.path(), epoch, 6, |[x, y, z]| distance([x, y - shift, z], true))
        };
        map(1, 0);
        map(2, 4);
        let found = resolve(root.path(), |_| Ok(())).unwrap();
        let volume_m3 =
            found.changes.iter().map(|block| f64::from(block.voxels) * 1e-3).sum::<f64>();
        assert!(volume_m3 > 0.5, "ground and box are .4 m higher: {volume_m3}");
        assert_eq!(changes(&found.changes, &LATTICE, 0.05), []);
    }

    #[test]
    fn epochs_that_agree_have_no_change() {
        let root = tempfile::TempDir::new().unwrap();
        for epoch in 0..3 {
            write(root.path(), epoch, true, 4);
        }
        let (blocks, changes) = resolved(root.path());
        assert!(shows_box(&blocks) && changes.is_empty(), "{changes:?}");
    }
}
