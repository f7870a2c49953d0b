//! The window's slice as maps for the map servers of Nav2 and ROS 1, one for each of their modes.
//!
//! Both servers compute an occupancy from a pixel's brightness, `1 - grey / 255`, and compare it
//! with the two thresholds of the YAML file. Each mode has its own way to say "unknown": a grey
//! between the thresholds (trinary), a transparent pixel (scale), a value above 100 (raw). A
//! picture written for one mode is wrong in another, so each has its own.

use crate::scene::{FREE_GREY, OCCUPIED_GREY};
use dynvox_core::planning::CellState;
use image::{ImageBuffer, Rgba, RgbaImage};

/// Grey level of unknown cells in trinary mode, the one that the map savers write.
const UNKNOWN_GREY: u8 = 205;
/// Occupancy from which on a cell is occupied.
const OCCUPIED_THRESH: f64 = 0.65;
/// Occupancy below which a cell is free. It must not exceed that of [`UNKNOWN_GREY`],
/// 1 - 205 / 255 = 0.19608; with 0.25 both servers load unknown cells as free.
const FREE_THRESH: f64 = 0.196;
/// Values of `nav_msgs/OccupancyGrid`, as raw mode stores them; -1 is stored as 255.
const RAW: [u8; 3] = [0, 100, 255];
/// Colour of unknown cells in scale mode: transparent, and no known cell's grey.
const TRANSPARENT: Rgba<u8> = Rgba([128, 128, 128, 0]);

/// Mode of a map server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapMode {
    /// Free, occupied or unknown by two thresholds; the servers' default.
    Trinary,
    /// Probabilities between the thresholds; transparent pixels are unknown.
    Scale,
    /// Values of `nav_msgs/OccupancyGrid`.
    Raw,
}

/// Scale and corner of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapGeometry {
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Lower left corner of the picture, m to the right and ahead of the world's origin.
    pub corner_m: [f64; 2],
}

impl MapMode {
    /// All modes, the servers' default first.
    pub const ALL: [Self; 3] = [Self::Trinary, Self::Scale, Self::Raw];

    /// Name of the picture's file.
    pub fn picture(self) -> &'static str {
        match self {
            Self::Trinary => "map.pgm",
            Self::Scale => "map_scale.png",
            Self::Raw => "map_raw.pgm",
        }
    }

    /// Name of the YAML file that a map server is given.
    pub fn description(self) -> &'static str {
        match self {
            Self::Trinary => "map.yaml",
            Self::Scale => "map_scale.yaml",
            Self::Raw => "map_raw.yaml",
        }
    }

    /// Writes the YAML file that belongs to the picture.
    pub fn yaml(self, geometry: &MapGeometry) -> String {
        let MapGeometry { cell_m, corner_m: [x, y] } = geometry;
        let mode = match self {
            Self::Trinary => "trinary",
            Self::Scale => "scale",
            Self::Raw => "raw",
        };
        format!(
            "image: {}\nmode: {mode}\nresolution: {cell_m}\norigin: [{x}, {y}, 0.0]\nnegate: 0\n\
             occupied_thresh: {OCCUPIED_THRESH}\nfree_thresh: {FREE_THRESH}\n",
            self.picture()
        )
    }

    /// Encodes columns, row by row from the farthest, as the mode's picture.
    pub fn encode(self, states: &[CellState], size: (u32, u32)) -> Vec<u8> {
        let (width, height) = size;
        let pgm = |[free, occupied, unknown]: [u8; 3]| {
            let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
            bytes.extend(states.iter().map(|state| match state {
                CellState::Free => free,
                CellState::Occupied => occupied,
                CellState::Unknown => unknown,
            }));
            bytes
        };
        match self {
            Self::Trinary => pgm([FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY]),
            Self::Raw => pgm(RAW),
            // Grey with alpha is a kind of PNG that not every image library reads; RGBA is.
            Self::Scale => png(RgbaImage::from_fn(width, height, |u, v| {
                let opaque = |grey| Rgba([grey, grey, grey, 255]);
                match states.get((v * width + u) as usize) {
                    Some(CellState::Free) => opaque(FREE_GREY),
                    Some(CellState::Occupied) => opaque(OCCUPIED_GREY),
                    Some(CellState::Unknown) | None => TRANSPARENT,
                }
            })),
        }
    }
}

/// A picture as a PNG file.
pub(super) fn png<P>(picture: ImageBuffer<P, Vec<P::Subpixel>>) -> Vec<u8>
where
    P: image::Pixel + image::PixelWithColorType,
    [P::Subpixel]: image::EncodableLayout,
{
    let mut bytes = Vec::new();
    // Writing to memory cannot fail for a picture with pixels.
    let written = picture.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png);
    if written.is_ok() { bytes } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Cells of a random window: columns, rows, states.
    fn random_window(seed: u64) -> ((u32, u32), Vec<CellState>) {
        // An odd seed: xorshift stays at 0 forever.
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let size = ((random() % 20 + 1) as u32, (random() % 20 + 1) as u32);
        let states = (0..size.0 * size.1)
            .map(|_| match random() % 3 {
                0 => CellState::Free,
                1 => CellState::Occupied,
                _ => CellState::Unknown,
            })
            .collect();
        (size, states)
    }

    /// The value that a server publishes for a pixel (red, green, blue, opacity; `has_alpha` if the
    /// file has opacities), by the published rule of Nav2 or of ROS 1.
    fn loaded(
        yaml: &BTreeMap<String, String>,
        [r, g, b, alpha]: [u8; 4],
        has_alpha: bool,
        is_nav2: bool,
    ) -> i8 {
        let [r, g, b, alpha] = [r, g, b, alpha].map(f64::from);
        let number = |key: &str| yaml[key].parse::<f64>().unwrap();
        let (occupied, free) = (number("occupied_thresh"), number("free_thresh"));
        assert_eq!(yaml["negate"], "0");
        // Opacity counts as a fourth channel in trinary mode.
        let is_trinary = yaml["mode"] == "trinary";
        let shade =
            if is_trinary && has_alpha { (r + g + b + alpha) / 4.0 } else { (r + g + b) / 3.0 };
        let occupancy = 1.0 - shade / 255.0;
        match yaml["mode"].as_str() {
            "raw" if is_nav2 => {
                if shade <= 100.0 {
                    shade as i8
                } else {
                    -1
                }
            }
            "raw" => shade as u8 as i8,
            "scale" if is_nav2 && alpha < 255.0 => -1,
            _ if occupancy > occupied => 100,
            _ if occupancy < free => 0,
            "trinary" => -1,
            _ if alpha < 255.0 => -1,
            _ => ((occupancy - free) / (occupied - free) * 99.0) as i8,
        }
    }

    fn keys(yaml: &str) -> BTreeMap<String, String> {
        let pair =
            |line: &str| line.split_once(": ").map(|(key, value)| (key.into(), value.into()));
        yaml.lines().filter_map(pair).collect()
    }

    #[test]
    fn map_servers_load_each_cell_as_it_is_in_every_mode() {
        let geometry = MapGeometry { cell_m: 0.2, corner_m: [-6.4, 3.6] };
        for seed in 0..100 {
            let (size, states) = random_window(seed);
            for mode in MapMode::ALL {
                let picture = image::load_from_memory(&mode.encode(&states, size)).unwrap();
                let (has_alpha, pixels) = (picture.color().has_alpha(), picture.to_rgba8());
                assert_eq!(pixels.dimensions(), size);
                let yaml = keys(&mode.yaml(&geometry));
                for (pixel, state) in pixels.pixels().zip(&states) {
                    let expected = match state {
                        CellState::Free => 0,
                        CellState::Occupied => 100,
                        CellState::Unknown => -1,
                    };
                    // nav2 and ROS 1 decode the modes each in their way; both must agree.
                    let values = [true, false].map(|nav2| loaded(&yaml, pixel.0, has_alpha, nav2));
                    assert_eq!(values, [expected; 2], "{mode:?}, {state:?}, window {seed}");
                }
            }
        }
    }

    #[test]
    fn the_rule_of_the_servers_takes_unknown_for_free_above_its_occupancy() {
        let mut yaml =
            keys(&MapMode::Trinary.yaml(&MapGeometry { cell_m: 0.1, corner_m: [0.0; 2] }));
        let grey = [UNKNOWN_GREY, UNKNOWN_GREY, UNKNOWN_GREY, 255];
        assert_eq!(loaded(&yaml, grey, false, true), -1);
        yaml.insert("free_thresh".into(), "0.25".into());
        assert_eq!(loaded(&yaml, grey, false, true), 0);
    }
}
