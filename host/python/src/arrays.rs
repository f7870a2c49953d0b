//! Arrays that a mapper hands out: each call makes new ones.

use dynvox_core::geometry::Transform;
use dynvox_core::image::View;
use dynvox_core::view::{Raycaster, Triangle, Vertex};
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// One value for each pixel; takes the values over without a copy.
pub fn image<T: Element>(
    py: Python<'_>,
    pixels: Vec<T>,
    [height, width]: [usize; 2],
) -> PyResult<Bound<'_, PyArray2<T>>> {
    PyArray1::from_vec(py, pixels).reshape([height, width])
}

/// Three values for each pixel.
pub fn colour<T: Element>(
    py: Python<'_>,
    pixels: Vec<[T; 3]>,
    [height, width]: [usize; 2],
) -> PyResult<Bound<'_, PyArray3<T>>> {
    PyArray1::from_vec(py, pixels.into_flattened()).reshape([height, width, 3])
}

/// Copies a picture of the core.
pub fn copied<T: Copy>(view: View<'_, T>) -> (Vec<T>, [usize; 2]) {
    (view.rows().flatten().copied().collect(), [view.height(), view.width()])
}

/// Corners of triangles and their colours.
#[derive(Default)]
pub struct Triangles {
    positions_m: Vec<[f32; 3]>,
    colours: Vec<[u8; 3]>,
}

impl Triangles {
    pub fn add(&mut self, triangle: Triangle) {
        for Vertex { position_m, colour, weight: _ } in triangle.vertices {
            self.positions_m.push(position_m);
            self.colours.push(colour);
        }
    }

    /// Moves the corners from an object's frame to the world.
    pub fn moved(mut self, t_world_object: &Transform) -> Self {
        for position_m in &mut self.positions_m {
            *position_m =
                t_world_object.transform_point(position_m.map(f64::from)).map(|side| side as f32);
        }
        self
    }

    /// Two arrays of triangles x corners x 3.
    pub fn arrays<'py>(
        self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray3<f32>>, Bound<'py, PyArray3<u8>>)> {
        let triangles = self.positions_m.len() / 3;
        Ok((
            colour(py, self.positions_m, [triangles, 3])?,
            colour(py, self.colours, [triangles, 3])?,
        ))
    }
}

/// A picture of the map.
pub struct Raycast {
    size: [usize; 2],
    depth_m: Vec<f32>,
    normal: Vec<[i8; 3]>,
    colour: Vec<[u8; 3]>,
    weight: Vec<u8>,
    layer: Vec<u8>,
}

impl Raycast {
    /// Copies the last picture; `None` before the first.
    pub fn of(raycaster: &Raycaster<'_>) -> Option<Self> {
        let (depth_m, size) = copied(raycaster.depth_m()?);
        Some(Self {
            size,
            depth_m,
            normal: copied(raycaster.normal()?).0,
            colour: copied(raycaster.colour()?).0,
            weight: copied(raycaster.weight()?).0,
            layer: copied(raycaster.layer()?).0,
        })
    }

    /// The images by name. `objects` are the numbers of the tracks behind layers 1, 2 and on:
    /// `object` has for each pixel the track it shows.
    pub fn dictionary<'py>(self, py: Python<'py>, objects: &[u32]) -> PyResult<Bound<'py, PyDict>> {
        let track = |&layer: &u8| {
            usize::from(layer).checked_sub(1).and_then(|at| objects.get(at)).copied().unwrap_or(0)
        };
        let object = self.layer.iter().map(track).collect();
        let images = PyDict::new(py);
        images.set_item("depth_m", image(py, self.depth_m, self.size)?)?;
        images.set_item("normal", colour(py, self.normal, self.size)?)?;
        images.set_item("colour", colour(py, self.colour, self.size)?)?;
        images.set_item("weight", image(py, self.weight, self.size)?)?;
        images.set_item("object", image::<u32>(py, object, self.size)?)?;
        Ok(images)
    }
}
