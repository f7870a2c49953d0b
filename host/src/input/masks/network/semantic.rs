//! Semantic maps: a class a pixel.

use super::PicturePart;
use super::model::Output;
use crate::formats::Image;

/// The class of each pixel as [`dynvox_core::tracking::Class::code`], 0 for those that are not
/// kept. Logits are interpolated between their pixels, numbers of classes are not.
pub fn decode(output: &Output, part: &PicturePart<'_>) -> Option<Image<u8>> {
    let (map_width, map_height) = (*output.shape.last()?, output.shape[output.shape.len() - 2]);
    let channels = if output.shape.len() == 4 { output.shape[1] } else { 1 };
    let (width, height) = part.picture;
    let share = [map_width as f64 / part.input.0 as f64, map_height as f64 / part.input.1 as f64];
    let map = Map { values: &output.values, width: map_width, height: map_height };
    let code = |class: usize| {
        part.classes.get(class).copied().flatten().map_or(0, |class| class.code() as u8)
    };
    let mut codes = Vec::with_capacity(width * height);
    for v in 0..height {
        for u in 0..width {
            let at = part.fit.input_point([u as f64 + 0.5, v as f64 + 0.5]);
            let [x, y] = [at[0] * share[0], at[1] * share[1]];
            let class = match channels {
                1 => map.nearest(x, y) as usize,
                _ => map.best(channels, x, y),
            };
            codes.push(if part.fit.is_filled(at) { code(class) } else { 0 });
        }
    }
    Image::new(width, height, codes)
}

/// Channels of numbers.
pub struct Map<'o> {
    /// Channel by channel, row by row.
    pub values: &'o [f32],
    pub width: usize,
    pub height: usize,
}

impl Map<'_> {
    fn value(&self, channel: usize, u: usize, v: usize) -> f32 {
        self.values.get((channel * self.height + v) * self.width + u).copied().unwrap_or(0.0)
    }

    /// The number at a point of the first channel.
    fn nearest(&self, x: f64, y: f64) -> f32 {
        self.value(0, (x as usize).min(self.width - 1), (y as usize).min(self.height - 1))
    }

    /// The numbers of so many channels at a point, interpolated.
    pub fn at(&self, channels: usize, x: f64, y: f64) -> impl Iterator<Item = f32> + '_ {
        let axis = |at: f64, size: usize| {
            let at = (at - 0.5).clamp(0.0, (size - 1) as f64);
            let low = at as usize;
            (low, (low + 1).min(size - 1), (at - low as f64) as f32)
        };
        let ((left, right, right_share), (top, bottom, bottom_share)) =
            (axis(x, self.width), axis(y, self.height));
        (0..channels).map(move |channel| {
            let row = |v: usize| {
                let [a, b] = [left, right].map(|u| self.value(channel, u, v));
                a + (b - a) * right_share
            };
            row(top) + (row(bottom) - row(top)) * bottom_share
        })
    }

    /// The channel with the largest number at a point.
    fn best(&self, channels: usize, x: f64, y: f64) -> usize {
        let all = self.at(channels, x, y).enumerate();
        all.reduce(|best, one| if one.1 > best.1 { one } else { best })
            .map_or(0, |(channel, _)| channel)
    }
}
