//! A lens model as a table of its name and parameters, in TOML and JSON: every model of
//! [`LENS_MODELS`], by the names that it gives its parameters.

use dynvox_core::rectify::{LENS_MODELS, LensModel};
use serde::Deserialize;
use serde::de::{Deserializer, Error as _};
use serde::ser::{SerializeMap, Serializer};
use std::collections::BTreeMap;

/// Key of the model's name.
const MODEL: &str = "model";

/// Value of a key.
#[derive(Deserialize)]
#[serde(untagged)]
enum Value {
    Name(String),
    Number(f64),
    List(Vec<f64>),
}

/// Table of keys and values, before a model is made of it.
#[derive(Deserialize)]
#[serde(transparent)]
pub struct LensTable(BTreeMap<String, Value>);

impl LensTable {
    /// Name of the model.
    ///
    /// # Errors
    /// The table has no name.
    pub fn name(&self) -> Result<&str, String> {
        match self.0.get(MODEL) {
            Some(Value::Name(name)) => Ok(name),
            Some(_) => Err(format!("`{MODEL}` is not a name")),
            None => Err(format!("missing field `{MODEL}`")),
        }
    }

    /// The model with all its parameters.
    ///
    /// # Errors
    /// The name is not known, or a parameter is missing, unknown or of another length.
    pub fn model(self) -> Result<LensModel, String> {
        self.read(false)
    }

    /// The model; missing parameters are those of a typical lens.
    ///
    /// # Errors
    /// The name is not known, or a parameter is unknown or of another length.
    pub fn model_or_typical(self) -> Result<LensModel, String> {
        self.read(true)
    }

    fn read(mut self, typical: bool) -> Result<LensModel, String> {
        let name = self.name()?.to_owned();
        let kind = LENS_MODELS.iter().find(|kind| kind.name == name).ok_or_else(|| {
            let known: Vec<_> = LENS_MODELS.iter().map(|kind| kind.name).collect();
            format!("there is no lens model {name}: use one of {}", known.join(", "))
        })?;
        self.0.remove(MODEL);
        let (mut model, mut problem) = (kind.typical, None);
        model.visit_parameters(|parameter, values| {
            let given = match self.0.remove(parameter.key) {
                Some(Value::Number(number)) => vec![number],
                Some(Value::List(list)) => list,
                Some(Value::Name(_)) => Vec::new(),
                None if typical => return,
                None => {
                    problem = Some(format!("missing field `{}`", parameter.key));
                    return;
                }
            };
            if given.len() == values.len() {
                values.copy_from_slice(&given);
            } else {
                let (key, found, needed) = (parameter.key, given.len(), values.len());
                problem = Some(format!("`{key}` has {found} numbers, not {needed}"));
            }
        });
        if let Some(key) = self.0.keys().next() {
            return Err(format!("unknown field `{key}` of the lens model {name}"));
        }
        problem.map_or(Ok(model), Err)
    }
}

/// Writes a model as a table.
///
/// # Errors
/// A number cannot be written as TOML.
pub fn serialize<S: Serializer>(model: &LensModel, serializer: S) -> Result<S::Ok, S::Error> {
    let mut parameters: Vec<(&str, Vec<f64>)> = Vec::new();
    let mut copy = *model;
    copy.visit_parameters(|parameter, values| parameters.push((parameter.key, values.to_vec())));
    let mut map = serializer.serialize_map(Some(1 + parameters.len()))?;
    map.serialize_entry(MODEL, model.name())?;
    for (key, values) in &parameters {
        match values.as_slice() {
            [one] => map.serialize_entry(key, one)?,
            list => map.serialize_entry(key, list)?,
        }
    }
    map.end()
}

/// Reads a model with all its parameters.
///
/// # Errors
/// See [`LensTable::model`].
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<LensModel, D::Error> {
    LensTable::deserialize(deserializer)?.model().map_err(D::Error::custom)
}

/// Lists the parameters for a reader, with `decimals` decimals.
pub fn shown(model: &LensModel, decimals: usize) -> String {
    let (mut parts, mut lists) = (Vec::new(), false);
    let mut copy = *model;
    copy.visit_parameters(|parameter, values| {
        let numbers: Vec<_> = values.iter().map(|value| format!("{value:.decimals$}")).collect();
        parts.push(format!("{} {}", parameter.label, numbers.join(" ")));
        lists |= values.len() > 1;
    });
    parts.join(if lists { "; " } else { ", " })
}
