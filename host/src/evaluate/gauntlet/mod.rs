//! Scenes and faults of `dynvox evaluate faults`: a table of a kind, a world and a strength each.

use serde::{Deserialize, Serialize};

/// Rows, one line each. In a fault, `{N}` is N frames after the first that faults begin in.
const ROWS: &str = include_str!("rows.csv");
/// Settings of the images of the room and the yard: small ones, so that all rows take minutes.
const ROOM_SIZE: [&str; 2] = ["room.width=320", "room.height=200"];

/// A scene, or a fault in one.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub struct Trial {
    /// Kind of the scene or of the fault.
    pub kind: String,
    /// Synthetic world, as `--world` takes it.
    pub world: String,
    /// Strength, in words; empty where the fault says it.
    pub strength: String,
    /// Fault as `--faults` takes it; empty without one.
    pub fault: String,
    /// Settings of the world, separated by spaces.
    #[serde(skip_serializing)]
    settings: String,
    /// "short" in rows of the short form.
    #[serde(skip_serializing)]
    short: String,
}

impl Trial {
    /// Rows of the table whose faults begin in frame `at`.
    pub fn listed(at: usize) -> Vec<Self> {
        let rows = csv::Reader::from_reader(ROWS.as_bytes()).into_deserialize::<Self>();
        // A test reads every row.
        rows.flatten().map(|row| Self { fault: placed(&row.fault, at), ..row }).collect()
    }

    /// A fault that the caller names, in the street or in a data set of theirs.
    pub fn from_fault(fault: &str) -> Self {
        Self {
            kind: String::new(),
            world: "street".to_owned(),
            strength: String::new(),
            fault: fault.to_owned(),
            settings: String::new(),
            short: String::new(),
        }
    }

    /// Tells whether the row belongs to the short form.
    pub fn is_short(&self) -> bool {
        !self.short.is_empty()
    }

    /// Tells whether it needs no world of its own: any data set will do.
    pub fn fits_any_data(&self) -> bool {
        self.world == "street" && self.settings.is_empty() && !self.fault.is_empty()
    }

    /// Tells whether its kind or world contains a word.
    pub fn is_of(&self, word: &str) -> bool {
        self.kind.contains(word) || self.world == word
    }

    /// Name in a table.
    pub fn name(&self) -> String {
        let parts = [self.kind.as_str(), self.world.as_str(), self.strength.as_str()];
        let words: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        words.join(", ")
    }

    /// Arguments of `dynvox run` for its world, with another seed than the first if one is given.
    pub fn arguments(&self, seed: Option<u64>) -> Vec<String> {
        let is_street = self.world == "street";
        let mut settings: Vec<String> =
            if is_street { Vec::new() } else { ROOM_SIZE.map(str::to_owned).to_vec() };
        settings.extend(self.settings.split_whitespace().map(str::to_owned));
        let of_seed = if is_street { "street.seed" } else { "room.seed" };
        settings.extend(seed.map(|seed| format!("{of_seed}={seed}")));
        let world = if is_street { Vec::new() } else { vec!["--world".into(), self.world.clone()] };
        world
            .into_iter()
            .chain(settings.into_iter().flat_map(|setting| ["--set".to_owned(), setting]))
            .collect()
    }
}

/// A fault with its frames counted from `at`.
fn placed(fault: &str, at: usize) -> String {
    let mut placed = String::new();
    for (number, part) in fault.split('{').enumerate() {
        match part.split_once('}').filter(|_| number > 0) {
            Some((after, rest)) => {
                let frames: usize = after.parse().unwrap_or_default();
                placed += &format!("{}{rest}", at + frames);
            }
            None => placed += part,
        }
    }
    placed
}

#[cfg(test)]
mod tests;
