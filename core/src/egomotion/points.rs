//! Matches as scene points in the previous camera and where the current cameras see them, one array
//! per coordinate.
//!
//! Memory: 28 bytes per match and 8 for the lists of inliers.

use crate::{
    geometry::{DEPTH_MIN_M, StereoRig, Transform},
    memory::{Carver, region_bytes},
    scene_flow::Match,
};

/// Points scored between two looks at whether the hypothesis can still win.
const STRIDE: usize = 256;
/// Coordinates of a point and its observations.
const COLUMNS: usize = 7;

/// The points. Coordinates in m, observations in px from the principal point.
#[derive(Debug)]
pub(super) struct Points<'s> {
    x: &'s mut [f32],
    y: &'s mut [f32],
    z: &'s mut [f32],
    left_u: &'s mut [f32],
    left_v: &'s mut [f32],
    right_u: &'s mut [f32],
    right_v: &'s mut [f32],
    /// Index of the match that each point came from.
    source: &'s mut [u32],
    len: usize,
}

/// One point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub xyz: [f64; 3],
    pub left: [f64; 2],
    pub right: [f64; 2],
}

impl<'s> Points<'s> {
    pub(super) const fn bytes(matches: usize) -> usize {
        region_bytes::<f32>(COLUMNS * matches) + region_bytes::<u32>(matches)
    }

    pub(super) fn new_in(matches: usize, carver: &mut Carver<'s>) -> Self {
        let mut columns = carver.alloc("egomotion.point", COLUMNS * matches);
        let mut column = || columns.split_off_mut(..matches).unwrap_or_default();
        Self {
            x: column(),
            y: column(),
            z: column(),
            left_u: column(),
            left_v: column(),
            right_u: column(),
            right_v: column(),
            source: carver.alloc("egomotion.source", matches),
            len: 0,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Triangulates the matches. Those without disparity, not finite or beyond the capacity are
    /// left out; returns how many were given.
    pub(super) fn fill<'m>(
        &mut self,
        matches: impl IntoIterator<Item = &'m Match>,
        rig: &StereoRig,
    ) -> usize {
        self.len = 0;
        let mut given = 0;
        // Positions among the matches given, so that inliers can be named to the caller.
        for (index, m) in (0..).zip(matches) {
            given += 1;
            if let Some(point) = triangulate(m, rig) {
                self.push(point, index);
            }
        }
        given
    }

    fn push(&mut self, point: Point, source: u32) {
        let at = self.len;
        let ([x, y, z], [left_u, left_v], [right_u, right_v]) =
            (point.xyz, point.left, point.right);
        let columns = [
            (&mut *self.x, x),
            (&mut *self.y, y),
            (&mut *self.z, z),
            (&mut *self.left_u, left_u),
            (&mut *self.left_v, left_v),
            (&mut *self.right_u, right_u),
            (&mut *self.right_v, right_v),
        ];
        for (column, value) in columns {
            if let Some(slot) = column.get_mut(at) {
                *slot = value as f32;
            }
        }
        // The source decides: a point beyond the capacity is not counted.
        if let Some(slot) = self.source.get_mut(at) {
            *slot = source;
            self.len += 1;
        }
    }

    pub(super) fn get(&self, index: usize) -> Option<Point> {
        let at = |column: &[f32]| column.get(index).map(|&x| f64::from(x));
        Some(Point {
            xyz: [at(self.x)?, at(self.y)?, at(self.z)?],
            left: [at(self.left_u)?, at(self.left_v)?],
            right: [at(self.right_u)?, at(self.right_v)?],
        })
    }

    /// Returns the index, among the matches handed to [`Points::fill`], of a point's match.
    pub(super) fn source(&self, index: usize) -> Option<u32> {
        self.source.get(index).copied()
    }

    /// Counts the points within `inlier_px` of where the motion puts them; gives up, with a smaller
    /// count, when `to_beat` is out of reach.
    pub(super) fn score(
        &self,
        motion: &Transform,
        rig: &StereoRig,
        inlier_px: f32,
        to_beat: u32,
    ) -> u32 {
        let view = SinglePrecision::new(motion, rig);
        let mut count = 0;
        let mut first = 0;
        // A stride is long enough for vectors and short enough to give up early.
        while first < self.len && count + ((self.len - first) as u32) > to_beat {
            let last = (first + STRIDE).min(self.len);
            count += self.errors(&view, first..last, |hits, error| {
                hits + u32::from(error < inlier_px * inlier_px)
            });
            first = last;
        }
        count
    }

    /// Writes the positions of the points within `inlier_px` to `inliers`, in order. Returns how
    /// many there are.
    pub(super) fn select(
        &self,
        motion: &Transform,
        rig: &StereoRig,
        inlier_px: f32,
        inliers: &mut [u32],
    ) -> usize {
        let view = SinglePrecision::new(motion, rig);
        let mut slots = inliers.iter_mut();
        let mut count = 0;
        let mut index = 0;
        // The callback's result is summed up by `errors` and is not needed here.
        self.errors(&view, 0..self.len, |_, error| {
            if error < inlier_px * inlier_px
                && let Some(slot) = slots.next()
            {
                *slot = index;
                count += 1;
            }
            index += 1;
            0
        });
        count
    }

    /// Folds the squared errors of a range of points, px²; infinite for points that would be behind
    /// the camera.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "all columns are cut to n first")]
    fn errors(
        &self,
        view: &SinglePrecision,
        range: core::ops::Range<usize>,
        mut fold: impl FnMut(u32, f32) -> u32,
    ) -> u32 {
        let n = range.len();
        // Slices of one length, so that the loop needs no checks.
        let columns =
            [&*self.x, self.y, self.z, self.left_u, self.left_v, self.right_u, self.right_v];
        let [Some(x), Some(y), Some(z), Some(left_u), Some(left_v), Some(right_u), Some(right_v)] =
            columns.map(|column| column.get(range.start..)?.get(..n))
        else {
            return 0;
        };
        let mut state = 0;
        for i in 0..n {
            let error =
                view.error([x[i], y[i], z[i]], [left_u[i], left_v[i]], [right_u[i], right_v[i]]);
            state = fold(state, error);
        }
        state
    }
}

/// A motion and a rig in single precision, for scoring: hundreds of hypotheses times a thousand
/// points. Its projection divides once and never branches, which the one of [`StereoRig`] in double
/// precision does not allow.
pub(super) struct SinglePrecision {
    rotation: [[f32; 3]; 3],
    translation: [f32; 3],
    focal: f32,
    focal_baseline: f32,
}

impl SinglePrecision {
    pub(super) fn new(motion: &Transform, rig: &StereoRig) -> Self {
        Self {
            rotation: motion.rotation_matrix().map(|row| row.map(|x| x as f32)),
            translation: motion.translation_m.map(|x| x as f32),
            focal: rig.focal_px as f32,
            focal_baseline: rig.focal_baseline_px_m() as f32,
        }
    }

    /// Tells whether the motion puts a match within so many pixels of where it is seen.
    pub(super) fn explains(&self, m: &Match, rig: &StereoRig, within_px: f32) -> bool {
        triangulate(m, rig).is_some_and(|Point { xyz, left, right }| {
            let [left, right] = [left, right].map(|at| at.map(|x| x as f32));
            self.error(xyz.map(|x| x as f32), left, right) < within_px * within_px
        })
    }

    /// Distance between where the motion puts a match and where it is seen, px; infinite for one
    /// that cannot be triangulated.
    pub(super) fn distance_px(&self, m: &Match, rig: &StereoRig) -> f32 {
        let squared = triangulate(m, rig).map(|Point { xyz, left, right }| {
            let [left, right] = [left, right].map(|at| at.map(|x| x as f32));
            self.error(xyz.map(|x| x as f32), left, right)
        });
        squared.map_or(f32::INFINITY, libm::sqrtf)
    }

    #[inline(always)]
    fn error(&self, [x, y, z]: [f32; 3], left: [f32; 2], right: [f32; 2]) -> f32 {
        // A row of the rotation times the point.
        let row = |r: [f32; 3], t: f32| r[0] * x + r[1] * y + r[2] * z + t;
        let [rx, ry, rz] = self.rotation;
        let [tx, ty, tz] = self.translation;
        let depth = row(rz, tz);
        let inverse = 1.0 / depth;
        let u = self.focal * row(rx, tx) * inverse;
        let v = self.focal * row(ry, ty) * inverse;
        let [a, b, c, d] =
            [u - left[0], v - left[1], u - self.focal_baseline * inverse - right[0], v - right[1]];
        let error = a * a + b * b + c * c + d * d;
        // Computed for all and chosen last: a branch would keep vectors out.
        if depth > DEPTH_MIN_M as f32 { error } else { f32::INFINITY }
    }
}

/// The point a match shows, in the previous left camera, and its current observations.
fn triangulate(m: &Match, rig: &StereoRig) -> Option<Point> {
    let (left, right) = (rig.centered(m.current_left), rig.centered(m.current_right));
    // The current positions are not checked by the triangulation below.
    if !left.iter().chain(&right).all(|x| x.is_finite()) {
        return None;
    }
    Some(Point {
        xyz: rig.triangulate(&rig.observation(m.previous_left, m.previous_right))?,
        left,
        right,
    })
}

#[cfg(test)]
mod tests;
