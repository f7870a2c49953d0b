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

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> LensTable {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn a_table_is_taken_whole_or_refused_by_the_key_at_fault() {
        for (text, words) in [
            ("model = 3", "`model` is not a name"),
            ("xi = 0.1", "missing field `model`"),
            ("model = \"pear\"", "there is no lens model pear: use one of"),
            ("model = \"double_sphere\"\nxi = -0.2", "missing field `alpha`"),
            ("model = \"double_sphere\"\nxi = -0.2\nalpha = \"x\"", "`alpha` has 0 numbers, not 1"),
            ("model = \"double_sphere\"\nxi = -0.2\nalpha = 0.5\nbeta = 1", "unknown field `beta`"),
            ("model = \"equidistant\"\nradial = [0.1, 0.2]", "`radial` has 2 numbers, not 4"),
        ] {
            let message = table(text).model().unwrap_err();
            assert!(message.contains(words), "{text}: {message}");
        }
        let double = table("model = \"double_sphere\"\nxi = -0.2\nalpha = 0.5").model();
        assert_eq!(double, Ok(LensModel::DoubleSphere { xi: -0.2, alpha: 0.5 }));
        let typical = table("model = \"double_sphere\"\nxi = -0.1").model_or_typical();
        assert!(matches!(typical, Ok(LensModel::DoubleSphere { xi: -0.1, .. })), "{typical:?}");
    }

    #[test]
    fn parameters_are_shown_with_their_names() {
        let double = LensModel::DoubleSphere { xi: -0.2, alpha: 0.5 };
        assert!(shown(&double, 2).contains("-0.20, ") && shown(&double, 2).ends_with("0.50"));
        let shown = shown(&LensModel::Equidistant { radial: [0.1, 0.2, 0.3, 0.4] }, 1);
        assert!(shown.ends_with("0.1 0.2 0.3 0.4"), "{shown}");
    }
}
