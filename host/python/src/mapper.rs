//! The mapper.

use super::arrays::{self, Raycast, Triangles};
use super::blocks::BlocksChoice;
use super::detection::BorrowedDetection;
use super::error::{raise, refuse};
use super::images::{Borrowed, Picture};
use super::planning::Plan;
use super::rig::Rig;
use super::running::{Recipe, Running, State};
use super::{options, pose};
use dynvox::Request;
use dynvox::request::MapperPlan;
use dynvox::run::store::{self, OneSegment};
use dynvox::slab::HostSlab;
use dynvox_core::tracking::TrackReport;
use dynvox_core::view::{RaycastView, Triangle};
use dynvox_core::volume::BlockKey;
use dynvox_core::{Report, StereoFrame};
use hashbrown::HashSet;
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use pythonize::pythonize;
use std::sync::{Mutex, MutexGuard};

/// Bytes in which evicted blocks are meshed, a cube of the map at a time.
const MESH_BYTES: usize = 8 << 20;

/// A stereo mapper in one slab of memory.
#[pyclass(frozen, module = "dynvox")]
pub struct Mapper {
    state: Mutex<State>,
}

impl Mapper {
    /// The mapper of a data set's run.
    pub fn of_plan(
        rig: Rig,
        size: (usize, usize),
        plan: MapperPlan,
        blocks: BlocksChoice,
    ) -> PyResult<Self> {
        let request = Request::default();
        let recipe = Recipe { rig, request, interval_s: None, plan: Some(plan), blocks };
        let mut state = State { recipe, running: None };
        state.running_for(size)?;
        Ok(Self { state: Mutex::new(state) })
    }

    fn lock(&self) -> PyResult<MutexGuard<'_, State>> {
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

#[pymethods]
impl Mapper {
    #[new]
    #[pyo3(signature = (rig, *, image=None, frame_interval_s=None, stream=None, threads=None, **options))]
    fn new(
        rig: Rig,
        image: Option<(usize, usize)>,
        frame_interval_s: Option<f64>,
        stream: Option<Bound<'_, PyAny>>,
        threads: Option<usize>,
        options: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let recipe = Recipe {
            request: options::of_mapper(threads, options.as_ref())?,
            blocks: options::blocks(stream.as_ref())?,
            interval_s: frame_interval_s,
            plan: None,
            rig,
        };
        let size = image.or(recipe.rig.mapped_size());
        let mut state = State { recipe, running: None };
        match size {
            Some(size) => drop(state.running_for(size)?),
            // What is wrong with the options is said at once, and not at the first picture.
            None => drop(state.recipe.request.check_mapper().map_err(raise)?),
        }
        Ok(Self { state: Mutex::new(state) })
    }

    #[pyo3(signature = (left, right, *, colour=None, classes=None, disparity_q8=None, t_world_camera=None, time_ns=None, detections=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn step<'py>(
        &self,
        py: Python<'py>,
        left: Bound<'py, PyAny>,
        right: Bound<'py, PyAny>,
        colour: Option<Bound<'py, PyAny>>,
        classes: Option<Bound<'py, PyAny>>,
        disparity_q8: Option<Bound<'py, PyAny>>,
        t_world_camera: Option<Bound<'py, PyAny>>,
        time_ns: Option<u64>,
        detections: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (left, right) = (Borrowed::new("left", &left)?, Borrowed::new("right", &right)?);
        let colour = colour.map(|array| Borrowed::<u8>::new("colour", &array)).transpose()?;
        let classes = classes.map(|array| Borrowed::<u8>::new("classes", &array)).transpose()?;
        let disparity_q8 =
            disparity_q8.map(|array| Borrowed::<u16>::new("disparity_q8", &array)).transpose()?;
        let found = detections.map(|list| {
            list.try_iter()?.map(|one| BorrowedDetection::new(&one?)).collect::<PyResult<Vec<_>>>()
        });
        let found = found.transpose()?.unwrap_or_default();
        let detections =
            found.iter().map(BorrowedDetection::detection).collect::<PyResult<Vec<_>>>()?;
        let (left, right) = (Picture::of(&left)?, Picture::of(&right)?);
        let frame = StereoFrame {
            colour: colour.as_ref().map(Borrowed::colour).transpose()?.or(left.colour),
            class: classes.as_ref().map(Borrowed::view).transpose()?,
            disparity_q8: disparity_q8.as_ref().map(Borrowed::view).transpose()?,
            t_world_camera: t_world_camera
                .map(|pose| pose::given("t_world_camera", &pose))
                .transpose()?,
            time_ns,
            detections: &detections,
            ..StereoFrame::pair(left.grey()?, right.grey()?)
        };
        let size = (frame.left.width(), frame.left.height());
        let report = py.detach(|| self.lock()?.step(size, &frame))?;
        report_dictionary(py, &report)
    }

    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pruned = self.with(py, |running| {
            Ok(running.mapper.with_dependent_mut(|_, mapper| mapper.finish()))
        })?;
        Ok(pythonize(py, &pruned)?)
    }

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

    #[getter]
    fn t_world_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let of = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| *mapper.t_world_camera()))
        })?;
        pose::matrix(py, &of)
    }

    #[getter]
    fn disparity_q8<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u16>>> {
        let (pixels, size) = self.with(py, |running| {
            Ok(running.mapper.with_dependent(|_, mapper| arrays::copied(mapper.disparity_q8())))
        })?;
        arrays::image(py, pixels, size)
    }

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

    #[getter]
    fn slab_bytes(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |running| Ok(running.plan.capacity.bytes()))
    }

    #[getter]
    fn config_toml(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |running| Ok(running.plan.config_toml.clone()))
    }

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
            Ok(parts)
        });
        PyList::new(py, regions.collect::<PyResult<Vec<_>>>()?)
    }

    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.with(py, Running::snapshot)?))
    }

    fn restore(&self, py: Python<'_>, snapshot: &[u8]) -> PyResult<()> {
        py.detach(|| self.lock()?.restore(snapshot))
    }
}

/// Triangles of the static map in the camera's segment: of the blocks in memory, and of those that
/// are only in the store.
fn map_triangles(running: &mut Running) -> PyResult<Triangles> {
    let mut triangles = Triangles::default();
    let (segment, in_memory): (_, HashSet<_>) = running.mapper.with_dependent(|_, mapper| {
        mapper.triangles(&mut |triangle| triangles.add(triangle));
        let volume = mapper.static_map();
        let in_memory = volume.current_blocks().map(|(_, coord)| BlockKey::in_first(coord));
        (volume.segment(), in_memory.collect())
    });
    if let Some(file) = running.blocks.file_mut() {
        let (config, colour) = (&running.plan.config, running.plan.capacity.colour);
        let mut slab = HostSlab::map(MESH_BYTES)
            .ok_or_else(|| refuse("there is no memory for the triangles. Free some"))?;
        let how = (&config.volume, &config.mesh);
        store::mesh::triangles(
            &mut OneSegment::new(file, segment),
            how,
            (slab.bytes_mut(), colour),
            &in_memory,
            &mut |triangle: Triangle| triangles.add(triangle),
        )
        .map_err(|error| raise(anyhow::anyhow!("{error}")))?;
    }
    Ok(triangles)
}

/// Triangles of one object where it is now.
fn object_triangles(running: &mut Running, id: u32) -> PyResult<Triangles> {
    let mesh = running.plan.config.mesh;
    let found = running.mapper.with_dependent(|_, mapper| {
        let posed = mapper.posed_objects().find(|posed| posed.summary.id == id)?;
        let mut triangles = Triangles::default();
        posed.object.volume().triangles(&mesh, &mut |triangle| triangles.add(triangle));
        Some(triangles.moved(&posed.t_world_object))
    });
    found.ok_or_else(|| {
        refuse(format!(
            "track {id} has no reconstructed object now. Mapper.tracks lists tracks, \
                        with blocks where they have one"
        ))
    })
}

/// A report as nested dictionaries, and its severity in a word.
fn report_dictionary<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyAny>> {
    let dictionary = pythonize(py, report)?;
    dictionary.set_item("severity", report.severity().name())?;
    Ok(dictionary)
}

fn track_dictionary<'py>(py: Python<'py>, of: &TrackReport) -> PyResult<Bound<'py, PyDict>> {
    let parts = PyDict::new(py);
    parts.set_item("id", of.id)?;
    parts.set_item("class_name", of.class.name())?;
    parts.set_item("state", of.state.name())?;
    parts.set_item("score", of.score)?;
    parts.set_item("detected", of.detected)?;
    parts.set_item("first_frame", of.first_frame)?;
    parts.set_item("last_frame", of.last_frame)?;
    parts.set_item("sightings", of.sightings)?;
    parts.set_item("box_px", [of.pixels.left, of.pixels.top, of.pixels.width, of.pixels.height])?;
    parts.set_item("speed_m_s", of.speed_m_s.map(|[speed, _]| speed))?;
    parts.set_item("speed_sigma_m_s", of.speed_m_s.map(|[_, sigma]| sigma))?;
    parts.set_item("measured", of.measured)?;
    parts.set_item("center_world_m", of.center_world_m)?;
    parts.set_item("motion_world", pose::dictionary(py, &of.motion_world)?)?;
    parts.set_item(
        "t_world_object",
        of.t_world_object.map(|pose| pose::dictionary(py, &pose)).transpose()?,
    )?;
    parts.set_item("matches", of.matches)?;
    parts.set_item("inliers", of.inliers)?;
    parts.set_item("blocks", of.blocks)?;
    Ok(parts)
}
