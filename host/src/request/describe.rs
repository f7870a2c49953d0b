//! A request in words: its values that differ from another's.

use super::Request;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

impl Request {
    /// The values that differ from those of another request, by dotted key: as JSON, or `null`
    /// where this request has none.
    pub fn differences(&self, other: &Self) -> BTreeMap<String, Value> {
        let mut found = BTreeMap::new();
        // What cannot be stored is empty, and differs from everything that can.
        let [a, b] = [self, other].map(|of| serde_json::to_value(of).unwrap_or_default());
        compare("", (&a, &b), &mut found);
        found
    }

    /// The values asked for that differ from the defaults, as `key=value` words.
    pub fn words(&self) -> String {
        let all = self.differences(&Self::default());
        let asked = all.iter().filter(|(_, value)| !value.is_null());
        asked.map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
    }
}

/// Collects the values of `a` that differ from those of `b`.
fn compare(key: &str, (a, b): (&Value, &Value), found: &mut BTreeMap<String, Value>) {
    match (a, b) {
        (a, b) if a == b => {}
        (Value::Object(inner), Value::Object(other)) => {
            let keys = inner.keys().chain(other.keys().filter(|key| !inner.contains_key(*key)));
            for name in keys {
                let at = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                let of =
                    |object: &Map<String, Value>| object.get(name).cloned().unwrap_or_default();
                compare(&at, (&of(inner), &of(other)), found);
            }
        }
        // A section that only one of them has is told value by value.
        (Value::Object(_), Value::Null) => compare(key, (a, &Value::Object(Map::new())), found),
        (a, _) => drop(found.insert(key.to_owned(), a.clone())),
    }
}
