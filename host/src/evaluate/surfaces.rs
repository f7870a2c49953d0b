//! Objects' meshes against the surfaces the renderer drew: how far the mesh lies from what is
//! really there, and how much it has of what was seen.
//!
//! Every pixel of exact depth that lies on a true object while its object is fused is a point of
//! its true surface, in the true object's own frame; those of one cell of `CELL_M` are one sample,
//! their mean. So the seen side is known, and hidden parts do not count. The mesh is carried into
//! the true object's frame by where the object was in the frame in which the true object was
//! nearest, and most of it is made: drift of the object's pose shows as distance.

use crate::input::TrueObject;
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::image::View;
use dynvox_core::view::Triangle;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Side of the cells samples are made of, m.
const CELL_M: f64 = 0.03;
/// Distance outside the true object's box within which its surface may lie, m.
const MARGIN_M: f64 = 0.03;
/// Height above its foot at which a true object begins, m: what is lower is road.
const FOOT_M: f64 = 0.05;
/// Largest distance measured, voxels: a sample this near to the mesh counts as reconstructed.
pub const REACH_VOXELS: f64 = 2.0;

/// A frame as it was rendered.
#[derive(Clone, Copy, Debug)]
pub struct TrueView<'a> {
    /// The left camera.
    pub rig: &'a StereoRig,
    /// Exact depth, m.
    pub depth_m: View<'a, f32>,
    /// Camera to the truth's world.
    pub t_world_camera: Transform,
    /// Depth beyond which nothing is fused, m.
    pub far_m: f64,
}

/// Surface of a true object that was visible while it was fused.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SeenSide {
    /// Sum of the points in a cell, and their number.
    cells: HashMap<[i32; 3], [f64; 4]>,
    /// Distance when nearest, m, and the object's frame to the true object's then.
    nearest: Option<(f64, Transform)>,
    frames: u32,
}

/// A mesh against the true surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceFigures {
    /// Median distance of the mesh's triangles to what was seen of the true surface, m; `None`
    /// where the most lie beyond the reach.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median_m: Option<f64>,
    /// Share of the triangles within [`REACH_VOXELS`] of it.
    pub accuracy: f64,
    /// Share of what was seen of the true surface within [`REACH_VOXELS`] of the mesh.
    pub completeness: f64,
    /// Samples of the true surface.
    pub samples: usize,
    /// Frames in which the true object was seen and fused.
    pub frames: u32,
    /// Distance when nearest, m.
    pub nearest_m: f64,
}

impl SeenSide {
    /// Adds what a frame shows of a true object. `t_truth_object` carries the object's own frame
    /// into the true object's.
    pub fn add(&mut self, view: &TrueView<'_>, truth: &TrueObject, t_truth_object: &Transform) {
        let t_truth_camera = truth.t_world_object.inverse() * view.t_world_camera;
        let [width, height, length] = truth.dimensions_m;
        // The box without its foot: the ground below an object is not the object.
        let inside = |p: &Point3<f64>| {
            p.x.abs() <= 0.5 * width + MARGIN_M
                && p.z.abs() <= 0.5 * length + MARGIN_M
                && p.y >= -height - MARGIN_M
                && p.y <= -FOOT_M
        };
        let pixels = truth.pixels;
        let mut seen = false;
        for v in pixels.top.max(0)..pixels.top + pixels.height {
            for u in pixels.left.max(0)..pixels.left + pixels.width {
                let depth_m = view.depth_m.get(u as usize, v as usize).map_or(0.0, f64::from);
                // Written so that NaN is left out.
                if !(depth_m > 0.0 && depth_m <= view.far_m) {
                    continue;
                }
                let per_px = depth_m / view.rig.focal_px;
                let camera = Point3::new(
                    (f64::from(u) - view.rig.center_u_px) * per_px,
                    (f64::from(v) - view.rig.center_v_px) * per_px,
                    depth_m,
                );
                let point = t_truth_camera.transform_point(camera);
                if inside(&point) {
                    // Points of a cell are averaged: noise in depth cancels over frames.
                    let cell = self.cells.entry(cell(&point, CELL_M)).or_default();
                    [point.x, point.y, point.z, 1.0]
                        .iter()
                        .zip(cell)
                        .for_each(|(value, sum)| *sum += value);
                    seen = true;
                }
            }
        }
        if seen {
            self.frames += 1;
            let distance_m = t_truth_camera.distance_m();
            // The frame nearest to the object fixes how its own frame lies in the true one.
            if self.nearest.is_none_or(|(nearest_m, _)| distance_m < nearest_m) {
                self.nearest = Some((distance_m, *t_truth_object));
            }
        }
    }

    /// Compares a mesh, in the object's own frame, with it; `None` where nothing was seen or there
    /// is no mesh.
    pub fn compare(&self, triangles: &[Triangle], voxel_size_m: f64) -> Option<SurfaceFigures> {
        let (nearest_m, t_truth_object) = self.nearest?;
        let reach_m = REACH_VOXELS * voxel_size_m;
        // Hash order must not reach the figures.
        let mut samples: Vec<([i32; 3], Point3<f64>)> = self
            .cells
            .iter()
            .map(|(cell, [x, y, z, count])| (*cell, Point3::new(x / count, y / count, z / count)))
            .collect();
        samples.sort_by_key(|(cell, _)| *cell);
        let samples: Vec<Point3<f64>> = samples.into_iter().map(|(_, point)| point).collect();
        let of = |position_m: [f32; 3]| {
            t_truth_object.transform_point(Point3::from(position_m.map(f64::from)))
        };
        let middles: Vec<Point3<f64>> = triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.vertices.map(|vertex| of(vertex.position_m).coords);
                Point3::from((a + b + c) / 3.0)
            })
            .collect();
        if middles.is_empty() || samples.is_empty() {
            return None;
        }
        // From the mesh to the truth: how much of what was made is right.
        let truth = PointGrid::new(&samples, reach_m);
        let mut distances: Vec<f64> =
            middles.iter().map(|middle| truth.distance_m(middle)).collect();
        distances.sort_by(f64::total_cmp);
        // From the truth to the mesh: how much of what was seen was made.
        let mesh = PointGrid::new(&middles, reach_m);
        let there = samples.iter().filter(|sample| mesh.distance_m(sample).is_finite()).count();
        Some(SurfaceFigures {
            median_m: distances
                .get(distances.len() / 2)
                .copied()
                .filter(|distance| distance.is_finite()),
            accuracy: distances.iter().filter(|distance| distance.is_finite()).count() as f64
                / distances.len() as f64,
            completeness: there as f64 / samples.len() as f64,
            samples: samples.len(),
            frames: self.frames,
            nearest_m,
        })
    }
}

fn cell(point: &Point3<f64>, side_m: f64) -> [i32; 3] {
    [point.x, point.y, point.z].map(|c| (c / side_m).floor() as i32)
}

/// Points by cells of the reach's side.
struct PointGrid<'p> {
    cells: HashMap<[i32; 3], Vec<&'p Point3<f64>>>,
    reach_m: f64,
}

impl<'p> PointGrid<'p> {
    fn new(points: &'p [Point3<f64>], reach_m: f64) -> Self {
        let mut cells: HashMap<[i32; 3], Vec<&Point3<f64>>> = HashMap::new();
        points.iter().for_each(|point| cells.entry(cell(point, reach_m)).or_default().push(point));
        Self { cells, reach_m }
    }

    /// Distance to the nearest point, m; infinite beyond the reach.
    fn distance_m(&self, from: &Point3<f64>) -> f64 {
        let [x, y, z] = cell(from, self.reach_m);
        // A point within reach lies in one of the 27 cells around.
        let around = (0..27).map(|n| [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]);
        let near = around
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .map(|point| (from - **point).norm());
        near.filter(|distance| *distance <= self.reach_m).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::masks::PixelBox;
    use dynvox_core::view::Vertex;

    const RIG: StereoRig =
        StereoRig { focal_px: 200.0, center_u_px: 50.0, center_v_px: 40.0, baseline_m: 0.5 };
    const SIZE: (usize, usize) = (100, 80);

    /// A wall of a box 2 m wide, 1.5 m high and 4 m long whose back is 8 m away: what a camera 1 m
    /// above the road sees of it.
    fn side() -> SeenSide {
        let truth = TrueObject {
            id: 1,
            instance: 0,
            pixels: PixelBox { left: 0, top: 0, width: 100, height: 80 },
            t_world_object: Transform::from_translation([0.0, 1.0, 10.0]),
            dimensions_m: [2.0, 1.5, 4.0],
            moving: true,
            speed_m_s: 5.0,
        };
        let depth_m = vec![8.0f32; SIZE.0 * SIZE.1];
        let view = TrueView {
            rig: &RIG,
            depth_m: View::new(&depth_m, SIZE.0, SIZE.1).unwrap(),
            t_world_camera: Transform::IDENTITY,
            far_m: 20.0,
        };
        let mut side = SeenSide::default();
        // The object's frame is the camera's.
        side.add(&view, &truth, &truth.t_world_object.inverse());
        side
    }

    /// A square patch of small triangles at a depth, from `left` to `right`.
    fn patch(depth_m: f32, left: f32, right: f32) -> Vec<Triangle> {
        let steps = |from: f32, to: f32| {
            (0..((to - from) / 0.04) as usize).map(move |n| from + 0.04 * n as f32)
        };
        let corner = |x: f32, y: f32| Vertex { position_m: [x, y, depth_m], ..Vertex::default() };
        let at = |x: f32, y: f32| Triangle {
            vertices: [corner(x, y), corner(x + 0.04, y), corner(x, y + 0.04)],
        };
        steps(left, right).flat_map(|x| steps(-0.5, 0.95).map(move |y| at(x, y))).collect()
    }

    #[test]
    fn a_shifted_mesh_has_the_distance_it_is_off() {
        let side = side();
        let good = side.compare(&patch(8.0, -1.0, 1.0), 0.05).unwrap();
        assert!(
            good.median_m.unwrap() < 0.025 && good.accuracy > 0.99 && good.completeness > 0.98,
            "{good:?}"
        );
        let off = side.compare(&patch(8.06, -1.0, 1.0), 0.05).unwrap();
        assert!((off.median_m.unwrap() - 0.061).abs() < 0.006, "{off:?}");
        // Half of the mesh: what is there is right, and half of the truth is missing.
        let half = side.compare(&patch(8.0, -1.0, 0.0), 0.05).unwrap();
        assert!((half.completeness - 0.53).abs() < 0.03 && half.accuracy > 0.99, "{half:?}");
        // Beyond the distance up to which surfaces are compared.
        let far = side.compare(&patch(8.5, -1.0, 1.0), 0.05).unwrap();
        assert_eq!((far.median_m, far.accuracy, far.completeness), (None, 0.0, 0.0));
        assert!(
            side.compare(&[], 0.05).is_none()
                && SeenSide::default().compare(&patch(8.0, -1.0, 1.0), 0.05).is_none()
        );
    }

    #[test]
    fn the_road_and_objects_beside_it_are_not_an_objects_surface() {
        let side = side();
        let xs: Vec<f64> = side.cells.values().map(|[x, _, _, count]| x / count).collect();
        assert!(xs.iter().all(|x| x.abs() <= 1.03) && xs.iter().any(|x| *x < -0.95));
        assert!(
            side.cells.values().all(|[_, y, _, count]| y / count <= -FOOT_M && y / count >= -1.53)
        );
    }
}
