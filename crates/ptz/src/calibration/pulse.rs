/// How the picture shifted from one frame to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// The time stamp of the later frame, seconds.
    pub stamp_s: f64,
    /// By how many pixels what is seen went to the right. A head that pans to the right shifts the picture to the left.
    pub right_px: f64,
    /// By how many pixels what is seen went down. A head that tilts upward shifts the picture down.
    pub down_px: f64,
}

/// What one pulse of speed did: the head was told to move at a speed, and a while later to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Answer {
    /// The whole displacement in pixels; its sign is that of the commanded speed unless the axis is reversed.
    pub way_px: f64,
    /// The steady speed, pixels per second.
    pub speed_px_s: f64,
    /// When the straight line of steady motion leaves the start, seconds after the command: the delay, and half the ramp.
    pub onset_s: f64,
    /// The middle of that line: seconds after the command, and pixels gone.
    pub middle: (f64, f64),
    /// How much the stamps of the frames in steady motion vary about that line, seconds².
    pub scatter_s2: f64,
    /// How many frames those are.
    pub frames: usize,
}

/// The way over time in pixels, in the direction of the pulse, of one pulse.
#[derive(Debug, Clone, Default)]
pub(super) struct Record {
    /// Seconds after the command; pixels gone since.
    points: Vec<(f64, f64)>,
}

impl Record {
    /// The most points kept.
    const MOST: usize = 4096;

    pub fn push(&mut self, after_s: f64, step_px: f64) {
        let before = self.points.last().map_or(0.0, |(_, way)| *way);
        if self.points.len() < Self::MOST && after_s.is_finite() && step_px.is_finite() {
            self.points.push((after_s, before + step_px));
        }
    }

    /// Whether nothing moved for the last `seconds`: by less than `still_px` a frame.
    pub fn rests(&self, seconds: f64, still_px: f64) -> bool {
        let Some(&(last, _)) = self.points.last() else { return false };
        let recent = self.points.iter().zip(self.points.iter().skip(1)).filter(|(_, (time, _))| *time > last - seconds);
        let mut count = 0;
        let moved = recent.inspect(|_| count += 1).any(|((_, a), (_, b))| (b - a).abs() > still_px);
        count >= 3 && !moved
    }

    /// What the pulse did; `None` where too little was seen of it. The steady part is taken between 35 % and 65 % of the
    /// way.
    pub fn answer(&self) -> Option<Answer> {
        let way = self.points.last()?.1;
        let sign = way.signum();
        let part = |p: f64| 0.35 * way.abs() <= p * sign && p * sign <= 0.65 * way.abs();
        let steady: Vec<(f64, f64)> = self.points.iter().copied().filter(|(_, p)| part(*p)).collect();
        let count = steady.len() as f64;
        if steady.len() < 3 {
            return None;
        }
        let mean = |of: fn(&(f64, f64)) -> f64| steady.iter().map(of).sum::<f64>() / count;
        let (time, place) = (mean(|p| p.0), mean(|p| p.1));
        let covariance: f64 = steady.iter().map(|(t, p)| (t - time) * (p - place)).sum();
        let variance: f64 = steady.iter().map(|(t, _)| (t - time).powi(2)).sum();
        let speed = covariance / variance;
        // Which frames are steady is told by their place, so that it is their time that errs.
        let spread: f64 = steady.iter().map(|(_, p)| (p - place).powi(2)).sum();
        let off = |(t, p): &(f64, f64)| (t - time) - covariance / spread * (p - place);
        let scatter_s2 = steady.iter().map(|point| off(point).powi(2)).sum::<f64>() / (count - 2.0);
        (variance > 0.0 && speed * sign > 0.0).then(|| Answer {
            way_px: way,
            speed_px_s: speed,
            onset_s: time - place / speed,
            middle: (time, place),
            scatter_s2,
            frames: steady.len(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pulse of 1 s at 100 px/s with ramps of 0.1 s, seen 0.3 s late at 50 Hz.
    fn record(sign: f64) -> Record {
        let way = |t: f64| {
            let t = t - 0.3;
            let ramp = |t: f64| {
                if t <= 0.0 {
                    0.0
                } else if t < 0.1 {
                    500.0 * t * t
                } else {
                    100.0 * t - 5.0
                }
            };
            ramp(t) - ramp(t - 1.0)
        };
        let mut record = Record::default();
        for k in 0..120 {
            let t = f64::from(k) * 0.02;
            record.push(t, sign * (way(t) - way(t - 0.02)));
        }
        record
    }

    #[test]
    fn a_pulse_is_understood() {
        for sign in [1.0, -1.0] {
            let answer = record(sign).answer().unwrap();
            assert!((answer.way_px - sign * 100.0).abs() < 1e-9);
            assert!((answer.speed_px_s - sign * 100.0).abs() < 1e-6);
            assert!((answer.onset_s - 0.35).abs() < 1e-6, "the delay and half the ramp");
            assert!(answer.scatter_s2 < 1e-12 && answer.frames > 10);
        }
    }

    #[test]
    fn rest_is_seen() {
        assert!(record(1.0).rests(0.5, 0.1));
        assert!(!record(1.0).rests(1.5, 0.1));
        let mut short = Record::default();
        assert!(!short.rests(0.5, 0.1));
        short.push(0.0, 0.0);
        short.push(0.02, 0.0);
        assert!(!short.rests(0.5, 0.1), "too little to tell");
    }

    #[test]
    fn too_little_gives_no_answer() {
        assert_eq!(Record::default().answer(), None);
        let mut noise = Record::default();
        for step in [0.1, -0.1, 0.1, f64::NAN, -0.1] {
            noise.push(0.0, step);
        }
        assert_eq!(noise.answer(), None);
        assert_eq!(noise.points.len(), 4);
    }
}
