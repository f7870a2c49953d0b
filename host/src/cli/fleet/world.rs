//! Maps in the world: aligned, resampled, merged, shown.

use super::{Shard, each};
use crate::fleet::{self, Alignment, Averages, JobState, Manifest, Report, Submap, Uncertainty};
use crate::formats::Axes;
use crate::owned::{check_overlap, create_folder};
use crate::report::text::{counted, grouped};
use crate::terminal::quoted;
use anyhow::bail;
use std::path::{Path, PathBuf};

/// The jobs of a folder, all of them done.
fn done_jobs(folder: &Path) -> anyhow::Result<Manifest> {
    let manifest = Manifest::read(folder)?;
    let open: Vec<&str> = manifest
        .jobs
        .iter()
        .filter(|job| job.state(folder) != JobState::Done)
        .map(|job| job.name.as_str())
        .collect();
    if !open.is_empty() {
        bail!(
            "{} of {} are not done. Do them with: dynvox fleet run {}",
            open.join(", "),
            folder.display(),
            quoted(folder)
        );
    }
    Ok(manifest)
}

pub fn align(folder: &Path, uncertainty: &Uncertainty) -> anyhow::Result<()> {
    let alignment = Alignment::find(&done_jobs(folder)?, folder, uncertainty)?;
    alignment.write(folder)?;
    outln!(
        "{:<32}{:>9}{:>9}{:>12}{:>10}{:>11}  state",
        "recordings",
        "points",
        "near, %",
        "before, mm",
        "rms, mm",
        "weakest"
    );
    for pair in &alignment.pairs {
        let fit = &pair.fit;
        let (names, state) =
            (pair.recordings.join(", "), fit.refused.as_deref().unwrap_or("accepted"));
        let (near, before, after) =
            (100.0 * fit.inlier_share, 1e3 * fit.rms_before_m, 1e3 * fit.rms_m);
        outln!(
            "{names:<32}{:>9}{near:>9.1}{before:>12.1}{after:>10.1}{:>11.5}  {state}",
            fit.points,
            fit.min_eigen_share
        );
    }
    outln!("\n{:<32}{:>10}{:>17}", "recording", "moved, m", "turned, degrees");
    alignment
        .recordings
        .iter()
        .for_each(|of| outln!("{:<32}{:>10.3}{:>17.3}", of.name, of.moved_m, of.turned_deg));
    Ok(())
}

pub fn resample(folder: &Path, shard: Shard) -> anyhow::Result<()> {
    let manifest = Manifest::read(folder)?;
    let poses = fleet::poses(&manifest, folder)?;
    create_folder(&folder.join("sums"))?;
    let posed = manifest.jobs.iter().zip(poses).skip(shard.index).step_by(shard.of);
    each(posed, "in the world", |job, t_world_map| {
        let t_world_map = &t_world_map?;
        let out = job.sums(folder, t_world_map);
        if out.is_dir() {
            return Ok(());
        }
        let resampled = Submap::open(&job.submap(folder))
            .and_then(|mut map| fleet::resample(&mut map, job.epoch, t_world_map, &out));
        match resampled {
            Ok(resampled) => {
                outln!(
                    "{}: {} blocks in {} tiles",
                    job.name,
                    grouped(resampled.blocks),
                    resampled.tiles
                );
                if resampled.beyond > 0 {
                    errln!(
                        "warning: {} blocks of {} are beyond the world's coordinates",
                        resampled.beyond,
                        job.name
                    );
                }
                Ok(())
            }
            // Another worker was faster.
            Err(_) if out.is_dir() => Ok(()),
            Err(error) => Err(error.into()),
        }
    })
}

/// The folders of sums of jobs whose maps are all resampled.
fn sums_of(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let manifest = done_jobs(folder)?;
    let poses = fleet::poses(&manifest, folder)?.into_iter().collect::<Result<Vec<_>, _>>()?;
    let inputs: Vec<PathBuf> =
        manifest.jobs.iter().zip(&poses).map(|(job, pose)| job.sums(folder, pose)).collect();
    let missing = manifest
        .jobs
        .iter()
        .zip(&inputs)
        .filter(|(_, sums)| !sums.is_dir())
        .map(|(job, _)| job.name.as_str());
    let missing: Vec<&str> = missing.collect();
    if !missing.is_empty() {
        let (missing, quoted, folder) = (missing.join(", "), quoted(folder), folder.display());
        bail!(
            "{missing} of {folder} are not in the world's lattice. Carry them there with: dynvox \
             fleet resample {quoted}"
        );
    }
    Ok(inputs)
}

pub fn merge(maps: &[PathBuf], out: &Path) -> anyhow::Result<()> {
    let mut inputs = Vec::new();
    for map in maps {
        if map.join(fleet::MANIFEST_FILE).is_file() {
            inputs.extend(sums_of(map)?);
        } else {
            inputs.push(map.clone());
        }
    }
    check_overlap(out, &inputs)?;
    let merged = fleet::merge(&inputs, out)?;
    let digest = fleet::digest(out)?;
    outln!(
        "{}: {} blocks in {} tiles, digest {digest:016x}",
        out.display(),
        grouped(merged.blocks),
        merged.tiles
    );
    Ok(())
}

pub fn mesh(map: &Path, out: &Path, min_weight: u8, axes: Axes) -> anyhow::Result<()> {
    let mut averages = Averages::of(map, out)?;
    let mesh = fleet::write_mesh(&mut averages, out, min_weight, axes)?;
    outln!(
        "{}: {} triangles of {} blocks",
        out.display(),
        grouped(mesh.triangles),
        grouped(averages.blocks)
    );
    if averages.overflowed > 0 {
        errln!(
            "warning: {} voxels were seen too often for their sums and are left out",
            grouped(averages.overflowed)
        );
    }
    Ok(())
}

pub fn report(
    (folder, map): (&Path, &Path),
    out: &Path,
    least_change_m3: f64,
) -> anyhow::Result<()> {
    sums_of(folder)?;
    let report = Report::of((folder, &Manifest::read(folder)?), map, least_change_m3)?;
    report.write(out)?;
    outln!(
        "{}: {} blocks with a surface, {} free",
        out.display(),
        grouped(report.blocks),
        grouped(report.free_blocks)
    );
    for (nth, blocks) in report.coverage.blocks_by_recordings.iter().enumerate() {
        outln!("{:>12} blocks seen by {}", grouped(*blocks), counted(nth + 1, "recording"));
    }
    outln!("{} between epochs", counted(report.changes.len(), "change"));
    for change in &report.changes {
        let ([x, y, z], kind) = (change.centre_m, change.kind.name());
        let (from, to, believed) = (change.from_epoch, change.to_epoch, change.believed_epoch);
        outln!(
            "{kind:<9} {x:>9.2}{y:>9.2}{z:>9.2} m, {:>8.3} m3, epochs {from} to {to}, shown as in \
             {believed}",
            change.volume_m3
        );
    }
    Ok(())
}
