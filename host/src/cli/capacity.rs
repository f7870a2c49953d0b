//! Which bounds a run has: a named profile, a byte budget, or a file; without any of them 256 MiB
//! for the images that come.

use crate::formats::CapacityFile;
use anyhow::{Context, bail};
use dynvox_core::planning::{MAX_SIDE_CELLS, Planning};
use dynvox_core::rectify::Rectification;
use dynvox_core::{BudgetError, BudgetOptions, Capacity};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The default budget.
pub const DEFAULT_MEMORY: Bytes = Bytes(256 << 20);

/// The options that choose the bounds.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct CapacityArgs {
    /// Bounds by name: tiny, small, onboard or desktop
    #[arg(long, value_name = "NAME", conflicts_with_all = ["memory", "capacity"])]
    profile: Option<String>,
    /// Bytes of memory the map and all stages may take, divided for the images that come: 48MiB,
    /// 1GiB [default: 256MiB]
    #[arg(long, value_name = "BYTES", conflicts_with = "capacity")]
    memory: Option<Bytes>,
    /// Bounds from a file, as `dynvox budget --memory 48MiB --image 752x480` prints them
    #[arg(long, value_name = "FILE")]
    capacity: Option<PathBuf>,
    /// Make a map for planners around the camera and write it to planning/: cells to the sides,
    /// ahead and behind, and upwards, of planning.cell_voxels voxels each: 200x200x20 is 40 x 40 x
    /// 4 m
    #[arg(long, value_name = "CELLS", help_heading = "Results")]
    planning: Option<WindowSize>,
    /// Keep distances to obstacles for every cell of that window, and not for a slice of it alone
    #[arg(long, requires = "planning", help_heading = "Results")]
    planning_3d: bool,
}

impl CapacityArgs {
    /// The bounds for images of a size, with their name for reports. Where raw images are rectified
    /// a budget holds that too; named bounds and those of a file get it on top.
    pub fn resolve(
        &self,
        size: (usize, usize),
        rectified: Option<&Rectification>,
        voxel_size_m: f32,
    ) -> anyhow::Result<(String, Capacity)> {
        let raw = rectified.map(|of| [of.left.raw, of.right.raw]);
        let [raw_width, raw_height] = raw.map_or([0; 2], |[left, right]| {
            [left.width.max(right.width), left.height.max(right.height)].map(|side| side as usize)
        });
        let with_raw = |capacity: Capacity| Capacity {
            raw_width: capacity.raw_width.max(raw_width),
            raw_height: capacity.raw_height.max(raw_height),
            ..self.with_window(capacity)
        };
        if let Some(name) = &self.profile {
            let (name, capacity) = super::profile(name)?;
            return Ok((name, with_raw(capacity)));
        }
        if let Some(path) = &self.capacity {
            return Ok((path.display().to_string(), with_raw(read(path)?)));
        }
        let memory = self.memory.unwrap_or(DEFAULT_MEMORY);
        let options = BudgetOptions {
            voxel_size_m: Some(voxel_size_m),
            raw_image: [raw_width, raw_height],
            ..BudgetOptions::default()
        };
        // A budget's 64 tracks have a box each in the window.
        let images =
            Capacity { image_width: size.0, image_height: size.1, tracks: 64, ..Capacity::TINY };
        let window = Planning::bytes(&self.with_window(images));
        Ok((
            memory.to_string(),
            self.with_window(solve(Bytes(memory.0.saturating_sub(window)), size, &options)?),
        ))
    }

    /// The bounds with the planner's window, where one is asked for.
    fn with_window(&self, capacity: Capacity) -> Capacity {
        let Some(WindowSize([planning_width, planning_length, planning_height])) = self.planning
        else {
            return capacity;
        };
        Capacity {
            planning_width,
            planning_length,
            planning_height,
            planning_distance_3d: self.planning_3d,
            ..capacity
        }
    }
}

/// The capacity for a budget; a refusal names the next action.
pub fn solve(
    memory: Bytes,
    (width, height): (usize, usize),
    options: &BudgetOptions,
) -> anyhow::Result<Capacity> {
    Capacity::for_budget(memory.0, width, height, options).map_err(|error| match error {
        BudgetError::TooSmall { least } => anyhow::anyhow!(
            "{memory} are too few for images of {width} x {height} px: the least that works is {least} bytes. Give --memory {}, or smaller \
             images with --scale",
            Bytes(least).rounded_up()
        ),
        other => anyhow::anyhow!("there is no capacity for images of {width} x {height} px: {other}"),
    })
}

/// A number of bytes as people write it: `48MiB`, `1 GiB`, `50MB`, `1048576`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes(pub usize);

/// Units by their names in lower case; the last one that divides a number evenly is shown.
const UNITS: [(&str, usize); 8] = [
    ("", 1),
    ("b", 1),
    ("kb", 1_000),
    ("mb", 1_000_000),
    ("gb", 1_000_000_000),
    ("kib", 1 << 10),
    ("mib", 1 << 20),
    ("gib", 1 << 30),
];

impl FromStr for Bytes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("`{text}` is not a number of bytes: write 48MiB, 1GiB, 500MB or a plain number")
        };
        let unit_at = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
        let (number, unit) = text.split_at(unit_at);
        let unit = unit.trim().to_lowercase();
        let (_, unit) = UNITS.iter().find(|(name, _)| *name == unit).ok_or_else(wrong)?;
        let bytes = number.parse::<f64>().map_err(|_| wrong())? * *unit as f64;
        if bytes < 2f64.powi(62) { Ok(Self(bytes as usize)) } else { Err(wrong()) }
    }
}

impl std::fmt::Display for Bytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            bytes if bytes >= 1 << 30 && bytes.is_multiple_of(1 << 30) => {
                write!(f, "{} GiB", bytes >> 30)
            }
            bytes if bytes >= 1 << 20 && bytes.is_multiple_of(1 << 20) => {
                write!(f, "{} MiB", bytes >> 20)
            }
            bytes => write!(f, "{bytes} bytes"),
        }
    }
}

impl Bytes {
    /// The next whole MiB, as the command line takes it.
    fn rounded_up(self) -> String {
        format!("{}MiB", self.0.div_ceil(1 << 20))
    }
}

/// Width and height as `752x480`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize(pub usize, pub usize);

impl FromStr for ImageSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X', '×']).and_then(|(width, height)| {
            Some((width.trim().parse().ok()?, height.trim().parse().ok()?))
        });
        sides
            .map(|(width, height)| Self(width, height))
            .ok_or_else(|| format!("`{text}` is not an image size: write 752x480"))
    }
}

/// Cells of a planner's window as `200x200x20`: width, length, height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowSize(pub [usize; 3]);

impl FromStr for WindowSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides: Result<Vec<usize>, _> = text.split(['x', 'X', '×']).map(str::parse).collect();
        let within = |side: &usize| (1..=MAX_SIDE_CELLS).contains(side);
        match sides.as_deref() {
            Ok(&[width, length, height]) if [width, length, height].iter().all(within) => {
                Ok(Self([width, length, height]))
            }
            _ => Err(format!(
                "`{text}` is not a window: write 200x200x20, cells from 1 to {MAX_SIDE_CELLS} to the sides, ahead, upwards"
            )),
        }
    }
}

/// A capacity as TOML, for `--capacity`.
pub fn to_toml(capacity: &Capacity) -> anyhow::Result<String> {
    Ok(CapacityFile::of(capacity).to_toml()?)
}

/// A capacity as JSON.
pub fn to_json(capacity: &Capacity) -> anyhow::Result<serde_json::Value> {
    Ok(serde_json::to_value(CapacityFile::of(capacity))?)
}

fn read(path: &Path) -> anyhow::Result<Capacity> {
    let shown = path.display();
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("{shown} cannot be read. Check the path of --capacity"))?;
    let hint = "`dynvox budget --memory 48MiB --image 752x480` prints such a file";
    let file: CapacityFile = toml::from_str(&text).map_err(|error| {
        anyhow::anyhow!("{shown} is not a capacity: {}. {hint}", error.message().replace('\n', " "))
    })?;
    if let Err(problem) = file.capacity.0.validate() {
        bail!("{shown} cannot be used: {problem}. {hint}");
    }
    Ok(file.capacity.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_as_people_write_them() {
        for (text, bytes) in [
            ("48MiB", 48 << 20),
            ("1 GiB", 1 << 30),
            ("1gib", 1 << 30),
            ("1.5MiB", 3 << 19),
            ("500MB", 500_000_000),
            ("77", 77),
        ] {
            assert_eq!(text.parse(), Ok(Bytes(bytes)), "{text}");
        }
        assert!(
            ["", "MiB", "48 pounds", "-1", "1e99", "99999999999GiB"]
                .iter()
                .all(|text| text.parse::<Bytes>().is_err())
        );
        assert_eq!(
            [Bytes(48 << 20), Bytes(3 << 30), Bytes(77)].map(|bytes| bytes.to_string()),
            ["48 MiB", "3 GiB", "77 bytes"]
        );
        assert_eq!("752x480".parse(), Ok(ImageSize(752, 480)));
        assert!("752".parse::<ImageSize>().is_err() && "x480".parse::<ImageSize>().is_err());
        assert_eq!("200x100x20".parse(), Ok(WindowSize([200, 100, 20])));
        assert!(
            ["200x100", "0x1x1", "2000x1x1", "axbxc"]
                .iter()
                .all(|text| text.parse::<WindowSize>().is_err())
        );
    }

    #[test]
    fn a_window_fits_into_the_budget_that_is_asked_for() {
        let args = CapacityArgs {
            planning: Some(WindowSize([200, 200, 20])),
            planning_3d: true,
            ..CapacityArgs::default()
        };
        let (_, with) = args.resolve((1_242, 375), None, 0.05).unwrap();
        let (_, without) = CapacityArgs::default().resolve((1_242, 375), None, 0.05).unwrap();
        assert!(
            with.bytes() <= 256 << 20 && with.blocks < without.blocks && with.planning_distance_3d
        );
        let named = CapacityArgs { profile: Some("tiny".to_owned()), ..args };
        let (_, tiny) = named.resolve((320, 96), None, 0.05).unwrap();
        assert_eq!(
            tiny.bytes(),
            Capacity::TINY.bytes() + Planning::bytes(&tiny),
            "on top of named bounds"
        );
    }

    #[test]
    fn a_capacity_comes_back_from_its_file_and_bad_files_are_refused() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("capacity.toml");
        let solved = solve(Bytes(48 << 20), (752, 480), &BudgetOptions::default()).unwrap();
        let text = to_toml(&solved).unwrap();
        std::fs::write(&path, &text).unwrap();
        let args = CapacityArgs { capacity: Some(path.clone()), ..CapacityArgs::default() };
        assert_eq!(args.resolve((752, 480), None, 0.05).unwrap().1, solved);
        let refusal = |text: &str| {
            std::fs::write(&path, text).unwrap();
            format!("{:#}", args.resolve((752, 480), None, 0.05).unwrap_err())
        };
        assert!(refusal(&text.replace("matches = ", "matchs = ")).contains("dynvox budget"));
        assert!(
            refusal(&text.replace("objects = ", "objects = 9"))
                .contains("objects must be at most 16")
        );
        let message =
            format!("{:#}", solve(Bytes(0), (752, 480), &BudgetOptions::default()).unwrap_err());
        assert!(
            message.contains("the least that works is") && message.contains("--memory "),
            "{message}"
        );
    }

    #[test]
    fn without_an_option_every_common_image_gets_a_map_below_256_mib() {
        for size in [(640, 480), (752, 480), (1_242, 375), (1_280, 720)] {
            let (name, capacity) = CapacityArgs::default().resolve(size, None, 0.05).unwrap();
            assert_eq!(name, "256 MiB");
            assert!(
                capacity.bytes() <= 256 << 20 && capacity.blocks > 20_000 && capacity.colour,
                "{size:?}: {capacity:?}"
            );
        }
    }
}
