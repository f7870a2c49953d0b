//! How does a map outgrow its memory? Blocks that leave the pool go to a store of the caller's and
//! come back when they are visible again.
//!
//! `cargo run -p dynvox-core --example stream_blocks`

mod wall;

use dynvox_core::{
    Capacity, Config, Mapper, Serial,
    memory::SLAB_ALIGN,
    objects::NoSink,
    volume::{BLOCK_VOXELS, BlockKey, BlockStore, EvictedBlock, LoadedBlock},
};
use std::collections::HashMap;

/// Distances and weights of the blocks that left, by their segment and coordinates.
#[derive(Default)]
struct Memory(HashMap<BlockKey, ([i16; BLOCK_VOXELS], [u8; BLOCK_VOXELS])>);

impl BlockStore for Memory {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        self.0.insert(block.key, (*block.sdf, *block.weight));
        true
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        let Some((sdf, weight)) = self.0.get(&block.key) else { return false };
        (*block.sdf, *block.weight) = (*sdf, *weight);
        true
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Too few blocks for the wall, so that some must leave.
    let capacity = Capacity { blocks: 600, ..Capacity::TINY };
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&capacity, &Config::for_rig(wall::RIG), &mut slab)?;
    let mut store = Memory::default();
    for number in 0..10 {
        let report = mapper.step_with(
            &wall::Pair::new(number).frame()?,
            &Serial,
            &mut store,
            &mut NoSink,
        )?;
        println!(
            "frame {number}: {} of {} blocks used, {} in the store",
            report.blocks.used,
            report.blocks.capacity,
            store.0.len()
        );
    }
    // What is still in the map leaves as well, so that the store has all of it.
    mapper.stream_out(&mut store);
    println!("{} blocks in all", store.0.len());
    Ok(())
}
