//! The mapper.

use super::arrays::{self, Raycast};
use super::detection::BorrowedDetection;
use super::error::{raise, refuse};
use super::examined::Examined;
use super::images::{Borrowed, Picture};
use super::inertial::{self, InertialUnit};
use super::planning::Plan;
use super::readout::{map_triangles, object_triangles, report_dictionary, track_dictionary};
use super::rig::Rig;
use super::running::{Recipe, Running, State};
use super::{options, pose};
use dynvox_core::egomotion::MotionCovariance;
use dynvox_core::places::PoseFix;
use dynvox_core::view::RaycastView;
use dynvox_core::{FixError, StereoFrame};
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};
use pythonize::pythonize;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A stereo mapper in one slab of memory, which is taken when the pictures' size is known: with
/// `image`, else at the first pair.
///
/// Other threads of Python run while it is made and while it works. One mapper serves one thread at
/// a time; others wait. It belongs to the process that made it: in a forked child every call is an
/// `Error`, and the parent's mapper and files stay as they are.
#[pyclass(frozen, module = "dynvox")]
pub struct Mapper {
    state: Mutex<State>,
    /// Process that made it: a forked child has none of its threads, and not its lock.
    process: u32,
    /// Colour pictures are blue, green, red.
    is_bgr: bool,
}

impl Drop for Mapper {
    fn drop(&mut self) {
        // What a child inherits is the parent's: its file of blocks, and threads that do not run
        // here and would be waited for.
        if self.process != std::process::id() {
            let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
            std::mem::forget(state.running.take());
        }
    }
}

impl Mapper {
    /// The mapper of a data set's run.
    pub fn from_recipe(py: Python<'_>, recipe: Recipe, size: (usize, usize)) -> PyResult<Self> {
        // The data set was examined as a whole.
        let examined = Examined::over();
        let mut state = State { recipe, running: None, examined, is_closed: false };
        py.detach(|| state.running_for(size).map(drop))?;
        Ok(Self::holding(state, false))
    }

    fn holding(state: State, is_bgr: bool) -> Self {
        Self { state: Mutex::new(state), process: std::process::id(), is_bgr }
    }

    fn lock(&self) -> PyResult<MutexGuard<'_, State>> {
        let Self { process, .. } = *self;
        if process != std::process::id() {
            return Err(refuse(format!(
                "this mapper belongs to process {process}. Make one in this process, or start it \
                 with multiprocessing's spawn"
            )));
        }
        self.state.lock().map_err(|_| {
            refuse(
                "the mapper failed within a call: please report it as \
            a bug of dynvox. Make another mapper",
            )
        })
    }

    /// Runs `work` on the mapper while other threads of Python run.
    fn with<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Running) -> PyResult<R> + Send,
    ) -> PyResult<R> {
        py.detach(|| work(self.lock()?.running()?))
    }
}

impl Mapper {
    fn take_fix(
        &self,
        py: Python<'_>,
        take: impl FnOnce(&mut dynvox_core::Mapper<'_>) -> Result<(), FixError> + Send,
    ) -> PyResult<()> {
        self.with(py, |running| {
            running.mapper.with_dependent_mut(|_, mapper| take(mapper)).map_err(|error| {
                refuse(format!(
                    "the fix is not taken: {error}. Make the mapper with keyframes=1000, and give \
                     fixes of frames in which the camera is not lost"
                ))
            })
        })
    }
}

#[pymethods]
impl Mapper {
    #[new]
    #[pyo3(signature = (
        rig, *, image=None, frame_interval_s=None, stream=None, threads=None, force=false,
        channels="rgb", inertial_unit=None, **options
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        rig: Rig,
        image: Option<(usize, usize)>,
        frame_interval_s: Option<f64>,
        stream: Option<Bound<'_, PyAny>>,
        threads: Option<usize>,
        force: bool,
        channels: &str,
        inertial_unit: Option<InertialUnit>,
        options: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        if !matches!(channels, "rgb" | "bgr") {
            return Err(refuse(format!("channels is {channels:?}. Give \"rgb\" or \"bgr\"")));
        }
        let recipe = Recipe {
            request: options::of_mapper(threads, options.as_ref())?,
            blocks: options::blocks(stream.as_ref())?,
            interval_s: frame_interval_s,
            plan: None,
            inertial: inertial_unit.as_ref().map(InertialUnit::config),
            rig,
        };
        let size = image.or(recipe.rig.mapped_size());
        let examined = Examined::new(force);
        let mut state = State { recipe, running: None, examined, is_closed: false };
        match size {
            Some(size) => py.detach(|| state.running_for(size).map(drop))?,
            // What is wrong with the options is said at once, and not at the first picture.
            None => drop(state.recipe.request.check_mapper().map_err(raise)?),
        }
        Ok(Self::holding(state, channels == "bgr"))
    }

    /// Maps one pair and returns the report, with the fields of `dynvox_core::Report` and
    /// `severity`. `segment` numbers the segment of the map that the pose lies in, from 0: another
    /// one begins, with that camera as its world, where the camera was lost and is not found again.
    ///
    /// Pictures are height x width, or height x width x 3 (red, green, blue): the left one is then
    /// fused in colour, and grey is computed. Nothing is copied whose pixels lie side by side in
    /// their rows; rows may lie apart, as in a part of a larger array. Other views, as `[...,
    /// ::-1]`, are copied. `t_world_camera` replaces the egomotion and `disparity_q8` the stereo
    /// matching: give them with every frame. No stage uses the pixels of `ignored`, height x width
    /// of the rectified left picture, that are not 0. A pose must be a rigid motion within the
    /// map's bounds. `fused` in the report is true only if something was fused.
    ///
    /// `inertial` has the samples of the mapper's inertial unit since the frame before: N times, ns
    /// on the clock of `time_ns`, and N x 6 values, turn rates in rad/s and accelerations in m/s2
    /// with gravity. The report says under `inertial` what they told.
    #[pyo3(signature = (
        left, right, *, colour=None, classes=None, disparity_q8=None, ignored=None,
        t_world_camera=None, time_ns=None, detections=None, inertial=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn step<'py>(
        &self,
        py: Python<'py>,
        left: Bound<'py, PyAny>,
        right: Bound<'py, PyAny>,
        colour: Option<Bound<'py, PyAny>>,
        classes: Option<Bound<'py, PyAny>>,
        disparity_q8: Option<Bound<'py, PyAny>>,
        ignored: Option<Bound<'py, PyAny>>,
        t_world_camera: Option<Bound<'py, PyAny>>,
        time_ns: Option<u64>,
        detections: Option<Bound<'py, PyAny>>,
        inertial: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let borrow = if self.is_bgr { Borrowed::<u8>::reversed } else { Borrowed::<u8>::new };
        let (left, right) = (borrow("left", &left)?, borrow("right", &right)?);
        let colour = colour.map(|array| borrow("colour", &array)).transpose()?;
        let classes = classes.map(|array| Borrowed::<u8>::new("classes", &array)).transpose()?;
        let disparity_q8 =
            disparity_q8.map(|array| Borrowed::<u16>::new("disparity_q8", &array)).transpose()?;
        let ignored = ignored.map(|array| Borrowed::<u8>::new("ignored", &array)).transpose()?;
        let found = detections.map(|list| {
            list.try_iter()?.map(|one| BorrowedDetection::new(&one?)).collect::<PyResult<Vec<_>>>()
        });
        let found = found.transpose()?.unwrap_or_default();
        let detections =
            found.iter().map(BorrowedDetection::detection).collect::<PyResult<Vec<_>>>()?;
        let samples = inertial.map(|samples| inertial::given(&samples)).transpose()?;
        let (left, right) = (Picture::of(&left)?, Picture::of(&right)?);
        let frame = StereoFrame {
            colour: colour.as_ref().map(Borrowed::colour).transpose()?.or(left.colour),
            class: classes.as_ref().map(Borrowed::view).transpose()?,
            disparity_q8: disparity_q8.as_ref().map(Borrowed::view).transpose()?,
            ignored: ignored.as_ref().map(Borrowed::view).transpose()?,
            t_world_camera: t_world_camera
                .map(|pose| pose::given("t_world_camera", &pose))
                .transpose()?,
            time_ns,
            detections: &detections,
            inertial: samples.as_deref().unwrap_or_default(),
            ..StereoFrame::pair(left.grey()?, right.grey()?)
        };
        let size = (frame.left.width(), frame.left.height());
        let report = py.detach(|| self.lock()?.step(size, &frame))?;
        report_dictionary(py, &report)
    }

    /// Doubts about the first pairs, in sentences.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        py.detach(|| Ok(self.lock()?.examined.warnings()))
    }

    /// Frees the memory; every later call is an `Error`. A `with` block calls it at its end.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            let mut state = self.lock()?;
            (state.running, state.is_closed) = (None, true);
            Ok(())
        })
    }

    fn __enter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }

    /// Ends a sequence: prunes what is still in the window.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pruned = self.with(py, |running| {
            Ok(running.mapper.with_dependent_mut(|_, mapper| mapper.finish()))
        })?;
        Ok(pythonize(py, &pruned)?)
    }

    /// Tracks after the last step, oldest first.
    #[getter]
    fn tracks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let tracks: Vec<_> = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| mapper.tracks().collect()))
        })?;
        PyList::new(
            py,
            tracks.iter().map(|track| track_dictionary(py, track)).collect::<PyResult<Vec<_>>>()?,
        )
    }

    /// The map's current segment seen from a pose in it, the last one of the camera without one;
    /// with the objects where they are now. Of the image's columns and rows every so many are
    /// looked at.
    #[pyo3(signature = (t_world_camera=None, *, objects=true, every=1))]
    fn raycast<'py>(
        &self,
        py: Python<'py>,
        t_world_camera: Option<Bound<'py, PyAny>>,
        objects: bool,
        every: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let from = t_world_camera.map(|pose| pose::given("t_world_camera", &pose)).transpose()?;
        let (shown, ids) = self.with(py, |Running { mapper, threads, .. }| {
            mapper.with_dependent_mut(|_, mapper| {
                let from = from.unwrap_or(*mapper.t_world_camera());
                let view = RaycastView { every, ..(&from).into() };
                let ids: Vec<u32> = mapper.posed_objects().map(|posed| posed.summary.id).collect();
                let cast = threads.run(|| match objects {
                    true => mapper.raycast_composed(view, threads).map(Raycast::of),
                    false => mapper.raycast(view, threads).map(Raycast::of),
                });
                let action = "Map a frame first, and look from a pose within the map";
                let cast = cast.map_err(|error| {
                    refuse(format!("there is no picture of the map: {error}. {action}"))
                })?;
                Ok((
                    cast.ok_or_else(|| {
                        refuse(format!("there is no picture of the map. {action}"))
                    })?,
                    ids,
                ))
            })
        })?;
        shown.dictionary(py, &ids)
    }

    /// The window around the camera for planners, with moving objects where they will be `ahead_s`
    /// seconds after the last frame; an error of a mapper made without `planning`.
    #[pyo3(signature = (ahead_s=0.0))]
    fn plan<'py>(&self, py: Python<'py>, ahead_s: f32) -> PyResult<Bound<'py, PyDict>> {
        let plan = self.with(py, |running| {
            Ok(running.mapper.with_dependent_mut(|_, mapper| Plan::of(mapper, ahead_s)))
        })?;
        plan.ok_or_else(|| {
            refuse("the mapper has no window for planners. Make it with planning=\"200x200x20\"")
        })?
        .dictionary(py)
    }

    /// Triangles of the static map in the camera's segment, evicted blocks included, or of one
    /// track's object, in the world: positions in metres and colours, both triangles x corners x 3.
    /// Corners run counter-clockwise seen from free space.
    #[pyo3(signature = (object=None))]
    fn triangles<'py>(
        &self,
        py: Python<'py>,
        object: Option<u32>,
    ) -> PyResult<(Bound<'py, PyArray3<f32>>, Bound<'py, PyArray3<u8>>)> {
        let triangles = self.with(py, |running| match object {
            None => map_triangles(running),
            Some(id) => object_triangles(running, id),
        })?;
        triangles.arrays(py)
    }

    /// Pose of the left camera in the last frame, 4 x 4.
    #[getter]
    fn t_world_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let of = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| *mapper.t_world_camera()))
        })?;
        pose::matrix(py, &of)
    }

    /// Change from the world as it is driven to the one after all loops and fixes, at the camera,
    /// 4 x 4: ROS's transform from `map` to `odom`. Reports, plans and objects are in the world as
    /// driven, which never jumps.
    #[getter]
    fn t_closed_driven<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let change = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| mapper.t_closed_driven()))
        })?;
        pose::matrix(py, &change)
    }

    /// Takes a pose of the camera in the last frame that something else measured, in the world of
    /// the first camera, with its covariance, 6 x 6: rotation (rad), then translation (m), in the
    /// camera's axes. Like a loop it moves the keyframes, ten frames later; one that all else
    /// contradicts is taken out. The camera goes on in the world as driven. An error of a mapper
    /// made without `keyframes`.
    fn add_fix(
        &self,
        py: Python<'_>,
        t_world_camera: Bound<'_, PyAny>,
        covariance: [[f64; 6]; 6],
    ) -> PyResult<()> {
        let fix = PoseFix {
            t_world_camera: pose::given("t_world_camera", &t_world_camera)?,
            covariance: MotionCovariance::from_matrix(&covariance),
        };
        self.take_fix(py, |mapper| mapper.add_fix(&fix))
    }

    /// Takes a position of the camera in the last frame, m, with its standard deviations along the
    /// axes of the world, m, as `add_fix` takes a pose.
    fn add_position(
        &self,
        py: Python<'_>,
        position_m: [f64; 3],
        sigma_m: [f64; 3],
    ) -> PyResult<()> {
        self.take_fix(py, |mapper| mapper.add_position(position_m, sigma_m))
    }

    /// Takes the direction that is up in the last frame, in the camera's axes and in those of the
    /// first camera, with the standard deviation of its angle, rad, as `add_fix` takes a pose. It
    /// holds roll and pitch, and with them the height of a long way.
    fn add_vertical(
        &self,
        py: Python<'_>,
        up_camera: [f64; 3],
        up_world: [f64; 3],
        sigma_rad: f64,
    ) -> PyResult<()> {
        self.take_fix(py, |mapper| mapper.add_vertical(up_camera, up_world, sigma_rad))
    }

    /// Disparity of the last frame in 1/256 px, 0 where it is unknown: divide by 256 for pixels. Odd
    /// values of a pair that the mapper matched itself were filled in between measured ones, which
    /// are even. It has size 1 x 1 before the first frame.
    #[getter]
    fn disparity_q8<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u16>>> {
        let (pixels, size) = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| arrays::copied(mapper.disparity_q8())))
        })?;
        arrays::image(py, pixels, size)
    }

    /// Confidence of each disparity of the last frame, 0 without one, else 1 to 255: one more than
    /// the number of measured pixels in the 16 x 16 about it. None unless the setting
    /// `stereo.min_confidence` is above 0 and the mapper matched the pair itself.
    #[getter]
    fn confidence<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<u8>>>> {
        let found = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| mapper.confidence().map(arrays::copied)))
        })?;
        found.map(|(pixels, size)| arrays::image(py, pixels, size)).transpose()
    }

    /// Digest of the last step; None before the first, and after `restore`.
    #[getter]
    fn digest(&self, py: Python<'_>) -> PyResult<Option<u64>> {
        py.detach(|| {
            Ok(self
                .lock()?
                .running
                .as_ref()
                .and_then(|running| running.report)
                .map(|report| report.digest))
        })
    }

    /// Wall time of the last step within the core; None before the first.
    #[getter]
    fn step_seconds(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        py.detach(|| {
            Ok(self
                .lock()?
                .running
                .as_ref()
                .and_then(|running| running.step_time)
                .map(|time| time.as_secs_f64()))
        })
    }

    /// Bytes of the slab.
    #[getter]
    fn slab_bytes(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |running| Ok(running.plan.capacity.bytes()))
    }

    /// All settings, as the config.toml of a run has them.
    #[getter]
    fn config_toml(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |running| Ok(running.plan.config_toml.clone()))
    }

    /// Every region of the slab.
    fn footprint<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let footprint = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| mapper.footprint()))
        })?;
        let regions = footprint.regions().iter().map(|region| {
            let parts = PyDict::new(py);
            parts.set_item("name", region.name)?;
            parts.set_item("bytes", region.bytes)?;
            parts.set_item("used", region.used)?;
            parts.set_item("peak", region.peak)?;
            parts.set_item("placement", region.placement().name())?;
            Ok(parts)
        });
        PyList::new(py, regions.collect::<PyResult<Vec<_>>>()?)
    }

    /// Everything that later steps depend on, evicted blocks included.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.with(py, Running::snapshot)?))
    }

    /// Continues after the step at which the snapshot was taken, bit for bit. The mapper must have
    /// been made with the same rig, bounds and settings. After an error it is as it was made. A
    /// file of `stream` that this mapper did not make is never touched.
    fn restore(&self, py: Python<'_>, snapshot: &[u8]) -> PyResult<()> {
        py.detach(|| self.lock()?.restore(snapshot))
    }
}
