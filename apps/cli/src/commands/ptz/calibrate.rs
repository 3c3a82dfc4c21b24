use crate::args::{Global, PtzCalibrate};
use crate::commands::credentials::with_credentials;
use crate::commands::print;
use crate::console;
use anyhow::{Context, bail};
use pursuit::media::Locator;
use pursuit::open;
use pursuit::ptz::calibration::{CalibrationParams, Calibrator, Shift, ShiftMeter, Step};
use pursuit::ptz::control::FollowerParams;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// The longest side of the middle of the picture by which shifts are measured, pixels.
const LONGEST_SIDE: usize = 512;
/// A move lasts a second; a camera that says nothing for longer has gone.
const WATCHDOG: Duration = Duration::from_millis(1800);

/// `pursuit ptz calibrate`.
pub fn run(args: &PtzCalibrate, global: &Global) -> anyhow::Result<ExitCode> {
    let stop = console::stop_flag();
    let input = with_credentials(Locator::from(args.input.as_str()), &args.credentials)?;
    let open_input = || open(input.clone());
    let mut source = console::connecting(Some(&input), global, open_input)?;
    let size = source.info().size;
    let side = |length: usize| (length / 2 * 2).min(LONGEST_SIDE);
    let mut meter = ShiftMeter::new(side(size.width), side(size.height))?;
    let head = super::on_a_thread(super::reach(&args.head.head, &args.head.secret)?, WATCHDOG)?;
    let began = Instant::now();
    let mut calibrator = Calibrator::new(CalibrationParams::default(), 0.0)?;
    let calibration = loop {
        if stop.load(Ordering::Relaxed) {
            bail!("stopped before the head was measured");
        }
        let Some(frame) = source.next_frame()? else { bail!("the input ended before the head was measured") };
        let now_s = began.elapsed().as_secs_f64();
        if let Some((right_px, down_px)) = meter.measure(&frame.gray()) {
            calibrator.see(&Shift { stamp_s: now_s, right_px, down_px });
        }
        match calibrator.step(now_s)? {
            Step::Wait => {}
            Step::Send(command) => head.tell(command)?,
            Step::Done(calibration) => break calibration,
        }
        if let Some(error) = head.report().errors.into_iter().next() {
            return Err(error.into());
        }
    };
    drop(head);
    let mut params = FollowerParams { frame_age_s: args.frame_age, ..FollowerParams::default() };
    calibration.apply(&mut params);
    let measured = toml::to_string(&calibration).context("what was measured cannot be written")?;
    let measured: String = measured.lines().map(|line| format!("# {line}\n")).collect();
    let text = format!(
        "# Measured in {:.1} s. For `pursuit ptz follow --follower`:\n{measured}\n{}",
        calibration.took_s,
        toml::to_string(&params).context("the parameters cannot be written")?,
    );
    print(text.as_bytes())
}
