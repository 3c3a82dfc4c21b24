use crate::{Direction, Velocity};

/// One command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    address: u8,
    command: [u8; 2],
    data: [u8; 2],
}

impl Frame {
    const RIGHT: u8 = 0x02;
    const LEFT: u8 = 0x04;
    const UP: u8 = 0x08;
    const DOWN: u8 = 0x10;
    const TELE: u8 = 0x20;
    const WIDE: u8 = 0x40;
    /// The greatest speed of the tables but for "turbo".
    const TOP_SPEED: f64 = 63.0;

    const fn extended(address: u8, command: u8, data: u16) -> Self {
        Self { address, command: [0, command], data: data.to_be_bytes() }
    }

    /// Stops everything.
    pub const fn stop(address: u8) -> Self {
        Self::extended(address, 0, 0)
    }

    /// Moves; speeds are steps of `max_deg_s / 63`, at least one where anything shall move. The zoom has one speed.
    pub fn motion(address: u8, velocity: &Velocity, max_deg_s: (f64, f64)) -> Self {
        let speed = |deg_s: f64, top: f64| {
            let steps = (deg_s.abs() / top * Self::TOP_SPEED).round().clamp(0.0, Self::TOP_SPEED);
            if deg_s == 0.0 { 0 } else { (steps as u8).max(1) }
        };
        let towards = |value: f64, positive: u8, negative: u8| match value {
            v if v > 0.0 => positive,
            v if v < 0.0 => negative,
            _ => 0,
        };
        let bits = towards(velocity.pan_deg_s, Self::RIGHT, Self::LEFT)
            | towards(velocity.tilt_deg_s, Self::UP, Self::DOWN)
            | towards(velocity.zoom_per_s, Self::TELE, Self::WIDE);
        let data = [speed(velocity.pan_deg_s, max_deg_s.0), speed(velocity.tilt_deg_s, max_deg_s.1)];
        Self { address, command: [0, bits], data }
    }

    /// Goes to a stored position.
    pub const fn preset(address: u8, number: u8) -> Self {
        Self::extended(address, 0x07, number as u16)
    }

    /// Goes to a pan, hundredths of a degree clockwise from 0 to 35 999.
    pub fn pan_to(address: u8, direction: Direction) -> Self {
        Self::extended(address, 0x4B, hundredths(direction.pan_deg))
    }

    /// Goes to a tilt, hundredths of a degree downward from the horizon, 0 to 35 999.
    pub fn tilt_to(address: u8, direction: Direction) -> Self {
        Self::extended(address, 0x4D, hundredths(-direction.tilt_deg))
    }

    /// Goes to a zoom, 0 to 65 535.
    pub fn zoom_to(address: u8, zoom: f64) -> Self {
        Self::extended(address, 0x4F, (zoom.clamp(0.0, 1.0) * 65_535.0).round() as u16)
    }

    /// Asks for the pan, the tilt and the zoom.
    pub const fn queries(address: u8) -> [Self; 3] {
        [Self::extended(address, 0x51, 0), Self::extended(address, 0x53, 0), Self::extended(address, 0x55, 0)]
    }

    /// The seven bytes.
    pub const fn bytes(&self) -> [u8; 7] {
        let [first, second] = self.command;
        let [high, low] = self.data;
        let sum = self.address.wrapping_add(first).wrapping_add(second).wrapping_add(high).wrapping_add(low);
        [0xFF, self.address, first, second, high, low, sum]
    }
}

/// An angle as the tables have it.
fn hundredths(angle_deg: f64) -> u16 {
    ((angle_deg.rem_euclid(360.0) * 100.0).round() as u32 % 36_000) as u16
}

/// What a head answers to a query.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reply {
    /// Its pan, degrees to the right, in (−180, 180].
    Pan(f64),
    /// Its tilt, degrees upward, in (−180, 180].
    Tilt(f64),
    /// Its zoom, 0 to 1.
    Zoom(f64),
}

/// The answers in what came over the line from a head of this address, in order. What is no whole, sound answer is passed
/// over, byte by byte: lines are noisy.
pub fn parse_replies(address: u8, bytes: &[u8]) -> Vec<Reply> {
    let mut replies = Vec::new();
    let mut rest = bytes;
    while let Some(window) = rest.first_chunk::<7>() {
        match parse(address, window) {
            Some(reply) => {
                replies.extend(reply);
                rest = rest.get(7..).unwrap_or_default();
            }
            None => rest = rest.get(1..).unwrap_or_default(),
        }
    }
    replies
}

/// `None`: no frame; `Some(None)`: a frame that answers nothing that was asked.
fn parse(address: u8, bytes: &[u8; 7]) -> Option<Option<Reply>> {
    let [sync, from, first, second, high, low, _] = *bytes;
    let frame = Frame { address: from, command: [first, second], data: [high, low] };
    if sync != 0xFF || from != address || frame.bytes() != *bytes {
        return None;
    }
    let value = f64::from(u16::from_be_bytes([high, low]));
    let angle = |hundredths: f64| if hundredths > 18_000.0 { hundredths / 100.0 - 360.0 } else { hundredths / 100.0 };
    Some(match second {
        0x59 if value < 36_000.0 => Some(Reply::Pan(angle(value))),
        0x5B if value < 36_000.0 => Some(Reply::Tilt(-angle(value))),
        0x5D => Some(Reply::Zoom(value / 65_535.0)),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(pan: f64, tilt: f64, zoom: f64) -> [u8; 7] {
        let velocity = Velocity { pan_deg_s: pan, tilt_deg_s: tilt, zoom_per_s: zoom };
        Frame::motion(1, &velocity, (63.0, 63.0)).bytes()
    }

    /// The published tables, with speeds filled in.
    #[test]
    fn bytes_are_those_of_the_published_tables() {
        assert_eq!(motion(32.0, 0.0, 0.0), [0xFF, 0x01, 0x00, 0x02, 0x20, 0x00, 0x23], "right");
        assert_eq!(motion(-32.0, 0.0, 0.0), [0xFF, 0x01, 0x00, 0x04, 0x20, 0x00, 0x25], "left");
        assert_eq!(motion(0.0, 32.0, 0.0), [0xFF, 0x01, 0x00, 0x08, 0x00, 0x20, 0x29], "up");
        assert_eq!(motion(0.0, -32.0, 0.0), [0xFF, 0x01, 0x00, 0x10, 0x00, 0x20, 0x31], "down");
        assert_eq!(motion(-1.0, 63.0, 0.0), [0xFF, 0x01, 0x00, 0x0C, 0x01, 0x3F, 0x4D], "up left");
        assert_eq!(motion(99.0, -99.0, 0.0), [0xFF, 0x01, 0x00, 0x12, 0x3F, 0x3F, 0x91], "down right, at most");
        assert_eq!(motion(0.0, 0.0, 0.2), [0xFF, 0x01, 0x00, 0x20, 0x00, 0x00, 0x21], "in");
        assert_eq!(motion(0.0, 0.0, -0.2), [0xFF, 0x01, 0x00, 0x40, 0x00, 0x00, 0x41], "out");
        assert_eq!(motion(0.01, 0.0, 0.0)[4], 1, "slowest, but not none");
        assert_eq!(motion(0.0, 0.0, 0.0), Frame::stop(1).bytes());
        assert_eq!(Frame::stop(1).bytes(), [0xFF, 0x01, 0x00, 0x00, 0x00, 0x00, 0x01]);
        assert_eq!(Frame::preset(2, 5).bytes(), [0xFF, 0x02, 0x00, 0x07, 0x00, 0x05, 0x0E]);
        assert_eq!(Frame::queries(1).map(|f| f.bytes()[3]), [0x51, 0x53, 0x55]);
        let to = Direction::new(-90.0, -45.0);
        assert_eq!(Frame::pan_to(1, to).bytes(), [0xFF, 0x01, 0x00, 0x4B, 0x69, 0x78, 0x2D]); // 27 000
        assert_eq!(Frame::tilt_to(1, to).bytes(), [0xFF, 0x01, 0x00, 0x4D, 0x11, 0x94, 0xF3]); // 4 500
        assert_eq!(Frame::zoom_to(1, 1.0).bytes(), [0xFF, 0x01, 0x00, 0x4F, 0xFF, 0xFF, 0x4E]);
        assert_eq!(Frame::pan_to(1, Direction::new(359.999, 0.0)).bytes()[4..6], [0, 0]);
    }

    /// An implementation that is not ours.
    #[test]
    fn bytes_are_those_of_another_implementation() {
        use pelcodrs::{Direction as Towards, MessageBuilder, Speed};
        for (velocity, towards) in [
            ((40.0, 0.0), Towards::RIGHT),
            ((-40.0, 0.0), Towards::LEFT),
            ((0.0, 20.0), Towards::UP),
            ((-40.0, -20.0), Towards::DOWN | Towards::LEFT),
        ] {
            let (pan, tilt) = velocity;
            let mut builder = MessageBuilder::new(9);
            builder.direction(towards);
            if pan != 0.0 {
                builder.pan(Speed::Range(f64::abs(pan) as f32 / 63.0));
            }
            if tilt != 0.0 {
                builder.tilt(Speed::Range(f64::abs(tilt) as f32 / 63.0));
            }
            let theirs = builder.finalize().unwrap();
            let velocity = Velocity { pan_deg_s: pan, tilt_deg_s: tilt, zoom_per_s: 0.0 };
            let ours = Frame::motion(9, &velocity, (63.0, 63.0)).bytes();
            assert_eq!(ours.as_slice(), AsRef::<[u8]>::as_ref(&theirs));
        }
    }

    #[test]
    fn answers_are_read_among_noise() {
        let answer = |command, value: u16| Frame::extended(1, command, value).bytes().to_vec();
        let mut line = vec![0xFF, 0x01, 0xAA, 0x00];
        line.extend(answer(0x59, 27_000));
        line.push(0xAA);
        line.extend(answer(0x5B, 4_500));
        line.extend(answer(0x5D, 65_535));
        line.extend([0xFF, 0x01, 0x00, 0x59, 0x00, 0x64, 0x00]); // a wrong sum
        line.extend(answer(0x59, 40_000)); // no angle
        line.extend(Frame::extended(2, 0x59, 100).bytes()); // another head
        line.extend(&answer(0x59, 100)[..6]); // cut off
        assert_eq!(parse_replies(1, &line), [Reply::Pan(-90.0), Reply::Tilt(-45.0), Reply::Zoom(1.0)]);
        assert_eq!(parse_replies(1, &[]), []);
    }
}
