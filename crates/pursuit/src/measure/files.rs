//! The files that a measurement leaves, and what they may replace.

use super::{Measurement, cells, plots};
use crate::RunError;
use pursuit_measuring::Table;
use std::path::{Path, PathBuf};

/// The formats besides `measure.csv`, by name, with what each is.
pub const FORMATS: [(&str, &str); 4] = [
    ("csv-semicolon", "measure-semicolon.csv: semicolons between cells, commas in numbers"),
    ("jsonl", "measure.jsonl: a JSON object a row"),
    ("parquet", "measure.parquet: the columns of the CSV (feature `parquet`)"),
    ("xlsx", "measure.xlsx: a spreadsheet of rows, events, zones and fits (feature `xlsx`)"),
];

const CSV: &str = "measure.csv";
const FACTS: &str = "measure.json";
const EVENTS: &str = "measure-events.csv";
const STAYS: &str = "measure-zones.csv";
const BETWEEN: &str = "measure-between-";
const SEMICOLON: &str = "measure-semicolon.csv";
const FIXED: [&str; 8] = [CSV, SEMICOLON, FACTS, EVENTS, STAYS, "measure.jsonl", "measure.parquet", "measure.xlsx"];
/// The facts of a measurement are a few kilobytes, with many events some megabytes.
const MOST_FACTS_BYTES: u64 = 1 << 28;
const PLOTS: [&str; 6] = ["position", "velocity", "speed", "acceleration", "path", "fit"];

/// Whether a file of this name in a run's folder, or in its folder of plots, is a measurement's.
pub(crate) fn is_result(name: &str) -> bool {
    let between = |name: &str| {
        let pair = name.strip_prefix(BETWEEN)?.strip_suffix(".csv")?.split_once('-')?;
        Some(pair.0.parse::<u64>().is_ok() && pair.1.parse::<u64>().is_ok())
    };
    let plot = |name: &str| {
        let rest = name.strip_prefix("measure-")?.strip_suffix(".svg")?;
        let (stem, number) = rest.split_once('-').unwrap_or((rest, "0"));
        Some(PLOTS.contains(&stem) && number.parse::<u64>().is_ok())
    };
    FIXED.contains(&name) || between(name) == Some(true) || plot(name) == Some(true)
}

/// A folder that a measurement is written into, checked before anything is computed.
#[derive(Debug, Clone)]
pub struct Destination {
    folder: PathBuf,
    formats: Vec<String>,
    plots: bool,
}

impl Destination {
    /// Looks whether what is asked for can be written into `folder`. An earlier measurement there is replaced; what none wrote is
    /// not.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a format that there is not or that this build cannot write, and for files in the way.
    pub fn new(folder: &Path, formats: &[String], plots: bool) -> Result<Self, RunError> {
        for format in formats {
            match format.as_str() {
                "jsonl" | "csv-semicolon" => {}
                "parquet" if cfg!(feature = "parquet") => {}
                "xlsx" if cfg!(feature = "xlsx") => {}
                "parquet" | "xlsx" => {
                    return Err(RunError::usage(format!(
                        "this build cannot write {format}; build with `--features {format}`, or take the CSV"
                    )));
                }
                _ => {
                    let names: Vec<&str> = FORMATS.iter().map(|f| f.0).collect();
                    return Err(RunError::usage(format!(
                        "a measurement has no format `{format}`; besides the CSV there are {}",
                        names.join(", ")
                    )));
                }
            }
        }
        let destination = Self { folder: folder.to_path_buf(), formats: formats.to_vec(), plots };
        match destination.earlier().first() {
            Some(file) if !measured(folder) => Err(RunError::usage(format!(
                "{} would be overwritten, and no `pursuit measure` wrote it ({FACTS} is missing or none of ours); name another folder with `--out DIR`",
                file.display()
            ))),
            _ => Ok(destination),
        }
    }

    /// What an earlier measurement left there.
    fn earlier(&self) -> Vec<PathBuf> {
        let folders = [self.folder.clone(), self.folder.join("plots")];
        let entries = folders.iter().flat_map(|f| std::fs::read_dir(f).into_iter().flatten().flatten());
        entries.filter(|e| e.file_name().to_str().is_some_and(is_result)).map(|e| e.path()).collect()
    }

    /// Writes a measurement, and returns the files.
    ///
    /// # Errors
    /// [`RunError::Output`] when one cannot be written.
    pub fn write(&self, found: &Measurement) -> Result<Vec<PathBuf>, RunError> {
        std::fs::create_dir_all(&self.folder).map_err(RunError::output(&self.folder))?;
        for file in self.earlier() {
            std::fs::remove_file(&file).map_err(RunError::output(&file))?;
        }
        let mut files = Vec::new();
        let put = |name: &str, bytes: Vec<u8>| {
            let path = self.folder.join(name);
            std::fs::write(&path, bytes).map_err(RunError::output(&path))?;
            Ok::<_, RunError>(path)
        };
        let table = found.table();
        // The facts come first: they say whose the others are.
        let facts =
            serde_json::to_vec_pretty(&found.facts).map_err(|e| RunError::output(self.folder.join(FACTS))(e.into()))?;
        files.push(put(FACTS, facts)?);
        files.push(put(CSV, cells::csv(&table))?);
        if !found.events.is_empty() {
            files.push(put(EVENTS, cells::csv(&found.events_table()))?);
        }
        if !found.stays.is_empty() {
            files.push(put(STAYS, cells::csv(&found.stays_table()))?);
        }
        for (pair, table) in found.facts.options.between.iter().zip(&found.between) {
            files.push(put(&format!("{BETWEEN}{}.csv", pair.replace(' ', "").replace(',', "-")), cells::csv(table))?);
        }
        for format in &self.formats {
            files.push(self.further(format, &table, found)?);
        }
        if self.plots {
            let folder = self.folder.join("plots");
            std::fs::create_dir_all(&folder).map_err(RunError::output(&folder))?;
            for (name, chart) in plots::charts(found) {
                let path = folder.join(format!("{name}.svg"));
                if chart.write(&path).map_err(RunError::output(&path))? {
                    files.push(path);
                }
            }
        }
        Ok(files)
    }

    fn further(&self, format: &str, table: &Table, found: &Measurement) -> Result<PathBuf, RunError> {
        let name = if format == "csv-semicolon" { SEMICOLON.to_owned() } else { format!("measure.{format}") };
        let path = self.folder.join(name);
        match format {
            "csv-semicolon" => {
                std::fs::write(&path, cells::csv_semicolon(table)).map_err(RunError::output(&path))?;
            }
            #[cfg(feature = "parquet")]
            "parquet" => super::parquet::write(&path, table)?,
            #[cfg(feature = "xlsx")]
            "xlsx" => super::xlsx::write(&path, table, found)?,
            _ => std::fs::write(&path, cells::jsonl(table)).map_err(RunError::output(&path))?,
        }
        let _ = found;
        Ok(path)
    }
}

/// Whether a measurement of ours lies in a folder.
fn measured(folder: &Path) -> bool {
    use std::io::Read;
    let facts = || -> std::io::Result<serde_json::Value> {
        let mut text = String::new();
        std::fs::File::open(folder.join(FACTS))?.take(MOST_FACTS_BYTES).read_to_string(&mut text)?;
        Ok(serde_json::from_str(&text)?)
    };
    facts().is_ok_and(|f| f["measured_by"].as_str().is_some_and(|by| by.starts_with("pursuit measure")))
}

#[cfg(test)]
mod tests {
    use super::is_result;

    #[test]
    fn only_files_of_a_measurement_are_its_own() {
        for own in
            ["measure.csv", "measure-between-1-2.csv", "measure-path.svg", "measure-fit-2.svg", "measure-speed-7.svg"]
        {
            assert!(is_result(own), "{own}");
        }
        for other in [
            "measure.txt",
            "measure-between-a-2.csv",
            "measure-mine.svg",
            "measure-path-x.svg",
            "position.svg",
            "measures.csv",
        ] {
            assert!(!is_result(other), "{other}");
        }
    }
}
