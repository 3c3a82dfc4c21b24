//! Pelco-D and VISCA on a pseudo-terminal.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![cfg(all(feature = "serial", unix))]

use pursuit_ptz::drivers::pelco_d::{PelcoD, PelcoDParams};
use pursuit_ptz::drivers::visca::{StreamLink, Visca, ViscaParams};
use pursuit_ptz::drivers::{Head, Timeouts};
use pursuit_ptz::{Command, Direction, PtzError, Velocity};
use serial2::SerialPort;
use std::time::Duration;

fn pair() -> (SerialPort, SerialPort) {
    // The first end is the master: what the other one wrote can still be read from it when that one is closed.
    let (mut theirs, mut ours) = SerialPort::pair().unwrap();
    ours.set_read_timeout(Duration::from_millis(20)).unwrap();
    theirs.set_read_timeout(Duration::from_secs(5)).unwrap();
    (ours, theirs)
}

fn quick() -> Timeouts {
    Timeouts::from_secs(1.0, 0.3).unwrap()
}

fn read(port: &SerialPort, count: usize) -> Vec<u8> {
    let mut got = vec![0; count];
    port.read_exact(&mut got).unwrap();
    got
}

#[test]
fn pelco_d_goes_out_on_the_line_and_the_end_stops_the_head() {
    let (ours, theirs) = pair();
    let params = PelcoDParams { max_speed_deg_s: (63.0, 63.0), ..PelcoDParams::default() };
    let mut head = PelcoD::new("pelco:pty", ours, params, quick()).unwrap();
    head.send(&Command::Move(Velocity { pan_deg_s: -32.0, ..Velocity::ZERO })).unwrap();
    assert_eq!(read(&theirs, 7), [0xFF, 0x01, 0x00, 0x04, 0x20, 0x00, 0x25]);
    head.send(&Command::GoTo { direction: Direction::new(90.0, 0.0), zoom: Some(0.0) }).unwrap();
    let got = read(&theirs, 21);
    assert_eq!((got[3], got[10], got[17]), (0x4B, 0x4D, 0x4F));
    head.send(&Command::Preset { number: 4 }).unwrap();
    assert_eq!(read(&theirs, 7)[3..6], [0x07, 0x00, 0x04]);
    assert!(matches!(head.send(&Command::TurnBy { by: Direction::AHEAD }), Err(PtzError::Unsupported { .. })));
    drop(head);
    assert_eq!(read(&theirs, 7), [0xFF, 0x01, 0x00, 0x00, 0x00, 0x00, 0x01], "stop");
}

#[test]
fn a_position_is_asked_for_and_silence_is_an_error_in_time() {
    let (ours, theirs) = pair();
    let mut head = PelcoD::new("pelco:pty", ours, PelcoDParams::default(), quick()).unwrap();
    assert!(matches!(head.status(), Err(PtzError::TimedOut { .. })));
    let camera = std::thread::spawn(move || {
        read(&theirs, 42);
        let line = &theirs;
        line.write_all(&[0x00, 0xFF]).unwrap();
        line.write_all(&[0xFF, 0x01, 0x00, 0x59, 0x23, 0x28, 0xA5]).unwrap();
        line.write_all(&[0xFF, 0x01, 0x00, 0x5B, 0x03, 0xE8, 0x47]).unwrap();
        line.write_all(&[0xFF, 0x01, 0x00, 0x5D, 0x00, 0x00, 0x5E]).unwrap();
        theirs
    });
    let status = head.status().unwrap().unwrap();
    let position = status.position.unwrap();
    assert_eq!((position.direction, position.zoom, status.moving), (Direction::new(90.0, -10.0), 0.0, None));
    camera.join().unwrap();
    let (ours, _theirs) = pair();
    let deaf = PelcoDParams { positions: false, ..PelcoDParams::default() };
    let mut head = PelcoD::new("pelco:pty", ours, deaf, quick()).unwrap();
    assert_eq!(head.status().unwrap(), None);
    assert!(head.send(&Command::Home).is_err() && !head.capabilities().absolute);
    assert!(head.send(&Command::GoTo { direction: Direction::AHEAD, zoom: None }).is_err());
}

#[test]
fn visca_goes_over_a_line() {
    let (ours, theirs) = pair();
    let camera = std::thread::spawn(move || {
        let got = read(&theirs, 5);
        theirs.write_all(&[0x90, 0x42, 0xFF]).unwrap();
        // Kept open: a line that is hung up forgets what was not read.
        (got, theirs)
    });
    let mut head = Visca::new("visca:pty", StreamLink::new(ours), ViscaParams::usual().unwrap(), quick()).unwrap();
    head.send(&Command::Home).unwrap();
    assert_eq!(camera.join().unwrap().0, [0x81, 0x01, 0x06, 0x04, 0xFF]);
}
