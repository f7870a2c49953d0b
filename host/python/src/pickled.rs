//! Raw cameras as plain numbers, for pickle.

use super::error::{raise, refuse};
use dynvox_core::rectify::{LENS_MODELS, Lens, RawCamera, Rectification, TurnedCamera};
use pyo3::PyResult;

/// Numbers of a camera before those of its lens model: image size, focal lengths, principal point,
/// and the columns of its rotation.
const FIXED: usize = 2 + 2 + 2 + 9;

/// A camera: the name of its lens model, and its numbers.
pub type Camera = (String, Vec<f64>);
/// Both cameras, and the size of the rectified pictures.
pub type Raw = (Camera, Camera, (u32, u32));

/// Takes a rectification apart.
pub fn numbers(of: &Rectification) -> Raw {
    (camera_numbers(&of.left), camera_numbers(&of.right), (of.width, of.height))
}

fn camera_numbers(of: &TurnedCamera) -> Camera {
    let RawCamera { lens, width, height } = of.raw;
    let mut numbers = vec![f64::from(width), f64::from(height)];
    numbers.extend(lens.focal_px().into_iter().chain(lens.center_px()));
    numbers.extend(of.r_rectified_raw.iter());
    let mut model = *lens.model();
    model.visit_parameters(|_, values| numbers.extend_from_slice(values));
    (model.name().to_owned(), numbers)
}

/// Puts a rectification together again.
pub fn rectification(raw: &Raw) -> PyResult<Rectification> {
    let (left, right, (width, height)) = raw;
    Rectification::given(camera(left)?, camera(right)?, [*width, *height])
        .map_err(|error| raise(anyhow::anyhow!("{error}")))
}

fn camera(of: &Camera) -> PyResult<TurnedCamera> {
    let (name, numbers) = of;
    let damaged = || refuse("the pickled rig is damaged. Read its calibration again");
    let kind = LENS_MODELS.iter().find(|kind| kind.name == name).ok_or_else(damaged)?;
    let (fixed, parameters) = numbers.split_first_chunk::<FIXED>().ok_or_else(damaged)?;
    let [width, height, fu, fv, cu, cv, a, b, c, d, e, f, g, h, i] = *fixed;
    let (mut model, mut rest) = (kind.typical, parameters.iter());
    model.visit_parameters(|_, values| {
        values.iter_mut().zip(rest.by_ref()).for_each(|(value, given)| *value = *given);
    });
    let lens =
        Lens::new([fu, fv], [cu, cv], model).map_err(|error| raise(anyhow::anyhow!("{error}")))?;
    Ok(TurnedCamera {
        raw: RawCamera { lens, width: width as u32, height: height as u32 },
        r_rectified_raw: [[a, b, c], [d, e, f], [g, h, i]].into(),
    })
}
