use crate::args::PtzSimulate;
use crate::commands::{print, settings};
use anyhow::Context;
#[cfg(feature = "encode")]
use pursuit::head::Film;
use pursuit::head::KnownWorld;
use pursuit::media::OpenOptions;
use pursuit::parameters::{Table, Value, merge, nested};
#[cfg(feature = "encode")]
use pursuit::ptz::PtzError;
#[cfg(feature = "encode")]
use pursuit::ptz::simulation::CameraParams;
use pursuit::ptz::simulation::{Contender, Eye, Figures, Sample, Study, TrackingEye, Walk};
use pursuit::trackers::registry;
use pursuit::{Recipe, RunError};
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
    let of_tracker = match settings.remove("tracker") {
        Some(Value::Table(parameters)) => parameters,
        Some(_) => return Err(RunError::usage("`tracker` is a group; set `tracker.KEY`").into()),
        None => Table::new(),
    };
    if args.drone {
        settings.entry("drone").or_insert_with(|| Value::Table(Table::new()));
    }
    let said = super::read(args.head.as_deref(), settings)?;
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
    let world = match (&args.scene, &args.clip) {
        (Some(query), _) => Some(KnownWorld::scene(query)?),
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
    let tracker = registry::tracker(&args.tracker)?;
    let recipe_for = |contender: Contender| {
        let by_pose = (contender == Contender::Forecast).then(|| ("motion.camera".to_owned(), "pose".into()));
        let mut parameters = nested(&by_pose.into_iter().collect::<Table>());
        merge(&mut parameters, of_tracker.clone());
        tracker.recipe(&parameters)
    };
    let mut rows = Vec::new();
    if let Some(world) = &world {
        for contender in contenders() {
            let recipe = recipe_for(contender)?;
            let runs = seeds.clone().map(|seed| look(&study, world, contender, seed, &*recipe, film));
            let figures = Figures::mean(&runs.collect::<anyhow::Result<Vec<_>>>()?);
            rows.push(Row { walk: world.name().to_owned(), contender, figures, stands: false });
        }
    } else {
        for walk in walks(args, study.drone.is_some()) {
            for contender in contenders() {
                let figures = Figures::mean(&study.run(walk, contender, seeds.clone())?);
                let stands = walk == Walk::Standing && study.drone.is_none();
                rows.push(Row { walk: walk.name().to_owned(), contender, figures, stands });
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

/// A tracker looks at what the camera crops from a scene or a clip, beginning on the target.
fn look(
    study: &Study,
    world: &KnownWorld,
    contender: Contender,
    seed: u64,
    recipe: &dyn Recipe,
    film: Option<&Path>,
) -> anyhow::Result<Figures> {
    let study = Study { duration_s: study.duration_s.min(world.duration_s()), ..study.clone() };
    if study.duration_s <= study.judged_from_s {
        let (lasts, from) = (study.duration_s, study.judged_from_s);
        anyhow::bail!(
            "there are {lasts:.1} s to look at, and runs are judged from {from} s on; lower judged_from_s in --head FILE.toml"
        );
    }
    let eye = TrackingEye::new(world.world()?, recipe);
    let Some(first) = world.target(0.0) else { anyhow::bail!("the target is not there at the beginning") };
    // Who has left is where he was seen last.
    let last = Cell::new(first);
    let target = |time_s: f64| {
        last.set(world.target(time_s).unwrap_or(last.get()));
        last.get()
    };
    let samples = match film {
        None => study.follow(contender, seed, first.0, &target, &mut { eye })?,
        Some(path) => filmed(&study, eye, path, |eye| study.follow(contender, seed, first.0, &target, eye))?,
    };
    Ok(Figures::of(&samples, study.judged_from_s))
}

/// A run whose pictures become a video.
#[cfg(feature = "encode")]
fn filmed(
    study: &Study,
    eye: TrackingEye<'_>,
    path: &Path,
    run: impl FnOnce(&mut dyn Eye) -> pursuit::ptz::Result<Vec<Sample>>,
) -> anyhow::Result<Vec<Sample>> {
    let fps = study.camera.clone().map_or_else(CameraParams::usual, Ok)?.fps;
    let mut film = Film::create(path, fps)?;
    let failed = |error: RunError| PtzError::Picture { reason: error.to_string() };
    let mut eye = eye.shown_to(|frame, taken, estimate| film.add(frame, taken, estimate).map_err(failed));
    let samples = run(&mut eye);
    drop(eye);
    // What was seen until something went wrong can be looked at.
    film.finish()?;
    Ok(samples?)
}

#[cfg(not(feature = "encode"))]
fn filmed(
    _: &Study,
    _: TrackingEye<'_>,
    _: &Path,
    _: impl FnOnce(&mut dyn Eye) -> pursuit::ptz::Result<Vec<Sample>>,
) -> anyhow::Result<Vec<Sample>> {
    Err(RunError::usage(pursuit::NO_OVERLAY.unwrap_or("this build writes no video")).into())
}

fn table(rows: &[Row], seeds: &Range<u64>) -> anyhow::Result<String> {
    let wide = rows.iter().map(|row| row.walk.len()).max().unwrap_or(0).max(10);
    let mut text = format!(
        "{}. central: within the central 20 % of the picture; rms: off the middle; shown: in the picture.\n\n\
         {:<wide$} {:<13} {:>9} {:>8} {:>9} {:>16} {:>10} {:>9}\n",
        over(seeds),
        "walk",
        "controller",
        "central",
        "rms",
        "shown",
        "longest absence",
        "overshoot",
        "wanders"
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
        match row.standing() {
            Some((overshoot, wanders)) => writeln!(text, " {:>8.1} % {wanders:>8.2}°", 100.0 * overshoot)?,
            None => writeln!(text, " {:>10} {:>9}", "–", "–")?,
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
            })
        })
        .collect();
    Ok(serde_json::to_string_pretty(
        &serde_json::json!({ "seeds": seeds.end - seeds.start, "first_seed": seeds.start, "runs": rows }),
    )? + "\n")
}
