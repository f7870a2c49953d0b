//! How does firmware hold a mapper? Its slab is a `static`, its frames lie in the camera's buffers,
//! and nothing else is allocated.
//!
//! `cargo run -p dynvox-core --example firmware`. `tests/targets/firmware` is the same for a
//! Cortex-M7, with start-up code and proofs of heap, stack and panics.

mod wall;

use dynvox_core::{Capacity, Config, Mapper, Serial, Severity, memory::Slab};
use static_cell::ConstStaticCell;

const CAPACITY: Capacity = Capacity { blocks: 1_000, ..Capacity::TINY };
static SLAB: ConstStaticCell<Slab<{ CAPACITY.bytes() }>> = ConstStaticCell::new(Slab::ZERO);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let slab = SLAB.try_take().ok_or("the slab belongs to another mapper")?;
    let mut mapper = Mapper::new(&CAPACITY, &Config::for_rig(wall::RIG), &mut slab.0)?;
    for number in 0..5 {
        let buffers = wall::Pair::new(number);
        let report = mapper.step(&buffers.frame()?, &Serial)?;
        let note = if report.severity() == Severity::Info { "ok" } else { "look at the report" };
        println!(
            "frame {number}: {} of {} blocks, {note}",
            report.blocks.used, report.blocks.capacity
        );
    }
    println!("{} bytes of memory, all of them the slab", mapper.footprint().bytes());
    Ok(())
}
