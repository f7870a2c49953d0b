//! Lens models against independent ones: the crate `apex-camera-models` projects what we unproject;
//! OpenCV's numbers stand for the rational model, which the crate lacks.

use apex_camera_models::{
    CameraModel, DistortionModel, DoubleSphereCamera, EucmCamera, KannalaBrandtCamera,
    PinholeParams, RadTanCamera,
};
use dynvox_core::rectify::{Lens, LensModel};
use nalgebra::Vector3;

const FOCAL_PX: [f64; 2] = [400.0, 404.0];
const CENTER_PX: [f64; 2] = [310.0, 236.0];
/// Largest difference, px.
const BOUND_PX: f64 = 1e-6;

fn pinhole() -> PinholeParams {
    PinholeParams::new(FOCAL_PX[0], FOCAL_PX[1], CENTER_PX[0], CENTER_PX[1]).unwrap()
}

fn lens(model: LensModel) -> Lens {
    Lens::new(FOCAL_PX, CENTER_PX, model).unwrap()
}

/// Unprojects every fifth pixel of a 640 x 480 image with our lens and projects the ray with theirs
/// and with ours. Returns the largest distance from the pixel, px. Their own inverse stops at a
/// millionth of the focal length, too coarse for this bound.
fn worst(ours: &Lens, theirs: &impl CameraModel) -> f64 {
    let mut worst = 0.0;
    for at in 0..128 * 96u32 {
        let pixel = [f64::from(at % 128) * 5.0, f64::from(at / 128) * 5.0];
        let ray = ours.unproject(pixel).expect("within the field of view");
        let there = theirs.project(&Vector3::from(ray)).expect("within the field of view");
        let here = ours.project(ray).expect("within the field of view");
        for found in [[there.x, there.y], here] {
            let off = (found[0] - pixel[0]).hypot(found[1] - pixel[1]);
            worst = if off > worst { off } else { worst };
        }
    }
    worst
}

#[test]
fn every_model_agrees_with_an_independent_one_to_a_millionth_of_a_pixel() {
    // One set of parameters for ours and theirs.
    let radial = [-0.28, 0.07, -0.002, 0.0, 0.0, 0.0];
    let bent = lens(LensModel::RadialTangential { radial, tangential: [2e-4, -3e-4] });
    let theirs = RadTanCamera::new(
        pinhole(),
        DistortionModel::BrownConrady { k1: -0.28, k2: 0.07, p1: 2e-4, p2: -3e-4, k3: -0.002 },
    );
    let radial_tangential = worst(&bent, &theirs.unwrap());
    let fisheye = lens(LensModel::Equidistant { radial: [-0.013, 0.02, -0.012, 0.002] });
    let theirs = KannalaBrandtCamera::new(
        pinhole(),
        DistortionModel::KannalaBrandt { k1: -0.013, k2: 0.02, k3: -0.012, k4: 0.002 },
    );
    let equidistant = worst(&fisheye, &theirs.unwrap());
    let spheres = lens(LensModel::DoubleSphere { xi: -0.18, alpha: 0.59 });
    let theirs = DoubleSphereCamera::new(
        pinhole(),
        DistortionModel::DoubleSphere { xi: -0.18, alpha: 0.59 },
    );
    let double_sphere = worst(&spheres, &theirs.unwrap());
    let unified = lens(LensModel::ExtendedUnified { alpha: 0.6, beta: 1.1 });
    let theirs = EucmCamera::new(pinhole(), DistortionModel::EUCM { alpha: 0.6, beta: 1.1 });
    let extended_unified = worst(&unified, &theirs.unwrap());
    println!(
        "largest difference, px: {radial_tangential:e} {equidistant:e} {double_sphere:e} \
         {extended_unified:e}"
    );
    assert!(
        [radial_tangential, equidistant, double_sphere, extended_unified]
            .iter()
            .all(|off| *off < BOUND_PX)
    );
}

/// Projections by OpenCV 5.0 of rays with z 1 (`cv2.projectPoints`, `cv2.fisheye.projectPoints`).
const RAYS: [[f64; 2]; 6] = [
    [0.017, 0.328],
    [0.631, -0.091],
    [-0.498, 0.05],
    [0.628, -0.472],
    [-0.263, 0.254],
    [-0.107, 0.038],
];
const RATIONAL: [[f64; 2]; 6] = [
    [316.5965003964711, 364.466664224808],
    [536.8889412936421, 202.9706700968478],
    [124.09249992766465, 254.86320223254967],
    [525.5273909620009, 72.43504637980075],
    [208.74936762830768, 334.7742565798173],
    [267.36552431435155, 251.29333368232886],
];
const FISHEYE: [[f64; 2]; 6] = [
    [316.562840253747, 363.8904540741948],
    [534.1384733803333, 203.3525085762497],
    [125.67542797432847, 254.69154796645867],
    [522.3283770063343, 74.81977088143361],
    [209.27725223220062, 334.2487213397386],
    [267.3894742403265, 251.28403718370345],
];

#[test]
fn the_rational_and_the_fisheye_model_give_opencvs_pixels() {
    let rational = LensModel::RadialTangential {
        radial: [0.9, 0.2, 0.01, 1.2, 0.4, 0.05],
        tangential: [1e-4, 1e-4],
    };
    let fisheye = LensModel::Equidistant { radial: [-0.013, 0.02, -0.012, 0.002] };
    for (model, pixels) in [(rational, RATIONAL), (fisheye, FISHEYE)] {
        for ([x, y], expected) in RAYS.into_iter().zip(pixels) {
            let found = lens(model).project([x, y, 1.0]).unwrap();
            assert!(
                (found[0] - expected[0]).hypot(found[1] - expected[1]) < BOUND_PX,
                "{found:?} {expected:?}"
            );
            // And back from OpenCV's pixel to the ray.
            let ray = lens(model).unproject(expected).unwrap();
            assert!((ray[0] / ray[2] - x).hypot(ray[1] / ray[2] - y) < 1e-9);
        }
    }
}
