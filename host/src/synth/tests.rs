//! What the street promises.

use super::*;

/// Writes pictures to look at when DYNVOX_LOOK names a folder.
#[test]
fn pictures_to_look_at() {
    let Ok(folder) = std::env::var("DYNVOX_LOOK") else { return };
    std::fs::create_dir_all(&folder).unwrap();
    for (width, height) in [(640, 192), (1242, 375)] {
        let street = Street::new(StreetConfig { width, height, ..StreetConfig::default() }).unwrap();
        for index in [0, 40, 80, 150] {
            let start = std::time::Instant::now();
            let frame = street.frame(index);
            println!("{width} frame {index}: {:?}", start.elapsed());
            let save = |name: &str, pixels: &[u8], colour| {
                let path = format!("{folder}/{width}_{index:03}_{name}.png");
                image::save_buffer(path, pixels, width, height, colour).unwrap();
            };
            save("left", &frame.left_rgb.concat(), image::ExtendedColorType::Rgb8);
            save("right", &frame.right_rgb.concat(), image::ExtendedColorType::Rgb8);
            let depth: Vec<u8> = frame.depth_m.iter().map(|&z| if z > 0.0 { (600.0 / z).min(255.0) as u8 } else { 0 }).collect();
            save("depth", &depth, image::ExtendedColorType::L8);
            let masks: Vec<u8> = frame.instances.iter().map(|&k| k.wrapping_mul(37)).collect();
            save("masks", &masks, image::ExtendedColorType::L8);
        }
    }
}
