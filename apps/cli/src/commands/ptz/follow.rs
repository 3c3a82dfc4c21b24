use super::Manner;
use crate::args::{Global, PtzFollow};
use crate::commands::{Remarks, track};
use crate::console;
use pursuit::ptz::control::Follower;
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
    let manner = Manner::take(&mut config, args.follower.as_deref())?;
    // A picture of everything that was seen is made when asked for.
    config.video = config.video.or(Some(false));
    let Some(config) = track::with_box(config, &args.track)? else { return Ok(ExitCode::SUCCESS) };
    let config = manner.on_a_head(config);
    let input = config.input.clone();
    let open = || Run::prepare(config, &track::open_options(&args.track));
    let run = console::connecting(input.as_ref(), global, open)?;
    let mut head = super::reach(&args.head.head, &args.head.secret)?;
    let mut params = manner.of(&mut *head)?;
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
