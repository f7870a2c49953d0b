//! Prior of every pixel from the support points (Geiger et al., section 3.2): the plane of its
//! triangle, and the disparities of the support points near it.
//!
//! Planes are rasterised, triangle by triangle, into the image that will receive the disparities:
//! no memory of their own. The grid prior is a set of 256 bits per cell.

use crate::{
    lanes::{self, LANES},
    parallel::Work,
    slices::{clipped_mut, padded, store},
};

use super::{
    StereoConfig,
    config::{DISPARITY_LIMIT, MAX_PLANE_RADIUS},
    delaunay::{SupportPoint, Triangulation},
    rows::MatchedRows,
};

/// No triangle covers the pixel.
pub(super) const NO_PLANE: i16 = -1;
/// Added to the plane's disparity where its triangle is too steep to be a surface.
pub(super) const STEEP: i16 = 256;

/// Disparities about a plane, at most.
pub(super) const PLANE_WIDTH: usize = 2 * MAX_PLANE_RADIUS + 1;

/// Rasterises the planes into the matched rows `first..`, which `out` holds, `width` wide: the
/// disparity in whole px, plus [`STEEP`], or [`NO_PLANE`]. Triangles are rasterised to the pixels
/// beyond their edges; the later one wins.
pub(super) struct RasterisePlanes<'a, 'm> {
    pub mesh: &'a Triangulation<'m>,
    pub slope_max: f32,
    pub rows: MatchedRows,
    pub first: usize,
    pub width: usize,
    pub out: &'a mut [i16],
}

impl Work for RasterisePlanes<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        rasterise_planes(self);
    }
}

#[inline(always)]
fn rasterise_planes(
    RasterisePlanes { mesh, slope_max, rows, first, width, out }: RasterisePlanes<'_, '_>,
) {
    out.fill(NO_PLANE);
    let width = width.max(1);
    // The band's rows are `step` apart, from this one on.
    let (top_row, step, count) = (rows.row(first), rows.step.max(1), out.len() / width);
    // A slope of 1000 fits.
    let slope_max = (slope_max * ONE as f32) as i64;
    for mut corners in mesh.triangles() {
        let [a, b, c] = corners.map(|point| usize::from(point.v));
        // Rows of the triangle that lie in this band, counted in it.
        let from = a.min(b).min(c).saturating_sub(top_row).div_ceil(step);
        let to = (a.max(b).max(c) + 1).saturating_sub(top_row).div_ceil(step).min(count);
        if from >= to {
            continue;
        }
        // Top to bottom: the long edge spans all rows, the others a part each.
        corners.sort_unstable_by_key(|point| (point.v, point.u));
        let [top, middle, bottom] = corners;
        let Some(plane) = Plane::through(corners, slope_max) else { continue };
        let (long, upper, lower) =
            (Edge::new(top, bottom), Edge::new(top, middle), Edge::new(middle, bottom));
        for (i, v) in (from..to).zip((top_row + from * step..).step_by(step)) {
            let at = v as i32;
            let (a, b) = (
                long.column(at),
                if v < usize::from(middle.v) { upper.column(at) } else { lower.column(at) },
            );
            // Pixels whose centre lies between the edges, one column wider to leave no seam.
            let (left, right) = ((a.min(b) >> SHIFT) as usize, (a.max(b) >> SHIFT) as usize + 1);
            let count = width.min(right + 1).saturating_sub(left);
            plane.rasterise(left as i64, at.into(), clipped_mut(out, i * width + left..), count);
        }
    }
}

/// Slopes and columns are in 1/65536 px: off by at most 0.03 px across 2,000.
const SHIFT: u32 = 16;
/// One px in that unit.
const ONE: i64 = 1 << SHIFT;

/// An edge of a triangle, downwards. Coordinates are below 2^13: 32 bits hold its columns, and
/// their division is a short one.
struct Edge {
    from: SupportPoint,
    slope: i32,
}

impl Edge {
    fn new(from: SupportPoint, to: SupportPoint) -> Self {
        let (columns, rows) =
            (i32::from(to.u) - i32::from(from.u), i32::from(to.v) - i32::from(from.v));
        // An edge along the row is met in its own row only, where the other edges give its ends.
        Self { from, slope: (columns << SHIFT).checked_div(rows).unwrap_or(0) }
    }

    fn column(&self, v: i32) -> i32 {
        (i32::from(self.from.u) << SHIFT) + self.slope * (v - i32::from(self.from.v))
    }
}

/// A disparity, held at the ends of what there can be.
#[inline(always)]
fn held(disparity: i32) -> i16 {
    const MOST: i32 = DISPARITY_LIMIT as i32;
    let low = if disparity > 0 { disparity } else { 0 };
    (if low < MOST { low } else { MOST }) as i16
}

/// d(u, v) = d0 + slope_u (u - u0) + slope_v (v - v0).
struct Plane {
    origin: SupportPoint,
    slope_u: i64,
    slope_v: i64,
    /// By how much the disparity rises to each of the pixels after one.
    along: [i32; LANES],
    /// Added to disparities.
    mark: i16,
}

impl Plane {
    fn through([a, b, c]: [SupportPoint; 3], slope_max: i64) -> Option<Self> {
        let d = |x: u16, y: u16| i64::from(x) - i64::from(y);
        // Cramer's rule in integers: the same plane on every machine.
        let (bu, bv, bd) = (d(b.u, a.u), d(b.v, a.v), d(b.disparity, a.disparity));
        let (cu, cv, cd) = (d(c.u, a.u), d(c.v, a.v), d(c.disparity, a.disparity));
        let slope = |numerator: i64| (numerator * ONE).checked_div(bu * cv - bv * cu);
        let (slope_u, slope_v) = (slope(bd * cv - bv * cd)?, slope(bu * cd - bd * cu)?);
        Some(Self {
            origin: a,
            slope_u,
            slope_v,
            along: core::array::from_fn(|i| (slope_u as i32).wrapping_mul(i as i32)),
            mark: if slope_u.abs() > slope_max || slope_v.abs() > slope_max { STEEP } else { 0 },
        })
    }

    /// Fills the first `count` of the pixels from column `left` of row `v` on.
    #[inline(always)]
    fn rasterise(&self, left: i64, v: i64, pixels: &mut [i16], count: usize) {
        let offset = self.slope_u * (left - i64::from(self.origin.u))
            + self.slope_v * (v - i64::from(self.origin.v));
        let mut start = (i64::from(self.origin.disparity) * ONE + offset + ONE / 2) as i32;
        // Spans are short, and how long no processor foresees: eight pixels at a time. Those beyond
        // the span stay as they are.
        for first in (0..count).step_by(LANES) {
            let own = lanes::first(count - first);
            match pixels.get_mut(first..).and_then(|pixels| pixels.first_chunk_mut()) {
                Some(eight) => self.fill(eight, start, own),
                None => self.fill_last(pixels, first, start, own),
            }
            start = start.wrapping_add((self.slope_u as i32).wrapping_mul(LANES as i32));
        }
    }

    /// Replaces the pixels whose bits are set in `own` by the plane's, which are `start` at the
    /// first one.
    ///
    /// Within a triangle all fits; a pixel beyond the edge of a very steep one may wrap, and its
    /// plane is not preferred anyway.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below eight")]
    fn fill(&self, eight: &mut [i16; LANES], start: i32, own: &[i16; LANES]) {
        for lane in 0..LANES {
            let disparity = held(start.wrapping_add(self.along[lane]) >> SHIFT) + self.mark;
            eight[lane] = (disparity & own[lane]) | (eight[lane] & !own[lane]);
        }
    }

    /// Fills the last pixels, fewer than eight.
    #[cold]
    #[inline(never)]
    fn fill_last(&self, pixels: &mut [i16], first: usize, start: i32, own: &[i16; LANES]) {
        let mut eight = padded(pixels, first, 0, NO_PLANE);
        self.fill(&mut eight, start, own);
        store(pixels, first, eight);
    }
}

/// The disparities a cell's pixels may have besides those near their plane: one bit each.
pub(super) type DisparitySet = [u64; 4];

/// The grid prior of one image.
pub(super) struct CellGrid<'a> {
    /// The sets, row by row.
    pub cells: &'a [DisparitySet],
    /// Cells along a row.
    pub columns: usize,
}

/// Cells along `length` px.
pub(super) const fn cells(length: usize, size: usize) -> usize {
    if size == 0 { 0 } else { length.div_ceil(size) }
}

/// Marks each support point's disparity and the two beside it in its cell and the eight about it.
/// `out` is `columns` wide.
pub(super) fn mark_cells(
    config: &StereoConfig,
    points: &[SupportPoint],
    columns: usize,
    out: &mut [DisparitySet],
) {
    out.fill([0; 4]);
    let (size, columns) = (config.grid_size.max(1), columns.max(1));
    for point in points {
        let (cu, cv) = (usize::from(point.u) / size, usize::from(point.v) / size);
        let (low, high) =
            // A match between two whole disparities may be rounded either way.
            (point.disparity.saturating_sub(1), (point.disparity + 1).min(config.disparity_max));
        // Three rows and columns of cells, two at the image's border.
        for row in out.chunks_exact_mut(columns).skip(cv.saturating_sub(1)).take(cv.min(1) + 2) {
            for cell in row.iter_mut().skip(cu.saturating_sub(1)).take(cu.min(1) + 2) {
                for disparity in low..=high {
                    if let Some(word) = cell.get_mut(usize::from(disparity / 64)) {
                        *word |= 1 << (disparity % 64);
                    }
                }
            }
        }
    }
}

/// Weight of the descriptor distance against the prior (beta), as published.
const BETA: f32 = 0.02;

/// Cost of disagreeing with the plane, in 1/16 of a descriptor distance: -ln(gamma + exp(-k^2 / 2
/// sigma^2)) / beta at k px from it, lowered so that k = 0 costs nothing.
pub(super) struct PlaneCost {
    /// At -radius..=radius px from the plane.
    pub about_plane: [u32; PLANE_WIDTH],
    /// Costs about a steep plane, which is not preferred.
    pub about_steep: [u32; PLANE_WIDTH],
    /// Farther off.
    pub elsewhere: u32,
    /// Searched to each side, px.
    pub radius: usize,
}

impl PlaneCost {
    /// Most a disparity can cost for being off the plane: as much as the worst descriptor distance.
    const MOST: f32 = 65_280.0;

    /// The tables for a valid configuration.
    pub fn new(config: &StereoConfig) -> Self {
        // ELAS's prior: how much a Gaussian about the plane, over a uniform share, takes off the
        // energy.
        let preference = |k: usize| {
            let deviation = k as f32;
            let density = libm::expf(-0.5 * deviation * deviation);
            libm::logf(1.0 + density / config.gamma) / BETA * 16.0
        };
        // Extreme parameters overflow to infinity or to nothing: both are clamped at what the
        // energies can bear.
        let clamped = |cost: f32| {
            if cost < Self::MOST { libm::roundf(cost) as u32 } else { Self::MOST as u32 }
        };
        let (radius, elsewhere) =
            (config.plane_radius().min(MAX_PLANE_RADIUS), clamped(preference(0)));
        // The preference is subtracted from the cost elsewhere, so that no cost is negative.
        let mut about_plane = [elsewhere; PLANE_WIDTH];
        for (i, cost) in about_plane.iter_mut().enumerate() {
            *cost = elsewhere - clamped(preference(i.abs_diff(radius))).min(elsewhere);
        }
        Self { about_plane, about_steep: [elsewhere; PLANE_WIDTH], elsewhere, radius }
    }
}
