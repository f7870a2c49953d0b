//! The four sides of a room, and meshes that stand along them.

use std::sync::Arc;

use dynvox_core::geometry::Transform;

use super::extent::Extent;
use crate::synth::mesh::Mesh;

const QUARTER_RAD: f64 = 0.5 * core::f64::consts::PI;

/// A side of a room: x runs along it to the right of somebody who looks away from it, z out of it
/// into the room; the origin is the middle of its foot.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Length, m.
    pub length_m: f64,
    yaw_rad: f64,
    middle_m: [f64; 2],
}

impl Side {
    /// All sides of an extent.
    pub fn all(extent: &Extent) -> [Self; 4] {
        let [x, z] = extent.half_m;
        let side = |quarters: f64, half: f64, middle_m: [f64; 2]| Self {
            length_m: 2.0 * half,
            yaw_rad: quarters * QUARTER_RAD,
            middle_m,
        };
        [
            side(2.0, x, [0.0, z]),
            side(-1.0, z, [x, 0.0]),
            side(0.0, x, [0.0, -z]),
            side(1.0, z, [-x, 0.0]),
        ]
    }

    /// The frame `along_m` to the right of the middle and `out_m` into the room.
    pub fn t_room_side(&self, along_m: f64, out_m: f64) -> Transform {
        let [x, z] = self.middle_m;
        let foot = Transform::new([0.0, self.yaw_rad, 0.0], [x, 0.0, z]);
        (foot * Transform::new([0.0; 3], [along_m, 0.0, out_m])).normalized()
    }
}

/// Meshes that stay.
#[derive(Default)]
pub struct Standing {
    /// Meshes in the room's frame.
    pub meshes: Vec<Arc<Mesh>>,
}

impl Standing {
    /// Adds a mesh that is built around a frame of the room.
    pub fn add(&mut self, mut mesh: Mesh, t_room_mesh: &Transform) {
        mesh.move_by(0, t_room_mesh);
        self.meshes.push(Arc::new(mesh.finish()));
    }
}
