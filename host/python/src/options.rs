//! Keyword arguments as options of `dynvox run`.

use super::blocks::BlocksChoice;
use super::error::refuse;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyTuple};

/// Switches of the command line that take a word.
const ON_OR_OFF: [&str; 1] = ["dynamic"];

fn add(line: &mut Vec<String>, key: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let mut option = |text: String| line.push(format!("--{}={text}", key.replace('_', "-")));
    if value.is_none() {
        return Ok(());
    }
    if let Ok(on) = value.cast::<PyBool>() {
        match (ON_OR_OFF.contains(&key), on.is_true()) {
            (true, true) => option("on".to_owned()),
            (true, false) => option("off".to_owned()),
            (false, true) => line.push(format!("--{}", key.replace('_', "-"))),
            (false, false) => {}
        }
        return Ok(());
    }
    if let Ok(settings) = value.cast::<PyDict>() {
        for (key, value) in settings.iter() {
            option(format!("{}={}", key.str()?, toml(&value)?));
        }
        return Ok(());
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        return value.try_iter()?.try_for_each(|value| add(line, key, &value?));
    }
    option(value.str()?.to_string());
    Ok(())
}

/// A value as TOML has it.
fn toml(value: &Bound<'_, PyAny>) -> PyResult<String> {
    let text = value.str()?.to_string();
    if value.is_instance_of::<PyBool>() {
        return Ok(text.to_lowercase());
    }
    if text.contains('\n') {
        return Err(refuse(format!(
            "the setting {text:?} has more than one line. Give a number, a word or a list"
        )));
    }
    Ok(text)
}

/// Options of `dynvox run` that a mapper alone has.
const OF_MAPPER: [&str; 12] = [
    "profile",
    "memory",
    "capacity",
    "planning",
    "planning_3d",
    "threads",
    "config",
    "set",
    "dynamic",
    "fuse_every",
    "instances",
    "egomotion",
];
/// Those that a data set has besides.
const OF_DATASET: [&str; 18] = [
    "sequence",
    "dataset",
    "images",
    "bits",
    "topics",
    "side_by_side",
    "top_bottom",
    "calibration",
    "rectified",
    "rectified_focal",
    "start",
    "frames",
    "stride",
    "scale",
    "depth",
    "instances_every",
    "faults",
    "force",
];

/// The command line of a mapper alone.
pub fn mapper_line(options: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<String>> {
    line(None, options, &[&OF_MAPPER], "Mapper")
}

/// The command line of a data set's run.
pub fn dataset_line(
    path: Option<String>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<String>> {
    line(path, options, &[&OF_DATASET, &OF_MAPPER], "Dataset")
}

/// Where evicted blocks go.
pub fn blocks(stream: Option<&Bound<'_, PyAny>>) -> PyResult<BlocksChoice> {
    let Some(stream) = stream else { return Ok(BlocksChoice::Temporary) };
    match stream.cast::<PyBool>() {
        Ok(on) if on.is_true() => Ok(BlocksChoice::Temporary),
        Ok(_) => Ok(BlocksChoice::Lost),
        Err(_) => Ok(BlocksChoice::File(stream.str()?.to_string().into())),
    }
}

/// The command line of a run with these options. `memory="48MiB"` is `--memory 48MiB`,
/// `planning_3d=True` is `--planning-3d`, a list repeats its option, and
/// `set={"volume.voxel_size_m": 0.1}` is `--set volume.voxel_size_m=0.1`.
fn line(
    path: Option<String>,
    options: Option<&Bound<'_, PyDict>>,
    known: &[&[&str]],
    of: &str,
) -> PyResult<Vec<String>> {
    let mut line = vec!["dynvox".to_owned()];
    for (key, value) in options.into_iter().flat_map(|options| options.iter()) {
        let key: String = key.extract()?;
        if !known.iter().any(|known| known.contains(&key.as_str())) {
            let names = known.iter().copied().flatten().copied().collect::<Vec<_>>().join(", ");
            return Err(refuse(format!("{of} has no option {key}. Give one of {names}")));
        }
        add(&mut line, &key, &value)?;
    }
    // A path may begin with a hyphen.
    line.extend(path.into_iter().flat_map(|path| ["--".to_owned(), path]));
    Ok(line)
}
