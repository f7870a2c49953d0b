//! Examination of pairs before they are mapped: that of the command line.

use super::error::refuse;
use super::images::{Borrowed, Picture};
use super::rig::Rig;
use dynvox::formats::Image;
use dynvox::input::diagnosis::{Finding, LiveExamination};
use dynvox_core::StereoFrame;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Examination of a mapper's first pairs.
#[derive(Default)]
pub struct Examined {
    /// True if pairs that would make a map meaningless are mapped nevertheless.
    force: bool,
    /// Absent before the first pair and after the last that is looked at.
    under_way: Option<LiveExamination>,
    /// Findings of the last examination.
    findings: Vec<Finding>,
    is_over: bool,
}

impl Examined {
    /// An examination of the pairs to come.
    pub fn new(force: bool) -> Self {
        Self { force, ..Self::default() }
    }

    /// An examination that is over: of a data set that was examined as a whole.
    pub fn over() -> Self {
        Self { is_over: true, ..Self::default() }
    }

    /// Sentences about the pairs so far.
    pub fn warnings(&self) -> Vec<String> {
        self.findings.iter().map(|finding| finding.message.clone()).collect()
    }

    /// Looks at a pair that is about to be mapped.
    ///
    /// # Errors
    /// A map of it would be meaningless, and is not forced.
    pub fn take(&mut self, rig: &Rig, frame: &StereoFrame<'_>) -> PyResult<()> {
        if self.is_over || !rig.suits(frame) {
            return Ok(());
        }
        let examination = match &mut self.under_way {
            Some(examination) => examination,
            none => none.insert(rig.examination()?),
        };
        let pair = [&frame.left, &frame.right].map(Image::from_view);
        let findings = examination.take(pair);
        let refused: Vec<&str> = findings
            .iter()
            .filter(|finding| finding.is_refused_live())
            .map(|finding| finding.message.as_str())
            .collect();
        if !refused.is_empty() && !self.force {
            let reasons = refused.join(". ");
            return Err(refuse(format!("{reasons}. force=True maps them nevertheless")));
        }
        self.is_over = examination.is_done();
        self.findings = findings;
        if self.is_over {
            self.under_way = None;
        }
        Ok(())
    }
}

/// Examines up to ten pairs without mapping them, as the command line does before a run: (left,
/// right), or dictionaries with left and right.
///
/// Returns what is wrong with them, an empty list when all is well.
#[pyfunction]
pub fn diagnose<'py>(
    py: Python<'py>,
    rig: Rig,
    pairs: Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyList>> {
    let mut examination: Option<LiveExamination> = None;
    let mut findings = Vec::new();
    for pair in pairs.try_iter()? {
        let pair = pair?;
        let part = |name: &str, at: usize| match pair.cast::<PyDict>() {
            Ok(named) => named.as_any().get_item(name),
            Err(_) => pair.get_item(at),
        };
        let (left, right) = (part("left", 0)?, part("right", 1)?);
        let (left, right) = (Borrowed::new("left", &left)?, Borrowed::new("right", &right)?);
        let (left, right) = (Picture::of(&left)?, Picture::of(&right)?);
        let frame = StereoFrame::pair(left.grey()?, right.grey()?);
        if !rig.suits(&frame) {
            return Err(refuse("the pictures of a pair differ in size, or from the rig's"));
        }
        let examination = match &mut examination {
            Some(examination) => examination,
            none => none.insert(rig.examination()?),
        };
        let pair = [&frame.left, &frame.right].map(Image::from_view);
        findings = py.detach(|| examination.take(pair));
        if examination.is_done() {
            break;
        }
    }
    let list = PyList::empty(py);
    for finding in &findings {
        let parts = PyDict::new(py);
        parts.set_item("fault", finding.fault.name())?;
        parts.set_item("message", &finding.message)?;
        parts.set_item("refused", finding.refused)?;
        list.append(parts)?;
    }
    Ok(list)
}
