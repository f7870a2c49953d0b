//! What a mapper is asked for: triangles, reports, tracks.

use super::arrays::Triangles;
use super::error::{raise, refuse};
use super::pose;
use super::running::Running;
use dynvox::run::store::{self, OneSegment};
use dynvox::slab::HostSlab;
use dynvox_core::Report;
use dynvox_core::tracking::TrackReport;
use dynvox_core::view::Triangle;
use dynvox_core::volume::BlockKey;
use hashbrown::HashSet;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pythonize::pythonize;

/// Bytes in which evicted blocks are meshed, a cube of the map at a time.
const MESH_BYTES: usize = 8 << 20;

/// Triangles of the static map in the camera's segment: of the blocks in memory, and of those that
/// are only in the store.
pub fn map_triangles(running: &mut Running) -> PyResult<Triangles> {
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
pub fn object_triangles(running: &mut Running, id: u32) -> PyResult<Triangles> {
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
pub fn report_dictionary<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyAny>> {
    let dictionary = pythonize(py, report)?;
    dictionary.set_item("severity", report.severity().name())?;
    Ok(dictionary)
}

pub fn track_dictionary<'py>(py: Python<'py>, of: &TrackReport) -> PyResult<Bound<'py, PyDict>> {
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
