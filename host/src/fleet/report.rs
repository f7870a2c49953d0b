//! Report on recordings: what they saw, where they went and what has changed, as figures, a table
//! of changes and a picture from above.

use super::coverage::{Coverage, coverage};
use super::resolve::{ResolvedMap, resolve};
use super::submap::Submap;
use super::{Change, FleetError, Manifest, changes, path_m, poses};
use crate::owned::{self, DraftFolder};
use crate::run::write_whole;
use dynvox_core::volume::BLOCK_SIDE;
use image::{Rgb, RgbImage};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Larger side of the picture, px, at most.
const PICTURE_PX: i32 = 1_600;
const BACKGROUND: Rgb<u8> = Rgb([255, 255, 255]);
/// Colours of columns that one, two, and three or more recordings observed.
const COVERED: [Rgb<u8>; 3] = [Rgb([205, 205, 205]), Rgb([150, 195, 150]), Rgb([120, 160, 215])];
const CHANGED: Rgb<u8> = Rgb([220, 20, 20]);
/// Colours of paths, in turn.
const PATHS: [Rgb<u8>; 6] = [
    Rgb([0, 0, 0]),
    Rgb([215, 95, 0]),
    Rgb([0, 105, 170]),
    Rgb([130, 60, 150]),
    Rgb([0, 120, 60]),
    Rgb([150, 110, 0]),
];

/// Contents of a merged map, for the report.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The recordings.
    pub recordings: Vec<RecordingPath>,
    /// Blocks with a surface.
    pub blocks: u64,
    /// Blocks that are known to be free.
    pub free_blocks: u64,
    /// Voxels that were seen too often for their sums.
    pub overflowed_voxels: u64,
    /// Coverage of the world by the recordings.
    pub coverage: Coverage,
    /// Changes, the largest first.
    pub changes: Vec<Change>,
    #[serde(skip)]
    block_m: f64,
}

/// Path of a recording's camera.
#[derive(Clone, Debug, Serialize)]
pub struct RecordingPath {
    /// Name in tables and charts.
    pub name: String,
    /// Epoch of the recording.
    pub epoch: u32,
    /// Frames.
    pub frames: usize,
    /// Length of its path, m.
    pub path_m: f64,
    #[serde(skip)]
    cameras_m: Vec<[f64; 3]>,
}

impl Report {
    /// Reports on jobs that are all in the world and on their merged map; changes below
    /// `least_change_m3` are left out.
    ///
    /// # Errors
    /// A file is damaged or missing.
    pub fn of(
        (folder, manifest): (&Path, &Manifest),
        map: &Path,
        least_change_m3: f64,
    ) -> Result<Self, FleetError> {
        let (mut sums, mut recordings) = (Vec::new(), Vec::new());
        for (job, t_world_map) in manifest.jobs.iter().zip(poses(manifest, folder)?) {
            // Without a pose for every job there is no report.
            let t_world_map = t_world_map?;
            sums.push(job.sums(folder, &t_world_map));
            let cameras = Submap::cameras(&job.submap(folder))?;
            let cameras_m: Vec<_> =
                cameras.iter().map(|of| (t_world_map * of.t_map_camera).translation_m).collect();
            recordings.push(RecordingPath {
                name: job.name.clone(),
                epoch: job.epoch,
                frames: cameras_m.len(),
                path_m: path_m(&cameras_m),
                cameras_m,
            });
        }
        let ResolvedMap { lattice, blocks, free_blocks, overflowed, changes: changed } =
            resolve(map, |_| Ok(()))?;
        Ok(Self {
            recordings,
            blocks,
            free_blocks,
            overflowed_voxels: overflowed,
            coverage: coverage(&sums)?,
            changes: changes(&changed, &lattice, least_change_m3),
            block_m: f64::from(lattice.voxel_size_m) * BLOCK_SIDE as f64,
        })
    }

    /// Writes report.json, changes.csv and map.png into a new folder.
    ///
    /// # Errors
    /// The folder exists, or the disk refuses. Nothing half-written stays behind.
    pub fn write(&self, out: &Path) -> Result<(), FleetError> {
        if out.exists() {
            return Err(FleetError::Exists { path: out.to_path_buf() });
        }
        // The folder appears under its name only when it is whole.
        let draft = DraftFolder::begin(out).map_err(FleetError::io(out))?;
        let file = |name: &str, text: String| {
            let path: PathBuf = draft.path().join(name);
            write_whole(&path, |file| file.write_all(text.as_bytes()))
                .map_err(|error| FleetError::content(&path, error.to_string()))
        };
        file("report.json", serde_json::to_string_pretty(self).unwrap_or_default() + "\n")?;
        file("changes.csv", self.table())?;
        let path = draft.path().join("map.png");
        let mut png = std::io::Cursor::new(Vec::new());
        self.picture()
            .write_to(&mut png, image::ImageFormat::Png)
            .map_err(|error| FleetError::content(&path, error.to_string()))?;
        owned::write(&path, png.get_ref()).map_err(FleetError::io(&path))?;
        draft.rename(out).map_err(FleetError::io(out))
    }

    fn table(&self) -> String {
        let mut table = "kind,from_epoch,to_epoch,believed_epoch,x_m,y_m,z_m,extent_x_m,extent_y_m,extent_z_m,volume_m3\n".to_owned();
        for change in &self.changes {
            let Change {
                kind,
                from_epoch,
                to_epoch,
                believed_epoch,
                centre_m: [x, y, z],
                extent_m: [a, b, c],
                volume_m3,
            } = change;
            let kind = kind.name();
            table += &format!(
                "{kind},{from_epoch},{to_epoch},{believed_epoch},{x:.2},{y:.2},{z:.2},{a:.1},{b:.1},{c:.1},{volume_m3:.3}\n"
            );
        }
        table
    }

    /// From above: x to the right, z upwards. Columns that recordings saw, their paths, and a ring
    /// about what has changed.
    fn picture(&self) -> RgbImage {
        let columns = &self.coverage.columns;
        let path = |at: &[f64; 3]| [at[0], at[2]].map(|side| (side / self.block_m).floor() as i32);
        let paths = self.recordings.iter().flat_map(|of| of.cameras_m.iter().map(path));
        let all = columns.keys().map(|at| at.map(i32::from)).chain(paths);
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        all.for_each(|at| {
            (0..2).for_each(|axis| {
                (low[axis], high[axis]) = (low[axis].min(at[axis]), high[axis].max(at[axis]))
            })
        });
        // Nothing was mapped: a picture of one pixel.
        if low[0] > high[0] {
            return RgbImage::from_pixel(1, 1, BACKGROUND);
        }
        let longer = (high[0] - low[0]).max(high[1] - low[1]) + 1;
        // Some columns make a pixel, or some pixels a column.
        let scale = if longer > PICTURE_PX {
            f64::from(PICTURE_PX) / f64::from(longer)
        } else {
            f64::from((PICTURE_PX / longer).min(8))
        };
        let size =
            |axis: usize| ((f64::from(high[axis] - low[axis] + 1) * scale).ceil() as u32).max(1);
        let mut picture = RgbImage::from_pixel(size(0), size(1), BACKGROUND);
        // North is up: rows run against z.
        let pixel = |x: f64, z: f64| {
            [
                ((x - f64::from(low[0])) * scale) as i32,
                size(1) as i32 - 1 - ((z - f64::from(low[1])) * scale) as i32,
            ]
        };
        for ([x, z], count) in columns {
            let [left, bottom] = pixel(f64::from(*x), f64::from(*z));
            let side = scale.ceil() as i32;
            (0..side * side).for_each(|at| {
                set(
                    &mut picture,
                    [left + at % side, bottom - at / side],
                    COVERED[usize::from(*count).clamp(1, 3) - 1],
                )
            });
        }
        // Paths are drawn over the columns they passed.
        for (of, colour) in self.recordings.iter().zip(PATHS.iter().cycle()) {
            let points: Vec<_> = of
                .cameras_m
                .iter()
                .map(|at| pixel(at[0] / self.block_m, at[2] / self.block_m))
                .collect();
            points.windows(2).for_each(|ends| line(&mut picture, ends[0], ends[1], *colour));
        }
        // A circle around each change.
        for change in &self.changes {
            let centre =
                pixel(change.centre_m[0] / self.block_m, change.centre_m[2] / self.block_m);
            let radius_px =
                (0.5 * change.extent_m[0].max(change.extent_m[2]) / self.block_m * scale).max(4.0);
            for degree in 0..720 {
                let (sine, cosine) = (0.5 * f64::from(degree)).to_radians().sin_cos();
                set(
                    &mut picture,
                    [
                        centre[0] + (radius_px * cosine) as i32,
                        centre[1] + (radius_px * sine) as i32,
                    ],
                    CHANGED,
                );
            }
        }
        picture
    }
}

fn set(picture: &mut RgbImage, [x, y]: [i32; 2], colour: Rgb<u8>) {
    if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
        && let Some(pixel) = picture.get_pixel_mut_checked(x, y)
    {
        *pixel = colour;
    }
}

/// A line two pixels wide.
fn line(picture: &mut RgbImage, from: [i32; 2], to: [i32; 2], colour: Rgb<u8>) {
    let steps = (to[0] - from[0]).abs().max((to[1] - from[1]).abs()).max(1);
    for step in 0..=steps {
        let at: [i32; 2] =
            std::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * step / steps);
        (0..4).for_each(|by| set(picture, [at[0] + by % 2, at[1] + by / 2], colour));
    }
}
