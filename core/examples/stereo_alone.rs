//! How is one stage used without the others? Matches one stereo pair.
//!
//! `cargo run -p dynvox-core --example stereo_alone`

mod wall;

use dynvox_core::{
    Capacity, Serial,
    image::DISPARITY_ONE_PX,
    memory::{Carver, SLAB_ALIGN},
    stereo::{StereoConfig, StereoMatcher},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bytes = StereoMatcher::bytes(&Capacity::TINY);
    let mut slab = vec![0; bytes + SLAB_ALIGN];
    // A slab for the matcher alone: the map and the tracker need none here.
    let mut carver = Carver::new(&mut slab, bytes)?;
    let mut matcher = StereoMatcher::new_in(&Capacity::TINY, &mut carver);
    carver.check()?;
    let pair = wall::Pair::new(0);
    let frame = pair.frame()?;
    matcher.compute(&StereoConfig::default(), frame.left, frame.right, &Serial);
    // The middle of the image; 0 would be no disparity.
    let disparity =
        f64::from(matcher.disparity_q8().get(160, 48).unwrap_or(0)) / f64::from(DISPARITY_ONE_PX);
    println!(
        "the middle pixel's disparity is {disparity:.2} px, its depth {:.2} m",
        wall::RIG.focal_px * wall::RIG.baseline_m / disparity
    );
    Ok(())
}
