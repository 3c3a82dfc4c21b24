use crate::args::PtzSimulate;
use crate::commands::{print, settings};
use anyhow::Context;
#[cfg(feature = "encode")]
use pursuit::head::Film;
use pursuit::head::{KnownWorld, compensated, finder};
use pursuit::media::OpenOptions;
use pursuit::parameters::{Table, Value, merge, nested};
use pursuit::ptz::Direction;
#[cfg(feature = "encode")]
use pursuit::ptz::PtzError;
#[cfg(feature = "encode")]
use pursuit::ptz::simulation::{CameraParams, Exposure};
use pursuit::ptz::simulation::{Contender, Eye, Figures, Sample, Study, TrackingEye, Walk};
use pursuit::trackers::registry;
use pursuit::{Recipe, RunConfig, RunError};
use std::cell::Cell;
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;
use std::process::ExitCode;

/// The figures of one controller on one walk.
struct Row {
    walk: String,
    contender: Contender,
    figures: Figures,
    /// Whether the target stands before a camera that stands.
    stands: bool,
    /// How far the head turned, degrees, while nobody was there before; `None` where somebody is from the beginning.
    before_deg: Option<f64>,
}

impl Row {
    /// The most overshoot and wandering, which mean something before a target that stands.
    fn standing(&self) -> Option<(f64, f64)> {
        self.stands.then_some((self.figures.overshoot, self.figures.wandering_deg))
    }
}

/// `pursuit ptz simulate`.
pub fn run(args: &PtzSimulate) -> anyhow::Result<ExitCode> {
    let mut settings = nested(&settings(&args.settings)?);
    let mut group = |name: &str| match settings.remove(name) {
        Some(Value::Table(parameters)) => Ok(parameters),
        Some(_) => Err(RunError::usage(format!("`{name}` is a group; set `{name}.KEY`"))),
        None => Ok(Table::new()),
    };
    let (of_tracker, of_detector) = (group("tracker")?, group("detect")?);
    if args.drone {
        settings.entry("drone").or_insert_with(|| Value::Table(Table::new()));
    }
    let mut said = super::read(args.head.as_deref(), settings)?;
    if args.detect.is_some() {
        let follower = said.entry("follower").or_insert_with(|| Value::Table(Table::new()));
        follower.as_table_mut().into_iter().for_each(super::go_home);
    }
    let wrong = || format!("cannot simulate a head by {}", super::origin(args.head.as_deref()));
    // The error says in a second line where it is.
    let one_line = |error: toml::de::Error| anyhow::Error::msg(error.to_string().trim().replace('\n', " "));
    let study: Study = said.try_into().map_err(one_line).with_context(wrong)?;
    study.validate().with_context(wrong)?;
    if study.drone.is_some() && (args.grid || args.scene.is_some() || args.clip.is_some()) {
        return Err(RunError::usage(
            "a drone looks down on walks alone; leave `drone` out, or --grid, --scene and --clip",
        )
        .into());
    }
    if args.grid {
        return super::grid::run(args, &study);
    }
    let film = args.film.as_deref();
    if film.is_some() && args.scene.is_none() && args.clip.is_none() {
        return Err(RunError::usage("a film needs pictures: give --scene or --clip with --film").into());
    }
    if args.detect.is_none() && !of_detector.is_empty() {
        return Err(RunError::usage("no detector is named; add one, `--detect motion`").into());
    }
    let world = match (&args.scene, &args.clip) {
        (Some(query), _) => Some(KnownWorld::scene(query)?),
        (_, Some(input)) if args.detect.is_some() => {
            Some(KnownWorld::whole_clip(input, args.clip_view, OpenOptions::from_env())?)
        }
        (_, Some(input)) => Some(KnownWorld::clip(input, args.clip_view, OpenOptions::from_env())?),
        _ => None,
    };
    // Pictures take their time.
    let seeds = args.seeds.unwrap_or(if world.is_some() { 1 } else { 20 });
    let seeds = args.first_seed..args.first_seed + seeds;
    let asked = |name: &str| args.controller.is_empty() || args.controller.iter().any(|asked| asked == name);
    let contenders = || Contender::ALL.into_iter().filter(|c| asked(c.name()));
    if film.is_some() && (contenders().count(), seeds.end - seeds.start) != (1, 1) {
        return Err(RunError::usage("a film shows one run: give one --controller and --seeds 1 with --film").into());
    }
    let mut rows = Vec::new();
    if let Some(world) = &world {
        for contender in contenders() {
            let looker = Looker::new(args, contender, &of_tracker, &of_detector)?;
            rows.extend(looks(&study, world, contender, seeds.clone(), &looker, film)?);
        }
    } else {
        for walk in walks(args, study.drone.is_some()) {
            for contender in contenders() {
                let figures = Figures::mean(&study.run(walk, contender, seeds.clone())?);
                let stands = walk == Walk::Standing && study.drone.is_none();
                rows.push(Row { walk: walk.name().to_owned(), contender, figures, stands, before_deg: None });
            }
        }
    }
    let text = if args.json { json(&rows, &seeds)? } else { table(&rows, &seeds)? };
    print(text.as_bytes())
}

/// The walks that are asked for; else those before a camera that stands, or what drones look down on too.
pub(super) fn walks(args: &PtzSimulate, has_drone: bool) -> Vec<Walk> {
    let usual = if has_drone { &Walk::EVERY[..] } else { &Walk::ALL[..] };
    let asked = |walk: &&Walk| args.walk.iter().any(|name| name == walk.name());
    if args.walk.is_empty() { usual.to_vec() } else { Walk::EVERY.iter().filter(asked).copied().collect() }
}

/// What looks at the pictures.
enum Looker {
    /// A tracker that is told where the target is at first.
    Told(Box<dyn Recipe>),
    /// A tracker and a detector that finds the target.
    Finds(Box<RunConfig>),
}

impl Looker {
    fn new(
        args: &PtzSimulate,
        contender: Contender,
        of_tracker: &Table,
        of_detector: &Table,
    ) -> Result<Self, RunError> {
        if args.detect.is_some() {
            let (tracker, detect) = (args.tracker.clone(), args.detect.clone());
            let mut parameters = of_tracker.clone();
            if !of_detector.is_empty() {
                parameters.insert("detect".to_owned(), Value::Table(of_detector.clone()));
            }
            let config = RunConfig { tracker, detect, parameters, ..RunConfig::default() };
            return Ok(Self::Finds(Box::new(compensated(config))));
        }
        let by_pose = (contender == Contender::Forecast).then(|| ("motion.camera".to_owned(), "pose".into()));
        let mut parameters = nested(&by_pose.into_iter().collect::<Table>());
        merge(&mut parameters, of_tracker.clone());
        let tracker = registry::tracker(args.tracker.as_deref().unwrap_or(registry::DEFAULT_TRACKER))?;
        Ok(Self::Told(tracker.recipe(&parameters)?))
    }

    /// An eye for a world.
    fn eye<'a>(&'a self, world: &'a KnownWorld) -> Result<TrackingEye<'a>, RunError> {
        Ok(match self {
            Self::Told(recipe) => TrackingEye::new(world.world()?, &**recipe),
            Self::Finds(config) => TrackingEye::finding(world.world()?, finder(config)?),
        })
    }
}

/// A tracker looks at what the camera crops from a scene or a clip, beginning on the target or before there is one: a row for each
/// time that somebody comes.
fn looks(
    study: &Study,
    world: &KnownWorld,
    contender: Contender,
    seeds: Range<u64>,
    looker: &Looker,
    film: Option<&Path>,
) -> anyhow::Result<Vec<Row>> {
    let study = Study { duration_s: study.duration_s.min(world.duration_s()), ..study.clone() };
    let (judged_from_s, lasts) = (study.judged_from_s, study.duration_s);
    let is_told = matches!(looker, Looker::Told(_));
    let all = std::iter::once(0.0..lasts);
    let seen = world.visits().into_iter().map(|visit| visit.start..visit.end.min(lasts));
    let visits: Vec<Range<f64>> = if is_told { all.collect() } else { seen.collect() };
    if visits.iter().all(|visit| visit.end - visit.start <= judged_from_s) {
        anyhow::bail!(
            "there are {lasts:.1} s to look at, and runs are judged from {judged_from_s} s on; lower judged_from_s in --head FILE.toml"
        );
    }
    let known = visits.iter().find_map(|visit| world.target(visit.start));
    let Some(first) = known else { anyhow::bail!("the target is not there at the beginning") };
    let view = if is_told { first.0 } else { Direction::AHEAD };
    let mut runs = Vec::new();
    for seed in seeds {
        // Who has left is where he was seen last.
        let last = Cell::new(first);
        let target = |time_s: f64| {
            last.set(world.target(time_s).unwrap_or(last.get()));
            last.get()
        };
        let mut eye = looker.eye(world)?;
        runs.push(match film {
            None => study.follow(contender, seed, view, &target, &mut eye)?,
            Some(path) => filmed(&study, world, eye, path, |eye| study.follow(contender, seed, view, &target, eye))?,
        });
    }
    let mut rows = Vec::new();
    let mut left_s = f64::NEG_INFINITY;
    for visit in visits {
        let judged = visit.start + judged_from_s..=visit.end;
        let waits = left_s + judged_from_s..visit.start;
        left_s = visit.end;
        if judged.is_empty() {
            continue;
        }
        let nobody = |s: &Sample| waits.contains(&s.time_s) && world.target(s.time_s).is_none();
        let of = |run: &Vec<Sample>| run.iter().filter(|s| judged.contains(&s.time_s)).copied().collect::<Vec<_>>();
        let figures: Vec<Figures> = runs.iter().map(|run| Figures::of(&of(run), 0.0)).collect();
        let turned = runs.iter().map(|run| turned_deg(run, nobody)).sum::<f64>() / runs.len().max(1) as f64;
        let (walk, before_deg) = if is_told {
            (world.name().to_owned(), None)
        } else {
            (format!("{}, {:.1} to {:.1} s", world.name(), visit.start, visit.end), Some(turned))
        };
        rows.push(Row { walk, contender, figures: Figures::mean(&figures), stands: false, before_deg });
    }
    Ok(rows)
}

/// How far the head turned in all from one of these samples to the next, degrees.
fn turned_deg(run: &[Sample], these: impl Fn(&Sample) -> bool) -> f64 {
    let steps = run.windows(2).filter(|pair| pair.iter().all(&these));
    steps.map(|pair| pair[0].position.direction.angle_to(pair[1].position.direction)).sum()
}

/// A run whose pictures become a video.
#[cfg(feature = "encode")]
fn filmed(
    study: &Study,
    world: &KnownWorld,
    eye: TrackingEye<'_>,
    path: &Path,
    run: impl FnOnce(&mut dyn Eye) -> pursuit::ptz::Result<Vec<Sample>>,
) -> anyhow::Result<Vec<Sample>> {
    let fps = study.camera.clone().map_or_else(CameraParams::usual, Ok)?.fps;
    let mut film = Film::create(path, fps)?;
    let failed = |error: RunError| PtzError::Picture { reason: error.to_string() };
    let mut eye = eye.shown_to(|frame, taken, estimate| {
        let truth = taken.truth.filter(|_| world.target(taken.time_s).is_some());
        film.add(frame, &Exposure { truth, ..*taken }, estimate).map_err(failed)
    });
    let samples = run(&mut eye);
    drop(eye);
    // What was seen until something went wrong can be looked at.
    film.finish()?;
    Ok(samples?)
}

#[cfg(not(feature = "encode"))]
fn filmed(
    _: &Study,
    _: &KnownWorld,
    _: TrackingEye<'_>,
    _: &Path,
    _: impl FnOnce(&mut dyn Eye) -> pursuit::ptz::Result<Vec<Sample>>,
) -> anyhow::Result<Vec<Sample>> {
    Err(RunError::usage(pursuit::NO_OVERLAY.unwrap_or("this build writes no video")).into())
}

fn table(rows: &[Row], seeds: &Range<u64>) -> anyhow::Result<String> {
    let wide = rows.iter().map(|row| row.walk.len()).max().unwrap_or(0).max(10);
    let waits = rows.iter().any(|row| row.before_deg.is_some());
    let before = if waits { " before: the head turned while nobody was there." } else { "" };
    let mut text = format!(
        "{}. central: within the central 20 % of the picture; rms: off the middle; shown: in the picture.{before}\n\n\
         {:<wide$} {:<13} {:>9} {:>8} {:>9} {:>16} {:>10} {:>9}\n",
        over(seeds),
        "walk",
        "controller",
        "central",
        "rms",
        "shown",
        "longest absence",
        if waits { "before" } else { "overshoot" },
        if waits { "" } else { "wanders" }
    );
    for row in rows {
        let Row { walk, contender, figures, .. } = row;
        let (central, shown) = (100.0 * figures.central, 100.0 * figures.shown);
        let (name, absence) = (contender.name(), figures.longest_absence_s);
        write!(
            text,
            "{walk:<wide$} {name:<13} {central:>7.1} % {:>7.2}° {shown:>7.1} % {absence:>14.2} s",
            figures.rms_deg
        )?;
        match (row.before_deg, row.standing()) {
            (Some(before), _) => writeln!(text, " {before:>9.1}°")?,
            (None, Some((overshoot, wanders))) => writeln!(text, " {:>8.1} % {wanders:>8.2}°", 100.0 * overshoot)?,
            (None, None) => writeln!(text, " {:>10} {:>9}", "–", "–")?,
        }
    }
    Ok(text)
}

/// Over how many runs the figures are means.
fn over(seeds: &Range<u64>) -> String {
    match seeds.end - seeds.start {
        1 => format!("One run, seed {}", seeds.start),
        many => format!("Means over {many} seeds"),
    }
}

fn json(rows: &[Row], seeds: &Range<u64>) -> anyhow::Result<String> {
    let rows: Vec<serde_json::Value> = rows
        .iter()
        .map(|row| {
            serde_json::json!({
                "walk": row.walk,
                "controller": row.contender.name(),
                "central": row.figures.central,
                "rms_deg": row.figures.rms_deg,
                "shown": row.figures.shown,
                "longest_absence_s": row.figures.longest_absence_s,
                "overshoot": row.standing().map(|s| s.0),
                "wandering_deg": row.standing().map(|s| s.1),
                "before_deg": row.before_deg,
            })
        })
        .collect();
    Ok(serde_json::to_string_pretty(
        &serde_json::json!({ "seeds": seeds.end - seeds.start, "first_seed": seeds.start, "runs": rows }),
    )? + "\n")
}
