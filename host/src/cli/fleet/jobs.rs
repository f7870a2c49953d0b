//! Jobs: made, done, listed.

use super::{Shard, each};
use crate::cli::run::{request_of, write as run_to};
use crate::cli::{signals, sweep};
use crate::fleet::{
    self, Camera, CameraPose, Given, Identity, Job, JobState, Lattice, Manifest, Prior, Recordings,
    Submap,
};
use crate::formats::{
    FRAMES_FILE, TIMED_TRAJECTORY_FILE, TRAJECTORY_FILE, read_poses, rows_of_file,
};
use crate::observe::tables::read_frame_digests;
use crate::owned::{self, check_overlap, create_folder};
use crate::report::text::counted;
use crate::request::{Plan, Request};
use crate::run::store::BlockFile;
use crate::run::{self, BLOCKS_FILE, RunFolder, stereo_frame};
use crate::terminal::quoted;
use anyhow::{Context, bail};
use dynvox_core::digest::Digest;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Identifies a run by its settings, the facts about its data set, and its first and last image.
fn identify(plan: &Plan) -> anyhow::Result<Identity> {
    let mut digest = Digest::default();
    for (key, value) in run::fingerprint(plan) {
        digest.bytes(key.as_bytes());
        digest.bytes(value.as_bytes());
    }
    let frames = plan.frames.listed();
    for &index in [frames.first(), frames.last()].into_iter().flatten() {
        let images = plan.dataset.frame(index)?;
        digest.u64(stereo_frame(&images, &[]).map_or(0, |frame| frame.digest()));
    }
    let first_pose = plan.poses.iter().flatten().next().copied();
    let (bytes, frames) = (plan.rss_limit_bytes, frames.len());
    Ok(Identity { digest: digest.finish(), bytes, first_pose, frames })
}

/// A job whose figures are wanted, as a file below the folder of the jobs.
pub fn of_figures(name: &str, request: Request, file: PathBuf) -> anyhow::Result<Job> {
    let identity = identify(&request.resolve()?)?;
    Ok(Job::new(name, request, &identity, Given::Figures(file)))
}

/// Blocks as far about surfaces as distances are kept: registration searches so far, and what is
/// free of one epoch's surfaces tells what has changed.
const ALLOCATION: [&str; 2] = ["--set", "volume.allocation_m=64"];

/// The request of a recording's arguments, whose map is kept.
fn request_of_map(arguments: &[String]) -> anyhow::Result<Request> {
    let words = ALLOCATION.into_iter().map(str::to_owned).chain(arguments.iter().cloned());
    let mut request = request_of(&words.collect::<Vec<_>>())?;
    request.storage.keep_blocks = true;
    Ok(request)
}

pub fn plan(recordings: &Path, out: &Path) -> anyhow::Result<()> {
    let list = Recordings::read(recordings)?;
    let identify = |request: &Request| identify(&request.resolve()?);
    write(&Manifest::plan(recordings, &list, request_of_map, identify)?, out)
}

/// Writes jobs, and says what to do with them.
pub fn write(manifest: &Manifest, out: &Path) -> anyhow::Result<()> {
    manifest.jobs.iter().try_for_each(|job| check_overlap(out, &job.request.inputs()))?;
    manifest.write(out)?;
    outln!(
        "{} jobs in {}. Do them with: dynvox fleet run {}",
        manifest.jobs.len(),
        out.display(),
        quoted(out)
    );
    Ok(())
}

pub fn run(folder: &Path, shard: Shard) -> anyhow::Result<()> {
    let manifest = Manifest::read(folder)?;
    each(manifest.shard(shard.index, shard.of).map(|job| (job, ())), "done", |job, ()| {
        if job.state(folder) != JobState::Done {
            done(folder, job)?;
            outln!("{} is {}", job.name, state(folder, job));
            if matches!(job.given, Given::Gnss { .. }) {
                say_fixes(folder, job)?;
            }
        }
        Ok(())
    })
}

/// Says how well a map lies along its fixes.
fn say_fixes(folder: &Path, job: &Job) -> anyhow::Result<()> {
    match (fleet::prior(job, folder), job.given.follows()) {
        (Ok(Prior { uncertainty: Some(of), .. }), _) => outln!(
            "{} lies along its fixes, with standard deviations of {:.2} m and {:.2} degrees",
            job.name,
            of.position_m,
            of.rotation_rad.to_degrees()
        ),
        // The part before it says where it lies.
        (Err(error), Some(_)) => outln!("{} lies where it follows: {error}", job.name),
        (prior, _) => {
            prior?;
        }
    }
    Ok(())
}

/// Does one job, of the settings and images it was planned for.
fn done(folder: &Path, job: &Job) -> anyhow::Result<()> {
    let is_same = |plan: &Plan| anyhow::Ok(job.is_of(identify(plan)?.digest));
    let plan = job.request.resolve()?;
    if !is_same(&plan)? {
        bail!("its settings or images are not those of the plan. Plan again");
    }
    let figures = match &job.given {
        Given::Figures(file) => Some((folder.join(file), sweep::figures_of(folder, job)?)),
        Given::TWorldCamera(_) | Given::Gnss { .. } | Given::Follows(_) => {
            run_apart(folder, job)?;
            None
        }
    };
    if !is_same(&job.request.resolve()?)? {
        bail!("its images have changed while it ran. Plan again");
    }
    match figures {
        Some((file, figures)) => Ok(figures.write(&file)?),
        None => keep_map(folder, job, &plan),
    }
}

/// Runs one job in a process of its own, so that memory and a crash are its own.
fn run_apart(folder: &Path, job: &Job) -> anyhow::Result<()> {
    let run = Command::new(std::env::current_exe()?)
        .args(["fleet", "job"])
        .arg(folder)
        .arg(&job.id)
        .output()
        .context("the run cannot be started")?;
    if !run.status.success() {
        bail!("{}", String::from_utf8_lossy(&run.stderr).trim().trim_start_matches("error: "));
    }
    Ok(())
}

/// Does the run of one job in this process.
pub fn run_one(folder: &Path, id: &str) -> anyhow::Result<()> {
    let manifest = Manifest::read(folder)?;
    let Some(job) = manifest.jobs.iter().find(|job| job.id == id) else {
        bail!("{} has no job {id}. `dynvox fleet status` lists them", folder.display())
    };
    let plan = job.request.resolve_with(&signals::stop_request()?)?;
    run_to(plan, RunFolder::begin(&job.run_folder(folder), true)?)
}

/// Keeps the map of a job's run, and removes the run's block file.
fn keep_map(folder: &Path, job: &Job, plan: &Plan) -> anyhow::Result<()> {
    let run_folder = job.run_folder(folder);
    let volume = &plan.config.volume;
    let lattice = Lattice {
        voxel_size_m: volume.voxel_size_m,
        truncation_m: volume.truncation_m,
        colour: plan.capacity.colour,
    };
    let blocks = run_folder.join(BLOCKS_FILE);
    let (mut store, _) = BlockFile::open(&blocks, lattice.voxel_size_m, lattice.truncation_m)?;
    let camera =
        Camera { rig: plan.config.rig, size: plan.dataset.size(), poses: cameras(&run_folder)? };
    create_folder(&folder.join("submaps"))?;
    fleet::keep(&mut store, &lattice, &camera, &job.submap(folder))?;
    owned::remove_file(&blocks)?;
    Ok(())
}

/// Reads the camera's poses of a run.
fn cameras(run_folder: &Path) -> anyhow::Result<Vec<CameraPose>> {
    let poses = read_poses(&run_folder.join(TRAJECTORY_FILE))?.poses;
    let rows = read_frame_digests(rows_of_file(&run_folder.join(FRAMES_FILE))?)?;
    // Two rows at one time, of a source without clock, are read by no one.
    let times_s = read_poses(&run_folder.join(TIMED_TRAJECTORY_FILE)).ok();
    let times_s = times_s.and_then(|timed| timed.times_s).filter(|of| of.len() == poses.len());
    Ok(rows
        .iter()
        .zip(poses)
        .enumerate()
        .map(|(at, (row, t_map_camera))| CameraPose {
            frame: row.frame,
            time_s: times_s.as_ref().and_then(|times_s| times_s.get(at).copied()),
            segment: row.segment,
            t_map_camera,
        })
        .collect())
}

/// Describes the state of a job.
fn state(folder: &Path, job: &Job) -> String {
    match (job.state(folder), left_out(folder, job)) {
        (JobState::Done, frames @ 1..) => {
            format!("done; {} after the camera was lost are left out", counted(frames, "frame"))
        }
        (state, _) => word(state).to_owned(),
    }
}

const fn word(state: JobState) -> &'static str {
    match state {
        JobState::Done => "done",
        JobState::Started => "started",
        JobState::Open => "open",
    }
}

/// Frames of a job's map whose place in it is not known.
fn left_out(folder: &Path, job: &Job) -> usize {
    Submap::left_out_frames(&job.submap(folder)).unwrap_or_default()
}

pub fn status(folder: &Path, json: bool) -> anyhow::Result<()> {
    let manifest = Manifest::read(folder)?;
    if json {
        let poses = fleet::poses(&manifest, folder)?;
        let rows = manifest.jobs.iter().zip(&poses).map(|(job, pose)| {
            serde_json::json!({
                "name": job.name, "id": job.id, "bytes": job.bytes, "state": word(job.state(folder)),
                "left_out_frames": left_out(folder, job),
                "sums": pose.as_ref().ok().map(|pose| job.sums(folder, pose)),
            })
        });
        outln!("{}", serde_json::to_string_pretty(&rows.collect::<Vec<_>>())?);
        return Ok(());
    }
    outln!("{:<24}{:<20}{:>14}  state", "recording", "id", "memory, MiB");
    manifest.jobs.iter().for_each(|job| {
        outln!("{:<24}{:<20}{:>14}  {}", job.name, job.id, job.bytes >> 20, state(folder, job))
    });
    Ok(())
}
