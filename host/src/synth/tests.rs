//! Promises of the street.

use std::path::PathBuf;

use dynvox_core::geometry::Transform;
use nalgebra::{Point3, Vector3};

use super::*;

fn quiet(width: u32, height: u32) -> StreetConfig {
    StreetConfig {
        width,
        height,
        noise_sigma: 0.0,
        gain_difference: 0.0,
        ..StreetConfig::default()
    }
}

/// The point a pixel's centre sees, in the camera.
fn seen(street: &Street, frame: &SynthFrame, u: usize, v: usize) -> Option<Point3<f64>> {
    let rig = street.rig();
    let depth = f64::from(frame.depth_m[v * frame.width + u]);
    let (x, y) =
        ((u as f64 - rig.center_u_px) / rig.focal_px, (v as f64 - rig.center_v_px) / rig.focal_px);
    (depth > 0.0).then(|| Point3::new(x * depth, y * depth, depth))
}

/// Projects a point of a camera into its image, px.
fn projected(street: &Street, point: &Point3<f64>) -> (f64, f64) {
    let rig = street.rig();
    (
        rig.focal_px * point.x / point.z + rig.center_u_px,
        rig.focal_px * point.y / point.z + rig.center_v_px,
    )
}

/// Bilinear grey level, if the four pixels around are in the picture.
fn grey_at(picture: &[u8], size: (usize, usize), at: (f64, f64)) -> Option<f64> {
    let ((width, height), (u, v)) = (size, at);
    if !(u >= 0.0 && v >= 0.0 && u < width as f64 - 1.0 && v < height as f64 - 1.0) {
        return None;
    }
    let (x, y) = (u as usize, v as usize);
    let (fx, fy) = (u - x as f64, v - y as f64);
    let at = |x: usize, y: usize| f64::from(picture[y * width + x]);
    Some(
        (at(x, y) * (1.0 - fx) + at(x + 1, y) * fx) * (1.0 - fy)
            + (at(x, y + 1) * (1.0 - fx) + at(x + 1, y + 1) * fx) * fy,
    )
}

/// Returns true if depth around a pixel changes little: no edge, so no occlusion and no mixed
/// pixel.
fn flat(frame: &SynthFrame, u: usize, v: usize) -> bool {
    let at = |u: usize, v: usize| frame.depth_m[v * frame.width + u];
    let here = at(u, v);
    (u.wrapping_sub(2)..=u + 2).all(|x| x < frame.width && (at(x, v) - here).abs() < 0.05 * here)
        && (v.wrapping_sub(1)..=v + 1)
            .all(|y| y < frame.height && (at(u, y) - here).abs() < 0.2 * here)
}

fn median(mut values: Vec<f64>) -> f64 {
    assert!(values.len() > 1000, "too few values: {}", values.len());
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn a_pixel_carried_to_the_right_image_by_its_depth_finds_its_own_grey() {
    let street = Street::new(quiet(640, 192)).unwrap();
    let frame = street.frame(7);
    let size = (frame.width, frame.height);
    let difference = |shift_px: f64| {
        let mut differences = Vec::new();
        // Every third pixel: neighbours say the same.
        for v in (2..frame.height - 2).step_by(3) {
            for u in (2..frame.width - 2).step_by(3) {
                let Some(point) = seen(&street, &frame, u, v) else { continue };
                // Where the surface is flat, so that interpolation is right.
                if !flat(&frame, u, v) {
                    continue;
                }
                let (x, y) = projected(&street, &(point - Vector3::x() * street.rig().baseline_m));
                if let Some(grey) = grey_at(&frame.right_grey, size, (x + shift_px, y)) {
                    differences
                        .push((grey - f64::from(frame.left_grey[v * frame.width + u])).abs());
                }
            }
        }
        median(differences)
    };
    let exact = difference(0.0);
    println!(
        "right against left: {exact:.2} grey levels; half a pixel off: {:.2}, {:.2}",
        difference(-0.5),
        difference(0.5)
    );
    // A smaller difference than a shift by half a pixel to either side gives.
    assert!(exact < 1.5 && difference(0.5) > exact && difference(-0.5) > exact);
}

#[test]
// Without traffic all is static.
fn a_static_pixel_carried_to_the_next_frame_finds_its_own_grey() {
    let street = Street::new(StreetConfig { traffic: Traffic::None, ..quiet(640, 192) }).unwrap();
    let (frame, next) = (street.frame(20), street.frame(21));
    let size = (frame.width, frame.height);
    let t_next_frame = next.t_world_camera.inverse() * frame.t_world_camera;
    let mut differences = Vec::new();
    let mut depth_errors = Vec::new();
    for v in (2..frame.height - 2).step_by(2) {
        for u in (2..frame.width - 2).step_by(2) {
            let Some(point) = seen(&street, &frame, u, v) else { continue };
            let moved = t_next_frame.transform_point(point);
            // Behind the camera, or at an edge.
            if moved.z < 1.0 || !flat(&frame, u, v) {
                continue;
            }
            let (x, y) = projected(&street, &moved);
            let Some(grey) = grey_at(&next.left_grey, size, (x, y)) else { continue };
            differences.push((grey - f64::from(frame.left_grey[v * frame.width + u])).abs());
            // The nearest pixel there has its own depth.
            let (column, row) = ((x + 0.5) as usize, (y + 0.5) as usize);
            if let Some(there) = seen(&street, &next, column, row) {
                depth_errors.push((there.z - moved.z).abs() / moved.z);
            }
        }
    }
    let (grey, depth) = (median(differences), median(depth_errors));
    println!("next against this: {grey:.2} grey levels, depth {:.4} %", 100.0 * depth);
    assert!(grey < 2.0 && depth < 0.01);
}

#[test]
fn a_frame_depends_neither_on_earlier_frames_nor_on_threads() {
    let config = StreetConfig { width: 200, height: 64, ..StreetConfig::default() };
    let street = Street::new(config.clone()).unwrap();
    // Frames in any order, which fill and empty the caches.
    for index in [0, 90, 12, 400, 36] {
        street.frame(index);
    }
    let after_others = (street.frame(37), street.lidar(37));
    let alone = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let street = Street::new(config.clone()).unwrap();
        pool.install(|| (street.frame(37), street.lidar(37)))
    };
    assert!(after_others == alone(1));
    assert!(after_others == alone(2));
    assert!(after_others.0 != street.frame(38));
    assert_eq!(after_others.0.t_world_camera, street.t_world_camera(37));
}

#[test]
fn points_under_a_mask_lie_in_the_box_of_their_car() {
    let street = Street::new(quiet(640, 192)).unwrap();
    let mut cars = 0;
    for index in [0, 30, 60, 100] {
        let frame = street.frame(index);
        let mut counts = vec![0; frame.objects.len()];
        for v in 0..frame.height {
            for u in 0..frame.width {
                let instance = usize::from(frame.instances[v * frame.width + u]);
                if instance == 0 {
                    continue;
                }
                let object = &frame.objects[instance - 1];
                let in_world =
                    frame.t_world_camera.transform_point(seen(&street, &frame, u, v).unwrap());
                let inside = object.t_world_object.inverse().transform_point(in_world);
                let [width, height, length] = object.dimensions_m;
                // A millimetre for rounding.
                let slack = 1e-3;
                assert!(
                    inside.x.abs() < 0.5 * width + slack && inside.z.abs() < 0.5 * length + slack,
                    "car {} at {inside}",
                    object.id
                );
                assert!(inside.y < slack && inside.y > -height - slack);
                counts[instance - 1] += 1;
            }
        }
        // Cars of a few pixels do not count.
        cars += counts.iter().filter(|&&count| count > 50).count();
        assert!(
            frame.objects.iter().any(|object| object.moving)
                && frame.objects.iter().any(|object| !object.moving)
        );
    }
    // Three cars a frame are a street with traffic.
    assert!(cars >= 12, "a street with {cars} cars in four frames is empty");
}

#[test]
fn lidar_and_depth_agree_where_both_see() {
    let street = Street::new(quiet(640, 192)).unwrap();
    let (frame, scan) = (street.frame(25), street.lidar(25));
    assert!(scan.len() > 60_000, "{} echoes", scan.len());
    let mut errors = Vec::new();
    for point in &scan {
        let point = street.t_camera_lidar().transform_point(Point3::new(
            f64::from(point[0]),
            f64::from(point[1]),
            f64::from(point[2]),
        ));
        if point.z < 1.0 {
            continue;
        }
        let (u, v) = projected(&street, &point);
        let (u, v) = ((u + 0.5) as isize, (v + 0.5) as isize);
        // Two pixels off the border, where flatness is known.
        if u >= 2 && v >= 2 && u < frame.width as isize - 2 && v < frame.height as isize - 2 {
            let depth = f64::from(frame.depth_m[v as usize * frame.width + u as usize]);
            if depth > 0.0 && flat(&frame, u as usize, v as usize) {
                errors.push((point.z - depth).abs() / depth);
            }
        }
    }
    // A tenth: at edges the scanner sees past what the camera sees.
    let close = errors.iter().filter(|&&error| error < 0.1).count() as f64 / errors.len() as f64;
    println!(
        "{} echoes in view, {:.2} % within a tenth, median {:.4} %",
        errors.len(),
        100.0 * close,
        100.0 * median(errors.clone())
    );
    assert!(close > 0.97 && median(errors) < 0.01);
}

#[test]
fn the_camera_and_every_car_move_smoothly() {
    let street = Street::new(StreetConfig::default()).unwrap();
    let poses: Vec<Transform> = (0..120).map(|index| street.t_world_camera(index)).collect();
    assert_eq!(poses[0], Transform::IDENTITY);
    let steps: Vec<Transform> = poses.windows(2).map(|pair| pair[0].inverse() * pair[1]).collect();
    for pair in steps.windows(2) {
        assert!(
            (Vector3::from(pair[0].translation_m) - Vector3::from(pair[1].translation_m)).norm()
                < 0.05
        );
        assert!((pair[0].inverse() * pair[1]).angle_rad() < 0.02);
        // 9 m/s at ten frames a second.
        assert!((pair[0].distance_m() - 0.9).abs() < 0.06);
    }
    let angle_rad = poses[119].angle_rad();
    assert!(angle_rad > 0.02, "a camera that turns, not {angle_rad}");
}

#[test]
fn one_scripted_car_starts_and_one_stops_and_speeds_match_the_way_driven() {
    let street =
        Street::new(StreetConfig { width: 64, height: 32, ..StreetConfig::default() }).unwrap();
    let truth = |index: u32, id: u32| {
        street.frame(index).objects.iter().find(|object| object.id == id).copied().unwrap()
    };
    assert!(!truth(40, 2).moving && truth(50, 2).moving, "the second car starts at frame 45");
    assert!(
        truth(69, 3).moving && truth(105, 3).moving && !truth(112, 3).moving,
        "the third brakes from frame 70 and stands after 4 s"
    );
    for id in [1, 2, 3] {
        for index in [20, 60, 90] {
            let (now, next) = (truth(index, id), truth(index + 1, id));
            let way = (Vector3::from(next.t_world_object.translation_m)
                - Vector3::from(now.t_world_object.translation_m))
            .norm();
            // The speed is that of an instant, the way of a tenth of a second: the mean of both
            // ends.
            let speed = 0.5 * (now.speed_m_s + next.speed_m_s);
            assert!(
                (way * 10.0 - speed).abs() < 0.1 + 0.06 * speed,
                "car {id} at {index}: {way} m in 0.1 s at {speed} m/s"
            );
        }
    }
}

#[test]
fn a_static_street_has_no_motion_and_no_two_cars_overlap() {
    let still =
        Street::new(StreetConfig { width: 64, height: 32, ..StreetConfig::static_street() })
            .unwrap();
    assert!(still.frame(50).objects.iter().all(|object| !object.moving));
    let street =
        Street::new(StreetConfig { width: 64, height: 32, ..StreetConfig::default() }).unwrap();
    for index in (0..200).step_by(4) {
        let objects = street.frame(index).objects;
        for (k, a) in objects.iter().enumerate() {
            for b in &objects[k + 1..] {
                let offset =
                    Vector3::from((a.t_world_object.inverse() * b.t_world_object).translation_m);
                // Lengths must not overlap, or widths by a tenth at most: mirrors and rounding.
                let apart = offset.z.abs() > 0.5 * (a.dimensions_m[2] + b.dimensions_m[2])
                    || offset.x.abs() > 0.45 * (a.dimensions_m[0] + b.dimensions_m[0]);
                assert!(apart, "frame {index}: {} meets {}", a.id, b.id);
            }
        }
    }
}

#[test]
fn the_street_goes_on_after_twenty_thousand_frames() {
    let config =
        StreetConfig { width: 160, height: 48, curvature: false, ..StreetConfig::default() };
    let street = Street::new(config).unwrap();
    let frame = street.frame(20_000);
    assert!((frame.t_world_camera.translation_m[2] - 18_000.0).abs() < 1.0);
    let near = frame.depth_m.iter().filter(|&&z| z > 0.0 && z < 60.0).count();
    assert!(near > 160 * 48 / 2);
}

#[test]
fn noise_and_gain_are_as_configured() {
    let config = StreetConfig { width: 320, height: 96, ..StreetConfig::default() };
    let clean =
        Street::new(StreetConfig { noise_sigma: 0.0, gain_difference: 0.0, ..config.clone() })
            .unwrap()
            .frame(3);
    let noisy =
        Street::new(StreetConfig { gain_difference: 0.0, ..config.clone() }).unwrap().frame(3);
    let brighter = Street::new(StreetConfig { noise_sigma: 0.0, ..config }).unwrap().frame(3);
    let pairs = clean.left_rgb.iter().flatten().zip(noisy.left_rgb.iter().flatten());
    let differences: Vec<f64> = pairs
        .filter(|(a, _)| (110..146).contains(*a))
        .map(|(&a, &b)| f64::from(b) - f64::from(a))
        .collect();
    let variance =
        differences.iter().map(|value| value * value).sum::<f64>() / differences.len() as f64;
    assert!((variance.sqrt() - 1.6).abs() < 0.15, "{}", variance.sqrt());
    let mean = |picture: &[u8]| {
        picture.iter().map(|&value| f64::from(value)).sum::<f64>() / picture.len() as f64
    };
    assert_eq!(clean.left_grey, brighter.left_grey);
    // The right camera alone has another gain.
    let ratio = mean(&brighter.right_grey) / mean(&clean.right_grey);
    assert!((1.004..1.03).contains(&ratio), "{ratio}");
}

fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("dynvox-synth-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

#[test]
fn a_written_street_reads_back_as_it_was() {
    let config = StreetConfig { width: 160, height: 48, frames: 3, ..StreetConfig::default() };
    let street = Street::new(config).unwrap();
    let folder = scratch("written");
    let mut progress = Vec::new();
    write_kitti(&street, &folder, |done, all| progress.push((done, all))).unwrap();
    assert_eq!(progress, [(1, 3), (2, 3), (3, 3)]);
    let sequence = folder.join("sequences/00");
    for index in 0..3 {
        // Every image as the frame has it, to the bit.
        let frame = street.frame(index);
        let open =
            |name: &str| image::open(sequence.join(format!("{name}/{index:06}.png"))).unwrap();
        assert_eq!(open("image_0").into_luma8().into_raw(), frame.left_grey);
        assert_eq!(open("image_1").into_luma8().into_raw(), frame.right_grey);
        assert_eq!(open("image_2").into_rgb8().into_raw(), frame.left_rgb.concat());
        assert_eq!(open("image_3").into_rgb8().into_raw(), frame.right_rgb.concat());
        assert_eq!(open("instances").into_luma8().into_raw(), frame.instances);
        let (depth, disparity) =
            (open("depth").into_luma16().into_raw(), open("disp").into_luma16().into_raw());
        for ((&stored, &disparity), &z) in depth.iter().zip(&disparity).zip(&frame.depth_m) {
            // The files have 1/256 m and 1/256 px.
            assert!((f32::from(stored) / 256.0 - z).abs() < 0.003);
            let true_disparity =
                if z > 0.0 { street.rig().focal_baseline_px_m() as f32 / z } else { 0.0 };
            assert!((f32::from(disparity) / 256.0 - true_disparity).abs() < 0.003);
        }
        let scan: Vec<u8> =
            street.lidar(index).into_iter().flatten().flat_map(f32::to_le_bytes).collect();
        assert!(std::fs::read(sequence.join(format!("velodyne/{index:06}.bin"))).unwrap() == scan);
    }
    let text = |path: &str| std::fs::read_to_string(folder.join(path)).unwrap();
    let poses = text("poses/00.txt");
    assert_eq!(poses.lines().count(), 3);
    let last: Vec<f64> =
        poses.lines().last().unwrap().split(' ').map(|value| value.parse().unwrap()).collect();
    assert!((last[11] - street.t_world_camera(2).translation_m[2]).abs() < 1e-9);
    assert_eq!(text("sequences/00/times.txt").lines().count(), 3);
    // KITTI's five keys.
    assert_eq!(
        text("sequences/00/calib.txt").lines().map(|line| &line[..2]).collect::<Vec<_>>(),
        ["P0", "P1", "P2", "P3", "Tr"]
    );
    let objects: usize = (0..3).map(|index| street.frame(index).objects.len()).sum();
    // A line for each object, and the header.
    assert_eq!(text("sequences/00/objects.csv").lines().count(), 1 + objects);
    assert!(text("sequences/00/instances/000000.txt").lines().count() > 3);
    let again = write_kitti(&street, &folder, |_, _| {});
    assert!(matches!(again, Err(SynthError::NotEmpty(_))), "what is there already is not touched");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_failed_writing_leaves_nothing_behind() {
    let parent = scratch("failed");
    std::fs::create_dir_all(&parent).unwrap();
    std::fs::write(parent.join("occupied"), b"a file, not a folder").unwrap();
    let street =
        Street::new(StreetConfig { width: 64, height: 32, frames: 1, ..StreetConfig::default() })
            .unwrap();
    // The folder's name is taken by a file; and it would lie within one.
    assert!(matches!(
        write_kitti(&street, &parent.join("occupied"), |_, _| {}),
        Err(SynthError::NotEmpty(_))
    ));
    assert!(matches!(
        write_kitti(&street, &parent.join("occupied/below"), |_, _| {}),
        Err(SynthError::Write { .. })
    ));
    // Nothing but the file is there.
    assert_eq!(std::fs::read_dir(&parent).unwrap().count(), 1);
    std::fs::remove_dir_all(&parent).unwrap();
}

#[test]
fn a_configuration_survives_toml_and_bad_ones_are_refused_by_name() {
    let config = StreetConfig::default();
    let text = toml::to_string(&config).unwrap();
    assert_eq!(toml::from_str::<StreetConfig>(&text).unwrap(), config);
    assert!(toml::from_str::<StreetConfig>("sped_m_s = 3.0").is_err());
    assert_eq!(
        toml::from_str::<StreetConfig>("traffic = { mode = \"none\" }").unwrap(),
        StreetConfig::static_street()
    );
    let refused = |config| Street::new(config).err().unwrap().to_string();
    assert!(refused(StreetConfig { width: 8, ..StreetConfig::default() }).contains("width"));
    assert!(
        refused(StreetConfig { baseline_m: -0.5, ..StreetConfig::default() })
            .contains("baseline_m")
    );
    assert!(
        refused(StreetConfig { speed_m_s: f64::NAN, ..StreetConfig::default() })
            .contains("speed_m_s")
    );
}

/// `DYNVOX_LOOK=folder cargo test --release -p dynvox --lib synth -- --ignored --nocapture` writes
/// pictures to look at and prints the time of a frame on one thread.
#[test]
#[ignore = "writes pictures for eyes, checks nothing"]
fn pictures_to_look_at() {
    let folder = std::env::var("DYNVOX_LOOK").expect("name a folder in DYNVOX_LOOK");
    let seed = std::env::var("DYNVOX_LOOK_SEED").map_or(1, |seed| seed.parse().unwrap());
    std::fs::create_dir_all(&folder).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for (width, height) in [(640, 192), (1242, 375)] {
        let street =
            Street::new(StreetConfig { seed, width, height, ..StreetConfig::default() }).unwrap();
        for index in [0, 40, 80, 150] {
            let frame = street.frame(index);
            let time = |work: &(dyn Fn() + Sync)| {
                let one = || {
                    let start = std::time::Instant::now();
                    pool.install(work);
                    start.elapsed().as_secs_f64() * 1e3
                };
                (0..5).map(|_| one()).fold(f64::MAX, f64::min)
            };
            let (pair, scan) =
                (time(&|| drop(street.frame(index))), time(&|| drop(street.lidar(index))));
            println!("{width} x {height}, frame {index}: {pair:.1} ms, LiDAR {scan:.1} ms");
            let save = |name: &str, pixels: &[u8], colour| {
                let path = format!("{folder}/{width}_{index:03}_{name}.png");
                image::save_buffer(path, pixels, width, height, colour).unwrap();
            };
            save("left", &frame.left_rgb.concat(), image::ExtendedColorType::Rgb8);
            save("right", &frame.right_rgb.concat(), image::ExtendedColorType::Rgb8);
            let depth: Vec<u8> = frame
                .depth_m
                .iter()
                .map(|&z| if z > 0.0 { (600.0 / z).min(255.0) as u8 } else { 0 })
                .collect();
            save("depth", &depth, image::ExtendedColorType::L8);
            let masks: Vec<u8> = frame.instances.iter().map(|&k| k.wrapping_mul(37)).collect();
            save("masks", &masks, image::ExtendedColorType::L8);
        }
    }
}
