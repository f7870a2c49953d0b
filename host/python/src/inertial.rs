//! Inertial unit: its mounting and noise, and the samples of a frame.

use super::error::refuse;
use super::pose;
use dynvox_core::Problems;
use dynvox_core::inertial::{InertialSample, InertialUnit as CoreUnit};
use numpy::ndarray::Axis;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Values of a sample: three turn rates, three forces.
const VALUES: usize = 6;

/// Inertial unit that is fixed to the left camera: `t_camera_unit` maps its axes to those of the
/// rectified left camera. `Mapper(rig, inertial_unit=...)` then takes its samples with every frame.
///
/// `clock_offset_s` is added to the samples' times; what remains is found from the turns.
/// `turn_density` is the noise of turn rates, rad/s/sqrt(Hz), `turn_bias_sigma` the bias that they
/// may begin with, rad/s, `turn_walk` its random walk, rad/s2/sqrt(Hz), and `force_bias_sigma` the
/// error of forces, m/s2. A sample at `turn_range`, rad/s, or `force_range`, m/s2, is saturated.
#[pyclass(frozen, module = "dynvox", from_py_object)]
#[derive(Clone)]
pub struct InertialUnit {
    unit: CoreUnit,
}

impl InertialUnit {
    pub fn config(&self) -> CoreUnit {
        self.unit
    }
}

#[pymethods]
impl InertialUnit {
    #[new]
    #[pyo3(signature = (t_camera_unit, **numbers))]
    fn new(t_camera_unit: Bound<'_, PyAny>, numbers: Option<Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut unit = CoreUnit::new(pose::given("t_camera_unit", &t_camera_unit)?);
        for (name, value) in numbers.iter().flat_map(PyDictMethods::iter) {
            let name: String = name.extract()?;
            let number = match name.as_str() {
                "clock_offset_s" => &mut unit.clock_offset_s,
                "turn_density" => &mut unit.turn_density,
                "turn_bias_sigma" => &mut unit.turn_bias_sigma,
                "turn_walk" => &mut unit.turn_walk,
                "force_bias_sigma" => &mut unit.force_bias_sigma,
                "turn_range" => &mut unit.turn_range,
                "force_range" => &mut unit.force_range,
                _ => {
                    return Err(refuse(format!(
                        "an inertial unit has no {name}. Give one of clock_offset_s, turn_density, \
                         turn_bias_sigma, turn_walk, force_bias_sigma, turn_range, force_range"
                    )));
                }
            };
            *number = value.extract().map_err(|_| {
                refuse(format!("{name} of an inertial unit is no number. Give one"))
            })?;
        }
        let mut problems = Problems::new();
        unit.validate(&mut problems);
        match problems.first() {
            Some(problem) => Err(refuse(format!("{problem}. Check the numbers of the unit"))),
            None => Ok(Self { unit }),
        }
    }

    fn __repr__(&self) -> String {
        let [x, y, z] = self.unit.t_camera_unit.translation_m;
        format!("InertialUnit(at {x:.3}, {y:.3}, {z:.3} m from the left camera)")
    }
}

/// Samples of a frame: a pair of times, ns, and of rows of six values.
pub fn given(value: &Bound<'_, PyAny>) -> PyResult<Vec<InertialSample>> {
    let refused = |reason: &str| {
        refuse(format!(
            "inertial {reason}. Pass a pair: times in ns as integers, and as many rows of six \
             numbers, turn rates in rad/s and then accelerations in m/s2"
        ))
    };
    let pair: (Bound<'_, PyAny>, Bound<'_, PyAny>) =
        value.extract().map_err(|_| refused("is no pair"))?;
    let numpy = value.py().import("numpy")?;
    let times = numpy.call_method1("asarray", (&pair.0,))?;
    let is_empty = times.getattr("size")?.extract::<usize>()? == 0;
    let kind: String = times.getattr("dtype")?.getattr("kind")?.extract()?;
    // Floating point loses the last digits of a time in ns.
    if !is_empty && !matches!(kind.as_str(), "i" | "u") {
        return Err(refused("has times that are no integers"));
    }
    // Signed, so that a time below 0 is seen and does not wrap.
    let times: PyReadonlyArray1<'_, i64> = times
        .call_method1("astype", ("int64",))?
        .extract()
        .map_err(|_| refused("has times in more than one row"))?;
    let values = numpy.call_method1("asarray", (&pair.1, "float64"));
    let values: PyReadonlyArray2<'_, f64> = values
        .and_then(|values| values.call_method1("reshape", ((-1, VALUES),)))
        .and_then(|values| values.extract().map_err(Into::into))
        .map_err(|_| refused("has rows that are not of six numbers"))?;
    let (times, values) = (times.as_array(), values.as_array());
    if times.len() != values.nrows() {
        let reason = format!("has {} times and {} rows", times.len(), values.nrows());
        return Err(refused(&reason));
    }
    let sample = |(&time_ns, row): (&i64, numpy::ndarray::ArrayView1<'_, f64>)| {
        Some(InertialSample {
            time_ns: u64::try_from(time_ns).ok()?,
            turn_rate: [row[0], row[1], row[2]],
            force: [row[3], row[4], row[5]],
        })
    };
    let samples = times.iter().zip(values.axis_iter(Axis(0))).map(sample).collect::<Option<_>>();
    samples.ok_or_else(|| refused("has a time below 0"))
}

/// Samples as [`given`] takes them.
pub fn pair<'py>(py: Python<'py>, samples: &[InertialSample]) -> PyResult<Bound<'py, PyTuple>> {
    let times: Vec<u64> = samples.iter().map(|sample| sample.time_ns).collect();
    let values: Vec<f64> =
        samples.iter().flat_map(|sample| [sample.turn_rate, sample.force]).flatten().collect();
    let values = PyArray1::from_vec(py, values).reshape([samples.len(), VALUES])?;
    (PyArray1::from_vec(py, times), values).into_pyobject(py)
}
