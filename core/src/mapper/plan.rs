//! Maps for planners, with the objects that the mapper knows: those that stand as obstacles, those
//! that move as boxes.
//!
//! | object | in the window |
//! |---|---|
//! | has a map and does not move | its surface, as the static map's |
//! | moves, has a map | a box around its surface |
//! | moves or may move, no map, detected now | a box around what its mask shows; still until its motion is known |

use super::Mapper;
use crate::{
    geometry::{GroundPlane, StereoRig, Transform},
    objects::PosedObject,
    planning::{
        BoxFit, DepthView, Grid, MARGIN_PX, MovingBox, Planning, PlanningReport, crossings,
    },
    tracking::{MotionState, Track},
};

/// Rows and columns from one pixel of a mask that is looked at to the next.
const PIXEL_STEP: usize = 2;
/// Fewest points of a box.
const POINTS_MIN: f64 = 8.0;
/// Disparities that are told apart to find an object's middle one, px.
const DISPARITIES: usize = 256;

impl<'s> Mapper<'s> {
    /// Reads the maps into the planner's window, finds the ground, and makes the slice and the
    /// distance fields, with moving objects where they will be `ahead_s` seconds after the last
    /// frame. Nothing where the capacity has no window.
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, Mapper, Serial, StereoFrame, geometry::StereoRig, image::View,
    ///     memory::SLAB_ALIGN,
    /// };
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let capacity = Capacity { planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY };
    /// let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// let (image, disparity_q8) = ([90; 320 * 96], [10 << 8; 320 * 96]); // a wall 10 m ahead
    /// let [view, wall] = [View::new(&image, 320, 96).unwrap(); 2];
    /// let disparity_q8 = View::new(&disparity_q8, 320, 96);
    /// for _ in 0..3 {
    ///     mapper.step(&StereoFrame { disparity_q8, t_world_camera: Some(Default::default()), ..StereoFrame::pair(view, wall) }, &Serial)?;
    /// }
    /// let report = mapper.update_planning_maps(0.0);
    /// assert!(report.free > 100);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn update_planning_maps(&mut self, ahead_s: f32) -> PlanningReport {
        if self.planning.is_empty() {
            return PlanningReport::default();
        }
        self.planning.read(&self.static_map.volume);
        // An uncertain object counts as static: its surface is an obstacle where it was last seen.
        let is_static = |posed: &PosedObject<'_, '_>| posed.summary.state != MotionState::Dynamic;
        for posed in self.objects.posed(&self.tracker).filter(is_static) {
            self.planning.add_static(posed.object.volume(), &posed.t_world_object);
        }
        // A full list of boxes is no error: the report counts what it lacks.
        let mut refused = 0;
        for (track, _) in self.tracker.tracks_with_instances() {
            if let Some(moving) = self.moving_box(track) {
                refused += u32::from(!self.planning.add_moving(moving));
            }
        }
        PlanningReport { boxes_refused: refused, ..self.planning.finish(ahead_s) }
    }

    /// Marks what the frame sees through in the planner's window, where the capacity has one.
    pub(super) fn observe_free_space(
        &mut self,
        t_world_camera: &Transform,
        ground: Option<GroundPlane>,
    ) {
        let rig = self.config.scaled_rig();
        self.planning.observe(&DepthView {
            rig: &rig,
            t_world_camera,
            disparity_q8: self.stereo.disparity_q8(),
            ground,
            within_m: self.static_map.fused_within_m(),
        });
    }

    /// Draws the moving objects at another time, see [`Planning::predict`].
    pub fn plan_ahead(&mut self, ahead_s: f32) -> PlanningReport {
        self.planning.predict(ahead_s)
    }

    /// The planner's window, as the last [`Mapper::update_planning_maps`] left it.
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
    /// mapper.update_planning_maps(0.0);
    /// let planning = mapper.planning();
    /// let camera = planning.grid().of_world([0.0; 3]);
    /// let cell = planning.grid().cell_at(camera).expect("within the grid");
    /// assert!((0..3).all(|axis| cell[axis] >= planning.origin()[axis]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn planning(&self) -> &Planning<'s> {
        &self.planning
    }

    /// Returns the planning maps like [`Mapper::planning`], to cut other slices.
    pub fn planning_mut(&mut self) -> &mut Planning<'s> {
        &mut self.planning
    }

    /// The box of a track that moves or may move; `None` of one that stands, and where too little
    /// of it was seen.
    fn moving_box(&self, track: &Track) -> Option<MovingBox> {
        let state = track.motion_state.state();
        let moves = state == MotionState::Dynamic;
        let posed = self.objects.posed(&self.tracker).find(|posed| posed.summary.id == track.id);
        // A static object is in the map already.
        if state == MotionState::Static || (!moves && posed.is_some()) {
            return None;
        }
        let (grid, rig) = (self.planning.grid(), self.config.scaled_rig());
        let in_grid = |vector: [f64; 3]| grid.of_world(vector).map(|c| c * grid.cell_m());
        let velocity = if moves { in_grid(track.filter.velocity().into()) } else { [0.0; 3] };
        let velocity = [velocity[0], velocity[1]];
        // The box's heading is that of the motion.
        let mut fit = BoxFit::new(velocity, in_grid(track.filter.center_world().coords.into()));
        match &posed {
            Some(posed) => self.add_object(&mut fit, posed),
            None if track.instance.is_some() => self.add_mask(&mut fit, track, &rig),
            None => return None,
        }
        let moving = fit.solve().filter(|_| fit.points() >= POINTS_MIN)?;
        // An object that has not moved may begin to: up to the speed that would make it dynamic.
        let sigma_m_s =
            if moves { track.sigma_m_s } else { self.config.tracking.state.dynamic_m_s };
        Some(MovingBox {
            id: track.id,
            unseen_frames: self.tracker.frame().saturating_sub(track.last_frame),
            velocity_m_s: velocity.map(|c| c as f32),
            sigma_m: self.depth_sigma_m(grid, &moving, &rig),
            sigma_m_s,
            ..moving
        })
    }

    /// Takes in the surface of an object that has a map.
    fn add_object(&self, fit: &mut BoxFit, posed: &PosedObject<'_, '_>) {
        let (volume, grid) = (posed.object.volume(), self.planning.grid());
        let voxel_m = f64::from(volume.config().voxel_size_m);
        for (slot, coord) in volume.current_blocks() {
            crossings(volume, slot, coord, self.config.planning.min_weight, |crossing| {
                // The object's map is in its own frame.
                let point = posed.t_world_object.transform_point(crossing.point_m(voxel_m));
                fit.add(grid.of_world(point).map(|c| c * grid.cell_m()));
            });
        }
    }

    /// Takes in what this frame's mask of a track shows, within an object's extent of its middle
    /// disparity.
    fn add_mask(&self, fit: &mut BoxFit, track: &Track, rig: &StereoRig) {
        let (disparity_q8, grid) = (self.stereo.disparity_q8(), self.planning.grid());
        let pixels = track.mask.pixels;
        // Clipped to the image: a mask's box may reach beyond it.
        let span = |from: i32, length: i32, size: usize| {
            let [from, to] =
                [from, from.saturating_add(length)].map(|at| usize::try_from(at).unwrap_or(0));
            (from..if to < size { to } else { size }).step_by(PIXEL_STEP)
        };
        let rows = || span(pixels.top, pixels.height, disparity_q8.height());
        let shown = || {
            rows()
                .flat_map(|v| {
                    span(pixels.left, pixels.width, disparity_q8.width()).map(move |u| (u, v))
                })
                .filter_map(|(u, v)| {
                    let disparity = disparity_q8.get(u, v).filter(|disparity| *disparity > 0)?;
                    let instance = self.tracker.instance_at(u as i32, v as i32)?;
                    (instance.track == Some(track.id)).then_some((u, v, disparity))
                })
        };
        // The median disparity is the object's: windows and rims show other surfaces.
        let mut counts = [0u32; DISPARITIES];
        for (_, _, disparity) in shown() {
            if let Some(count) = counts.get_mut(usize::from(disparity >> 8)) {
                *count += 1;
            }
        }
        let half = counts.iter().sum::<u32>() / 2;
        let mut sum = 0;
        let middle = counts.iter().position(|count| {
            sum += count;
            sum > half
        });
        let Some(middle) = middle else { return };
        let depth_m = |disparity_px: f64| rig.focal_baseline_px_m() / disparity_px;
        let middle_m = depth_m(middle as f64 + 0.5);
        let extent_m = f64::from(self.config.objects.extent_m);
        // Pixels near that depth span the box.
        for (u, v, disparity) in shown() {
            let z = depth_m(f64::from(disparity) / 256.0);
            if libm::fabs(z - middle_m) <= extent_m {
                let [x, y] = [u as f64 - rig.center_u_px, v as f64 - rig.center_v_px]
                    .map(|px| px * z / rig.focal_px);
                fit.add(
                    grid.of_world(self.t_world_camera().transform_point([x, y, z]))
                        .map(|c| c * grid.cell_m()),
                );
            }
        }
    }

    /// Error of a box's place: what the expected error of disparity makes of its distance.
    fn depth_sigma_m(&self, grid: &Grid, moving: &MovingBox, rig: &StereoRig) -> f32 {
        let camera = grid.of_camera(self.t_world_camera()).1.map(|c| c * grid.cell_m());
        let [x, y] = [0, 1].map(|axis: usize| {
            let of = |point: &[f64]| point.get(axis).copied().unwrap_or_default();
            of(&moving.center_m.map(f64::from)) - of(&camera)
        });
        let square = x * x + y * y;
        (square * f64::from(MARGIN_PX) / rig.focal_baseline_px_m()) as f32
    }
}
