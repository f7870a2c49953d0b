//! Visibility: which triangle each sample of a band of rows sees.
//!
//! Edges are planes through the eye (homogeneous rasterisation, Olano and Greer 1997), so nothing
//! is clipped; the same three planes give exact inverse depth and perspective-correct barycentric
//! coordinates anywhere in the pixel. A band's result depends on the order of the triangles alone.

use nalgebra::Vector3;

/// Nothing seen: the sky.
pub const SKY: u32 = u32::MAX;
/// Samples per pixel: the centre, which gives depth and masks, and six around it.
pub const SAMPLES: usize = 7;
/// Positions of the samples, twelfths of a pixel from its centre. No two of the six share a column
/// or a row.
const OFFSETS_PX_12: [(f64, f64); SAMPLES] =
    [(0.0, 0.0), (-5.0, -3.0), (-3.0, 1.0), (-1.0, 5.0), (1.0, -5.0), (3.0, -1.0), (5.0, 3.0)];
/// Rows after which the samples' shifts repeat.
pub const PHASES: usize = 8;
/// Shift of a row's samples to the right, 96ths of a pixel: upright edges meet 48 positions within
/// a pixel, not six. The centre stays.
const SHIFTS_PX_96: [f64; PHASES] = [-7.0, 1.0, -3.0, 5.0, -5.0, 3.0, -1.0, 7.0];
const NEAR_M: f64 = 0.05;

/// Position of a sample in the pixels of a row, px from their centres.
pub fn offset_px(sample: usize, row: usize) -> (f64, f64) {
    let (right, down) = OFFSETS_PX_12[sample];
    let shift = if sample == 0 { 0.0 } else { SHIFTS_PX_96[row % PHASES] };
    (right * (1.0 / 12.0) + shift * (1.0 / 96.0), down * (1.0 / 12.0))
}

/// A pinhole as the rasteriser needs it.
#[derive(Clone, Copy)]
pub struct Pinhole {
    /// Image width, px.
    pub width: usize,
    /// Image height, px.
    pub height: usize,
    /// Focal length, px.
    pub focal_px: f64,
    /// Principal point, px.
    pub center_px: (f64, f64),
}

/// A triangle set up for one view: each plane is (per column, per row, constant).
#[derive(Clone, Copy)]
pub struct Setup {
    /// Barycentric weight of each corner over depth.
    pub weights: [[f64; 3]; 3],
    /// Number of the object in the scene.
    pub object: u32,
    /// Number of the triangle in its object.
    pub triangle: u32,
    /// Surface group: samples of one group share one colour.
    pub group: u64,
    /// Columns it may touch, first and last.
    pub columns: (i32, i32),
    /// Rows it may touch, first and last.
    pub rows: (i32, i32),
    /// Exact extent over rows, px.
    pub extent_px: (f64, f64),
}

impl Setup {
    /// Prepares a triangle of corners in camera coordinates; `None` where it cannot be seen.
    pub fn new(pinhole: &Pinhole, corners: [Vector3<f64>; 3], two_sided: bool) -> Option<Self> {
        let [a, b, c] = corners;
        // Wholly behind the camera.
        if a.z <= NEAR_M && b.z <= NEAR_M && c.z <= NEAR_M {
            return None;
        }
        let planes = [b.cross(&c), c.cross(&a), a.cross(&b)];
        let volume = a.dot(&planes[0]);
        // Edge on, or seen from behind.
        if volume.abs() < 1e-14 || (volume > 0.0 && !two_sided) {
            return None;
        }
        let (columns, rows, extent_px) = reach(pinhole, corners)?;
        let scale = 1.0 / (volume * pinhole.focal_px);
        let (u, v) = pinhole.center_px;
        // Barycentric weights over depth are linear in the image: three numbers for each corner.
        let weights = planes.map(|plane| {
            let (x, y) = (plane.x * scale, plane.y * scale);
            [x, y, plane.z * (1.0 / volume) - x * u - y * v]
        });
        Some(Self { weights, object: 0, triangle: 0, group: 0, columns, rows, extent_px })
    }

    /// Inverse depth's plane.
    pub fn inverse_depth(&self) -> [f64; 3] {
        let [a, b, c] = &self.weights;
        [a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]]
    }
}

/// Columns, rows, and the exact extent over rows.
type Reach = ((i32, i32), (i32, i32), (f64, f64));

/// Columns and rows a triangle may touch, its part behind the eye cut off.
fn reach(pinhole: &Pinhole, corners: [Vector3<f64>; 3]) -> Option<Reach> {
    let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
    let mut take = |point: Vector3<f64>| {
        let scale = pinhole.focal_px / point.z;
        let (u, v) = (point.x * scale + pinhole.center_px.0, point.y * scale + pinhole.center_px.1);
        low = (low.0.min(u), low.1.min(v));
        high = (high.0.max(u), high.1.max(v));
    };
    for k in 0..3 {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        if from.z > NEAR_M {
            take(from);
        }
        // Where an edge crosses the near plane, its end is the crossing.
        if (from.z > NEAR_M) != (to.z > NEAR_M) {
            take(from + (to - from) * ((NEAR_M - from.z) / (to.z - from.z)));
        }
    }
    let last = (pinhole.width as f64 - 1.0, pinhole.height as f64 - 1.0);
    if high.0 < -0.5 || high.1 < -0.5 || low.0 > last.0 + 0.5 || low.1 > last.1 + 0.5 {
        return None;
    }
    let span = |low: f64, high: f64, last: f64| {
        ((low - 0.5).max(0.0) as i32, (high + 0.5).min(last) as i32)
    };
    // A hair wider, so that rounding does not lose a row.
    Some((span(low.0, high.0, last.0), span(low.1, high.1, last.1), (low.1 - 1e-9, high.1 + 1e-9)))
}

/// Visible surfaces in a band of rows: for each sample an inverse depth and a setup's number.
pub struct Band {
    /// First row.
    pub first_row: usize,
    /// Rows.
    pub rows: usize,
    width: usize,
    inverse_depth: Vec<f32>,
    seen: Vec<u32>,
}

impl Band {
    /// An empty band.
    pub fn new(width: usize, first_row: usize, rows: usize) -> Self {
        let samples = SAMPLES * rows * width;
        Self {
            first_row,
            rows,
            width,
            inverse_depth: vec![0.0; samples],
            seen: vec![SKY; samples],
        }
    }

    /// The setups seen by a row's pixels at one sample.
    pub fn row(&self, sample: usize, row: usize) -> &[u32] {
        let start = (sample * self.rows + row) * self.width;
        &self.seen[start..start + self.width]
    }

    /// Draws one triangle into all samples.
    pub fn rasterize(&mut self, number: u32, setup: &Setup) {
        let first = setup.rows.0.max(self.first_row as i32);
        let last = setup.rows.1.min((self.first_row + self.rows) as i32 - 1);
        let [per_column, per_row, constant] = setup.inverse_depth();
        let slope = per_column as f32;
        let sides = Sides::new(setup);
        for sample in 0..SAMPLES {
            let (_, dv) = offset_px(sample, 0);
            // Rows whose sample lies within the triangle's extent; casts saturate at the band's own
            // rows.
            let (top, bottom) = (setup.extent_px.0 - dv, setup.extent_px.1 - dv);
            let top_row = top as i32 + i32::from(top > f64::from(top as i32));
            if bottom < 0.0 {
                continue;
            }
            for row in first.max(top_row)..=last.min(bottom as i32) {
                let v = f64::from(row) + dv;
                let row = row as usize;
                let (du, _) = offset_px(sample, row);
                let Some((from, to)) = sides.span(du, v) else { continue };
                let start = (sample * self.rows + row - self.first_row) * self.width;
                let begin =
                    // Inverse depth is linear along a row: one addition for each pixel.
                    (per_column * (f64::from(from as u32) + du) + per_row * v + constant) as f32;
                let range = start + from..=start + to;
                let slots = self.inverse_depth[range.clone()].iter_mut().zip(&mut self.seen[range]);
                for (k, (near, seen)) in slots.enumerate() {
                    let here = begin + slope * k as i32 as f32;
                    // Selections instead of branches, which the compiler turns into vectors.
                    let closer = here > *near;
                    *near = if closer { here } else { *near };
                    *seen = if closer { number } else { *seen };
                }
            }
        }
    }
}

/// A triangle's edges as columns over rows: inside is right of all of the left ones and left of all
/// of the right ones.
struct Sides {
    left: [(f64, f64); 3],
    right: [(f64, f64); 3],
    columns: (f64, f64),
}

impl Sides {
    fn new(setup: &Setup) -> Self {
        // A hair's breadth is added so that neighbours leave no crack.
        const HAIR_PX: f64 = 1e-9;
        let columns = (f64::from(setup.columns.0), f64::from(setup.columns.1));
        let mut sides = Self { left: [(0.0, -1e9); 3], right: [(0.0, 1e9); 3], columns };
        for (k, [per_column, per_row, constant]) in setup.weights.into_iter().enumerate() {
            // An edge along a row is nearly one: its line is far away or covers all.
            let per_column = if per_column.abs() < 1e-13 { 1e-13 } else { per_column };
            let line = (-per_row / per_column, -constant / per_column);
            if per_column > 0.0 {
                sides.left[k] = (line.0, line.1 - HAIR_PX);
            } else {
                sides.right[k] = (line.0, line.1 + HAIR_PX);
            }
        }
        sides
    }

    /// First and last column of a row of samples.
    fn span(&self, du: f64, v: f64) -> Option<(usize, usize)> {
        // The first column to the right of all left edges, the last to the left of all right ones.
        let at = |(slope, start): (f64, f64)| slope * v + start - du;
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let smaller = |a: f64, b: f64| if a < b { a } else { b };
        let from = larger(
            larger(at(self.left[0]), at(self.left[1])),
            larger(at(self.left[2]), self.columns.0),
        );
        let to = smaller(
            smaller(at(self.right[0]), at(self.right[1])),
            smaller(at(self.right[2]), self.columns.1),
        );
        if from > to {
            return None;
        }
        // Neither is negative: a cast is the floor.
        let (first, last) = (from as i32, to as i32);
        let first = first + i32::from(f64::from(first) < from);
        (first <= last).then_some((first as usize, last as usize))
    }
}
