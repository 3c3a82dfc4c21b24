"""Processor time a frame of our mixture of Gaussians and of OpenCV's, one thread each, on the same 768 x 576 pictures, in turns.

    python3 -m pip install opencv-python-headless numpy
    cargo build --release -p pursuit-vision --example mog2_time
    python3 crates/vision/benches/mog2.py target/release/examples/mog2_time [FOLDER OF PICTURES]
"""
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

cv2.setNumThreads(1)
WIDTH, HEIGHT, ROUNDS, TURNS = 768, 576, 6, 7


def synthetic(n):
    """As benches/background.rs, but for the generator of the noise."""
    rng = np.random.default_rng(n)
    noise = ((rng.integers(0, 16, (HEIGHT, WIDTH, 3)) + rng.integers(0, 16, (HEIGHT, WIDTH, 3))) // 2).astype(np.uint8)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    v = ((x // 8 + y // 8) // 2 % 256).astype(np.uint8)
    image = (np.stack([60 + v, 70 + v // 2, 50 + v], axis=2) + noise).astype(np.uint8)
    side, left = HEIGHT // 4, n * 5 % WIDTH
    there = image[side:2 * side, left:left + side]
    there[:] = noise[side:2 * side, left:left + side] + np.array([220, 40, 60], np.uint8)
    return image


def ours(program, file, rounds):
    """Seconds of processor time of `rounds` rounds, reading the file included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, file, str(WIDTH), str(HEIGHT), str(rounds)], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def opencv(frames, rounds):
    """Seconds of processor time of OpenCV, and as much counting of its masks as ours does."""
    model, mask = cv2.createBackgroundSubtractorMOG2(), None
    start = time.process_time()
    for _ in range(rounds):
        for frame in frames:
            mask = model.apply(frame, mask)
    return time.process_time() - start


def compare(name, frames):
    with tempfile.NamedTemporaryFile() as file:
        file.write(b"".join(frame.tobytes() for frame in frames))
        file.flush()
        mine, theirs = [], []
        for _ in range(TURNS):
            # The difference of two runs is without the reading of the file.
            mine.append(ours(sys.argv[1], file.name, 2 * ROUNDS) - ours(sys.argv[1], file.name, ROUNDS))
            theirs.append(opencv(frames, 2 * ROUNDS) - opencv(frames, ROUNDS))
        a, b = (1e3 * min(v) / (ROUNDS * len(frames)) for v in (mine, theirs))
        spread = ", ".join(f"{t / m:.2f}" for m, t in zip(mine, theirs))
        print(f"{name}: ours {a:.2f} ms, OpenCV {cv2.__version__} {b:.2f} ms a frame: {b / a:.2f} times; by turns {spread}", flush=True)


compare("synthetic", [synthetic(n) for n in range(0, 97, 4)])
if len(sys.argv) > 2:
    files = sorted(pathlib.Path(sys.argv[2]).glob("*.jpg"))[:60]
    compare(sys.argv[2], [cv2.resize(cv2.imread(str(f)), (WIDTH, HEIGHT)) for f in files])
