use std::collections::BTreeMap;

/// The most pictures that may have to wait for their turn (ITU-T H.264 §A.3.1).
const MOST_WAITING: usize = 16;

/// Puts pictures that come in decoding order into the order of their times.
///
/// How many have to wait, a stream need not say; most cameras send them in order. So none waits until one comes too
/// late: it is left out, and from then on one more waits.
pub(super) struct Reorder<T> {
    waiting: BTreeMap<i64, T>,
    depth: usize,
    /// The time of the last that came out.
    last: Option<i64>,
}

impl<T> Default for Reorder<T> {
    fn default() -> Self {
        Self { waiting: BTreeMap::new(), depth: 0, last: None }
    }
}

/// A time this much before the last, in units of a 90 kHz clock, is of a clock set anew: no picture is that late.
const RESET: i64 = 90_000;

impl<T> Reorder<T> {
    pub fn push(&mut self, time: i64, picture: T) {
        match self.last {
            Some(last) if time <= last && last - time < RESET => self.depth = (self.depth + 1).min(MOST_WAITING),
            Some(last) if time <= last => {
                self.last = None;
                self.waiting.clear();
                self.waiting.insert(time, picture);
            }
            _ => _ = self.waiting.insert(time, picture),
        }
    }

    /// The next picture whose turn has come.
    pub fn pop(&mut self) -> Option<(i64, T)> {
        if self.waiting.len() <= self.depth {
            return None;
        }
        let next = self.waiting.pop_first();
        self.last = next.as_ref().map(|(time, _)| *time);
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes out, each time as soon as it can.
    fn shown(times: &[i64]) -> Vec<i64> {
        let mut reorder = Reorder::default();
        let mut out = Vec::new();
        for &time in times {
            reorder.push(time, ());
            out.extend(std::iter::from_fn(|| reorder.pop()).map(|(time, ())| time));
        }
        out
    }

    #[test]
    fn what_comes_in_order_does_not_wait() {
        assert_eq!(shown(&[0, 1, 2, 3]), [0, 1, 2, 3]);
    }

    #[test]
    fn what_comes_late_makes_one_more_wait() {
        // I P B B P B B: both B come before their P from the second on.
        assert_eq!(shown(&[0, 3, 1, 2, 6, 4, 5, 9, 7, 8, 12]), [0, 3, 4, 5, 6, 7, 8]);
    }

    #[test]
    fn a_clock_set_anew_begins_anew() {
        assert_eq!(shown(&[500_000, 500_001, 0, 1, 2]), [500_000, 500_001, 0, 1, 2]);
    }
}
