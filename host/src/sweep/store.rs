//! A sweep's folder: the plan, a file for each finished run, tables and page of the results so far.

use super::{Plan, RunResult, SweepError, page, table};
use crate::formats::bounds::MANIFEST_TEXT;
use crate::formats::read_text_within;
use crate::owned::{OwnedFolder, create_folder};
use crate::run::{FolderError, write_whole};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Results by key.
pub type Results = BTreeMap<String, RunResult>;

/// The folder.
#[derive(Debug)]
pub struct SweepFolder {
    root: PathBuf,
}

impl SweepFolder {
    /// Opens the folder of a plan, or creates it.
    ///
    /// # Errors
    /// The folder belongs to another plan, or the disk refuses.
    pub fn open(root: &Path, plan: &Plan) -> Result<Self, SweepError> {
        let folder = Self { root: root.to_path_buf() };
        let runs = folder.root.join("runs");
        let failed = |source| FolderError::Write { path: root.to_path_buf(), source };
        drop(OwnedFolder::open_or_create(root).map_err(|error| failed(error.into()))?);
        create_folder(&runs).map_err(|source| FolderError::Write { path: runs, source })?;
        let path = folder.root.join("plan.json");
        // A folder continues only the plan it was made for.
        if path.is_file() {
            if folder.plan()? != *plan {
                return Err(SweepError::Other { path });
            }
        } else {
            let text = serde_json::to_vec_pretty(plan).map_err(|error| SweepError::Foreign {
                path: path.clone(),
                reason: error.to_string(),
            })?;
            // Written as a whole: an interruption leaves no half of a plan.
            write_whole(&path, |file| file.write_all(&text))?;
        }
        Ok(folder)
    }

    /// The folder of a plan that is there.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_path_buf() }
    }

    /// The plan in the folder.
    ///
    /// # Errors
    /// There is no plan.
    pub fn plan(&self) -> Result<Plan, SweepError> {
        let path = self.root.join("plan.json");
        let text = read_text_within(&path, &MANIFEST_TEXT)
            .map_err(|error| SweepError::Read { path: path.clone(), source: error.into() })?;
        serde_json::from_str(&text)
            .map_err(|error| SweepError::Foreign { path, reason: error.to_string() })
    }

    /// Returns the path of a run's result, whether or not it exists yet.
    pub fn result(&self, key: &str) -> PathBuf {
        self.root.join(Self::result_below(key))
    }

    /// Returns the path of a run's result below the sweep's folder.
    pub fn result_below(key: &str) -> PathBuf {
        Path::new("runs").join(format!("{key}.json"))
    }

    /// Scratch directory of a run.
    pub fn scratch_dir(&self, key: &str) -> PathBuf {
        self.root.join("runs").join(key)
    }

    /// All results so far.
    ///
    /// # Errors
    /// A result cannot be read, or is of another request.
    pub fn results(&self, plan: &Plan) -> Result<Results, SweepError> {
        let mut results = Results::new();
        for (key, request) in &plan.runs {
            // A result that is missing is a run not yet made; one of another request is another
            // sweep's.
            let path = self.result(key);
            if let Some(result) = RunResult::read(&path)? {
                if result.request != *request {
                    return Err(SweepError::Foreign {
                        path,
                        reason: "it is of another request".to_owned(),
                    });
                }
                results.insert(key.clone(), result);
            }
        }
        Ok(results)
    }

    /// Writes a table for each sweep, and the page.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn draw(&self, plan: &Plan, results: &Results) -> Result<PathBuf, SweepError> {
        for kind in plan.kinds() {
            write_whole(&self.root.join(format!("{}.csv", kind.name())), |file| {
                file.write_all(&table::csv(plan, kind, results)?)
            })?;
        }
        let page = self.root.join("report.html");
        write_whole(&page, |file| {
            file.write_all(page::html(plan, results).into_string().as_bytes())
        })?;
        Ok(page)
    }
}

/// Merges parts made on several machines into `target`.
///
/// # Errors
/// The parts belong to different plans, or have different results of one run.
pub fn merge(parts: &[PathBuf], target: &Path) -> Result<(Plan, SweepFolder, Results), SweepError> {
    let mut merged: Option<(Plan, Results)> = None;
    for root in parts {
        let part = SweepFolder::new(root);
        let plan = part.plan()?;
        let results = part.results(&plan)?;
        let Some((first, all)) = &mut merged else {
            merged = Some((plan, results));
            continue;
        };
        // Results of two plans cannot be put into one table.
        if *first != plan {
            return Err(SweepError::Other { path: root.join("plan.json") });
        }
        // The same run on two machines must give the same digest.
        for (run, result) in results {
            let digest = |result: &RunResult| {
                result.summary["digest"].as_str().unwrap_or_default().to_owned()
            };
            if let Some(known) = all.get(&run).filter(|known| digest(known) != digest(&result)) {
                return Err(SweepError::Differs {
                    path: root.clone(),
                    run,
                    ours: digest(known),
                    theirs: digest(&result),
                });
            }
            all.insert(run, result);
        }
    }
    // Without parts the result is an empty plan.
    let (plan, results) = merged
        .unwrap_or_else(|| (Plan { points: Vec::new(), runs: BTreeMap::new() }, Results::new()));
    let folder = SweepFolder::open(target, &plan)?;
    for (key, result) in &results {
        result.write(&folder.result(key))?;
    }
    Ok((plan, folder, results))
}
