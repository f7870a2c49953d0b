//! Fusion against a plain twin, voxel by voxel.

use super::*;
use crate::volume::fuse::COLOUR_BAND;
/// The colour that a pixel shows.
fn target_colour(seen: &Observation<'_>, u: usize, v: usize) -> [u8; 3] {
    seen.colour.map_or_else(|| [seen.grey.get(u, v).unwrap(); 3], |image| image.get(u, v).unwrap())
}

/// Returns what a weight counts for against an observation at a depth.
fn past(config: &VolumeConfig, weight: i32, depth_m: f32) -> i32 {
    if config.observation_weight == ObservationWeight::Nearest {
        weight.min(libm::rintf(0.5 * depth_m) as i32)
    } else {
        weight
    }
}

/// Returns the weight of an observation of a class at a depth, so far before the surface.
fn gain(config: &VolumeConfig, class: Option<u8>, depth_m: f32, distance_m: f32) -> i32 {
    let is_free = distance_m >= 4.0 * config.voxel_size_m;
    let at_1_m = match config.observation_weight {
        ObservationWeight::One | ObservationWeight::Nearest => 0.0,
        ObservationWeight::Band if is_free => 25.0,
        ObservationWeight::Depth | ObservationWeight::Band => 100.0,
    };
    let by_class = class.map_or(1, |class| i32::from(config.class_weight[usize::from(class)]));
    crate::geometry::scalar::clamp_f32(at_1_m / depth_m, 1.0, 10.0) as i32 * by_class
}

/// An average of integers with the share of a new observation in 15 bits.
fn averaged(old: i32, new: i32, gain: i32, sum: i32) -> i32 {
    let share = (gain * (((1 << 23) + sum / 2) / sum) + 128) >> 8;
    old + (((new - old) * share + (1 << 14)) >> 15)
}

/// Averages a colour in, unless there is one and that of the pixel may be another surface's.
fn fuse_colour_slowly(
    colour: &mut Colour,
    voxel: usize,
    weight: u8,
    is_unreliable: bool,
    target: [u8; 3],
) {
    let is_blank = colour.iter().all(|plane| plane[voxel] == 0);
    if !is_blank && is_unreliable {
        return;
    }
    let sum = if is_blank { 1 } else { i32::from(weight).clamp(2, 6) };
    for (plane, target) in colour.iter_mut().zip(target) {
        plane[voxel] = averaged(i32::from(plane[voxel]), i32::from(target.max(1)), 1, sum) as u8;
    }
}

/// Fusion as its module states it, one voxel after the other, and as plainly.
fn fuse_slowly(
    config: &VolumeConfig,
    view: &Viewpoint,
    seen: &Observation<'_>,
    coord: BlockCoord,
    Voxels { sdf, weight }: &mut Voxels,
    colour: &mut Colour,
) {
    let (camera_from_world, camera) = view.camera_from_world();
    let voxel_m = f64::from(config.voxel_size_m);
    let corner = (camera_from_world
        * (Vector3::from(coord.origin().map(|c| f64::from(c) * voxel_m)) - camera.coords))
        .cast::<f32>();
    let step = [Vector3::x(), Vector3::y(), Vector3::z()]
        .map(|axis| (camera_from_world * (axis * voxel_m)).cast::<f32>());
    for voxel in 0..BLOCK_VOXELS {
        let (x, y, z) = (voxel & 7, voxel >> 3 & 7, voxel >> 6);
        let first = corner + step[1] * y as f32 + step[2] * z as f32;
        let at = Vector3::new(
            first.x + step[0].x * x as f32,
            first.y + step[0].y * x as f32,
            first.z + step[0].z * x as f32,
        );
        if at.z <= 0.0 {
            continue;
        }
        let scale = RIG.focal_px as f32 / at.z;
        let column = libm::rintf(at.x * scale + RIG.center_u_px as f32);
        let row = libm::rintf(at.y * scale + RIG.center_v_px as f32);
        if column < 0.0 || row < 0.0 || column >= WIDTH as f32 || row >= HEIGHT as f32 {
            continue;
        }
        let (u, v) = (column as usize, row as usize);
        let depth = seen.depth.depth_m().get(u, v).unwrap();
        let distance = depth - at.z;
        let least_m = if depth > config.far_m { depth * BEFORE_FAR } else { -config.truncation_m };
        if depth <= 0.0 || distance < least_m {
            continue;
        }
        // The lowest five bits: sixteenths less one, and whether the colour is another's.
        let notes =
            if matches!(seen.depth, DepthImage::Noted(_)) { depth.to_bits() & 31 } else { 15 };
        let distance = distance * ((notes & 15) + 1) as f32 / 16.0;
        if distance < -crate::geometry::scalar::max_f32(config.behind_m, 2.0 * config.voxel_size_m)
        {
            continue;
        }
        let observed = if distance < config.truncation_m {
            libm::rintf(distance * (32_767.0 / config.truncation_m)) as i32
        } else {
            32_767
        };
        let w = i32::from(weight[voxel]);
        let gain = gain(config, seen.class.map(|class| class.get(u, v).unwrap()), depth, distance);
        if gain == 0 {
            continue;
        }
        sdf[voxel] =
            averaged(i32::from(sdf[voxel]), observed, gain, past(config, w, depth) + gain) as i16;
        weight[voxel] = (w + gain).min(i32::from(config.max_weight)) as u8;
        if distance.abs() <= COLOUR_BAND * config.truncation_m {
            let is_unreliable = notes & 16 != 0;
            fuse_colour_slowly(
                colour,
                voxel,
                weight[voxel],
                is_unreliable,
                target_colour(seen, u, v),
            );
        }
    }
}

#[test]
fn equals_the_plain_twin_bit_for_bit() {
    equals_the_plain_twin(ObservationWeight::Nearest);
    equals_the_plain_twin(ObservationWeight::One);
    equals_the_plain_twin(ObservationWeight::Depth);
    equals_the_plain_twin(ObservationWeight::Band);
}

fn equals_the_plain_twin(observation_weight: ObservationWeight) {
    let mut config = VolumeConfig {
        max_weight: 7,
        behind_m: 0.4,
        // Some of the depths lie beyond.
        far_m: 5.0,
        observation_weight,
        ..VolumeConfig::default()
    };
    config.class_weight[..3].copy_from_slice(&[0, 1, 3]);
    let grey: Vec<u8> = (0..(WIDTH + 5) * HEIGHT).map(|i| (i % 251) as u8).collect();
    let rgb: Vec<[u8; 3]> = grey.iter().map(|&grey| [grey, 255 - grey, grey / 3]).collect();
    let class: Vec<u8> = (0..WIDTH * HEIGHT).map(|i| (i / 5 % 4) as u8).collect();
    with_volume(&CAPACITY, &config, |volume| {
        let mut unchanged = 0;
        for i in 0..8 {
            // Every other frame shows a wall that hides most of what the one before showed.
            let noted = i % 4 > 1;
            let shown_m = bumpy_depth()
                .into_iter()
                .map(|depth| if i % 2 == 1 { 0.5 * depth } else { depth })
                .zip(0u32..);
            let note = |(depth, at): (f32, u32)| {
                f32::from_bits(depth.to_bits() & !31 | at.wrapping_mul(2_654_435_761) >> 27)
            };
            let depth_m: Vec<f32> = shown_m
                .map(|(depth, at)| if noted && depth > 0.0 { note((depth, at)) } else { depth })
                .collect();
            let noted_depths = View::new(NotedDepth::wrap_slice(&depth_m), WIDTH, HEIGHT).unwrap();
            let view = view([0.02 * f64::from(i), 0.1, -0.3], [0.1 * f64::from(i), 0.0, 0.2]);
            let stride = WIDTH + if i % 2 == 1 { 5 } else { 0 };
            let seen = Observation {
                grey: View::with_stride(&grey, WIDTH, HEIGHT, stride).unwrap(),
                colour: if i % 4 < 2 {
                    View::with_stride(&rgb, WIDTH, HEIGHT, stride)
                } else {
                    None
                },
                class: if i % 3 < 2 { View::new(&class, WIDTH, HEIGHT) } else { None },
                depth: if noted {
                    DepthImage::Noted(noted_depths)
                } else {
                    observation(&depth_m, &grey).depth
                },
            };
            volume.allocate(&view, seen.depth.depth_m(), &mut NoStore, &Serial);
            let blocks = &volume.blocks;
            let slots = volume.visible().slots().iter();
            let twins: Vec<_> = slots
                .map(|&slot| (slot, blocks.voxels[slot.index()], *blocks.colour(slot).unwrap()))
                .collect();
            volume.fuse(&view, seen, &Serial);
            for (slot, mut voxels, mut colour) in twins {
                let before = voxels;
                fuse_slowly(
                    &config,
                    &view,
                    &seen,
                    volume.blocks().coord(slot).unwrap(),
                    &mut voxels,
                    &mut colour,
                );
                let fused = &volume.blocks.voxels[slot.index()];
                assert!(
                    fused.sdf == voxels.sdf
                        && fused.weight == voxels.weight
                        && *volume.blocks().colour(slot).unwrap() == colour
                );
                unchanged +=
                    usize::from(before.weight == voxels.weight && before.sdf == voxels.sdf);
            }
        }
        assert!(unchanged > 100, "{unchanged} blocks were hidden");
    });
}
