"""Times the linear Kalman filter, the kfilter crate and FilterPy on the same two problems, in one run.

    python crates/estimation/benches/compare_peers.py [ROUNDS]

The three take turns, a few milliseconds each, so that whatever else the machine does disturbs all alike; the least time
of all rounds counts. FilterPy runs as its users run it: `predict()` and `update(z)` on plain numpy arrays.
"""

import subprocess
import sys
import timeit

import numpy as np
from filterpy.kalman import KalmanFilter

MEASURED = {4: [0, 1], 6: [0, 1, 4, 5]}
STEPS = 200  # of FilterPy in a round


def filterpy_step(n, m, dt=1 / 30):
    """The constant velocity of benches/peers.rs (for 6/4: a box whose size walks), as a function that does one step."""
    kalman = KalmanFilter(dim_x=n, dim_z=m)
    kalman.F = np.eye(n)
    kalman.F[0, 2] = kalman.F[1, 3] = dt
    kalman.Q = np.zeros((n, n))
    for axis in (0, 1):
        block = np.ix_([axis, axis + 2], [axis, axis + 2])
        kalman.Q[block] = 50 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    if n == 6:
        kalman.Q[4, 4] = kalman.Q[5, 5] = dt
    kalman.H = np.eye(n)[MEASURED[n]]
    kalman.R = np.eye(m)
    z = np.full((m, 1), 0.1)

    def step():
        kalman.predict()
        kalman.update(z)

    return step


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    command = ["cargo", "bench", "--quiet", "-p", "pursuit-estimation", "--bench", "peers", "--", "--serve"]
    peers = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    steps = {"4/2": filterpy_step(4, 2), "6/4": filterpy_step(6, 4)}
    least = {name: [float("inf")] * 3 for name in steps}
    for _ in range(rounds):
        peers.stdin.write("\n")
        peers.stdin.flush()
        fields = peers.stdout.readline().split()
        for name, ours, peer in zip(fields[0::3], fields[1::3], fields[2::3], strict=True):
            filterpy = timeit.timeit(steps[name], number=STEPS) / STEPS * 1e9
            found = [float(ours), float(peer), filterpy]
            least[name] = [min(pair) for pair in zip(least[name], found, strict=True)]
    peers.stdin.close()
    peers.wait()
    print(f"least of {rounds} rounds, ns a predict and update, and the ratio to pursuit")
    for name, (ours, peer, filterpy) in least.items():
        print(
            f"linear {name}: pursuit {ours:.1f}, kfilter {peer:.1f} ({peer / ours:.2f}), "
            f"FilterPy {filterpy:.0f} ({filterpy / ours:.0f})"
        )


main()
