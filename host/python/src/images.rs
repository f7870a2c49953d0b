//! Pictures of numpy, borrowed: no pixel is copied on the way into the core where the pixels of a
//! row lie side by side. Other views, such as `[..., ::-1]`, are copied.

use super::error::refuse;
use dynvox::formats::luma;
use dynvox_core::image::View;
use numpy::{Element, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::slice;

/// An array that is read for as long as this lives.
pub struct Borrowed<'py, T: Element> {
    array: PyReadonlyArrayDyn<'py, T>,
    /// Name of the argument in messages.
    name: &'static str,
}

impl<'py, T: Element> Borrowed<'py, T> {
    /// Borrows `array`.
    pub fn new(name: &'static str, array: &Bound<'py, PyAny>) -> PyResult<Self> {
        let wanted = T::get_dtype(array.py());
        let untyped = array.cast::<PyUntypedArray>().map_err(|_| {
            let found = array.get_type();
            refuse(format!(
                "{name} is no numpy array, but {found}. Pass numpy.asarray(...): it \
                            copies nothing that has a buffer"
            ))
        })?;
        let read = |array: &Bound<'py, PyAny>| {
            array.extract::<PyReadonlyArrayDyn<'py, T>>().map_err(|_| {
                let found = untyped.dtype();
                refuse(format!(
                    "{name} has values of {found}, and {wanted} is needed. Scale and \
                     convert it: array.astype(numpy.{wanted})"
                ))
            })
        };
        let this = Self { array: read(array)?, name };
        if this.is_dense() {
            return Ok(this);
        }
        let numpy = array.py().import("numpy")?;
        Ok(Self { array: read(&numpy.call_method1("ascontiguousarray", (array,))?)?, name })
    }

    /// Borrows a colour picture whose channels are blue, green, red, as red, green, blue: a copy.
    pub fn reversed(name: &'static str, array: &Bound<'py, PyAny>) -> PyResult<Self> {
        let this = Self::new(name, array)?;
        if !this.is_colour() {
            return Ok(this);
        }
        let numpy = array.py().import("numpy")?;
        Self::new(name, &numpy.call_method1("flip", (array, -1))?)
    }

    /// Returns true if pixels of a row lie side by side, and rows a whole number of pixels apart;
    /// what has another number of axes is left to [`Borrowed::view`].
    fn is_dense(&self) -> bool {
        let (shape, strides) = (self.array.shape(), self.array.strides());
        let (&[height, width, ref rest @ ..], &[row, column, ..]) = (shape, strides) else {
            return true;
        };
        let value = size_of::<T>() as isize;
        let size = rest.iter().product::<usize>() as isize * value;
        let side_by_side = (width <= 1 || column == size)
            && strides.get(2).is_none_or(|&channel| channel == value);
        let rows = height <= 1 || (size > 0 && row >= size * width as isize && row % size == 0);
        shape.contains(&0) || rest.len() > 1 || (side_by_side && rows)
    }

    /// Returns true if there are three values for each pixel.
    pub fn is_colour(&self) -> bool {
        self.array.shape().len() == 3
    }

    /// One value for each pixel.
    pub fn view(&self) -> PyResult<View<'_, T>> {
        self.pixels::<T>(&[])
    }

    /// Three values for each pixel.
    pub fn colour(&self) -> PyResult<View<'_, [T; 3]>> {
        self.pixels::<[T; 3]>(&[3])
    }

    /// The array as rows of `P`, which are values of the trailing shape.
    fn pixels<P: Trailing<T>>(&self, trailing: &[usize]) -> PyResult<View<'_, P>> {
        let (name, shape, strides) = (self.name, self.array.shape(), self.array.strides());
        let wrong_shape = || {
            let wanted = if trailing.is_empty() { "height x width" } else { "height x width x 3" };
            refuse(format!(
                "{name} has the shape {shape:?}, and {wanted} is needed. Check its axes"
            ))
        };
        let (&[height, width], rest) = shape
            .split_at_checked(2)
            .and_then(|(two, rest)| Some((two.first_chunk()?, rest)))
            .ok_or_else(wrong_shape)?;
        if rest != trailing || height == 0 || width == 0 {
            return Err(wrong_shape());
        }
        let (size, row) = (size_of::<P>() as isize, strides[0]);
        if !self.is_dense() {
            return Err(wrong_shape());
        }
        let stride = if height > 1 { (row / size) as usize } else { width };
        let len = (height - 1) * stride + width;
        // SAFETY: the array has `height` rows of `width` pixels, `stride` pixels apart, as checked;
        // `P` is one or several `T` without padding, of the alignment of `T`, which numpy's dtype
        // check has established. It lives as long as the borrow, and its read-only borrow keeps
        // other Rust code from writing. What other threads of Python write meanwhile shows in the
        // map, as in any function of numpy that releases the interpreter.
        let data =
            unsafe { slice::from_raw_parts(self.array.as_array().as_ptr().cast::<P>(), len) };
        View::with_stride(data, width, height, stride).ok_or_else(wrong_shape)
    }
}

/// `T`, or several of them side by side.
trait Trailing<T> {}
impl<T> Trailing<T> for T {}
impl<T> Trailing<T> for [T; 3] {}

/// A grey picture, or a colour one with its grey.
pub struct Picture<'a> {
    given: Option<View<'a, u8>>,
    /// The colours, where they are given.
    pub colour: Option<View<'a, [u8; 3]>>,
    computed: Vec<u8>,
}

impl<'a> Picture<'a> {
    /// Grey as it is, colour with the grey that the readers of data sets compute.
    pub fn of(array: &'a Borrowed<'_, u8>) -> PyResult<Self> {
        if !array.is_colour() {
            return Ok(Self { given: Some(array.view()?), colour: None, computed: Vec::new() });
        }
        let colour = array.colour()?;
        Ok(Self {
            given: None,
            computed: colour.rows().flatten().map(|&pixel| luma(pixel)).collect(),
            colour: Some(colour),
        })
    }

    /// The grey values.
    pub fn grey(&self) -> PyResult<View<'_, u8>> {
        let computed = || {
            self.colour
                .and_then(|colour| View::new(&self.computed, colour.width(), colour.height()))
        };
        self.given
            .or_else(computed)
            .ok_or_else(|| refuse("a picture is empty. Pass one with pixels"))
    }
}

/// Address of the first pixel that the core would read of a picture, and how many pixels apart its
/// rows are: for the test that nothing is copied.
#[pyfunction]
pub fn _borrowed(array: Bound<'_, PyAny>) -> PyResult<(usize, usize)> {
    fn address<T>(view: &View<'_, T>) -> (usize, usize) {
        let (pixels, stride) = view.strided();
        (pixels.as_ptr().addr(), stride)
    }
    let borrowed = Borrowed::<u8>::new("array", &array)?;
    if borrowed.is_colour() {
        borrowed.colour().map(|view| address(&view))
    } else {
        borrowed.view().map(|view| address(&view))
    }
}
