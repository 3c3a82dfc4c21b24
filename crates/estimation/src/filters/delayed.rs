//! Measurements that arrive late: exactly, within the last step, without going back; or by replay over a history.

use std::collections::VecDeque;

use nalgebra::SVector;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::{require, require_time_step};
use crate::matrix::{cholesky, require_finite, sandwich, times_transpose};
use crate::{EstimationError, Gaussian, Innovation, LinearMeasurement, MotionModel, Result, Transition};

/// What a filter must remember of its last update to take in a measurement from before it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LastUpdate<const M: usize, const N: usize> {
    /// The belief before the last update.
    pub prior: Gaussian<N>,
    /// The sensor of the last update.
    pub measurement: LinearMeasurement<M, N>,
    /// What [`Gaussian::update`] returned.
    pub innovation: Innovation<M>,
}

impl<const N: usize> Gaussian<N> {
    /// Corrects the belief by a measurement taken **before** the last update but after the one before that: algorithm
    /// A1 of Bar-Shalom (IEEE Trans. AES 38, 2002), which equals filtering in the right order.
    ///
    /// `since` is the transition from the time of the late measurement to now, with its process noise.
    ///
    /// # Errors
    /// Where a number is not finite, `since` has no inverse or an innovation is singular; the belief is then as it was.
    pub fn update_delayed<const M: usize, const L: usize>(
        &mut self,
        last: &LastUpdate<L, N>,
        since: &Transition<N>,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<Innovation<M>> {
        let back = since
            .matrix()
            .try_inverse()
            .ok_or(EstimationError::NotInvertible { what: "the transition since the late measurement" })?;
        let noise = since.noise();
        let old = last.measurement.matrix();
        // Hᵀ S⁻¹ of the last update, and what it said of the process noise since the late measurement.
        let weigh = last.innovation.divide(&old.transpose());
        let told = weigh * last.innovation.residual();
        let noise_cross = noise * weigh * old * noise; // Q Hᵀ S⁻¹ H Q
        let state_cross = noise - last.prior.covariance() * weigh * old * noise;
        let at_then_mean = back * (self.mean() - noise * told - since.offset());
        let spread = self.covariance() + (noise - noise_cross) - state_cross - state_cross.transpose();
        let then = Gaussian::computed(at_then_mean, sandwich(&back, &spread))?;
        let innovation = then.innovation(measurement, value)?;
        // P_xz = (P − P_xv) F⁻ᵀ Hᵀ
        let cross = times_transpose(&((self.covariance() - state_cross) * back.transpose()), measurement.matrix());
        let gain = innovation.divide(&cross);
        let covariance = self.covariance() - sandwich(&gain, &innovation.covariance());
        let corrected = Self::computed(self.mean() + gain * innovation.residual(), covariance)?;
        // A difference, unlike the Joseph form, can lose definiteness to rounding.
        cholesky(corrected.covariance()).map_err(|(row, pivot)| EstimationError::NotPositive {
            what: "the corrected covariance",
            requirement: "positive definite",
            row,
            pivot,
        })?;
        *self = corrected;
        Ok(innovation)
    }
}

/// One measurement in time order, with the belief after it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Entry<const M: usize, const N: usize> {
    time_s: f64,
    reading: Option<(LinearMeasurement<M, N>, SVector<f64, M>)>,
    belief: Gaussian<N>,
}

/// A filter that takes measurements in any order: it keeps the last few and goes over them again when one comes late.
///
/// Exact for any lag inside the history. The history is allocated once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Replay", bound = "Model: Serialize + DeserializeOwned")]
pub struct Replay<Model, const M: usize, const N: usize> {
    model: Model,
    depth: usize,
    entries: VecDeque<Entry<M, N>>,
}

crate::checked!([Model: Serialize + DeserializeOwned, const M: usize, const N: usize] Replay<Model, M, N>);

impl<Model, const M: usize, const N: usize> Replay<Model, M, N> {
    fn restored(self) -> Result<Self> {
        require_depth(self.depth)?;
        let got = self.entries.len();
        if !(1..=self.depth + 1).contains(&got) {
            let expected = got.clamp(1, self.depth + 1);
            return Err(EstimationError::Length { what: "entries of a history", got, expected });
        }
        for (entry, next) in self.entries.iter().zip(self.entries.iter().skip(1).chain(self.entries.back())) {
            require("the time of an entry", entry.time_s, true, "finite")?;
            if let Some((_, value)) = &entry.reading {
                require_finite("a measurement of a history", value)?;
            }
            if next.time_s < entry.time_s {
                return Err(EstimationError::TimeStep { dt_s: next.time_s - entry.time_s });
            }
        }
        Ok(self)
    }
}

/// The deepest history.
const DEEPEST: usize = 1 << 16;

fn require_depth(depth: usize) -> Result<()> {
    require("the depth of the history", depth as f64, (1..=DEEPEST).contains(&depth), "from 1 to 65536 measurements")
}

impl<Model: MotionModel<N>, const M: usize, const N: usize> Replay<Model, M, N> {
    /// A filter that starts from `belief` at `time_s` and remembers `depth` measurements.
    ///
    /// # Errors
    /// Where `depth` is not from 1 to 65536, or `time_s` is not finite.
    pub fn new(model: Model, belief: Gaussian<N>, time_s: f64, depth: usize) -> Result<Self> {
        require_depth(depth)?;
        if !time_s.is_finite() {
            return Err(EstimationError::NotFinite { what: "the start time" });
        }
        let mut entries = VecDeque::with_capacity(depth + 2);
        entries.push_back(Entry { time_s, reading: None, belief });
        Ok(Self { model, depth, entries })
    }

    /// The belief after the latest measurement, and its time in seconds.
    pub fn latest(&self) -> Option<(f64, &Gaussian<N>)> {
        self.entries.back().map(|entry| (entry.time_s, &entry.belief))
    }

    /// Takes in a measurement made at `time_s`, late or not.
    ///
    /// Measurements at one and the same time are taken in one after the other. Returns how many had to be gone over
    /// again: 0 for one that came in order.
    ///
    /// # Errors
    /// Where the measurement is older than the history ([`EstimationError::TimeStep`], negative), or as
    /// [`Gaussian::update`]; the filter is then as it was.
    pub fn update(
        &mut self,
        time_s: f64,
        measurement: &LinearMeasurement<M, N>,
        value: &SVector<f64, M>,
    ) -> Result<usize> {
        let later = self.entries.iter().rev().take_while(|entry| entry.time_s > time_s).count();
        let at = self.entries.len() - later;
        let Some(before) = at.checked_sub(1).and_then(|index| self.entries.get(index)) else {
            let oldest = self.entries.front().map_or(time_s, |entry| entry.time_s);
            return Err(EstimationError::TimeStep { dt_s: time_s - oldest });
        };
        if !time_s.is_finite() {
            return Err(EstimationError::NotFinite { what: "the time of a measurement" });
        }
        let (mut belief, mut now_s) = (before.belief, before.time_s);
        let mut inserted = Entry { time_s, reading: Some((*measurement, *value)), belief };
        inserted.belief = self.advanced(&belief, now_s, &inserted)?;
        // Two passes: the first only looks for errors, so that a failure changes nothing.
        (belief, now_s) = (inserted.belief, time_s);
        for entry in self.entries.iter().skip(at) {
            belief = self.advanced(&belief, now_s, entry)?;
            now_s = entry.time_s;
        }
        self.entries.insert(at, inserted);
        (belief, now_s) = (inserted.belief, time_s);
        for index in at + 1..self.entries.len() {
            let entry = self.entries[index];
            belief = self.advanced(&belief, now_s, &entry)?;
            now_s = entry.time_s;
            self.entries[index].belief = belief;
        }
        while self.entries.len() > self.depth + 1 {
            self.entries.pop_front();
        }
        Ok(later)
    }

    /// The belief at an entry, coming from `belief` at `from_s`.
    fn advanced(&self, belief: &Gaussian<N>, from_s: f64, entry: &Entry<M, N>) -> Result<Gaussian<N>> {
        let mut belief = *belief;
        if entry.time_s != from_s {
            require_time_step(entry.time_s - from_s)?;
            belief.predict(&self.model.over(entry.time_s - from_s)?)?;
        }
        if let Some((measurement, value)) = &entry.reading {
            belief.update(measurement, value)?;
        }
        Ok(belief)
    }
}
