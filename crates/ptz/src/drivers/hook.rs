use super::{Capabilities, Head};
use crate::{Command, PtzError, Result, Status};
use std::io::Write;
use std::process::{Child, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

/// A user's own program as a head: it is given one command a line, as JSON, on its standard input.
///
/// ```text
/// {"command":"move","pan_deg_s":12.5,"tilt_deg_s":-3.0,"zoom_per_s":0.0}
/// {"command":"go_to","direction":{"pan_deg":10.0,"tilt_deg":2.0},"zoom":null}
/// {"command":"turn_by","by":{"pan_deg":10.0,"tilt_deg":2.0}}
/// {"command":"preset","number":3}
/// {"command":"home"}
/// {"command":"stop"}
/// ```
///
/// A program that does not read is complained of, never waited for. At the end it is told to stop, its input is closed, and
/// when it has not ended a second later it is killed.
#[derive(Debug)]
pub struct Hook {
    name: String,
    child: Child,
    lines: Option<SyncSender<Vec<u8>>>,
    failed: Receiver<std::io::Error>,
    /// Whether it is told to stop at the end.
    stops: bool,
}

impl Hook {
    /// How many lines may wait for a program that is slow to read.
    const WAITING: usize = 64;
    /// How long a program may take to end after its input was closed.
    const LAST_WORDS: Duration = Duration::from_secs(1);

    /// How long a shell may take to say that there is no such command.
    const FIRST_WORDS: Duration = Duration::from_millis(100);

    /// Fails where the shell ends at once because there is no such command (127) or it cannot be run (126).
    fn exists(child: &mut Child) -> std::io::Result<()> {
        let deadline = Instant::now() + Self::FIRST_WORDS;
        while Instant::now() < deadline {
            if let Some(status) = child.try_wait()? {
                let missing = matches!(status.code(), Some(126 | 127));
                let reason = || std::io::Error::new(std::io::ErrorKind::NotFound, "there is no such command");
                return if missing { Err(reason()) } else { Ok(()) };
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    /// Starts `command` with the system's shell.
    ///
    /// # Errors
    /// Where it cannot be started.
    pub fn start(command: &str) -> Result<Self> {
        let name = "hook".to_owned();
        let io = |source| PtzError::Io { head: "hook".into(), doing: "starting its command", source };
        let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
        let mut child =
            std::process::Command::new(shell).args([flag, command]).stdin(Stdio::piped()).spawn().map_err(io)?;
        Self::exists(&mut child).map_err(io)?;
        let input = child.stdin.take();
        let (lines, waiting) = sync_channel::<Vec<u8>>(Self::WAITING);
        let (fail, failed) = sync_channel(1);
        let writer = std::thread::Builder::new().name("hook".into()).spawn(move || {
            let Some(mut input) = input else { return };
            for line in waiting {
                if let Err(error) = input.write_all(&line).and_then(|()| input.flush()) {
                    fail.try_send(error).ok();
                    return;
                }
            }
        });
        writer.map_err(io)?;
        Ok(Self { name, child, lines: Some(lines), failed, stops: true })
    }
}

impl Head for Hook {
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
            ..Capabilities::default()
        }
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        let io = |source| PtzError::Io { head: "hook".into(), doing: "writing a command", source };
        if let Ok(error) = self.failed.try_recv() {
            return Err(io(error));
        }
        let mut line = serde_json::to_vec(command).map_err(|error| io(error.into()))?;
        line.push(b'\n');
        let Some(lines) = &self.lines else { return Err(PtzError::Ended { head: self.name.clone() }) };
        match lines.try_send(line) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                Err(PtzError::TimedOut { head: self.name.clone(), doing: "a command", after_s: 0.0 })
            }
            Err(TrySendError::Disconnected(_)) => Err(PtzError::Ended { head: self.name.clone() }),
        }
    }

    fn status(&mut self) -> Result<Option<Status>> {
        Ok(None)
    }

    fn leave(&mut self) {
        self.stops = false;
    }
}

impl Drop for Hook {
    fn drop(&mut self) {
        if self.stops {
            self.send(&Command::Stop).ok();
        }
        // The writer ends when it has written what waits, and the program's input closes with it.
        self.lines = None;
        let deadline = Instant::now() + Self::LAST_WORDS;
        while Instant::now() < deadline {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::{Direction, Velocity};

    #[test]
    fn a_program_gets_one_line_a_command_and_a_stop_at_the_end() {
        let path = std::env::temp_dir().join(format!("pursuit-ptz-hook-{}.jsonl", std::process::id()));
        let mut hook = Hook::start(&format!("cat > '{}'", path.display())).unwrap();
        hook.send(&Command::Move(Velocity { pan_deg_s: 2.5, ..Velocity::ZERO })).unwrap();
        hook.send(&Command::TurnBy { by: Direction::new(1.0, -1.0) }).unwrap();
        assert!(hook.capabilities().velocity && hook.status().unwrap().is_none());
        drop(hook);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines,
            [
                r#"{"command":"move","pan_deg_s":2.5,"tilt_deg_s":0.0,"zoom_per_s":0.0}"#,
                r#"{"command":"turn_by","by":{"pan_deg":1.0,"tilt_deg":-1.0}}"#,
                r#"{"command":"stop"}"#,
            ]
        );
    }

    #[test]
    fn a_program_that_does_not_read_or_has_gone_is_complained_of_and_not_waited_for() {
        let mut deaf = Hook::start("exec sleep 1000").unwrap();
        let long = Command::GoTo { direction: Direction::new(0.123_456_789, 0.987_654_321), zoom: Some(0.111_111_111) };
        let error = (0..100_000).find_map(|_| deaf.send(&long).err()).unwrap();
        assert!(matches!(error, PtzError::TimedOut { .. }), "{error}");
        drop(deaf);
        assert!(Hook::start("/does/not/exist --now").unwrap_err().to_string().contains("no such command"));
        let mut gone = Hook::start("exit 0").unwrap();
        gone.child.wait().unwrap();
        let error = (0..1000).find_map(|_| {
            std::thread::sleep(Duration::from_millis(1));
            gone.send(&long).err()
        });
        assert!(matches!(error, Some(PtzError::Io { .. } | PtzError::Ended { .. })), "{error:?}");
    }
}
