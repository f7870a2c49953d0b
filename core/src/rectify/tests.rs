//! Lenses and rectified pairs whose truth is known.

use super::*;
use crate::{
    Capacity, Serial,
    geometry::StereoRig,
    image::View,
    memory::{Carver, SLAB_ALIGN},
    parallel::TwoThreads,
};
use nalgebra::{Matrix3, Vector3};
use std::{vec, vec::Vec};

/// One of each model, with parameters as real lenses have them.
fn lenses() -> [Lens; 9] {
    // Focal lengths differ by 1 % and the principal point is off the middle, as in real cameras.
    let lens = |focal: f64, model| Lens::new([focal, 1.01 * focal], [310.0, 236.0], model).unwrap();
    [
        lens(400.0, LensModel::IDEAL),
        lens(
            400.0,
            LensModel::RadialTangential {
                radial: [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0],
                tangential: [2e-4, -3e-4],
            },
        ),
        lens(
            380.0,
            LensModel::RadialTangential {
                radial: [0.9, 0.2, 0.01, 1.2, 0.4, 0.05],
                tangential: [1e-4, 1e-4],
            },
        ),
        lens(290.0, LensModel::Equidistant { radial: [-0.013, 0.02, -0.012, 0.002] }),
        lens(280.0, LensModel::DoubleSphere { xi: -0.18, alpha: 0.59 }),
        lens(300.0, LensModel::ExtendedUnified { alpha: 0.6, beta: 1.1 }),
        lens(400.0, general(0.0, [-0.28, 0.07, 0.003, 0.0, 0.0, 0.0])),
        lens(720.0, general(0.8, [-0.34, 0.17, 0.0, 0.0, 0.0, 0.0])),
        lens(2138.0, general(3.63, [1.176, 15.49, 0.0, 0.0, 0.0, 0.0])),
    ]
}

/// A lens of the general model with a little of everything.
fn general(xi: f64, radial: [f64; 6]) -> LensModel {
    LensModel::General {
        xi,
        radial,
        tangential: [-7e-4, 7e-4],
        prism: [1e-3, -4e-4, 5e-4, 2e-4],
        tilt: [0.01, -0.02],
    }
}

#[test]
fn the_general_model_without_sphere_prism_and_tilt_is_the_radial_one() {
    let (radial, tangential) = ([0.9, 0.2, 0.01, 1.2, 0.4, 0.05], [1e-4, -2e-4]);
    let plain = LensModel::RadialTangential { radial, tangential };
    let general =
        LensModel::General { xi: 0.0, radial, tangential, prism: [0.0; 4], tilt: [0.0; 2] };
    let [plain, general] =
        [plain, general].map(|model| Lens::new([400.0; 2], [310.0, 236.0], model).unwrap());
    for ray in [[0.3, -0.2, 1.0], [0.0, 0.0, 2.0], [-0.9, 0.7, 1.0]] {
        let [a, b] = [plain, general].map(|lens| lens.project(ray).unwrap());
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-10, "{a:?} {b:?}");
    }
}

#[test]
fn prism_and_tilt_move_a_point_as_their_formulas_say() {
    let (u, v, about_y): (f64, f64, f64) = (0.3, -0.2, 0.05);
    let lens = |prism, tilt| {
        let (radial, tangential) = ([0.0; 6], [0.0; 2]);
        let model = LensModel::General { xi: 0.0, radial, tangential, prism, tilt };
        Lens::new([1.0; 2], [0.0; 2], model).unwrap()
    };
    let [x, y] = lens([1e-3, 2e-3, 3e-3, 4e-3], [0.0; 2]).project([u, v, 1.0]).unwrap();
    let r2 = u * u + v * v;
    let [along, down] = [r2 * (1e-3 + 2e-3 * r2), r2 * (3e-3 + 4e-3 * r2)];
    assert!((x - u - along).abs() < 1e-15 && (y - v - down).abs() < 1e-15);
    // Turned about y alone, the sensor's plane is met nearer or farther by the column.
    let [x, y] = lens([0.0; 4], [0.0, about_y]).project([u, v, 1.0]).unwrap();
    let depth = about_y.sin() * u + about_y.cos();
    assert!((x - u / depth).abs() < 1e-15 && (y - about_y.cos() * v / depth).abs() < 1e-15);
}

#[test]
fn a_sphere_seen_from_its_rim_is_the_unified_model() {
    // Mei's model without distortion is the extended unified one with other names.
    let xi = 0.8;
    let sphere = LensModel::General {
        xi,
        radial: [0.0; 6],
        tangential: [0.0; 2],
        prism: [0.0; 4],
        tilt: [0.0; 2],
    };
    let unified = LensModel::ExtendedUnified { alpha: xi / (1.0 + xi), beta: 1.0 };
    let sphere = Lens::new([720.0; 2], [310.0, 236.0], sphere).unwrap();
    let unified = Lens::new([720.0 / (1.0 + xi); 2], [310.0, 236.0], unified).unwrap();
    for ray in [[0.3, -0.2, 1.0], [1.5, 0.5, 1.0], [-2.0, 0.7, 0.3]] {
        let [a, b] = [sphere, unified].map(|lens| lens.project(ray).unwrap());
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9, "{a:?} {b:?}");
    }
}

#[test]
fn every_lens_takes_back_what_it_projects_over_its_whole_image() {
    for lens in lenses() {
        let mut seen = 0;
        for at in 0..64 * 48 {
            // Every tenth pixel, not in its middle.
            let pixel = [f64::from(at % 64) * 10.0 + 0.3, f64::from(at / 64) * 10.0 + 0.7];
            let Some(ray) = lens.unproject(pixel) else { continue };
            // Three times as far: depth must not matter.
            let back = lens.project(ray.map(|x| 3.0 * x)).unwrap();
            assert!(
                (back[0] - pixel[0]).hypot(back[1] - pixel[1]) < 1e-9,
                "{lens:?} {pixel:?} {back:?}"
            );
            seen += 1;
        }
        assert!(seen > 64 * 48 * 9 / 10, "{lens:?} sees {seen} pixels");
    }
}

#[test]
fn beyond_the_fold_of_a_polynomial_there_is_nothing() {
    let lens = Lens::new(
        [500.0; 2],
        [320.0, 240.0],
        LensModel::RadialTangential {
            radial: [-0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
            tangential: [0.0; 2],
        },
    );
    let lens = lens.unwrap();
    // r (1 - 0.3 r^2) grows up to r = 1.054 and is back at 0.5 for r = 1.43.
    assert!(lens.project([1.0, 0.0, 1.0]).is_some());
    assert_eq!(lens.project([1.43, 0.0, 1.0]), None);
    assert_eq!(lens.unproject([320.0 + 0.8 * 500.0, 240.0]), None, "no ray leads there");
    for lens in lenses() {
        assert_eq!(lens.project([0.0, 0.0, -1.0]), None, "{lens:?}");
        assert_eq!(lens.project([f64::NAN, 0.0, 1.0]), None, "{lens:?}");
        assert_eq!(lens.unproject([f64::NAN, 0.0]), None, "{lens:?}");
    }
}

#[test]
fn absurd_lenses_are_refused() {
    // Each has one fault, and the rest is sound.
    let make = |focal: f64, model| Lens::new([focal, 400.0], [0.0; 2], model).unwrap_err();
    assert_eq!(make(0.0, LensModel::IDEAL), LensProblem::Focal);
    assert_eq!(make(f64::NAN, LensModel::IDEAL), LensProblem::Focal);
    assert_eq!(
        make(1.0, LensModel::Equidistant { radial: [f64::INFINITY, 0.0, 0.0, 0.0] }),
        LensProblem::DistortionNotFinite
    );
    assert_eq!(
        make(1.0, LensModel::DoubleSphere { xi: 0.0, alpha: 1.2 }),
        LensProblem::DistortionOutOfRange
    );
    assert_eq!(
        make(1.0, LensModel::ExtendedUnified { alpha: 0.5, beta: 0.0 }),
        LensProblem::DistortionOutOfRange
    );
}

/// A rig whose right camera is turned, lifted and pushed.
fn raw_rig(lens: Lens) -> RawRig {
    let camera = RawCamera { lens, width: 640, height: 480 };
    let (sine, cosine) = (0.03f64.sin(), 0.03f64.cos());
    RawRig {
        left: camera,
        right: camera,
        r_right_left: Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0),
        t_right_left_m: Vector3::new(-0.2, 0.01, 0.005),
    }
}

const CAPACITY: Capacity = Capacity {
    image_width: 400,
    image_height: 300,
    raw_width: 640,
    raw_height: 480,
    ..Capacity::TINY
};

fn with_rectifier<R>(
    rectification: &Rectification,
    rig: &StereoRig,
    test: impl FnOnce(&Rectifier<'_>, &mut RectifiedImages<'_>) -> R,
) -> R {
    let bytes = Rectifier::bytes(&CAPACITY) + RectifiedImages::bytes(&CAPACITY);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut slab[start..], bytes).unwrap();
    let mut rectifier = Rectifier::new_in(&CAPACITY, &mut carver);
    let mut images = RectifiedImages::new_in(&CAPACITY, &mut carver);
    assert_eq!(carver.footprint().bytes(), bytes);
    carver.check().unwrap();
    rectifier.prepare(rectification, rig).unwrap();
    test(&rectifier, &mut images)
}

fn pair<'a>(left: View<'a, u8>, right: View<'a, u8>) -> Pair<'a> {
    Pair { left, right, colour: None }
}

/// A smooth pattern on a plane 2 m ahead of the left raw camera.
fn pattern([x, y]: [f64; 2]) -> f64 {
    128.0 + 60.0 * (x * 9.0).sin() + 50.0 * (y * 7.0 + x * 3.0).cos()
}

/// Renders the plane as a raw camera sees it: `r`, `t` map left raw coordinates to its own.
fn see_raw(camera: &RawCamera, r: &Matrix3<f64>, t: &Vector3<f64>) -> Vec<u8> {
    let origin = -(r.transpose() * t);
    let pixels = (0..camera.width * camera.height).map(|at| {
        let pixel = [f64::from(at % camera.width), f64::from(at / camera.width)];
        let Some(ray) = camera.lens.unproject(pixel) else { return 0 };
        let ray = r.transpose() * Vector3::from(ray);
        if ray.z < 0.05 {
            return 0;
        }
        let meets = origin + ray * ((2.0 - origin.z) / ray.z);
        pattern([meets.x, meets.y]).round() as u8
    });
    pixels.collect()
}

#[test]
fn a_rectified_pair_shows_what_an_ideal_pair_would_see() {
    for lens in lenses() {
        let raw = raw_rig(lens);
        let (rectification, rig) =
            Rectification::new(&raw, Sizing::Automatic { max_width: 400, max_height: 300 })
                .unwrap();
        // Raw pictures of one plane, 2 m away, by each camera's own lens.
        let left = see_raw(&raw.left, &Matrix3::identity(), &Vector3::zeros());
        let right = see_raw(&raw.right, &raw.r_right_left, &raw.t_right_left_m);
        let [left, right] = [&left, &right].map(|pixels| View::new(pixels, 640, 480).unwrap());
        with_rectifier(&rectification, &rig, |rectifier, images| {
            assert!(
                rectifier.invalid().is_none(),
                "automatic sizes leave no invalid pixel: {lens:?}"
            );
            let frame = rectifier.rectify(&pair(left, right), images, &Serial).unwrap();
            let r = rectification.left.r_rectified_raw;
            for (image, shift_m) in [(frame.left, 0.0), (frame.right, rig.baseline_m)] {
                let (mut sum, mut worst) = (0.0f64, 0.0f64);
                for (v, row) in image.rows().enumerate() {
                    for (u, &grey) in row.iter().enumerate() {
                        let ray = Vector3::new(
                            (u as f64 - rig.center_u_px) / rig.focal_px,
                            (v as f64 - rig.center_v_px) / rig.focal_px,
                            1.0,
                        );
                        // The rectified cameras look along other axes than the left raw one.
                        let (origin, ray) =
                            (r.transpose() * Vector3::new(shift_m, 0.0, 0.0), r.transpose() * ray);
                        // Where the ray meets the plane: what an ideal camera would see there.
                        let meets = origin + ray * ((2.0 - origin.z) / ray.z);
                        let difference = (pattern([meets.x, meets.y]) - f64::from(grey)).abs();
                        (sum, worst) =
                            (sum + difference, if difference > worst { difference } else { worst });
                    }
                }
                let mean = sum / (image.width() * image.height()) as f64;
                assert!(mean < 0.5 && worst < 8.0, "{lens:?}: mean {mean}, worst {worst}");
            }
        });
    }
}

#[test]
fn pixels_no_raw_pixel_covers_are_invalid_with_a_margin() {
    let raw = raw_rig(lenses()[1]);
    let (rectification, rig) =
        Rectification::new(&raw, Sizing::Given { width: 400, height: 300, focal_px: Some(150.0) })
            .unwrap();
    with_rectifier(&rectification, &rig, |rectifier, images| {
        let invalid = rectifier.invalid().unwrap().left;
        let covered = |u: i64, v: i64| {
            let raw = rectification.left.raw_pixel(&rig, [u as f64, v as f64]);
            raw.is_some_and(|[u, v]| {
                // Up to a sixteenth of a pixel beyond the image, as the map rounds.
                (-0.0625..=639.0625).contains(&u) && (-0.0625..=479.0625).contains(&v)
            })
        };
        let margin = INVALID_MARGIN_PX as i64;
        for (u, v) in (0..400i64).flat_map(|u| (0..300i64).map(move |v| (u, v))).step_by(7) {
            let near = |at: i64, end: i64| (at - margin).max(0)..(at + margin + 1).min(end);
            let whole = near(u, 400).all(|u| near(v, 300).all(|v| covered(u, v)));
            assert_eq!(invalid.contains(u as usize, v as usize), !whole, "{u} {v}");
        }
        let white = vec![255u8; 640 * 480];
        let view = View::new(&white, 640, 480).unwrap();
        let frame = rectifier.rectify(&pair(view, view), images, &Serial).unwrap();
        // White where it is covered, black where it is not.
        assert_eq!((frame.left.get(200, 150), frame.left.get(0, 0)), (Some(255), Some(0)));
        let report = rectifier.report(&frame).unwrap();
        assert_eq!(
            report.invalid_left,
            (0..400 * 300).filter(|at| !covered(at % 400, at / 400)).count() as u32
        );
    });
}

#[test]
fn memory_below_an_image_is_not_read() {
    // Half of the rectified pixels lie beyond the raw image, and one picture above another.
    let mut raw = raw_rig(lenses()[1]);
    (raw.left.height, raw.right.height) = (256, 256);
    let sizing = Sizing::Given { width: 400, height: 300, focal_px: Some(100.0) };
    let (rectification, rig) = Rectification::new(&raw, sizing).unwrap();
    let memory = vec![255u8; 2 * 640 * 256];
    let [whole, exact] =
        [&memory[..], &memory[..640 * 256]].map(|data| View::new(data, 640, 256).unwrap());
    with_rectifier(&rectification, &rig, |rectifier, images| {
        let one = rectifier.rectify(&pair(whole, whole), images, &Serial).unwrap();
        let one = rectifier.report(&one).unwrap();
        let other = rectifier.rectify(&pair(exact, exact), images, &Serial).unwrap();
        assert!(one.invalid_left > 10_000);
        assert_eq!(one, rectifier.report(&other).unwrap());
    });
}

#[test]
fn threads_change_nothing_and_rows_may_be_padded() {
    let raw = raw_rig(lenses()[3]);
    let (rectification, rig) =
        Rectification::new(&raw, Sizing::Automatic { max_width: 400, max_height: 300 }).unwrap();
    let noise: Vec<u8> =
        (0..700 * 480u32).map(|at| (at.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    // 60 px of padding with other noise: rows must not run into it.
    let padded = View::with_stride(&noise, 640, 480, 700).unwrap();
    let tight: Vec<u8> = padded.rows().flatten().copied().collect();
    let tight = View::new(&tight, 640, 480).unwrap();
    with_rectifier(&rectification, &rig, |rectifier, images| {
        let one = rectifier.rectify(&pair(padded, padded), images, &Serial).unwrap();
        let one = rectifier.report(&one).unwrap().digest;
        let other = rectifier.rectify(&pair(tight, tight), images, &TwoThreads).unwrap();
        assert_eq!(rectifier.report(&other).unwrap().digest, one);
    });
}

#[test]
fn without_raw_pixels_it_costs_nothing_and_takes_nothing() {
    let none = Capacity { raw_width: 0, raw_height: 0, ..CAPACITY };
    assert_eq!(Rectifier::bytes(&none) + RectifiedImages::bytes(&none), 0);
    let mut carver = Carver::without_slab();
    let mut rectifier = Rectifier::new_in(&none, &mut carver);
    RectifiedImages::new_in(&none, &mut carver);
    assert!(carver.footprint().regions().is_empty());
    let raw = raw_rig(lenses()[0]);
    let (rectification, rig) =
        Rectification::new(&raw, Sizing::Automatic { max_width: 400, max_height: 300 }).unwrap();
    assert_eq!(
        rectifier.prepare(&rectification, &rig),
        Err(RectifierError::RawTooLarge { width: 0, height: 0 })
    );
}
