//! Moving objects as boxes, at a chosen time ahead.
//!
//! An object is a box that stands upright and points where it moves. Its sides come from surface
//! points: twice their standard deviation on either side of their mean, which for points spread
//! evenly over a side is its length and a seventh, and for a few wild ones hardly more. At `t + dt`
//! it is displaced by its velocity; its position is as uncertain as it is now, and by `dt` times
//! its velocity's error more, and the box drawn is larger by a stated number of sigmas. A constant
//! velocity is the model that the tracks themselves are filtered with.
//!
//! Memory: 56 bytes for each of `Capacity::tracks`. Time: linear in the cells drawn over.

use super::{
    cells::{Cells, OBJECT},
    grid::Grid,
};
use crate::geometry::scalar::{max_f32, min_f32};
use bytemuck::{Pod, Zeroable};

/// Least half side of a box, m: what is seen of a wall-thin side says little about how deep it is.
const HALF_MIN_M: f32 = 0.25;
/// Below this speed a box does not point where it moves, m/s.
const HEADING_MIN_M_S: f32 = 0.2;

/// A moving object. Coordinates are the grid's: x right, y ahead, z up, in metres from the world's
/// origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MovingBox {
    /// Number of its track.
    pub id: u32,
    /// Frames since it was last seen.
    pub unseen_frames: u32,
    /// Centre, m.
    pub center_m: [f32; 3],
    /// Half its sides, m: along its heading, across it, upwards.
    pub half_m: [f32; 3],
    /// Heading, a unit vector (right, ahead).
    pub heading: [f32; 2],
    /// Velocity, m/s (right, ahead).
    pub velocity_m_s: [f32; 2],
    /// Error of the centre, one sigma, m.
    pub sigma_m: f32,
    /// Error of the velocity, one sigma, m/s.
    pub sigma_m_s: f32,
}

impl MovingBox {
    /// Predicts the box `ahead_s` seconds later, with its uncertainty.
    ///
    /// ```
    /// use dynvox_core::planning::MovingBox;
    ///
    /// let car = MovingBox { velocity_m_s: [0.0, 10.0], heading: [0.0, 1.0], sigma_m: 0.2, sigma_m_s: 0.5, ..MovingBox::default() };
    /// let later = car.predicted(2.0);
    /// assert_eq!((later.center_m[1], later.sigma_m), (20.0, 1.2));
    /// ```
    pub fn predicted(&self, ahead_s: f32) -> Self {
        let [x, y, z] = self.center_m;
        let [vx, vy] = self.velocity_m_s;
        Self {
            center_m: [x + vx * ahead_s, y + vy * ahead_s, z],
            sigma_m: self.sigma_m + self.sigma_m_s * if ahead_s < 0.0 { -ahead_s } else { ahead_s },
            ..*self
        }
    }

    /// Marks the cells whose centre lies in the box, `sigmas` sigmas and half a cell larger on each
    /// side.
    pub(super) fn draw(&self, grid: &Grid, sigmas: f32, cells: &mut Cells<'_>) {
        let cell_m = grid.cell_m() as f32;
        let more = sigmas * self.sigma_m + 0.5 * cell_m;
        let [along, across, up] = self.half_m.map(|half| half + more);
        let [cos, sin] = self.heading;
        // Half the sides of the upright box of the grid's axes around the turned one.
        let reach = [
            (cos * along).abs() + (sin * across).abs(),
            (sin * along).abs() + (cos * across).abs(),
            up,
        ];
        // The cells the box reaches, within the window.
        let mut spans = [[0, 0]; 3];
        for ((span, size), ((center, reach), origin)) in spans
            .iter_mut()
            .zip(cells.size)
            .zip(self.center_m.into_iter().zip(reach).zip(cells.origin))
        {
            let bound = |at: f32| {
                let cell = at / cell_m - origin as f32;
                // A position that is not a number reaches no cell.
                if cell.is_finite() { min_f32(max_f32(cell, 0.0), size as f32) as usize } else { 0 }
            };
            *span = [bound(center - reach), bound(center + reach + cell_m)];
        }
        let center = |axis: usize, at: usize| {
            let of = |cell: [i32; 3]| cell.get(axis).copied().unwrap_or_default();
            (of(cells.origin) as f32 + at as f32 + 0.5) * cell_m
                - self.center_m.get(axis).copied().unwrap_or_default()
        };
        // Each cell's centre is tested in the box's axes.
        let [columns, rows, levels] = spans;
        for y in rows[0]..rows[1] {
            for x in columns[0]..columns[1] {
                // In the box's own axes two comparisons decide.
                let (dx, dy) = (center(0, x), center(1, y));
                let is_beside =
                    (cos * dx + sin * dy).abs() > along || (cos * dy - sin * dx).abs() > across;
                if is_beside {
                    continue;
                }
                let first = cells.column(x, y);
                for z in (levels[0]..levels[1]).filter(|&z| center(2, z).abs() <= up) {
                    let position = first + cells.level(z);
                    if let Some(bits) = cells.bits.get_mut(position) {
                        *bits |= OBJECT;
                    }
                }
            }
        }
    }
}

/// Sums over an object's surface points, in its directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxFit {
    heading: [f64; 2],
    /// A point of the object: sums are of differences from it.
    near: [f64; 3],
    count: f64,
    sum: [f64; 3],
    squares: [f64; 3],
}

impl BoxFit {
    /// For an object that moves with that velocity (right, ahead), near that point of the grid, m.
    pub fn new(velocity_m_s: [f64; 2], near: [f64; 3]) -> Self {
        let [x, y] = velocity_m_s;
        let speed = libm::sqrt(x * x + y * y);
        let heading =
            if speed > f64::from(HEADING_MIN_M_S) { [x / speed, y / speed] } else { [0.0, 1.0] };
        Self { heading, near, count: 0.0, sum: [0.0; 3], squares: [0.0; 3] }
    }

    /// Takes in a point of the grid, m.
    pub fn add(&mut self, point: [f64; 3]) {
        let [cos, sin] = self.heading;
        let [x, y, z] = [point[0] - self.near[0], point[1] - self.near[1], point[2] - self.near[2]];
        let local = [cos * x + sin * y, cos * y - sin * x, z];
        self.count += 1.0;
        self.sum.iter_mut().zip(local).for_each(|(sum, c)| *sum += c);
        self.squares.iter_mut().zip(local).for_each(|(sum, c)| *sum += c * c);
    }

    /// Points taken in.
    pub fn points(&self) -> f64 {
        self.count
    }

    /// The box; `None` without points.
    pub fn solve(&self) -> Option<MovingBox> {
        if self.count < 1.0 {
            return None;
        }
        let mean = self.sum.map(|sum| sum / self.count);
        let mut half_m = [0.0; 3];
        for ((half, squares), mean) in half_m.iter_mut().zip(self.squares).zip(mean) {
            // Rounding may leave a variance slightly below zero.
            let variance = squares / self.count - mean * mean;
            // Two sigmas of evenly spread points reach beyond the box's end: at least HALF_MIN_M.
            *half = max_f32(
                2.0 * libm::sqrt(if variance > 0.0 { variance } else { 0.0 }) as f32,
                HALF_MIN_M,
            );
        }
        let [cos, sin] = self.heading;
        let [along, across, up] = mean;
        // The sums were taken along the object's heading: turn their mean back into the grid.
        let center = [
            self.near[0] + cos * along - sin * across,
            self.near[1] + sin * along + cos * across,
            self.near[2] + up,
        ];
        Some(MovingBox {
            center_m: center.map(|c| c as f32),
            half_m,
            heading: self.heading.map(|c| c as f32),
            ..MovingBox::default()
        })
    }
}
