//! The dynvox stereo mapper for Python: the core, and the host's readers of data sets and
//! calibrations.
//!
//! `python/dynvox/__init__.pyi` describes what users see. Images are borrowed from numpy for the
//! time of a step (`images`); what comes back is new arrays and dictionaries. The interpreter is
//! free for other threads while a mapper works and while a frame is decoded.

mod arrays;
mod blocks;
mod dataset;
mod detection;
mod error;
mod examined;
mod images;
mod inertial;
mod mapper;
mod options;
mod pickled;
mod planning;
mod pose;
mod readout;
mod rig;
mod running;

use pyo3::prelude::*;

#[pymodule]
fn _dynvox(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("Error", module.py().get_type::<error::Error>())?;
    module.add_class::<rig::Rig>()?;
    module.add_class::<detection::Detection>()?;
    module.add_class::<inertial::InertialUnit>()?;
    module.add_class::<mapper::Mapper>()?;
    module.add_class::<dataset::Dataset>()?;
    module.add_function(wrap_pyfunction!(images::_borrowed, module)?)?;
    module.add_function(wrap_pyfunction!(rig::_rig, module)?)?;
    module.add_function(wrap_pyfunction!(examined::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(rig::read_calibration, module)?)
}
