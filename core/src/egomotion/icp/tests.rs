//! A scene of planes, rendered from two poses with a known motion between them.

mod parts;

use super::*;
use crate::{
    geometry::Transform,
    image::{DISPARITY_ONE_PX, ViewMut},
    settings::Problems,
};
use std::{vec, vec::Vec};

const WIDTH: usize = 640;
const HEIGHT: usize = 192;
const RIG: StereoRig =
    StereoRig { focal_px: 360.0, center_u_px: 319.5, center_v_px: 95.5, baseline_m: 0.5 };
const LIMITS_M: [f32; 2] = [0.5, 20.0];

/// A plane: normal towards the camera, and where it cuts the axis along it.
type Plane = ([f64; 3], f64);
/// Floor, both walls, and a wall ahead.
const SCENE: [Plane; 4] = [
    ([0.0, -1.0, 0.0], 1.5),
    ([1.0, 0.0, 0.0], 3.0),
    ([-1.0, 0.0, 0.0], 4.0),
    ([0.0, 0.0, -1.0], 9.0),
];

/// Image of the planes from a camera.
struct Picture {
    depth_m: Vec<f32>,
    normal: Vec<[i8; 3]>,
    disparity_q8: Vec<u16>,
}

fn render(planes: &[Plane], t_world_camera: &Transform) -> Picture {
    let mut picture = Picture {
        depth_m: vec![0.0; WIDTH * HEIGHT],
        normal: vec![[0; 3]; WIDTH * HEIGHT],
        disparity_q8: vec![0; WIDTH * HEIGHT],
    };
    for at in 0..WIDTH * HEIGHT {
        let (u, v) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
        let ray = Vector3::new(
            (u - RIG.center_u_px) / RIG.focal_px,
            (v - RIG.center_v_px) / RIG.focal_px,
            1.0,
        );
        let (origin, direction) = (t_world_camera.translation(), t_world_camera.rotate(ray));
        // Each plane's depth along the ray; the nearest one in front is seen.
        let hits = planes.iter().filter_map(|(normal, away_m)| {
            let normal = Vector3::from(*normal);
            let depth = -(normal.dot(&origin) + away_m) / normal.dot(&direction);
            (depth > 0.1 && depth < f64::from(LIMITS_M[1]))
                .then_some((depth, t_world_camera.inverse().rotate(normal)))
        });
        if let Some((depth, normal)) = hits.min_by(|a, b| a.0.total_cmp(&b.0)) {
            picture.depth_m[at] = depth as f32;
            picture.normal[at] = [0, 1, 2].map(|axis| libm::round(127.0 * normal[axis]) as i8);
            picture.disparity_q8[at] =
                libm::round(RIG.focal_baseline_px_m() / depth * f64::from(DISPARITY_ONE_PX)) as u16;
        }
    }
    picture
}

fn measured(disparity_q8: &[u16]) -> MeasuredDepth<'_> {
    let disparity_q8 = View::new(disparity_q8, WIDTH, HEIGHT).unwrap();
    MeasuredDepth { rig: &RIG, limits_m: LIMITS_M, disparity_q8 }
}

/// Tracks the way from the origin to `motion`, which is where the camera is then.
fn tracked(config: &IcpConfig, planes: &[Plane], motion: &Transform) -> IcpReport {
    let (before, now) = (render(planes, &Transform::IDENTITY), render(planes, motion));
    let map = MapPicture {
        depth_m: View::new(&before.depth_m, WIDTH, HEIGHT).unwrap(),
        normal: View::new(&before.normal, WIDTH, HEIGHT).unwrap(),
        every: 1,
    };
    let mut memory = vec![7.0; WIDTH * HEIGHT];
    track(config, &measured(&now.disparity_q8), &map, &mut memory)
}

#[test]
fn a_picture_of_every_second_pixel_leads_to_the_same_motion() {
    let motion = walk([0.0, 0.01, 0.0], [0.05, 0.0, 0.2]);
    let (before, now) = (render(&SCENE, &Transform::IDENTITY), render(&SCENE, &motion));
    let [width, height] = [WIDTH / 2, HEIGHT / 2];
    let kept = |at: usize| (2 * (at / width)) * WIDTH + 2 * (at % width);
    let depth_m: Vec<f32> = (0..width * height).map(|at| before.depth_m[kept(at)]).collect();
    let normal: Vec<_> = (0..width * height).map(|at| before.normal[kept(at)]).collect();
    let map = MapPicture {
        depth_m: View::new(&depth_m, width, height).unwrap(),
        normal: View::new(&normal, width, height).unwrap(),
        every: 2,
    };
    let mut memory = vec![7.0; WIDTH * HEIGHT];
    let config = IcpConfig::default();
    let report = track(&config, &measured(&now.disparity_q8), &map, &mut memory);
    assert_eq!(report.status, IcpStatus::Tracked);
    let off_m = (report.t_current_previous.inverse() * motion.inverse()).distance_m();
    assert!(off_m < 0.02, "{off_m} m");
    let whole = tracked(&config, &SCENE, &motion);
    assert!(4 * report.points <= whole.points + whole.points / 8, "a quarter of the points");
}

fn walk(turn: [f64; 3], way_m: [f64; 3]) -> Transform {
    Transform::new(Vector3::from(turn), Vector3::from(way_m))
}

#[test]
fn small_motions_are_found() {
    // No motion, one along the view, and one along all axes.
    for (turn, way_m) in [
        ([0.0; 3], [0.0; 3]),
        ([0.0, 0.01, 0.0], [0.02, 0.0, 0.08]),
        ([0.004, -0.012, 0.003], [-0.05, 0.02, 0.05]),
    ] {
        let motion = walk(turn, way_m);
        let report = tracked(&IcpConfig::default(), &SCENE, &motion);
        assert_eq!(report.status, IcpStatus::Tracked, "{report:?}");
        // The product of a motion and its inverse is what the estimate is off.
        let error = report.t_current_previous * motion;
        assert!(error.distance_m() < 0.005 && error.angle_rad() < 0.001, "{way_m:?}: {error:?}");
        assert!(
            report.pairs > 3_000 && report.residual_rms_m < 0.02 && report.eigen_share > 0.001,
            "{report:?}"
        );
    }
}

#[test]
fn large_motions_are_no_estimates() {
    let turned = tracked(&IcpConfig::default(), &SCENE, &walk([0.0, 0.6, 0.0], [0.0; 3]));
    assert!(turned.status != IcpStatus::Tracked && turned.motion().is_none(), "{turned:?}");
    let config = IcpConfig { step_max_m: 0.05, ..IcpConfig::default() };
    assert_eq!(
        tracked(&config, &SCENE, &walk([0.0; 3], [0.0, 0.0, 0.08])).status,
        IcpStatus::TooFar
    );
}

#[test]
fn a_road_alone_holds_no_way_along_it_and_nothing_holds_none() {
    let road = tracked(&IcpConfig::default(), &SCENE[..1], &walk([0.0; 3], [0.0, 0.0, 0.08]));
    assert_eq!(road.status, IcpStatus::Degenerate, "{road:?}");
    let canyon = tracked(&IcpConfig::default(), &SCENE[..3], &walk([0.0; 3], [0.0, 0.0, 0.5]));
    assert_eq!(
        canyon.status,
        IcpStatus::Degenerate,
        "walls to both sides hold no more: {canyon:?}"
    );
    let empty = tracked(&IcpConfig::default(), &[], &Transform::IDENTITY);
    assert_eq!((empty.status, empty.points), (IcpStatus::TooFewPairs, 0));
}

#[test]
fn depth_off_the_map_is_no_estimate() {
    // The same scene, with a wall far nearer over two thirds of the picture than the map knows.
    let (before, mut now) =
        (render(&SCENE, &Transform::IDENTITY), render(&SCENE, &Transform::IDENTITY));
    let mut image = ViewMut::new(&mut now.disparity_q8, WIDTH, HEIGHT).unwrap();
    for row in image.pixels_mut().chunks_mut(WIDTH) {
        row[..2 * WIDTH / 3].fill((RIG.focal_baseline_px_m() / 0.8 * 256.0) as u16);
    }
    let map = MapPicture {
        depth_m: View::new(&before.depth_m, WIDTH, HEIGHT).unwrap(),
        normal: View::new(&before.normal, WIDTH, HEIGHT).unwrap(),
        every: 1,
    };
    let mut memory = vec![0.0; WIDTH * HEIGHT / 3];
    let report = track(
        &IcpConfig { pairs_min: 0.5, ..IcpConfig::default() },
        &measured(&now.disparity_q8),
        &map,
        &mut memory,
    );
    assert_eq!(report.status, IcpStatus::OffTheMap, "{report:?}");
}

#[test]
fn matches_can_contradict_the_motion() {
    let mut report = IcpReport { matches: [49, 100], ..IcpReport::default() };
    report.check_matches();
    assert_eq!(report.status, IcpStatus::Contradicted);
    for matches in [[50, 100], [0, 0]] {
        let mut report = IcpReport { matches, ..IcpReport::default() };
        report.check_matches();
        assert_eq!(report.status, IcpStatus::Tracked);
    }
}

#[test]
fn settings_out_of_range_are_named_and_their_bounds_are_taken() {
    let problems = |change: fn(&mut IcpConfig, f32), value: f32| {
        let (mut problems, mut config) = (Problems::new(), IcpConfig::default());
        change(&mut config, value);
        config.validate(&mut problems);
        problems.iter().map(|problem| problem.key).collect::<Vec<_>>()
    };
    type Setting = (&'static str, fn(&mut IcpConfig, f32), &'static [f32], &'static [f32]);
    const SHARE: (&[f32], &[f32]) = (&[0.0, 1.0], &[-0.01, 1.01, f32::NAN]);
    const ABOVE_0: (&[f32], &[f32]) = (&[1e-9, 1e9], &[0.0, -1.0, f32::NAN, f32::INFINITY]);
    let settings: [Setting; 6] = [
        ("icp.levels", |config, value| config.levels = value as u8, &[1.0, 4.0], &[0.0, 5.0]),
        ("icp.steps", |config, value| config.steps = value as u8, &[1.0, 50.0], &[0.0, 51.0]),
        ("icp.distance_m", |config, value| config.distance_m = value, ABOVE_0.0, ABOVE_0.1),
        (
            "icp.noise_px",
            |config, value| config.noise_px = value,
            &[0.0, 9.0],
            &[-0.01, f32::NAN, f32::INFINITY],
        ),
        ("icp.pairs_min", |config, value| config.pairs_min = value, SHARE.0, SHARE.1),
        ("icp.step_max_m", |config, value| config.step_max_m = value, ABOVE_0.0, ABOVE_0.1),
    ];
    for (key, change, good, bad) in settings {
        good.iter()
            .for_each(|&value| assert!(problems(change, value).is_empty(), "{key} = {value}"));
        bad.iter().for_each(|&value| assert_eq!(problems(change, value), [key], "{key} = {value}"));
    }
}
