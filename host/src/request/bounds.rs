//! Memory of the mapper: a byte budget, a named profile, or bounds one by one.

use super::{Bytes, RequestError};
use crate::formats::bounds::SETTINGS_TEXT;
use crate::formats::{CapacityFile, CapacityTable, read_text_within};
use dynvox_core::rectify::Rectification;
use dynvox_core::{BudgetError, BudgetOptions, Capacity};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The default budget.
const DEFAULT_MEMORY: Bytes = Bytes(256 << 20);

/// Memory of the mapper.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bounds {
    /// Number of bytes, or the bounds.
    pub memory: Memory,
    /// The planner's window around the camera; none is made when absent.
    pub planning: Option<PlanningWindow>,
    /// Keyframes by which places are recognised; 0 leaves the number to `memory`'s bounds.
    pub keyframes: usize,
}

/// Bytes or bounds of the mapper.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Memory {
    /// Bytes that the map and all stages may take, divided for the images that come; 256 MiB by
    /// default.
    Budget(Bytes),
    /// Bounds by name: tiny, small, onboard or desktop.
    Profile(String),
    /// Bounds one by one, with a name for reports.
    Given {
        /// Name in reports.
        name: String,
        /// The bounds.
        capacity: CapacityTable,
    },
}

impl Default for Memory {
    fn default() -> Self {
        Self::Budget(DEFAULT_MEMORY)
    }
}

/// A planner's window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanningWindow {
    /// Cells to the sides, ahead and behind, and upwards, of `planning.cell_voxels` voxels each.
    pub cells: [usize; 3],
    /// Keep distances to obstacles for every cell; otherwise for one slice.
    #[serde(default)]
    pub distance_3d: bool,
}

impl Memory {
    /// Reads bounds from a file, as `dynvox budget --memory 48MiB --image 752x480` prints them.
    ///
    /// # Errors
    /// The file cannot be read or used.
    pub fn read(path: &Path) -> Result<Self, RequestError> {
        let capacity = CapacityTable(read(path).map_err(RequestError::Invalid)?);
        Ok(Self::Given { name: path.display().to_string(), capacity })
    }
}

impl Bounds {
    /// The bounds for images of a size, with their name for reports. Where raw images are rectified
    /// a budget holds that too; named bounds and given ones get it on top.
    pub(super) fn resolve(
        &self,
        size: (usize, usize),
        rectified: Option<&Rectification>,
        voxel_size_m: f32,
    ) -> Result<(String, Capacity), RequestError> {
        let raw = rectified.map(|of| [of.left.raw, of.right.raw]);
        let [raw_width, raw_height] = raw.map_or([0; 2], |[left, right]| {
            [left.width.max(right.width), left.height.max(right.height)].map(|side| side as usize)
        });
        let with_raw = |capacity: Capacity| Capacity {
            raw_width: capacity.raw_width.max(raw_width),
            raw_height: capacity.raw_height.max(raw_height),
            ..self.with_extras(capacity)
        };
        let memory = match &self.memory {
            Memory::Profile(name) => {
                let (name, capacity) = profile(name)?;
                return Ok((name, with_raw(capacity)));
            }
            Memory::Given { name, capacity } => return Ok((name.clone(), with_raw(capacity.0))),
            Memory::Budget(memory) => *memory,
        };
        let options = BudgetOptions {
            voxel_size_m: Some(voxel_size_m),
            raw_image: [raw_width, raw_height],
            ..BudgetOptions::default()
        };
        // Extras grow with the map: those of the largest are more than enough for what is left.
        let largest = solve(memory, size, &options)?;
        let extras = self.with_extras(largest).bytes() - largest.bytes();
        let left = Bytes(memory.0.saturating_sub(extras));
        Ok((memory.to_string(), self.with_extras(solve(left, size, &options)?)))
    }

    /// The bounds with the keyframes and the planner's window that are asked for.
    fn with_extras(&self, capacity: Capacity) -> Capacity {
        let keyframes = if self.keyframes > 0 { self.keyframes } else { capacity.keyframes };
        let capacity = Capacity { keyframes, ..capacity };
        let Some(PlanningWindow { cells, distance_3d }) = self.planning else { return capacity };
        let [planning_width, planning_length, planning_height] = cells;
        Capacity {
            planning_width,
            planning_length,
            planning_height,
            planning_distance_3d: distance_3d,
            ..capacity
        }
    }
}

/// Finds a profile by its name in any case, and returns its name.
///
/// # Errors
/// There is no such profile.
pub fn profile(name: &str) -> Result<(String, Capacity), RequestError> {
    let known = Capacity::PROFILES;
    let found = known.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
    found.map(|(name, capacity)| ((*name).to_owned(), *capacity)).ok_or_else(|| {
        let names = known.map(|(name, _)| name).join(", ");
        RequestError::Invalid(format!(
            "there is no profile {name}. Choose one of {names}; `dynvox budget` shows them"
        ))
    })
}

/// The capacity for a budget; a refusal names the next action.
pub fn solve(
    memory: Bytes,
    (width, height): (usize, usize),
    options: &BudgetOptions,
) -> Result<Capacity, RequestError> {
    Capacity::for_budget(memory.0, width, height, options).map_err(|error| match error {
        BudgetError::TooSmall { least } => RequestError::Invalid(format!(
            "{memory} are too few for images of {width} x {height} px: the least that works is \
             {least} bytes. Give --memory {}, or smaller images with --scale",
            Bytes(least).rounded_up()
        )),
        other => RequestError::Invalid(format!(
            "there is no capacity for images of {width} x \
            {height} px: {other}"
        )),
    })
}

/// The bounds in a file; in the error's place a sentence.
fn read(path: &Path) -> Result<Capacity, String> {
    let shown = path.display();
    let text = read_text_within(path, &SETTINGS_TEXT)
        .map_err(|error| format!("--capacity cannot be used: {error}"))?;
    let hint = "`dynvox budget --memory 48MiB --image 752x480` prints such a file";
    let file: CapacityFile = toml::from_str(&text).map_err(|error| {
        format!("{shown} is not a capacity: {}. {hint}", error.message().replace('\n', " "))
    })?;
    match file.capacity.0.validate() {
        Ok(()) => Ok(file.capacity.0),
        Err(problem) => Err(format!("{shown} cannot be used: {problem}. {hint}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::planning::Planning;

    fn named(name: &str) -> Memory {
        Memory::Profile(name.to_owned())
    }

    #[test]
    fn a_window_fits_into_the_budget_that_is_asked_for() {
        let planning = Some(PlanningWindow { cells: [200, 200, 20], distance_3d: true });
        let bounds = Bounds { planning, ..Bounds::default() };
        let (_, with) = bounds.resolve((1_242, 375), None, 0.05).unwrap();
        let (_, without) = Bounds::default().resolve((1_242, 375), None, 0.05).unwrap();
        // The window is paid from the budget, so that fewer blocks are left.
        assert!(
            with.bytes() <= 256 << 20 && with.blocks < without.blocks && with.planning_distance_3d
        );
        let named = Bounds { memory: named("tiny"), ..bounds };
        let (_, tiny) = named.resolve((320, 96), None, 0.05).unwrap();
        assert_eq!(
            tiny.bytes(),
            Capacity::TINY.bytes() + Planning::bytes(&tiny),
            "on top of named bounds"
        );
    }

    #[test]
    fn keyframes_are_paid_from_the_budget_and_come_on_top_of_named_bounds() {
        let bounds = Bounds { keyframes: 500, ..Bounds::default() };
        let (_, with) = bounds.resolve((1_242, 375), None, 0.05).unwrap();
        let (_, without) = Bounds::default().resolve((1_242, 375), None, 0.05).unwrap();
        assert!(with.bytes() <= 256 << 20 && with.blocks < without.blocks);
        assert_eq!((with.keyframes, without.keyframes), (500, 0));
        let named = Bounds { memory: named("tiny"), ..bounds };
        let (_, tiny) = named.resolve((320, 96), None, 0.05).unwrap();
        let more = tiny.bytes() - Capacity::TINY.bytes();
        // A keyframe, its submap, and two bytes for each block.
        let each = (more - 2 * tiny.blocks) / 500;
        assert!((11_000..12_600).contains(&each), "{each} bytes");
    }

    #[test]
    fn a_capacity_comes_back_from_its_file_and_bad_files_are_refused() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("capacity.toml");
        let solved = solve(Bytes(48 << 20), (752, 480), &BudgetOptions::default()).unwrap();
        let text = CapacityFile::of(&solved).to_toml().unwrap();
        std::fs::write(&path, &text).unwrap();
        let bounds = Bounds { memory: Memory::read(&path).unwrap(), ..Bounds::default() };
        assert_eq!(bounds.resolve((752, 480), None, 0.05).unwrap().1, solved);
        let refusal = |text: &str| {
            std::fs::write(&path, text).unwrap();
            // A misspelt key, a bound beyond its limit, and a budget of nothing.
            Memory::read(&path).unwrap_err().to_string()
        };
        assert!(refusal(&text.replace("matches = ", "matchs = ")).contains("dynvox budget"));
        assert!(
            refusal(&text.replace("objects = ", "objects = 9"))
                .contains("objects must be at most 16")
        );
        let message =
            solve(Bytes(0), (752, 480), &BudgetOptions::default()).unwrap_err().to_string();
        assert!(
            message.contains("the least that works is") && message.contains("--memory "),
            "{message}"
        );
    }

    #[test]
    fn without_an_option_every_common_image_gets_a_map_below_256_mib() {
        for size in [(640, 480), (752, 480), (1_242, 375), (1_280, 720)] {
            let (name, capacity) = Bounds::default().resolve(size, None, 0.05).unwrap();
            assert_eq!(name, "256 MiB");
            assert!(
                capacity.bytes() <= 256 << 20 && capacity.blocks > 20_000 && capacity.colour,
                "{size:?}: {capacity:?}"
            );
        }
    }
}
