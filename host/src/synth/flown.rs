//! Frames of a camera that goes where it likes, and the exact distance to everything around it.

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

use super::frame::SynthFrame;
use super::mesh::Point;
use super::room::Room;
use super::scene::Scene;
use super::street::{Street, Surroundings};
use super::world::World;

/// Position and direction of a camera in the street.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreetPose {
    /// Distance along the street's reference line near the camera, m: the street exists about it.
    pub along_m: f64,
    /// Camera to street.
    pub t_street_camera: Transform,
}

/// The world around a camera at a time.
pub struct FlownView<'s> {
    world: FlownWorld<'s>,
    index: u32,
}

/// World with its surfaces around a camera.
enum FlownWorld<'s> {
    Street { street: &'s Street, around: Surroundings },
    Room { room: &'s Room, scene: Scene, t_room_camera: Transform },
}

impl Street {
    /// Place of a camera above the road: `lateral_m` to the right of the reference line,
    /// `height_m` above it, turned to the right by `yaw_rad`.
    ///
    /// ```
    /// use dynvox::synth::{Street, StreetConfig};
    ///
    /// let config = StreetConfig { width: 160, height: 48, ..StreetConfig::static_street() };
    /// let street = Street::new(config).unwrap();
    /// let pose = street.pose_above_road(30.0, 0.0, 1.5, 0.2);
    /// let view = street.seen_from(0, &pose);
    /// // The road is 1.5 m below, and nothing is nearer in the middle of a lane.
    /// assert!((view.clearance_m([0.0; 3], 5.0) - 1.5).abs() < 0.05);
    /// ```
    pub fn pose_above_road(
        &self,
        along_m: f64,
        lateral_m: f64,
        height_m: f64,
        yaw_rad: f64,
    ) -> StreetPose {
        let on_road = self.t_street_local(along_m, lateral_m, yaw_rad);
        let up = Transform::new(Vector3::zeros(), Vector3::new(0.0, -height_m, 0.0));
        StreetPose { along_m, t_street_camera: (on_road * up).normalized() }
    }

    /// The street around a camera at the time of frame `index`.
    pub fn seen_from(&self, index: u32, pose: &StreetPose) -> FlownView<'_> {
        let around =
            self.surroundings_of(self.time_s(index), pose.along_m, |_| pose.t_street_camera);
        FlownView { world: FlownWorld::Street { street: self, around }, index }
    }
}

impl Room {
    /// The room or yard around a camera at the time of frame `index`.
    pub fn seen_from(&self, index: u32, t_room_camera: &Transform) -> FlownView<'_> {
        let scene = self.scene(self.time_s(index), t_room_camera);
        let world = FlownWorld::Room { room: self, scene, t_room_camera: *t_room_camera };
        FlownView { world, index }
    }
}

impl FlownView<'_> {
    /// The pair with its truth. The world of its poses is the street, or the room.
    pub fn frame(&self) -> SynthFrame {
        match &self.world {
            FlownWorld::Street { street, around } => {
                street.frame_of(self.index, around, around.t_street_camera)
            }
            FlownWorld::Room { room, scene, t_room_camera } => {
                room.frame_of(self.index, scene, *t_room_camera)
            }
        }
    }

    fn scene(&self) -> &Scene {
        match &self.world {
            FlownWorld::Street { around, .. } => &around.scene,
            FlownWorld::Room { scene, .. } => scene,
        }
    }

    /// Distance from a point, in the camera's coordinates, m, to the nearest surface, at most
    /// `reach_m`. Time: linear in the triangles of objects within reach.
    pub fn clearance_m(&self, point_m: [f64; 3], reach_m: f64) -> f64 {
        let point = Point::from(point_m);
        let mut least = reach_m;
        for object in &self.scene().objects {
            let mesh = &object.mesh;
            if (object.to_camera.point(mesh.middle_m) - point).norm() - mesh.radius_m > least {
                continue;
            }
            // In the mesh's own frame, so that its corners need not be moved.
            let local = object.to_camera.rotation.tr_mul(&(point - object.to_camera.shift));
            for triangle in &mesh.triangles {
                let corners =
                    triangle.corners.map(|corner| mesh.vertices[corner as usize].position_m);
                least = least.min(distance_m(local, corners));
            }
        }
        least
    }
}

/// Distance of a point from a triangle.
fn distance_m(point: Point, [a, b, c]: [Point; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let squared = normal.norm_squared();
    if squared > 0.0 {
        // Over the triangle's inside the distance is that of its plane.
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(from, to)| (to - from).cross(&(point - from)).dot(&normal) >= 0.0);
        if inside {
            return ((point - a).dot(&normal) / squared.sqrt()).abs();
        }
    }
    [(a, b), (b, c), (c, a)].iter().fold(f64::INFINITY, |least, (from, to)| {
        let along = to - from;
        let length = along.norm_squared();
        let share =
            if length > 0.0 { ((point - from).dot(&along) / length).clamp(0.0, 1.0) } else { 0.0 };
        least.min((point - (from + along * share)).norm())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{RoomConfig, RoomKind, StreetConfig};

    #[test]
    fn a_distance_is_that_of_the_nearest_of_many_points() {
        let corners =
            [Point::new(0.0, 0.0, 0.0), Point::new(2.0, 0.0, 0.5), Point::new(0.3, 1.5, -0.4)];
        for (x, y, z) in [(0.5, 0.4, 2.0), (-1.0, 0.2, 0.3), (3.0, -1.0, 0.0), (1.2, 1.4, -1.0)] {
            let point = Point::new(x, y, z);
            let mut least = f64::INFINITY;
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let (s, t) = (f64::from(i) / 200.0, f64::from(j) / 200.0);
                    let on = corners[0] * (1.0 - s - t) + corners[1] * s + corners[2] * t;
                    least = least.min((point - on).norm());
                }
            }
            assert!((distance_m(point, corners) - least).abs() < 0.01);
        }
    }

    #[test]
    fn a_camera_sees_the_surface_whose_distance_it_is_told() {
        let config = StreetConfig { width: 160, height: 48, ..StreetConfig::static_street() };
        let street = Street::new(config).unwrap();
        let rig = street.rig();
        // Towards the houses on the right.
        let view = street.seen_from(3, &street.pose_above_road(40.0, 0.0, 1.6, 1.2));
        let frame = view.frame();
        for (u, v) in [(20, 12), (80, 20), (140, 30)] {
            let z = f64::from(frame.depth_m[v * 160 + u]);
            let ray = [
                (u as f64 - rig.center_u_px) / rig.focal_px,
                (v as f64 - rig.center_v_px) / rig.focal_px,
                1.0,
            ];
            // A point of the surface is no distance from it, and one before it is some.
            assert!(view.clearance_m(ray.map(|c| c * z), 5.0) < 1e-3);
            assert!(view.clearance_m(ray.map(|c| c * (z - 0.5)), 5.0) <= 0.5 * 1.3);
        }
    }

    #[test]
    fn a_yard_has_its_ground_below_and_the_frame_of_its_own_path() {
        let config = RoomConfig { width: 96, height: 64, ..RoomConfig::default() };
        let yard = Room::new(RoomKind::Yard, config).unwrap();
        let pose = yard.pose_above_floor([0.0, 0.0], 1.5, 0.3);
        let view = yard.seen_from(0, &pose);
        assert!(view.clearance_m([0.0; 3], 5.0) <= 1.5 + 1e-6);
        assert!((view.clearance_m([0.0, 1.4, 0.0], 5.0) - 0.1).abs() < 0.05);
        // A yard's frame of its own path differs in the world of its poses only.
        let own = yard.t_camera0_room.inverse() * yard.t_world_camera(7);
        let (frame, flown) = (yard.frame(7), yard.seen_from(7, &own).frame());
        assert_eq!((frame.left_grey, frame.right_grey), (flown.left_grey, flown.right_grey));
    }

    #[test]
    fn a_camera_on_the_street_s_own_path_sees_the_street_s_own_frame() {
        let config = StreetConfig { width: 160, height: 48, ..StreetConfig::static_street() };
        let street = Street::new(config).unwrap();
        let around = street.surroundings(7);
        let along_m = street.config().speed_m_s * street.time_s(7);
        let pose = StreetPose { along_m, t_street_camera: around.t_street_camera };
        let (frame, flown) = (street.frame(7), street.seen_from(7, &pose).frame());
        assert_eq!((frame.left_grey, frame.depth_m), (flown.left_grey, flown.depth_m));
    }
}
