//! `dynvox fixtures`.

use crate::fixtures::{self, Blessing, Verdict};
use crate::input::masks::MaskChoice;
use crate::owned::check_overlap;
use crate::request::{Bytes, Options, Request, RequestError, ScaleWord};
use crate::run::replace_whole;
use crate::terminal::quoted;
use anyhow::bail;
use dynvox_core::Serial;
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct FixturesArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Make a fixture of frames of a data set: pictures, calibration, masks, settings, bounds and
    /// their digests
    New(Box<NewArgs>),
    /// Replay fixtures and compare every digest with the golden ones
    Verify {
        /// A fixture, or a folder of fixtures
        #[arg(default_value = "fixtures", value_name = "DIR")]
        path: PathBuf,
        /// Write the verdicts to standard output as JSON, and nothing else
        #[arg(long)]
        json: bool,
        /// Write the verdicts as JUnit XML, for a CI server
        #[arg(long, value_name = "FILE")]
        junit: Option<PathBuf>,
    },
    /// Rewrite the golden digests, with the reason
    Bless {
        /// A fixture, or a folder of fixtures
        #[arg(default_value = "fixtures", value_name = "DIR")]
        path: PathBuf,
        /// Reason why the digests are meant to change
        #[arg(long, value_name = "TEXT", required_unless_present = "dry_run")]
        reason: Option<String>,
        /// Say what would be blessed, and write nothing
        #[arg(long)]
        dry_run: bool,
        /// Write what was done to standard output as JSON
        #[arg(long)]
        json: bool,
    },
    /// Pack a fixture into one file that a firmware can embed
    Pack {
        /// The fixture
        fixture: PathBuf,
        /// File to write
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Write its bounds and settings as Rust constants, CAPACITY and CONFIG, for the firmware
        /// to include
        #[arg(long, value_name = "FILE")]
        rust: Option<PathBuf>,
    },
}

/// Arguments of `dynvox fixtures new`. The options are those of `dynvox run`.
#[derive(Debug, clap::Args)]
struct NewArgs {
    /// Folder to write
    folder: PathBuf,
    /// Data set to take the frames from
    #[arg(long, value_name = "DATASET")]
    from: PathBuf,
    /// Frames to take
    #[arg(long, default_value_t = 24, value_name = "N")]
    frames: usize,
    /// First frame
    #[arg(long, value_name = "N")]
    start: Option<usize>,
    /// Shrink the images, above 0 and up to 1
    #[arg(long, value_name = "S")]
    scale: Option<f64>,
    /// Bytes of memory to replay in, divided for the images [default: 32MiB]
    #[arg(long, value_name = "BYTES", conflicts_with = "profile")]
    memory: Option<Bytes>,
    /// Bounds by name
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
    /// Sequence within the data set
    #[arg(long, value_name = "NAME")]
    sequence: Option<String>,
    /// Calibration instead of the recording's own
    #[arg(long, value_name = "FILE")]
    calibration: Vec<PathBuf>,
    /// Source of instance masks
    #[arg(long, value_name = "SOURCE")]
    instances: Option<MaskChoice>,
    /// Settings from a file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One setting; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write what was made to standard output as JSON
    #[arg(long)]
    json: bool,
}

impl NewArgs {
    /// Makes the request of a run from the arguments.
    fn request(&self) -> Result<Request, RequestError> {
        let memory = self.memory.or(self.profile.is_none().then_some(DEFAULT_MEMORY));
        let options = Options {
            path: Some(self.from.clone()),
            frames: Some(self.frames),
            start: self.start,
            scale: self.scale.map(ScaleWord::Images).into_iter().collect(),
            memory,
            profile: self.profile.clone(),
            sequence: self.sequence.clone(),
            calibration: self.calibration.clone(),
            instances: self.instances.clone(),
            config: self.config.clone(),
            set: self.set.clone(),
            ..Options::default()
        };
        options.request()
    }
}

/// The default budget of a new fixture: a microcontroller with external memory.
const DEFAULT_MEMORY: Bytes = Bytes(32 << 20);

fn new(args: &NewArgs) -> anyhow::Result<()> {
    let plan = args.request()?.resolve()?;
    check_overlap(&args.folder, &plan.request.inputs())?;
    let frames = fixtures::create(&args.folder, &plan, &Serial)?;
    if args.json {
        outln!(
            "{:#}",
            json!({ "fixture": args.folder, "frames": frames, "bytes": plan.capacity.bytes() })
        );
        return Ok(());
    }
    let (shown, quoted) = (args.folder.display(), quoted(&args.folder));
    let mib = plan.capacity.bytes() as f64 / f64::from(1 << 20);
    outln!(
        "{shown}: {frames} frames, replayed in {mib:.1} MiB. Commit the folder, and compare with: \
         dynvox fixtures verify {quoted}"
    );
    Ok(())
}

fn verify(path: &Path, json: bool, junit: Option<&Path>) -> anyhow::Result<()> {
    let verdicts = verdicts(path)?;
    if let Some(file) = junit {
        replace_whole(file, |out| out.write_all(fixtures::junit(&verdicts).as_bytes()))?;
    }
    if json {
        outln!("{}", serde_json::to_string_pretty(&verdicts)?);
    } else {
        verdicts.iter().for_each(|verdict| outln!("{}", sentence(verdict)));
    }
    if verdicts.iter().any(|verdict| !verdict.differences.is_empty()) {
        bail!(
            "digests have changed. If that is meant: dynvox fixtures bless {} --reason \"why\"",
            quoted(path)
        );
    }
    Ok(())
}

fn verdicts(path: &Path) -> anyhow::Result<Vec<Verdict>> {
    Ok(fixtures::all(path)?
        .iter()
        .map(|fixture| fixtures::verify(fixture, &Serial))
        .collect::<Result<_, _>>()?)
}

fn bless(path: &Path, reason: &str, json: bool) -> anyhow::Result<()> {
    let mut outcomes = Vec::new();
    for fixture in fixtures::all(path)? {
        let written = fixtures::bless(&fixture, reason, &Serial)? == Blessing::Written;
        if !json {
            outln!("{} is {}", fixture.display(), if written { "blessed" } else { "unchanged" });
        }
        outcomes.push(json!({ "fixture": fixture, "blessed": written }));
    }
    if json {
        outln!("{:#}", serde_json::Value::from(outcomes));
    }
    Ok(())
}

pub fn run(args: &FixturesArgs) -> anyhow::Result<()> {
    match &args.action {
        Action::New(args) => new(args)?,
        Action::Verify { path, json, junit } => verify(path, *json, junit.as_deref())?,
        Action::Bless { path, dry_run: true, json, .. } => {
            let verdicts = verdicts(path)?;
            if *json {
                outln!("{}", serde_json::to_string_pretty(&verdicts)?);
            } else {
                verdicts.iter().for_each(|verdict| outln!("{}", sentence(verdict)));
            }
        }
        Action::Bless { path, reason, json, .. } => {
            bless(path, reason.as_deref().unwrap_or_default(), *json)?
        }
        Action::Pack { fixture, out, rust } => {
            let bytes = fixtures::pack(fixture)?;
            if let Some(rust) = rust {
                let text = fixtures::constants(fixture, &bytes)?;
                replace_whole(rust, |file| file.write_all(text.as_bytes()))?;
            }
            replace_whole(out, |file| file.write_all(&bytes))?;
            outln!("{} bytes in {}", bytes.len(), out.display());
        }
    }
    Ok(())
}

/// Frames named in a sentence, at most.
const NAMED: usize = 3;

fn sentence(verdict: &Verdict) -> String {
    let name = verdict.fixture.display();
    let Some(first) = verdict.differences.first() else {
        return format!("{name}: {} frames, all digests equal", verdict.frames);
    };
    let columns = first.columns.join(", ");
    let others: Vec<String> =
        verdict.differences.iter().skip(1).take(NAMED).map(|one| one.frame.to_string()).collect();
    let more = verdict.differences.len().saturating_sub(1 + NAMED);
    let more = match (others.is_empty(), more) {
        (true, _) => String::new(),
        (false, 0) => format!("; frames {} differ too", others.join(", ")),
        (false, more) => format!("; frames {} and {more} more differ too", others.join(", ")),
    };
    format!("{name}: first divergence: frame {}, {columns}{more}", first.frame)
}
