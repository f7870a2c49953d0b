//! Images changed pixel by pixel, by place.

use crate::formats::Image;
use crate::input::source::StereoImages;

/// Place of a pixel in one image of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixel {
    pub u: f64,
    pub v: f64,
    /// Sides of the image, px.
    pub width: f64,
    pub height: f64,
    /// True in the right image.
    pub is_right: bool,
}

/// Changes every grey value of both images. What is in colour no longer fits, and is left out.
pub(super) fn each_pixel(images: &mut StereoImages, mut change: impl FnMut(Pixel, f64) -> f64) {
    for (is_right, image) in [(false, &mut images.left), (true, &mut images.right)] {
        let (columns, rows) = (image.width(), image.height());
        let (width, height) = (columns as f64, rows as f64);
        let mut at = 0;
        *image = image.map(|&value| {
            let (u, v) = ((at % columns) as f64, (at / columns) as f64);
            at += 1;
            let pixel = Pixel { u, v, width, height, is_right };
            change(pixel, f64::from(value)).round().clamp(0.0, 255.0) as u8
        });
    }
    images.colour = None;
}

/// Takes every pixel of both images from the place that `from` names.
pub(super) fn warp(images: &mut StereoImages, from: impl Fn(Pixel) -> [f64; 2]) {
    let sources = [images.left.clone(), images.right.clone()];
    each_pixel(images, |at, _| {
        let [left, right] = &sources;
        bilinear(if at.is_right { right } else { left }, from(at))
    });
}

/// Value between pixels; the border goes on beyond the image.
fn bilinear(image: &Image<u8>, [u, v]: [f64; 2]) -> f64 {
    let (left, top) = (u.floor(), v.floor());
    let value = |right: f64, low: f64| {
        let column = (left + right).clamp(0.0, image.width() as f64 - 1.0);
        let row = (top + low).clamp(0.0, image.height() as f64 - 1.0);
        image.get(column as usize, row as usize).map_or(0.0, f64::from)
    };
    let row = |low: f64| (1.0 - (u - left)) * value(0.0, low) + (u - left) * value(1.0, low);
    (1.0 - (v - top)) * row(0.0) + (v - top) * row(1.0)
}
