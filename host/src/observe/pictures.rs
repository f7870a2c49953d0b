//! Pictures for the report: input, disparity in colours, the map from the camera's pose, errors
//! against a reference.

use super::MapView;
use crate::evaluate::reference::{Region, Rule, Sample};
use dynvox_core::Mapper;
use dynvox_core::geometry::Transform;
use dynvox_core::image::{DISPARITY_ONE_PX, DisparityQ8, View};
use dynvox_core::tracking::MotionState;
use dynvox_core::view::{NORMAL_ONE, RaycastView, Raycaster};
use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageResult, Rgb, RgbImage, Rgba, RgbaImage};

/// Widest picture of a frame, px: wider ones are thinned out, so that the report stays small.
pub const SMALL_PX: usize = 640;
/// Widest picture of the whole map, px.
pub const LARGE_PX: usize = 1_920;
/// Disparity shown in red, as a share of the image width.
const NEAR_SHARE: f32 = 0.08;
/// Pixels without a surface or a disparity.
const EMPTY: [u8; 3] = [24, 26, 30];
/// Tint of dynamic objects.
const MOVING: [u8; 3] = [255, 120, 20];
/// Tint of static objects.
const STATIC: [u8; 3] = [40, 130, 255];
/// Tint of objects whose motion is not known.
const UNCERTAIN: [u8; 3] = [190, 190, 190];
/// Share of a tint in what is tinted.
const TINT: f32 = 0.45;
/// Direction towards the light in camera axes (x right, y down, z forward), length 1: behind the
/// camera's left shoulder.
const TO_LIGHT: [f32; 3] = [-0.36, -0.60, -0.714];

/// Quality of JPEG files, of 100.
const JPEG_QUALITY: u8 = 78;
/// Opacity of a mask over the image, of 255.
const MASK_ALPHA: u8 = 120;

/// A picture as a PNG file.
pub fn png(picture: &RgbImage) -> Vec<u8> {
    file(|out| {
        PngEncoder::new(out).write_image(
            picture,
            picture.width(),
            picture.height(),
            ExtendedColorType::Rgb8,
        )
    })
}

/// A picture as a JPEG file: without planes of colour where it has none, which show the same
/// pixels.
pub fn jpeg(picture: &RgbImage) -> Vec<u8> {
    let grey: Option<Vec<u8>> = picture
        .pixels()
        .map(|&Rgb([red, green, blue])| (red == green && green == blue).then_some(red))
        .collect();
    let (width, height) = picture.dimensions();
    file(|out| {
        let encoder = JpegEncoder::new_with_quality(out, JPEG_QUALITY);
        match grey {
            Some(grey) => encoder.write_image(&grey, width, height, ExtendedColorType::L8),
            None => encoder.write_image(picture, width, height, ExtendedColorType::Rgb8),
        }
    })
}

/// Collects the bytes that an encoder writes. A picture that cannot be encoded is left out of the
/// report.
fn file(encode: impl FnOnce(&mut Vec<u8>) -> ImageResult<()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    if encode(&mut bytes).is_err() {
        bytes.clear();
    }
    bytes
}

/// Every so many pixels is shown so that a picture is not wider than `widest_px`.
fn step(widest_px: usize, width: usize) -> usize {
    width.div_ceil(widest_px).max(1)
}

/// Returns the thinning step, and the columns and rows that remain.
fn thinned(widest_px: usize, width: usize, height: usize) -> (usize, u32, u32) {
    let step = step(widest_px, width);
    (step, width.div_ceil(step) as u32, height.div_ceil(step) as u32)
}

/// A picture of the sampled pixels.
fn picture(
    widest_px: usize,
    width: usize,
    height: usize,
    pixel: impl Fn(usize, usize) -> [u8; 3],
) -> RgbImage {
    let (step, columns, rows) = thinned(widest_px, width, height);
    // One of `step` pixels: pictures for looking at need no average.
    RgbImage::from_fn(columns, rows, |u, v| Rgb(pixel(u as usize * step, v as usize * step)))
}

/// The colour of a motion state.
pub fn state_colour(state: MotionState) -> [u8; 3] {
    match state {
        MotionState::Uncertain => UNCERTAIN,
        MotionState::Static => STATIC,
        MotionState::Dynamic => MOVING,
    }
}

/// The instances of the last frame in the colours of their motion states, transparent elsewhere, as
/// a PNG file. Empty without instances.
pub fn masks(mapper: &Mapper<'_>, width: usize, height: usize) -> Vec<u8> {
    let (step, columns, rows) = thinned(SMALL_PX, width, height);
    let instance =
        |u: u32, v: u32| mapper.instance_at((u as usize * step) as i32, (v as usize * step) as i32);
    let colour = |u: u32, v: u32| instance(u, v).map(|instance| state_colour(instance.state));
    let mask = RgbaImage::from_fn(columns, rows, |u, v| match colour(u, v) {
        Some([red, green, blue]) => Rgba([red, green, blue, MASK_ALPHA]),
        None => Rgba([0; 4]),
    });
    // Objects that are all too small for the thinned pixels.
    if mask.pixels().all(|pixel| pixel.0[3] == 0) {
        return Vec::new();
    }
    file(|out| PngEncoder::new(out).write_image(&mask, columns, rows, ExtendedColorType::Rgba8))
}

/// Points over the darkened image, each a spot in the colour of its error.
pub fn errors<'a>(
    grey: &View<'_, u8>,
    samples: impl Iterator<Item = (&'a Sample, f32)>,
) -> Vec<u8> {
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
    RgbImage::from_raw(width as u32, height as u32, pixels.into_flattened())
        .map(|picture| jpeg(&picture))
        .unwrap_or_default()
}

/// Disparities against true ones, both 1/256 px and 0 none, each pixel of truth in the colour of
/// its error over the darkened image; what the matcher filled in is darker.
pub fn disparity_errors(
    grey: &View<'_, u8>,
    truth: &View<'_, u16>,
    given: &View<'_, u16>,
    marked: bool,
) -> Vec<u8> {
    // From 1/256 px.
    let px = |q8: u16| f32::from(q8) / f32::from(DISPARITY_ONE_PX);
    let picture = RgbImage::from_fn(grey.width() as u32, grey.height() as u32, |u, v| {
        let at = (u as usize, v as usize);
        let [truth, given] = [truth, given].map(|image| image.get(at.0, at.1).unwrap_or_default());
        if truth == 0 {
            // At most a third of full brightness, so that the errors stand out.
            return Rgb([grey.get(at.0, at.1).unwrap_or_default() / 32 * 11; 3]);
        }
        let colour = error_colour(px(given), px(truth));
        Rgb(if marked && DisparityQ8::new(given).is_filled() {
            colour.map(|channel| channel / 2)
        } else {
            colour
        })
    });
    png(&picture)
}

/// Points that are in no figure.
pub const IGNORED: [u8; 3] = [110, 110, 110];
/// Points without an estimate.
pub const MISSING: [u8; 3] = [190, 60, 230];
/// Upper bounds of errors, as multiples of what is right, and their colours: blue is right, yellow
/// to red wrong.
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
pub fn input(grey: &View<'_, u8>, colour: Option<&View<'_, [u8; 3]>>) -> RgbImage {
    picture(SMALL_PX, grey.width(), grey.height(), |u, v| {
        colour
            .and_then(|colour| colour.get(u, v))
            .or_else(|| grey.get(u, v).map(|grey| [grey; 3]))
            .unwrap_or(EMPTY)
    })
}

/// Disparity as colours from blue (far) to red (near).
pub fn disparity(disparity_q8: &View<'_, u16>) -> RgbImage {
    // Disparities are a share of the width: near is the same in any size of images.
    let near_px = NEAR_SHARE * disparity_q8.width() as f32;
    picture(SMALL_PX, disparity_q8.width(), disparity_q8.height(), |u, v| {
        match disparity_q8.get(u, v) {
            Some(q8) if q8 > 0 => turbo(f32::from(q8) / f32::from(DISPARITY_ONE_PX) / near_px),
            _ => EMPTY,
        }
    })
}

/// A view of the map that is not wider than `widest_px`.
fn looking(widest_px: usize, view: &dyn MapView<'_>, t_world_camera: &Transform) -> RaycastView {
    let every = step(widest_px, view.mapper().disparity_q8().width());
    RaycastView { every, ..t_world_camera.into() }
}

/// The static map: its colours, or clay grey where it has none, lit from behind the camera.
pub fn map(
    widest_px: usize,
    view: &mut dyn MapView<'_>,
    t_world_camera: &Transform,
) -> Option<RgbImage> {
    painted(view.raycast(looking(widest_px, view, t_world_camera))?, |_| None)
}

/// The static map with every object at its pose: dynamic ones tinted orange, static ones blue.
/// `None` without objects.
pub fn composed(
    widest_px: usize,
    view: &mut dyn MapView<'_>,
    t_world_camera: &Transform,
) -> Option<RgbImage> {
    let states: Vec<MotionState> =
        view.mapper().posed_objects().map(|posed| posed.summary.state).collect();
    if states.is_empty() {
        return None;
    }
    // Layer 0 is the static map, which has no tint.
    let tint = |layer: u8| match states.get(usize::from(layer).checked_sub(1)?)? {
        MotionState::Dynamic => Some(MOVING),
        _ => Some(STATIC),
    };
    painted(view.raycast_with_objects(looking(widest_px, view, t_world_camera))?, tint)
}

/// Paints a raycast, tinted by layer with the colours of `tint`. `None` before the first raycast.
fn painted(seen: &Raycaster<'_>, tint: impl Fn(u8) -> Option<[u8; 3]>) -> Option<RgbImage> {
    let (depth_m, normal, colour, layer) =
        (seen.depth_m()?, seen.normal()?, seen.colour()?, seen.layer()?);
    Some(
        Painting { depth_m, normal, colour, tint: |u, v| layer.get(u, v).and_then(&tint) }
            .picture(),
    )
}

/// Raycast and the way in which it is painted.
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
    fn picture(&self) -> RgbImage {
        let (width, height) = (self.depth_m.width() as u32, self.depth_m.height() as u32);
        RgbImage::from_fn(width, height, |u, v| {
            Rgb(self.pixel(u as usize, v as usize).unwrap_or(EMPTY))
        })
    }

    fn pixel(&self, u: usize, v: usize) -> Option<[u8; 3]> {
        let (depth, normal, colour) =
            (self.depth_m.get(u, v)?, self.normal.get(u, v)?, self.colour.get(u, v)?);
        if depth <= 0.0 {
            // No surface: the background shows through.
            return None;
        }
        let facing: f32 =
            normal.iter().zip(TO_LIGHT).map(|(n, light)| f32::from(*n) * light).sum::<f32>()
                / NORMAL_ONE;
        let lit = facing.clamp(0.0, 1.0);
        // Without colour the shading has to show the form.
        let (base, ambient) =
            if colour == [0; 3] { ([205, 205, 200], 0.35) } else { (colour, 0.9) };
        let shaded =
            base.map(|channel| 1.05 * f32::from(channel) * (ambient + (1.0 - ambient) * lit));
        Some(match (self.tint)(u, v) {
            // A tinted surface keeps its shading: half its brightness, half the tint's colour.
            Some(tint) => [0, 1, 2].map(|c| (0.5 * shaded[c] + TINT * f32::from(tint[c])) as u8),
            None => shaded.map(|channel| channel as u8),
        })
    }
}

/// The *turbo* colour map (Mikhailov, 2019) by its polynomial approximation; `share` from 0 to 1.
fn turbo(share: f32) -> [u8; 3] {
    // Beyond the ends the polynomial leaves the colours.
    let x = share.clamp(0.0, 1.0);
    // Horner's rule, from the highest power.
    let polynomial = |terms: [f32; 6]| terms.iter().rev().fold(0.0, |sum, term| sum * x + term);
    [
        polynomial([0.135_721_4, 4.615_392_6, -42.660_32, 132.131_08, -152.942_4, 59.286_38]),
        polynomial([0.091_402_6, 2.194_188_4, 4.842_966_6, -14.185_033, 4.277_298_6, 2.829_566]),
        polynomial([0.106_673_3, 12.641_946, -60.582_048, 110.362_77, -89.903_11, 27.348_25]),
    ]
    .map(|value| (value.clamp(0.0, 1.0) * 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grey_picture_shows_the_same_with_and_without_planes_of_colour() {
        // All grey levels, in no order that compresses well.
        let grey = RgbImage::from_fn(75, 41, |u, v| Rgb([(u * u + 3 * v * v + u * v) as u8; 3]));
        let [one_plane, three_planes] = [
            jpeg(&grey),
            file(|out| JpegEncoder::new_with_quality(out, JPEG_QUALITY).encode_image(&grey)),
        ];
        let [one, three] =
            [&one_plane, &three_planes].map(|bytes| image::load_from_memory(bytes).unwrap());
        assert_eq!((one.color().channel_count(), three.color().channel_count()), (1, 3));
        assert!(one.into_rgb8() == three.into_rgb8() && one_plane.len() < three_planes.len());
    }
}
