//! An exported scene: camera, poses, points.

use crate::formats::{PlyMesh, PlyVertex};
use dynvox_core::geometry::{StereoRig, Transform};
use std::io;
use std::path::Path;

/// Most points of the map that are exported.
const MAX_POINTS: u64 = 200_000;
/// Colour of points of a map without colours.
const GREY: [u8; 3] = [128; 3];

/// Cameras, poses and points, in the axes of the first camera: x right, y down, z ahead.
#[derive(Clone, Debug)]
pub struct ExportedScene {
    /// The rig; its left camera's images are exported.
    pub rig: StereoRig,
    /// Size of the images, px.
    pub size: (usize, usize),
    /// File name of each image, and `t_world_camera`.
    pub frames: Vec<(String, Transform)>,
    /// Points on the surface of the static map, m, and their colours.
    pub points: Vec<([f32; 3], [u8; 3])>,
}

impl ExportedScene {
    /// Principal point as COLMAP and nerfstudio count: from the outer corner of the upper left
    /// pixel, not from its centre.
    pub fn center_px(&self) -> [f64; 2] {
        [self.rig.center_u_px + 0.5, self.rig.center_v_px + 0.5]
    }
}

/// Points of the static map in a mesh file: a corner of every so many triangles.
///
/// # Errors
/// The file cannot be read.
pub fn points_of(mesh: &Path) -> io::Result<Vec<([f32; 3], [u8; 3])>> {
    let mesh = PlyMesh::open(mesh).map_err(io::Error::other)?;
    let step = mesh.triangles.div_ceil(MAX_POINTS).max(1);
    let (mut at, mut points) = (0u64, Vec::new());
    mesh.triangles(|[PlyVertex { object, vertex }, ..]| {
        if at.is_multiple_of(step) && object == 0 {
            let colour = if vertex.colour == [0; 3] { GREY } else { vertex.colour };
            points.push((vertex.position_m, colour));
        }
        at += 1;
    })?;
    Ok(points)
}
