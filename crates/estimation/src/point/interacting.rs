//! Several ways of moving, interacting.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{PointFilter, PointStart, plane, position_sensor};
use crate::{Gaussian, Imm, Innovation, Mode, Result, Sojourn};

/// `K` ways of moving over one state of `N` components: tuples of two to four [`Mode`]s.
pub trait Modes<const N: usize, const K: usize> {
    /// The modes.
    fn each(&self) -> [&dyn Mode<N>; K];
}

impl<const N: usize, A: Mode<N>, B: Mode<N>> Modes<N, 2> for (A, B) {
    fn each(&self) -> [&dyn Mode<N>; 2] {
        [&self.0, &self.1]
    }
}

impl<const N: usize, A: Mode<N>, B: Mode<N>, C: Mode<N>> Modes<N, 3> for (A, B, C) {
    fn each(&self) -> [&dyn Mode<N>; 3] {
        [&self.0, &self.1, &self.2]
    }
}

impl<const N: usize, A: Mode<N>, B: Mode<N>, C: Mode<N>, D: Mode<N>> Modes<N, 4> for (A, B, C, D) {
    fn each(&self) -> [&dyn Mode<N>; 4] {
        [&self.0, &self.1, &self.2, &self.3]
    }
}

/// A point that moves in one of the ways of `Set` at a time, over a state of `N` components `[x, y, vx, vy, …]`.
///
/// Modes of smaller states stand in it as [`crate::Embedded`]. How long a mode lasts is given in seconds, so that it means
/// the same at every frame rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ImmPoint<Set, const N: usize, const K: usize> {
    modes: Set,
    sojourn: Sojourn<K>,
    start: PointStart,
    imm: Imm<N, K>,
}

impl<Set: Modes<N, K>, const N: usize, const K: usize> ImmPoint<Set, N, K> {
    /// A filter first seen at `position` with noise covariance `noise`, every mode equally likely.
    ///
    /// # Errors
    /// Where a number of `start` is out of range or `noise` is not positive definite.
    pub fn new(
        modes: Set,
        sojourn: Sojourn<K>,
        start: PointStart,
        position: &SVector<f64, 2>,
        noise: &SMatrix<f64, 2, 2>,
    ) -> Result<Self> {
        const { assert!(N >= 4, "the state holds two positions and two velocities at least") };
        let imm = Imm::new(start.at(position, noise)?, [1.0 / K as f64; K])?;
        Ok(Self { modes, sojourn, start, imm })
    }

    /// The estimator: beliefs and probabilities of the modes.
    pub const fn imm(&self) -> &Imm<N, K> {
        &self.imm
    }

    fn predicted(&self, dt_s: f64) -> Result<Imm<N, K>> {
        let mut after = self.imm;
        after.predict_modes(&self.modes.each(), &self.sojourn.over(dt_s)?, dt_s)?;
        Ok(after)
    }
}

impl<Set: Modes<N, K>, const N: usize, const K: usize> PointFilter for ImmPoint<Set, N, K> {
    fn predict(&mut self, dt_s: f64) -> Result<()> {
        self.imm = self.predicted(dt_s)?;
        Ok(())
    }

    /// Returns the innovation of the mixture.
    fn update(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<Innovation<2>> {
        let sensor = position_sensor(noise)?;
        let innovation = self.imm.combined().innovation(&sensor, position)?;
        self.imm.update(&sensor, position)?;
        Ok(innovation)
    }

    fn belief(&self) -> Gaussian<4> {
        plane(&self.imm.combined())
    }

    fn forecast(&self, dt_s: f64) -> Result<Gaussian<4>> {
        Ok(plane(&self.predicted(dt_s)?.combined()))
    }

    fn restart(&mut self, position: &SVector<f64, 2>, noise: &SMatrix<f64, 2, 2>) -> Result<()> {
        self.imm = Imm::new(self.start.at(position, noise)?, [1.0 / K as f64; K])?;
        Ok(())
    }
}
