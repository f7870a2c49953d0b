//! Instances that a detector found.

use super::error::refuse;
use super::images::Borrowed;
use dynvox::input::InstanceMask;
use dynvox_core::tracking::{Class, Detection as CoreDetection};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

/// An instance in the left image: a mask in a box whose first column and row are `left` and `top`.
#[pyclass(frozen, module = "dynvox")]
pub struct Detection {
    class: Class,
    class_name: String,
    /// Confidence of the detector, 0 to 1.
    #[pyo3(get)]
    score: f32,
    /// First column of the box, px.
    #[pyo3(get)]
    left: i32,
    /// First row of the box, px.
    #[pyo3(get)]
    top: i32,
    mask: Py<PyAny>,
}

/// The mask of a detection, borrowed.
pub struct BorrowedDetection<'py> {
    of: PyRef<'py, Detection>,
    mask: Borrowed<'py, u8>,
}

impl Detection {
    pub fn of(py: Python<'_>, of: InstanceMask) -> PyResult<Self> {
        let shape = [of.pixels.height.max(0) as usize, of.pixels.width.max(0) as usize];
        Ok(Self {
            class: of.class,
            class_name: of.class.name().to_owned(),
            score: of.score,
            left: of.pixels.left,
            top: of.pixels.top,
            mask: PyArray1::from_vec(py, of.mask).reshape(shape)?.into_any().unbind(),
        })
    }
}

impl<'py> BorrowedDetection<'py> {
    pub fn new(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let of = object
            .cast::<Detection>()
            .map_err(|_| {
                refuse("detections holds what is no dynvox.Detection. Pass a list of them")
            })?
            .borrow();
        let mask = Borrowed::new("mask", of.mask.bind(object.py()))?;
        Ok(Self { of, mask })
    }

    /// Returns the detection as the core takes it.
    pub fn detection(&self) -> PyResult<CoreDetection<'_>> {
        let view = self.mask.view()?;
        if view.pixels().is_empty() {
            return Err(refuse(
                "mask has rows that do not lie one behind the other. Pass \
                 numpy.ascontiguousarray(mask)",
            ));
        }
        Ok(CoreDetection {
            class: self.of.class,
            score: self.of.score,
            left: self.of.left,
            top: self.of.top,
            width: view.width() as u32,
            height: view.height() as u32,
            mask: view.pixels(),
        })
    }
}

#[pymethods]
impl Detection {
    #[new]
    #[pyo3(signature = (mask, left, top, class_name="car", score=1.0))]
    fn new(
        mask: Bound<'_, PyAny>,
        left: i32,
        top: i32,
        class_name: &str,
        score: f32,
    ) -> PyResult<Self> {
        // Truth values are bytes of 0 and 1.
        let is_bool = mask
            .getattr("dtype")
            .and_then(|dtype| dtype.getattr("kind")?.extract::<String>())
            .is_ok_and(|kind| kind == "b");
        let mask = if is_bool { mask.call_method1("view", ("uint8",))? } else { mask };
        Borrowed::<u8>::new("mask", &mask)?.view()?;
        let class = Class::from_name(class_name).ok_or_else(|| {
            refuse(format!(
                "there is no class {class_name:?}. Give a name of COCO, Cityscapes or \
                            KITTI, as car, person or truck"
            ))
        })?;
        Ok(Self { class, class_name: class_name.to_owned(), score, left, top, mask: mask.unbind() })
    }

    /// Name of its class.
    #[getter]
    fn class_name(&self) -> &str {
        &self.class_name
    }

    /// Pixels of the box: not 0 where they belong to the instance.
    #[getter]
    fn mask(&self, py: Python<'_>) -> Py<PyAny> {
        self.mask.clone_ref(py)
    }

    fn __repr__(&self) -> String {
        format!(
            "Detection({}, score {:.2}, at {}, {})",
            self.class_name, self.score, self.left, self.top
        )
    }
}
