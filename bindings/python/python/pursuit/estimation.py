"""Filters on arrays: one call for N tracks x T steps, shared among the processors.

Shapes: measurements z are (N, T, m), or (T, m) for one track; a row of NaN is a step without a measurement, a NaN within a row
a component that is missing. Matrices are one for all, (n, n), or one for each step, (T, n, n); x0 and P0 are one for all, (n,)
and (n, n), or one for each track. States have 1 to 9 components, measurements 1 to 4. Step k is a prediction by F[k], Q[k],
then a correction by z[k].

>>> import numpy as np
>>> from pursuit import estimation
>>> F, Q = estimation.constant_velocity(dt=0.1, density=1.0, axes=1)
>>> z = np.arange(20.0).reshape(1, 20, 1) * 0.5
>>> found = estimation.kalman_filter(z, F, [[1, 0]], Q, [[0.01]], x0=[0, 0], P0=np.diag([1.0, 100.0]))
>>> bool(abs(found.means[0, -1, 1] - 5.0) < 0.2)
True

The algorithms are those of the Rust crate pursuit-estimation: covariances stay symmetric and positive, and an error names the
track and the step.
"""

from typing import NamedTuple

import numpy as np

from . import _native


class Filtered(NamedTuple):
    """What a filter believes after each step."""

    means: np.ndarray
    """Expected states, (N, T, n), or (T, n) for one track."""
    covariances: np.ndarray
    """Covariances of their errors, (N, T, n, n)."""
    log_likelihoods: np.ndarray
    """Of each measurement, (N, T): 0 where there was none, NaN where a part of it was missing."""


class Smoothed(NamedTuple):
    """What is believed of each step, knowing all."""

    means: np.ndarray
    covariances: np.ndarray


class Mixed(NamedTuple):
    """What an estimator of several models believes after each step."""

    means: np.ndarray
    covariances: np.ndarray
    probabilities: np.ndarray
    """Of each model, (N, T, K)."""
    log_likelihoods: np.ndarray


class Sampled(NamedTuple):
    """What a particle filter believes after each step."""

    means: np.ndarray
    covariances: np.ndarray
    effective_sizes: np.ndarray
    """How many equally weighted particles would say as much, before resampling, (N, T)."""


def _array(values, ndim, name):
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim == ndim - 1:
        array = array[None]
    if array.ndim != ndim:
        raise _native.UsageError(f"{name} has {array.ndim} dimensions, not {ndim - 1} or {ndim}")
    return array


def _measurements(z):
    z = np.asarray(z, dtype=np.float64)
    if z.ndim not in (2, 3):
        raise _native.UsageError(f"z has {z.ndim} dimensions; it is (N, T, m), or (T, m) for one track")
    return np.ascontiguousarray(z if z.ndim == 3 else z[None]), z.ndim == 2


def _out(kind, alone, arrays):
    return kind(*(a[0] if alone else a for a in arrays))


def kalman_filter(z, F, H, Q, R, x0, P0, *, b=None, predict_first=True):
    """The Kalman filter, in Joseph form; returns Filtered.

    b: known displacements, (n,) or (T, n). predict_first: False where x0, P0 are what is believed before the first
    measurement, at its time.
    """
    z, alone = _measurements(z)
    x0, P0 = _array(x0, 2, "x0"), _array(P0, 3, "P0")
    b = np.zeros((1, x0.shape[-1])) if b is None else _array(b, 2, "b")
    matrices = (_array(F, 3, "F"), _array(Q, 3, "Q"), b, _array(H, 3, "H"), _array(R, 3, "R"))
    return _out(Filtered, alone, _native.kalman_filter(z, *matrices, x0, P0, predict_first, None))


def turn_filter(
    z, H, R, x0, P0, dt, *, acceleration_density, turn_density, kind="unscented", predict_first=True
):
    """A target that turns, state [x, y, vx, vy, turn rate], by the extended or the unscented Kalman filter; returns Filtered.

    dt: seconds of each step, one or (T,). acceleration_density: px^2/s^3. turn_density: rad^2/s^3.
    """
    if kind not in ("extended", "unscented"):
        raise _native.UsageError(f'there is no filter `{kind}`; there are: "extended", "unscented"')
    z, alone = _measurements(z)
    dt = np.atleast_1d(np.asarray(dt, dtype=np.float64))
    F = np.zeros((len(dt), 5, 5))
    F[:, 0, 0] = dt
    rest = (np.zeros((1, 5, 5)), np.zeros((1, 5)), _array(H, 3, "H"), _array(R, 3, "R"))
    turn = (float(acceleration_density), float(turn_density), kind == "unscented")
    x0, P0 = _array(x0, 2, "x0"), _array(P0, 3, "P0")
    return _out(Filtered, alone, _native.kalman_filter(z, F, *rest, x0, P0, predict_first, turn))


def smooth(filtered, F, Q, *, b=None):
    """The Rauch-Tung-Striebel smoother over what kalman_filter returned, with the same F, Q and b; returns Smoothed."""
    means, alone = _measurements(filtered.means)
    covariances = np.ascontiguousarray(filtered.covariances[None] if alone else filtered.covariances)
    b = np.zeros((1, means.shape[-1])) if b is None else _array(b, 2, "b")
    return _out(Smoothed, alone, _native.smooth(means, covariances, _array(F, 3, "F"), _array(Q, 3, "Q"), b))


def imm_filter(z, F, H, Q, R, switching, x0, P0, *, probabilities=None):
    """The interacting multiple model estimator of 2 or 3 models; returns Mixed.

    F, Q: (K, n, n), one for each model. H, R: one for all. switching: (K, K), the probability that a target in mode i is in
    mode j after a step. probabilities: of the modes at the start, equal without.
    """
    z, alone = _measurements(z)
    switching = _array(switching, 2, "switching")
    if probabilities is None:
        probabilities = np.full(len(switching), 1.0 / max(len(switching), 1))
    probabilities = np.ascontiguousarray(probabilities, dtype=np.float64)
    matrices = (_array(F, 3, "F"), _array(Q, 3, "Q"), _array(H, 3, "H"), _array(R, 3, "R"))
    start = (_array(x0, 2, "x0"), _array(P0, 3, "P0"))
    return _out(Mixed, alone, _native.imm_filter(z, *matrices, switching, probabilities, *start))


def particle_filter(
    z,
    F,
    H,
    Q,
    R,
    x0,
    P0,
    *,
    particles=1000,
    resampling="systematic",
    threshold=0.5,
    regularisation=0.0,
    seed=1,
):
    """A particle filter of linear motion and Gaussian measurements; returns Sampled.

    resampling: "systematic", "stratified", "residual" or "multinomial", done where fewer than threshold x particles are
    effective. regularisation: how much resampled particles are blurred, 0 not at all. seed: the same gives the same
    result, whatever the number of processors.
    """
    z, alone = _measurements(z)
    matrices = (_array(F, 3, "F"), _array(Q, 3, "Q"), _array(H, 3, "H"), _array(R, 3, "R"))
    start = (_array(x0, 2, "x0"), _array(P0, 3, "P0"))
    options = (particles, resampling, float(threshold), float(regularisation), seed)
    return _out(Sampled, alone, _native.particle_filter(z, *matrices, *start, *options))


def constant_velocity(dt, density, *, axes=2, noise="white"):
    """F and Q of a point at constant velocity, disturbed; state [x, y, …, vx, vy, …].

    dt: seconds. noise: "white" (density is a spectral density), "piecewise" or "per_step" (a variance).
    """
    return _native.constant(axes, 2, dt, noise, density)


def constant_acceleration(dt, density, *, axes=2, noise="white"):
    """F and Q of a point at constant acceleration, disturbed; state [x, y, …, vx, vy, …, ax, ay, …]. See constant_velocity."""
    return _native.constant(axes, 3, dt, noise, density)


def random_walk(dt, density, *, axes=2, noise="white"):
    """F and Q of a point that wanders; state [x, y, …]. See constant_velocity."""
    return _native.constant(axes, 1, dt, noise, density)


def singer(dt, rate_per_s, acceleration_variance, *, axes=2):
    """F and Q of Singer's model: acceleration of the correlation time 1 / rate_per_s and the variance given."""
    return _native.singer(axes, dt, rate_per_s, acceleration_variance)


def assign(cost, *, unassigned=1e9):
    """The column of each row of cost (rows, columns), -1 for none, so that the sum is least; returns (columns, sum).

    Infinite costs forbid a pair; a row that stays without costs `unassigned`.
    """
    return _native.assign(np.ascontiguousarray(cost, dtype=np.float64), float(unassigned))


def associate(means, covariances, detections, *, gate=0.99, detection_probability=None, clutter_density=None):
    """Global nearest neighbours: the detection of each target, int (K,), -1 for none.

    means (K, m), covariances (K, m, m): expected measurements, their noise included. detections: (D, m). gate: the
    probability with which a true measurement is admitted. With detection_probability and clutter_density (false detections
    per unit of the measured space) pairs cost what they are unlikely, else their distance.
    """
    given = (detection_probability is None) + (clutter_density is None)
    if given == 1:
        raise _native.UsageError("give detection_probability and clutter_density together, or neither")
    likelihood = None if given else (float(detection_probability), float(clutter_density))
    return _native.associate(*_targets(means, covariances, detections), float(gate), likelihood)


def joint_probabilities(
    means, covariances, detections, *, detection_probability, clutter_density, gate=0.99, most_events=1_000_000
):
    """Joint probabilistic data association: (K, D + 1), that each target was missed, and that each detection is its own.

    Raises ComputationError or UsageError where more than most_events partial events would have to be looked at.
    """
    given = (float(gate), float(detection_probability), float(clutter_density), most_events)
    return _native.joint_probabilities(*_targets(means, covariances, detections), *given)


def _targets(means, covariances, detections):
    means = np.ascontiguousarray(means, dtype=np.float64)
    detections = np.ascontiguousarray(detections, dtype=np.float64)
    if means.ndim == 2 and detections.size == 0:
        detections = detections.reshape(0, means.shape[1])
    return means, np.ascontiguousarray(covariances, dtype=np.float64), detections
