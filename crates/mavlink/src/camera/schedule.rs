use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The messages that can be had again and again, by their numbers.
pub(crate) const IMAGE_STATUS: u32 = 275;
pub(crate) const GEO_STATUS: u32 = 276;
pub(crate) const LANDING_TARGET: u32 = 149;
const SETTINGS: u32 = 260;
const CAPTURE_STATUS: u32 = 262;
pub(crate) const FOV_STATUS: u32 = 271;
const ALL: [u32; 6] = [IMAGE_STATUS, GEO_STATUS, LANDING_TARGET, SETTINGS, CAPTURE_STATUS, FOV_STATUS];

/// How often which message is sent.
#[derive(Debug)]
pub(crate) struct Schedule {
    usual: BTreeMap<u32, Duration>,
    asked: BTreeMap<u32, Pace>,
    /// Whether the next word of tracking is not to wait.
    hurry: bool,
}

#[derive(Debug, Clone, Copy)]
struct Pace {
    /// None for never.
    every: Option<Duration>,
    next: Option<Instant>,
}

impl Schedule {
    /// How often tracking is told where nobody says how often.
    const USUAL: Duration = Duration::from_millis(200);

    pub fn new(landing_target: bool) -> Self {
        let mut usual = BTreeMap::from([(IMAGE_STATUS, Self::USUAL)]);
        if landing_target {
            // With every picture: precision landing wants them all.
            usual.insert(LANDING_TARGET, Duration::ZERO);
        }
        let asked = usual.iter().map(|(id, every)| (*id, Pace { every: Some(*every), next: None })).collect();
        Self { usual, asked, hurry: false }
    }

    /// Sets a message's interval in microseconds: −1 for never, 0 for as usual. Whether there is such a message.
    pub fn set(&mut self, id: u32, interval_us: f64) -> bool {
        if !ALL.contains(&id) || !interval_us.is_finite() {
            return false;
        }
        let every = match interval_us {
            never if never < 0.0 => None,
            0.0 => self.usual.get(&id).copied(),
            // A message a millisecond is more than any link takes, one in an hour as good as none.
            us => Some(Duration::from_micros(us.clamp(1e3, 3.6e9) as u64)),
        };
        self.asked.insert(id, Pace { every, next: None });
        true
    }

    /// A message's interval in microseconds: −1 for never; `None` where there is no such message.
    pub fn interval_us(&self, id: u32) -> Option<i32> {
        ALL.contains(&id).then(|| {
            let every = self.asked.get(&id).and_then(|pace| pace.every);
            every.map_or(-1, |every| i32::try_from(every.as_micros()).unwrap_or(i32::MAX))
        })
    }

    /// Something has changed that is not to wait for its turn.
    pub const fn hurry(&mut self) {
        self.hurry = true;
    }

    /// Whether it is a message's turn; if so it is taken.
    pub fn is_due(&mut self, id: u32, now: Instant) -> bool {
        let hurries = id == IMAGE_STATUS && std::mem::take(&mut self.hurry);
        let Some(Pace { every: Some(every), next }) = self.asked.get_mut(&id) else { return false };
        if !hurries && next.is_some_and(|next| now < next) {
            return false;
        }
        // The beat is kept, unless it was missed by more than once.
        let on_beat = next.map(|next| next + *every).filter(|later| *later > now);
        *next = Some(on_beat.unwrap_or(now + *every));
        true
    }

    /// The messages that are not told of tracking alone and whose turn it is.
    pub fn others_due(&mut self, now: Instant) -> Vec<u32> {
        let others = [SETTINGS, CAPTURE_STATUS, FOV_STATUS];
        others.into_iter().filter(|id| self.is_due(*id, now)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often tracking is sent in so many seconds of 25 pictures each.
    fn sent(schedule: &mut Schedule, seconds: u64) -> usize {
        let began = Instant::now();
        (0..25 * seconds).filter(|k| schedule.is_due(IMAGE_STATUS, began + Duration::from_millis(40 * k))).count()
    }

    #[test]
    fn messages_are_sent_as_often_as_asked() {
        let mut schedule = Schedule::new(false);
        assert_eq!(sent(&mut schedule, 10), 50, "the usual rate");
        assert!(schedule.set(IMAGE_STATUS, 1e6));
        assert_eq!((sent(&mut schedule, 10), schedule.interval_us(IMAGE_STATUS)), (10, Some(1_000_000)));
        assert!(schedule.set(IMAGE_STATUS, 1e4));
        assert_eq!(sent(&mut schedule, 10), 250, "not oftener than there are pictures");
        assert!(schedule.set(IMAGE_STATUS, -1.0));
        assert_eq!((sent(&mut schedule, 10), schedule.interval_us(IMAGE_STATUS)), (0, Some(-1)));
        assert!(schedule.set(IMAGE_STATUS, 0.0));
        assert_eq!(sent(&mut schedule, 10), 50);
    }

    #[test]
    fn a_change_does_not_wait() {
        let (mut schedule, now) = (Schedule::new(false), Instant::now());
        assert!(schedule.is_due(IMAGE_STATUS, now) && !schedule.is_due(IMAGE_STATUS, now));
        schedule.hurry();
        assert!(schedule.is_due(IMAGE_STATUS, now) && !schedule.is_due(IMAGE_STATUS, now));
        schedule.set(IMAGE_STATUS, -1.0);
        schedule.hurry();
        assert!(!schedule.is_due(IMAGE_STATUS, now), "who wants nothing gets nothing");
    }

    #[test]
    fn there_are_only_these_messages() {
        let mut schedule = Schedule::new(true);
        assert!(!schedule.set(24, 1e6) && !schedule.set(IMAGE_STATUS, f64::NAN));
        assert_eq!((schedule.interval_us(24), schedule.interval_us(GEO_STATUS)), (None, Some(-1)));
        assert_eq!(schedule.interval_us(LANDING_TARGET), Some(0));
        assert!(schedule.set(FOV_STATUS, 1e6));
        assert_eq!(schedule.others_due(Instant::now()), [FOV_STATUS]);
    }
}
