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
        let text = error.to_string().replace('`', "");
        refuse(
            match text
                .strip_prefix("unknown field ")
                .and_then(|of| of.split_once(", expected one of "))
            {
                Some((name, known)) => no_option(name, known),
                None => text,
            },
        )
    })?;
    let mut request = options.request().map_err(raise)?;
    request.limits.threads = threads;
    Ok(request)
}

/// The sentence for an unknown option, with the most similar name first.
fn no_option(name: &str, known: &str) -> String {
    let similar = |option: &&str| (strsim::jaro_winkler(name, option) * 1e6) as u64;
    let nearest = known
        .split(", ")
        .filter(|option| similar(option) > 800_000)
        .max_by_key(|option| similar(option));
    let hint = nearest.map_or(String::new(), |option| format!(". Did you mean {option}?"));
    let end = if hint.is_empty() { ". " } else { " " };
    format!("there is no option {name}{hint}{end}Give one of {known}")
}

/// A path as text, with "~" replaced by the home folder.
pub fn path(name: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    let os = value.py().import("os")?;
    let text = os.call_method1("fsdecode", (value,)).map_err(|_| {
        refuse(format!(
            "{name} is no path, but {}. Give a text or a pathlib.Path",
            value.get_type()
        ))
    })?;
    os.getattr("path")?.call_method1("expanduser", (text,))?.extract()
}

/// A text with "~" replaced by the home folder where a path begins with it: at the beginning, or
/// behind the kind, as in `files:~/masks`.
fn expanded(text: String, of: &Bound<'_, PyAny>) -> PyResult<String> {
    let start = text.find(":~/").map_or(0, |colon| colon + 1);
    let (kind, rest) = text.split_at(start);
    if rest != "~" && !rest.starts_with("~/") {
        return Ok(text);
    }
    let os = of.py().import("os.path")?;
    let home: String = os.call_method1("expanduser", (rest,))?.extract()?;
    Ok(format!("{kind}{home}"))
}

/// A dictionary without what is None.
fn object(dictionary: &Bound<'_, PyDict>) -> PyResult<Map<String, Value>> {
    let mut object = Map::new();
    for (key, value) in dictionary.iter().filter(|(_, value)| !value.is_none()) {
        let Ok(name) = key.extract::<String>() else {
            return Err(refuse(format!("{key} is no name of an option. Give a text")));
        };
        let value = plain(&value).map_err(|error| {
            let reason = error.value(key.py()).to_string();
            refuse(reason.replacen("the option ", &format!("the option {name}: "), 1))
        })?;
        object.insert(name, value);
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
    // Numbers of numpy are taken like Python's: an array of one is not a number.
    let is_array = value.getattr("shape").is_ok_and(|shape| shape.len().is_ok_and(|axes| axes > 0));
    if is_array {
        return Err(refuse("the option is an array. Give a number, a word or a list"));
    }
    let as_index = value.call_method0("__index__");
    if value.is_instance_of::<PyInt>() || as_index.is_ok() {
        let whole: i64 = as_index
            .unwrap_or_else(|_| value.clone())
            .extract()
            .map_err(|_| refuse("the option is a number beyond 64 bits. Give a smaller one"))?;
        return Ok(whole.into());
    }
    if value.is_instance_of::<PyFloat>() || value.hasattr("__float__")? {
        let number: f64 = value.call_method0("__float__")?.extract()?;
        if !number.is_finite() {
            return Err(refuse("the option is not finite. Give a number"));
        }
        return Ok(number.into());
    }
    let os = value.py().import("os")?;
    let text: String =
        os.call_method1("fsdecode", (value,)).and_then(|text| text.extract()).map_err(|_| {
            refuse(format!(
                "the option is {}. Give a number, a word, a path or a list",
                value.get_type()
            ))
        })?;
    if text.contains('\n') {
        return Err(refuse(format!(
            "the option {text:?} has more than one line. Give a number, a word or a list"
        )));
    }
    Ok(expanded(text, value)?.into())
}

/// Returns the destination of evicted blocks.
pub fn blocks(stream: Option<&Bound<'_, PyAny>>) -> PyResult<BlocksChoice> {
    let Some(stream) = stream else { return Ok(BlocksChoice::Temporary) };
    match stream.cast::<PyBool>() {
        Ok(on) if on.is_true() => Ok(BlocksChoice::Temporary),
        Ok(_) => Ok(BlocksChoice::Lost),
        Err(_) => Ok(BlocksChoice::File { path: path("stream", stream)?.into(), ours: false }),
    }
}
