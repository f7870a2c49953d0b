//! What the support points say about every pixel (Geiger et al., section 3.2): the plane of its triangle, and the disparities of the
//! support points near it.
//!
//! Planes are drawn, triangle by triangle, into the image that will receive the disparities: no memory of their own. The grid prior is a
//! set of 256 bits per cell.

use super::{
    StereoConfig,
    config::{DISPARITY_LIMIT, MAX_PLANE_RADIUS},
    delaunay::{SupportPoint, Triangulation},
};

/// No triangle covers the pixel.
pub(super) const NO_PLANE: i16 = -1;
/// Added to the plane's disparity where its triangle is too steep to be a surface.
pub(super) const STEEP: i16 = 256;

/// Draws the planes into image rows `first..` of `out`, `width` wide: the disparity in whole px, plus [`STEEP`], or [`NO_PLANE`].
/// Where triangles touch the later one wins.
pub(super) fn draw_planes(mesh: &Triangulation<'_>, slope_max: f32, first: usize, width: usize, out: &mut [i16]) {
    out.fill(NO_PLANE);
    let rows = out.len() / width;
    // In 1/65536 px per px; a slope of 1000 fits.
    let slope_max = (slope_max * 65_536.0) as i64;
    for corners in mesh.triangles() {
        let Some(plane) = Plane::through(corners) else { continue };
        let steep = plane.slope_u.abs() > slope_max || plane.slope_v.abs() > slope_max;
        let [top, middle, bottom] = by_row(corners);
        let (from, to) = (usize::from(top.v).max(first), usize::from(bottom.v).min(first + rows.saturating_sub(1)));
        for v in from..=to {
            let v_ = v as i64;
            let long = crossing(top, bottom, v_);
            let short = if v_ < i64::from(middle.v) { crossing(top, middle, v_) } else { crossing(middle, bottom, v_) };
            let (Some(long), Some(short)) = (long, short) else { continue };
            // Rightwards from the first column not left of the edge; both ends are in the image as all corners are.
            let (left, right) =
                if long.0 < short.0 || (long.0 == short.0 && long.1 < short.1) { (long.1, short.0) } else { (short.1, long.0) };
            let start = (v - first) * width;
            if let Some(span) = out.get_mut(start..start + width).and_then(|row| row.get_mut(left as usize..=right as usize)) {
                plane.draw(left, v_, if steep { STEEP } else { 0 }, span);
            }
        }
    }
}

fn by_row(mut corners: [SupportPoint; 3]) -> [SupportPoint; 3] {
    corners.sort_unstable_by_key(|point| (point.v, point.u));
    corners
}

/// Where the edge a-b crosses row v: the columns rounded down and up. An edge along the row gives its second end.
fn crossing(a: SupportPoint, b: SupportPoint, v: i64) -> Option<(i64, i64)> {
    let (au, av, bu, bv) = (i64::from(a.u), i64::from(a.v), i64::from(b.u), i64::from(b.v));
    if av == bv {
        return Some((bu, bu));
    }
    let numerator = (bu - au) * (v - av);
    let down = au + numerator.div_euclid(bv - av);
    Some((down, down + i64::from(numerator.rem_euclid(bv - av) != 0)))
}

/// d(u, v) = d0 + slope_u (u - u0) + slope_v (v - v0), kept as exact fractions over `determinant`.
struct Plane {
    origin: SupportPoint,
    numerator_u: i64,
    numerator_v: i64,
    determinant: i64,
    slope_u: i64,
    slope_v: i64,
}

impl Plane {
    fn through([a, b, c]: [SupportPoint; 3]) -> Option<Self> {
        let d = |x: u16, y: u16| i64::from(x) - i64::from(y);
        let (bu, bv, bd) = (d(b.u, a.u), d(b.v, a.v), d(b.disparity, a.disparity));
        let (cu, cv, cd) = (d(c.u, a.u), d(c.v, a.v), d(c.disparity, a.disparity));
        let determinant = bu * cv - bv * cu;
        let (numerator_u, numerator_v) = (bd * cv - bv * cd, bu * cd - bd * cu);
        let slope = |numerator: i64| (numerator << 16).checked_div(determinant);
        Some(Self { origin: a, numerator_u, numerator_v, determinant, slope_u: slope(numerator_u)?, slope_v: slope(numerator_v)? })
    }

    /// Fills a run of row `v` from column `left`, in 1/65536 px: exact at its first pixel, at most 0.03 px off after 2,000.
    fn draw(&self, left: i64, v: i64, mark: i16, span: &mut [i16]) {
        let from_origin = self.numerator_u * (left - i64::from(self.origin.u)) + self.numerator_v * (v - i64::from(self.origin.v));
        let Some(offset) = (from_origin << 16).checked_div(self.determinant) else { return };
        let start = (i64::from(self.origin.disparity) << 16) + offset + (1 << 15);
        let (start, slope) = (start as i32, self.slope_u as i32);
        for (i, out) in span.iter_mut().enumerate() {
            let disparity = (start.wrapping_add(slope.wrapping_mul(i as i32)) >> 16).clamp(0, i32::from(DISPARITY_LIMIT));
            *out = disparity as i16 + mark;
        }
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
    length.div_ceil(size)
}

/// Marks each support point's disparity and the two beside it in its cell and the eight about it. `out` is `columns` wide.
pub(super) fn mark_cells(config: &StereoConfig, points: &[SupportPoint], columns: usize, out: &mut [DisparitySet]) {
    out.fill([0; 4]);
    for point in points {
        let (cu, cv) = (usize::from(point.u) / config.grid_size, usize::from(point.v) / config.grid_size);
        let (low, high) = (point.disparity.saturating_sub(1), (point.disparity + 1).min(config.disparity_max));
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

/// What disagreeing with the plane costs, in 1/16 of a descriptor distance: -ln(gamma + exp(-k^2 / 2 sigma^2)) / beta at k px from it,
/// lowered so that k = 0 costs nothing.
pub(super) struct PlaneCost {
    /// At -radius..=radius px from the plane.
    pub about_plane: [u32; 2 * MAX_PLANE_RADIUS + 1],
    /// The same about a steep plane, which is not preferred.
    pub about_steep: [u32; 2 * MAX_PLANE_RADIUS + 1],
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
        let preference = |k: usize| {
            let deviation = k as f32 / config.sigma;
            let density = libm::expf(-0.5 * deviation * deviation);
            libm::logf(1.0 + density / config.gamma) / config.beta * 16.0
        };
        // Extreme parameters overflow to infinity or to nothing: both are held at what the energies can bear.
        let held = |cost: f32| if cost < Self::MOST { libm::roundf(cost) as u32 } else { Self::MOST as u32 };
        let (radius, elsewhere) = (config.plane_radius().min(MAX_PLANE_RADIUS), held(preference(0)));
        let mut about_plane = [elsewhere; 2 * MAX_PLANE_RADIUS + 1];
        for (i, cost) in about_plane.iter_mut().enumerate() {
            *cost = elsewhere - held(preference(i.abs_diff(radius))).min(elsewhere);
        }
        Self { about_plane, about_steep: [elsewhere; 2 * MAX_PLANE_RADIUS + 1], elsewhere, radius }
    }
}
