//! Random scenes: patches that move in front of a wall, and a detector that errs.

use crate::{geometry::Transform, random::Random, tracking::Class};
use std::vec::Vec;

pub(super) const FRAMES: usize = 9;
pub(super) const SIZE: [usize; 2] = [96, 48];
const CLASSES: [Class; 3] = [Class::Car, Class::Person, Class::Other];

/// One detection.
pub(super) struct Box {
    pub class: Class,
    pub score: f32,
    /// Left, top, width, height, px.
    pub pixels: [i32; 4],
    pub mask: Vec<u8>,
}

/// One frame, as it is handed in.
pub(super) struct Frame {
    pub left: Vec<u8>,
    pub right: Vec<u8>,
    pub colour: Option<Vec<[u8; 3]>>,
    pub t_world_camera: Option<Transform>,
    pub seen: Vec<Box>,
}

/// A patch that moves in front of a wall.
struct Patch {
    at: [i32; 2],
    by: [i32; 2],
    size: [i32; 2],
    disparity: i32,
    class: Class,
}

impl Patch {
    fn random(random: &mut Random) -> Self {
        Self {
            at: [below(random, 80), below(random, 36)],
            by: [below(random, 5) - 2, below(random, 3) - 1],
            size: [6 + below(random, 30), 6 + below(random, 22)],
            disparity: 4 + below(random, 10),
            class: CLASSES[below(random, 3) as usize],
        }
    }

    /// Column and row within the patch of a pixel of the left (0) or right (1) image, if the pixel
    /// shows it.
    fn offset(&self, [u, v]: [i32; 2], camera: i32) -> Option<[i32; 2]> {
        let [du, dv] = [u + camera * self.disparity - self.at[0], v - self.at[1]];
        (du >= 0 && dv >= 0 && du < self.size[0] && dv < self.size[1]).then_some([du, dv])
    }

    /// The patch as the detector sees it: with holes, and not at all in one frame of four.
    fn detection(&self, random: &mut Random) -> Option<Box> {
        (below(random, 4) > 0).then(|| {
            let holes = below(random, 4);
            Box {
                pixels: [self.at[0], self.at[1], self.size[0], self.size[1]],
                mask: (0..self.size[0] * self.size[1])
                    .map(|_| u8::from(below(random, 8) >= holes))
                    .collect(),
                class: self.class,
                score: 0.5 + 0.05 * below(random, 10) as f32,
            }
        })
    }
}

/// A texture without borders.
fn texture(u: i32, v: i32, seed: u32) -> u8 {
    let hash = |u: i32, v: i32| {
        let x = (u as u32).wrapping_mul(0x9E37_79B9)
            ^ (v as u32).wrapping_mul(0x85EB_CA6B)
            ^ seed.wrapping_mul(0xC2B2_AE35);
        let x = (x ^ x >> 15).wrapping_mul(0x2C1B_3C6D);
        ((x ^ x >> 12) & 0xFF) as i32
    };
    let (cell_u, cell_v) = (u.div_euclid(3), v.div_euclid(3));
    ((2 * hash(cell_u, cell_v) + hash(u, v)) / 3) as u8
}

fn below(random: &mut Random, bound: i32) -> i32 {
    random.below(bound as u32) as i32
}

/// A detection of nothing, which may reach beyond the image.
fn false_detection(random: &mut Random) -> Box {
    let [width, height] = [1 + below(random, 40), 1 + below(random, 30)];
    Box {
        pixels: [below(random, 110) - 10, below(random, 60) - 10, width, height],
        mask: (0..width * height).map(|_| below(random, 3) as u8).collect(),
        class: CLASSES[below(random, 3) as usize],
        score: below(random, 12) as f32 * 0.1,
    }
}

/// The left (0) or right (1) image: patches in front of a wall that has moved by `shift` px.
fn image(patches: &[Patch], shift: i32, seed: u64, camera: i32) -> Vec<u8> {
    let value = |u: i32, v: i32| {
        let offsets = patches.iter().map(|patch| patch.offset([u, v], camera));
        let first = (7..).zip(offsets).find_map(|(texture, offset)| Some((texture, offset?)));
        match first {
            Some((seed, [du, dv])) => texture(du, dv, seed),
            None => texture(u + camera * 3 + shift, v, seed as u32),
        }
    };
    let pixels = (0..SIZE[1] as i32).flat_map(|v| (0..SIZE[0] as i32).map(move |u| (u, v)));
    pixels.map(|(u, v)| value(u, v)).collect()
}

/// A run of [`FRAMES`] frames, all of it from one seed: the camera's motion, the patches', what the
/// detector misses or makes up.
pub(super) fn run(seed: u64) -> Vec<Frame> {
    let mut random = Random::new(seed);
    let mut patches: Vec<Patch> =
        (0..1 + below(&mut random, 3)).map(|_| Patch::random(&mut random)).collect();
    let (given, coloured, speed) =
        (below(&mut random, 3) == 0, below(&mut random, 2) == 0, below(&mut random, 3));
    (0..FRAMES as i32)
        .map(|at| {
            // Now and then a camera sees nothing.
            let black = below(&mut random, 12) == 0;
            let images = [0, 1].map(|camera| {
                if black {
                    std::vec![0; SIZE[0] * SIZE[1]]
                } else {
                    image(&patches, at * speed, seed, camera)
                }
            });
            let mut seen: Vec<Box> =
                patches.iter().filter_map(|patch| patch.detection(&mut random)).collect();
            if below(&mut random, 4) == 0 {
                seen.push(false_detection(&mut random));
            }
            for patch in &mut patches {
                patch.at = [patch.at[0] + patch.by[0], patch.at[1] + patch.by[1]];
            }
            let [left, right] = images;
            Frame {
                colour: coloured
                    .then(|| left.iter().map(|&grey| [grey, grey / 2, 255 - grey]).collect()),
                left,
                right,
                t_world_camera: given.then(|| {
                    Transform::from_translation([
                        0.05 * f64::from(at * speed),
                        0.0,
                        0.1 * f64::from(at),
                    ])
                }),
                seen,
            }
        })
        .collect()
}
