//! The map as a camera at any pose would see it: depth, normal, colour and weight per pixel.
//!
//! The surface is where the trilinear field between lattice points falls from above 0, in free
//! space that was seen, to 0 or below. A ray is tried in every cell that it passes and that has
//! corners on both sides, and within the first that stops it the surface is found by false
//! position: nothing thin is jumped over, and the depth carries no bias of a step length. A ray
//! that begins behind a surface, or comes out of unseen space at its back, meets none there. Where
//! corners of a cell were never seen, the plane through the others stands in.
//!
//! Cells go to the rays, not rays to the cells (docs/decisions/0050-cells-are-projected.md): the
//! blocks in view are reduced to bits for the cells that the surface runs through (`signs`,
//! `surface`), these are projected into the picture, from near to far, and each pixel keeps the one
//! that its ray enters first (`visibility`); what is seen there is worked out once for each pixel
//! (`hits`). Both work on eight rays at a time. What two cells say of a ray at the face between
//! them is equal to the bit, so that no ray slips through, but where corners were guessed. The
//! tests compare with a walk through every cell.
//!
//! Several maps make one picture: [`Raycaster::cast`] begins it and [`Raycaster::cast_over`] adds
//! what lies nearer, so that each pixel shows the nearest surface and says whose it is. Of equal
//! depths the map added first is seen.
//!
//! Memory: 12 bytes a pixel for the images, 8 bytes a pixel of 64 rows, 300 bytes per
//! `visible_blocks` and 8 bytes for the next power of two of twice their number. Time: linear in
//! blocks in view, in the cells that the surface runs through and in the pixels they cover.
//!
//! When more blocks are in view than `visible_blocks`, the picture ends nearer, and the report says
//! where.

mod cell;
mod cell_index;
mod colour;
mod config;
mod crossed;
mod draw;
mod hits;
mod ray_camera;
mod signs;
mod surface;
#[cfg(test)]
mod tests;
mod visibility;

pub use config::RaycastConfig;
pub(crate) use signs::of_block as signs_of_block;

use crate::{
    geometry::{MapSegment, Transform, scalar::min_f32},
    image::View,
    memory::{Capacity, Carver, Footprint, region_bytes},
    parallel::{Executor, each, zip2},
    slices::clipped_mut,
    volume::{Slot, Viewpoint, Volume},
};
use core::fmt;
use crossed::CrossedCells;
use draw::{Band, Scene};
use ray_camera::RayCamera;
use surface::{Surface, SurfaceSought};
use visibility::Visibility;

/// Units of a normal's components: ±127 is ±1.
pub const NORMAL_ONE: f32 = 127.0;

/// Reason why a view cannot be rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RaycastError {
    /// The image is empty or larger than the capacity's.
    ImageSize,
    /// The pose is not finite or lies beyond the map, or the rig is invalid.
    Viewpoint,
    /// The object has no pose now.
    Object,
}

impl fmt::Display for RaycastError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ImageSize => "the image is empty, or larger than the capacity's",
            Self::Viewpoint => "the pose is not finite or lies beyond the map",
            Self::Object => "the object has no pose now",
        })
    }
}

impl core::error::Error for RaycastError {}

/// Pose from which a picture is taken, and the interval of its pixels. A pose by itself takes all
/// of them.
#[derive(Clone, Copy, Debug)]
pub struct RaycastView {
    /// Camera to world.
    pub t_world_camera: Transform,
    /// Every so many columns and rows are looked at, from the first on, at least 1. Time falls with
    /// the number of pixels; where it is a power of two, they show what they show in the whole
    /// picture, to the last bit.
    pub every: usize,
    /// Segment of the map that the pose lies in and that is looked at; `None` for the camera's.
    pub segment: Option<MapSegment>,
}

impl From<&Transform> for RaycastView {
    fn from(t_world_camera: &Transform) -> Self {
        Self { t_world_camera: *t_world_camera, every: 1, segment: None }
    }
}

/// Counts of a raycast.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct RaycastReport {
    /// Pixels that show a surface.
    pub pixels: u32,
    /// Blocks in view, within the far limit.
    pub blocks_in_view: u32,
    /// Number of blocks that did not fit, so that the picture ends at `far_m`.
    pub blocks_left_out: u32,
    /// The far limit, m: the configured one unless blocks were left out.
    pub far_m: f32,
}

/// Looks at maps, and keeps the last picture.
#[derive(Debug)]
pub struct Raycaster<'s> {
    config: RaycastConfig,
    surface: Surface<'s>,
    visibility: Visibility<'s>,
    depth_m: &'s mut [f32],
    normal: &'s mut [[i8; 3]],
    colour: &'s mut [[u8; 3]],
    weight: &'s mut [u8],
    layer: &'s mut [u8],
    width: usize,
    height: usize,
    peak_blocks: usize,
}

impl<'s> Raycaster<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        let pixels = capacity.pixels();
        Surface::bytes(capacity)
            + Visibility::bytes(capacity)
            + region_bytes::<f32>(pixels)
            + 2 * region_bytes::<[u8; 3]>(pixels)
            + 2 * region_bytes::<u8>(pixels)
    }

    /// Cuts the images and the working space.
    pub fn new_in(capacity: &Capacity, config: &RaycastConfig, carver: &mut Carver<'s>) -> Self {
        let pixels = capacity.pixels();
        Self {
            config: *config,
            surface: Surface::new_in(capacity, carver),
            visibility: Visibility::new_in(capacity, carver),
            depth_m: carver.alloc("raycast.depth", pixels),
            normal: carver.alloc("raycast.normal", pixels),
            colour: carver.alloc("raycast.colour", pixels),
            weight: carver.alloc("raycast.weight", pixels),
            layer: carver.alloc("raycast.layer", pixels),
            width: 0,
            height: 0,
            peak_blocks: 0,
        }
    }

    /// Looks at a map from a viewpoint. The picture is read with [`Self::depth_m`] and its like
    /// until the next one.
    pub fn cast<E: Executor>(
        &mut self,
        volume: &Volume<'_>,
        view: &Viewpoint,
        executor: &E,
    ) -> Result<RaycastReport, RaycastError> {
        // An error leaves an empty picture, not the one before.
        (self.width, self.height) = (0, 0);
        let pixels = view.width.saturating_mul(view.height);
        if pixels == 0 || pixels > self.depth_m.len() || !self.visibility.fits(view.width) {
            return Err(RaycastError::ImageSize);
        }
        let ray_camera = ray_camera(volume, view)?;
        (self.width, self.height) = (view.width, view.height);
        clipped_mut(self.depth_m, ..pixels).fill(0.0);
        clipped_mut(self.normal, ..pixels).fill([0; 3]);
        clipped_mut(self.colour, ..pixels).fill([0; 3]);
        clipped_mut(self.weight, ..pixels).fill(0);
        clipped_mut(self.layer, ..pixels).fill(0);
        Ok(self.draw(volume, &ray_camera, 0, executor))
    }

    /// Adds another map to the picture, of the same size and seen with the same rig; `view` is the
    /// camera's place in that map's own frame. Where the map is nearer than what is there it is
    /// shown, and [`Self::layer`] is `layer`. The report counts these pixels. After an error the
    /// picture is as it was.
    pub(crate) fn cast_over<E: Executor>(
        &mut self,
        volume: &Volume<'_>,
        view: &Viewpoint,
        layer: u8,
        executor: &E,
    ) -> Result<RaycastReport, RaycastError> {
        if [view.width, view.height] != [self.width, self.height] || self.width == 0 {
            return Err(RaycastError::ImageSize);
        }
        Ok(self.draw(volume, &ray_camera(volume, view)?, layer, executor))
    }

    /// Draws a map over a picture of the camera's size.
    fn draw<E: Executor>(
        &mut self,
        volume: &Volume<'_>,
        ray_camera: &RayCamera,
        layer: u8,
        executor: &E,
    ) -> RaycastReport {
        // Weight 0 marks voxels that were never observed.
        let min_weight = if self.config.min_weight == 0 { 1 } else { self.config.min_weight };
        let near_m = self.config.near_m;
        let sought =
            SurfaceSought { ray_camera, limits_m: [near_m, self.config.far_m], min_weight };
        // Only blocks in view are read from here on.
        let in_view = self.surface.find(volume, &sought, executor);
        let limits_m = [near_m, min_f32(in_view.far_m, self.config.far_m)];
        if self.surface.len() > self.peak_blocks {
            self.peak_blocks = self.surface.len();
        }
        // One scene for all bands; each band writes its own rows.
        let scene = Scene {
            cells: CrossedCells {
                surface: &self.surface,
                blocks: volume.blocks(),
                origin: ray_camera.origin,
                min_weight,
            },
            ray_camera,
            limits_m,
            layer,
        };
        let picture = Band {
            first_row: 0,
            depth_m: self.depth_m,
            normal: self.normal,
            colour: self.colour,
            weight: self.weight,
            layer: self.layer,
        }
        .split(ray_camera.height, ray_camera.width)
        .0;
        // Four bands of rows; the number is fixed, so that threads cannot reach the result.
        let rows = ray_camera.height.div_ceil(4);
        let (high, low) = picture.split(2 * rows, ray_camera.width);
        let ((a, b), (c, d)) =
            (high.split(rows, ray_camera.width), low.split(rows, ray_camera.width));
        let strips = self.visibility.strips(ray_camera.width);
        // Sky and road go together, so that two threads have about the same to do.
        let hits = each(executor, zip2([a, d, b, c], strips), |(band, strip)| {
            scene.draw(band, strip, executor.vectors())
        });
        RaycastReport {
            pixels: hits.iter().sum(),
            blocks_in_view: in_view.blocks,
            blocks_left_out: in_view.blocks.saturating_sub(self.surface.len() as u32),
            far_m: limits_m[1],
        }
    }

    /// Depth along the camera's z, m; 0 where there is no surface. `None` before the first picture,
    /// as for the other images.
    pub fn depth_m(&self) -> Option<View<'_, f32>> {
        View::new(self.depth_m, self.width, self.height)
    }

    /// Normal in camera axes, towards the camera, in units of 1 / [`NORMAL_ONE`]; all 0 where there
    /// is no surface.
    pub fn normal(&self) -> Option<View<'_, [i8; 3]>> {
        View::new(self.normal, self.width, self.height)
    }

    /// Red, green, blue; all 0 where there is no surface or it has no colour.
    pub fn colour(&self) -> Option<View<'_, [u8; 3]>> {
        View::new(self.colour, self.width, self.height)
    }

    /// Observations at the nearest lattice point; 0 where there is no surface.
    pub fn weight(&self) -> Option<View<'_, u8>> {
        View::new(self.weight, self.width, self.height)
    }

    /// Returns the layer of each pixel: 0 for the map that the picture began with, and where there
    /// is no surface.
    pub fn layer(&self) -> Option<View<'_, u8>> {
        View::new(self.layer, self.width, self.height)
    }

    /// Enters what was in use at most into a footprint.
    pub(crate) fn note_use(&self, footprint: &mut Footprint) {
        let (now, peak) = (self.surface.len(), self.peak_blocks);
        footprint.set_use::<[i32; 3]>("raycast.local", now, peak);
        footprint.set_use::<[u16; 2]>("raycast.rows", now, peak);
        footprint.set_use::<[Slot; 8]>("raycast.slots", now, peak);
        footprint.set_use::<[signs::Layers; 2]>("raycast.signs", now, peak);
        footprint.set_use::<signs::Cells>("raycast.cells", now, peak);
    }
}

/// The camera's rays and boxes, in the map's lattice.
fn ray_camera(volume: &Volume<'_>, view: &Viewpoint) -> Result<RayCamera, RaycastError> {
    RayCamera::new(view, volume.config().voxel_size_m).ok_or(RaycastError::Viewpoint)
}
