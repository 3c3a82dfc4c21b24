"""Time a frame of our mixture of Gaussians and of OpenCV's, one thread each, on the same 768 x 576 pictures, in turns. On a machine with
other load the tenth percentile of the frames tells more than their mean.

    python3 -m pip install opencv-python-headless numpy
    cargo build --release -p pursuit-vision --example mog2_time
    python3 crates/vision/benches/mog2.py target/release/examples/mog2_time [FOLDER OF PICTURES]
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

cv2.setNumThreads(1)
WIDTH, HEIGHT, ROUNDS, TURNS = 768, 576, 6, 5


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


def ours(program, file):
    """Least, tenth percentile and median, ms a frame."""
    said = subprocess.run([program, file, str(WIDTH), str(HEIGHT), str(ROUNDS)], check=True, capture_output=True, text=True)
    return [float(v) for v in said.stdout.split()]


def opencv(frames):
    """The same of OpenCV."""
    model, mask, times = cv2.createBackgroundSubtractorMOG2(), None, []
    for turn in range(ROUNDS):
        for frame in frames:
            start = time.perf_counter()
            mask = model.apply(frame, mask)
            if turn:
                times.append(1e3 * (time.perf_counter() - start))
    return [min(times), *np.percentile(times, [10, 50])]


def compare(name, frames):
    with tempfile.NamedTemporaryFile() as file:
        file.write(b"".join(frame.tobytes() for frame in frames))
        file.flush()
        turns = [(ours(sys.argv[1], file.name), opencv(frames)) for _ in range(TURNS)]
    for k, what in enumerate(("least", "tenth percentile", "median")):
        a, b = (min(turn[side][k] for turn in turns) for side in (0, 1))
        ratios = ", ".join(f"{theirs[k] / mine[k]:.2f}" for mine, theirs in turns)
        print(f"{name}, {what}: ours {a:.2f} ms, OpenCV {cv2.__version__} {b:.2f} ms a frame: {b / a:.2f} times; by turns {ratios}", flush=True)


compare("synthetic", [synthetic(n) for n in range(0, 97, 4)])
if len(sys.argv) > 2:
    files = sorted(pathlib.Path(sys.argv[2]).glob("*.jpg"))[:60]
    compare(sys.argv[2], [cv2.resize(cv2.imread(str(f)), (WIDTH, HEIGHT)) for f in files])
