//! The static map against moving objects: triangles of `map.ply` inside the boxes moving objects
//! filled while they were seen.
//!
//! A box is taken smaller than the true object: the ground below it and what it touches belong to
//! the map.

use crate::formats::{PlyMesh, PlyVertex};
use crate::input::TrueObject;
use dynvox_core::geometry::Transform;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::io;
use std::path::Path;

/// Height above its foot at which a box begins, m: the road is mapped, and not flat to the
/// millimetre.
const FOOT_M: f64 = 0.3;
/// Distance by which the box's sides are moved inwards, m.
const SIDE_M: f64 = 0.1;

/// Side of the squares of ground by which boxes are found, m.
const SQUARE_M: f64 = 4.0;

/// A box of one frame.
#[derive(Debug, Serialize, Deserialize)]
struct SweptBox {
    t_object_map: Transform,
    /// Width, height, length.
    dimensions_m: [f64; 3],
}

impl SweptBox {
    fn contains(&self, point: &Point3<f64>) -> bool {
        let ([width, height, length], at) =
            (self.dimensions_m, self.t_object_map.transform_point(*point));
        at.x.abs() < 0.5 * width - SIDE_M
            && at.z.abs() < 0.5 * length - SIDE_M
            && at.y < -FOOT_M
            && at.y > -height
    }
}

/// The volume moving objects swept.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Swept {
    boxes: Vec<SweptBox>,
    /// The boxes that may reach into each square of ground.
    squares: HashMap<[i64; 2], Vec<u32>>,
}

/// The square of ground a point lies in.
fn square(x_m: f64, z_m: f64) -> [i64; 2] {
    [x_m, z_m].map(|m| (m / SQUARE_M).floor() as i64)
}

impl Swept {
    /// Adds a true object if it moves in this frame; `t_map_world` carries the truth's world into
    /// the map's.
    pub fn add(&mut self, object: &TrueObject, t_map_world: &Transform) {
        if object.moving {
            let t_map_object = t_map_world * object.t_world_object;
            let ([width, height, length], foot) =
                (object.dimensions_m, Point3::from(t_map_object.translation_m));
            // The box may lean: no corner is farther away than this.
            let reach = (0.25 * (width * width + length * length) + height * height).sqrt();
            let number = self.boxes.len() as u32;
            self.boxes.push(SweptBox {
                t_object_map: t_map_object.inverse(),
                dimensions_m: object.dimensions_m,
            });
            // All squares of the ground that the box may touch: a point then asks few boxes.
            let ([left, near], [right, far]) =
                (square(foot.x - reach, foot.z - reach), square(foot.x + reach, foot.z + reach));
            for x in left..=right {
                (near..=far).for_each(|z| self.squares.entry([x, z]).or_default().push(number));
            }
        }
    }

    /// Returns true if a point of the map lies in a swept box.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        let near = self.squares.get(&square(point.x, point.z)).into_iter().flatten();
        near.filter_map(|&number| self.boxes.get(number as usize)).any(|one| one.contains(point))
    }

    /// Counts the triangles of a static map that have all their corners in a swept box.
    ///
    /// # Errors
    /// The file is no mesh of this program.
    pub fn triangles(&self, ply: &Path) -> io::Result<u64> {
        let inside = |corner: &PlyVertex| {
            // Meshes of objects may lie where cars drove.
            corner.object == 0
                && self.contains(&Point3::from(corner.vertex.position_m.map(f64::from)))
        };
        let mut count = 0;
        PlyMesh::open(ply)
            .map_err(io::Error::other)?
            .triangles(|triangle| count += u64::from(triangle.iter().all(inside)))?;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::PlyWriter;
    use dynvox_core::masks::PixelBox;
    use dynvox_core::view::Vertex;

    #[test]
    fn counts_what_stands_where_a_car_drove_and_not_the_road_below_it() {
        let car = |z: f64, moving| TrueObject {
            id: 1,
            instance: 0,
            pixels: PixelBox::default(),
            t_world_object: Transform::from_translation([3.0, 1.6, z]),
            dimensions_m: [1.8, 1.5, 4.0],
            moving,
            speed_m_s: 10.0,
        };
        let mut swept = Swept::default();
        // Four metres of driving, and a car that stands, where nothing is swept.
        (0..5)
            .for_each(|frame| swept.add(&car(10.0 + f64::from(frame), true), &Transform::IDENTITY));
        swept.add(&car(30.0, false), &Transform::IDENTITY);
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("map.ply");
        let mut ply = PlyWriter::begin(&path).unwrap();
        // A small triangle, a little bent so that it has an area.
        let mut patch = |x: f32, y: f32, z: f32| {
            ply.triangle(
                [0.0, 0.05, 0.1]
                    .map(|d| Vertex { position_m: [x + d, y, z + d * d], ..Vertex::default() }),
            )
        };
        let patches = [
            (3.0, 1.0, 9.0),
            (3.0, 1.0, 15.5),
            (3.0, 1.6, 12.0),
            (5.0, 1.0, 12.0),
            (3.0, 1.0, 30.0),
            (3.0, -0.5, 12.0),
        ];
        patches.iter().for_each(|&(x, y, z)| patch(x, y, z));
        ply.finish().unwrap();
        assert_eq!(
            swept.triangles(&path).unwrap(),
            2,
            "two of the patches: the others are road, beside, above, or where a car is parked"
        );
    }
}
