//! The disparity image on a lattice: where a group's mask grows.

mod growth;

use super::{extent::Extent, known::KnownSurfaces};
use crate::{
    geometry::{GroundPlane, StereoRig, scalar::max_f64},
    image::{View, disparity_px},
    masks::PixelBox,
};
use growth::Growth;

/// Marks of an object's cells: those it grew to, and those between them.
const GROWN: u8 = 1;
const FILLED: u8 = 2;
/// Side of a lattice cell, px.
pub(super) const CELL_PX: usize = 4;
/// Margin of a mask around the extent of a group's members, m: to the side, above and below, along
/// the depth.
const MARGIN_M: [f64; 3] = [0.9, 0.9, 1.6];
/// Less of it far away, m by metre of depth, and at least: there the disparities of an object reach
/// beyond it.
const MARGIN_PER_DEPTH: f64 = 0.02;
const MARGIN_MIN_M: f64 = 0.45;
/// Least length of an object along the depth, m: members on an oncoming car are on its front.
const LENGTH_M: f64 = 4.5;
/// Least height of what stands upright, m, how many times its width that is at least, and its
/// greatest length along the depth, m: between its members' 5th and 95th percentiles.
const UPRIGHT_HEIGHT_M: f64 = 0.7;
const UPRIGHT_SHAPE: f64 = 1.5;
const UPRIGHT_LENGTH_M: f64 = 1.5;
/// An object further to the side than this share of its depth shows its side, and its members may
/// be on either end of it.
const BESIDE: f64 = 0.25;
/// Disparities of neighbouring cells of one object differ by less, px: those of the side of a car 2
/// m beside the camera by 1.1.
const STEP_PX: f64 = 0.4;
/// Largest step between neighbouring cells, as a share of the disparity.
const STEP_SHARE: f64 = 0.04;
/// Largest excess over the disparity of the image part that the right camera does not see, px:
/// matching needs some pixels around each.
const BORDER_PX: f64 = 16.0;
/// A match decides on cells whose disparity differs from its own by less, as a share and px.
const BLOCK_SHARE: f64 = 0.06;
const BLOCK_PX: f64 = 0.4;
/// Beyond that, by what depth errs, m for each m^2 of squared depth.
const DEPTH_MARGIN: f64 = 0.0012;
/// Height above the ground below which pixels belong to the ground, m.
pub(super) const CLEARANCE_M: f64 = 0.12;

/// The lattice of a frame.
pub(super) struct Lattice<'a> {
    rig: &'a StereoRig,
    disparity_q8: View<'a, u16>,
    ground: Option<GroundPlane>,
    known: Option<KnownSurfaces<'a>>,
    columns: usize,
    rows: usize,
}

impl<'a> Lattice<'a> {
    pub fn new(
        rig: &'a StereoRig,
        disparity_q8: View<'a, u16>,
        ground: Option<GroundPlane>,
    ) -> Self {
        let (columns, rows) =
            (disparity_q8.width().div_ceil(CELL_PX), disparity_q8.height().div_ceil(CELL_PX));
        Self { rig, disparity_q8, ground, known: None, columns, rows }
    }

    /// The lattice with surfaces that belong to no object: those of the map.
    pub fn with_known(self, known: Option<KnownSurfaces<'a>>) -> Self {
        Self { known, ..self }
    }

    /// The ground under the image, if it shows any.
    pub fn ground(&self) -> Option<&GroundPlane> {
        self.ground.as_ref()
    }

    /// Returns true if a point of the camera's frame is clear of the ground.
    fn is_above_ground(&self, point: [f64; 3]) -> bool {
        self.ground.is_none_or(|ground| ground.above_m(point) > CLEARANCE_M)
    }

    /// Returns true if a point of the camera's frame lies on a surface that stood there before.
    fn is_known(&self, point: [f64; 3]) -> bool {
        self.known.is_some_and(|known| known.hold(point))
    }

    /// The pixel of a cell: its middle, within the image.
    fn pixel(&self, column: usize, row: usize) -> [usize; 2] {
        let within =
            |cell: usize, size: usize| (cell * CELL_PX + CELL_PX / 2).min(size.saturating_sub(1));
        [within(column, self.disparity_q8.width()), within(row, self.disparity_q8.height())]
    }

    /// Disparity of a pixel, px.
    pub fn disparity_px(&self, pixel: [usize; 2]) -> Option<f64> {
        disparity_px(self.disparity_q8, pixel)
    }

    /// The pixels in the middle of the marked cells.
    pub fn marked(&self, cells: &[u8], pixels: &PixelBox) -> impl Iterator<Item = [usize; 2]> {
        // Masks may begin outside the image.
        let cell = |px: i32| usize::try_from(px).unwrap_or(0) / CELL_PX;
        let (columns, rows) = (
            cell(pixels.left)..cell(pixels.left + pixels.width - 1) + 1,
            cell(pixels.top)..cell(pixels.top + pixels.height - 1) + 1,
        );
        let is_marked = move |row: usize, column: usize| {
            cells.get(row * self.columns + column).is_some_and(|cell| *cell > 0)
        };
        let in_row = move |row: usize| {
            columns
                .clone()
                .filter(move |column| is_marked(row, *column))
                .map(move |column| self.pixel(column, row))
        };
        rows.flat_map(in_row)
    }

    /// The point of a cell, in the camera, m.
    fn point(&self, column: usize, row: usize) -> Option<[f64; 3]> {
        self.point_at(self.pixel(column, row))
    }

    /// The point of a pixel, in the camera, m.
    fn point_at(&self, pixel: [usize; 2]) -> Option<[f64; 3]> {
        Some(self.rig.pixel_point(pixel, self.disparity_px(pixel)?))
    }

    /// Marks the cells of an object, from those within its extent on, connected through cells that
    /// can be its own, and fills gaps between them. The marks are `cells`, row by row of the
    /// lattice; those that `blocked` marks belong to something else. Returns the pixels they lie
    /// in.
    pub fn grow(
        &self,
        extent: &Extent,
        blocked: &[u8],
        cells: &mut [u8],
        queue: &mut [u32],
    ) -> Option<PixelBox> {
        let reach = widened(extent);
        let bounds = self.bounds(&reach)?;
        let cells = cells.get_mut(..self.columns * self.rows)?;
        cells.fill(0);
        let growth = Growth { lattice: self, bounds: &bounds, blocked };
        // Of an object that leaves the image, the members' extent may lie outside already.
        let is_visible = bounds.cells().any(|(column, row)| growth.can_be_own(column, row, extent));
        let start = if is_visible { extent } else { &reach };
        let seeds = growth.seed(start, cells, queue)?;
        growth.spread(&reach, cells, queue, seeds)?;
        // Gaps are closed only after growing, so that they do not carry growth further.
        (seeds > 0).then_some(())?;
        self.close(&bounds, cells);
        self.reach_border(&bounds, cells);
        self.pixels(&bounds, cells)
    }

    /// Blocks the cell of a match that does not move, or frees that of one that does, where the
    /// disparity is the match's.
    pub fn block(&self, [u, v, disparity_px]: [f32; 3], moves: bool, blocked: &mut [u8]) {
        let cell = |px: f32| if px > 0.0 { px as usize / CELL_PX } else { 0 };
        let (column, row, disparity_px) = (cell(u), cell(v), f64::from(disparity_px));
        if column >= self.columns || row >= self.rows {
            return;
        }
        let reach_px = max_f64(BLOCK_SHARE * disparity_px, BLOCK_PX);
        // The cell must show the match's surface: a match on a pole does not block the wall behind
        // it.
        let is_same = |other_px: f64| libm::fabs(other_px - disparity_px) < reach_px;
        let slot = blocked.get_mut(row * self.columns + column);
        if let Some(slot) =
            slot.filter(|_| self.disparity_px(self.pixel(column, row)).is_some_and(is_same))
        {
            *slot = u8::from(!moves);
        }
    }

    /// The cells in which an extent can be seen.
    fn bounds(&self, extent: &Extent) -> Option<Bounds> {
        let ([left, top, near], [right, bottom, far]) = (extent.low, extent.high);
        let near = if near > 1.0 { near } else { 1.0 };
        let far = if far > near { far } else { near };
        // A side left of the axis is leftmost where it is nearest, one on the right where it is
        // farthest.
        let farthest = |side: f64| self.rig.focal_px * side / if side < 0.0 { near } else { far };
        let nearest = |side: f64| self.rig.focal_px * side / if side < 0.0 { far } else { near };
        let cell = |px: f64, center: f64, cells: usize| {
            let at = (px + center) / CELL_PX as f64;
            if at < 0.0 { 0 } else { (at as usize).min(cells) }
        };
        let (rig, columns, rows) = (self.rig, self.columns, self.rows);
        let bounds = Bounds {
            left: cell(farthest(left), rig.center_u_px, columns),
            right: (cell(nearest(right), rig.center_u_px, columns) + 1).min(columns),
            top: cell(farthest(top), rig.center_v_px, rows),
            bottom: (cell(nearest(bottom), rig.center_v_px, rows) + 1).min(rows),
        };
        (bounds.left < bounds.right && bounds.top < bounds.bottom).then_some(bounds)
    }

    /// Fills cells between two marked ones, left and right or above and below.
    fn close(&self, bounds: &Bounds, cells: &mut [u8]) {
        let is_marked = |cells: &[u8], column: usize, row: usize| {
            bounds.contains(column, row) && cells.get(row * self.columns + column) == Some(&GROWN)
        };
        // In place: cells filled here are `FILLED` and not `GROWN`, and so do not count as marked.
        for (column, row) in bounds.cells() {
            let is_between = (is_marked(cells, column.wrapping_sub(1), row)
                && is_marked(cells, column + 1, row))
                || (is_marked(cells, column, row.wrapping_sub(1))
                    && is_marked(cells, column, row + 1));
            if let Some(cell) =
                cells.get_mut(row * self.columns + column).filter(|cell| is_between && **cell == 0)
            {
                *cell = FILLED;
            }
        }
    }

    /// Fills the cells between a mask and the left border where none has a disparity: the right
    /// camera does not see what is there.
    fn reach_border(&self, bounds: &Bounds, cells: &mut [u8]) {
        for row in bounds.top..bounds.bottom {
            let at = |column: usize| row * self.columns + column;
            let is_marked = |column: &usize| cells.get(at(*column)).is_some_and(|cell| *cell > 0);
            // The mask's leftmost cell of the row.
            let Some(first) = (bounds.left..bounds.right).find(is_marked) else { continue };
            let own_px = self.disparity_px(self.pixel(first, row)).unwrap_or_default();
            let is_unseen =
                (0..first).all(|column| self.disparity_px(self.pixel(column, row)).is_none());
            // Farther from the border than its disparity, the right camera would see it.
            if is_unseen && ((first * CELL_PX) as f64) < own_px + BORDER_PX {
                let unseen = cells.get_mut(at(bounds.left)..at(first)).unwrap_or_default();
                unseen.fill(FILLED);
            }
        }
    }

    /// The pixels of the marked cells.
    fn pixels(&self, bounds: &Bounds, cells: &[u8]) -> Option<PixelBox> {
        let marked = || {
            bounds.cells().filter(|(column, row)| {
                cells.get(row * self.columns + column).is_some_and(|cell| *cell > 0)
            })
        };
        let (left, right) =
            (marked().map(|(column, _)| column).min()?, marked().map(|(column, _)| column).max()?);
        let (top, bottom) =
            (marked().map(|(_, row)| row).min()?, marked().map(|(_, row)| row).max()?);
        let side = |first: usize, last: usize, size: usize| {
            // The last column and row of cells may end with the image.
            ((last + 1) * CELL_PX).min(size) - first * CELL_PX
        };
        Some(PixelBox {
            left: (left * CELL_PX) as i32,
            top: (top * CELL_PX) as i32,
            width: side(left, right, self.disparity_q8.width()) as i32,
            height: side(top, bottom, self.disparity_q8.height()) as i32,
        })
    }

    /// Returns true if a pixel belongs to the marked cells: it lies in one, has the disparity of
    /// that or of a neighbouring one, and is above the ground. One without a disparity belongs to
    /// the cell it lies in.
    pub fn is_own(&self, cells: &[u8], u: i32, v: i32) -> bool {
        let Some(at) = usize::try_from(u).ok().zip(usize::try_from(v).ok()).map(|(u, v)| [u, v])
        else {
            return false;
        };
        let [column, row] = at.map(|px| px / CELL_PX);
        let mark = |column: usize, row: usize| {
            let is_within = column < self.columns && row < self.rows;
            cells
                .get(row * self.columns + column)
                .copied()
                .filter(|_| is_within)
                .unwrap_or_default()
        };
        let own = mark(column, row);
        // A cell that fills a gap has no disparity of the object's.
        if own != GROWN {
            return own == FILLED;
        }
        let Some(disparity_px) = self.disparity_px(at) else { return true };
        let is_like = |column: usize, row: usize| {
            let like = |cell_px: f64| libm::fabs(cell_px - disparity_px) < step_px(cell_px);
            mark(column, row) == GROWN
                && self.disparity_px(self.pixel(column, row)).is_some_and(like)
        };
        // The pixel may lie in a cell whose middle shows something else: neighbours count, too.
        let near = [
            (column, row),
            (column.wrapping_sub(1), row),
            (column + 1, row),
            (column, row.wrapping_sub(1)),
            (column, row + 1),
        ];
        near.into_iter().any(|(column, row)| is_like(column, row))
            && self.point_at(at).is_some_and(|point| self.is_above_ground(point))
    }
}

/// Returns the largest difference of disparities in neighbouring cells of one object, px.
fn step_px(disparity_px: f64) -> f64 {
    STEP_PX + STEP_SHARE * disparity_px
}

/// Cells of a rectangle: columns `left .. right`, rows `top .. bottom`.
#[derive(Clone, Copy)]
struct Bounds {
    left: usize,
    right: usize,
    top: usize,
    bottom: usize,
}

impl Bounds {
    fn contains(&self, column: usize, row: usize) -> bool {
        (self.left..self.right).contains(&column) && (self.top..self.bottom).contains(&row)
    }

    fn cells(self) -> impl Iterator<Item = (usize, usize)> {
        (self.top..self.bottom)
            .flat_map(move |row| (self.left..self.right).map(move |column| (column, row)))
    }
}

/// An extent with its margins.
fn widened(extent: &Extent) -> Extent {
    if is_upright(extent) {
        return with_margins(extent, [(MARGIN_MIN_M, MARGIN_MIN_M); 3]);
    }
    let depth_m = extent.center().z;
    let length_m = extent.high[2] - extent.low[2];
    let is_beside = libm::fabs(extent.center().x) > BESIDE * depth_m;
    let side_m = |margin_m: f64| max_f64(margin_m - MARGIN_PER_DEPTH * depth_m, MARGIN_MIN_M);
    // Depth is uncertain with its square.
    let [across_m, up_m, along_m] = MARGIN_M;
    let along_m = along_m + DEPTH_MARGIN * depth_m * depth_m;
    // Seen from one end, an object shows less than its length.
    let behind_m = if length_m + along_m < LENGTH_M { LENGTH_M - length_m } else { along_m };
    // Beside the camera, the near end may be out of view as well.
    let before_m = if is_beside { behind_m } else { along_m };
    let [across_m, up_m] = [side_m(across_m), side_m(up_m)];
    with_margins(extent, [(across_m, across_m), (up_m, up_m), (before_m, behind_m)])
}

/// Returns true for the shape of a person who stands, walks or rides along the line of sight: what
/// is around the members is not the rest of a car.
fn is_upright(extent: &Extent) -> bool {
    let ([left, top, near], [right, bottom, far]) = (extent.low, extent.high);
    let [width_m, height_m, length_m] = [right - left, bottom - top, far - near];
    height_m > UPRIGHT_HEIGHT_M && height_m > UPRIGHT_SHAPE * width_m && length_m < UPRIGHT_LENGTH_M
}

/// An extent with so much before and behind on each axis, m.
fn with_margins(extent: &Extent, margins_m: [(f64, f64); 3]) -> Extent {
    let mut reach = *extent;
    for ((low, high), (before_m, behind_m)) in
        reach.low.iter_mut().zip(&mut reach.high).zip(margins_m)
    {
        (*low, *high) = (*low - before_m, *high + behind_m);
    }
    reach
}
