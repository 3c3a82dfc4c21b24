use crate::args::{Global, PtzFollow};
use crate::commands::{Remarks, track};
use crate::console;
use anyhow::Context;
use pursuit::parameters::{Parameters, Table, Value, nested};
use pursuit::ptz::control::{Follower, FollowerParams, PredictBy};
use pursuit::ptz::drivers::Pilot;
use pursuit::ptz::geometry::FieldsOfView;
use pursuit::{Run, RunError, head};
use std::process::ExitCode;

/// `pursuit ptz follow`: a run as `pursuit track` makes it, whose first target a head follows.
pub fn run(args: &PtzFollow, global: &Global) -> anyhow::Result<ExitCode> {
    let views = FieldsOfView::fixed(0.5 * args.field_of_view)?;
    if args.track.inputs.len() > 1 {
        return Err(RunError::usage("a head follows one input; give no more than one").into());
    }
    let mut config = track::config(&args.track)?;
    config.parameters = nested(&config.parameters);
    let settings = match config.parameters.remove("follower") {
        Some(Value::Table(settings)) => settings,
        Some(_) => return Err(RunError::usage("`follower` is a group; set `follower.KEY`").into()),
        None => Table::new(),
    };
    let said = super::read(args.follower.as_deref(), settings)?;
    let params = FollowerParams::default().with("follower", &said);
    let params =
        params.with_context(|| format!("{} does not say how to follow", super::origin(args.follower.as_deref())))?;
    // A picture of everything that was seen is made when asked for.
    config.video = config.video.or(Some(false));
    let Some(config) = track::with_box(config, &args.track)? else { return Ok(ExitCode::SUCCESS) };
    // A forecast is of use to a moving head where the tracker knows how the head moves; poses are of the whole picture.
    let by_tracker = params.predict_by == PredictBy::Tracker && config.region.is_none();
    let config = if by_tracker { head::compensated(config) } else { config };
    let input = config.input.clone();
    let open = || Run::prepare(config, &track::open_options(&args.track));
    let run = console::connecting(input.as_ref(), global, open)?;
    let mut head = super::reach(&args.head.head, &args.head.secret)?;
    let mut params = super::known(&mut *head).with("follower", &said)?;
    let head = super::able(head, &mut params)?;
    let follower = Follower::new(params, views, run.input().input_size(), 0.0)?;
    let thread = super::on_a_thread(head, Pilot::WATCHDOG)?;
    let carry_out = |run: Run, remarks: Remarks| {
        let run = head::follow(run, Pilot::new(follower, thread), move |diagnosis| remarks(diagnosis.to_string()));
        let say = |finished: &_| if args.track.json { track::json(finished) } else { track::summary(finished, false) };
        track::carry_out(run, global, say)
    };
    #[cfg(feature = "studio")]
    if args.track.watch {
        return crate::commands::studio::watched(run, carry_out);
    }
    carry_out(run, Box::new(|_| {}))
}
