//! Pictures for the report: input, disparity in colours, the map from the camera's pose, errors against a reference.

use super::MapView;
use crate::evaluate::reference::{Region, Rule, Sample};
use dynvox_core::geometry::Transform;
use dynvox_core::image::{DISPARITY_ONE_PX, View};
use dynvox_core::tracking::MotionState;
use dynvox_core::view::{NORMAL_ONE, Raycaster};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

/// Widest picture of a frame, px: wider ones are thinned out, so that the report stays small.
pub const SMALL_PX: usize = 640;
/// Widest picture of the whole map, px.
pub const LARGE_PX: usize = 1_920;
/// Pixels without a surface or a disparity.
const EMPTY: [u8; 3] = [24, 26, 30];
/// Tint of dynamic objects.
const MOVING: [u8; 3] = [255, 120, 20];
/// Tint of static objects.
const STATIC: [u8; 3] = [40, 130, 255];
/// Share of a tint in what is tinted.
const TINT: f32 = 0.45;
/// Where light comes from, in camera axes (x right, y down, z forward), length 1: behind the camera's left shoulder.
const TO_LIGHT: [f32; 3] = [-0.36, -0.60, -0.714];

/// A picture under construction: the sampled pixels, row by row.
fn picture(widest_px: usize, width: usize, height: usize, pixel: impl Fn(usize, usize) -> [u8; 3]) -> Vec<u8> {
    let step = width.div_ceil(widest_px).max(1);
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let pixels: Vec<u8> = (0..rows).flat_map(|v| (0..columns).map(move |u| (u, v))).flat_map(|(u, v)| pixel(u * step, v * step)).collect();
    encoded(&pixels, columns, rows)
}

fn encoded(rgb: &[u8], width: usize, height: usize) -> Vec<u8> {
    let mut png = Vec::new();
    let made = PngEncoder::new(&mut png).write_image(rgb, width as u32, height as u32, ExtendedColorType::Rgb8);
    // A picture that cannot be encoded is left out of the report.
    if made.is_err() {
        png.clear();
    }
    png
}

/// Points over the darkened image, each a spot in the colour of its error.
pub fn errors<'a>(grey: &View<'_, u8>, samples: impl Iterator<Item = (&'a Sample, f32)>) -> Vec<u8> {
    let (width, height) = (grey.width(), grey.height());
    // A few steps of grey, so that the file stays small.
    let mut pixels: Vec<[u8; 3]> = grey.rows().flatten().map(|&grey| [grey / 32 * 11; 3]).collect();
    for (sample, seen_px) in samples {
        let colour = match sample.region {
            Region::Ignored => IGNORED,
            Region::Static | Region::Dynamic => error_colour(seen_px, sample.point.disparity_px),
        };
        let (u, v) = (usize::from(sample.point.u), usize::from(sample.point.v));
        // Two by two: scans are dense along rows and sparse across them.
        for (u, v) in [(u, v), (u + 1, v), (u, v + 1), (u + 1, v + 1)] {
            if let Some(pixel) = pixels.get_mut(v * width + u).filter(|_| u < width) {
                *pixel = colour;
            }
        }
    }
    encoded(pixels.as_flattened(), width, height)
}

/// Points that are in no figure.
pub const IGNORED: [u8; 3] = [110, 110, 110];
/// Points without an estimate.
pub const MISSING: [u8; 3] = [190, 60, 230];
/// Upper bounds of errors, as multiples of what is right, and their colours: blue is right, yellow to red wrong.
pub const ERRORS: [(f32, [u8; 3]); 6] = [
    (0.25, [49, 84, 200]),
    (0.5, [84, 148, 224]),
    (1.0, [150, 210, 240]),
    (2.0, [255, 214, 60]),
    (4.0, [250, 140, 30]),
    (f32::INFINITY, [225, 30, 30]),
];

/// The colour of an error by KITTI's rule: off by 3 px and by 5 % is once what is allowed.
fn error_colour(seen_px: f32, true_px: f32) -> [u8; 3] {
    if seen_px <= 0.0 {
        return MISSING;
    }
    let off_px = (seen_px - true_px).abs();
    let times = (off_px / Rule::KITTI.px).min(off_px / (Rule::KITTI.share * true_px));
    ERRORS.iter().find(|(up_to, _)| times <= *up_to).map_or(MISSING, |&(_, colour)| colour)
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

/// The map: its colours, or clay grey where it has none, lit from behind the camera, tinted by layer with the colours of `tint`. Empty
/// before the first raycast.
pub fn map(widest_px: usize, seen: &Raycaster<'_>, tint: impl Fn(u8) -> Option<[u8; 3]>) -> Vec<u8> {
    let (Some(depth_m), Some(normal), Some(colour), Some(layer)) = (seen.depth_m(), seen.normal(), seen.colour(), seen.layer()) else {
        return Vec::new();
    };
    Painting { depth_m, normal, colour, tint: |u, v| layer.get(u, v).and_then(&tint) }.png(widest_px)
}

/// The static map with every object at its pose: dynamic ones tinted orange, static ones blue. Empty without objects.
pub fn composed(widest_px: usize, view: &mut dyn MapView<'_>, t_world_camera: &Transform) -> Vec<u8> {
    let states: Vec<MotionState> = view.mapper().posed_objects().map(|posed| posed.summary.state).collect();
    if states.is_empty() {
        return Vec::new();
    }
    let tint = |layer: u8| match states.get(usize::from(layer).checked_sub(1)?)? {
        MotionState::Dynamic => Some(MOVING),
        _ => Some(STATIC),
    };
    view.raycast_with_objects(t_world_camera).map(|seen| map(widest_px, seen, tint)).unwrap_or_default()
}

/// What a raycast shows, and how it is painted.
struct Painting<'a, T> {
    /// Depth, m; 0 none.
    depth_m: View<'a, f32>,
    /// Normals in camera axes.
    normal: View<'a, [i8; 3]>,
    /// Colours; black where unknown.
    colour: View<'a, [u8; 3]>,
    /// Tint of a pixel, if it has one.
    tint: T,
}

impl<T: Fn(usize, usize) -> Option<[u8; 3]>> Painting<'_, T> {
    fn png(&self, widest_px: usize) -> Vec<u8> {
        picture(widest_px, self.depth_m.width(), self.depth_m.height(), |u, v| self.pixel(u, v).unwrap_or(EMPTY))
    }

    fn pixel(&self, u: usize, v: usize) -> Option<[u8; 3]> {
        let (depth, normal, colour) = (self.depth_m.get(u, v)?, self.normal.get(u, v)?, self.colour.get(u, v)?);
        if depth <= 0.0 {
            return None;
        }
        let facing: f32 = normal.iter().zip(TO_LIGHT).map(|(n, light)| f32::from(*n) * light).sum::<f32>() / NORMAL_ONE;
        let lit = facing.clamp(0.0, 1.0);
        let (base, ambient) = if colour == [0; 3] { ([205, 205, 200], 0.35) } else { (colour, 0.9) };
        let shaded = base.map(|channel| 1.05 * f32::from(channel) * (ambient + (1.0 - ambient) * lit));
        Some(match (self.tint)(u, v) {
            // A tinted surface keeps its shading: half its brightness, half the tint's colour.
            Some(tint) => [0, 1, 2].map(|c| (0.5 * shaded[c] + TINT * f32::from(tint[c])) as u8),
            None => shaded.map(|channel| channel as u8),
        })
    }
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
