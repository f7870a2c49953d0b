//! A run for programs that reconstruct from images and poses: COLMAP and nerfstudio.
//!
//! Written are the left images as they are mapped, masks (white; black where something moves or
//! may), the camera, its poses in m, and points of the static map. Frames whose pose was
//! extrapolated, and those after the camera was lost, are left out.

mod colmap;
mod nerfstudio;
mod scene;
#[cfg(test)]
mod tests;

use super::planning_maps::png;
use super::{Finished, FrameContext, ObserveError, ObservedRun, Observer, instances::stem};
use crate::owned;
use crate::request::SceneFormat;
use dynvox_core::Mapper;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::image::View;
use dynvox_core::tracking::MotionState;
use image::{GrayImage, RgbImage};
use scene::{ExportedScene, points_of};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Folder of the images.
const IMAGES: &str = "images";
/// Folder of the masks.
const MASKS: &str = "masks";
/// Values of a mask: what is used, and what moves.
const USED: u8 = 255;
const MOVING: u8 = 0;

/// Exports a scene where [`ObservedRun::scene_folder`] says so.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct SceneExportObserver {
    /// Names and poses of the images. No checkpoint has them: such a run has none.
    #[serde(skip)]
    frames: Vec<(String, Transform)>,
    /// Size of the images, px.
    #[serde(skip)]
    size: (usize, usize),
}

impl Observer for SceneExportObserver {
    type Section = ();

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let (Some(folder), Some(export)) =
            (run.scene_folder.as_deref(), &run.plan.request.exports.scene)
        else {
            return Ok(());
        };
        if frame.row.is_extrapolated() || frame.row.report.segment > MapSegment::FIRST {
            return Ok(());
        }
        let mapper = frame.view.mapper();
        let name = format!("{}.png", stem(run.plan.dataset.as_ref(), frame.row.frame));
        // Raw images are rectified by the mapper.
        let rectified = mapper.rectified_pair().map(|[left, _]| left);
        let colour = frame.images.colour.as_ref().filter(|_| rectified.is_none());
        let Some(left) = rectified.or_else(|| frame.images.left.view()) else { return Ok(()) };
        self.size = (left.width(), left.height());
        let image = file(folder, IMAGES, &name)?;
        let picture = match colour {
            Some(colour) => rgb(self.size, colour.pixels()).map(png),
            None => grey(self.size, pixels_of(left)).map(png),
        };
        write_file(&image, &picture.unwrap_or_default())?;
        // COLMAP appends the ending to the image's name.
        let mask_name = match export.format {
            SceneFormat::Colmap => format!("{name}.png"),
            SceneFormat::Nerfstudio => name.clone(),
        };
        let mask = file(folder, MASKS, &mask_name)?;
        let picture = grey(self.size, mask_of(mapper, self.size)).map(png);
        write_file(&mask, &picture.unwrap_or_default())?;
        self.frames.push((name, frame.row.report.t_world_camera));
        Ok(())
    }

    fn finish(self, run: &ObservedRun<'_>, finished: &Finished) -> Result<(), ObserveError> {
        let (Some(folder), Some(export)) =
            (run.scene_folder.as_deref(), &run.plan.request.exports.scene)
        else {
            return Ok(());
        };
        let write_failed = |source| ObserveError::Write { path: folder.to_path_buf(), source };
        let scene = ExportedScene {
            rig: run.plan.config.rig,
            size: self.size,
            frames: self.frames,
            points: points_of(&finished.mesh_path).map_err(write_failed)?,
        };
        match export.format {
            SceneFormat::Colmap => colmap::write(folder, &scene),
            SceneFormat::Nerfstudio => nerfstudio::write(folder, &scene),
        }
        .map_err(write_failed)
    }
}

/// Path of a file in a folder that is made if it is missing.
fn file(folder: &Path, inner: &str, name: &str) -> Result<PathBuf, ObserveError> {
    let path = folder.join(inner).join(name);
    let parent = path.parent().unwrap_or(folder);
    owned::create_folder(parent)
        .map_err(|source| ObserveError::Write { path: parent.to_path_buf(), source })?;
    Ok(path)
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ObserveError> {
    owned::write(path, bytes)
        .map_err(|source| ObserveError::Write { path: path.to_path_buf(), source })
}

fn grey(size: (usize, usize), pixels: Vec<u8>) -> Option<GrayImage> {
    GrayImage::from_raw(size.0 as u32, size.1 as u32, pixels)
}

fn rgb(size: (usize, usize), pixels: &[[u8; 3]]) -> Option<RgbImage> {
    RgbImage::from_raw(size.0 as u32, size.1 as u32, pixels.as_flattened().to_vec())
}

fn pixels_of(view: View<'_, u8>) -> Vec<u8> {
    let at = |v: usize| (0..view.width()).map(move |u| view.get(u, v).unwrap_or_default());
    (0..view.height()).flat_map(at).collect()
}

/// The mask of the last frame: black where an object is that is not known to be static.
fn mask_of(mapper: &Mapper<'_>, size: (usize, usize)) -> Vec<u8> {
    let (width, height) = size;
    let is_static = |state: MotionState| state == MotionState::Static;
    let still: BTreeSet<u32> =
        mapper.tracks().filter(|track| is_static(track.state)).map(|track| track.id).collect();
    let value = |u: usize, v: usize| match mapper.instance_at(u as i32, v as i32) {
        Some(at) if !at.track.is_some_and(|track| still.contains(&track)) => MOVING,
        _ => USED,
    };
    (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| value(u, v)).collect()
}
