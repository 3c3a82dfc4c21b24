//! The files of an evaluation. Every file appears whole or not at all: written beside its place, then renamed.

use crate::protocol::Pass;
use crate::table::{csv_tables, tables};
use crate::{EvaluationError, Protocol, Result, Results, RunRecord, Sequence, Trajectory};
use std::path::{Path, PathBuf};

/// The folder that an evaluation keeps its results in.
pub(crate) struct Store {
    root: PathBuf,
}

impl Store {
    pub fn new(root: &Path) -> Result<Self> {
        std::fs::create_dir_all(root).map_err(|e| EvaluationError::output(root, e))?;
        Ok(Self { root: root.to_owned() })
    }

    /// What an earlier call left of this pass, if it is complete and `fits`.
    pub fn read(
        &self,
        tracker: &str,
        sequence: &Sequence,
        pass: &Pass,
        fits: impl Fn(&RunRecord) -> bool,
    ) -> Option<(Trajectory, RunRecord)> {
        let boxes = self.boxes(tracker, sequence, pass);
        let record: RunRecord = serde_json::from_slice(&std::fs::read(boxes.with_extension("json")).ok()?).ok()?;
        let started_alike = record.starts.first().is_none_or(|s| *s == pass.start);
        let fits = fits(&record) && started_alike && record.frames <= sequence.truth().len();
        // A damaged file counts as missing, so that the pass is run again.
        let trajectory = Trajectory::read(&boxes).ok().filter(|t| t.end() <= record.frames)?;
        fits.then_some((trajectory, record))
    }

    /// Keeps a pass and returns it as it reads back: the boxes are written first, so that a record never speaks of boxes
    /// that are not there.
    pub fn write(
        &self,
        tracker: &str,
        sequence: &Sequence,
        pass: &Pass,
        trajectory: &Trajectory,
        record: &RunRecord,
    ) -> Result<(Trajectory, RunRecord)> {
        let boxes = self.boxes(tracker, sequence, pass);
        let beside = boxes.with_extension("json");
        let _ = std::fs::remove_file(&beside);
        write_whole(&boxes, trajectory.to_csv().as_bytes())?;
        let json = serde_json::to_vec_pretty(record).map_err(|e| EvaluationError::output(&beside, e))?;
        write_whole(&beside, &json)?;
        let record = serde_json::from_slice(&json).map_err(|e| EvaluationError::output(&beside, e))?;
        Ok((Trajectory::read(&boxes)?, record))
    }

    /// Keeps the figures as `results.json` and `results-PROTOCOL.json`, with tables and curves beside them.
    pub fn write_results(&self, results: &Results) -> Result<()> {
        let json = serde_json::to_vec_pretty(results)
            .map_err(|e| EvaluationError::output(&self.root.join("results.json"), e))?;
        self.write_last("results", "json", results.protocol, &json)?;
        for (name, extension, text) in files(results) {
            self.write_last(&name, extension, results.protocol, text.as_bytes())?;
        }
        Ok(())
    }

    /// Keeps the report as `report.html` and `report-PROTOCOL.html`.
    pub fn write_report(&self, protocol: Protocol, page: &str) -> Result<()> {
        self.write_last("report", "html", protocol, page.as_bytes())
    }

    /// `NAME.EXTENSION` is of the last call, whatever its protocol; a copy stays when the next call has another one.
    fn write_last(&self, name: &str, extension: &str, protocol: Protocol, bytes: &[u8]) -> Result<()> {
        write_whole(&self.root.join(format!("{name}-{protocol}.{extension}")), bytes)?;
        write_whole(&self.root.join(format!("{name}.{extension}")), bytes)
    }

    /// `boxes/TRACKER/SEQUENCE.csv`, with the pass's label, where it has one, after an `@`.
    fn boxes(&self, tracker: &str, sequence: &Sequence, pass: &Pass) -> PathBuf {
        let mut path = self.root.join("boxes").join(safe(tracker));
        let mut parts: Vec<String> = sequence.name().split('/').map(safe).collect();
        if let (Some(last), Some(label)) = (parts.last_mut(), &pass.label) {
            *last = format!("{last}@{label}");
        }
        if let Some(last) = parts.last_mut() {
            last.push_str(".csv");
        }
        path.extend(parts);
        path
    }
}

/// The figures as files for spreadsheets, papers and plots: name, extension, text.
fn files(results: &Results) -> Vec<(String, &'static str, String)> {
    let mut files: Vec<(String, &'static str, String)> = Vec::new();
    for (name, table) in tables(results) {
        files.push((format!("tables/{name}"), "md", table.to_markdown()));
        files.push((format!("tables/{name}"), "tex", table.to_latex()));
    }
    for (name, text) in csv_tables(results) {
        files.push((format!("tables/{name}"), "csv", text));
    }
    for curves in crate::curves::all(results) {
        files.push((format!("curves/{}", curves.file), "csv", curves.to_csv()));
        files.extend(curves.chart.to_svg().map(|svg| (format!("curves/{}", curves.file), "svg", svg)));
    }
    files
}

/// A name that stays inside its folder on every system.
fn safe(name: &str) -> String {
    let keep = |c: char| if c.is_control() || r#"/\:*?"<>|"#.contains(c) { '_' } else { c };
    let kept: String = name.chars().map(keep).collect();
    if kept.is_empty() || kept.chars().all(|c| c == '.') { "_".to_owned() } else { kept }
}

/// Writes a file beside its place and moves it there, making the folders on the way.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let failed = |e: std::io::Error| EvaluationError::output(path, e);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let mut beside = path.as_os_str().to_owned();
    beside.push(format!(".{}.part", std::process::id()));
    std::fs::write(&beside, bytes).and_then(|()| std::fs::rename(&beside, path)).map_err(failed)
}
