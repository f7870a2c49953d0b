//! Keyword arguments as a request.

use super::blocks::BlocksChoice;
use super::error::{raise, refuse};
use dynvox::Request;
use dynvox::request::Options;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyTuple};
use serde_json::{Map, Value};

/// The request of a data set read frame by frame; nothing is written.
pub fn of_dataset(
    path: Option<String>,
    threads: Option<usize>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Request> {
    let request = request(path, threads, options)?;
    request.check_frames_only().map_err(raise)?;
    Ok(request)
}

/// The request of a mapper alone.
pub fn of_mapper(threads: Option<usize>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Request> {
    request(None, threads, options)
}

/// The request of options by name: `memory="48MiB"`, `planning_3d=True`, a list for an option that
/// may be repeated, `set={"volume.voxel_size_m": 0.1}`.
fn request(
    path: Option<String>,
    threads: Option<usize>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Request> {
    let mut named = match options {
        Some(options) => object(options)?,
        None => Map::new(),
    };
    if let Some(path) = path {
        named.insert("path".to_owned(), path.into());
    }
    let options: Options = serde_json::from_value(named.into()).map_err(|error| {
        let text = error.to_string().replace(", expected one of ", ". Give one of ");
        refuse(text.replace("unknown field ", "there is no option ").replace('`', ""))
    })?;
    let mut request = options.request().map_err(raise)?;
    request.limits.threads = threads;
    Ok(request)
}

/// A dictionary without what is None.
fn object(dictionary: &Bound<'_, PyDict>) -> PyResult<Map<String, Value>> {
    let mut object = Map::new();
    for (key, value) in dictionary.iter().filter(|(_, value)| !value.is_none()) {
        object.insert(key.str()?.to_string(), plain(&value)?);
    }
    Ok(object)
}

/// A value as plain data; what is neither number, list nor dictionary is its text, as a path is.
fn plain(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(on) = value.cast::<PyBool>() {
        return Ok(on.is_true().into());
    }
    if let Ok(dictionary) = value.cast::<PyDict>() {
        return Ok(object(dictionary)?.into());
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        return value.try_iter()?.map(|value| plain(&value?)).collect();
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.extract::<i64>()?.into());
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(value.extract::<f64>()?.into());
    }
    let text = value.str()?.to_string();
    if text.contains('\n') {
        return Err(refuse(format!(
            "the option {text:?} has more than one line. Give a number, a word or a list"
        )));
    }
    Ok(text.into())
}

/// Returns the destination of evicted blocks.
pub fn blocks(stream: Option<&Bound<'_, PyAny>>) -> PyResult<BlocksChoice> {
    let Some(stream) = stream else { return Ok(BlocksChoice::Temporary) };
    match stream.cast::<PyBool>() {
        Ok(on) if on.is_true() => Ok(BlocksChoice::Temporary),
        Ok(_) => Ok(BlocksChoice::Lost),
        Err(_) => Ok(BlocksChoice::File(stream.str()?.to_string().into())),
    }
}
