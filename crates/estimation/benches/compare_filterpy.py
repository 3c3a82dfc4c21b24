"""Times FilterPy on the problems of benches/filters.rs: python crates/estimation/benches/compare_filterpy.py"""

import timeit

import numpy as np
from filterpy.kalman import KalmanFilter


def problem(n, m):
    f = KalmanFilter(dim_x=n, dim_z=m)
    f.F = np.eye(n)
    f.F[0, 2] = f.F[1, 3] = 1 / 30
    f.Q = np.eye(n) * 0.01
    measured = [0, 1] if n == 4 else [0, 1, 4, 5]
    f.H = np.eye(n)[measured]
    f.R = np.eye(m)
    return f


for n, m in [(4, 2), (6, 4)]:
    kalman, z = problem(n, m), np.full((m, 1), 0.1)

    def step():
        kalman.predict()
        kalman.update(z)

    best = min(timeit.repeat(step, number=2000, repeat=5)) / 2000
    print(f"linear {n}/{m}/filterpy: {best * 1e9:.0f} ns")
