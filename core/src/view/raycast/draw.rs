//! A picture drawn band by band: cells are projected into a few rows, then what each pixel's ray
//! meets in its cell is shown if it is nearer than what is there.

use super::{
    NORMAL_ONE,
    cell_index::CellId,
    crossed::CrossedCells,
    hits::{Hit, Hits, RowToHit},
    ray_camera::RayCamera,
    visibility::{Projection, Strip},
};
use crate::parallel::Vectors;

/// Some rows of the picture, which one worker fills.
pub(super) struct Band<'b> {
    pub first_row: usize,
    pub depth_m: &'b mut [f32],
    pub normal: &'b mut [[i8; 3]],
    pub colour: &'b mut [[u8; 3]],
    pub weight: &'b mut [u8],
    pub layer: &'b mut [u8],
}

impl<'b> Band<'b> {
    // Four calls a picture: apart, for the size of a Cortex-M7's image.
    #[inline(never)]
    pub fn split(self, rows: usize, width: usize) -> (Self, Self) {
        // A last band may have fewer rows.
        let at = (rows * width).min(self.depth_m.len());
        let (depth_m, depth_low) = self.depth_m.split_at_mut_checked(at).unwrap_or_default();
        let (normal, normal_low) = self.normal.split_at_mut_checked(at).unwrap_or_default();
        let (colour, colour_low) = self.colour.split_at_mut_checked(at).unwrap_or_default();
        let (weight, weight_low) = self.weight.split_at_mut_checked(at).unwrap_or_default();
        let (layer, layer_low) = self.layer.split_at_mut_checked(at).unwrap_or_default();
        let low = Band {
            first_row: self.first_row + rows,
            depth_m: depth_low,
            normal: normal_low,
            colour: colour_low,
            weight: weight_low,
            layer: layer_low,
        };
        (Band { first_row: self.first_row, depth_m, normal, colour, weight, layer }, low)
    }
}

/// Cells and camera of a raycast.
pub(super) struct Scene<'a, 's> {
    pub cells: CrossedCells<'a, 's>,
    pub ray_camera: &'a RayCamera,
    /// Nearest and farthest surface shown, m.
    pub limits_m: [f32; 2],
    pub layer: u8,
}

impl Scene<'_, '_> {
    /// Finds the cell of each pixel of rows from a first to a last one: whether there may be any.
    // Apart from what shows them, for the stack: neither needs the other's.
    #[inline(never)]
    fn project(&self, rows: [usize; 2], strip: &mut Strip<'_>, vectors: Vectors) -> bool {
        let is_seen = self.cells.surface.blocks_in_rows(rows).next().is_some();
        if is_seen {
            strip.clear();
            let Self { cells, ray_camera, limits_m, .. } = *self;
            vectors.run(Projection { cells, ray_camera, limits_m, rows, strip });
        }
        is_seen
    }

    /// Fills a band and counts the pixels that show the map.
    pub fn draw(&self, band: Band<'_>, mut strip: Strip<'_>, vectors: Vectors) -> u32 {
        let width = self.ray_camera.width.max(1);
        let images = band
            .depth_m
            .chunks_mut(width)
            .zip(band.normal.chunks_mut(width))
            .zip(band.colour.chunks_mut(width).zip(band.weight.chunks_mut(width)))
            .zip(band.layer.chunks_mut(width));
        // A strip of rows is projected once; its pixels then meet their cells.
        let (mut count, mut hits, mut is_empty) = (0, Hits::none(), true);
        let end = band.first_row + images.len();
        for (v, (((depth_m, normal), (colour, weight)), layers)) in (band.first_row..).zip(images) {
            let row = (v - band.first_row) % strip.rows.max(1);
            if row == 0 {
                let rows = [v, (v + strip.rows).min(end) - 1];
                is_empty = !self.project(rows, &mut strip, vectors);
            }
            if is_empty {
                continue;
            }
            let mut images = Row { depth_m, normal, colour, weight, layers };
            let to_hit = RowToHit {
                cells: &self.cells,
                rays: &self.ray_camera.row(v),
                limits_m: self.limits_m,
                rotation: &self.ray_camera.rotation,
            };
            let mut show = |hits: &mut Hits<'_>, images: &mut Row<'_>| {
                hits.take(&to_hit, vectors, |u, hit| {
                    count += u32::from(images.show(u, &hit, self.layer));
                });
            };
            for (u, &id) in
                strip.row(row).iter().take(width).enumerate().filter(|(_, id)| **id != CellId::NONE)
            {
                // Eight hits are refined at once; the row's last ones are shown after it.
                hits.push(&self.cells, u, id);
                if hits.is_full() {
                    show(&mut hits, &mut images);
                }
            }
            show(&mut hits, &mut images);
        }
        count
    }
}

/// A row of the picture.
struct Row<'r> {
    depth_m: &'r mut [f32],
    normal: &'r mut [[i8; 3]],
    colour: &'r mut [[u8; 3]],
    weight: &'r mut [u8],
    layers: &'r mut [u8],
}

impl Row<'_> {
    /// Returns true if a depth is nearer than the pixel's.
    #[inline(always)]
    fn is_nearer(&self, u: usize, depth_m: f32) -> bool {
        self.depth_m.get(u).is_some_and(|&shown_m| shown_m == 0.0 || depth_m < shown_m)
    }

    /// Shows what a ray met, if it is nearer than what the pixel shows.
    #[inline(always)]
    fn show(&mut self, u: usize, hit: &Hit, layer: u8) -> bool {
        let is_nearer = self.is_nearer(u, hit.depth_m);
        if is_nearer
            && let (Some(depth_m), Some(normal), Some(colour), Some(weight), Some(shown)) = (
                self.depth_m.get_mut(u),
                self.normal.get_mut(u),
                self.colour.get_mut(u),
                self.weight.get_mut(u),
                self.layers.get_mut(u),
            )
        {
            // A component of a unit vector times 127 fits a signed byte.
            let unit = hit.normal.map(|c| (c * NORMAL_ONE) as i8);
            (*depth_m, *normal, *colour, *weight, *shown) =
                (hit.depth_m, unit, hit.colour, hit.weight, layer);
        }
        is_nearer
    }
}
