//! Report of a board: all that its figures depend on, and that they are of the same bits.

use crate::formats::CapacityFile;
use crate::owned::replace_whole;
use crate::request::Plan;
use crate::run::{self, Bench, Machine};
use anyhow::{Context, bail};
use dynvox_core::parallel::Vectors;
use serde::Serialize;
use std::io::Write;
use std::path::Path;

/// Figures of one machine on one data set, at each level of vector instructions that it has.
#[derive(Debug, Serialize)]
pub struct BoardReport {
    /// Version of program and core.
    program: String,
    machine: Machine,
    /// Arguments that chose data set and settings; the synthetic street without any.
    arguments: Vec<String>,
    /// Name of the bounds, and the bounds.
    profile: String,
    capacity: CapacityFile,
    /// From ordinary code to the most that the machine has.
    levels: Vec<Bench>,
}

impl BoardReport {
    /// Runs a plan at each level.
    pub fn new(plan: &Plan, arguments: &[String]) -> anyhow::Result<Self> {
        // From the least to the most, so that the last one is what `dynvox run` takes.
        let levels: Result<_, _> =
            Vectors::available().map(|vectors| run::bench(plan, vectors)).collect();
        Ok(Self {
            program: run::program(),
            machine: Machine::detect(),
            arguments: arguments.to_vec(),
            profile: plan.profile.clone(),
            capacity: CapacityFile::of(&plan.capacity),
            levels: levels?,
        })
    }

    /// Writes the report as JSON, over an older one.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        replace_whole(path, |file| file.write_all(text.as_bytes())).with_context(|| {
            format!("{} cannot be written. Give another path with --report", path.display())
        })
    }

    /// Prints machine, digests and the times of the best level.
    pub fn print(&self) {
        let machine = &self.machine;
        outln!("{}", self.program);
        // Not every system tells the names of board and processor.
        let named = [machine.board.as_deref(), machine.processor.as_deref()];
        let named: Vec<_> = named.into_iter().flatten().collect();
        outln!(
            "{}{}{}, {} processors, {}",
            named.join(", "),
            if named.is_empty() { "" } else { ", " },
            machine.architecture,
            machine.processors,
            machine.system
        );
        for level in &self.levels {
            let step = level.stages.iter().find(|stage| stage.name == "step");
            outln!(
                "{:<6} a step {:>8.2} ms, digest {}",
                level.vectors,
                step.map_or(0.0, |stage| stage.work_ms),
                level.digest
            );
        }
        if let Some(best) = self.levels.last() {
            outln!("");
            super::print(best);
        }
    }

    /// Refuses levels that differ.
    pub fn check_digests(&self) -> anyhow::Result<()> {
        let Some((first, others)) = self.levels.split_first() else { return Ok(()) };
        // Ordinary code is what all others must equal.
        match others.iter().find(|level| level.digest != first.digest) {
            None => Ok(()),
            Some(other) => bail!(
                "{} and {} kernels give different digests, {} and {}: a fault of dynvox or of the \
                 machine. Please send the report to the developers",
                first.vectors,
                other.vectors,
                first.digest,
                other.digest
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARGUMENTS: [&str; 8] = [
        "--profile",
        "tiny",
        "--frames",
        "6",
        "--set",
        "street.width=96",
        "--set",
        "street.height=64",
    ];

    #[test]
    fn a_report_has_machine_and_equal_digests_of_every_level() {
        let arguments = ARGUMENTS.map(str::to_owned);
        let plan = crate::cli::run::request_of(&arguments).unwrap().resolve().unwrap();
        let mut report = BoardReport::new(&plan, &arguments).unwrap();
        report.check_digests().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("board.json");
        // Over an older one.
        std::fs::write(&path, "{}").unwrap();
        report.write(&path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["machine"]["architecture"], std::env::consts::ARCH);
        assert_eq!(json["arguments"][1], "tiny");
        let levels = json["levels"].as_array().unwrap();
        assert_eq!(levels.len(), Vectors::available().count());
        assert!(levels.iter().all(|level| level["digest"] == levels[0]["digest"]));
        assert!(levels.iter().all(|level| level["units"][0]["ns"].as_f64() > Some(0.0)));
        // Counted work is the same at every level, its worst step at least the usual one.
        assert!(levels.iter().all(|level| level["tails"][1] == levels[0]["tails"][1]));
        let [median, worst] =
            ["median_ms", "worst_ms"].map(|name| levels[0]["tails"][1][name].as_f64().unwrap());
        assert!(0.0 < median && median <= worst);
        // A level with another digest is named, and what to do.
        if let [_, .., last] = &mut report.levels[..] {
            last.digest = "0123456789abcdef".to_owned();
            let refusal = report.check_digests().unwrap_err().to_string();
            assert!(refusal.contains("0123456789abcdef") && refusal.contains("send the report"));
        }
    }
}
