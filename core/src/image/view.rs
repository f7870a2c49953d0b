//! Row-major image views over borrowed slices.

use crate::slices::clipped;
use bytemuck::TransparentWrapper;

/// A read-only image. Rows are `stride` items apart.
///
/// ```
/// use dynvox_core::image::View;
///
/// let pixels = [1, 2, 3, 4, 5, 6];
/// let view = View::new(&pixels, 3, 2).unwrap();
/// assert_eq!((view.get(2, 1), view.get(3, 0), view.row(1)), (Some(6), None, &[4, 5, 6][..]));
/// assert!(View::new(&pixels, 3, 3).is_none(), "three pixels are missing");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct View<'a, T> {
    data: &'a [T],
    width: usize,
    height: usize,
    stride: usize,
}

/// Items a view of this shape spans, or nothing when the shape is absurd.
fn span(width: usize, height: usize, stride: usize) -> Option<usize> {
    if width == 0 || height == 0 || stride < width {
        return None;
    }
    (height - 1).checked_mul(stride)?.checked_add(width)
}

impl View<'_, u16> {
    /// One pixel, 0.
    pub(crate) const ONE_ZERO: Self = Self { data: &[0], width: 1, height: 1, stride: 1 };
}

impl<'a, T> View<'a, T> {
    /// Views `data` as `width` x `height`, rows `width` apart. `None` when empty or when `data` is
    /// too short.
    pub fn new(data: &'a [T], width: usize, height: usize) -> Option<Self> {
        Self::with_stride(data, width, height, width)
    }

    /// Makes a view like [`View::new`], with rows `stride` items apart.
    ///
    /// ```
    /// use dynvox_core::image::View;
    ///
    /// let padded = [1, 2, 0, 0, 3, 4];
    /// let rows: Vec<&[u8]> = View::with_stride(&padded, 2, 2, 4).unwrap().rows().collect();
    /// assert_eq!(rows, [[1, 2], [3, 4]]);
    /// ```
    pub fn with_stride(data: &'a [T], width: usize, height: usize, stride: usize) -> Option<Self> {
        (data.len() >= span(width, height, stride)?).then_some(Self { data, width, height, stride })
    }

    /// The part of `width` x `height` pixels from (`left`, `top`) on; `None` when it is empty or
    /// does not lie within.
    ///
    /// ```
    /// use dynvox_core::image::View;
    ///
    /// let pixels: Vec<u8> = (0..12).collect();
    /// let part = View::new(&pixels, 4, 3).unwrap().part(1, 1, 2, 2).unwrap();
    /// assert_eq!((part.row(0), part.row(1)), (&[5, 6][..], &[9, 10][..]));
    /// ```
    pub fn part(&self, left: usize, top: usize, width: usize, height: usize) -> Option<Self> {
        // Checked, since sizes come from callers and may overflow.
        let within =
            left.checked_add(width)? <= self.width && top.checked_add(height)? <= self.height;
        let first = top.checked_mul(self.stride)?.checked_add(left)?;
        if within {
            Self::with_stride(self.data.get(first..)?, width, height, self.stride)
        } else {
            None
        }
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Row `v`; empty beyond the image.
    ///
    /// ```
    /// use dynvox_core::image::View;
    ///
    /// let image = View::new(&[1, 2, 3, 4, 5, 6], 3, 2).unwrap();
    /// assert_eq!(image.row(1), [4, 5, 6]);
    /// assert!(image.row(2).is_empty(), "below the image");
    /// ```
    pub fn row(&self, v: usize) -> &'a [T] {
        if v >= self.height {
            return &[];
        }
        clipped(self.data, v * self.stride..v * self.stride + self.width)
    }

    /// The pixels row by row, of an image without padding; empty for one with.
    ///
    /// ```
    /// use dynvox_core::image::View;
    ///
    /// let image = View::new(&[1u8, 2, 3, 4], 2, 2).unwrap();
    /// assert_eq!(image.pixels().iter().map(|&pixel| u32::from(pixel)).sum::<u32>(), 10);
    /// ```
    pub fn pixels(&self) -> &'a [T] {
        if self.stride == self.width { clipped(self.data, ..self.width * self.height) } else { &[] }
    }

    /// The pixels from the first on, and how many items apart rows are.
    pub fn strided(&self) -> (&'a [T], usize) {
        (self.data, self.stride)
    }

    /// All rows, top to bottom.
    ///
    /// ```
    /// use dynvox_core::image::View;
    ///
    /// let image = View::new(&[1, 2, 3, 4, 5, 6], 3, 2).unwrap();
    /// assert_eq!(image.rows().map(|row| row[0]).collect::<Vec<_>>(), [1, 4]);
    /// ```
    pub fn rows(&self) -> impl Iterator<Item = &'a [T]> + use<'a, T> {
        let this = (self.data, self.width, self.stride);
        (0..self.height).map(move |v| clipped(this.0, v * this.2..v * this.2 + this.1))
    }
}

impl<'a, W> View<'a, W> {
    /// The image with the values that its pixels wrap.
    pub(crate) fn peeled<T>(self) -> View<'a, T>
    where
        W: TransparentWrapper<T>,
    {
        let Self { data, width, height, stride } = self;
        View { data: W::peel_slice(data), width, height, stride }
    }
}

impl<'a, T: Copy> View<'a, T> {
    /// Pixel at column `u`, row `v`; `None` beyond the image.
    ///
    /// ```
    /// use dynvox_core::image::View;
    ///
    /// let image = View::new(&[1, 2, 3, 4, 5, 6], 3, 2).unwrap();
    /// assert_eq!((image.get(2, 1), image.get(3, 1)), (Some(6), None));
    /// ```
    pub fn get(&self, u: usize, v: usize) -> Option<T> {
        self.row(v).get(u).copied()
    }
}

/// A writable image without padding.
///
/// ```
/// use dynvox_core::image::ViewMut;
///
/// let mut depths = [0.0; 6];
/// let mut view = ViewMut::new(&mut depths, 3, 2).unwrap();
/// view.pixels_mut()[4] = 7.5;
/// assert_eq!(view.as_view().get(1, 1), Some(7.5));
/// ```
#[derive(Debug)]
pub struct ViewMut<'a, T> {
    data: &'a mut [T],
    width: usize,
    height: usize,
}

impl<'a, T> ViewMut<'a, T> {
    /// Views the first `width` x `height` items of `data`. `None` when empty or when `data` is too
    /// short.
    pub fn new(data: &'a mut [T], width: usize, height: usize) -> Option<Self> {
        let len = span(width, height, width)?;
        Some(Self { data: data.get_mut(..len)?, width, height })
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The pixels, row by row.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        self.data
    }

    /// The image with the values that its pixels wrap, to be written.
    pub(crate) fn peeled_mut<V>(&mut self) -> ViewMut<'_, V>
    where
        T: TransparentWrapper<V>,
    {
        ViewMut { data: T::peel_slice_mut(self.data), width: self.width, height: self.height }
    }

    /// Returns a read-only view of the image.
    ///
    /// ```
    /// use dynvox_core::image::ViewMut;
    ///
    /// let mut data = [0; 6];
    /// let mut image = ViewMut::new(&mut data, 3, 2).unwrap();
    /// image.pixels_mut().fill(7);
    /// assert_eq!(image.as_view().get(0, 1), Some(7));
    /// ```
    pub fn as_view(&self) -> View<'_, T> {
        View { data: self.data, width: self.width, height: self.height, stride: self.width }
    }
}
