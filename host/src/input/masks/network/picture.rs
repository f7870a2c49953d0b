//! A picture as a network's input.

use crate::formats::Image;
use crate::input::source::StereoImages;

/// A picture is divided into tiles when it is so many times as wide as the input's shape.
const WIDE: f64 = 1.5;
/// Overlap of a tile with its neighbour, as a share of its width.
const OVERLAP: f64 = 0.15;

/// The left image, in colour where it is.
pub enum Picture<'i> {
    /// Red, green, blue.
    Colour(&'i Image<[u8; 3]>),
    /// Grey.
    Grey(&'i Image<u8>),
}

impl<'i> Picture<'i> {
    pub fn of(images: &'i StereoImages) -> Self {
        images.colour.as_ref().map_or(Self::Grey(&images.left), Self::Colour)
    }

    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Colour(image) => (image.width(), image.height()),
            Self::Grey(image) => (image.width(), image.height()),
        }
    }

    fn rgb(&self, u: usize, v: usize) -> [f32; 3] {
        match self {
            Self::Colour(image) => image.get(u, v).unwrap_or_default().map(f32::from),
            Self::Grey(image) => [f32::from(image.get(u, v).unwrap_or_default()); 3],
        }
    }

    /// The colour at a point, px from the outer corner of the upper left pixel: bilinear between
    /// pixels.
    pub fn sample(&self, x: f64, y: f64) -> [f32; 3] {
        let (width, height) = self.size();
        let axis = |at: f64, size: usize| {
            let at = (at - 0.5).clamp(0.0, (size - 1) as f64);
            let low = at as usize;
            (low, (low + 1).min(size - 1), (at - low as f64) as f32)
        };
        let ((left, right, right_share), (top, bottom, bottom_share)) =
            (axis(x, width), axis(y, height));
        let [a, b, c, d] = [
            self.rgb(left, top),
            self.rgb(right, top),
            self.rgb(left, bottom),
            self.rgb(right, bottom),
        ];
        std::array::from_fn(|channel| {
            let upper = a[channel] + (b[channel] - a[channel]) * right_share;
            let lower = c[channel] + (d[channel] - c[channel]) * right_share;
            upper + (lower - upper) * bottom_share
        })
    }
}

/// Position of a part of a picture in an input: at its upper left corner, scaled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Upper left corner of the part, px.
    left: f64,
    top: f64,
    /// Input px for each px of the picture.
    scale: [f64; 2],
    /// Extent of the input that the part fills, px.
    filled: [f64; 2],
}

impl Fit {
    /// Fits a part (left, top, width, height) of a picture into an input of `size`.
    pub fn new([left, top, width, height]: [usize; 4], size: (usize, usize), fill: bool) -> Self {
        let [x, y] = [size.0 as f64 / width as f64, size.1 as f64 / height as f64];
        let scale = if fill { [x, y] } else { [x.min(y); 2] };
        Self {
            left: left as f64,
            top: top as f64,
            scale,
            filled: [width as f64 * scale[0], height as f64 * scale[1]],
        }
    }

    /// Maps a point of the input into the picture, px.
    pub fn picture_point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.left + x / self.scale[0], self.top + y / self.scale[1]]
    }

    /// Maps a point of the picture into the input, px.
    pub fn input_point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x - self.left) * self.scale[0], (y - self.top) * self.scale[1]]
    }

    /// Returns true if a point of the input shows the picture.
    pub fn is_filled(&self, [x, y]: [f64; 2]) -> bool {
        x < self.filled[0] && y < self.filled[1]
    }
}

/// Tiles of a picture, side by side with an overlap: `count` of them, or two where the picture is
/// wide for an input of `size`.
pub fn tiles(
    (width, height): (usize, usize),
    size: (usize, usize),
    count: Option<usize>,
) -> Vec<[usize; 4]> {
    let is_wide = width as f64 / height as f64 >= WIDE * size.0 as f64 / size.1 as f64;
    let count = count.unwrap_or(if is_wide { 2 } else { 0 });
    let tile = width as f64 / (count as f64 - (count as f64 - 1.0) * OVERLAP);
    let left = |index: usize| (index as f64 * tile * (1.0 - OVERLAP)) as usize;
    (0..count)
        .map(|index| {
            [
                left(index),
                0,
                if index + 1 == count { width - left(index) } else { tile as usize },
                height,
            ]
        })
        .collect()
}
