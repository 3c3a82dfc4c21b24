/// Something that is or is not so, and is believed only when it has been so for a while: what shakes does not flap.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Switch {
    /// What is believed, and since when, seconds.
    is_on: bool,
    since_s: f64,
    /// When it was first so, without having been otherwise since, while it is not believed; while it is, when it was so last.
    turning_s: Option<f64>,
}

impl Switch {
    pub const fn is_on(&self) -> bool {
        self.is_on
    }

    /// For how long it has been as believed.
    pub fn lasted_s(&self, now: f64) -> f64 {
        (now - self.since_s).max(0.0)
    }

    /// For how long it was so, until it was so last: what is waited for before that is believed to be over is no part of it.
    pub fn held_s(&self) -> f64 {
        self.turning_s.map_or(0.0, |last| (last - self.since_s).max(0.0))
    }

    /// It is so or not at `now`; true when that turns the belief: when it has been so for `on_s`, or not for `off_s`.
    pub fn turn(&mut self, is_so: bool, now: f64, [on_s, off_s]: [f64; 2]) -> bool {
        match (self.is_on, is_so) {
            (false, false) => self.turning_s = None,
            (true, true) => self.turning_s = Some(now),
            (true, false) | (false, true) => {}
        }
        if is_so == self.is_on {
            return false;
        }
        let began = *self.turning_s.get_or_insert(now);
        // A clock that was set back begins anew.
        if now < began {
            self.turning_s = Some(now);
        }
        if now - began < if is_so { on_s } else { off_s } {
            return false;
        }
        *self = Self { is_on: is_so, since_s: began, turning_s: is_so.then_some(now) };
        true
    }

    /// Turns it at once.
    pub const fn turn_off(&mut self, now: f64) {
        *self = Self { is_on: false, since_s: now, turning_s: None };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_shakes_does_not_flap() {
        let mut switch = Switch::default();
        let turns = (0..200).filter(|n| switch.turn(n % 2 == 0, f64::from(*n) * 0.04, [0.2, 0.5])).count();
        assert_eq!(turns, 0);
    }

    #[test]
    fn what_lasts_is_believed_from_its_beginning_on() {
        let mut switch = Switch::default();
        let turned: Vec<i32> =
            (0..50).filter(|n| switch.turn((10..30).contains(n), f64::from(*n), [3.0, 5.0])).collect();
        assert_eq!(turned, [13, 34]);
        let mut switch = Switch::default();
        assert!(switch.turn(true, 4.0, [0.0, 1.0]), "what needs no time turns at once");
        assert_eq!((switch.is_on(), switch.lasted_s(6.0)), (true, 2.0));
        switch.turn(true, 5.0, [0.0, 1.0]);
        switch.turn(false, 5.5, [0.0, 1.0]);
        assert_eq!((switch.is_on(), switch.held_s()), (true, 1.0), "it was so last a second after it began");
    }
}
