//! A rectified pair with rows drawn: left and right beside each other.

use crate::formats::Image;
use crate::input::FrameSource;
use crate::input::diagnosis::RectifiedSource;
use crate::owned;
use anyhow::Context;
use image::{Rgb, RgbImage};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Rows that are drawn.
const ROWS: usize = 16;
/// Names tried for a picture without one.
const NAMES: usize = 1_000;
/// Colours of neighbouring rows.
const COLOURS: [[u8; 3]; 3] = [[255, 80, 80], [80, 220, 80], [90, 150, 255]];

/// Draws the middle frame of a source.
pub fn draw(source: &dyn FrameSource) -> anyhow::Result<RgbImage> {
    let middle = source.len() / 2;
    let pair = RectifiedSource::new(source)?.pair(middle)?;
    let [left, right] =
        pair.with_context(|| format!("frame {middle} is empty. Give other images"))?;
    Ok(with_rows(&left, &right))
}

/// Both images and lines along some rows.
fn with_rows(left: &Image<u8>, right: &Image<u8>) -> RgbImage {
    let (width, height) = (left.width(), left.height());
    let step = height.div_ceil(ROWS).max(1);
    let side = |side: usize| u32::try_from(side).unwrap_or(0);
    RgbImage::from_fn(side(2 * width), side(height), |u, v| {
        let (u, v) = (u as usize, v as usize);
        let (image, u) = if u < width { (left, u) } else { (right, u - width) };
        let grey = image.get(u, v).unwrap_or(0);
        let row = v % step == step / 2;
        match COLOURS.get(v / step % COLOURS.len()) {
            Some(colour) if row => Rgb(*colour),
            _ => Rgb([grey; 3]),
        }
    })
}

/// Writes a picture to a new file, and returns its path.
pub fn write(picture: &RgbImage, path: Option<&Path>) -> anyhow::Result<PathBuf> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    let name = |number: usize| match number {
        0 => PathBuf::from("rectified_pair.png"),
        number => PathBuf::from(format!("rectified_pair_{number}.png")),
    };
    let path = match path {
        Some(path) => path.to_path_buf(),
        None => (0..NAMES).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(NAMES)),
    };
    let hint = || format!("{} cannot be written. Give a new file with --picture", path.display());
    owned::write(&path, bytes.get_ref()).with_context(hint)?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_run_through_both_images() {
        let image = |grey| Image::new(8, 32, vec![grey; 256]).unwrap();
        let drawn = with_rows(&image(10), &image(20));
        assert_eq!(drawn.dimensions(), (16, 32));
        assert_eq!((drawn.get_pixel(0, 0).0, drawn.get_pixel(15, 0).0), ([10; 3], [20; 3]));
        assert_eq!(drawn.get_pixel(0, 1), drawn.get_pixel(15, 1), "one line");
        assert_eq!(drawn.get_pixel(0, 1).0, COLOURS[0]);
    }
}
