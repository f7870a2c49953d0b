//! Scenes with known distances, and maps of them.

use super::VOXEL_M;
use crate::{
    random::Random,
    volume::{
        Volume, VolumeConfig,
        tests::analytic::{LatticeSample, cuboid, empty, fill},
    },
};
use nalgebra::{Point3, Vector3};
use std::vec::Vec;

/// Something a ray can meet: the depth along its z at which a camera sees it through a direction
/// (x, y, 1) in world axes.
pub(super) trait Scene {
    fn depth(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64>;
    /// Distance in m, positive in free space.
    fn distance(&self, point: Point3<f64>) -> f64;
    fn normal(&self, point: Point3<f64>) -> Vector3<f64>;
}

pub(super) struct Plane {
    normal: Vector3<f64>,
    offset: f64,
}

impl Plane {
    /// Free space lies on the side to which `normal` points; the plane passes through `through`.
    pub fn new(normal: [f64; 3], through: [f64; 3]) -> Self {
        let normal = Vector3::from(normal).normalize();
        Self { normal, offset: normal.dot(&Vector3::from(through)) }
    }
}

impl Scene for Plane {
    fn depth(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
        let towards = -self.normal.dot(&direction);
        (towards > 1e-9).then(|| self.distance(origin) / towards).filter(|&depth| depth > 0.0)
    }
    fn distance(&self, point: Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) - self.offset
    }
    fn normal(&self, _: Point3<f64>) -> Vector3<f64> {
        self.normal
    }
}

pub(super) struct Ball {
    pub center: Vector3<f64>,
    pub radius: f64,
}

impl Scene for Ball {
    fn depth(&self, origin: Point3<f64>, direction: Vector3<f64>) -> Option<f64> {
        let from = origin.coords - self.center;
        let (a, b, c) = (
            direction.dot(&direction),
            from.dot(&direction),
            from.dot(&from) - self.radius * self.radius,
        );
        let root = b * b - a * c;
        (root > 0.0).then(|| (-b - root.sqrt()) / a)
    }
    fn distance(&self, point: Point3<f64>) -> f64 {
        (point.coords - self.center).norm() - self.radius
    }
    fn normal(&self, point: Point3<f64>) -> Vector3<f64> {
        (point.coords - self.center).normalize()
    }
}

pub(super) fn lattice_point(point: [i32; 3]) -> Point3<f64> {
    Point3::from(point.map(|c| f64::from(c) * f64::from(VOXEL_M)))
}

/// Distances as they are.
pub(super) fn true_distances(scene: &impl Scene) -> impl Fn([i32; 3]) -> LatticeSample {
    |point| {
        Some((scene.distance(lattice_point(point)) as f32, 3, [10, 20, 30]))
            .filter(|(distance, ..)| distance.abs() < 0.75)
    }
}

/// Distances as a camera at the origin measures them, along its z.
pub(super) fn seen_from_origin(scene: &impl Scene) -> impl Fn([i32; 3]) -> LatticeSample {
    |point| {
        let point = lattice_point(point);
        if point.z <= 0.1 {
            return None;
        }
        let depth = scene.depth(Point3::origin(), point.coords / point.z)?;
        let distance = depth - point.z;
        (distance >= -0.75).then_some((
            if distance < 0.75 { distance } else { 0.75 } as f32,
            3,
            [10, 20, 30],
        ))
    }
}

pub(super) fn filled(
    low: [i32; 3],
    high: [i32; 3],
    sample_at: impl Fn([i32; 3]) -> LatticeSample,
) -> Volume<'static> {
    let mut volume = empty(&VolumeConfig::default(), cuboid(low, high).count());
    fill(&mut volume, cuboid(low, high), sample_at);
    volume
}

/// A rough scene: a slanted plane and a ball, distances disturbed, some points unseen, some blocks
/// missing, weights and colours at random.
pub(super) fn rough(seed: u64) -> Volume<'static> {
    let plane = Plane::new([0.3, -0.4, -0.8], [0.0, 0.0, 3.2]);
    let ball = Ball { center: Vector3::new(-0.3, 0.1, 2.0), radius: 0.5 };
    let mut random = Random::new(seed);
    // One block in twenty is missing.
    let coords: Vec<_> = cuboid([-8, -6, 0], [8, 6, 12]).filter(|_| random.below(20) > 0).collect();
    let mut volume = empty(&VolumeConfig::default(), coords.len());
    fill(&mut volume, coords, |point| {
        // A point's values depend on the point alone, so that blocks agree on their borders.
        let mut random = Random::new(
            point.iter().fold(seed, |seed, &c| seed.wrapping_mul(8_191).wrapping_add(c as u64)),
        );
        let at = lattice_point(point);
        let distance = if plane.distance(at) < ball.distance(at) {
            plane.distance(at)
        } else {
            ball.distance(at)
        } as f32;
        // Off by up to 5 cm, a voxel.
        let distance = distance + random.below(1_000) as f32 * 1e-4 - 0.05;
        let colour = [(); 3].map(|()| random.below(256) as u8);
        let is_observed = distance.abs() < 0.75 && random.below(100) < 93;
        is_observed.then_some((
            distance,
            1 + random.below(4) as u8,
            if random.below(4) == 0 { [0; 3] } else { colour },
        ))
    });
    volume
}
