//! Data sets, read by the host's own readers.

use super::blocks::BlocksChoice;
use super::detection::Detection;
use super::error::{raise, refuse};
use super::mapper::Mapper;
use super::rig::Rig;
use super::running::Recipe;
use super::{arrays, inertial, options, pose};
use dynvox::Request;
use dynvox::formats::Image;
use dynvox::input::StereoImages;
use dynvox::observe::from_first;
use dynvox::request::{MapperPlan, Plan};
use dynvox::run::inertial_samples;
use dynvox_core::geometry::Transform;
use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// The frames that `dynvox run PATH` would map; the synthetic street without a path.
///
/// Options are those of `dynvox run`, with underscores. A sequence of frames: `dataset[3]`,
/// `len(dataset)`, `for frame in dataset` (decoded ahead).
#[pyclass(frozen, module = "dynvox", subclass)]
pub struct Dataset {
    plan: Plan,
    /// Given poses of the frames, the first at the origin.
    poses: Option<Vec<Transform>>,
    blocks: BlocksChoice,
}

impl Dataset {
    /// The number in the data set of a frame at a position, which may count from the end.
    fn number(&self, position: isize) -> PyResult<(usize, usize)> {
        let listed = self.plan.frames.listed();
        let from_end = || listed.len().checked_add_signed(position);
        let found = if position < 0 { from_end() } else { Some(position as usize) };
        let number = found.and_then(|at| Some((at, *listed.get(at)?)));
        number.ok_or_else(|| PyIndexError::new_err(format!("frame {position} of {}", listed.len())))
    }

    /// Adds the samples of the data set's inertial unit since the frame before.
    fn set_inertial(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyDict>,
        position: usize,
    ) -> PyResult<()> {
        let Plan { dataset, frames, .. } = &self.plan;
        let stamp_ns = |at: usize| dataset.stamp_ns(*frames.listed().get(at)?);
        let before_ns = position.checked_sub(1).and_then(stamp_ns);
        let samples = inertial_samples(dataset.as_ref(), before_ns, stamp_ns(position));
        if samples.is_empty() {
            return Ok(());
        }
        frame.set_item("inertial", inertial::pair(py, samples)?)
    }
}

#[pymethods]
impl Dataset {
    #[new]
    #[pyo3(signature = (path=None, *, stream=None, threads=None, **options))]
    fn new(
        py: Python<'_>,
        path: Option<Bound<'_, PyAny>>,
        stream: Option<Bound<'_, PyAny>>,
        threads: Option<usize>,
        options: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let path = path.map(|path| options::path("path", &path)).transpose()?;
        if path.as_deref() == Some("-") {
            return Err(refuse(
                "a stream is read by its own program. Give its pairs to Mapper.step",
            ));
        }
        let request = options::of_dataset(path, threads, options.as_ref())?;
        let plan = py.detach(|| request.resolve()).map_err(raise)?;
        let poses = plan
            .poses
            .as_ref()
            .map(|poses| from_first(poses, &(0..poses.len()).collect::<Vec<_>>()));
        Ok(Self { plan, poses, blocks: options::blocks(stream.as_ref())? })
    }

    /// Name of the data set.
    #[getter]
    fn name(&self) -> &str {
        self.plan.dataset.name()
    }

    /// Width and height of the pictures that are mapped.
    #[getter]
    fn size(&self) -> (usize, usize) {
        self.plan.dataset.size()
    }

    /// The cameras.
    #[getter]
    fn rig(&self) -> Rig {
        Rig::of(
            self.plan.dataset.rig(),
            self.plan.dataset.size(),
            self.plan.dataset.rectification(),
        )
    }

    /// Assumptions, and what was left aside.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.plan.dataset.notes().to_vec()
    }

    /// Doubts about the images, in sentences.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.plan.warnings.clone()
    }

    /// Time between two frames, s.
    #[getter]
    fn frame_interval_s(&self) -> f32 {
        self.plan.config.tracking.frame_interval_s
    }

    /// Numbers of the frames in the data set.
    #[getter]
    fn numbers(&self) -> Vec<usize> {
        self.plan.frames.listed().to_vec()
    }

    /// Times of the frames, s.
    #[getter]
    fn times_s(&self) -> Vec<f64> {
        self.plan.frames.listed().iter().map(|&number| self.plan.dataset.time_s(number)).collect()
    }

    /// True poses, frames x 4 x 4, the first at the origin.
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<f64>>>> {
        let Some(truth) = self.plan.dataset.truth() else { return Ok(None) };
        let poses = from_first(truth, self.plan.frames.listed());
        let rows = poses.iter().flat_map(|pose| {
            let [x, y, z] = pose.matrix_3x4();
            [x, y, z, [0.0, 0.0, 0.0, 1.0]]
        });
        let values: Vec<f64> = rows.flatten().collect();
        let array = numpy::PyArray1::from_vec(py, values);
        Ok(Some(numpy::PyArrayMethods::reshape(&array, [poses.len(), 4, 4])?))
    }

    /// Points of a frame's LiDAR scan in the axes of the rectified left camera; None where the
    /// frame has no scan.
    fn lidar<'py>(
        &self,
        py: Python<'py>,
        position: isize,
    ) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        let (_, number) = self.number(position)?;
        let scan = py.detach(|| self.plan.dataset.lidar(number)).map_err(raise)?;
        let Some(scan) = scan else { return Ok(None) };
        let points = scan.points_m;
        let count = points.len();
        let values: Vec<f32> = points.into_iter().flatten().map(|side| side as f32).collect();
        arrays::image(py, values, [count, 3]).map(Some)
    }

    /// A mapper with the bounds, settings and threads of this run.
    fn mapper(&self, py: Python<'_>) -> PyResult<Mapper> {
        let Plan { profile, capacity, config, config_toml, threads, .. } = &self.plan;
        let plan = MapperPlan {
            profile: profile.clone(),
            capacity: *capacity,
            config: *config,
            config_toml: config_toml.clone(),
            threads: *threads,
        };
        dynvox::request::check_bounds(self.plan.dataset.size(), (profile, capacity), config)
            .map_err(raise)?;
        let recipe = Recipe {
            rig: self.rig(),
            request: Request::default(),
            interval_s: None,
            plan: Some(plan),
            inertial: None,
            blocks: self.blocks.clone(),
        };
        Mapper::from_recipe(py, recipe, self.plan.dataset.size())
    }

    fn __len__(&self) -> usize {
        self.plan.frames.listed().len()
    }

    /// The keywords of Mapper.step for a frame.
    fn __getitem__<'py>(&self, py: Python<'py>, position: isize) -> PyResult<Bound<'py, PyDict>> {
        let (position, number) = self.number(position)?;
        let images = py.detach(|| self.plan.dataset.frame(number)).map_err(raise)?;
        let frame = frame(py, images)?;
        if let Some(time_ns) = self.plan.dataset.stamp_ns(number) {
            frame.set_item("time_ns", time_ns)?;
            self.set_inertial(py, &frame, position)?;
        }
        if let Some(pose) = self.poses.as_ref().and_then(|poses| poses.get(position)) {
            frame.set_item("t_world_camera", pose::dictionary(py, pose)?)?;
        }
        Ok(frame)
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.plan.dataset.size();
        format!(
            "Dataset({}, {} frames of {width} x {height} px)",
            self.plan.dataset.name(),
            self.__len__()
        )
    }
}

/// The keywords of a step; what was decoded is taken over, not copied.
fn frame(py: Python<'_>, images: StereoImages) -> PyResult<Bound<'_, PyDict>> {
    let StereoImages { left, right, colour, depth, masks, ignored, .. } = images;
    let frame = PyDict::new(py);
    let size = |image: &Image<u8>| [image.height(), image.width()];
    let (of_left, of_right) = (size(&left), size(&right));
    frame.set_item("left", arrays::image(py, left.into_pixels(), of_left)?)?;
    frame.set_item("right", arrays::image(py, right.into_pixels(), of_right)?)?;
    if let Some(colour) = colour {
        let size = [colour.height(), colour.width()];
        frame.set_item("colour", arrays::colour(py, colour.into_pixels(), size)?)?;
    }
    if let Some(depth) = depth {
        let size = [depth.disparity_q8.height(), depth.disparity_q8.width()];
        frame
            .set_item("disparity_q8", arrays::image(py, depth.disparity_q8.into_pixels(), size)?)?;
    }
    if let Some(ignored) = ignored {
        let pixels = ignored.pixels().to_vec();
        frame.set_item("ignored", arrays::image(py, pixels, size(&ignored))?)?;
    }
    if !masks.instances.is_empty() {
        let detections = masks
            .instances
            .into_iter()
            .map(|of| Detection::of(py, of))
            .collect::<PyResult<Vec<_>>>()?;
        frame.set_item("detections", PyList::new(py, detections)?)?;
    }
    Ok(frame)
}
