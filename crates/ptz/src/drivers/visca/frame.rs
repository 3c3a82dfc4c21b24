use crate::{Direction, Velocity};

/// The end of every message.
pub(super) const END: u8 = 0xFF;
/// The longest message of the lists, bytes.
const LONGEST: usize = 16;

/// A message to the camera: what lies between the address and the end.
pub(super) fn message(address: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(body.len() + 2);
    bytes.push(0x80 | (address & 0x07));
    bytes.extend_from_slice(body);
    bytes.push(END);
    bytes
}

/// Pan-tilt drive: steps of speed with signs, to the right and upward; 0 stops an axis.
pub(super) fn drive(pan: i8, tilt: i8) -> [u8; 7] {
    let towards = |step: i8, positive: u8, negative: u8| match step.signum() {
        1 => positive,
        -1 => negative,
        _ => 0x03,
    };
    let [pan_speed, tilt_speed] = [pan, tilt].map(|step| step.unsigned_abs().max(1));
    [0x01, 0x06, 0x01, pan_speed, tilt_speed, towards(pan, 0x02, 0x01), towards(tilt, 0x01, 0x02)]
}

/// Zoom drive: −8 (fast, wide) to 8 (fast, tele); 0 stops.
pub(super) const fn zoom_drive(step: i8) -> [u8; 4] {
    let speed = step.unsigned_abs().saturating_sub(1);
    let speed = if speed > 7 { 7 } else { speed };
    let way = match step {
        1.. => 0x20 | speed,
        0 => 0x00,
        _ => 0x30 | speed,
    };
    [0x01, 0x04, 0x07, way]
}

/// Which step of the zoom drive is meant by a zoom velocity whose greatest is `top`.
pub(super) fn zoom_step(velocity: &Velocity, top: f64) -> i8 {
    let steps = (velocity.zoom_per_s.abs() / top * 8.0).round().clamp(1.0, 8.0) as i8;
    match velocity.zoom_per_s {
        v if v > 0.0 => steps,
        v if v < 0.0 => -steps,
        _ => 0,
    }
}

/// A 16-bit number in four half bytes.
pub(super) fn nibbles(value: i16) -> [u8; 4] {
    let value = value as u16;
    [12, 8, 4, 0].map(|shift| ((value >> shift) & 0x0F) as u8)
}

/// The number in four half bytes.
fn from_nibbles(bytes: &[u8]) -> Option<u16> {
    if bytes.len() != 4 || bytes.iter().any(|&byte| byte > 0x0F) {
        return None;
    }
    Some(bytes.iter().fold(0, |value, &byte| (value << 4) | u16::from(byte)))
}

/// Absolute (`0x02`) or relative (`0x03`) position, at these speeds.
pub(super) fn position(kind: u8, speeds: (u8, u8), angles: Direction, units_per_deg: f64) -> [u8; 13] {
    let units = |deg: f64| (deg * units_per_deg).round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16;
    let mut body = [0x01, 0x06, kind, speeds.0, speeds.1, 0, 0, 0, 0, 0, 0, 0, 0];
    let [pan, tilt] = [units(angles.pan_deg), units(angles.tilt_deg)].map(nibbles);
    for (slot, nibble) in body.iter_mut().skip(5).zip(pan.into_iter().chain(tilt)) {
        *slot = nibble;
    }
    body
}

/// Zoom position, `0` to `top`.
pub(super) fn zoom_to(zoom: f64, top: u16) -> [u8; 7] {
    let units = (zoom.clamp(0.0, 1.0) * f64::from(top)).round() as u16;
    let [p, q, r, s] = nibbles(units as i16);
    [0x01, 0x04, 0x47, p, q, r, s]
}

/// What a camera answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// It takes the command.
    Acknowledged,
    /// It has carried out a command.
    Completed,
    /// The answer to an inquiry, without frame.
    Information(Vec<u8>),
    /// It does not carry out a command: the error's number.
    Error(u8),
}

impl Reply {
    /// Pan and tilt of a position answer.
    pub fn position(&self, units_per_deg: f64) -> Option<Direction> {
        let Self::Information(bytes) = self else { return None };
        let (pan, tilt) = bytes.split_at_checked(4)?;
        let degrees = |value: u16| f64::from(value as i16) / units_per_deg;
        Some(Direction::new(degrees(from_nibbles(pan)?), degrees(from_nibbles(tilt)?)))
    }

    /// The zoom of a zoom answer, 0 to 1.
    pub fn zoom(&self, top: u16) -> Option<f64> {
        let Self::Information(bytes) = self else { return None };
        Some((f64::from(from_nibbles(bytes)?) / f64::from(top.max(1))).clamp(0.0, 1.0))
    }
}

/// What an error's number means.
pub(super) const fn meaning(error: u8) -> &'static str {
    match error {
        0x01 => "the message is too long",
        0x02 => "it does not know the command",
        0x03 => "it has too many commands to carry out",
        0x04 => "the command was cancelled",
        0x05 => "there is nothing to cancel",
        0x41 => "it cannot do that now",
        _ => "an error that the command lists do not name",
    }
}

/// Reads one message of a camera, from its address to its end; `None` where it is none.
pub fn parse_reply(message: &[u8]) -> Option<Reply> {
    let [from, kind, body @ .., END] = message else { return None };
    if from & 0x8F != 0x80 || *from == 0x80 {
        return None;
    }
    match (kind >> 4, body) {
        (0x4, []) => Some(Reply::Acknowledged),
        (0x5, []) => Some(Reply::Completed),
        (0x5, body) => Some(Reply::Information(body.to_vec())),
        (0x6, [error]) => Some(Reply::Error(*error)),
        _ => None,
    }
}

/// Cuts a stream of bytes into messages. Bytes that belong to none are dropped; it never keeps more than one message.
#[derive(Debug, Clone, Default)]
pub struct Splitter {
    kept: Vec<u8>,
    overlong: bool,
}

impl Splitter {
    /// Takes one byte; gives the answer that it ends.
    pub fn take(&mut self, byte: u8) -> Option<Reply> {
        if byte != END {
            self.overlong |= self.kept.len() >= LONGEST;
            if !self.overlong {
                self.kept.push(byte);
            }
            return None;
        }
        self.kept.push(END);
        let reply = if self.overlong { None } else { parse_reply(&self.kept) };
        self.kept.clear();
        self.overlong = false;
        reply
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published command lists, with speeds and positions filled in.
    #[test]
    fn bytes_are_those_of_the_published_lists() {
        let sent = |body: &[u8]| message(1, body);
        assert_eq!(sent(&drive(0, 5)), [0x81, 0x01, 0x06, 0x01, 0x01, 0x05, 0x03, 0x01, 0xFF], "up");
        assert_eq!(sent(&drive(0, -5)), [0x81, 0x01, 0x06, 0x01, 0x01, 0x05, 0x03, 0x02, 0xFF], "down");
        assert_eq!(sent(&drive(-24, 0)), [0x81, 0x01, 0x06, 0x01, 0x18, 0x01, 0x01, 0x03, 0xFF], "left");
        assert_eq!(sent(&drive(24, 0)), [0x81, 0x01, 0x06, 0x01, 0x18, 0x01, 0x02, 0x03, 0xFF], "right");
        assert_eq!(sent(&drive(-1, 2)), [0x81, 0x01, 0x06, 0x01, 0x01, 0x02, 0x01, 0x01, 0xFF], "up left");
        assert_eq!(sent(&drive(1, -2)), [0x81, 0x01, 0x06, 0x01, 0x01, 0x02, 0x02, 0x02, 0xFF], "down right");
        assert_eq!(sent(&drive(0, 0)), [0x81, 0x01, 0x06, 0x01, 0x01, 0x01, 0x03, 0x03, 0xFF], "stop");
        assert_eq!(sent(&zoom_drive(0)), [0x81, 0x01, 0x04, 0x07, 0x00, 0xFF]);
        assert_eq!(sent(&zoom_drive(8)), [0x81, 0x01, 0x04, 0x07, 0x27, 0xFF]);
        assert_eq!(sent(&zoom_drive(-1)), [0x81, 0x01, 0x04, 0x07, 0x30, 0xFF]);
        assert_eq!(zoom_drive(127)[3], 0x27);
        // 90° are 0x0510 and −30° are 0xFE50 in the makers' tables of angles, at 14.4 units a degree.
        let to = position(0x02, (0x18, 0x14), Direction::new(90.0, -30.0), 14.4);
        assert_eq!(
            sent(&to),
            [0x81, 0x01, 0x06, 0x02, 0x18, 0x14, 0x00, 0x05, 0x01, 0x00, 0x0F, 0x0E, 0x05, 0x00, 0xFF]
        );
        assert_eq!(position(0x03, (1, 1), Direction::new(1e9, 0.0), 14.4)[5..9], [0x07, 0x0F, 0x0F, 0x0F]);
        assert_eq!(zoom_to(1.0, 0x4000), [0x01, 0x04, 0x47, 0x04, 0x00, 0x00, 0x00]);
        assert_eq!(message(7, &[])[0], 0x87);
    }

    #[test]
    fn zoom_velocities_are_steps() {
        let step = |zoom_per_s| zoom_step(&Velocity { zoom_per_s, ..Velocity::ZERO }, 0.4);
        assert_eq!([step(0.4), step(0.2), step(0.0), step(-0.001), step(-9.0)], [8, 4, 0, -1, -8]);
    }

    #[test]
    fn answers_are_read() {
        assert_eq!(parse_reply(&[0x90, 0x41, 0xFF]), Some(Reply::Acknowledged));
        assert_eq!(parse_reply(&[0x90, 0x52, 0xFF]), Some(Reply::Completed));
        assert_eq!(parse_reply(&[0x90, 0x60, 0x02, 0xFF]), Some(Reply::Error(2)));
        assert_eq!(parse_reply(&[0xA0, 0x61, 0x41, 0xFF]), Some(Reply::Error(0x41)));
        let at = parse_reply(&[0x90, 0x50, 0, 5, 1, 0, 0xF, 0xE, 5, 0, 0xFF]).unwrap();
        assert_eq!(at.position(14.4), Some(Direction::new(90.0, -30.0)));
        assert_eq!(at.zoom(0x4000), None);
        let zoom = parse_reply(&[0x90, 0x50, 2, 0, 0, 0, 0xFF]).unwrap();
        assert_eq!((zoom.zoom(0x4000), zoom.position(14.4)), (Some(0.5), None));
        assert_eq!(Reply::Information(vec![0, 5, 1, 0, 0x1F, 0xE, 5, 0]).position(14.4), None, "no half byte");
        for bad in [
            &[][..],
            &[0xFF],
            &[0x90, 0xFF],
            &[0x81, 0x41, 0xFF],
            &[0x80, 0x41, 0xFF],
            &[0x90, 0x60, 0xFF],
            &[0x90, 0x41],
        ] {
            assert_eq!(parse_reply(bad), None, "{bad:?}");
        }
        assert!([1, 2, 3, 4, 5, 0x41].map(meaning).iter().all(|m| *m != meaning(0x77)));
    }

    #[test]
    fn streams_are_cut_into_messages() {
        let mut splitter = Splitter::default();
        let mut noise = vec![0x12; 5000];
        noise.extend([0xFF, 0xFF, 0x90, 0x41, 0xFF, 0x90, 0x51, 0xFF, 0x90]);
        let got: Vec<Reply> = noise.into_iter().filter_map(|byte| splitter.take(byte)).collect();
        assert_eq!(got, [Reply::Acknowledged, Reply::Completed]);
        assert!(splitter.kept.len() <= LONGEST + 1);
    }
}
