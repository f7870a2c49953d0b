//! Moving objects stay out of the static map, are tracked and reconstructed apart; shown on the
//! synthetic street with exact masks.

use dynvox::evaluate::surfaces::{SeenSide, TrueView};
use dynvox::input::TrueObject;
use dynvox::synth::{Street, StreetConfig, SynthFrame};
use dynvox_core::{
    Capacity, Config, Mapper, Report, Serial, StereoFrame,
    geometry::Transform,
    image::View,
    objects::NoSink,
    tracking::{Class, Detection, MotionState, TrackReport},
    view::{MeshConfig, Raycaster},
    volume::NoStore,
};
use dynvox_tests::HeapSlab;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Width and height at which cars have matches enough.
const SIZE: [u32; 2] = [1242, 375];
const FRAMES: u32 = 18;
const CAPACITY: Capacity = Capacity { blocks: 40_000, ..Capacity::ONBOARD };

struct Seen {
    class: Class,
    pixels: [i32; 4],
    mask: Vec<u8>,
    truth: usize,
}

impl Seen {
    fn detection(&self) -> Detection<'_> {
        let [left, top, width, height] = self.pixels;
        Detection {
            class: self.class,
            score: 0.9,
            left,
            top,
            width: width as u32,
            height: height as u32,
            mask: &self.mask,
        }
    }
}

/// The exact masks of a frame.
fn seen(frame: &SynthFrame) -> Vec<Seen> {
    let of = |k: usize| {
        let pixels = || {
            frame
                .instances
                .iter()
                .enumerate()
                .filter(|(_, p)| usize::from(**p) == k)
                .map(|(at, _)| at)
        };
        // The box of the instance's pixels; an instance without any is not seen.
        let (left, right) = (
            pixels().map(|at| at % frame.width).min()?,
            pixels().map(|at| at % frame.width).max()?,
        );
        let (top, bottom) = (pixels().min()? / frame.width, pixels().max()? / frame.width);
        let inside =
            |v: usize, u: usize| u8::from(usize::from(frame.instances[v * frame.width + u]) == k);
        let mask = (top..=bottom).flat_map(|v| (left..=right).map(move |u| inside(v, u))).collect();
        let pixels = [left, top, right + 1 - left, bottom + 1 - top].map(|px| px as i32);
        Some(Seen {
            class: Class::from_name(frame.objects[k - 1].class)?,
            pixels,
            mask,
            truth: k - 1,
        })
    };
    (1..=frame.objects.len()).filter_map(of).collect()
}

struct Sequence {
    street: Street,
    frames: Vec<(SynthFrame, Vec<Seen>)>,
}

/// Rendered once for all tests.
static SEQUENCE: LazyLock<Sequence> = LazyLock::new(Sequence::new);

impl Sequence {
    fn new() -> Self {
        let street = Street::new(StreetConfig {
            width: SIZE[0],
            height: SIZE[1],
            frames: FRAMES,
            ..StreetConfig::default()
        })
        .unwrap();
        let frames = (0..FRAMES)
            .map(|index| street.frame(index))
            .map(|frame| (seen(&frame), frame))
            .map(|(s, f)| (f, s))
            .collect();
        Self { street, frames }
    }

    /// Runs all frames; `inspect` sees the mapper after each.
    fn run(
        &self,
        dynamic: bool,
        backwards: bool,
        inspect: impl FnMut(usize, &Report, &mut Mapper<'_>),
    ) {
        self.run_within(&CAPACITY, dynamic, backwards, inspect);
    }

    fn run_within(
        &self,
        capacity: &Capacity,
        dynamic: bool,
        backwards: bool,
        mut inspect: impl FnMut(usize, &Report, &mut Mapper<'_>),
    ) {
        let mut config = Config::for_rig(self.street.rig());
        config.tracking.dynamic = dynamic;
        let mut slab = HeapSlab::of(capacity);
        let mut mapper = Mapper::new(capacity, &config, slab.bytes()).unwrap();
        for (index, (frame, seen)) in self.frames.iter().enumerate() {
            let mut detections: Vec<_> = seen.iter().map(Seen::detection).collect();
            // The order in which a detector lists its finds must not matter.
            if backwards {
                detections.reverse();
            }
            let view = |pixels| View::new(pixels, frame.width, frame.height).unwrap();
            let pair = StereoFrame::pair(view(&frame.left_grey[..]), view(&frame.right_grey[..]));
            let stereo = StereoFrame { detections: &detections, ..pair };
            let report = mapper.step_with(&stereo, &Serial, &mut NoStore, &mut NoSink).unwrap();
            inspect(index, &report, &mut mapper);
        }
    }

    /// Triangles of the static map within what the moving cars swept, 20 cm off their boxes' faces
    /// so that the road stays out.
    fn swept(&self, mapper: &Mapper<'_>) -> u64 {
        let origin = self.frames[0].0.t_world_camera;
        let cars = || {
            self.frames.iter().flat_map(|(frame, _)| &frame.objects).filter(|object| object.moving)
        };
        let mut count = 0;
        let boxes: Vec<(Transform, [f64; 3])> =
            cars().map(|car| (car.t_world_object.inverse() * origin, car.dimensions_m)).collect();
        mapper.triangles(&mut |triangle| {
            let corner = triangle.vertices[0].position_m.map(f64::from);
            count += u64::from(boxes.iter().any(|(t_object_map, [width, height, length])| {
                let [x, y, z] = t_object_map.transform_point(corner);
                // Height is measured downwards from the ground.
                x.abs() < width / 2.0 - 0.2
                    && z.abs() < length / 2.0 - 0.2
                    && y < -0.3
                    && y > 0.2 - height
            }));
        });
        count
    }
}

/// Returns the true car that a track follows.
fn truth<'f>(
    frame: &'f SynthFrame,
    seen: &[Seen],
    track: &TrackReport,
) -> Option<&'f dynvox::synth::ObjectTruth> {
    let near = |seen: &&Seen| {
        (seen.pixels[0] - track.pixels.left).abs() + (seen.pixels[1] - track.pixels.top).abs()
    };
    frame.objects.get(seen.iter().min_by_key(near)?.truth)
}

#[dynvox_needs::long]
#[test]
fn moving_cars_leave_no_trail_in_the_static_map_and_do_without_masks() {
    let sequence = &*SEQUENCE;
    let trail = |dynamic| {
        // Only at the end: a trail may be there while the car is.
        let mut count = 0;
        sequence.run(dynamic, false, |index, _, mapper| {
            if index + 1 == sequence.frames.len() {
                count = sequence.swept(mapper);
            }
        });
        count
    };
    let (on, off) = (trail(true), trail(false));
    println!("triangles where cars drove: {on} with masks, {off} without");
    assert!(off > 500, "{off}");
    assert_eq!(on, 0);
}

#[dynvox_needs::long]
#[test]
fn each_cars_state_and_motion_are_true_in_any_order_of_detections() {
    let sequence = &*SEQUENCE;
    let mut states: BTreeMap<u32, Vec<(bool, MotionState)>> = BTreeMap::new();
    let (mut errors_m, mut errors_deg) = (Vec::new(), Vec::new());
    let mut digests = Vec::new();
    sequence.run(true, false, |index, report, mapper| {
        digests.push(report.digest);
        let (frame, seen) = &sequence.frames[index];
        let Some((last, _)) = index.checked_sub(1).map(|last| &sequence.frames[last]) else {
            return;
        };
        // The truth, as seen from the estimated camera: the camera's own drift is not the object's
        // error.
        let t_map_world = report.t_world_camera * frame.t_world_camera.inverse();
        for track in mapper.tracks().filter(|track| track.detected && track.sightings > 4) {
            let Some(car) = truth(frame, seen, &track) else { continue };
            states.entry(track.id).or_default().push((car.moving, track.state));
            let distance_m = (frame.t_world_camera.inverse() * car.t_world_object).translation_m[2];
            // Only the true motion of cars in both frames can be compared.
            let Some(before) = last.objects.iter().find(|other| other.id == car.id) else {
                continue;
            };
            if !(track.measured && car.moving && distance_m < 35.0) {
                continue;
            }
            let moved = t_map_world
                * car.t_world_object
                * before.t_world_object.inverse()
                * t_map_world.inverse();
            // Motions are compared at the object's middle, where a turn about a far origin does not
            // count.
            let [a, b] = [track.motion_world, moved]
                .map(|motion| motion.transform_point(track.center_world_m));
            errors_m.push((0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt());
            errors_deg.push((track.motion_world.inverse() * moved).angle_rad().to_degrees());
        }
    });
    // Uncertain is no mistake; the wrong state is.
    for (id, states) in &states {
        let wrong = states.iter().filter(|(moving, state)| {
            (*moving && *state == MotionState::Static)
                || (!moving && *state == MotionState::Dynamic)
        });
        assert_eq!(wrong.count(), 0, "track {id}: {states:?}");
    }
    // Most sightings of moving cars must be recognised as such.
    let known = states
        .values()
        .flatten()
        .filter(|(moving, state)| *moving && *state == MotionState::Dynamic)
        .count();
    let moving = states.values().flatten().filter(|(moving, _)| *moving).count();
    assert!(
        moving > 15 && known * 10 >= moving * 8,
        "{known} of {moving} sightings of moving cars"
    );
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let [error_m, error_deg] = [median(&mut errors_m), median(&mut errors_deg)];
    println!(
        "motion error of moving cars up to 35 m: median {error_m:.4} m, {error_deg:.3} deg a frame"
    );
    // Of pictures as a lens shows them, where edges are soft.
    assert!(error_m < 0.055 && error_deg < 0.35, "{error_m} m, {error_deg} deg");

    // A second run with detections in reverse.
    let mut again = Vec::new();
    sequence.run(true, true, |_, report, _| again.push(report.digest));
    assert_eq!(again, digests);
}

/// A picture's depth, colour and the layer each pixel shows.
type Picture = Vec<(f32, [u8; 3], u8)>;

fn picture(seen: &Raycaster<'_>) -> Picture {
    let (depth_m, colour, layer) =
        (seen.depth_m().unwrap(), seen.colour().unwrap(), seen.layer().unwrap());
    depth_m
        .rows()
        .flatten()
        .zip(colour.rows().flatten())
        .zip(layer.rows().flatten())
        .map(|((d, c), l)| (*d, *c, *l))
        .collect()
}

#[dynvox_needs::long]
#[test]
fn the_composed_picture_shows_the_nearest_surface_and_cars_at_their_poses() {
    let sequence = &*SEQUENCE;
    let (mut cars, mut totals) = (Vec::new(), [0u32; 3]);
    sequence.run(true, false, |index, report, mapper| {
        // Every third frame is enough; in the first ones no car has a map yet.
        if index < 6 || index % 3 > 0 {
            return;
        }
        let pose = report.t_world_camera;
        // The composed picture, built from one picture for each layer.
        let mut nearest = picture(mapper.raycast(&pose, &Serial).unwrap());
        let tracks: Vec<u32> = mapper.posed_objects().map(|posed| posed.summary.id).collect();
        for (layer, track) in (1..).zip(&tracks) {
            let alone = picture(mapper.raycast_object(*track, &pose, &Serial).unwrap());
            for (nearest, pixel) in nearest.iter_mut().zip(alone) {
                if pixel.0 > 0.0 && (nearest.0 == 0.0 || pixel.0 < nearest.0) {
                    *nearest = (pixel.0, pixel.1, layer);
                }
            }
        }
        let composed = picture(mapper.raycast_composed(&pose, &Serial).unwrap());
        assert!(composed == nearest);
        assert!(mapper.raycast_object(u32::MAX, &pose, &Serial).is_err());

        // Under the mask of a car seen now, an object is shown, as far away as the car is.
        let (frame, seen) = &sequence.frames[index];
        let states: BTreeMap<usize, &str> = mapper
            .tracks()
            .filter(|track| track.detected && tracks.contains(&track.id))
            .filter_map(|track| {
                let near = |seen: &&Seen| {
                    (seen.pixels[0] - track.pixels.left).abs()
                        + (seen.pixels[1] - track.pixels.top).abs()
                };
                Some((seen.iter().min_by_key(near)?.truth, track.state.name()))
            })
            .collect();
        for (truth, state) in states {
            let pixels = composed
                .iter()
                .zip(&frame.depth_m)
                .zip(&frame.instances)
                .filter(|(_, mask)| usize::from(**mask) == truth + 1);
            let (mut shown, mut right, mut all) = (0, 0, 0);
            for (((depth_m, _, layer), true_m), _) in
                pixels.filter(|((_, true_m), _)| **true_m < 20.0)
            {
                all += 1;
                shown += u32::from(*layer > 0);
                right += u32::from(*layer > 0 && (depth_m - true_m).abs() < 0.05 * true_m);
            }
            // Too few pixels say nothing about a car.
            if all < 500 {
                continue;
            }
            cars.push(state);
            println!(
                "frame {index}, car {truth}, {state}: of {all} pixels nearer than 20 m {shown} \
                 show an object, {right} at its distance"
            );
            totals = [totals[0] + all, totals[1] + shown, totals[2] + right];
        }
    });
    assert!(cars.contains(&"static") && cars.contains(&"dynamic"), "{cars:?}");
    let [all, shown, right] = totals;
    println!(
        "of {all} pixels of cars with a volume {shown} show an object, {right} at its distance"
    );
    assert!(shown * 10 > all * 8 && right * 10 > shown * 9);
}

#[dynvox_needs::long]
#[test]
fn one_track_and_one_object_are_used_and_the_rest_is_counted() {
    let sequence = &*SEQUENCE;
    // Fewer slots than cars, down to none at all.
    for (tracks, objects, object_blocks) in [(1, 1, 17), (1, 1, 1), (1, 0, 0)] {
        let capacity = Capacity { tracks, objects, object_blocks, ..CAPACITY };
        let (mut begun, mut refused, mut blocks) = (0, 0, 0);
        sequence.run_within(&capacity, true, false, |_, report, mapper| {
            let (tracks, seen) = (&report.tracking.tracks, &report.objects);
            assert!(
                tracks.tracks <= 1
                    && mapper.tracks().count() <= 1
                    && seen.objects as usize <= objects
            );
            assert!(seen.blocks as usize <= objects * object_blocks);
            refused += tracks.refused;
            begun += seen.begun;
            blocks += seen.blocks_refused;
        });
        assert!(refused > 0, "cars beyond the first are counted");
        assert_eq!(
            (begun > 0, blocks > 0),
            (objects > 0, objects > 0),
            "{objects} objects of {object_blocks} blocks"
        );
    }
}

#[dynvox_needs::long]
#[test]
fn meshes_of_near_cars_lie_on_their_true_surfaces() {
    let sequence = &*SEQUENCE;
    let rig = sequence.street.rig();
    let mut sides: BTreeMap<u32, SeenSide> = BTreeMap::new();
    let (mut medians_m, mut complete) = (Vec::new(), Vec::new());
    sequence.run(true, false, |index, report, mapper| {
        let (frame, seen) = &sequence.frames[index];
        let t_map_world = report.t_world_camera * frame.t_world_camera.inverse();
        let tracks: BTreeMap<u32, TrackReport> =
            mapper.tracks().map(|track| (track.id, track)).collect();
        for (summary, _) in
            mapper.objects().filter(|(summary, _)| summary.last_frame == report.frame)
        {
            let Some(car) = tracks.get(&summary.id).and_then(|track| truth(frame, seen, track))
            else {
                continue;
            };
            let truth = TrueObject {
                id: car.id,
                instance: 0,
                pixels: tracks[&summary.id].pixels,
                t_world_object: car.t_world_object,
                dimensions_m: car.dimensions_m,
                moving: car.moving,
                speed_m_s: car.speed_m_s,
            };
            let view = TrueView {
                rig: &rig,
                depth_m: View::new(&frame.depth_m, frame.width, frame.height).unwrap(),
                t_world_camera: frame.t_world_camera,
                far_m: 20.0,
            };
            let t_truth_object =
                car.t_world_object.inverse() * t_map_world.inverse() * summary.t_world_object;
            sides.entry(summary.id).or_default().add(&view, &truth, &t_truth_object);
        }
        // Surfaces are compared once, at the end.
        if index + 1 < sequence.frames.len() {
            return;
        }
        for (summary, object) in mapper.objects() {
            let mut triangles = Vec::new();
            object
                .volume()
                .triangles(&MeshConfig::default(), &mut |triangle| triangles.push(triangle));
            let Some(figures) =
                sides.get(&summary.id).and_then(|side| side.compare(&triangles, 0.05))
            else {
                continue;
            };
            println!("object {}, {}: {figures:?}", summary.id, summary.state.name());
            // One seen more seldom, or from farther away, is not done yet.
            if figures.nearest_m < 12.0 && figures.frames >= 9 {
                medians_m.push(figures.median_m.unwrap_or(1.0));
                complete.push(figures.completeness);
            }
        }
    });
    assert!(medians_m.len() >= 3, "{medians_m:?}");
    assert!(medians_m.iter().all(|median_m| *median_m <= 0.05), "{medians_m:?}");
    // One car comes this near in the last frame alone, half hidden and with a dark rear window.
    assert!(complete.iter().all(|share| *share >= 0.7), "{complete:?}");
    assert!(complete.iter().sum::<f64>() >= 0.83 * complete.len() as f64, "{complete:?}");
}
