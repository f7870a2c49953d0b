//! Settings in a stored request: those that differ from the defaults or that somebody set to
//! them, in their sections.

use super::settings::{insert, leaves};
use super::{Settings, Worlds};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de, ser};
use toml::{Table, Value};

/// Writes the settings that differ from the defaults, and those that somebody set.
pub fn serialize<S: Serializer>(settings: &Settings, to: S) -> Result<S::Ok, S::Error> {
    changed(settings).map_err(ser::Error::custom)?.serialize(to)
}

/// Reads settings over the defaults; an unknown key is an error that names it.
pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Settings, D::Error> {
    let table = Table::deserialize(from)?;
    Settings::from_table(&table).map_err(|error| de::Error::custom(format!("{error:#}")))
}

/// The settings that differ from the defaults.
fn changed(settings: &Settings) -> anyhow::Result<Table> {
    // By way of text, in which an f32 has as few digits as tell it from its neighbours.
    let table = |of: &Settings| Ok::<Table, anyhow::Error>(of.to_toml(Worlds::ALL)?.parse()?);
    let all = table(settings)?;
    let mut changed = difference(&all, &table(&Settings::default())?);
    for (key, value) in leaves("", &all) {
        if settings.asked().contains(&key) {
            insert(&mut changed, &key, value);
        }
    }
    Ok(changed)
}

/// Entries of `table` that `base` lacks or has otherwise.
fn difference(table: &Table, base: &Table) -> Table {
    let mut found = Table::new();
    for (key, value) in table {
        match (value, base.get(key)) {
            (value, Some(same)) if value == same => {}
            (Value::Table(inner), Some(Value::Table(base))) => {
                found.insert(key.clone(), Value::Table(difference(inner, base)));
            }
            (value, _) => drop(found.insert(key.clone(), value.clone())),
        }
    }
    found
}
