//! Looking at what was made: the static map, the objects where they are now, an object alone.

use super::Mapper;
use crate::{
    Stage,
    geometry::{MapSegment, Transform},
    objects::{MAX_OBJECTS, PosedObject},
    parallel::Executor,
    view::{RaycastError, RaycastView, Raycaster},
    volume::Viewpoint,
};

impl<'s> Mapper<'s> {
    /// Looks at the static map from a pose, at the size of the frames taken so far or thinned out
    /// ([`RaycastView`]). Before the first frame there is no size to look at.
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
    ///     image::View, memory::SLAB_ALIGN,
    /// };
    /// use dynvox_core::view::RaycastView;
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mut mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert!(mapper.raycast(&Transform::IDENTITY, &Serial).is_err(), "no frame, no image size");
    /// let image = View::new(&[90; 320 * 96], 320, 96).unwrap();
    /// mapper.step(&StereoFrame::pair(image, image), &Serial)?;
    /// let view = mapper.raycast(&Transform::IDENTITY, &Serial)?;
    /// assert!(view.depth_m().unwrap().pixels().iter().all(|&depth_m| depth_m == 0.0), "an empty map");
    /// let preview = RaycastView { every: 4, ..RaycastView::from(&Transform::IDENTITY) };
    /// let preview = mapper.raycast(preview, &Serial)?;
    /// assert_eq!(preview.depth_m().map(|depth_m| [depth_m.width(), depth_m.height()]), Some([80, 24]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn raycast<E: Executor>(
        &mut self,
        view: impl Into<RaycastView>,
        executor: &E,
    ) -> Result<&Raycaster<'s>, RaycastError> {
        let (view, segment) = self.viewpoint(view.into())?;
        let map = &mut self.static_map;
        executor.stage(Stage::Raycast, || map.cast_segment(segment, &view, executor))?;
        Ok(&map.raycaster)
    }

    /// Raycasts the map like [`Mapper::raycast`], and where the segment is the camera's every
    /// object at its current pose: each pixel shows the nearest surface (the compositing of Section
    /// III-E). [`Raycaster::layer`] is 0 for the static map and n for the n-th of
    /// [`Mapper::posed_objects`]. Time: one raycast, and one more for each object; there are at
    /// most [`crate::objects::MAX_OBJECTS`].
    ///
    /// ```
    /// # use dynvox_core::{
    /// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
    /// #     image::View, memory::SLAB_ALIGN,
    /// # };
    /// # let rig =
    /// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// # let capacity = Capacity {
    /// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
    /// # };
    /// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
    /// # let view = View::new(&grey, 320, 96).unwrap();
    /// # let frame = StereoFrame {
    /// #     disparity_q8: View::new(&wall, 320, 96),
    /// #     t_world_camera: Some(Transform::IDENTITY),
    /// #     ..StereoFrame::pair(view, view)
    /// # };
    /// # for _ in 0..3 {
    /// #     mapper.step(&frame, &Serial)?;
    /// # }
    /// let picture = mapper.raycast_composed(&Transform::IDENTITY, &Serial)?;
    /// let layers = picture.layer().expect("drawn just now");
    /// assert!(layers.pixels().iter().all(|&layer| layer == 0), "no object, only the map");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn raycast_composed<E: Executor>(
        &mut self,
        view: impl Into<RaycastView>,
        executor: &E,
    ) -> Result<&Raycaster<'s>, RaycastError> {
        let (view, segment) = self.viewpoint(view.into())?;
        let map = &mut self.static_map;
        let objects = if segment == map.volume.segment() { MAX_OBJECTS } else { 0 };
        executor.stage(Stage::Raycast, || {
            map.cast_segment(segment, &view, executor)?;
            let posed = self.objects.posed(&self.tracker).take(objects);
            // The static map is layer 0.
            for (layer, posed) in (1..=u8::MAX).zip(posed) {
                // An object too far away for its coordinates is too far away to be seen.
                let _ = map.raycaster.cast_over(
                    posed.object.volume(),
                    &from_object(&view, &posed),
                    layer,
                    executor,
                );
            }
            Ok::<(), RaycastError>(())
        })?;
        Ok(&map.raycaster)
    }

    /// Looks at nothing but the object of a track, where it is now.
    ///
    /// ```
    /// use dynvox_core::view::RaycastError;
    /// # use dynvox_core::{
    /// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
    /// #     image::View, memory::SLAB_ALIGN,
    /// # };
    /// # let rig =
    /// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// # let capacity = Capacity {
    /// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
    /// # };
    /// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
    /// # let view = View::new(&grey, 320, 96).unwrap();
    /// # let frame = StereoFrame {
    /// #     disparity_q8: View::new(&wall, 320, 96),
    /// #     t_world_camera: Some(Transform::IDENTITY),
    /// #     ..StereoFrame::pair(view, view)
    /// # };
    /// # for _ in 0..3 {
    /// #     mapper.step(&frame, &Serial)?;
    /// # }
    /// let picture = mapper.raycast_object(1, &Transform::IDENTITY, &Serial);
    /// assert!(matches!(picture, Err(RaycastError::Object)), "track 1 is not reconstructed");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn raycast_object<E: Executor>(
        &mut self,
        track: u32,
        view: impl Into<RaycastView>,
        executor: &E,
    ) -> Result<&Raycaster<'s>, RaycastError> {
        let (view, _) = self.viewpoint(view.into())?;
        let posed = self
            .objects
            .posed(&self.tracker)
            .find(|posed| posed.summary.id == track)
            .ok_or(RaycastError::Object)?;
        // The camera is moved into the object's frame, in which the volume stands still.
        let view = from_object(&view, &posed);
        executor.stage(Stage::Raycast, || {
            self.static_map.raycaster.cast(posed.object.volume(), &view, executor)
        })?;
        Ok(&self.static_map.raycaster)
    }

    /// The objects that are in the world after the last frame.
    pub fn posed_objects(&self) -> impl Iterator<Item = PosedObject<'_, 's>> {
        self.objects.posed(&self.tracker)
    }

    /// Viewpoint and segment of a view.
    #[inline(always)]
    fn viewpoint(&self, view: RaycastView) -> Result<(Viewpoint, MapSegment), RaycastError> {
        let segment = view.segment.unwrap_or(self.static_map.volume.segment());
        let whole = self.whole_view(&view.t_world_camera)?;
        Ok((whole.thinned(view.every).ok_or(RaycastError::ImageSize)?, segment))
    }

    fn whole_view(&self, t_world_camera: &Transform) -> Result<Viewpoint, RaycastError> {
        let [width, height] = self.size.ok_or(RaycastError::ImageSize)?;
        Ok(Viewpoint {
            rig: self.config.scaled_rig(),
            width,
            height,
            t_world_camera: *t_world_camera,
        })
    }
}

/// A view of the world as a view from an object's frame.
fn from_object(view: &Viewpoint, posed: &PosedObject<'_, '_>) -> Viewpoint {
    Viewpoint {
        t_world_camera: (posed.t_world_object.inverse() * view.t_world_camera).normalized(),
        ..*view
    }
}
