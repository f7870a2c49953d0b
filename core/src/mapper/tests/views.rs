//! Looking at what was made, and finding a camera again by it.

use super::*;
use crate::{
    PoseOrigin,
    egomotion::MAX_REFERENCE_FRAMES,
    view::{RaycastError, RaycastView},
};

fn depths(
    mapper: &mut Mapper<'_>,
    cast: impl FnOnce(&mut Mapper<'_>) -> Result<(), RaycastError>,
) -> Vec<f32> {
    cast(mapper).unwrap();
    Vec::from(mapper.static_map.raycaster.depth_m().unwrap().pixels())
}

#[test]
fn a_composed_view_shows_what_is_nearest_of_the_map_and_the_objects() {
    let walk = Walk::new(6);
    with_mapper(&walk, 6, |mapper, reports| {
        assert_eq!(reports[5].objects.objects, 1);
        let t_world_camera = reports[5].t_world_camera;
        let ids: Vec<u32> = mapper.posed_objects().map(|posed| posed.summary.id).collect();
        assert_eq!(ids.len(), 1);
        // The composed picture, made by hand from its two layers.
        let map = depths(mapper, |mapper| mapper.raycast(&t_world_camera, &Serial).map(|_| ()));
        let object = depths(mapper, |mapper| {
            mapper.raycast_object(ids[0], &t_world_camera, &Serial).map(|_| ())
        });
        let composed =
            depths(mapper, |mapper| mapper.raycast_composed(&t_world_camera, &Serial).map(|_| ()));
        let layers = Vec::from(mapper.static_map.raycaster.layer().unwrap().pixels());
        let shown = |depths: &[f32]| depths.iter().filter(|depth_m| **depth_m > 0.0).count();
        assert!(
            shown(&map) > 3_000 && shown(&object) > 500,
            "{} px of the map, {} of the object",
            shown(&map),
            shown(&object)
        );
        for at in 0..map.len() {
            let is_object = object[at] > 0.0 && (map[at] == 0.0 || object[at] < map[at]);
            assert_eq!(composed[at], if is_object { object[at] } else { map[at] }, "pixel {at}");
            assert_eq!(layers[at], u8::from(is_object), "pixel {at}");
        }
        // A thinned picture shows the same pixels, fewer of them.
        for every in [2, 4] {
            let preview = RaycastView { t_world_camera, every };
            let thinned =
                depths(mapper, |mapper| mapper.raycast_composed(preview, &Serial).map(|_| ()));
            let kept =
                composed.chunks(WIDTH).step_by(every).flat_map(|row| row.iter().step_by(every));
            assert!(thinned.iter().eq(kept), "every {every}");
        }
        let none = RaycastView { t_world_camera, every: 0 };
        assert_eq!(mapper.raycast(none, &Serial).err(), Some(RaycastError::ImageSize));
        // Its mask is the object's place in the image, but for where it has moved on.
        let [left, top, width, height] = Walk::CAR.map(|px| px as usize);
        let outside = |at: usize| {
            let (u, v) = (at % WIDTH, at / WIDTH);
            u + 40 < left || u > left + width + 40 || v + 40 < top || v > top + height + 40
        };
        assert!((0..object.len()).all(|at| object[at] == 0.0 || !outside(at)));
        assert_eq!(
            mapper.raycast_object(ids[0] + 1, &t_world_camera, &Serial).err(),
            Some(RaycastError::Object)
        );
        let nowhere = Transform::from_translation([f64::NAN, 0.0, 0.0]);
        assert_eq!(mapper.raycast_composed(&nowhere, &Serial).err(), Some(RaycastError::Viewpoint));
    });
    with_mapper(&walk, 0, |mapper, _| {
        assert_eq!(
            mapper.raycast(&Transform::IDENTITY, &Serial).err(),
            Some(RaycastError::ImageSize),
            "no frame yet"
        );
        assert_eq!(
            mapper.raycast_object(1, &Transform::IDENTITY, &Serial).err(),
            Some(RaycastError::ImageSize)
        );
        assert_eq!(mapper.posed_objects().count(), 0);
    });
}

/// Frames until the camera is covered, and the first that is seen again.
const SEEN: usize = 5;
const AGAIN: usize = SEEN + MAX_REFERENCE_FRAMES as usize + 1;

/// Walks, is covered until it is lost, and goes on; the last report, and how far its pose is from
/// where the camera is, m.
fn lost(capacity: &Capacity) -> (Report, f64) {
    let pose = |at: usize| {
        Transform::new(
            Vector3::new(0.0, 0.003 * at as f64, 0.0),
            Vector3::new(0.0, 0.0, 0.06) * at as f64,
        )
    };
    let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(capacity, &Walk::config(), &mut slab[start..]).unwrap();
    let dark = vec![0u8; WIDTH * HEIGHT];
    // Black images in between: the camera is lost, and then sees the scene again.
    let mut last = Report::default();
    for at in 0..AGAIN + 2 {
        let pair =
            if (SEEN..AGAIN).contains(&at) { [dark.clone(), dark.clone()] } else { see(&pose(at)) };
        let [left, right] = pair.each_ref().map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        last = mapper.step(&StereoFrame::pair(left, right), &Serial).unwrap();
        let expected = if at == 0 {
            PoseOrigin::First
        } else if at < SEEN {
            PoseOrigin::Estimated
        } else {
            PoseOrigin::Extrapolated
        };
        assert!(last.pose == expected || at == AGAIN + 1, "frame {at}: {:?}", last.pose);
        assert!(
            !last.fused || last.pose != PoseOrigin::Extrapolated,
            "a frame whose pose is a guess is not fused"
        );
    }
    let difference = last.t_world_camera.inverse() * pose(AGAIN + 1);
    (last, difference.distance_m())
}

#[test]
fn a_camera_that_was_lost_is_found_where_the_map_looks_like_the_image() {
    let (report, off_m) = lost(&Capacity { colour: true, ..CAPACITY });
    assert_eq!((report.pose, report.segment), (PoseOrigin::Relocalized, 0));
    assert!(off_m < 0.1, "{off_m} m");
}

#[test]
fn a_camera_that_was_lost_begins_a_segment_where_the_map_has_no_picture() {
    let (report, off_m) = lost(&CAPACITY);
    assert_eq!((report.pose, report.segment), (PoseOrigin::Estimated, 1));
    assert!((off_m - crate::egomotion::SEGMENT_GAP_M).abs() < 1.0, "{off_m} m above");
}
