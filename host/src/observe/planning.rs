//! The planner's window after the last frame, as files: a map for Nav2, heights, distances, a
//! picture of them.

use super::planning_maps::{MapGeometry, MapMode, png};
use super::{EndContext, Finished, FrameContext, ObserveError, ObservedRun, Observer};
use crate::owned;
use crate::scene::{PLANNING_FOLDER, WindowScales};
use dynvox_core::geometry::MapSegment;
use dynvox_core::planning::{Cell, CellState, MovingBox, Planning, PlanningReport};
use image::{ImageBuffer, Luma, Rgb, RgbImage};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Value in `distance.png` of a distance of 0; the values are centimetres.
const DISTANCE_ZERO: f32 = 32_768.0;

/// Writes the window after the last frame, with what moves in it; of a stream, whose last frame is
/// known too late, without.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct PlanningObserver {
    written: bool,
}

/// Meaning of the numbers in the files.
#[derive(Clone, Debug, Serialize)]
struct Description {
    /// Number of the frame, and its camera's place in the window's axes: m to the right, ahead,
    /// upwards.
    frame: usize,
    camera_m: [f64; 3],
    /// Cells along each side.
    cells: [usize; 3],
    #[serde(flatten)]
    scales: WindowScales,
    report: PlanningReport,
    boxes: Vec<BoxDescription>,
}

/// A moving object in the planner's window: lengths in m along the window's axes.
#[derive(Clone, Debug, Serialize)]
pub struct BoxDescription {
    track: u32,
    center_m: [f32; 3],
    half_m: [f32; 3],
    heading: [f32; 2],
    velocity_m_s: [f32; 2],
    sigma_m: f32,
    sigma_m_s: f32,
}

impl From<&MovingBox> for BoxDescription {
    fn from(of: &MovingBox) -> Self {
        let &MovingBox {
            id: track,
            unseen_frames: _,
            center_m,
            half_m,
            heading,
            velocity_m_s,
            sigma_m,
            sigma_m_s,
        } = of;
        Self { track, center_m, half_m, heading, velocity_m_s, sigma_m, sigma_m_s }
    }
}

impl Observer for PlanningObserver {
    type Section = ();

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        if run.plan.frames.count() == Some(frame.position + 1) {
            self.write(run, frame.row.frame, frame.view)?;
        }
        Ok(())
    }

    fn end(
        &mut self,
        run: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        match end.last {
            Some(last) if !self.written => self.write(run, last.frame, end.view),
            _ => Ok(()),
        }
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<(), ObserveError> {
        Ok(())
    }
}

impl PlanningObserver {
    fn write(
        &mut self,
        run: &ObservedRun<'_>,
        frame: usize,
        view: &mut dyn super::MapView<'_>,
    ) -> Result<(), ObserveError> {
        // A run without a window writes no folder.
        if view.mapper().planning().is_empty() {
            return Ok(());
        }
        let report = view.plan(0.0);
        let mapper = view.mapper();
        let camera = WindowCamera {
            frame,
            segment: mapper.static_map().segment(),
            position_m: mapper.t_world_camera().translation_m,
        };
        write_folder(&run.folder.join(PLANNING_FOLDER), &camera, report, mapper.planning())?;
        self.written = true;
        Ok(())
    }
}

/// Camera in whose frame a window is written.
#[derive(Clone, Copy, Debug)]
pub struct WindowCamera {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Segment of the map that the window is of.
    pub segment: MapSegment,
    /// Position of the camera in the segment's world, m.
    pub position_m: [f64; 3],
}

/// Writes all files of a window.
///
/// # Errors
/// The disk refuses.
pub fn write_folder(
    folder: &Path,
    camera: &WindowCamera,
    report: PlanningReport,
    planning: &Planning<'_>,
) -> Result<(), ObserveError> {
    owned::create_folder(folder)
        .map_err(|source| ObserveError::Write { path: folder.to_path_buf(), source })?;
    let write = |name: &str, bytes: &[u8]| {
        let path: PathBuf = folder.join(name);
        owned::write(&path, bytes).map_err(|source| ObserveError::Write { path, source })
    };
    let columns = Columns { planning };
    let description = describe(&columns, camera, report);
    // The states are gathered once for all three maps.
    let states = columns.states();
    for mode in MapMode::ALL {
        write(mode.picture(), &mode.encode(&states, columns.size()))?;
        write(mode.description(), mode.yaml(&columns.geometry()).as_bytes())?;
    }
    write("height.png", &png(columns.heights(&description)))?;
    write("distance.png", &png(columns.distances()))?;
    write("window.png", &png(columns.picture(&description)))?;
    write("window.json", &serde_json::to_vec_pretty(&description).unwrap_or_default())
}

fn describe(
    columns: &Columns<'_, '_>,
    &WindowCamera { frame, segment, position_m }: &WindowCamera,
    report: PlanningReport,
) -> Description {
    let planning = columns.planning;
    let grid = planning.grid();
    let cell_m = grid.cell_m();
    // Columns of the grid's turn, from the world's axes.
    let axis = |unit: [f64; 3]| grid.to_world(unit.map(|c| c / cell_m));
    // Heights are stored above the lowest, so that they fit 16 bits.
    let heights = columns.all().filter_map(|cell| planning.column(cell)?.ground_m()).map(f64::from);
    let lowest = heights.fold(f64::INFINITY, f64::min);
    Description {
        frame,
        camera_m: grid.of_world(position_m).map(|c| c * cell_m),
        cells: planning.size(),
        scales: WindowScales {
            segment,
            cell_m,
            origin_m: planning.origin().map(|c| f64::from(c) * cell_m),
            right_world: axis([1.0, 0.0, 0.0]),
            ahead_world: axis([0.0, 1.0, 0.0]),
            up_world: axis([0.0, 0.0, 1.0]),
            height_zero_m: if lowest.is_finite() { lowest } else { 0.0 },
            height_unit_m: 0.001,
            distance_zero: DISTANCE_ZERO as u16,
            distance_unit_m: 0.01,
        },
        report,
        boxes: planning.boxes().iter().map(BoxDescription::from).collect(),
    }
}

/// The window from above: rows from the farthest ahead to the nearest, as maps are drawn.
struct Columns<'p, 's> {
    planning: &'p Planning<'s>,
}

impl Columns<'_, '_> {
    fn size(&self) -> (u32, u32) {
        let [width, length, _] = self.planning.size();
        (width as u32, length as u32)
    }

    /// The column at a picture's pixel.
    fn at(&self, u: u32, v: u32) -> Cell {
        let [x, y, z] = self.planning.origin();
        [x + u as i32, y + (self.size().1 - 1 - v) as i32, z]
    }

    fn all(&self) -> impl Iterator<Item = Cell> {
        let (width, length) = self.size();
        (0..length).flat_map(move |v| (0..width).map(move |u| self.at(u, v)))
    }

    /// State of each column between the limits of the slice, in the order of the pictures.
    fn states(&self) -> Vec<CellState> {
        self.all().map(|cell| self.planning.slice_state(cell)).collect()
    }

    /// Scale and corner of the pictures.
    fn geometry(&self) -> MapGeometry {
        let (cell_m, [x, y, _]) = (self.planning.grid().cell_m(), self.planning.origin());
        MapGeometry { cell_m, corner_m: [x, y].map(|c| f64::from(c) * cell_m) }
    }

    /// Heights of the ground in millimetres above the lowest.
    fn heights(&self, description: &Description) -> ImageBuffer<Luma<u16>, Vec<u16>> {
        let (width, length) = self.size();
        ImageBuffer::from_fn(width, length, |u, v| {
            let height_m = self
                .planning
                .column(self.at(u, v))
                .and_then(|column| column.ground_m())
                .map(f64::from);
            // The scale is stated in window.json, and the greatest value is reserved for unknown
            // heights.
            let value = height_m.map(|height_m| {
                (height_m - description.scales.height_zero_m) / description.scales.height_unit_m
            });
            Luma([value.map_or(u16::MAX, |value| (value + 0.5).min(65_534.0) as u16)])
        })
    }

    /// Distances in centimetres around [`DISTANCE_ZERO`].
    fn distances(&self) -> ImageBuffer<Luma<u16>, Vec<u16>> {
        let (width, length) = self.size();
        ImageBuffer::from_fn(width, length, |u, v| {
            let distance = self.planning.slice_distance(self.at(u, v));
            Luma([distance.map_or(0, |distance| {
                (DISTANCE_ZERO + 0.5 + 100.0 * distance.distance_m).clamp(1.0, 65_535.0) as u16
            })])
        })
    }

    /// For people: free ground by height, steps in orange, obstacles black, moving objects red,
    /// unknown grey, the camera blue.
    fn picture(&self, description: &Description) -> RgbImage {
        let (width, length) = self.size();
        let [camera_x, camera_y, _] =
            description.camera_m.map(|c| (c / description.scales.cell_m).floor() as i32);
        let boxes = |cell: Cell| {
            self.planning
                .boxes()
                .iter()
                .any(|moving| covers(moving, cell, description.scales.cell_m as f32))
        };
        RgbImage::from_fn(width, length, |u, v| {
            let cell = self.at(u, v);
            let column = self.planning.column(cell).unwrap_or_default();
            // The camera is drawn over everything else.
            if (cell[0] - camera_x).abs() <= 1 && (cell[1] - camera_y).abs() <= 1 {
                return Rgb([40, 90, 255]);
            }
            if boxes(cell) {
                return Rgb([220, 40, 40]);
            }
            match self.planning.slice_state(cell) {
                CellState::Occupied => Rgb([0, 0, 0]),
                CellState::Unknown => Rgb([128, 128, 128]),
                CellState::Free => match column.ground_m() {
                    // A step a robot would have to climb.
                    _ if column.step_m > 0.06 => Rgb([255, 160, 40]),
                    Some(height_m) => {
                        let above = ((f64::from(height_m) - description.scales.height_zero_m)
                            * 128.0)
                            .clamp(0.0, 155.0) as u8;
                        Rgb([100 + above, 230, 100])
                    }
                    None => Rgb([235, 235, 235]),
                },
            }
        })
    }
}

/// Returns true if a box covers the middle of a column.
fn covers(moving: &MovingBox, [x, y, _]: Cell, cell_m: f32) -> bool {
    let [dx, dy] = [
        (x as f32 + 0.5) * cell_m - moving.center_m[0],
        (y as f32 + 0.5) * cell_m - moving.center_m[1],
    ];
    let [cos, sin] = moving.heading;
    (cos * dx + sin * dy).abs() <= moving.half_m[0]
        && (cos * dy - sin * dx).abs() <= moving.half_m[1]
}
