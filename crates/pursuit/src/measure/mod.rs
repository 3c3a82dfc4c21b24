//! From a run's pixels to metres: `pursuit measure`.
//!
//! [`measure`] reads what a run left behind, makes a ruler of the calibration beside it, and finds position, velocity,
//! acceleration, events and fits; [`Destination::write`] leaves them in files. What is computed is `pursuit-measuring`'s.

mod board;
mod calibration;
mod cells;
mod facts;
mod files;
mod options;
#[cfg(feature = "parquet")]
mod parquet;
mod plots;
mod run;
#[cfg(test)]
mod tests;
#[cfg(feature = "xlsx")]
mod xlsx;

pub use board::{Board, FoundInClip, camera_of};
pub use calibration::{CALIBRATION, CalibrationOptions, read_calibration, write_calibration};
pub use facts::{Facts, TargetFacts};
pub(crate) use files::is_result;
pub use files::{Destination, FORMATS};
pub use options::{MeasureOptions, Point};
pub use run::{RecordedRun, read_run};

use crate::RunError;
use pursuit_measuring::events::{self, Event, Stay, Watched};
use pursuit_measuring::fits::{Asked, Fitted, fit};
use pursuit_measuring::{
    Calibration, Measured, MeasuringError, Options, Ruler, Table, Track, between, events_table, kinematics_table,
    stays_table,
};

/// What was found of a run.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Position, velocity and acceleration of each target.
    pub targets: Vec<Measured>,
    /// What happened, in order of time.
    pub events: Vec<Event>,
    /// The time of each target in each zone.
    pub stays: Vec<Stay>,
    /// What was fitted.
    pub fits: Vec<Fitted>,
    /// Distances and directions between targets.
    pub between: Vec<Table>,
    /// The ruler.
    pub ruler: Ruler,
    /// What is known of the whole.
    pub facts: Facts,
}

impl Measurement {
    /// A row for each frame of each target; units stand in the names of the columns.
    pub fn table(&self) -> Table {
        kinematics_table(&self.targets, self.ruler.unit())
    }

    /// A row for each event.
    pub fn events_table(&self) -> Table {
        events_table(&self.events, self.ruler.unit())
    }

    /// A row for each target and zone.
    pub fn stays_table(&self) -> Table {
        stays_table(&self.stays, self.ruler.unit())
    }

    /// What `measure.csv` holds.
    pub fn csv(&self) -> Vec<u8> {
        cells::csv(&self.table())
    }

    /// What `measure-events.csv` holds.
    pub fn events_csv(&self) -> Vec<u8> {
        cells::csv(&self.events_table())
    }

    /// What `measure.xlsx` holds.
    ///
    /// # Errors
    /// More rows than a sheet can hold.
    #[cfg(feature = "xlsx")]
    pub fn xlsx(&self) -> Result<Vec<u8>, RunError> {
        xlsx::bytes(&self.table(), self)
    }
}

/// Measures a run: its folder, or a trajectory in it (CSV or JSON lines). Without a `calibration` given, the one named by the
/// options, or `calibration.toml` in the run's folder or beside its input; without any, in pixels.
///
/// # Errors
/// A run or a calibration that cannot be read, that do not belong together, or of which nothing can be said.
pub fn measure(
    run: &std::path::Path,
    calibration: Option<Calibration>,
    options: &MeasureOptions,
) -> Result<Measurement, RunError> {
    let run = read_run(run, options)?;
    let (calibration, from) = match calibration {
        Some(given) => (given, None),
        None => calibration::find(&run, options.calibration.as_deref())?,
    };
    measure_by(&run, calibration, from, options)
}

/// Measures a run that was read, or that is still at hand, by this calibration.
///
/// # Errors
/// A calibration that does not belong to it, or a run of which nothing can be said.
pub fn measure_recorded(
    run: &RecordedRun,
    calibration: Calibration,
    options: &MeasureOptions,
) -> Result<Measurement, RunError> {
    measure_by(run, calibration, None, options)
}

fn measure_by(
    run: &RecordedRun,
    calibration: Calibration,
    from: Option<std::path::PathBuf>,
    options: &MeasureOptions,
) -> Result<Measurement, RunError> {
    let calibration = Calibration { unit: options.unit.or(calibration.unit), ..calibration };
    calibration.check()?;
    if let Some([width, height]) = run.picture {
        calibration.check_picture(width, height).map_err(|error| match &from {
            Some(file) => RunError::usage(format!(
                "{} is not of this run: {error}, name another by `--calibration FILE.toml`, or say the ruler (`--scale X1,Y1,X2,Y2=LENGTH`)",
                file.display()
            )),
            None => error.into(),
        })?;
    }
    let tracks = run.tracks(calibration.true_fps);
    let ruler = Ruler::new(&calibration, &run.boxes())?;
    let asked = Questions::read(options)?;
    let mut found = found(&tracks, &ruler, options, &asked)?;
    found.facts = Facts::of(run, from, &calibration, options, &found);
    Ok(found)
}

/// The calibration that [`measure`] would take of its own accord, to be said more of. One that merely lies there, and was made on
/// pictures of another size, is none of this run's, and is passed over.
///
/// # Errors
/// As [`measure`].
pub fn calibration_of(run: &std::path::Path, options: &MeasureOptions) -> Result<Calibration, RunError> {
    let run = read_run(run, options)?;
    let (calibration, from) = calibration::find(&run, options.calibration.as_deref())?;
    let fits = run.picture.is_none_or(|[width, height]| calibration.check_picture(width, height).is_ok());
    if let (None, false, Some(file)) = (&options.calibration, fits, from) {
        tracing::warn!("{} was made on pictures of another size: it is passed over", file.display());
        return Ok(Calibration::default());
    }
    Ok(calibration)
}

/// What is asked of a run besides its motion.
struct Questions {
    watched: Watched,
    fits: Vec<Asked>,
    between: Vec<[u64; 2]>,
}

impl Questions {
    fn read(options: &MeasureOptions) -> Result<Self, RunError> {
        let pair = |text: &String| {
            let pair = text.split_once(',').and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
            pair.filter(|[a, b]: &[u64; 2]| a != b).ok_or_else(|| {
                RunError::usage(format!("`{text}` is no pair of targets; give two numbers, for example 1,2"))
            })
        };
        Ok(Self {
            watched: Watched {
                lines: options.lines.iter().map(|l| l.parse()).collect::<Result<_, MeasuringError>>()?,
                zones: options.zones.iter().map(|z| z.parse()).collect::<Result<_, MeasuringError>>()?,
            },
            fits: options.fits.iter().map(|f| f.parse()).collect::<Result<_, MeasuringError>>()?,
            between: options.between.iter().map(pair).collect::<Result<_, RunError>>()?,
        })
    }
}

fn found(
    tracks: &[Track],
    ruler: &Ruler,
    options: &MeasureOptions,
    asked: &Questions,
) -> Result<Measurement, RunError> {
    let how = Options {
        method: options.method.unwrap_or_default(),
        window: options.window.unwrap_or(Options::default().window),
        bounces: options.bounces.unwrap_or(true),
    };
    let (mut targets, mut events, mut stays) = (Vec::new(), Vec::new(), Vec::new());
    let (mut fits, mut unmeasured) = (Vec::new(), Vec::new());
    for track in tracks {
        match pursuit_measuring::measure(track, ruler, &how) {
            Ok(measured) => {
                events.extend(events::find(&measured, &asked.watched));
                stays.extend(events::stays(&measured, &asked.watched.zones));
                for asked in &asked.fits {
                    fits.push(fit(track, &measured.moments, ruler, asked)?);
                }
                targets.push(measured);
            }
            // Of several targets some may have been seen for a moment only.
            Err(MeasuringError::Track(why)) if tracks.len() > 1 => unmeasured.push(why),
            Err(error) => return Err(error.into()),
        }
    }
    if targets.is_empty() {
        let why = unmeasured.first().map_or("the run has no targets", String::as_str);
        return Err(RunError::usage(format!("nothing can be measured: {why}")));
    }
    events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let target = |number: u64| {
        targets.iter().find(|t| t.target == number).ok_or_else(|| {
            let there: Vec<String> = targets.iter().map(|t| t.target.to_string()).collect();
            RunError::usage(format!("there is no target {number} to measure between; there are {}", there.join(", ")))
        })
    };
    let tables = asked.between.iter().map(|[a, b]| Ok(between(target(*a)?, target(*b)?, ruler.unit())));
    let tables = tables.collect::<Result<_, RunError>>()?;
    let facts = Facts { warnings: unmeasured, ..Facts::default() };
    Ok(Measurement { targets, events, stays, fits, between: tables, ruler: ruler.clone(), facts })
}
