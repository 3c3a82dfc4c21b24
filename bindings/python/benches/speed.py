"""What the binding costs, and what its batched filters gain: prints ratios of one run.

python benches/speed.py [calls] [filters] [threads] [associate]; FilterPy is needed for `filters`.
"""

import sys
import threading
import time

import numpy as np
import pursuit
from pursuit import estimation


def calls():
    """The time of a call on 1280 x 720 beside the time that the tracker itself takes, measured inside by MultiTracker."""
    generator = np.random.default_rng(1)
    frame = generator.integers(0, 255, (720, 1280, 3), dtype=np.uint8)
    tracker = pursuit.Tracker("mosse")
    tracker.init(frame, (600, 300, 16, 16))
    targets = pursuit.MultiTracker("mosse")
    targets.add(frame, (600, 300, 16, 16))
    for channels, image in (("rgb", frame), ("grey", np.ascontiguousarray(frame[..., 0]))):
        tracker.init(image, (600, 300, 16, 16))
        whole, inside = [], []
        targets = pursuit.MultiTracker("mosse")
        targets.add(image, (600, 300, 16, 16))
        for _ in range(300):
            start = time.perf_counter()
            tracker.update(image)
            whole.append(time.perf_counter() - start)
            inside.append(targets.update(image)[0].update_ms / 1e3)
        print(f"mosse, {channels}: {1e6 * np.median(whole):.1f} us a call, {1e6 * np.median(inside):.1f} us inside")
    # What is left when nothing is tracked: a call that is refused after the frame has been taken.
    never = pursuit.Tracker("mosse")
    def refused():
        try:
            never.update(frame)
        except pursuit.StateError:
            pass
    def bare():
        try:
            raise pursuit.StateError("x")
        except pursuit.StateError:
            pass
    for what, call in (("array to frame, lock, error", refused), ("a bare exception", bare)):
        times = []
        for _ in range(5000):
            start = time.perf_counter()
            call()
            times.append(time.perf_counter() - start)
        print(f"{what}: {1e6 * np.median(times):.2f} us")


def filters(tracks=1000, steps=1000):
    """1 000 tracks x 1 000 steps beside FilterPy on a part of them."""
    from filterpy.kalman import KalmanFilter

    generator = np.random.default_rng(1)
    F, Q = estimation.constant_velocity(0.1, 2.0)
    H, R, P0 = np.eye(2, 4), np.diag([0.5, 0.8]), np.diag([2.0, 3.0, 10.0, 10.0])
    z = np.cumsum(generator.normal(size=(tracks, steps, 2)), axis=1)
    x0 = np.zeros((tracks, 4))
    times = []
    for _ in range(3):
        start = time.perf_counter()
        found = estimation.kalman_filter(z, F, H, Q, R, x0, P0)
        times.append(time.perf_counter() - start)
    ours = min(times)
    part = 10
    start = time.perf_counter()
    worst = 0.0
    for track in range(part):
        kf = KalmanFilter(4, 2)
        kf.x, kf.P, kf.F, kf.H, kf.Q, kf.R = x0[track].copy(), P0.copy(), F, H, Q, R
        means, covariances, _, _ = kf.batch_filter(z[track])
        worst = max(worst, np.abs(means - found.means[track]).max(), np.abs(covariances - found.covariances[track]).max())
    theirs = (time.perf_counter() - start) * tracks / part
    print(f"Kalman filter {tracks} x {steps}: {ours:.3f} s, FilterPy {theirs:.1f} s, {theirs / ours:.0f} x; differ by {worst:.1e}")
    start = time.perf_counter()
    estimation.smooth(found, F, Q)
    print(f"smoother: {time.perf_counter() - start:.3f} s")
    start = time.perf_counter()
    estimation.imm_filter(z, [F, F], H, [Q, 50 * Q], R, [[0.95, 0.05], [0.1, 0.9]], x0, P0)
    print(f"IMM of two models: {time.perf_counter() - start:.3f} s")


def threads(count=8, frames=100):
    """Frames a second of `count` threads, each with a clip of its own, beside one thread that does them in turn."""
    generator = np.random.default_rng(1)
    clip = generator.integers(0, 255, (20, 360, 640, 3), dtype=np.uint8)

    def follow():
        tracker = pursuit.Tracker("kcf")
        tracker.init(clip[0], (300, 150, 60, 60))
        for k in range(frames):
            tracker.update(clip[k % 20])

    start = time.perf_counter()
    for _ in range(count):
        follow()
    alone = time.perf_counter() - start
    workers = [threading.Thread(target=follow) for _ in range(count)]
    start = time.perf_counter()
    [w.start() for w in workers]
    [w.join() for w in workers]
    together = time.perf_counter() - start
    print(f"{count} threads: {alone / together:.2f} x the throughput of one")


def associate(frames=300):
    """Microseconds a frame of the walkers of `cargo run --profile suite -p pursuit-tracking --example associate`, arrays in and out."""
    for count in (4, 20, 100, 500):
        side = int(np.ceil(np.sqrt(count)))
        i, times = np.arange(count), []
        associator = pursuit.Associator(size=(300 + 55 * side, 300 + 95 * side), fps=25)
        scores, boxes = np.full(count, 0.9), np.tile([0.0, 0, 30, 80], (count, 1))
        for k in range(2 * frames):
            boxes[:, 0] = 100 + 55 * (i % side) + 25 * np.sin(0.05 * k + i)
            boxes[:, 1] = 100 + 95 * (i // side) + 20 * np.cos(0.04 * k + 2 * i)
            start = time.perf_counter()
            tracks = associator.update(boxes, scores)
            known = tracks.ids, tracks.boxes, tracks.scores, tracks.states, tracks.detections
            times.append(time.perf_counter() - start)
        assert len(known[0]) == count
        print(f"{count} boxes: {1e6 * np.median(times[frames:]):.1f} us a frame (median)")


if __name__ == "__main__":
    for name in sys.argv[1:] or ["calls", "filters", "threads"]:
        {"calls": calls, "filters": filters, "threads": threads, "associate": associate}[name]()
