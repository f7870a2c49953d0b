//! A map made of exact depth and poses passes the evaluation; one that is off by a known disparity
//! loses what it must.
#![allow(missing_docs)]

use dynvox::evaluate::reference::{
    EvaluatedFrame, Field, PendingFrame, ProjectedScan, ReferenceFigures, Region, Rule,
    project_scan, sample_exact_depth,
};
use dynvox::formats::Image;
use dynvox::input::LidarScan;
use dynvox::synth::{Street, StreetConfig, SynthFrame};
use dynvox_core::image::{DISPARITY_ONE_PX, View};
use dynvox_core::{Capacity, Config, Mapper, Serial, StereoFrame};
use dynvox_tests::HeapSlab;

const FRAMES: u32 = 6;

fn street() -> Street {
    Street::new(StreetConfig {
        width: 640,
        height: 192,
        frames: FRAMES,
        ..StreetConfig::static_street()
    })
    .unwrap()
}

fn field(config: &Config) -> Field {
    Field {
        width: 640,
        height: 192,
        near_m: config.volume.near_m.into(),
        far_m: config.volume.far_m.into(),
    }
}

/// The exact disparity in 1/256 px.
fn disparity_q8(street: &Street, frame: &SynthFrame) -> Vec<u16> {
    let scale = street.rig().focal_baseline_px_m() * f64::from(DISPARITY_ONE_PX);
    frame
        .depth_m
        .iter()
        .map(|&depth_m| if depth_m > 0.0 { (scale / f64::from(depth_m)).round() as u16 } else { 0 })
        .collect()
}

fn scan(street: &Street, index: u32) -> LidarScan {
    let t_camera_lidar = street.t_camera_lidar();
    let point = |&[x, y, z, _]: &[f32; 4]| t_camera_lidar.transform_point([x, y, z].map(f64::from));
    LidarScan::of_rig(street.lidar(index).iter().map(point).collect(), &street.rig())
}

/// All defaults, but that exact disparities have no rims.
fn exact_config(street: &Street) -> Config {
    let mut config = Config::for_rig(street.rig());
    config.volume.edge_reach_px = 0;
    config
}

#[test]
fn a_perfect_map_is_right_and_complete_and_a_shifted_one_is_not() {
    let street = street();
    // Nothing is masked: parked cars are street.
    let config = exact_config(&street);
    let capacity = Capacity::DESKTOP;
    let mut slab = HeapSlab::of(&capacity);
    let mut mapper = Mapper::new(&capacity, &config, slab.bytes()).unwrap();
    let (mut by_scan, mut by_pixel, mut shifted) = (Vec::new(), Vec::new(), Vec::new());
    let (mut near, mut compared) = (0u32, 0u32);
    for index in 0..FRAMES {
        let frame = street.frame(index);
        let exact_q8 = disparity_q8(&street, &frame);
        let view = |pixels| View::new(pixels, 640, 192).unwrap();
        let stereo = StereoFrame {
            disparity_q8: View::new(&exact_q8, 640, 192),
            t_world_camera: Some(frame.t_world_camera),
            ..StereoFrame::pair(view(&frame.left_grey), view(&frame.right_grey))
        };
        mapper.step(&stereo, &Serial).unwrap();
        // The sensor sees its points by the true depth; each compared with map and input.
        let bf = street.rig().focal_baseline_px_m();
        let exact = Image::new(640, 192, frame.depth_m.clone()).unwrap();
        let mut scans = [
            project_scan(&scan(&street, index), &field(&config)),
            sample_exact_depth(&exact, &street.rig(), &field(&config)),
        ];
        // The sensor stands above and behind the camera and sees past edges: what it sees there is
        // hidden from the camera, and no map can show it.
        let all = scans[0].points.len();
        let bare = |u: u16, v: u16| {
            f32::from(exact_q8[usize::from(v) * 640 + usize::from(u)]) / f32::from(DISPARITY_ONE_PX)
        };
        scans[0]
            .points
            .retain(|point| !Rule::KITTI.is_error(bare(point.u, point.v), point.disparity_px));
        assert!(
            scans[0].points.len() as f64 > 0.97 * all as f64,
            "{} of {all}",
            scans[0].points.len()
        );
        let map = mapper.raycast(&frame.t_world_camera, &Serial).unwrap().depth_m().unwrap();
        let input =
            |u: usize, v: usize| f32::from(exact_q8[v * 640 + u]) / f32::from(DISPARITY_ONE_PX);
        let evaluate = |scanned: &ProjectedScan, map: &View<'_, f32>| -> EvaluatedFrame {
            let view = (&frame.t_world_camera).into();
            PendingFrame::new(index as usize, view, scanned, input, |_, _| Region::Static)
                .compare(map, bf, 1.0)
                .0
        };
        by_scan.push(evaluate(&scans[0], &map));
        by_pixel.push(evaluate(&scans[1], &map));
        // A map whose every surface is 4 px off: wrong wherever 4 px are more than 5 %.
        let off: Vec<f32> =
            frame
                .depth_m
                .iter()
                .map(|&depth_m| {
                    if depth_m > 0.0 { (bf / (bf / f64::from(depth_m) + 4.0)) as f32 } else { 0.0 }
                })
                .collect();
        let off = evaluate(&scans[1], &view_f32(&off));
        let large = scans[1]
            .points
            .iter()
            .filter(|point| 4.0 <= Rule::KITTI.share * point.disparity_px)
            .count() as u32;
        assert_eq!(
            off.regions[0].sources[1].errors[0],
            off.regions[0].total - large,
            "frame {index}"
        );
        (near, compared) = (near + large, compared + off.regions[0].total);
        shifted.push(off);
    }
    // With only one kind of point the shifted map would be all right or all wrong.
    assert!(near > 0 && near < compared, "the scene must have both: {near} of {compared}");
    for (name, frames) in [("scan", &by_scan), ("pixels", &by_pixel)] {
        let fused = ReferenceFigures::from_frames("exact", 0, frames, None).unwrap().still.fused;
        assert!(fused.points > 10_000);
        assert!(
            fused.accuracy.unwrap() > 0.99 && fused.completeness.unwrap() > 0.99,
            "{name}: {fused:?}"
        );
    }
    // A shifted map is complete, and wrong where the shift is too large for the rule.
    let fused = ReferenceFigures::from_frames("exact", 0, &shifted, None).unwrap().still.fused;
    assert_eq!(fused.completeness, Some(1.0));
    let kept = shifted.iter().map(|frame| frame.regions[0].accuracy(1, 0).unwrap()).sum::<f64>()
        / f64::from(FRAMES);
    assert!((fused.accuracy.unwrap() - kept).abs() < 1e-12 && kept < 0.5, "{kept}");
}

fn view_f32(pixels: &[f32]) -> View<'_, f32> {
    View::new(pixels, 640, 192).unwrap()
}
