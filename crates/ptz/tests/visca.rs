//! VISCA against a fake camera, over UDP and TCP.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use pursuit_ptz::drivers::visca::{SpeedSteps, Visca, ViscaParams, connect_tcp, connect_udp};
use pursuit_ptz::drivers::{Head, Timeouts};
use pursuit_ptz::{Command, Direction, PtzError, Velocity};
use std::io::{Read, Write};
use std::net::{TcpListener, UdpSocket};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

fn params() -> ViscaParams {
    let steps = SpeedSteps::equal(24, 24.0).unwrap();
    ViscaParams { pan: steps.clone(), tilt: steps, ..ViscaParams::usual().unwrap() }
}

fn quick() -> Timeouts {
    Timeouts::from_secs(1.0, 0.4).unwrap()
}

const RIGHT: Command = Command::Move(Velocity { pan_deg_s: 10.0, tilt_deg_s: 0.0, zoom_per_s: 0.0 });
const DRIVE_RIGHT: &[u8] = &[0x81, 0x01, 0x06, 0x01, 0x0A, 0x01, 0x02, 0x03, 0xFF];
const DRIVE_STOP: &[u8] = &[0x81, 0x01, 0x06, 0x01, 0x01, 0x01, 0x03, 0x03, 0xFF];
const ZOOM_STOP: &[u8] = &[0x81, 0x01, 0x04, 0x07, 0x00, 0xFF];

/// A camera on TCP that answers each message by `answer`; what it heard is passed on.
fn tcp(answer: impl Fn(&[u8]) -> Vec<u8> + Send + 'static) -> (u16, Receiver<Vec<u8>>, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let (heard, hears) = channel();
    let camera = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut message = Vec::new();
        let mut byte = [0];
        while stream.read(&mut byte).is_ok_and(|n| n == 1) {
            message.push(byte[0]);
            if byte[0] == 0xFF {
                let said = answer(&message);
                heard.send(std::mem::take(&mut message)).ok();
                if said == b"hang up" {
                    return;
                }
                stream.write_all(&said).ok();
            }
        }
    });
    (port, hears, camera)
}

fn head(port: u16) -> Visca<impl pursuit_ptz::drivers::visca::Link> {
    Visca::new("visca+tcp://cam", connect_tcp("127.0.0.1", port, &quick()).unwrap(), params(), quick()).unwrap()
}

fn takes(message: &[u8]) -> Vec<u8> {
    match message.get(1..4) {
        Some([0x09, 0x06, 0x12]) => vec![0x90, 0x50, 0, 5, 1, 0, 0xF, 0xE, 5, 0, 0xFF],
        Some([0x09, 0x04, 0x47]) => vec![0x90, 0x50, 2, 0, 0, 0, 0xFF],
        _ => vec![0x90, 0x41, 0xFF, 0x90, 0x51, 0xFF],
    }
}

#[test]
fn commands_go_out_as_the_lists_have_them_and_the_end_stops_the_head() {
    let (port, heard, camera) = tcp(takes);
    let mut head = head(port);
    let next = || heard.recv_timeout(Duration::from_secs(5)).unwrap();
    head.send(&RIGHT).unwrap();
    assert_eq!(next(), DRIVE_RIGHT);
    head.send(&Command::Move(Velocity { pan_deg_s: 10.0, tilt_deg_s: 0.0, zoom_per_s: 0.3 })).unwrap();
    assert_eq!((next(), next()), (DRIVE_RIGHT.to_vec(), vec![0x81, 0x01, 0x04, 0x07, 0x27, 0xFF]));
    head.send(&Command::Stop).unwrap();
    assert_eq!((next(), next()), (DRIVE_STOP.to_vec(), ZOOM_STOP.to_vec()));
    head.send(&Command::GoTo { direction: Direction::new(90.0, -30.0), zoom: Some(0.5) }).unwrap();
    assert_eq!(next()[..5], [0x81, 0x01, 0x06, 0x02, 0x18]);
    assert_eq!(next(), [0x81, 0x01, 0x04, 0x47, 0x02, 0x00, 0x00, 0x00, 0xFF]);
    head.send(&Command::TurnBy { by: Direction::new(1.0, 0.0) }).unwrap();
    assert_eq!(next()[3..13], [0x03, 0x18, 0x18, 0, 0, 0, 0x0E, 0, 0, 0]);
    head.send(&Command::Preset { number: 7 }).unwrap();
    assert_eq!(next(), [0x81, 0x01, 0x04, 0x3F, 0x02, 0x07, 0xFF]);
    head.send(&Command::Home).unwrap();
    assert_eq!(next(), [0x81, 0x01, 0x06, 0x04, 0xFF]);
    let position = head.status().unwrap().unwrap().position.unwrap();
    assert_eq!((position.direction, position.zoom), (Direction::new(90.0, -30.0), 0.5));
    next();
    next();
    head.send(&RIGHT).unwrap();
    next();
    drop(head);
    assert_eq!((next(), next()), (DRIVE_STOP.to_vec(), ZOOM_STOP.to_vec()), "it was moving");
    camera.join().unwrap();
}

#[test]
fn a_head_that_stands_is_left_alone_at_the_end() {
    let (port, heard, camera) = tcp(takes);
    let mut head = head(port);
    head.send(&RIGHT).unwrap();
    head.send(&Command::Stop).unwrap();
    drop(head);
    camera.join().unwrap();
    assert_eq!(heard.iter().collect::<Vec<_>>(), [DRIVE_RIGHT, DRIVE_STOP]);
}

#[test]
fn refusals_garbage_silence_and_slow_answers_are_clear_errors_in_time() {
    let refused = |error: u8| {
        let (port, _heard, _camera) = tcp(move |_| vec![0x90, 0x60, error, 0xFF]);
        head(port).send(&RIGHT).unwrap_err()
    };
    assert!(matches!(refused(0x02), PtzError::Refused { reason, .. } if reason.contains("does not know")));
    assert!(matches!(refused(0x41), PtzError::Refused { reason, .. } if reason.contains("cannot do that now")));
    for silence in [Vec::new(), vec![0x55; 3000], vec![0xFF; 3000], vec![0x90, 0x60, 0x04, 0xFF]] {
        let (port, _heard, _camera) = tcp(move |_| silence.clone());
        let mut head = head(port);
        let start = Instant::now();
        assert!(matches!(head.send(&RIGHT), Err(PtzError::TimedOut { .. })));
        assert!(start.elapsed() < Duration::from_secs(5));
    }
    let (port, _heard, _camera) = tcp(|_| b"hang up".to_vec());
    let mut head = head(port);
    assert!(matches!(head.send(&RIGHT), Err(PtzError::Io { .. })));
}

/// A camera on UDP that answers with its header; `lost` datagrams are lost first.
fn udp(lost: usize) -> (u16, Receiver<Vec<u8>>) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = socket.local_addr().unwrap().port();
    socket.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    let (heard, hears) = channel();
    std::thread::spawn(move || {
        let mut buffer = [0; 512];
        let mut lost = lost;
        while let Ok((count, from)) = socket.recv_from(&mut buffer) {
            let got = buffer[..count].to_vec();
            let (header, payload) = got.split_at(8);
            let command = header[0] == 0x01;
            if command && lost > 0 {
                lost -= 1;
                continue;
            }
            if command {
                for said in [vec![0x90, 0x00, 0xFF], takes(payload)[..3].to_vec()] {
                    let mut answer = vec![0x01, 0x11, 0x00, said.len() as u8];
                    answer.extend(&header[4..]);
                    answer.extend(said);
                    socket.send_to(&answer, from).unwrap();
                }
            }
            if heard.send(got).is_err() {
                return;
            }
        }
    });
    (port, hears)
}

#[test]
fn udp_has_a_header_that_counts_and_a_lost_datagram_is_sent_again() {
    let (port, heard) = udp(1);
    let link = connect_udp("127.0.0.1", port).unwrap();
    let timeouts = Timeouts::from_secs(1.0, 2.0).unwrap();
    let mut head = Visca::new("visca://cam", link, params(), timeouts).unwrap();
    let next = || heard.recv_timeout(Duration::from_secs(5)).unwrap();
    assert_eq!(next(), [0x02, 0, 0, 1, 0, 0, 0, 0, 1], "the count is reset");
    head.send(&RIGHT).unwrap();
    let got = next();
    assert_eq!(got[..8], [0x01, 0x00, 0x00, 0x09, 0, 0, 0, 1]);
    assert_eq!(got[8..], *DRIVE_RIGHT);
    head.send(&Command::Stop).unwrap();
    assert_eq!(next()[..8], [0x01, 0x00, 0x00, 0x09, 0, 0, 0, 2]);
}

#[test]
fn nobody_there_is_an_error_in_time() {
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    assert!(matches!(connect_tcp("127.0.0.1", nobody, &quick()), Err(PtzError::Io { .. })));
    let link = connect_udp("127.0.0.1", nobody).unwrap();
    let mut head = Visca::new("visca://cam", link, params(), quick()).unwrap();
    let start = Instant::now();
    assert!(head.send(&RIGHT).is_err());
    assert!(start.elapsed() < Duration::from_secs(5));
}
