//! Which way the axes of a mesh point.

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The axes of a mesh file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Axes {
    /// The first camera's: x right, y down, z forward.
    #[default]
    Camera,
    /// z up, as maps and robots have it: x right (east), y forward (north), z up. Up is the first
    /// camera's own, unless an inertial unit tells the true one.
    Enu,
}

impl Axes {
    /// Both.
    pub(super) const ALL: [Self; 2] = [Self::Camera, Self::Enu];

    /// Returns the header's description of the axes.
    pub(super) const fn description(self) -> &'static str {
        match self {
            Self::Camera => "x right, y down, z forward",
            Self::Enu => "x right, y forward, z up",
        }
    }

    /// A point or direction in the camera's axes, in these.
    pub(super) fn of_camera(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Camera => [x, y, z],
            Self::Enu => [x, z, -y],
        }
    }

    /// A point or direction in these axes, in the camera's.
    pub(super) fn to_camera(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Camera => [x, y, z],
            Self::Enu => [x, -z, y],
        }
    }
}

/// Axes of a mesh file, turned so that they stand upright where the first camera leans.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshAxes {
    axes: Axes,
    /// Rows of the rotation that puts the world of the first camera upright.
    upright: Option<[[f32; 3]; 3]>,
}

impl From<Axes> for MeshAxes {
    fn from(axes: Axes) -> Self {
        Self { axes, upright: None }
    }
}

impl MeshAxes {
    /// Beginning of the header's line with the rotation.
    const UPRIGHT: &str = "upright:";

    /// Axes with z up where `up` points, a unit vector in the first camera's axes; those of the
    /// camera stay as they are.
    pub fn upright(axes: Axes, up: [f32; 3]) -> Self {
        let up = Vector3::from(up.map(f64::from));
        // The smallest turn that leads up to where the camera has it.
        let own = Vector3::new(0.0, -1.0, 0.0);
        let (axis, cosine) = (up.cross(&own), up.dot(&own));
        let angle = axis.norm().atan2(cosine);
        // Without a turn the header stays as readers of older files know it.
        let is_turned = axes == Axes::Enu && axis.norm() > 1e-9 && angle.is_finite();
        let turn = || Transform::new(axis * (angle / axis.norm()), [0.0; 3]).matrix_3x4();
        let rows = || turn().map(|[x, y, z, _]| [x, y, z].map(|part| part as f32));
        Self { axes, upright: is_turned.then(rows) }
    }

    /// Lines of the header after its first, each with its end.
    pub(super) fn comments(&self, frame: &str) -> String {
        let mut lines = format!("comment metres; {} of {frame}\n", self.axes.description());
        if let Some(rows) = self.upright {
            let numbers = rows.as_flattened().iter().map(|number| format!(" {number}"));
            lines += &format!("comment {}{}\n", Self::UPRIGHT, numbers.collect::<String>());
        }
        lines
    }

    /// Takes in a comment of the header.
    pub(super) fn read(&mut self, line: &str) {
        if let Some(axes) = Axes::ALL.into_iter().find(|axes| line.contains(axes.description())) {
            self.axes = axes;
        }
        if let Some((_, numbers)) = line.split_once(Self::UPRIGHT) {
            let numbers: Vec<f32> =
                numbers.split_whitespace().filter_map(|number| number.parse().ok()).collect();
            let rows: Option<[[f32; 3]; 3]> = <[f32; 9]>::try_from(numbers)
                .ok()
                .map(|[a, b, c, d, e, f, g, h, i]| [[a, b, c], [d, e, f], [g, h, i]]);
            self.upright = rows.filter(|rows| rows.as_flattened().iter().all(|n| n.is_finite()));
        }
    }

    /// A point or direction in the camera's axes, in these.
    pub(super) fn of_camera(&self, point: [f32; 3]) -> [f32; 3] {
        let dot = |row: [f32; 3]| row[0] * point[0] + row[1] * point[1] + row[2] * point[2];
        self.axes.of_camera(self.upright.map_or(point, |rows| rows.map(dot)))
    }

    /// A point or direction in these axes, in the camera's.
    pub(super) fn to_camera(self, point: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.axes.to_camera(point);
        let back = |at: usize, [a, b, c]: [[f32; 3]; 3]| a[at] * x + b[at] * y + c[at] * z;
        self.upright.map_or([x, y, z], |rows| [0, 1, 2].map(|at| back(at, rows)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaning_first_camera_gives_an_upright_mesh_and_is_read_back() {
        // The camera looks down by 20 degrees, and leans by 5 to the side.
        let t_level_camera = Transform::new(Vector3::new(-0.35, 0.0, 0.09), [0.0; 3]);
        let up: [f64; 3] = t_level_camera.inverse().rotate([0.0, -1.0, 0.0]);
        let axes = MeshAxes::upright(Axes::Enu, up.map(|part| part as f32));
        // A pole of two metres stands along z, and what is right stays right.
        let [x, y, z] = axes.of_camera(up.map(|part| 2.0 * part as f32));
        assert!(x.abs() < 1e-5 && y.abs() < 1e-5 && (z - 2.0).abs() < 1e-5, "{x} {y} {z}");
        assert!(axes.of_camera([1.0, 0.0, 0.0])[0] > 0.98);
        let mut read = MeshAxes::default();
        axes.comments("the first camera").lines().for_each(|line| read.read(line));
        assert_eq!(read, axes);
        let point = [3.0, -1.0, 7.0];
        for (there, back) in point.iter().zip(read.to_camera(axes.of_camera(point))) {
            assert!((there - back).abs() < 1e-5, "{back}");
        }
        // The camera's axes are what they are, and an upright camera needs no turn.
        assert_eq!(MeshAxes::upright(Axes::Camera, [0.6, -0.8, 0.0]), Axes::Camera.into());
        assert_eq!(MeshAxes::upright(Axes::Enu, [0.0, -1.0, 0.0]), Axes::Enu.into());
        let mut damaged = MeshAxes::default();
        damaged.read("comment upright: 1 0 0 nan");
        assert_eq!(damaged, MeshAxes::default());
    }
}
