//! How true is a merged map? It is viewed from each pose of a trajectory and compared with LiDAR or
//! the street's exact depth, as `dynvox run --evaluate` does; pixels of instance masks are left
//! out. The data set is that of a request, as `--example run_request` prints one.
//!
//! `cargo run --release -p dynvox --example evaluate_map -- MAP TRAJECTORY lidar|exact REQUEST.json`

use anyhow::Context;
use dynvox::Request;
use dynvox::evaluate::reference::{
    Field, PendingFrame, ReferenceFigures, Region, project_scan, sample_exact_depth,
};
use dynvox::fleet::Averages;
use dynvox::formats::read_poses;
use dynvox::request::Plan;
use dynvox::slab::HostSlab;
use dynvox_core::geometry::Transform;
use dynvox_core::memory::Carver;
use dynvox_core::tracking::Treatment;
use dynvox_core::view::Raycaster;
use dynvox_core::volume::{Viewpoint, Volume, VolumeConfig};
use dynvox_core::{Capacity, Serial};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [map, trajectory, reference, request] = arguments.as_slice() else {
        anyhow::bail!("evaluate_map MAP TRAJECTORY lidar|exact REQUEST.json")
    };
    let request: Request = serde_json::from_str(&std::fs::read_to_string(request)?)?;
    let plan = request.absolute()?.resolve()?;
    let poses = read_poses(trajectory.as_ref())?.poses;
    let mut map = Averages::of(map.as_ref(), &std::env::temp_dir().join("evaluate_map"))?;
    let blocks = map.blocks as usize;
    // A volume as large as the map, so that nothing is evicted.
    let capacity =
        Capacity { blocks, visible_blocks: blocks, colour: map.lattice.colour, ..plan.capacity };
    let bytes = Volume::bytes(&capacity) + Raycaster::bytes(&capacity);
    let mut slab = HostSlab::map(bytes).context("the map does not fit this machine's memory")?;
    let mut carver = Carver::new(slab.bytes_mut(), bytes)?;
    let config = VolumeConfig {
        voxel_size_m: map.lattice.voxel_size_m,
        truncation_m: map.lattice.truncation_m,
        ..plan.config.volume
    };
    let mut volume = Volume::new_in(&capacity, &config, &mut carver);
    let mut raycaster = Raycaster::new_in(&capacity, &plan.config.raycast, &mut carver);
    carver.check()?;
    // All blocks are loaded before the first view.
    for tile in map.store.tiles() {
        for coord in map.store.blocks_of(tile) {
            volume.load(coord, &mut map.store);
        }
    }
    let mut frames = Vec::new();
    for (&index, t_world_camera) in plan.frames.listed().iter().zip(&poses) {
        let Some(frame) = scan(&plan, index, t_world_camera, reference == "lidar")? else {
            continue;
        };
        let (width, height) = plan.dataset.size();
        let view =
            Viewpoint { rig: plan.config.rig, width, height, t_world_camera: *t_world_camera };
        raycaster
            .cast(&volume, &view, &Serial)
            .map_err(|error| anyhow::anyhow!("frame {index}: {error}"))?;
        let Some(depth_m) = raycaster.depth_m() else { continue };
        frames.push(frame.compare(&depth_m, plan.config.rig.focal_baseline_px_m(), 1.0).0);
    }
    let figures = ReferenceFigures::from_frames("reference", 0, &frames, None)
        .context("no frame has a reference")?;
    let fused = figures.still.fused;
    let (accuracy, completeness) =
        (fused.accuracy_alone.unwrap_or_default(), fused.completeness.unwrap_or_default());
    println!(
        "{} frames, {} points, {blocks} blocks: accuracy {accuracy:.4}, completeness \
         {completeness:.4}",
        frames.len(),
        fused.points
    );
    Ok(())
}

/// The points of a frame.
fn scan(
    plan: &Plan,
    index: usize,
    t_world_camera: &Transform,
    lidar: bool,
) -> anyhow::Result<Option<PendingFrame>> {
    let (width, height) = plan.dataset.size();
    let volume = &plan.config.volume;
    let field = Field { width, height, near_m: volume.near_m.into(), far_m: volume.far_m.into() };
    let images = plan.dataset.frame(index)?;
    let scan = if lidar {
        plan.dataset.lidar(index)?.map(|scan| project_scan(&scan, &field))
    } else {
        images
            .exact
            .as_ref()
            .map(|exact| sample_exact_depth(&exact.depth_m, &plan.config.rig, &field))
    };
    // Objects are not part of a merged map.
    let region = |u: i32, v: i32| {
        let is_object = images
            .masks
            .instances
            .iter()
            .any(|one| one.class.treatment() != Treatment::Ignore && one.contains(u, v));
        if is_object { Region::Ignored } else { Region::Static }
    };
    // The input's disparity takes no part in what is counted for the map alone.
    Ok(scan.map(|scan| PendingFrame::new(index, t_world_camera.into(), &scan, |_, _| 1.0, region)))
}
