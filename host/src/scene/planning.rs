//! The planner's window as a viewer shows it: what is free and occupied, on the ground.

use crate::formats::{FormatError, Picture, read_picture, read_png_deep, read_text, shown_pose};
use dynvox_core::geometry::{MapSegment, Transform};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Name of the folder of the window in the run folder.
pub const PLANNING_FOLDER: &str = "planning";
/// Grey level of what is free in `map.pgm`, as Nav2's map server has it in trinary mode.
pub const FREE_GREY: u8 = 254;
/// Grey value of an obstacle.
pub const OCCUPIED_GREY: u8 = 0;

/// Scales of the other files, as `window.json` has them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WindowScales {
    /// Segment of the map that the world below is of.
    #[serde(default)]
    pub segment: MapSegment,
    /// Side of a cell, and where the first one begins, m.
    pub cell_m: f64,
    /// See `cell_m`.
    pub origin_m: [f64; 3],
    /// A metre along each of the window's axes, in the world's coordinates.
    pub right_world: [f64; 3],
    /// See `right_world`.
    pub ahead_world: [f64; 3],
    /// See `right_world`.
    pub up_world: [f64; 3],
    /// Height of the value 0 of `height.png`, m, and its unit; 65,535 is no ground.
    pub height_zero_m: f64,
    /// See `height_zero_m`.
    pub height_unit_m: f64,
    /// The value of `distance.png` that is a distance of 0, and its unit; 0 is no distance.
    pub distance_zero: u16,
    /// See `distance_zero`.
    pub distance_unit_m: f64,
}

/// A column of the window that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanningCell {
    /// The middle of its ground, m, in world coordinates.
    pub position_m: [f32; 3],
    /// True if the cell holds an obstacle.
    pub occupied: bool,
    /// Distance to the nearest obstacle, below 0 inside one, m; `None` where it is not known.
    pub distance_m: Option<f32>,
}

/// The window after the last frame.
#[derive(Clone, Debug, Default)]
pub struct PlanningWindow {
    /// Side of a column, m.
    pub cell_m: f32,
    /// Upwards, in world coordinates.
    pub up: [f32; 3],
    /// Columns of the window that are free or occupied.
    pub cells: Vec<PlanningCell>,
}

impl PlanningWindow {
    /// Reads it from a run folder; an empty one of a run without.
    ///
    /// # Errors
    /// A file is missing or damaged.
    pub fn read(run: &Path) -> Result<Self, FormatError> {
        let folder = run.join(PLANNING_FOLDER);
        let path = folder.join("window.json");
        if !path.is_file() {
            return Ok(Self::default());
        }
        let damaged = |reason: String| FormatError::content(&path, reason, "Make the run again");
        let of: WindowScales =
            serde_json::from_str(&read_text(&path)?).map_err(|error| damaged(error.to_string()))?;
        // The occupancy grid has the format that ROS's map server reads.
        let Picture::Grey(map) = read_picture(&folder.join("map.pgm"))? else {
            return Err(damaged("map.pgm has no grey levels".to_owned()));
        };
        let (heights, distances) = (
            read_png_deep(&folder.join("height.png"))?,
            read_png_deep(&folder.join("distance.png"))?,
        );
        // The largest number stands for unknown ground.
        let height_m = |value: u16| {
            (value != u16::MAX).then(|| of.height_zero_m + of.height_unit_m * f64::from(value))
        };
        // Where no ground was seen, as below an obstacle, a column stands at the middle height.
        let mut known_m: Vec<f64> =
            heights.pixels().iter().filter_map(|&value| height_m(value)).collect();
        known_m.sort_unstable_by(f64::total_cmp);
        let middle_m = known_m.get(known_m.len() / 2).copied().unwrap_or(of.origin_m[2]);
        // Unknown cells are left out: nothing is drawn there.
        let cell = |(u, v): (usize, usize)| {
            let occupied = match map.get(u, v)? {
                FREE_GREY => false,
                OCCUPIED_GREY => true,
                _ => return None,
            };
            // Rows begin with the farthest.
            let column = [u as f64, (map.height() - 1 - v) as f64];
            let [right_m, ahead_m] =
                [0, 1].map(|axis| of.origin_m[axis] + (column[axis] + 0.5) * of.cell_m);
            let up_m = heights.get(u, v).and_then(height_m).unwrap_or(middle_m);
            let along = |axis: usize| {
                of.right_world[axis] * right_m
                    + of.ahead_world[axis] * ahead_m
                    + of.up_world[axis] * up_m
            };
            // Zero stands for no distance.
            let distance = distances.get(u, v).filter(|&value| value > 0);
            let middle = Transform::from_translation([0, 1, 2].map(along));
            let shown = shown_pose(of.segment, &middle);
            Some(PlanningCell {
                position_m: shown.translation_m.map(|along| along as f32),
                occupied,
                distance_m: distance.map(|value| {
                    ((f64::from(value) - f64::from(of.distance_zero)) * of.distance_unit_m) as f32
                }),
            })
        };
        let pixels = (0..map.height()).flat_map(|v| (0..map.width()).map(move |u| (u, v)));
        let up = of.up_world.map(|part| part as f32);
        Ok(Self { cell_m: of.cell_m as f32, up, cells: pixels.filter_map(cell).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Image, write_png_deep};

    #[test]
    fn cells_lie_on_the_ground_with_the_farthest_row_first() {
        let run = tempfile::TempDir::new().unwrap();
        assert!(PlanningWindow::read(run.path()).unwrap().cells.is_empty());
        let folder = run.path().join(PLANNING_FOLDER);
        std::fs::create_dir(&folder).unwrap();
        let window = serde_json::json!({
            "cell_m": 0.5, "origin_m": [-0.5, 2.0, -1.0], "height_zero_m": -1.5, "height_unit_m": 0.001,
            "right_world": [1.0, 0.0, 0.0], "ahead_world": [0.0, 0.0, 1.0], "up_world": [0.0, -1.0, 0.0],
            "distance_zero": 32768, "distance_unit_m": 0.01,
        });
        std::fs::write(folder.join("window.json"), window.to_string()).unwrap();
        // Unknown and free in the far row, occupied and free in the near one.
        std::fs::write(folder.join("map.pgm"), b"P5\n2 2\n255\n\xcd\xfe\x00\xfe").unwrap();
        let image = |values: [u16; 4]| Image::new(2, 2, values.to_vec()).unwrap();
        write_png_deep(&folder.join("height.png"), &image([0, 100, u16::MAX, 0])).unwrap();
        write_png_deep(&folder.join("distance.png"), &image([0, 32_868, 32_718, 0])).unwrap();
        let PlanningWindow { cell_m, up, cells } = PlanningWindow::read(run.path()).unwrap();
        let cell =
            |position_m, occupied, distance_m| PlanningCell { position_m, occupied, distance_m };
        // The unknown cell is left out; heights and distances count from their zeros.
        let expected = [
            cell([0.25, 1.4, 2.75], false, Some(1.0)),
            cell([-0.25, 1.5, 2.25], true, Some(-0.5)),
            cell([0.25, 1.5, 2.25], false, None),
        ];
        assert_eq!((cell_m, up), (0.5, [0.0, -1.0, 0.0]));
        assert_eq!(cells, expected);
        // Without the keys of a window.
        std::fs::write(folder.join("window.json"), "{}").unwrap();
        assert!(
            PlanningWindow::read(run.path())
                .unwrap_err()
                .to_string()
                .contains("window.json cannot be used")
        );
    }
}
