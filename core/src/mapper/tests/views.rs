//! Looking at what was made.

use super::*;
use crate::view::{RaycastError, RaycastView};

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
            let preview = RaycastView { every, ..RaycastView::from(&t_world_camera) };
            let thinned =
                depths(mapper, |mapper| mapper.raycast_composed(preview, &Serial).map(|_| ()));
            let kept =
                composed.chunks(WIDTH).step_by(every).flat_map(|row| row.iter().step_by(every));
            assert!(thinned.iter().eq(kept), "every {every}");
        }
        let none = RaycastView { every: 0, ..RaycastView::from(&t_world_camera) };
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
