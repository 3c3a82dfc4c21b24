//! What is said of whole sequences, so that figures can be told apart by it: the tags of VOT, the classes of GOT-10k, the
//! flags of UAV123, and tables of the user's.

use super::{Dataset, Listing, has_extension, stem, text};
use crate::{EvaluationError, Result, Sequence};
use std::collections::BTreeMap;
use std::path::Path;

/// Keys of GOT-10k's `meta_info.ini` whose values are attributes.
const CLASSES: [&str; 2] = ["major_class", "motion_class"];

/// VOT: `TAG.tag` has 1 in the frames in which the tag holds; the sequence has it where one frame does.
pub(super) fn add_tags(sequence: &mut Sequence, inside: &Listing) -> Result<()> {
    for file in inside.files.iter().filter(|f| has_extension(f, &["tag", "label"])) {
        if text::read(file)?.lines().any(|l| l.trim() == "1") {
            sequence.add_attribute(stem(file));
        }
    }
    Ok(())
}

/// GOT-10k: the classes named in `meta_info.ini`.
pub(super) fn add_classes(sequence: &mut Sequence, folder: &Path) -> Result<()> {
    let file = folder.join("meta_info.ini");
    if !file.is_file() {
        return Ok(());
    }
    for line in text::read(&file)?.lines() {
        let Some((key, value)) = line.split_once([':', '=']) else { continue };
        if let Some(class) = CLASSES.iter().find(|c| **c == key.trim()).filter(|_| !value.trim().is_empty()) {
            sequence.add_attribute(format!("{class}: {}", value.trim()));
        }
    }
    Ok(())
}

/// UAV123: a file of as many numbers as there are names, each 1 or 0.
pub(super) fn add_flags(sequence: &mut Sequence, file: &Path, names: &[&str]) -> Result<()> {
    let content = text::read(file)?;
    let flags: Vec<&str> = content.split([',', ' ', '\t', '\r', '\n']).filter(|word| !word.is_empty()).collect();
    if flags.len() != names.len() {
        let reason = format!("it has {} numbers instead of {}, one an attribute", flags.len(), names.len());
        return Err(EvaluationError::dataset(file, None, reason));
    }
    for (flag, name) in flags.iter().zip(names) {
        match *flag {
            "1" => sequence.add_attribute(*name),
            "0" => {}
            other => {
                let reason = format!("`{other}` for {name} is neither 1 nor 0");
                return Err(EvaluationError::dataset(file, None, reason));
            }
        }
    }
    Ok(())
}

impl Dataset {
    /// Adds the attributes of a CSV table to the sequences: `sequence,NAME,NAME,…` with 1 or 0 (yes or no, true or false)
    /// in every cell, or `sequence,attributes` with names separated by blanks or semicolons. A sequence is named as in the
    /// results or by the last part of that; lines about sequences that are not there are passed over.
    ///
    /// # Errors
    /// A file that cannot be read or is no such table, and one that names no sequence that is there.
    pub fn add_attributes(&mut self, file: &Path) -> Result<()> {
        let mut table = read_table(file)?;
        let mut found = false;
        for sequence in &mut self.sequences {
            let last = sequence.name().rsplit('/').next().unwrap_or_default();
            let named = table.get(sequence.name()).or_else(|| table.get(last)).cloned();
            found |= named.is_some();
            named.into_iter().flatten().for_each(|name| sequence.add_attribute(name));
        }
        if found {
            return Ok(());
        }
        let example = table.pop_first().map_or_else(|| "none".to_owned(), |(name, _)| name);
        let reason = format!("names no sequence that is there; its first is {example}");
        Err(EvaluationError::dataset(file, None, reason))
    }
}

/// The names of attributes by sequence.
fn read_table(file: &Path) -> Result<BTreeMap<String, Vec<String>>> {
    let content = text::read(file)?;
    let fail = |line: Option<usize>, reason: String| EvaluationError::dataset(file, line, reason);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(content.as_bytes());
    let heads = reader.headers().map_err(|e| fail(None, e.to_string()))?.clone();
    if heads.get(0) != Some("sequence") || heads.len() < 2 {
        let reason = "the first line must be `sequence,` and the names of attributes, or `sequence,attributes`";
        return Err(fail(Some(1), reason.to_owned()));
    }
    let listed = heads.len() == 2 && heads.get(1) == Some("attributes");
    let mut table = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(|e| fail(None, e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line) as usize;
        let mut names: Vec<String> = Vec::new();
        for (name, cell) in heads.iter().zip(record.iter()).skip(1) {
            match cell.to_ascii_lowercase().as_str() {
                _ if listed => {
                    let parts = cell.split([' ', ';', '\t']).filter(|p| !p.is_empty());
                    names.extend(parts.map(str::to_owned));
                }
                "1" | "yes" | "true" => names.push(name.to_owned()),
                "0" | "no" | "false" | "" => {}
                _ => return Err(fail(Some(line), format!("`{cell}` under {name} is neither 1 nor 0"))),
            }
        }
        table.insert(record.get(0).unwrap_or_default().to_owned(), names);
    }
    Ok(table)
}
