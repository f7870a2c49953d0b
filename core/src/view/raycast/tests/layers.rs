//! Several maps in one picture.

use super::{
    scenes::{Ball, Plane, filled, rough, true_distances},
    *,
};

/// Everything a picture shows, pixel by pixel.
type Pixel = (f32, [i8; 3], [u8; 3], u8);

fn pixels(caster: &Raycaster<'_>) -> Vec<Pixel> {
    let images = caster
        .depth_m
        .iter()
        .zip(caster.normal.iter())
        .zip(caster.colour.iter().zip(caster.weight.iter()));
    images.map(|((depth, normal), (colour, weight))| (*depth, *normal, *colour, *weight)).collect()
}

#[test]
fn several_maps_in_one_picture_show_what_is_nearest_of_each_alone() {
    let ground = rough(5);
    let ball = Ball { center: Vector3::new(0.2, -0.1, 3.0), radius: 0.8 };
    let ball = filled([-5, -5, 3], [5, 5, 11], true_distances(&ball));
    let near = Plane::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.5]);
    let sheet = filled([0, -7, 2], [1, 7, 5], true_distances(&near));
    let camera = at([0.1, -0.4, 0.2], [0.9, -0.3, 0.2]);
    let moved = |rotation: [f64; 3], shift: [f64; 3]| Viewpoint {
        t_world_camera: Transform::new(Vector3::from(rotation), Vector3::from(shift))
            * camera.t_world_camera,
        ..camera
    };
    // The ball twice: once before, once behind the ground and the other ball in part.
    let maps = [
        (&ball, moved([0.0, 0.3, 0.0], [0.0, 0.0, 0.4])),
        (&sheet, moved([0.0; 3], [0.1, 0.0, 0.0])),
        (&ball, moved([0.0; 3], [-0.7, 0.0, -0.6])),
    ];
    let mut caster = raycaster(6_000, &RaycastConfig::default());
    caster.cast(&ground, &camera, &Serial).unwrap();
    let mut nearest: Vec<(Pixel, u8)> =
        pixels(&caster).into_iter().map(|pixel| (pixel, 0)).collect();
    let mut threaded = raycaster(6_000, &RaycastConfig::default());
    threaded.cast(&ground, &camera, &TwoThreads).unwrap();
    for (layer, (map, view)) in (1..).zip(&maps) {
        let mut alone = raycaster(6_000, &RaycastConfig::default());
        alone.cast(map, view, &Serial).unwrap();
        let mut shown = 0;
        for (nearest, pixel) in nearest.iter_mut().zip(pixels(&alone)) {
            if pixel.0 > 0.0 && (nearest.0.0 == 0.0 || pixel.0 < nearest.0.0) {
                *nearest = (pixel, layer);
                shown += 1;
            }
        }
        assert_eq!(caster.cast_over(map, view, layer, &Serial).unwrap().pixels, shown);
        threaded.cast_over(map, view, layer, &TwoThreads).unwrap();
    }
    for caster in [&caster, &threaded] {
        let composed: Vec<(Pixel, u8)> =
            pixels(caster).into_iter().zip(caster.layer.iter().copied()).collect();
        assert!(composed == nearest);
    }
    for layer in 0..=3 {
        assert!(
            nearest.iter().filter(|(pixel, shown)| *shown == layer && pixel.0 > 0.0).count() > 300,
            "map {layer} is seen"
        );
    }
    let other_size = Viewpoint { width: 80, ..camera };
    assert_eq!(caster.cast_over(&ball, &other_size, 9, &Serial), Err(RaycastError::ImageSize));
    let absurd = Viewpoint { rig: StereoRig { focal_px: 0.0, ..RIG }, ..camera };
    assert_eq!(caster.cast_over(&ball, &absurd, 9, &Serial), Err(RaycastError::Viewpoint));
    assert!(
        pixels(&caster).iter().zip(&nearest).all(|(pixel, (known, _))| pixel == known),
        "a refused map changes nothing"
    );
    assert_eq!(
        raycaster(10, &RaycastConfig::default()).cast_over(&ball, &camera, 1, &Serial),
        Err(RaycastError::ImageSize),
        "over nothing"
    );
    caster.cast(&ground, &camera, &Serial).unwrap();
    assert!(caster.layer.iter().all(|layer| *layer == 0), "the next picture begins anew");
}
