"""Filters on arrays: against numpy written out, and against FilterPy where it is installed."""

import numpy as np
import pursuit
import pytest
from pursuit import estimation


def problem(tracks=5, steps=40, seed=1, missing=0.0):
    generator = np.random.default_rng(seed)
    F, Q = estimation.constant_velocity(0.1, 2.0)
    H = np.eye(2, 4)
    R = np.array([[0.5, 0.1], [0.1, 0.8]])
    x0, P0 = generator.normal(size=(tracks, 4)), np.diag([2.0, 3.0, 10.0, 10.0])
    z = np.cumsum(generator.normal(size=(tracks, steps, 2)), axis=1)
    z[generator.random((tracks, steps)) < missing] = np.nan
    return z, F, H, Q, R, x0, P0


def by_the_book(z, F, H, Q, R, x, P):
    means, covariances, likelihoods = [], [], []
    for value in z:
        x, P = F @ x, F @ P @ F.T + Q
        likelihood = 0.0
        if not np.isnan(value).any():
            y, S = value - H @ x, H @ P @ H.T + R
            K = P @ H.T @ np.linalg.inv(S)
            x, P = x + K @ y, P - K @ S @ K.T
            likelihood = -0.5 * (y @ np.linalg.solve(S, y) + np.linalg.slogdet(2 * np.pi * S)[1])
        means.append(x), covariances.append(P), likelihoods.append(likelihood)
    return np.array(means), np.array(covariances), np.array(likelihoods)


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_the_kalman_filter_is_the_book_s(missing):
    z, F, H, Q, R, x0, P0 = problem(missing=missing)
    found = estimation.kalman_filter(z, F, H, Q, R, x0, P0)
    for track in range(len(z)):
        expected = by_the_book(z[track], F, H, Q, R, x0[track], P0)
        for a, b in zip(found, expected):
            np.testing.assert_allclose(a[track], b, rtol=1e-9, atol=1e-9)
    alone = estimation.kalman_filter(z[2], F, H, Q, R, x0[2], P0)
    assert alone.means.shape == (40, 4) and np.array_equal(alone.means, found.means[2])


def test_what_varies_from_step_to_step_is_taken():
    z, F, H, Q, R, x0, P0 = problem()
    same = estimation.kalman_filter(z, F, H, Q, R, x0, P0)
    many = estimation.kalman_filter(z, np.stack([F] * 40), np.stack([H] * 40), Q, np.stack([R] * 40), x0, np.stack([P0] * 5))
    assert np.array_equal(same.means, many.means)
    steps = np.stack([F] * 40)
    steps[7] = np.eye(4)
    assert not np.allclose(estimation.kalman_filter(z, steps, H, Q, R, x0, P0).means, same.means)
    moved = estimation.kalman_filter(z, F, H, Q, R, x0, P0, b=[1.0, 0, 0, 0])
    assert not np.allclose(moved.means, same.means)
    first = estimation.kalman_filter(z, F, H, Q, R, x0, P0, predict_first=False)
    y = z[0, 0] - H @ x0[0]
    K = P0 @ H.T @ np.linalg.inv(H @ P0 @ H.T + R)
    np.testing.assert_allclose(first.means[0, 0], x0[0] + K @ y, rtol=1e-12)


def test_a_part_of_a_measurement_is_used():
    z, F, H, Q, R, x0, P0 = problem(tracks=1)
    part = z.copy()
    part[:, :, 1] = np.nan
    found = estimation.kalman_filter(part, F, H, Q, R, x0, P0)
    alone = estimation.kalman_filter(z[:, :, :1], F, H[:1], Q, R[:1, :1], x0, P0)
    np.testing.assert_allclose(found.means, alone.means, rtol=1e-9)
    assert np.isnan(found.log_likelihoods).all()


def test_the_smoother_is_the_book_s():
    z, F, H, Q, R, x0, P0 = problem(missing=0.2)
    filtered = estimation.kalman_filter(z, F, H, Q, R, x0, P0)
    smoothed = estimation.smooth(filtered, F, Q)
    for track in range(len(z)):
        x, P = filtered.means[track].copy(), filtered.covariances[track].copy()
        for k in range(len(x) - 2, -1, -1):
            before = F @ P[k] @ F.T + Q
            C = P[k] @ F.T @ np.linalg.inv(before)
            x[k] += C @ (x[k + 1] - F @ x[k])
            P[k] += C @ (P[k + 1] - before) @ C.T
        np.testing.assert_allclose(smoothed.means[track], x, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(smoothed.covariances[track], P, rtol=1e-8, atol=1e-8)


def test_filters_are_filterpy_s():
    filterpy = pytest.importorskip("filterpy.kalman")
    z, F, H, Q, R, x0, P0 = problem()
    found = estimation.kalman_filter(z, F, H, Q, R, x0, P0)
    for track in range(len(z)):
        kf = filterpy.KalmanFilter(4, 2)
        kf.x, kf.P, kf.F, kf.H, kf.Q, kf.R = x0[track].copy(), P0.copy(), F, H, Q, R
        means, covariances, _, _ = kf.batch_filter(z[track])
        np.testing.assert_allclose(found.means[track], means, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.covariances[track], covariances, rtol=1e-9, atol=1e-9)
        smooth_means, smooth_covariances, _, _ = kf.rts_smoother(means, covariances)
        smoothed = estimation.smooth(found, F, Q)
        np.testing.assert_allclose(smoothed.means[track], smooth_means, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(smoothed.covariances[track], smooth_covariances, rtol=1e-9, atol=1e-9)


def test_the_interacting_estimator_is_filterpy_s():
    filterpy = pytest.importorskip("filterpy.kalman")
    z, F, H, Q, R, x0, P0 = problem(tracks=2)
    switching, start = np.array([[0.95, 0.05], [0.1, 0.9]]), np.array([0.7, 0.3])
    found = estimation.imm_filter(z, [F, F], H, [Q, 50 * Q], R, switching, x0, P0, probabilities=start)
    for track in range(2):
        filters = []
        for noise in (Q, 50 * Q):
            kf = filterpy.KalmanFilter(4, 2)
            kf.x, kf.P, kf.F, kf.H, kf.Q, kf.R = x0[track].copy(), P0.copy(), F, H, noise, R
            filters.append(kf)
        imm = filterpy.IMMEstimator(filters, start.copy(), switching)
        for k in range(z.shape[1]):
            imm.predict()
            imm.update(z[track, k])
            np.testing.assert_allclose(found.means[track, k], imm.x, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(found.covariances[track, k], imm.P, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(found.probabilities[track, k], imm.mu, rtol=1e-9, atol=1e-9)


def test_the_interacting_estimator_chooses_the_model_that_fits():
    generator = np.random.default_rng(3)
    F, Q = estimation.constant_velocity(1.0, 1e-4, axes=1)
    z = generator.normal(scale=0.1, size=(1, 200, 1))
    z[0, 100:, 0] += np.cumsum(generator.normal(scale=5.0, size=100))
    found = estimation.imm_filter(
        z, [F, F], [[1, 0]], [Q, 1e5 * Q], [[0.01]], [[0.98, 0.02], [0.02, 0.98]], [0, 0], np.eye(2)
    )
    assert found.probabilities[0, 20:95, 0].mean() > 0.6 and found.probabilities[0, 110:, 1].mean() > 0.9
    np.testing.assert_allclose(found.probabilities.sum(axis=2), 1.0)


def test_particles_come_near_the_kalman_filter_and_repeat():
    z, F, H, Q, R, x0, P0 = problem(tracks=2, steps=15)
    exact = estimation.kalman_filter(z, F, H, Q, R, x0, P0)
    for resampling in ("systematic", "stratified", "residual", "multinomial"):
        found = estimation.particle_filter(z, F, H, Q, R, x0, P0, particles=20_000, resampling=resampling)
        deviation = np.sqrt(exact.covariances[..., [0, 1], [0, 1]])
        # The measurements wander far from what the model says: a few particles carry the weight.
        error = np.abs(found.means[..., :2] - exact.means[..., :2]) / deviation
        assert np.median(error) < 0.2, resampling
        assert (found.effective_sizes <= 20_000 * (1 + 1e-9)).all()
    again = estimation.particle_filter(z, F, H, Q, R, x0, P0, particles=500, seed=4)
    assert np.array_equal(again.means, estimation.particle_filter(z, F, H, Q, R, x0, P0, particles=500, seed=4).means)


@pytest.mark.parametrize("kind", ["extended", "unscented"])
def test_a_turn_is_followed(kind):
    generator = np.random.default_rng(5)
    time = np.arange(120) * 0.1
    truth = np.stack([50 * np.cos(0.4 * time), 50 * np.sin(0.4 * time)], axis=1)
    z = truth + generator.normal(scale=0.3, size=truth.shape)
    found = estimation.turn_filter(
        z, np.eye(2, 5), 0.09 * np.eye(2), [50, 0, 0, 15, 0], np.diag([1, 1, 25, 25, 0.5]), 0.1,
        acceleration_density=0.1, turn_density=0.001, kind=kind,
    )
    assert found.means.shape == (120, 5)
    assert abs(found.means[-1, 4] - 0.4) < 0.05
    assert np.hypot(*(found.means[60:, :2] - truth[60:]).T).mean() < 0.3


def test_assignments_are_the_best():
    generator = np.random.default_rng(2)
    from itertools import permutations

    for _ in range(20):
        cost = generator.random((5, 5))
        columns, total = estimation.assign(cost)
        best = min(sum(cost[i, p[i]] for i in range(5)) for p in permutations(range(5)))
        assert total == pytest.approx(best) and cost[range(5), columns].sum() == pytest.approx(best)
    columns, _ = estimation.assign([[np.inf, 0.1], [0.2, np.inf], [0.3, 9.0]], unassigned=1.0)
    assert columns.tolist() == [1, 0, -1]


def test_detections_are_associated():
    means, covariances = np.array([[0.0, 0.0], [10.0, 0.0], [50.0, 50.0]]), np.stack([np.eye(2)] * 3)
    detections = np.array([[9.5, 0.3], [0.4, -0.2], [200.0, 0.0]])
    assert estimation.associate(means, covariances, detections).tolist() == [1, 0, -1]
    likely = estimation.associate(means, covariances, detections, detection_probability=0.9, clutter_density=1e-4)
    assert likely.tolist() == [1, 0, -1]
    assert estimation.associate(means, covariances, []).tolist() == [-1, -1, -1]
    joint = estimation.joint_probabilities(means, covariances, detections, detection_probability=0.9, clutter_density=1e-4)
    assert joint.shape == (3, 4)
    np.testing.assert_allclose(joint.sum(axis=1), 1.0)
    assert joint[0, 2] > 0.95 and joint[1, 1] > 0.95 and joint[2, 0] == pytest.approx(1.0)


def test_models():
    F, Q = estimation.constant_velocity(0.5, 2.0, axes=1)
    np.testing.assert_allclose(F, [[1, 0.5], [0, 1]])
    np.testing.assert_allclose(Q, 2.0 * np.array([[0.5**3 / 3, 0.5**2 / 2], [0.5**2 / 2, 0.5]]))
    F, Q = estimation.constant_acceleration(0.5, 1.0, axes=1)
    np.testing.assert_allclose(F, [[1, 0.5, 0.125], [0, 1, 0.5], [0, 0, 1]])
    assert estimation.random_walk(1.0, 1.0, axes=3)[0].shape == (3, 3)
    assert estimation.singer(0.1, 0.5, 4.0)[0].shape == (6, 6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (dict(z=np.zeros((2, 3, 4, 5))), "4 dimensions"),
        (dict(H=np.eye(3, 4)), "H has shape"),
        (dict(F=np.eye(3)), "F has shape"),
        (dict(F=np.zeros((7, 4, 4))), "one for each step"),
        (dict(x0=np.zeros((3, 4))), "one for each track"),
        (dict(Q=-np.eye(4)), "positive"),
        (dict(R=np.full((2, 2), np.nan)), "finite"),
        (dict(P0=np.zeros((4, 4))), "step 0: "),
        (dict(x0=np.zeros(12), F=np.eye(12), Q=np.eye(12), H=np.eye(2, 12), P0=np.eye(12)), "1 to 9"),
        (dict(z=np.full((5, 3, 2), np.inf)), "step 0: "),
    ],
)
def test_errors_say_what_is_wrong(change, words):
    z, F, H, Q, R, x0, P0 = problem()
    given = dict(z=z, F=F, H=H, Q=Q, R=R, x0=x0, P0=P0) | change
    with pytest.raises(pursuit.PursuitError) as raised:
        estimation.kalman_filter(**given)
    assert words in str(raised.value) and "\n" not in str(raised.value)


def test_nothing_is_filtered_to_nothing():
    z, F, H, Q, R, x0, P0 = problem()
    assert estimation.kalman_filter(z[:, :0], F, H, Q, R, x0, P0).means.shape == (5, 0, 4)
    assert estimation.kalman_filter(z[:0], F, H, Q, R, x0[0], P0).means.shape == (0, 40, 4)
