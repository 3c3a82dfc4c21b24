use super::frame::{Reply, drive, meaning, message, position, zoom_drive, zoom_step, zoom_to};
use super::link::Link;
use crate::drivers::{Capabilities, Head, Timeouts};
use crate::error::require;
use crate::{Command, Position, PtzError, Result, Status, Velocity};
use std::time::Instant;

/// The speeds of an axis by step: the first is step 1. Cameras differ, and few have equal steps.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedSteps(Vec<f64>);

impl SpeedSteps {
    /// Measured speeds, growing, degrees per second.
    ///
    /// # Errors
    /// Unless there are 1 to 127 of them, above 0 and growing.
    pub fn new(deg_s: Vec<f64>) -> Result<Self> {
        require("speed steps", deg_s.len() as f64, (1..=127).contains(&deg_s.len()), "between 1 and 127")?;
        let mut before = 0.0;
        for speed in &deg_s {
            require("speed of a step", *speed, *speed > before, "above 0 and above the step before it")?;
            before = *speed;
        }
        Ok(Self(deg_s))
    }

    /// Equal steps up to `top_deg_s`.
    ///
    /// # Errors
    /// Unless there are 1 to 127 and the top is positive.
    pub fn equal(count: u8, top_deg_s: f64) -> Result<Self> {
        Self::new((1..=count).map(|step| top_deg_s * f64::from(step) / f64::from(count)).collect())
    }

    /// The step nearest to a speed, with its sign; 0 where standing still is nearest.
    pub fn nearest(&self, deg_s: f64) -> i8 {
        let off = |speed: f64| (speed - deg_s.abs()).abs();
        let mut best = (0, deg_s.abs());
        for (index, speed) in self.0.iter().enumerate() {
            if off(*speed) < best.1 {
                best = (index + 1, off(*speed));
            }
        }
        let step = best.0 as i8;
        if deg_s < 0.0 { -step } else { step }
    }

    fn count(&self) -> u8 {
        self.0.len() as u8
    }

    fn top(&self) -> f64 {
        self.0.last().copied().unwrap_or_default()
    }
}

/// How a VISCA camera is set up.
#[derive(Debug, Clone, PartialEq)]
pub struct ViscaParams {
    /// Its address, 1 to 7; 1 over IP.
    pub address: u8,
    /// The speeds of pan. Measured by the calibration, or from the camera's manual.
    pub pan: SpeedSteps,
    /// The speeds of tilt.
    pub tilt: SpeedSteps,
    /// Units of its positions per degree; 14.4 with many makers.
    pub units_per_deg: f64,
    /// Its longest zoom position.
    pub zoom_top: u16,
    /// How much of the zoom range it travels in a second at the greatest speed.
    pub zoom_per_s: f64,
}

impl ViscaParams {
    /// A common camera: 24 equal steps of pan to 100°/s and 20 of tilt to 70°/s.
    ///
    /// # Errors
    /// Never.
    pub fn usual() -> Result<Self> {
        let (pan, tilt) = (SpeedSteps::equal(24, 100.0)?, SpeedSteps::equal(20, 70.0)?);
        Ok(Self { address: 1, pan, tilt, units_per_deg: 14.4, zoom_top: 0x4000, zoom_per_s: 0.3 })
    }
}

/// A camera that speaks VISCA.
pub struct Visca<L: Link> {
    name: String,
    link: L,
    params: ViscaParams,
    timeouts: Timeouts,
    zooming: i8,
    moving: bool,
}

impl<L: Link> Visca<L> {
    /// A camera of this name at the end of `link`.
    ///
    /// # Errors
    /// Where a parameter is out of its range.
    pub fn new(name: impl Into<String>, link: L, params: ViscaParams, timeouts: Timeouts) -> Result<Self> {
        require("address", f64::from(params.address), (1..=7).contains(&params.address), "between 1 and 7")?;
        require("units_per_deg", params.units_per_deg, params.units_per_deg > 0.0, "above 0")?;
        require("zoom_per_s", params.zoom_per_s, params.zoom_per_s > 0.0, "above 0")?;
        Ok(Self { name: name.into(), link, params, timeouts, zooming: 0, moving: false })
    }

    fn io(&self, doing: &'static str, source: std::io::Error) -> PtzError {
        PtzError::Io { head: self.name.clone(), doing, source }
    }

    /// Sends a message and waits for the first answer that `accept` takes. Half way to the time-out the message is sent
    /// again where the link can.
    fn ask<T>(
        &mut self,
        doing: &'static str,
        body: &[u8],
        inquiry: bool,
        accept: impl Fn(&Reply) -> Option<T>,
    ) -> Result<T> {
        let start = Instant::now();
        let deadlines = [start + self.timeouts.answer / 2, start + self.timeouts.answer];
        let bytes = message(self.params.address, body);
        self.link.send(&bytes, inquiry).map_err(|error| self.io(doing, error))?;
        for (round, deadline) in deadlines.into_iter().enumerate() {
            while let Some(reply) = self.link.receive(deadline).map_err(|error| self.io(doing, error))? {
                if let Some(answer) = accept(&reply) {
                    return Ok(answer);
                }
                match reply {
                    // Commands that were overtaken say so; that is of no concern to this one.
                    Reply::Error(0x04) => {}
                    Reply::Error(error) => {
                        let reason = format!("{} (error {error:02X})", meaning(error));
                        return Err(PtzError::Refused { head: self.name.clone(), doing, reason });
                    }
                    _ => {}
                }
            }
            if round == 0 {
                self.link.again().map_err(|error| self.io(doing, error))?;
            }
        }
        let after_s = self.timeouts.answer.as_secs_f64();
        Err(PtzError::TimedOut { head: self.name.clone(), doing, after_s })
    }

    /// A camera that answers with the completion alone has taken the command too.
    fn command(&mut self, doing: &'static str, body: &[u8]) -> Result<()> {
        self.ask(doing, body, false, |reply| matches!(reply, Reply::Acknowledged | Reply::Completed).then_some(()))
    }

    fn velocity(&mut self, velocity: &Velocity) -> Result<()> {
        let (pan, tilt) = (&self.params.pan, &self.params.tilt);
        let steps = drive(pan.nearest(velocity.pan_deg_s), tilt.nearest(velocity.tilt_deg_s));
        self.command("moving", &steps)?;
        self.zoom(zoom_step(velocity, self.params.zoom_per_s))
    }

    /// Drives the zoom; what it does already it is not told again.
    fn zoom(&mut self, step: i8) -> Result<()> {
        if step != self.zooming {
            self.command("zooming", &zoom_drive(step))?;
            self.zooming = step;
        }
        Ok(())
    }

    fn stop(&mut self) -> Result<()> {
        // The zoom is stopped even where the drive does not answer.
        let drive = self.command("stopping", &drive(0, 0));
        let zoom = self.zoom(0);
        drive.and(zoom)
    }
}

impl<L: Link> Head for Visca<L> {
    fn name(&self) -> &str {
        &self.name
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities {
            velocity: true,
            absolute: true,
            relative: true,
            zoom: true,
            presets: true,
            status: true,
            travel: None,
            max_speed_deg_s: Some((self.params.pan.top(), self.params.tilt.top())),
        }
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        // From here on it may move, whatever happens to the answer.
        self.moving |= command.moves();
        let fastest = (self.params.pan.count(), self.params.tilt.count());
        let units = self.params.units_per_deg;
        match *command {
            Command::Move(velocity) => self.velocity(&velocity)?,
            Command::GoTo { direction, zoom } => {
                self.command("going to a position", &position(0x02, fastest, direction, units))?;
                if let Some(zoom) = zoom {
                    self.command("zooming to a position", &zoom_to(zoom, self.params.zoom_top))?;
                }
            }
            Command::TurnBy { by } => self.command("turning by an angle", &position(0x03, fastest, by, units))?,
            Command::Preset { number } => self.command("going to a preset", &[0x01, 0x04, 0x3F, 0x02, number])?,
            Command::Home => self.command("going home", &[0x01, 0x06, 0x04])?,
            Command::Stop => self.stop()?,
        }
        self.moving = command.moves();
        Ok(())
    }

    fn leave(&mut self) {
        self.moving = false;
    }

    fn status(&mut self) -> Result<Option<Status>> {
        let (units, top) = (self.params.units_per_deg, self.params.zoom_top);
        let at = |reply: &Reply| reply.position(units);
        let direction = self.ask("asking for the position", &[0x09, 0x06, 0x12], true, at)?;
        let zoom = self.ask("asking for the zoom", &[0x09, 0x04, 0x47], true, |reply| reply.zoom(top))?;
        Ok(Some(Status { position: Some(Position { direction, zoom }), moving: None }))
    }
}

impl<L: Link> Drop for Visca<L> {
    fn drop(&mut self) {
        if self.moving {
            // Sent, not waited for: the zoom too, since nobody knows what it does.
            for body in [&drive(0, 0)[..], &zoom_drive(0)] {
                self.link.send(&message(self.params.address, body), false).ok();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_become_the_nearest_step() {
        let steps = SpeedSteps::new(vec![1.0, 2.0, 5.0, 30.0]).unwrap();
        let nearest = |speed| steps.nearest(speed);
        assert_eq!([0.0, 0.4, 0.6, -3.4, 3.6, 100.0, -100.0].map(nearest), [0, 0, 1, -2, 3, 4, -4]);
        assert_eq!((steps.count(), steps.top()), (4, 30.0));
        assert_eq!(SpeedSteps::equal(24, 120.0).unwrap().nearest(50.0), 10);
        for bad in [vec![], vec![0.0], vec![2.0, 2.0], vec![f64::NAN], vec![1.0; 200]] {
            assert!(SpeedSteps::new(bad).is_err());
        }
    }
}
