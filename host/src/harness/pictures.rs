//! Pictures for the report: input, disparity in colours, the map from the camera's place.

use dynvox_core::image::{DISPARITY_ONE_PX, View};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

/// Widest picture of a frame, px: wider ones are thinned out, so that the report stays small.
pub const SMALL_PX: usize = 640;
/// Widest picture of the whole map, px.
pub const LARGE_PX: usize = 1_920;
/// Pixels without a surface or a disparity.
const EMPTY: [u8; 3] = [24, 26, 30];
/// Where light comes from, in camera axes (x right, y down, z forward), length 1: behind the camera's left shoulder.
const TO_LIGHT: [f32; 3] = [-0.36, -0.60, -0.714];

/// A picture under construction: the sampled pixels, row by row.
fn picture(widest_px: usize, width: usize, height: usize, pixel: impl Fn(usize, usize) -> [u8; 3]) -> Vec<u8> {
    let step = width.div_ceil(widest_px).max(1);
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let pixels: Vec<u8> = (0..rows).flat_map(|v| (0..columns).map(move |u| (u, v))).flat_map(|(u, v)| pixel(u * step, v * step)).collect();
    let mut png = Vec::new();
    let made = PngEncoder::new(&mut png).write_image(&pixels, columns as u32, rows as u32, ExtendedColorType::Rgb8);
    // A picture that cannot be encoded is left out of the report, no more.
    if made.is_err() {
        png.clear();
    }
    png
}

/// The left image, in colour where there is one.
pub fn input(grey: &View<'_, u8>, colour: Option<&View<'_, [u8; 3]>>) -> Vec<u8> {
    picture(SMALL_PX, grey.width(), grey.height(), |u, v| {
        colour.and_then(|colour| colour.get(u, v)).or_else(|| grey.get(u, v).map(|grey| [grey; 3])).unwrap_or(EMPTY)
    })
}

/// Disparity as colours from blue (far) to red (near); `near_px` is red.
pub fn disparity(disparity_q8: &View<'_, u16>, near_px: f32) -> Vec<u8> {
    picture(SMALL_PX, disparity_q8.width(), disparity_q8.height(), |u, v| match disparity_q8.get(u, v) {
        Some(q8) if q8 > 0 => turbo(f32::from(q8) / f32::from(DISPARITY_ONE_PX) / near_px),
        _ => EMPTY,
    })
}

/// The map: its colours, or clay grey where it has none, lit from behind the camera.
pub fn map(
    widest_px: usize,
    depth_m: &View<'_, f32>,
    normal: &View<'_, [i8; 3]>,
    colour: &View<'_, [u8; 3]>,
    to_camera: impl Fn([f32; 3]) -> [f32; 3],
) -> Vec<u8> {
    picture(widest_px, depth_m.width(), depth_m.height(), |u, v| {
        let (Some(depth), Some(normal), Some(colour)) = (depth_m.get(u, v), normal.get(u, v), colour.get(u, v)) else { return EMPTY };
        if depth <= 0.0 {
            return EMPTY;
        }
        let facing: f32 = to_camera(normal.map(f32::from)).iter().zip(TO_LIGHT).map(|(n, light)| n * light).sum::<f32>() / 127.0;
        let lit = facing.clamp(0.0, 1.0);
        let (base, ambient) = if colour == [0; 3] { ([205, 205, 200], 0.35) } else { (colour, 0.9) };
        base.map(|channel| (1.05 * f32::from(channel) * (ambient + (1.0 - ambient) * lit)) as u8)
    })
}

/// The *turbo* colour map (Mikhailov, 2019) by its polynomial approximation; `share` from 0 to 1.
fn turbo(share: f32) -> [u8; 3] {
    let x = share.clamp(0.0, 1.0);
    let polynomial = |terms: [f32; 6]| terms.iter().rev().fold(0.0, |sum, term| sum * x + term);
    [
        polynomial([0.135_721_4, 4.615_392_6, -42.660_32, 132.131_08, -152.942_4, 59.286_38]),
        polynomial([0.091_402_6, 2.194_188_4, 4.842_966_6, -14.185_033, 4.277_298_6, 2.829_566]),
        polynomial([0.106_673_3, 12.641_946, -60.582_048, 110.362_77, -89.903_11, 27.348_25]),
    ]
    .map(|value| (value.clamp(0.0, 1.0) * 255.0) as u8)
}
