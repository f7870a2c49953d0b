//! How far is what the map shows? Maps five frames and raycasts the map from the last camera pose.
//!
//! `cargo run -p dynvox-core --example raycast`

mod wall;

use dynvox_core::{Capacity, Config, Mapper, Serial, memory::SLAB_ALIGN};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(wall::RIG), &mut slab)?;
    for number in 0..5 {
        mapper.step(&wall::Pair::new(number).frame()?, &Serial)?;
    }
    // Where the last frame stood; any other pose will do.
    let t_world_camera = *mapper.t_world_camera();
    let view = mapper.raycast(&t_world_camera, &Serial)?;
    let mut depth_m: Vec<f32> = view
        .depth_m()
        .into_iter()
        .flat_map(|image| image.pixels())
        .copied()
        .filter(|&depth| depth > 0.0)
        .collect();
    depth_m.sort_by(f32::total_cmp);
    let median = depth_m.get(depth_m.len() / 2).ok_or("the map is empty")?;
    println!(
        "{} pixels show the map, their median depth is {median:.2} m (the wall is 8.20 m away)",
        depth_m.len()
    );
    Ok(())
}
