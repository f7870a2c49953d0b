//! Head of the viewer: what the page's script knows besides meshes and pictures.

use super::clouds::CloudHead;
use super::values::ValueHead;
use crate::scene::tiles::{TileHead, VALUES};
use crate::scene::{Scene, SceneFrame, TrackColumns};
use dynvox_core::geometry::Transform;
use serde::Serialize;

/// Digits after the point of positions, m.
const POSITION_DIGITS: i32 = 3;
/// Digits after the point of quaternions.
const ROTATION_DIGITS: i32 = 5;

/// The run.
#[derive(Debug, Serialize)]
pub struct ViewerIndex<'s> {
    name: &'s str,
    /// Numbers of the frames.
    frames: Vec<usize>,
    times_s: Vec<f64>,
    /// Poses of the left camera: position and quaternion (x, y, z, w).
    poses: Vec<[f64; 7]>,
    /// True positions of the left camera.
    truth: Vec<[f64; 3]>,
    charts: Vec<Chart>,
    /// Tracks of each frame.
    tracks: Vec<Vec<TrackHead<'s>>>,
    objects: Vec<ObjectHead<'s>>,
    /// Size of the images that boxes are measured in, px.
    image: [usize; 2],
    /// Frames that have pictures.
    pictures: &'s [usize],
    /// Triangles of the static map on disk.
    static_triangles: u64,
    /// Heights of the static map below which five of a hundred vertices lie, and above which five
    /// of a hundred do: y, m.
    heights_m: [f32; 2],
    /// Values of the surface; null where no vertex has one.
    values: [Option<ValueHead>; VALUES],
    /// Meshes, in the order of their elements on the page.
    pub tiles: Vec<TileHead>,
    /// Layers of points, likewise.
    pub clouds: Vec<CloudHead>,
}

/// A value of every frame.
#[derive(Debug, Serialize)]
struct Chart {
    name: &'static str,
    unit: &'static str,
    values: Vec<f64>,
}

/// Number, class, state, box (left, top, right, bottom), speed in m/s or null.
type TrackHead<'s> = (u32, &'s str, &'s str, [i32; 4], Option<f64>);

/// An object: its pose in each frame it was fused in.
#[derive(Debug, Serialize)]
struct ObjectHead<'s> {
    name: &'s str,
    id: u32,
    frames: Vec<usize>,
    poses: Vec<[f64; 7]>,
}

impl<'s> ViewerIndex<'s> {
    /// All but the tiles.
    pub fn new(name: &'s str, scene: &'s Scene, values: [Option<ValueHead>; VALUES]) -> Self {
        let frames = &scene.frames;
        Self {
            name,
            frames: frames.iter().map(|frame| frame.row.frame).collect(),
            // Milliseconds and millimetres are enough on a screen, and shorter than all digits.
            times_s: frames.iter().map(|frame| rounded(frame.row.time_s, 3)).collect(),
            poses: frames.iter().map(|frame| numbers(&frame.t_world_camera)).collect(),
            truth: scene
                .truth
                .iter()
                .map(|pose| pose.translation_m.map(|metres| rounded(metres, POSITION_DIGITS)))
                .collect(),
            charts: charts(frames),
            tracks: frames.iter().map(|frame| frame.tracks.iter().map(track).collect()).collect(),
            objects: scene
                .objects
                .iter()
                .map(|object| ObjectHead {
                    name: &object.name,
                    id: object.id,
                    frames: object.t_world_object.iter().map(|(frame, _)| *frame).collect(),
                    poses: object.t_world_object.iter().map(|(_, pose)| numbers(pose)).collect(),
                })
                .collect(),
            image: [scene.pictures.width, scene.pictures.height],
            pictures: &scene.pictures.frames,
            static_triangles: scene.static_triangles,
            heights_m: heights_m(scene),
            values,
            tiles: Vec::new(),
            clouds: Vec::new(),
        }
    }
}

fn track(track: &TrackColumns) -> TrackHead<'_> {
    let speed = track.speed_m_s.map(|speed| rounded(speed, 1));
    (track.id, &track.class, &track.state, [track.x1, track.y1, track.x2, track.y2], speed)
}

fn charts(frames: &[SceneFrame]) -> Vec<Chart> {
    let chart = |name, unit, value: fn(&SceneFrame) -> f64| Chart {
        name,
        unit,
        values: frames.iter().map(value).collect(),
    };
    vec![
        chart("step", "ms", |frame| rounded(frame.row.step_ms, 1)),
        chart("egomotion inliers", "", |frame| f64::from(frame.row.inliers)),
        chart("pixels with disparity", "%", |frame| rounded(100.0 * frame.row.stereo_density, 1)),
        chart("blocks in use", "", |frame| f64::from(frame.row.blocks_used)),
        chart("tracks", "", |frame| f64::from(frame.row.tracks)),
        chart("dynamic tracks", "", |frame| f64::from(frame.row.dynamic)),
    ]
}

fn numbers(pose: &Transform) -> [f64; 7] {
    let ([x, y, z], [i, j, k, w]) = (
        pose.translation_m.map(|metres| rounded(metres, POSITION_DIGITS)),
        pose.rotation.map(|part| rounded(part, ROTATION_DIGITS)),
    );
    [x, y, z, i, j, k, w]
}

/// The middle nine tenths of the static map's heights.
fn heights_m(scene: &Scene) -> [f32; 2] {
    let mut heights: Vec<f32> = scene.static_map.positions_m.iter().map(|at| at[1]).collect();
    heights.sort_unstable_by(f32::total_cmp);
    [5, 95].map(|percent| heights.get(heights.len() * percent / 100).copied().unwrap_or_default())
}

fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    (value * scale).round() / scale
}
