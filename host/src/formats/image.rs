//! Owned images.

use dynvox_core::image::View;

/// An owned image, row by row without padding.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    pixels: Vec<T>,
}

impl<T> Image<T> {
    /// Takes over `pixels`; `None` unless there are `width` x `height` of them and at least one.
    pub fn new(width: usize, height: usize, pixels: Vec<T>) -> Option<Self> {
        (width > 0 && height > 0 && width.checked_mul(height)? == pixels.len()).then_some(Self {
            width,
            height,
            pixels,
        })
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// Hands out the pixels.
    pub fn into_pixels(self) -> Vec<T> {
        self.pixels
    }

    /// Borrows it as the core takes images.
    pub fn view(&self) -> Option<View<'_, T>> {
        View::new(&self.pixels, self.width, self.height)
    }

    /// Returns the image with every pixel mapped.
    pub fn map<U>(&self, each: impl FnMut(&T) -> U) -> Image<U> {
        Image {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(each).collect(),
        }
    }
}

impl<T: Copy> Image<T> {
    /// Copies a view.
    pub fn from_view(view: &View<'_, T>) -> Self {
        Self {
            width: view.width(),
            height: view.height(),
            pixels: view.rows().flatten().copied().collect(),
        }
    }

    /// Pixel at column `u`, row `v`; `None` beyond the image.
    pub fn get(&self, u: usize, v: usize) -> Option<T> {
        if u >= self.width { None } else { self.pixels.get(v * self.width + u).copied() }
    }
}

/// Luma of ITU-R BT.601 in integers: the grey of a colour image is the same on every machine.
pub fn luma([r, g, b]: [u8; 3]) -> u8 {
    ((77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b) + 128) >> 8) as u8
}
