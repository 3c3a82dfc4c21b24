use super::frame::{Frame, Reply, parse_replies};
use crate::drivers::{Capabilities, Head, Timeouts};
use crate::error::require;
use crate::{Command, Direction, Position, PtzError, Result, Status};
use std::io::{ErrorKind, Read, Write};
use std::time::Instant;

/// How a Pelco-D head is set up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PelcoDParams {
    /// Its address, 1 to 255.
    pub address: u8,
    /// The speeds of pan and of tilt at the greatest step, degrees per second. Measured by the calibration.
    pub max_speed_deg_s: (f64, f64),
    /// Whether it takes and gives positions, as newer heads do.
    pub positions: bool,
}

impl Default for PelcoDParams {
    fn default() -> Self {
        Self { address: 1, max_speed_deg_s: (60.0, 30.0), positions: true }
    }
}

/// A Pelco-D head on a line: anything that is read and written, and whose reads come back after a while.
pub struct PelcoD<L: Read + Write + Send> {
    name: String,
    line: L,
    params: PelcoDParams,
    timeouts: Timeouts,
    moving: bool,
}

impl<L: Read + Write + Send> PelcoD<L> {
    /// How much of what a head says at once is looked at, bytes.
    const MOST_BYTES: usize = 4096;

    /// A head of this name on `line`.
    ///
    /// # Errors
    /// Where a speed is not positive.
    pub fn new(name: impl Into<String>, line: L, params: PelcoDParams, timeouts: Timeouts) -> Result<Self> {
        let (pan, tilt) = params.max_speed_deg_s;
        require("max_speed_deg_s of pan", pan, pan > 0.0, "above 0")?;
        require("max_speed_deg_s of tilt", tilt, tilt > 0.0, "above 0")?;
        Ok(Self { name: name.into(), line, params, timeouts, moving: false })
    }

    fn write(&mut self, frames: &[Frame], doing: &'static str) -> Result<()> {
        let bytes: Vec<u8> = frames.iter().flat_map(Frame::bytes).collect();
        let written = self.line.write_all(&bytes).and_then(|()| self.line.flush());
        written.map_err(|source| PtzError::Io { head: self.name.clone(), doing, source })
    }

    fn unsupported(&self, what: &'static str) -> PtzError {
        PtzError::Unsupported { head: self.name.clone(), what }
    }
}

impl<L: Read + Write + Send> Head for PelcoD<L> {
    fn name(&self) -> &str {
        &self.name
    }

    fn capabilities(&self) -> Capabilities {
        let positions = self.params.positions;
        Capabilities {
            velocity: true,
            absolute: positions,
            relative: false,
            zoom: true,
            presets: true,
            status: positions,
            travel: None,
            max_speed_deg_s: Some(self.params.max_speed_deg_s),
        }
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        let address = self.params.address;
        // From here on it may move, whatever happens to the answer.
        self.moving |= command.moves();
        match *command {
            Command::Move(velocity) => {
                let frame = Frame::motion(address, &velocity, self.params.max_speed_deg_s);
                self.write(&[frame], "moving")?;
            }
            Command::GoTo { direction, zoom } if self.params.positions => {
                let mut frames = vec![Frame::pan_to(address, direction), Frame::tilt_to(address, direction)];
                frames.extend(zoom.map(|zoom| Frame::zoom_to(address, zoom)));
                self.write(&frames, "going to a position")?;
            }
            Command::GoTo { .. } => return Err(self.unsupported("go to a position")),
            Command::TurnBy { .. } => return Err(self.unsupported("turn by an angle")),
            Command::Preset { number } => self.write(&[Frame::preset(address, number)], "going to a preset")?,
            Command::Home if self.params.positions => {
                let ahead = Direction::AHEAD;
                self.write(&[Frame::pan_to(address, ahead), Frame::tilt_to(address, ahead)], "going home")?;
            }
            Command::Home => return Err(self.unsupported("go home")),
            Command::Stop => self.write(&[Frame::stop(address)], "stopping")?,
        }
        self.moving = command.moves();
        Ok(())
    }

    fn leave(&mut self) {
        self.moving = false;
    }

    fn status(&mut self) -> Result<Option<Status>> {
        if !self.params.positions {
            return Ok(None);
        }
        self.write(&Frame::queries(self.params.address), "asking for the position")?;
        let deadline = Instant::now() + self.timeouts.answer;
        let mut said = Vec::new();
        let (mut pan, mut tilt, mut zoom) = (None, None, None);
        while Instant::now() < deadline && said.len() < Self::MOST_BYTES {
            let mut some = [0; 64];
            match self.line.read(&mut some) {
                Ok(0) => break,
                Ok(count) => said.extend_from_slice(some.get(..count).unwrap_or_default()),
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => {}
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(source) => {
                    return Err(PtzError::Io { head: self.name.clone(), doing: "reading the position", source });
                }
            }
            for reply in parse_replies(self.params.address, &said) {
                match reply {
                    Reply::Pan(deg) => pan = Some(deg),
                    Reply::Tilt(deg) => tilt = Some(deg),
                    Reply::Zoom(part) => zoom = Some(part),
                }
            }
            if let (Some(pan), Some(tilt), Some(zoom)) = (pan, tilt, zoom) {
                let position = Position { direction: Direction::new(pan, tilt), zoom };
                return Ok(Some(Status { position: Some(position), moving: None }));
            }
        }
        let after_s = self.timeouts.answer.as_secs_f64();
        Err(PtzError::TimedOut { head: self.name.clone(), doing: "asking for the position", after_s })
    }
}

impl<L: Read + Write + Send> Drop for PelcoD<L> {
    fn drop(&mut self) {
        if self.moving {
            self.write(&[Frame::stop(self.params.address)], "stopping").ok();
        }
    }
}
