//! A copy of a volume's blocks, meshed after the step so that the mapper need not wait.

use crate::slab::HostSlab;
use dynvox_core::Capacity;
use dynvox_core::memory::Carver;
use dynvox_core::view::{MeshConfig, MeshSink};
use dynvox_core::volume::{
    BLOCK_VOXELS, BlockKey, BlockStore, EvictedBlock, LoadedBlock, Volume, VolumeConfig,
};
use std::io::{Error, ErrorKind};

/// The blocks of a volume, in its order.
pub struct VolumeCopy {
    config: VolumeConfig,
    colour: bool,
    blocks: Vec<Block>,
}

struct Block {
    key: BlockKey,
    sdf: [i16; BLOCK_VOXELS],
    weight: [u8; BLOCK_VOXELS],
    /// All 0 without colour.
    colour: [[u8; BLOCK_VOXELS]; 3],
}

impl VolumeCopy {
    /// Copies a volume.
    pub fn new(volume: &Volume<'_>) -> Self {
        Self::of_blocks(volume, |_| true)
    }

    /// Copies the blocks of a volume that `is_wanted` picks.
    pub fn of_blocks(volume: &Volume<'_>, is_wanted: impl Fn(BlockKey) -> bool) -> Self {
        let (pool, blocks) = (volume.pool(), volume.blocks());
        let mut copy = Self { config: *volume.config(), colour: false, blocks: Vec::new() };
        // Slots are not kept: the copy is for writing meshes, and knows blocks by their
        // coordinates.
        for slot in pool.live() {
            let colour = blocks.colour(slot);
            let key = blocks.key(slot).filter(|&key| is_wanted(key));
            if let (Some(key), Some(&sdf), Some(&weight)) =
                (key, blocks.sdf(slot), blocks.weight(slot))
            {
                copy.colour |= colour.is_some();
                copy.blocks.push(Block {
                    key,
                    sdf,
                    weight,
                    colour: colour.copied().unwrap_or([[0; BLOCK_VOXELS]; 3]),
                });
            }
        }
        copy
    }

    /// Returns the configuration the volume was made with.
    pub fn config(&self) -> &VolumeConfig {
        &self.config
    }

    /// Returns the number of blocks.
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Hands out the mesh that the volume would have, in the same order.
    ///
    /// # Errors
    ///
    /// No memory for a volume of as many blocks.
    pub fn triangles(&self, mesh: &MeshConfig, sink: &mut impl MeshSink) -> std::io::Result<u64> {
        self.with_volume(|volume| volume.mesh(mesh, |_| true, sink))
    }

    /// Hands on a volume of these blocks.
    ///
    /// # Errors
    /// No memory for a volume of as many blocks.
    pub fn with_volume<T>(&self, consume: impl FnOnce(&Volume<'_>) -> T) -> std::io::Result<T> {
        // Only the pool counts: meshing needs no lists and no history.
        let capacity = Capacity {
            blocks: self.blocks.len(),
            visible_blocks: 1,
            history_frames: 1,
            colour: self.colour,
            ..Capacity::TINY
        };
        let bytes = Volume::bytes(&capacity);
        let mut slab = HostSlab::map(bytes).ok_or(ErrorKind::OutOfMemory)?;
        let misfit =
            |error| Error::other(format!("blocks do not fit the copy's memory: {error:?}"));
        let mut carver = Carver::new(slab.bytes_mut(), bytes).map_err(misfit)?;
        let mut volume = Volume::new_in(&capacity, &self.config, &mut carver);
        carver.check().map_err(misfit)?;
        // In the order of the pool, so that the mesh has the order that the object's had.
        for block in &self.blocks {
            volume.load(block.key, &mut One(block));
        }
        Ok(consume(&volume))
    }
}

/// A store that holds one block.
struct One<'b>(&'b Block);

impl BlockStore for One<'_> {
    fn store(&mut self, _: EvictedBlock<'_>) -> bool {
        false
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        (*block.sdf, *block.weight) = (self.0.sdf, self.0.weight);
        if let Some(colour) = block.colour {
            *colour = self.0.colour;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::Serial;
    use dynvox_core::geometry::{StereoRig, Transform};
    use dynvox_core::image::View;
    use dynvox_core::view::Triangle;
    use dynvox_core::volume::{DepthImage, NoStore, Observation, PruneBy, Viewpoint};

    const WIDTH: usize = 96;
    const HEIGHT: usize = 64;

    /// A volume of two walls. The first is pruned away, so that slots are free between those in
    /// use.
    fn with_volume(colour: bool, test: impl FnOnce(&Volume<'_>)) {
        let capacity = Capacity { blocks: 500, colour, ..Capacity::TINY };
        let prune_rule = PruneBy::Weight;
        let config = VolumeConfig { truncation_m: 0.2, prune_rule, ..VolumeConfig::default() };
        let bytes = Volume::bytes(&capacity);
        let mut slab = HostSlab::map(bytes).unwrap();
        let mut volume =
            Volume::new_in(&capacity, &config, &mut Carver::new(slab.bytes_mut(), bytes).unwrap());
        let rig =
            StereoRig { focal_px: 80.0, center_u_px: 48.0, center_v_px: 32.0, baseline_m: 0.5 };
        let view =
            Viewpoint { rig, width: WIDTH, height: HEIGHT, t_world_camera: Transform::IDENTITY };
        let grey: Vec<u8> = (0..WIDTH * HEIGHT).map(|i| 40 + (i % 200) as u8).collect();
        // The first wall is nearer in the left part; the second frame sees nothing there.
        for walls_m in [[1.0, 2.0], [0.0, 2.0]] {
            let depth_m: Vec<f32> =
                (0..WIDTH * HEIGHT).map(|i| walls_m[usize::from(i % WIDTH > 40)]).collect();
            let depth_m = View::new(&depth_m, WIDTH, HEIGHT).unwrap();
            let seen = Observation {
                depth: DepthImage::Plain(depth_m),
                grey: View::new(&grey, WIDTH, HEIGHT).unwrap(),
                colour: None,
                class: None,
            };
            volume.allocate(&view, depth_m, &mut NoStore, &Serial);
            volume.fuse(&view, seen, &Serial);
        }
        volume.prune_whole(1);
        assert!(volume.pool().len() < volume.pool().high_water(), "slots are free");
        test(&volume);
    }

    #[test]
    fn gives_the_volumes_own_triangles_in_its_order() {
        for colour in [false, true] {
            with_volume(colour, |volume| {
                let (mut own, mut copied) = (Vec::new(), Vec::new());
                let mesh = MeshConfig::default();
                volume.triangles(&mesh, &mut |triangle| own.push(triangle));
                let copy = VolumeCopy::new(volume);
                let count =
                    copy.triangles(&mesh, &mut |triangle: Triangle| copied.push(triangle)).unwrap();
                assert!(
                    own == copied && count == own.len() as u64,
                    "{} and {}",
                    own.len(),
                    copied.len()
                );
                assert!(own.len() > 100 && copy.blocks() == volume.pool().len());
                // Two frames were fused, and what was seen in one of them alone is pruned.
                assert!(own.iter().flat_map(|one| one.vertices).all(|vertex| vertex.weight == 2));
                assert_eq!(own.iter().any(|one| one.vertices[0].colour != [0; 3]), colour);
            });
        }
    }
}
