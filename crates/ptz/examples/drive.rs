//! Drives a head through every kind of command and prints what becomes of each, a line of JSON each: to try a camera, and for
//! the comparison with a camera simulator that we did not write (`xtask/peers/onvif.py`).
//!
//! usage: drive ADDRESS [PAUSE_S]; the password is read from PURSUIT_PTZ_PASSWORD, the file of trusted certificates is named by
//! PURSUIT_PTZ_CA

use pursuit_ptz::drivers::{Access, HeadAddress, Password, Timeouts, open};
use pursuit_ptz::{Command, Direction, Velocity};
use std::time::{Duration, Instant};

#[allow(clippy::disallowed_methods, reason = "the secret is in the environment")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let address: HeadAddress = args.next().ok_or("usage: drive ADDRESS [PAUSE_S]")?.parse()?;
    let pause = Duration::from_secs_f64(args.next().map_or(Ok(0.3), |s| s.parse())?);
    let password = std::env::var("PURSUIT_PTZ_PASSWORD").ok().map(Password::new);
    let access = Access { password, certificates: std::env::var_os("PURSUIT_PTZ_CA").map(Into::into) };
    let mut head = match open(&address, &access, Timeouts::default()) {
        Ok(head) => head,
        Err(error) => {
            println!("{}", serde_json::json!({ "open": error.to_string() }));
            return Ok(());
        }
    };
    println!("{}", serde_json::json!({ "open": null, "capabilities": head.capabilities() }));
    let right = Velocity { pan_deg_s: 20.0, ..Velocity::ZERO };
    let commands = [
        Command::Move(right),
        Command::Stop,
        Command::GoTo { direction: Direction::new(30.0, 10.0), zoom: None },
        Command::TurnBy { by: Direction::new(-15.0, 0.0) },
        Command::Home,
        Command::Move(right),
    ];
    for command in commands {
        let began = Instant::now();
        let error = head.send(&command).err().map(|e| e.to_string());
        let took_s = began.elapsed().as_secs_f64();
        std::thread::sleep(pause);
        let status = head.status().map(|s| format!("{s:?}")).unwrap_or_else(|e| e.to_string());
        println!("{}", serde_json::json!({ "command": command, "error": error, "took_s": took_s, "status": status }));
    }
    // The head is let go of while it moves.
    Ok(())
}
