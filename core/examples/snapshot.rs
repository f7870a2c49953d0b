//! How is a mapper saved and restored? The restored one computes the same bits as the one that
//! never stopped.
//!
//! `cargo run -p dynvox-core --example snapshot`

mod wall;

use dynvox_core::{Capacity, Config, Mapper, Serial, memory::SLAB_ALIGN};
use std::io::{self, Read};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (capacity, config) = (Capacity::TINY, Config::for_rig(wall::RIG));
    // Two mappers, and so two slabs.
    let mut slabs = [0, 1].map(|_| vec![0; capacity.bytes() + SLAB_ALIGN]);
    let [first, second] = &mut slabs;
    let mut mapper = Mapper::new(&capacity, &config, first)?;
    for number in 0..3 {
        mapper.step(&wall::Pair::new(number).frame()?, &Serial)?;
    }
    let mut bytes = Vec::new();
    // A file or a socket would do as well: the mapper hands out one part after the other.
    mapper.save(&mut |piece: &[u8]| {
        bytes.extend_from_slice(piece);
        Ok::<(), io::Error>(())
    })?;
    let mut file = &bytes[..];
    let mut restored = Mapper::restore(&capacity, &config, second, &mut |piece: &mut [u8]| {
        file.read_exact(piece)
    })?;
    // If the restored mapper goes on as the first one does, the digests are equal.
    let next = wall::Pair::new(3);
    let digests = [
        mapper.step(&next.frame()?, &Serial)?.digest,
        restored.step(&next.frame()?, &Serial)?.digest,
    ];
    println!(
        "a snapshot of {} bytes; digests of the next frame: {:016x} and {:016x}",
        bytes.len(),
        digests[0],
        digests[1]
    );
    assert_eq!(digests[0], digests[1]);
    Ok(())
}
