use super::*;
use crate::input::LidarScan;
use dynvox_core::geometry::Transform;
use dynvox_core::image::View;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{Class, InstanceAt, MotionState};

const FOCAL_PX: f64 = 700.0;
const BASELINE_M: f64 = 0.55;
const FIELD: Field = Field { width: 1240, height: 370, near_m: 0.5, far_m: 20.0 };

/// One LiDAR hit at its pixel: column, row, true disparity, the input's and the map's (0 where
/// missing).
type Hit = (i32, i32, f64, f32, f32);

/// Two cameras whose rows differ as those of KITTI's colour pair do: by 2 px at one metre.
fn scan(hits: &[(i32, i32, f64)]) -> LidarScan {
    let camera = |shift: f64, rows: f64| {
        [FOCAL_PX, 0.0, 620.0, shift, 0.0, FOCAL_PX, 185.0, rows, 0.0, 0.0, 1.0, 0.0]
    };
    let point = |&(u, v, disparity_px): &(i32, i32, f64)| {
        let z = FOCAL_PX * BASELINE_M / disparity_px;
        // A little beside the pixel's middle: the nearest pixel counts.
        [
            (f64::from(u) + 0.3 - 620.0) * z / FOCAL_PX,
            (f64::from(v) - 0.4 - 185.0) * z / FOCAL_PX,
            z,
        ]
    };
    LidarScan {
        points_m: hits.iter().map(point).collect(),
        cameras: [camera(0.0, 0.0), camera(-FOCAL_PX * BASELINE_M, 2.0)],
    }
}

/// A frame's masks, each with what is behind it.
struct Masks(Vec<(PixelBox, InstanceAt)>);

impl Masks {
    fn region(&self, u: i32, v: i32) -> Region {
        Region::from_instance(
            self.0.iter().find(|(pixels, _)| pixels.contains(u, v)).map(|(_, instance)| instance),
        )
    }
}

fn masks(shift: i32) -> Masks {
    let of = |left: i32, class, state| {
        let pixels = PixelBox { left: left + shift, top: 200, width: 40, height: 40 };
        (pixels, InstanceAt { class, track: Some(1), state })
    };
    Masks(vec![
        of(700, Class::Car, MotionState::Static),
        of(800, Class::Car, MotionState::Uncertain),
        of(900, Class::Person, MotionState::Dynamic),
        of(1000, Class::Other, MotionState::Uncertain),
    ])
}

/// Points of the scene: each a way in which an evaluation can go wrong.
const HITS: [Hit; 13] = [
    (300, 180, 900.0, 0.0, 0.0),     // nearer than 0.5 m
    (310, 180, 19.0, 19.0, 19.0),    // farther than 20 m
    (1240, 180, 40.0, 0.0, 0.0),     // one column beside the image
    (330, 180, 250.0, 250.0, 250.0), // its rows differ by 1.3 px; evaluated all the same
    (340, 180, 40.0, 40.0, 41.0),    // right in both
    (350, 180, 90.0, 90.0, 93.5),    // 3.5 px off, but under 5 %
    (360, 180, 25.0, 25.0, 28.5),    // 3.5 px off
    (370, 180, 30.0, 30.0, 0.0),     // the map lacks it
    (380, 180, 30.0, 0.0, 36.0),     // the input lacks it, the map has it wrong
    (390, 180, 30.0, 0.0, 0.0),      // both lack it
    (720, 220, 50.0, 50.0, 50.0),    // on a parked car
    (820, 220, 50.0, 50.0, 20.0),    // on a car of unknown motion
    (920, 220, 50.0, 20.0, 50.0),    // on a person
];

/// One frame's points, settled with that frame's masks; and the map's depth where the hits say so.
fn pending(frame: usize, hits: &[Hit], masks: &Masks) -> (PendingFrame, Vec<f32>) {
    let points: Vec<(i32, i32, f64)> =
        hits.iter().map(|&(u, v, true_px, ..)| (u, v, true_px)).collect();
    let scanned = project_scan(&scan(&points), &FIELD);
    // The input's disparity at the pixels of the points, 0 elsewhere.
    let input = |u: usize, v: usize| {
        hits.iter().find(|hit| (hit.0 as usize, hit.1 as usize) == (u, v)).map_or(0.0, |hit| hit.3)
    };
    let mut map_depth_m = vec![0.0; FIELD.width * FIELD.height];
    for &(u, v, _, _, shown_px) in hits.iter().filter(|hit| hit.4 > 0.0) {
        if let Some(depth_m) = map_depth_m
            .get_mut(v as usize * FIELD.width + u as usize)
            .filter(|_| u < FIELD.width as i32)
        {
            *depth_m = (FOCAL_PX * BASELINE_M) as f32 / shown_px;
        }
    }
    (
        PendingFrame::new(frame, (&Transform::IDENTITY).into(), &scanned, input, |u, v| {
            masks.region(u, v)
        }),
        map_depth_m,
    )
}

fn compare(frame: &PendingFrame, map_depth_m: &[f32]) -> EvaluatedFrame {
    frame
        .compare(
            &View::new(map_depth_m, FIELD.width, FIELD.height).unwrap(),
            FOCAL_PX * BASELINE_M,
            1.0,
        )
        .0
}

/// Position of a plain threshold among the rules.
fn plain(px: f32) -> usize {
    ACCEPTANCE_RULES.iter().position(|rule| *rule == Rule { px, share: 0.0 }).unwrap()
}

/// Total, missing; then by source: missing alone, errors by KITTI's rule on the intersection and
/// alone.
fn numbers(counts: &Counts) -> (u32, u32, [[u32; 3]; 2]) {
    (
        counts.total,
        counts.missing,
        counts.sources.map(|of| [of.missing_alone, of.errors[0], of.errors_alone[0]]),
    )
}

#[test]
fn every_point_of_the_hand_made_scene_is_counted_once_and_right() {
    let (frame, map) = pending(0, &HITS, &masks(0));
    let found = compare(&frame, &map);
    assert_eq!(found.count, ScanCount { points: 13, out_of_range: 2, outside: 1, epipolar: 1 });
    let [still, dynamic, ignored] = found.regions;
    // Seven points of the street; input or map lacks three of them. Compared are 250, 40, 90 and 25
    // px.
    assert_eq!(numbers(&still), (7, 3, [[2, 0, 0], [2, 1, 2]]));
    assert_eq!(numbers(&dynamic), (1, 0, [[0, 0, 0], [0, 0, 0]]));
    assert_eq!(numbers(&ignored), (2, 0, [[0, 1, 1], [0, 1, 1]]));
    assert_eq!((still.accuracy(0, 0), still.accuracy(1, 0)), (Some(1.0), Some(3.0 / 4.0)));
    assert_eq!(
        (still.accuracy_alone(0, 0), still.accuracy_alone(1, 0)),
        (Some(1.0), Some(3.0 / 5.0))
    );
    assert_eq!((still.completeness(0), still.completeness(1)), (Some(5.0 / 7.0), Some(5.0 / 7.0)));
    assert!(
        (still.f1(1, 0).unwrap() - 2.0 * 0.75 * (5.0 / 7.0) / (0.75 + 5.0 / 7.0)).abs() < 1e-12
    );
    // Plain thresholds do not forgive 3.5 px at 90 px.
    assert_eq!([0.5, 1.0, 3.0, 4.0].map(|px| still.sources[1].errors[plain(px)]), [3, 2, 2, 0]);
    for counts in found.regions {
        assert!(counts.sources.iter().all(|of| of.missing_alone <= counts.missing
            && of.errors.iter().all(|&errors| errors + counts.missing <= counts.total)));
    }
    let figures = ReferenceFigures::from_frames("lidar", 0, &[found], None).unwrap();
    assert_eq!(
        (figures.left_out_points, figures.ignored_points, figures.epipolar_violations),
        (3, 2, 1)
    );
    assert_eq!(
        (
            figures.still.fused.accuracy,
            figures.still.fused.points,
            figures.dynamic.as_ref().map(|of| of.frames)
        ),
        (Some(0.75), 7, Some(1))
    );
}

#[test]
fn a_delayed_evaluation_splits_the_points_by_the_masks_of_their_own_frame() {
    let mut delay = PendingFrames::default();
    let (first, _) = pending(7, &HITS, &masks(0));
    assert!(delay.step(2, Some(first)).is_none());
    assert!(delay.step(2, None).is_none(), "a frame without a scan takes its place in the row");
    // Two frames later the masks have moved on: over points that were street.
    let later = Masks(vec![(
        PixelBox { left: 320, top: 160, width: 60, height: 40 },
        InstanceAt { class: Class::Car, track: Some(1), state: MotionState::Dynamic },
    )]);
    let (second, mut map) = pending(9, &HITS, &later);
    let past = delay.step(2, Some(second)).unwrap();
    assert_eq!(past.frame, 7);
    // The map is that of now, of the street alone: where the parked car was it shows nothing.
    map[220 * FIELD.width + 720] = 0.0;
    let found = compare(&past, &map);
    assert_eq!(found.count, ScanCount { points: 13, out_of_range: 2, outside: 1, epipolar: 1 });
    let [still, dynamic, ignored] = found.regions;
    assert_eq!(numbers(&still), (7, 3, [[2, 0, 0], [2, 1, 2]]));
    assert_eq!(numbers(&dynamic), (1, 1, [[0, 0, 0], [1, 0, 0]]));
    assert_eq!(numbers(&ignored), (2, 0, [[0, 1, 1], [0, 1, 1]]));
    assert_eq!(
        (dynamic.accuracy(1, 0), dynamic.completeness(1), dynamic.f1(1, 0)),
        (None, Some(0.0), None)
    );
    assert_eq!(delay.step(2, None).map(|frame| frame.frame), None);
    let present = delay.step(2, None).unwrap();
    assert_eq!(present.frame, 9);
    // The frame of the other masks: five points that were street lie on a car now.
    let [still, dynamic, ignored] = compare(&present, &map).regions;
    assert_eq!([still.total, dynamic.total, ignored.total], [5, 5, 0]);
}

#[test]
fn frames_without_a_compared_point_are_left_out_of_the_means() {
    let counts = |points: &[[f32; 3]]| {
        let mut counts = Counts::default();
        points.iter().for_each(|&[true_px, input, map]| counts.add(true_px, [input, map]));
        EvaluatedFrame {
            frame: 0,
            count: ScanCount::default(),
            regions: [counts, Counts::default(), Counts::default()],
        }
    };
    // Right and wrong, missing, and no point at all.
    let frames = [
        counts(&[[20.0, 20.0, 20.0], [20.0, 20.0, 30.0]]),
        counts(&[[20.0, 20.0, 0.0]]),
        counts(&[]),
    ];
    let fused = ReferenceFigures::from_frames("lidar", 0, &frames, None).unwrap().still;
    assert_eq!(
        (fused.fused.accuracy, fused.fused.completeness, fused.frames),
        (Some(0.5), Some(0.5), 2)
    );
    assert!(
        (fused.fused.f1.unwrap() - 2.0 / 3.0).abs() < 1e-12,
        "the second frame has no accuracy, hence no F1"
    );
    assert!(ReferenceFigures::from_frames("lidar", 0, &[], None).is_none());
    assert!(
        ReferenceFigures::from_frames("lidar", 20, &frames, None).unwrap().dynamic.is_none(),
        "objects' places in past frames are not kept"
    );
}

#[test]
fn errors_are_counted_at_full_size_for_every_scale() {
    let (frame, map) = pending(0, &[(300, 180, 30.0, 30.0, 28.0)], &masks(0));
    let wrong = |enlarged: f32| {
        let view = View::new(&map, FIELD.width, FIELD.height).unwrap();
        let (found, _) = frame.compare(&view, FOCAL_PX * BASELINE_M, enlarged);
        found.regions[Region::Static as usize].sources[1].errors[0]
    };
    assert_eq!((wrong(1.0), wrong(2.0)), (0, 1), "2 px at half the size are 4 px");
}
