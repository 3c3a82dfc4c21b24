//! The figures that the README shows: kept in `docs/figures.json`, each measurement with the command and the commit that made
//! it. The table of trackers and the chart are made from there, so that neither can say something else.

use crate::run;
use anyhow::{Context, Result, bail};
use pursuit_charts::{Axis, Chart, Color, Series};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::PathBuf;

const FILE: &str = "docs/figures.json";
const PAGE: &str = "README.md";
const CHART: &str = "docs/pictures/speed-and-accuracy.svg";
/// What stands between these lines of the page is made here.
const FROM: &str = "<!-- made by `cargo xtask figures` from docs/figures.json -->";
const TO: &str = "<!-- end -->";

/// Writes the table and the chart.
pub fn write() -> Result<()> {
    let figures = Figures::read()?;
    let path = run::root().join(PAGE);
    std::fs::write(&path, figures.put_into(&std::fs::read_to_string(&path)?)?)?;
    std::fs::write(chart_path(), figures.chart()?)?;
    println!("figures: {PAGE} and {CHART} are written");
    Ok(())
}

/// Whether the table and the chart are those of the file, and every measurement says how it can be had again.
pub fn check() -> Result<()> {
    let figures = Figures::read()?;
    figures.check_origins()?;
    let page = std::fs::read_to_string(run::root().join(PAGE))?;
    let chart = std::fs::read_to_string(chart_path()).unwrap_or_default();
    if page != figures.put_into(&page)? || chart != figures.chart()? {
        bail!("{PAGE} or {CHART} is not what {FILE} says: run `cargo xtask figures`");
    }
    println!("figures: {PAGE} and {CHART} are those of {FILE}");
    Ok(())
}

fn chart_path() -> PathBuf {
    run::root().join(CHART)
}

struct Figures(Value);

impl Figures {
    fn read() -> Result<Self> {
        let text = std::fs::read_to_string(run::root().join(FILE)).context(FILE)?;
        Ok(Self(serde_json::from_str(&text).context(FILE)?))
    }

    /// Each measurement has a command, a day, what it is of, and a commit.
    fn check_origins(&self) -> Result<()> {
        let measurements = self.0["measurements"].as_object().context("no `measurements`")?;
        for (name, measurement) in measurements {
            for key in ["command", "commit", "date", "of"] {
                if measurement[key].as_str().is_none_or(str::is_empty) {
                    bail!("{FILE}: the measurement `{name}` has no `{key}`");
                }
            }
            let commit = measurement["commit"].as_str().unwrap_or_default();
            // Whether the history has it cannot be asked: many checkouts have none.
            if !(7..=40).contains(&commit.len()) || !commit.bytes().all(|b| b.is_ascii_hexdigit()) {
                bail!("{FILE}: `{name}` was measured at `{commit}`, which is no commit");
            }
        }
        Ok(())
    }

    /// A figure of a tracker in one measurement.
    fn figure(&self, measurement: &str, figure: &str, tracker: &str) -> Option<f64> {
        self.0["measurements"][measurement]["figures"][figure][tracker].as_f64()
    }

    /// A figure of a tracker, of whichever measurement has it; that of speed is of other sequences and does not count.
    fn any(&self, figure: &str, tracker: &str) -> Option<f64> {
        let measurements = self.0["measurements"].as_object()?;
        measurements.keys().filter(|name| *name != "speed").find_map(|name| self.figure(name, figure, tracker))
    }

    /// The page with today's table.
    fn put_into(&self, page: &str) -> Result<String> {
        let (before, rest) = page.split_once(FROM).with_context(|| format!("{PAGE} has no line `{FROM}`"))?;
        let (_, after) = rest.split_once(TO).with_context(|| format!("{PAGE} has no line `{TO}`"))?;
        Ok(format!("{before}{FROM}\n{}{TO}{after}", self.table()?))
    }

    /// A row for each tracker of `table`: what it takes, how well it sees, how honest it is, when to take it.
    fn table(&self) -> Result<String> {
        let mut table = String::from(
            "| tracker | accuracy (AUC) | says `tracking` though the target is away | right boxes it doubts | frames/s | take it when |\n\
             |---|---:|---:|---:|---:|---|\n",
        );
        for row in self.0["table"].as_array().context("no `table`")? {
            let name = row["tracker"].as_str().context("a row without `tracker`")?;
            let percent = |figure| self.any(figure, name).map_or("–".into(), |v| format!("{:.0} %", 100.0 * v));
            let auc = self.any("auc", name).map_or("–".into(), |v| short(v, 3));
            let speed = self.updates_per_s(name).map_or("–".into(), |v| format!("{}", round(v)));
            let when = row["when"].as_str().unwrap_or_default();
            let (told, doubted) = (percent("absent_told"), percent("right_untold"));
            writeln!(table, "| `{name}` | {auc} | {told} | {doubted} | {speed} | {when} |")?;
        }
        Ok(table)
    }

    /// Updates a second: the multiple of CSRT's rate, times that.
    fn updates_per_s(&self, tracker: &str) -> Option<f64> {
        let csrt_ms = self.0["measurements"]["speed"]["csrt_ms"].as_f64()?;
        Some(self.figure("speed", "times_csrt", tracker)? * 1000.0 / csrt_ms)
    }

    /// Speed against accuracy, both of the one measurement that has other programs' trackers too.
    fn chart(&self) -> Result<String> {
        let accuracies = self.0["measurements"]["speed"]["figures"]["auc"].as_object().context("no accuracies")?;
        let chart = Chart::new(
            "Accuracy and speed on 22 real sequences, one thread",
            Axis::new("updates a second").logarithmic(),
            Axis::new("success AUC").over(0.0, 0.8),
        )
        .sized(900.0, 460.0);
        let named = accuracies.iter().filter_map(|(name, auc)| {
            let color = if name.starts_with("OpenCV") { Color::Predicted } else { Color::Estimate };
            Some(Series::named(name.as_str(), color, vec![(self.updates_per_s(name)?, auc.as_f64()?)]))
        });
        named.fold(chart, Chart::with).to_svg().context("nothing to draw")
    }
}

/// `.712` for 0.7123.
fn short(value: f64, digits: usize) -> String {
    format!("{value:.digits$}").trim_start_matches('0').to_owned()
}

/// To two digits, since more would say more of the machine than of the tracker.
fn round(value: f64) -> u64 {
    let unit = 10_f64.powf(value.log10().floor() - 1.0).max(1.0);
    ((value / unit).round() * unit) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short() {
        assert_eq!([short(0.7123, 3), short(1.0, 3)], [".712", "1.000"]);
        assert_eq!([4.4, 85.47, 941.2, 14_186.0].map(round), [4, 85, 940, 14_000]);
    }

    #[test]
    fn a_table_is_put_between_its_lines() {
        let figures = Figures(serde_json::json!({
            "measurements": {
                "speed": {"csrt_ms": 10.0, "figures": {"times_csrt": {"kcf": 4.6}, "auc": {"kcf": 0.5}}},
                "honesty": {"figures": {"auc": {"kcf": 0.4691}, "absent_told": {"kcf": 0.094}}},
            },
            "table": [{"tracker": "kcf", "when": "speed counts"}],
        }));
        let page = figures.put_into(&format!("a\n{FROM}\nold\n{TO}\nb\n")).unwrap();
        assert!(page.contains("| `kcf` | .469 | 9 % | – | 460 | speed counts |\n"), "{page}");
        assert!(page.starts_with("a\n") && page.ends_with("\nb\n") && !page.contains("old"));
        assert!(figures.check_origins().is_err(), "no command, no commit");
        assert!(figures.chart().unwrap().contains("kcf"));
    }
}
