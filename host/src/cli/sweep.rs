//! `dynvox sweep`.

use super::fleet::jobs;
use super::run;
use crate::fleet::{Job, Manifest};
use crate::input::depth::DepthChoice;
use crate::input::{self, OpenOptions};
use crate::owned::check_overlap;
use crate::request::{Memory, Reference, Request, Settings};
use crate::sweep::{Data, Kind, Plan, Results, RunResult, SweepFolder, SweepRequest, merge};
use anyhow::{Context, bail};
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct SweepArgs {
    /// Data sets: street, room, yard, town, PATH or PATH:SEQUENCE [default: street]
    data: Vec<Data>,
    /// Settings to vary
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Kind::PruneWeight, Kind::FrameRate, Kind::Scale])]
    sweeps: Vec<Kind>,
    /// Prune weights
    #[arg(long, value_delimiter = ',', default_values_t = [0, 1, 2, 3, 5, 8, 10], value_name = "W,...")]
    weights: Vec<u8>,
    /// Frames from one that is fused to the next
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12], value_name = "K,...")]
    rates: Vec<u32>,
    /// Sizes of the images, percent
    #[arg(long, value_delimiter = ',', default_values_t = [100, 75, 50, 25], value_name = "PERCENT,...")]
    scales: Vec<u32>,
    /// Sources of depth, as `dynvox run --depth` takes them; exact is for synthetic worlds only
    #[arg(long, value_delimiter = ',', default_values_t = ["elas".to_owned(), "exact".to_owned()], value_name = "SOURCE,...")]
    depths: Vec<String>,
    /// Pruning lag of the first two sweeps, frames
    #[arg(long, default_value_t = 40, value_name = "N")]
    prune_lag: u32,
    /// Frames after which the first two sweeps evaluate the map, after pruning
    #[arg(long, default_value_t = 80, value_name = "N")]
    evaluation_delay: usize,
    /// Byte budget of every run
    #[arg(long, default_value = "desktop", value_name = "NAME")]
    profile: String,
    /// Threads of a run; the result does not depend on them
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Frames of a run at most
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// One setting of every run; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Run nothing: make jobs in --out, each with its bytes of memory, which dynvox fleet run does
    /// in shares; --merge draws the page
    #[arg(long)]
    plan: bool,
    /// Merge the folders of several machines into --out, without a run; --out may be one of them
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["data", "plan"])]
    merge: Vec<PathBuf>,
    /// Folder for results, tables and report.html; an interrupted sweep continues there
    #[arg(long, default_value = "out/sweep", value_name = "DIR")]
    out: PathBuf,
    /// Write points and figures to standard output as JSON, and nothing else
    #[arg(long)]
    json: bool,
    /// Show no progress
    #[arg(long)]
    quiet: bool,
}

pub fn run(args: &SweepArgs) -> anyhow::Result<()> {
    if !args.merge.is_empty() {
        let (plan, folder, results) = merge(&args.merge, &args.out)?;
        let page = folder.draw(&plan, &results)?;
        return print_result(args, &plan, &results, &page);
    }
    let data = if args.data.is_empty() { vec![Data::default()] } else { args.data.clone() };
    let labels: Vec<String> = data.iter().map(Data::label).collect();
    if let Some(twice) = labels
        .iter()
        .enumerate()
        .find_map(|(at, label)| labels[..at].contains(label).then_some(label))
    {
        bail!("two data sets have the name {twice}. Sweep them into two folders");
    }
    let plan = args.plan_of(&data)?;
    let inputs: Vec<PathBuf> =
        data.iter().filter_map(|data| data.path().map(Path::to_path_buf)).collect();
    check_overlap(&args.out, &inputs)?;
    let folder = SweepFolder::open(&args.out, &plan)?;
    let keys = plan.keys();
    let request = |key: &str| -> anyhow::Result<Request> {
        let found = data_of(&plan, key, &labels).and_then(|at| data.get(at));
        let asked = found.zip(plan.runs.get(key)).context("a run is of no point of the sweep")?;
        args.request(asked.0, asked.1)
    };
    if args.plan {
        let job = |key: &&str| jobs::of_figures(key, request(key)?, SweepFolder::result_below(key));
        return jobs::write(
            &Manifest::of(keys.iter().map(job).collect::<anyhow::Result<_>>()?),
            &args.out,
        );
    }
    for (at, key) in keys.iter().enumerate() {
        if folder.result(key).is_file() {
            continue;
        }
        let request = request(key)?;
        if !args.quiet && !args.json {
            errln!("run {} of {}: {}", at + 1, keys.len(), request.words());
        }
        figures(&folder, &plan, key, &request)?.write(&folder.result(key))?;
        // The page is written after every run, so that an interrupted sweep has one, too.
        folder.draw(&plan, &folder.results(&plan)?)?;
    }
    let results = folder.results(&plan)?;
    let page = folder.draw(&plan, &results)?;
    print_result(args, &plan, &results, &page)
}

impl SweepArgs {
    /// Points and runs of the sweeps.
    fn plan_of(&self, data: &[Data]) -> anyhow::Result<Plan> {
        let data = data.iter().map(|one| Ok((one.clone(), reference(one)?)));
        let depths = self.depths.iter().map(|name| Ok((name.clone(), depth(name)?)));
        Ok(Plan::new(&SweepRequest {
            data: data.collect::<anyhow::Result<_>>()?,
            kinds: self.sweeps.clone(),
            weights: self.weights.clone(),
            rates: self.rates.clone(),
            scales: self.scales.clone(),
            depths: depths.collect::<anyhow::Result<_>>()?,
            prune_lag: self.prune_lag,
            evaluation_delay: self.evaluation_delay,
            common: self.common()?,
        })?)
    }

    /// Request of every run.
    fn common(&self) -> anyhow::Result<Request> {
        let mut common = Request::default();
        common.bounds.memory = Memory::Profile(self.profile.clone());
        common.frames.most = self.frames;
        common.settings = Settings::resolve(None, &self.set)?;
        Ok(common)
    }

    /// Request of one run on this machine.
    fn request(&self, data: &Data, asked: &Request) -> anyhow::Result<Request> {
        let mut request = asked.clone();
        request.input.source = data.source.clone();
        request.input.sequence = data.sequence.clone();
        request.limits.threads = self.threads;
        Ok(request.absolute()?)
    }
}

/// A source of depth by its name.
fn depth(name: &str) -> anyhow::Result<DepthChoice> {
    name.parse().map_err(|why: String| anyhow::anyhow!("--depths {name} cannot be used: {why}"))
}

/// The reference that a data set has.
fn reference(data: &Data) -> anyhow::Result<Option<Reference>> {
    let Some(path) = data.path() else { return Ok(Some(Reference::Exact)) };
    let dataset = input::open(
        path,
        &OpenOptions { sequence: data.sequence.clone(), ..OpenOptions::default() },
    )?;
    let has_lidar = (0..dataset.len()).any(|index| dataset.has_lidar(index));
    Ok(has_lidar.then_some(Reference::Lidar))
}

/// Finds the data set that a run belongs to.
fn data_of(plan: &Plan, key: &str, labels: &[String]) -> Option<usize> {
    let point = plan.points.iter().find(|point| point.run == key)?;
    labels.iter().position(|label| *label == point.data)
}

/// Runs once. Only the result remains.
fn figures(
    folder: &SweepFolder,
    plan: &Plan,
    key: &str,
    request: &Request,
) -> anyhow::Result<RunResult> {
    let result = || -> anyhow::Result<RunResult> {
        let record = run::record(request.resolve()?, &folder.scratch_dir(key))?;
        Ok(RunResult::from_run(
            plan.runs.get(key).context("it is of no point of the sweep")?,
            &record,
        )?)
    };
    result().with_context(|| format!("run {key} ended"))
}

/// Does the run of a job in the folder of a sweep.
pub fn figures_of(folder: &Path, job: &Job) -> anyhow::Result<RunResult> {
    let folder = SweepFolder::new(folder);
    figures(&folder, &folder.plan()?, &job.name, &job.request)
}

fn print_result(
    args: &SweepArgs,
    plan: &Plan,
    results: &Results,
    page: &Path,
) -> anyhow::Result<()> {
    if args.json {
        let points = plan.points.iter().map(|point| {
            let result = results.get(&point.run);
            let mut value = serde_json::to_value(point)?;
            value["request"] = serde_json::to_value(plan.runs.get(&point.run))?;
            value["summary"] =
                result.map_or(serde_json::Value::Null, |result| result.summary.clone());
            Ok(value)
        });
        let points = points.collect::<anyhow::Result<Vec<_>>>()?;
        let of = json!({ "page": page, "runs": plan.runs.len(), "finished": results.len(), "points": points });
        outln!("{of:#}");
    } else if !args.quiet {
        outln!("{} of {} runs finished", results.len(), plan.runs.len());
        outln!("{}", page.display());
    }
    Ok(())
}
