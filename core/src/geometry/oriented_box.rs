//! A box that may be turned.

use super::{
    Transform,
    scalar::{max_f64, min_f64},
};

/// A box with a frame of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct OrientedBox {
    /// From the world into the box's frame.
    pub t_box_world: Transform,
    /// Least coordinates in its frame, m.
    pub low_m: [f64; 3],
    /// Greatest coordinates in its frame, m.
    pub high_m: [f64; 3],
}

impl OrientedBox {
    /// Returns true if a point of the world lies in the box; false if the point is not finite.
    #[inline]
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        let at = self.t_box_world.transform_point(point_m);
        at.iter()
            .zip(self.low_m.iter().zip(&self.high_m))
            .all(|(at, (low, high))| low <= at && at <= high)
    }

    /// The least box along the world's axes around it: least and greatest coordinates, m.
    pub fn bounds_m(&self) -> [[f64; 3]; 2] {
        let t_world_box = self.t_box_world.inverse();
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let [[x, y, z], [x2, y2, z2]] = [self.low_m, self.high_m];
        // Turned, the extremes along the axes are those of corners.
        for corner in [
            [x, y, z],
            [x2, y, z],
            [x, y2, z],
            [x2, y2, z],
            [x, y, z2],
            [x2, y, z2],
            [x, y2, z2],
            [x2, y2, z2],
        ] {
            let corner: [f64; 3] = t_world_box.transform_point(corner);
            let [low, high] = &mut bounds;
            for ((low, high), at) in low.iter_mut().zip(high).zip(corner) {
                (*low, *high) = (min_f64(*low, at), max_f64(*high, at));
            }
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_box_holds_its_corners_and_its_bounds_hold_them_all() {
        let t_world_box = Transform::new([0.1, 0.7, -0.2], [4.0, -1.0, 20.0]);
        let turned = OrientedBox {
            t_box_world: t_world_box.inverse(),
            low_m: [-1.0, -0.5, -2.0],
            high_m: [1.0, 0.5, 2.0],
        };
        let [low, high] = turned.bounds_m();
        // Four corners of the eight: the others are their opposites.
        for corner in [[-1.0, -0.5, -2.0], [1.0, -0.5, 2.0], [1.0, 0.5, -2.0], [-1.0, 0.5, 2.0]] {
            let inside: [f64; 3] = t_world_box.transform_point(corner.map(|c| 0.99 * c));
            let outside: [f64; 3] = t_world_box.transform_point(corner.map(|c| 1.01 * c));
            assert!(turned.contains(inside) && !turned.contains(outside));
            assert!(
                inside
                    .iter()
                    .zip(low.iter().zip(&high))
                    .all(|(at, (low, high))| low < at && at < high)
            );
        }
        assert!(!turned.contains([f64::NAN; 3]));
    }
}
