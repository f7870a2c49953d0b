//! How does the finished map look from each pose, as disparity images? Written as KITTI's 16-bit PNG, 1/256 px, 0 none; what self-calibration
//! added is taken off again, so that they can be compared with any matcher of the same images.
//!
//! `cargo run --release -p dynvox --example render_map -- KITTI-ODOMETRY 06 OUT [apply|off] [KEY=VALUE ...]`

use dynvox::input::{FrameSource, OpenOptions, open};
use dynvox_core::geometry::{DisparityCorrection, StereoRig, Transform};
use dynvox_core::mapper::BudgetOptions;
use dynvox_core::rectify::self_calibration::SelfCalibrationMode;
use dynvox_core::{Capacity, Config, Mapper, Serial, StereoFrame, memory::SLAB_ALIGN};
use std::path::{Path, PathBuf};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, sequence, out, rest @ ..] = arguments.as_slice() else {
        anyhow::bail!("render_map KITTI-ODOMETRY SEQUENCE OUT [apply|off] [KEY=VALUE ...]")
    };
    let mode = if rest.first().is_some_and(|mode| mode == "off") { SelfCalibrationMode::Off } else { SelfCalibrationMode::Apply };
    let source = open(path.as_ref(), &OpenOptions { sequence: Some(sequence.clone()), ..OpenOptions::default() })?;
    std::fs::create_dir_all(out)?;
    let (width, height) = source.size();
    let capacity = Capacity::for_budget(1 << 30, width, height, &BudgetOptions::default())?;
    let mut config = Config::for_rig(source.rig());
    config.rig_settings.self_calibration = mode;
    for set in rest.iter().filter_map(|argument| argument.split_once('=')) {
        config.set(set.0, set.1).map_err(|error| anyhow::anyhow!("{}={}: {error}", set.0, set.1))?;
    }
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&capacity, &config, &mut slab)?;
    let (poses, correction) = map(source.as_ref(), &mut mapper)?;
    println!("{correction:?}");
    for (index, t_world_camera) in poses.iter().enumerate() {
        let name = source.stem(index).unwrap_or_else(|| format!("{index:06}"));
        let path: PathBuf = Path::new(out).join(format!("{name}.png"));
        let Some(depth_m) = mapper.raycast(t_world_camera, &Serial)?.depth_m() else { continue };
        let disparity = |(at, &depth_m): (usize, &f32)| disparity_q8(&source.rig(), &correction, at % width, depth_m);
        let pixels: Vec<u8> = depth_m.pixels().iter().enumerate().map(disparity).flat_map(u16::to_ne_bytes).collect();
        image::save_buffer(&path, &pixels, width as u32, height as u32, image::ExtendedColorType::L16)?;
    }
    Ok(())
}

/// Maps all frames: their poses, and the correction as it was found.
fn map(source: &dyn FrameSource, mapper: &mut Mapper<'_>) -> anyhow::Result<(Vec<Transform>, DisparityCorrection)> {
    let (mut poses, mut correction) = (Vec::new(), DisparityCorrection::default());
    for index in 0..source.len() {
        let images = source.frame(index)?;
        let (Some(left), Some(right)) = (images.left.view(), images.right.view()) else { continue };
        let report = mapper.step(&StereoFrame::pair(left, right), &Serial)?;
        poses.push(report.t_world_camera);
        correction = report.self_calibration.found().filter(|_| report.self_calibration.corrected).unwrap_or_default();
    }
    Ok((poses, correction))
}

/// The disparity the images themselves have where the map is so far away, 1/256 px.
fn disparity_q8(rig: &StereoRig, correction: &DisparityCorrection, column: usize, depth_m: f32) -> u16 {
    if depth_m <= 0.0 {
        return 0;
    }
    let corrected_px = rig.focal_baseline_px_m() / f64::from(depth_m);
    let share = (column as f64 - corrected_px - rig.center_u_px) / rig.center_u_px;
    let added_px = correction.offset_px + correction.slope_px * share + correction.quartic_px * share.powi(4);
    ((corrected_px - added_px) * 256.0 + 0.5) as u16
}
