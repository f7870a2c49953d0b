//! Manifest of the work: a list of recordings becomes a list of jobs, each with its bytes of memory
//! and a name that is a hash of all that decides its result, so that what is done is known by its
//! folder.

use super::{FleetError, Recording, Recordings, part_frames, submap, tile_file};
use crate::formats::bounds::MANIFEST_TEXT;
use crate::formats::read_text_within;
use crate::owned::OwnedFolder;
use crate::request::Request;
use crate::run::{self, write_whole};
use dynvox_core::digest::Digest;
use dynvox_core::geometry::Transform;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Name of the list of jobs.
pub const MANIFEST_FILE: &str = "jobs.json";
/// One run to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// The recording's name.
    pub name: String,
    /// Hash of the program's version, the request, the settings and the images.
    pub id: String,
    /// Request of its run.
    pub request: Request,
    /// Given pose in the world.
    #[serde(flatten)]
    pub given: Given,
    /// The epoch it belongs to.
    pub epoch: u32,
    /// Most memory of the run, bytes.
    pub bytes: u64,
}

/// Source of a recording's pose in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Given {
    /// First camera in the world, camera to world: the rows of a 3 x 4 matrix.
    TWorldCamera([f64; 12]),
    /// Along fixes of a receiver of satellites.
    Gnss {
        /// File or folder of the fixes.
        file: PathBuf,
        /// The antenna in the camera's axes, m.
        antenna_m: [f64; 3],
        /// Latitude and longitude, degrees, and altitude, m, of the world's origin.
        origin: [f64; 3],
        /// Id of the recording's part before this one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        follows: Option<String>,
    },
    /// At the end of the recording's part before this one: its id.
    Follows(String),
    /// Nowhere: the run's figures are wanted, as this file below the folder of the jobs, and no
    /// map.
    Figures(PathBuf),
}

impl Given {
    /// Id of the recording's part before this one.
    pub fn follows(&self) -> Option<&str> {
        match self {
            Self::Follows(id) => Some(id),
            Self::Gnss { follows, .. } => follows.as_deref(),
            Self::TWorldCamera(_) | Self::Figures(_) => None,
        }
    }
}

/// State of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JobState {
    /// Finished: the map or its figures exist.
    Done,
    /// A run was started: it goes on, or ended early.
    Started,
    /// Nothing is there.
    Open,
}

/// Fingerprint of a request's run and the facts needed to plan it.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Hash of settings and images.
    pub digest: u64,
    /// Most memory of the run, bytes.
    pub bytes: u64,
    /// Pose of the first camera, if poses come from a file.
    pub first_pose: Option<Transform>,
    /// Frames of the run; 0 where their end is not known.
    pub frames: usize,
}

/// All jobs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The program that planned them, and its formats: another one may map otherwise, and does not
    /// take over what this one did.
    pub program: String,
    /// In the order of the recordings.
    pub jobs: Vec<Job>,
}

/// The program's version, and those of what fleet keeps: maps in their own lattice, sums.
fn program() -> String {
    format!("{}, maps {}, sums {}", run::program(), submap::VERSION, tile_file::VERSION)
}

impl Manifest {
    /// The jobs of recordings. `request_of` gives the request of a recording's arguments,
    /// `identify` what a request's run is.
    ///
    /// # Errors
    /// A recording has no pose in the world, or `request_of` or `identify` fails.
    pub fn plan<E: From<FleetError>>(
        path: &Path,
        recordings: &Recordings,
        request_of: impl Fn(&[String]) -> Result<Request, E>,
        identify: impl Fn(&Request) -> Result<Identity, E>,
    ) -> Result<Self, E> {
        let mut jobs: Vec<Job> = Vec::new();
        let origin = recordings.origin()?;
        for recording in &recordings.recordings {
            let Recording { arguments, epoch, .. } = recording;
            // A recording's own arguments come before those of all.
            let arguments: Vec<String> =
                arguments.iter().chain(&recordings.arguments).cloned().collect();
            let whole = request_of(&arguments)?;
            let mut before: Option<String> = None;
            for (name, request) in parts_of(path, recording, whole, &identify)? {
                let identity = identify(&request)?;
                let given = recording
                    .given(origin, identity.first_pose.as_ref(), before.take())
                    .map_err(|reason| FleetError::content(path, reason))?;
                let job = Job { epoch: *epoch, ..Job::new(&name, request, &identity, given) };
                // A job's name follows from what it maps: twice the same would be merged twice.
                if let Some(same) = jobs.iter().find(|other| other.id == job.id) {
                    return Err(FleetError::content(
                        path,
                        format!("has one recording twice: {} is {name}. Remove one", same.name),
                    )
                    .into());
                }
                before = Some(job.id.clone());
                jobs.push(job);
            }
        }
        Ok(Self::of(jobs))
    }

    /// Jobs planned by this program.
    pub fn of(jobs: Vec<Job>) -> Self {
        Self { program: program(), jobs }
    }

    /// Reads the jobs in a folder.
    ///
    /// # Errors
    /// The folder has no list of jobs, or another version of the program planned them.
    pub fn read(folder: &Path) -> Result<Self, FleetError> {
        let path = folder.join(MANIFEST_FILE);
        let text = read_text_within(&path, &MANIFEST_TEXT)?;
        let again = "Make it with `dynvox fleet plan`";
        let manifest: Self = serde_json::from_str(&text).map_err(|error| {
            FleetError::content(
                &path,
                format!("is no list of jobs of this version: {error}. {again}"),
            )
        })?;
        // Another version may map to other bits.
        if manifest.program != program() {
            let [planned, own] = [&manifest.program, &program()];
            return Err(FleetError::content(
                &path,
                format!("was planned by {planned}; this is {own}, which maps anew. {again}"),
            ));
        }
        Ok(manifest)
    }

    /// Writes the jobs into a folder.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn write(&self, folder: &Path) -> Result<(), FleetError> {
        // Held while the file is written.
        let _owned = OwnedFolder::open_or_create(folder)
            .map_err(|error| FleetError::io(folder)(error.into()))?;
        let path = folder.join(MANIFEST_FILE);
        let text = serde_json::to_string_pretty(self)
            .map_err(|error| FleetError::content(&path, error.to_string()))?;
        write_whole(&path, |file| file.write_all(text.as_bytes()))
            .map_err(|error| FleetError::content(&path, error.to_string()))
    }

    /// The jobs of one of `shards` workers.
    pub fn shard(&self, index: usize, shards: usize) -> impl Iterator<Item = &Job> {
        self.jobs.iter().skip(index).step_by(shards.max(1))
    }
}

/// Names and requests of a recording's parts; of one that does not bend its own.
fn parts_of<E: From<FleetError>>(
    path: &Path,
    recording: &Recording,
    whole: Request,
    identify: impl Fn(&Request) -> Result<Identity, E>,
) -> Result<Vec<(String, Request)>, E> {
    let Recording { name, part_frames: asked, .. } = recording;
    let Some(asked) = *asked else { return Ok(vec![(name.clone(), whole)]) };
    let refuse =
        |why: String| FleetError::content(path, format!("has part_frames for {name}, {why}"));
    if asked < part_frames::MIN_FRAMES {
        let least = part_frames::MIN_FRAMES;
        return Err(refuse(format!("of {asked} frames. Give {least} or more")).into());
    }
    let frames = identify(&whole)?.frames;
    if frames == 0 {
        return Err(refuse("whose frames cannot be counted. Remove it".to_owned()).into());
    }
    let part = |(nth, [first, most]): (usize, [usize; 2])| {
        let mut request = whole.clone();
        request.frames.start += first * request.frames.stride.max(1);
        request.frames.most = Some(most);
        (format!("{name}.{nth}"), request)
    };
    Ok((1..).zip(part_frames::frames_of_parts(frames, asked)).map(part).collect())
}

impl Job {
    /// The job of a run, and what is wanted of it.
    pub fn new(name: &str, request: Request, identity: &Identity, given: Given) -> Self {
        Self {
            name: name.to_owned(),
            id: id(&request, identity.digest),
            request,
            given,
            epoch: 0,
            bytes: identity.bytes,
        }
    }

    /// Returns true if settings and images are those the job was planned with.
    pub fn is_of(&self, digest: u64) -> bool {
        self.id == id(&self.request, digest)
    }

    /// Returns the folder of the map in the world's lattice at a pose; the name is a hash of both.
    pub fn sums(&self, folder: &Path, t_world_map: &Transform) -> PathBuf {
        let mut digest = Digest::default();
        digest.bytes(self.id.as_bytes());
        digest.u64(self.epoch.into());
        rows_of(t_world_map).iter().for_each(|&number| digest.f64(number));
        folder.join("sums").join(format!("{:016x}", digest.finish()))
    }

    /// Returns the folder of the map in its own lattice, below the folder of the jobs.
    pub fn submap(&self, folder: &Path) -> PathBuf {
        folder.join("submaps").join(&self.id)
    }

    /// Returns the run folder of the job.
    pub fn run_folder(&self, folder: &Path) -> PathBuf {
        folder.join("runs").join(&self.id)
    }

    /// Returns the state of the job, read from its folders.
    pub fn state(&self, folder: &Path) -> JobState {
        let run = self.run_folder(folder);
        // A run that was killed has a partial folder.
        let started = run.exists() || run.with_file_name(format!(".{}.partial", self.id)).exists();
        // What the job is for must be there, and not only its run.
        let is_done = match &self.given {
            Given::Figures(file) => folder.join(file).is_file(),
            Given::TWorldCamera(_) | Given::Gnss { .. } | Given::Follows(_) => {
                self.submap(folder).is_dir()
            }
        };
        match (is_done, started) {
            (true, _) => JobState::Done,
            (false, true) => JobState::Started,
            (false, false) => JobState::Open,
        }
    }
}

fn id(request: &Request, of_input: u64) -> String {
    let mut digest = Digest::default();
    digest.bytes(program().as_bytes());
    // What cannot be stored has no job: the manifest is not written.
    digest.bytes(&serde_json::to_vec(request).unwrap_or_default());
    digest.u64(of_input);
    format!("{:016x}", digest.finish())
}

/// A motion as the rows of a 3 x 4 matrix.
pub(super) fn rows_of(transform: &Transform) -> [f64; 12] {
    let rows = transform.matrix_3x4();
    std::array::from_fn(|at| rows[at / 4][at % 4])
}

/// A motion from the rows of a 3 x 4 matrix; `None` where they are no rigid motion.
pub(super) fn transform(rows: &[f64; 12]) -> Option<Transform> {
    let row = |at: usize| [rows[4 * at], rows[4 * at + 1], rows[4 * at + 2]];
    let matrix = [row(0), row(1), row(2)];
    // Rows of length 1, at right angles.
    let is_rotation = (0..3).all(|a| {
        (0..3).all(|b| {
            let dot: f64 = (0..3).map(|axis| matrix[a][axis] * matrix[b][axis]).sum();
            (dot - f64::from(u8::from(a == b))).abs() < 1e-6
        })
    });
    let transform = Transform::from_rotation_matrix(&matrix, [rows[3], rows[7], rows[11]]);
    (is_rotation && transform.is_finite()).then_some(transform)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::RECORDINGS_EXAMPLE;

    fn request_of(arguments: &[String]) -> Result<Request, FleetError> {
        let mut request = Request::default();
        request.input.sequence = Some(arguments.join(" "));
        Ok(request)
    }

    fn identify(request: &Request) -> Result<Identity, FleetError> {
        let words = request.input.sequence.iter().flat_map(|words| words.split(' ')).count();
        let frames = request.frames.most.unwrap_or(100);
        Ok(Identity { digest: words as u64, bytes: 7, first_pose: None, frames })
    }

    #[test]
    fn parts_follow_one_another() {
        let root = tempfile::TempDir::new().unwrap();
        let path = root.path().join("recordings.toml");
        let plan = |lines: &str| {
            let text = format!(
                "[[recording]]\nname = \"monday\"\narguments = [\"rig\"]\npart_frames = {lines}\n"
            );
            std::fs::write(&path, text).unwrap();
            Manifest::plan(&path, &Recordings::read(&path).unwrap(), request_of, identify)
        };
        let manifest = plan("40\nt_world_camera = [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0]").unwrap();
        let [first, second, third] = &manifest.jobs[..] else { panic!("{manifest:?}") };
        assert_eq!([&first.name, &third.name], ["monday.1", "monday.3"]);
        assert!(matches!(first.given, Given::TWorldCamera(rows) if rows[3] == 5.0));
        assert_eq!(second.given, Given::Follows(first.id.clone()));
        assert_eq!(third.given.follows(), Some(&second.id[..]));
        assert_eq!((third.request.frames.start, third.request.frames.most), (60, Some(40)));
        // What is written is what is read.
        let folder = root.path().join("fleet");
        manifest.write(&folder).unwrap();
        assert_eq!(Manifest::read(&folder).unwrap(), manifest);
        let refused = plan("5").unwrap_err().to_string();
        assert!(refused.contains("Give 20 or more"), "{refused}");
    }

    #[test]
    fn the_example_is_planned_written_read_and_sharded() {
        let root = tempfile::TempDir::new().unwrap();
        let path = root.path().join("recordings.toml");
        std::fs::write(&path, RECORDINGS_EXAMPLE).unwrap();
        let manifest =
            Manifest::plan(&path, &Recordings::read(&path).unwrap(), request_of, identify).unwrap();
        // The folder of the list is the user's own.
        let refused = manifest.write(root.path()).unwrap_err().to_string();
        assert!(refused.contains("has no marker"), "a folder of the user's: {refused}");
        let folder = root.path().join("fleet");
        manifest.write(&folder).unwrap();
        assert_eq!(Manifest::read(&folder).unwrap(), manifest);
        let [monday, tuesday] = &manifest.jobs[..] else { panic!("{manifest:?}") };
        assert_eq!(
            monday.request.input.sequence.as_deref(),
            Some("recordings/monday --instances none --memory 256MiB"),
            "its own arguments, then those of all"
        );
        assert_eq!(
            tuesday.given,
            Given::TWorldCamera([1.0, 0.0, 0.0, 5.2, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, -3.1])
        );
        assert!(monday.is_of(5) && !monday.is_of(4) && monday.id != tuesday.id);
        assert_eq!(manifest.shard(1, 2).collect::<Vec<_>>(), [tuesday]);
        assert_eq!(tuesday.state(&folder), JobState::Open);
        // A finished job is told by its submap, and by nothing that would have to be kept in step.
        std::fs::create_dir_all(tuesday.submap(&folder)).unwrap();
        assert_eq!(tuesday.state(&folder), JobState::Done);
    }

    #[test]
    fn jobs_of_another_version_are_refused() {
        let root = tempfile::TempDir::new().unwrap();
        let path = root.path().join(MANIFEST_FILE);
        Manifest { program: program(), jobs: Vec::new() }.write(root.path()).unwrap();
        assert!(Manifest::read(root.path()).is_ok());
        let text = std::fs::read_to_string(&path).unwrap();
        // Sums of another version cannot be added to these.
        std::fs::write(&path, text.replace("sums 1", "sums 0")).unwrap();
        let refused = Manifest::read(root.path()).unwrap_err().to_string();
        assert!(
            refused.contains("sums 0; this is dynvox ")
                && refused.contains("Make it with `dynvox fleet plan`"),
            "{refused}"
        );
    }

    #[test]
    fn jobs_of_a_format_with_arguments_are_refused_with_the_next_action() {
        let root = tempfile::TempDir::new().unwrap();
        // As the version before wrote it.
        let job = r#"{"name": "monday", "id": "07", "arguments": ["rig"], "figures": "a.json", "epoch": 0, "bytes": 7}"#;
        let text = format!(r#"{{"program": "{}", "jobs": [{job}]}}"#, program());
        std::fs::write(root.path().join(MANIFEST_FILE), text).unwrap();
        let refused = Manifest::read(root.path()).unwrap_err().to_string();
        assert!(
            refused.contains("no list of jobs of this version: missing field `request`")
                && refused.contains("Make it with `dynvox fleet plan`"),
            "{refused}"
        );
    }
}
