//! Writes the matches of a sequence of the synthetic street as the lines of a fixture's
//! `matches.csv`: how `fixtures/matches-640x192` was made.

use dynvox::synth::{Street, StreetConfig};
use dynvox_core::{
    Capacity, Serial,
    image::View,
    memory::Carver,
    scene_flow::{FlowMatcher, SceneFlowConfig},
};
use dynvox_tests::HeapSlab;

const SIZE: [u32; 2] = [640, 192];
const FRAMES: u32 = 12;

fn main() {
    let [width, height] = SIZE;
    let street =
        Street::new(StreetConfig { width, height, frames: FRAMES, ..StreetConfig::default() })
            .expect("the default street is sound");
    let mut slab = HeapSlab::of(&Capacity::SMALL);
    let mut carver =
        Carver::new(slab.bytes(), FlowMatcher::bytes(&Capacity::SMALL)).expect("an aligned slab");
    let mut matcher = FlowMatcher::new_in(&Capacity::SMALL, &mut carver);
    carver.check().expect("a slab that fits");
    println!(
        "frame,previous_left_u,previous_left_v,previous_right_u,previous_right_v,\
         current_left_u,current_left_v,current_right_u,current_right_v"
    );
    for index in 0..FRAMES {
        let frame = street.frame(index);
        let view = |grey| View::new(grey, width as usize, height as usize).expect("a whole image");
        matcher.push(
            &SceneFlowConfig::default(),
            view(&frame.left_grey),
            view(&frame.right_grey),
            &Serial,
        );
        // Only the matches that egomotion gets.
        for m in matcher.bucketed() {
            let points = [m.previous_left, m.previous_right, m.current_left, m.current_right];
            let numbers: Vec<String> = points.iter().flatten().map(f32::to_string).collect();
            println!("{index},{}", numbers.join(","));
        }
    }
}
