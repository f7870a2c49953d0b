//! Settings of a run as a flat table, and how two of them differ.

use std::collections::BTreeMap;

/// A setting that differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Key of the setting, with its section.
    pub key: String,
    /// Values of the setting in both runs; `None` where a run has none.
    pub values: [Option<String>; 2],
}

/// The settings of two runs that differ, by key.
pub(crate) fn differing(
    a: &BTreeMap<String, String>,
    b: &BTreeMap<String, String>,
) -> Vec<Setting> {
    let keys: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let pairs = keys.into_iter().map(|key| Setting {
        key: key.clone(),
        values: [a.get(key).cloned(), b.get(key).cloned()],
    });
    pairs.filter(|setting| setting.values[0] != setting.values[1]).collect()
}

/// The settings in a `config.toml`, by dotted key.
pub(crate) fn settings(config_toml: &str) -> Result<BTreeMap<String, String>, toml::de::Error> {
    let mut settings = BTreeMap::new();
    flatten("", &toml::from_str(config_toml)?, &mut settings);
    Ok(settings)
}

fn flatten(prefix: &str, table: &toml::Table, settings: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let key = format!("{prefix}{key}");
        match value {
            toml::Value::Table(inner) => flatten(&format!("{key}."), inner, settings),
            value => drop(settings.insert(key, value.to_string())),
        }
    }
}
