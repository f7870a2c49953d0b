//! The planner's window as arrays.

use super::{arrays, pose};
use dynvox::observe::{BoxDescription, PlanningLayers};
use dynvox_core::Mapper;
use dynvox_core::planning::PlanningReport;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::pythonize;

/// The window at a time.
pub struct Plan {
    layers: PlanningLayers,
    boxes: Vec<BoxDescription>,
    report: PlanningReport,
}

impl Plan {
    /// Makes the window and copies it; `None` where the mapper has none.
    pub fn of(mapper: &mut Mapper<'_>, ahead_s: f32) -> Option<Self> {
        let report = mapper.update_planning_maps(ahead_s);
        let planning = mapper.planning();
        Some(Self {
            layers: PlanningLayers::from_planning(planning)?,
            boxes: planning.boxes().iter().map(BoxDescription::from).collect(),
            report,
        })
    }

    /// Everything by name.
    pub fn dictionary(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let PlanningLayers {
            size: [columns, rows],
            cell_m,
            t_world_corner,
            occupancy,
            distance_m,
            height_m,
        } = self.layers;
        let parts = PyDict::new(py);
        parts.set_item("occupancy", arrays::image(py, occupancy, [rows, columns])?)?;
        parts.set_item("distance_m", arrays::image(py, distance_m, [rows, columns])?)?;
        parts.set_item("height_m", arrays::image(py, height_m, [rows, columns])?)?;
        parts.set_item("cell_m", cell_m)?;
        parts.set_item("t_world_corner", pose::matrix(py, &t_world_corner)?)?;
        parts.set_item("boxes", pythonize(py, &self.boxes)?)?;
        parts.set_item("report", pythonize(py, &self.report)?)?;
        Ok(parts)
    }
}
