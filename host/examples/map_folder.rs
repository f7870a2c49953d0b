//! How is a folder of stereo pairs mapped with the library? Any layout that `dynvox inspect` knows.
//!
//! `cargo run -p dynvox --example map_folder -- fixtures/street-320x96`

use dynvox::input::{OpenOptions, open};
use dynvox_core::mapper::BudgetOptions;
use dynvox_core::{Capacity, Config, Mapper, Serial, StereoFrame, memory::SLAB_ALIGN};

fn main() -> anyhow::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "fixtures/street-320x96".into());
    let source = open(path.as_ref(), &OpenOptions::default())?;
    let (width, height) = source.size();
    // 64 MiB for this size of images.
    let capacity = Capacity::for_budget(64 << 20, width, height, &BudgetOptions::default())?;
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&capacity, &Config::for_rig(source.rig()), &mut slab)?;
    for index in 0..source.len() {
        let images = source.frame(index)?;
        // Frames without pixels are passed over.
        let (Some(left), Some(right)) = (images.left.view(), images.right.view()) else { continue };
        let report = mapper.step(&StereoFrame::pair(left, right), &Serial)?;
        println!("frame {index}: {:?}, {} blocks", report.pose, report.blocks.used);
    }
    let mut triangles = 0;
    mapper.triangles(&mut |_| triangles += 1);
    println!("{triangles} triangles");
    Ok(())
}
