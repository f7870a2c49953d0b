//! Choice of an inertial unit for a recording: its own, that of a file, or none.
//!
//! A unit that is asked for must be usable; one that a recording has of its own and that is not is
//! said in a note, and the recording is mapped without it.

pub(super) mod choice;
#[cfg(test)]
mod tests;

use super::data_set::OpenOptions;
use super::source::{
    FrameSource, InertialUnitData, InputError, OwnUnit, UnitSamples, with_inertial_unit,
};
use crate::formats::calibration::UnitCalibration;
use crate::formats::{FormatError, InertialTable, TimedReading, read_inertial};
use choice::InertialChoice;
use std::path::{Path, PathBuf};

/// The source with the unit that the options choose.
///
/// # Errors
/// A unit is asked for, and its samples or its mounting cannot be used.
pub(super) fn attached(
    dataset: Box<dyn FrameSource>,
    options: &OpenOptions,
) -> Result<Box<dyn FrameSource>, InputError> {
    let own = dataset.info().own_unit.clone();
    let found = match (&options.inertial, own) {
        (InertialChoice::None, _) => return Ok(dataset),
        (InertialChoice::Auto, None) if options.inertial_calibration.is_empty() => {
            return Ok(dataset);
        }
        (InertialChoice::Auto, None) => {
            return Err(FormatError::content(
                dataset_path(options),
                "it is the mounting of an inertial unit, and the recording has no samples of one",
                "Give them with --inertial FILE, or leave out --inertial-calibration",
            )
            .into());
        }
        (InertialChoice::File(path), own) => {
            let calibration = match own {
                Some(own) if is_own(&own, path) => own.calibration,
                _ => beside(path),
            };
            let own = OwnUnit { samples: UnitSamples::Files(path.clone()), calibration };
            unit(dataset.as_ref(), &own, options)?
        }
        (InertialChoice::Auto, Some(own)) => match unit(dataset.as_ref(), &own, options) {
            Ok(found) => found,
            Err(error) if options.inertial_calibration.is_empty() => {
                let note = format!("its inertial unit is not used: {error}");
                return Ok(with_inertial_unit(dataset, None, vec![note]));
            }
            Err(error) => return Err(error.into()),
        },
    };
    let (unit, notes) = found;
    Ok(with_inertial_unit(dataset, Some(unit), notes))
}

fn dataset_path(options: &OpenOptions) -> &Path {
    options.inertial_calibration.first().map_or(Path::new(""), PathBuf::as_path)
}

/// Tells whether a path is the recording's own file.
fn is_own(own: &OwnUnit, path: &Path) -> bool {
    let whole = |path: &Path| path.canonicalize().ok();
    matches!(&own.samples, UnitSamples::Files(samples) if whole(samples) == whole(path))
}

/// Files with a unit's mounting next to its samples: EuRoC's, or a matrix.
fn beside(samples: &Path) -> Vec<PathBuf> {
    let folder = samples.parent().unwrap_or(Path::new(""));
    let files = ["sensor.yaml", "../cam0/sensor.yaml"].map(|name| folder.join(name));
    if files.iter().all(|file| file.is_file()) {
        return files.to_vec();
    }
    let matrices = ["imu_to_camera.txt", "imu_to_camera0.txt"].map(|name| folder.join(name));
    matrices.into_iter().find(|file| file.is_file()).into_iter().collect()
}

/// Reads a unit's samples and mounting for a source.
fn unit(
    dataset: &dyn FrameSource,
    own: &OwnUnit,
    options: &OpenOptions,
) -> Result<(InertialUnitData, Vec<String>), FormatError> {
    let table = match &own.samples {
        UnitSamples::Files(path) => read_inertial(path)?,
        UnitSamples::Read(table) => table.clone(),
        UnitSamples::Refused(reason) => {
            return Err(FormatError::content(Path::new(dataset.name()), reason, "Record it anew"));
        }
    };
    let mounting = mounting(&table.path, own, options)?;
    let mut notes = table.notes.clone();
    let readings = on_clock(dataset, &table, mounting.clock_offset_s)?;
    let within_frames = within(dataset, &readings);
    let rectification = dataset.info().rectification.as_ref();
    let r_rectified_raw = rectification.map(|of| &of.left.r_rectified_raw);
    let unit = InertialUnitData {
        t_camera_unit: mounting.t_rectified_unit(r_rectified_raw),
        clock_offset_s: mounting.clock_offset_s,
        noise: mounting.noise,
        rate_hz: table.rate_hz(),
        longest_gap_s: table.longest_gap_s(),
        path: table.path,
        within_frames,
        samples: InertialUnitData::samples_of(&readings),
        readings,
    };
    notes.insert(
        0,
        format!(
            "inertial unit: {within_frames} samples at {:.0} Hz of {} ({}), mounted as {} says",
            unit.rate_hz,
            unit.path.display(),
            table.format,
            mounting.path.display()
        ),
    );
    Ok((unit, notes))
}

/// The mounting: as given, else as the recording's own files say it, else as a camera calibration
/// that is given says it.
fn mounting(
    samples: &Path,
    own: &OwnUnit,
    options: &OpenOptions,
) -> Result<UnitCalibration, FormatError> {
    if !options.inertial_calibration.is_empty() {
        return UnitCalibration::read(&options.inertial_calibration);
    }
    if !options.calibration.is_empty()
        && let Some(found) = UnitCalibration::find(&options.calibration).ok().flatten()
    {
        return Ok(found);
    }
    if !own.calibration.is_empty() {
        return UnitCalibration::read(&own.calibration);
    }
    Err(FormatError::content(
        samples,
        "nothing says how the inertial unit is mounted on the left camera",
        "Give --inertial-calibration with Kalibr's camchain (T_cam_imu), EuRoC's \
         imu0/sensor.yaml and cam0/sensor.yaml, or a file with the 12 numbers of the matrix of \
         unit to left camera coordinates; or --inertial none",
    ))
}

/// Samples on the clock of the frames.
fn on_clock(
    dataset: &dyn FrameSource,
    table: &InertialTable,
    offset_s: f64,
) -> Result<Vec<TimedReading>, FormatError> {
    let offset_ns = (offset_s * 1e9).round() as i64;
    let moved = |reading: &TimedReading| TimedReading {
        time_ns: reading.time_ns.saturating_add(offset_ns),
        ..*reading
    };
    let readings: Vec<TimedReading> = table.readings.iter().map(moved).collect();
    let Some([first_ns, last_ns]) = frame_times_ns(dataset) else {
        return Err(FormatError::content(
            &table.path,
            "the frames have no times, to which its samples could belong",
            "Give the frames times: times.txt, timestamps.txt or stamps as names",
        ));
    };
    if within(dataset, &readings) > 0 {
        return Ok(readings);
    }
    let seconds = |ns: i64| ns as f64 * 1e-9;
    let ends = [readings.first(), readings.last()].map(|end| end.map_or(0, |end| end.time_ns));
    Err(FormatError::content(
        &table.path,
        format!(
            "its samples are of {:.3} s to {:.3} s, and the frames of {:.3} s to {:.3} s",
            seconds(ends[0]),
            seconds(ends[1]),
            seconds(first_ns),
            seconds(last_ns)
        ),
        "Give the samples of this recording, with times on the clock of its frames",
    ))
}

/// Times of the first and the last frame, ns; `None` where frames have none.
fn frame_times_ns(dataset: &dyn FrameSource) -> Option<[i64; 2]> {
    let last = dataset.len().checked_sub(1)?;
    let [first, last] = [dataset.stamp_ns(0)?, dataset.stamp_ns(last)?];
    Some([i64::try_from(first).ok()?, i64::try_from(last).ok()?])
}

/// Number of samples between the first and the last frame.
fn within(dataset: &dyn FrameSource, readings: &[TimedReading]) -> usize {
    let Some([first, last]) = frame_times_ns(dataset) else { return 0 };
    readings.iter().filter(|reading| (first..=last).contains(&reading.time_ns)).count()
}
