use super::{Jitter, MotionParams, SeenAt, TargetBelief, TargetMotion};
use crate::{Direction, Result};

/// The target's motion under several assumptions about by how much longer than assumed commands and pictures take together.
///
/// A filter that corrects the delay itself ([`TargetMotion`]) is right near the truth and may settle far from it, for the head's
/// motion is anything but linear in the delay. So several such filters run side by side, each from another delay, and each
/// is weighed by how likely it made the recent sightings: a static multiple-model estimator (Magill, "Optimal adaptive
/// estimation of sampled stochastic processes", IEEE Transactions on Automatic Control 10, 1965), whose likelihoods are forgotten.
#[derive(Debug, Clone)]
pub struct Lateness {
    members: Vec<Member>,
}

#[derive(Debug, Clone)]
struct Member {
    /// Which delay it began from, seconds.
    from_s: f64,
    motion: TargetMotion,
    log_weight: f64,
    weight: f64,
}

impl Lateness {
    /// How far apart the delays are from which the filters begin, and how many are below and above what is assumed.
    const APART_S: f64 = 0.1;
    const BELOW: i32 = 1;
    const ABOVE: i32 = 5;
    /// For how long a likelihood counts, seconds.
    const MEMORY_S: f64 = 8.0;
    /// Errors of sightings that follow each other are alike: together they count as this part of their number.
    const INDEPENDENT: f64 = 0.3;

    /// A target seen for the first time, `seen` by how much later than assumed.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn new(params: MotionParams, time_s: f64, seen: &dyn Fn(f64) -> SeenAt) -> Result<Self> {
        let members = (-Self::BELOW..=Self::ABOVE).map(|step| {
            let from_s = f64::from(step) * Self::APART_S;
            let motion = TargetMotion::new(params, time_s, &seen(from_s), (from_s, Self::spread_s(&params)))?;
            Ok(Member { from_s, motion, log_weight: Self::prior(&params, from_s), weight: 0.0 })
        });
        let mut lateness = Self { members: members.collect::<Result<_>>()? };
        lateness.weigh();
        Ok(lateness)
    }

    fn spread_s(params: &MotionParams) -> f64 {
        params.timing_s.min(0.5 * Self::APART_S)
    }

    fn prior(params: &MotionParams, late_s: f64) -> f64 {
        -0.5 * (late_s / params.timing_s.max(1e-3)).powi(2)
    }

    /// Another target, seen for the first time: what was learnt of the delays is true of it too.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn renew(&mut self, params: MotionParams, time_s: f64, seen: &dyn Fn(f64) -> SeenAt) -> Result<()> {
        for member in &mut self.members {
            let late = member.motion.late_s();
            let motion = TargetMotion::new(params, time_s, &seen(late.0), late)?;
            member.motion = motion.knowing(*member.motion.jitter());
        }
        Ok(())
    }

    /// All directions are counted from elsewhere: what was at 0 is at `by`.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn shift(&mut self, by: Direction) -> Result<()> {
        self.members.iter_mut().try_for_each(|member| member.motion.shift(by))
    }

    /// What is assumed of commands and pictures together has changed: they take by `by_s` longer than assumed than was believed.
    ///
    /// # Errors
    /// Where the number is not finite.
    pub fn later(&mut self, by_s: f64) -> Result<()> {
        self.members.iter_mut().try_for_each(|member| {
            member.motion.later(by_s)?;
            member.from_s += by_s;
            Ok(())
        })
    }

    /// The target was seen again at `time_s`, `seen` by how much later than assumed and which jitter.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn update(&mut self, params: &MotionParams, time_s: f64, seen: &dyn Fn(&TargetMotion) -> SeenAt) -> Result<()> {
        let keeps = (-(time_s - self.time_s()).max(0.0) / Self::MEMORY_S).exp();
        for member in &mut self.members {
            let likely = member.motion.update(time_s, &seen(&member.motion))?;
            let prior = Self::prior(params, member.from_s);
            member.log_weight = prior + keeps * (member.log_weight - prior) + Self::INDEPENDENT * likely;
        }
        self.weigh();
        Ok(())
    }

    fn weigh(&mut self) {
        let most = self.members.iter().map(|m| m.log_weight).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = self.members.iter().map(|m| (m.log_weight - most).exp()).sum();
        for member in &mut self.members {
            member.weight = (member.log_weight - most).exp() / sum;
        }
    }

    /// When it was seen last, seconds.
    pub fn time_s(&self) -> f64 {
        self.members.first().map_or(0.0, |member| member.motion.time_s())
    }

    /// The most likely of the filters.
    pub fn best(&self) -> Option<&TargetMotion> {
        self.members.iter().max_by(|a, b| a.weight.total_cmp(&b.weight)).map(|member| &member.motion)
    }

    /// What is known of the delay: mean and standard deviation, seconds.
    pub fn late_s(&self) -> (f64, f64) {
        let mean: f64 = self.members.iter().map(|m| m.weight * m.motion.late_s().0).sum();
        let spread = |m: &Member| {
            let (late, sigma) = m.motion.late_s();
            m.weight * (sigma * sigma + (late - mean).powi(2))
        };
        (mean, self.members.iter().map(spread).sum::<f64>().sqrt())
    }

    /// What the most likely filter knows of the jitter.
    pub fn jitter(&self) -> Option<&Jitter> {
        self.best().map(TargetMotion::jitter)
    }

    /// Where the target is so many seconds after `time_s` as commands are late, over all filters by their weight.
    ///
    /// # Errors
    /// Where the time is not finite.
    pub fn at(&self, time_s: &dyn Fn(f64) -> f64) -> Result<TargetBelief> {
        let mut sum = TargetBelief {
            direction: Direction::AHEAD,
            speed_deg_s: Direction::AHEAD,
            sigma_deg: Direction::AHEAD,
            late_s: 0.0,
        };
        for member in self.members.iter().filter(|member| member.weight > 1e-6) {
            let belief = member.motion.at(time_s(member.motion.late_s().0))?;
            let add = |to: &mut Direction, part: Direction| {
                to.pan_deg += member.weight * part.pan_deg;
                to.tilt_deg += member.weight * part.tilt_deg;
            };
            add(&mut sum.direction, belief.direction);
            add(&mut sum.speed_deg_s, belief.speed_deg_s);
            add(&mut sum.sigma_deg, belief.sigma_deg);
            sum.late_s += member.weight * belief.late_s;
        }
        Ok(sum)
    }
}
