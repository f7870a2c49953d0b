//! A scene of boards that face the camera: what a detector and the scene flow make of it.

use super::*;
use std::vec::Vec;

/// A rectangle of points that faces the camera.
pub(crate) struct Board {
    pub class: Class,
    pub score: f32,
    /// Half its width and height, m.
    pub half_m: [f64; 2],
    pub points: usize,
    /// Number of points, from the first, that stand still instead, like background under the mask.
    pub background: usize,
}

impl Board {
    pub const CAR: Self =
        Self { class: Class::Car, score: 0.9, half_m: [1.5, 0.75], points: 60, background: 0 };

    /// The matches of the board's points, each before and after a frame's motion.
    fn matches(
        &self,
        t_world_board: [&Transform; 2],
        t_world_camera: [&Transform; 2],
    ) -> Vec<Match> {
        let [before, now] = t_world_board;
        let [camera_before, camera_now] = t_world_camera.map(|pose| pose.inverse());
        let mut random = Random::new(9);
        let [half_x, half_y] = self.half_m;
        let match_of = |n| {
            let mut along = |half: f64| (f64::from(random.below(1001)) / 500.0 - 1.0) * half * 0.9;
            // Not all in one plane.
            let point = Point3::new(along(half_x), along(half_y), along(0.8));
            let after = if n < self.background { before } else { now }.transform_point(point);
            let [previous_left, previous_right] =
                project(&(camera_before * *before).transform_point(point));
            let [current_left, current_right] = project(&camera_now.transform_point(after));
            Match { previous_left, previous_right, current_left, current_right }
        };
        (0..self.points).map(match_of).collect()
    }

    /// Box of the board in the image of a camera.
    fn pixels(&self, t_camera_board: &Transform) -> PixelBox {
        let [half_x, half_y] = self.half_m;
        let corner =
            |x: f64, y: f64| project(&t_camera_board.transform_point(Point3::new(x, y, 0.0)))[0];
        let ([l, t], [r, b]) = (corner(-half_x, -half_y), corner(half_x, half_y));
        PixelBox { left: l as i32, top: t as i32, width: (r - l) as i32, height: (b - t) as i32 }
    }
}

pub(crate) fn shift(x: f64, y: f64, z: f64) -> Transform {
    Transform::new(Vector3::zeros(), Vector3::new(x, y, z))
}

/// Camera and car in a frame: 10 m ahead, it does 8 m/s to the camera's 5.
pub(crate) fn ahead(frame: u32) -> [Transform; 2] {
    let t = f64::from(frame) * 0.1;
    [shift(0.0, 0.0, 5.0 * t), shift(1.0, 0.3, 10.0 + 8.0 * t)]
}

/// Camera and car in a frame: it is parked, and the camera drives towards it.
pub(crate) fn parked(frame: u32) -> [Transform; 2] {
    [shift(0.0, 0.0, 0.3 * f64::from(frame)), shift(1.0, 0.3, 14.0)]
}

/// Projects a point into the left and the right image.
pub(crate) fn project(p: &Point3<f64>) -> [[f32; 2]; 2] {
    let per_m = RIG.focal_px / p.z;
    let (u, v) = (p.x * per_m + RIG.center_u_px, p.y * per_m + RIG.center_v_px);
    [[u as f32, v as f32], [(u - RIG.focal_px * RIG.baseline_m / p.z) as f32, v as f32]]
}

/// A camera that passes boards.
#[derive(Default)]
pub(crate) struct Scene {
    frame: u32,
    t_world_camera: Transform,
    /// Poses of the boards in the frame before.
    before: Vec<Option<Transform>>,
}

/// Images and matches of a frame.
pub(crate) struct Shot {
    /// Number of the frame.
    pub frame: u32,
    pub camera: CameraMotion,
    pub disparity_q8: Vec<u16>,
    refined: Vec<Match>,
    seen: Vec<(Class, f32, PixelBox, Vec<u8>)>,
}

impl Shot {
    pub fn matches(&self) -> FrameMatches<'_> {
        FrameMatches { refined: &self.refined, sparse: &[] }
    }

    pub fn detections(&self) -> Vec<Detection<'_>> {
        let detected = self.seen.iter();
        detected
            .map(|(class, score, pixels, mask)| detection(*class, *score, pixels, mask))
            .collect()
    }
}

impl Scene {
    /// Takes a frame: the camera's pose, and that of each board (`None`: not in view). The detector
    /// reports those that are `seen`; the others come in front of them.
    pub fn shoot(
        &mut self,
        t_world_camera: Transform,
        seen: &[(&Board, Option<Transform>)],
        unseen: &[(&Board, Option<Transform>)],
    ) -> Shot {
        let boards: Vec<_> = seen.iter().chain(unseen).copied().collect();
        let t_current_previous = t_world_camera.inverse() * self.t_world_camera;
        let mut shot = Shot {
            frame: self.frame,
            camera: CameraMotion {
                t_world_camera,
                t_current_previous: (self.frame > 0).then_some(t_current_previous),
            },
            disparity_q8: vec![0; WIDTH * HEIGHT],
            refined: Vec::new(),
            seen: Vec::new(),
        };
        self.before.resize(boards.len(), None);
        for (index, ((board, now), before)) in boards.iter().zip(&self.before).enumerate() {
            let Some(now) = now else { continue };
            let t_camera_board = t_world_camera.inverse() * now;
            let pixels = board.pixels(&t_camera_board);
            shot.paint(&pixels, t_camera_board.translation().z);
            if index < seen.len() {
                let mask = vec![1; pixels.area() as usize];
                shot.seen.push((board.class, board.score, pixels, mask));
            }
            let Some(before) = before else { continue };
            let cameras = [&self.t_world_camera, &t_world_camera];
            shot.refined.extend(board.matches([before, now], cameras));
        }
        self.frame += 1;
        self.t_world_camera = t_world_camera;
        self.before = boards.iter().map(|(_, now)| *now).collect();
        shot
    }
}

impl Shot {
    /// Gives the pixels of a box a depth.
    fn paint(&mut self, pixels: &PixelBox, depth_m: f64) {
        let image = PixelBox { left: 0, top: 0, width: WIDTH as i32, height: HEIGHT as i32 };
        let PixelBox { left, top, width, height } = pixels.intersection(&image);
        for (u, v) in (top..top + height).flat_map(|v| (left..left + width).map(move |u| (u, v))) {
            self.disparity_q8[v as usize * WIDTH + u as usize] =
                (RIG.focal_px * RIG.baseline_m / depth_m * 256.0) as u16;
        }
    }
}
