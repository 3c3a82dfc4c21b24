"""OpenCV's times for what benches/flow.rs and benches/background.rs time, on the same pictures, one thread.

    python3 -m pip install opencv-python-headless numpy
    cargo bench -p pursuit-vision --bench flow --bench background & wait; python3 crates/vision/benches/opencv.py
"""
import time
import cv2
import numpy as np

cv2.setNumThreads(1)


def best(name, work, rounds=60):
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    print(f"{name}: median {1e3 * np.median(times):.2f} ms, least {1e3 * min(times):.2f} ms")


def picture(dx, dy):
    y, x = np.mgrid[0:720, 0:1280].astype(np.float64)
    x, y = x - dx, y - dy
    wave = lambda a, b: np.sin(a * x + b * y)
    return (127.5 + 30 * (wave(.31, .17) + wave(-.23, .29) + wave(.071, -.053) + wave(.043, .061))).astype(np.uint8)


def frame(width, height, n):
    """As benches/background.rs, but for the generator of the noise."""
    rng = np.random.default_rng(n % 97)
    noise = ((rng.integers(0, 16, (height, width, 3)) + rng.integers(0, 16, (height, width, 3))) // 2).astype(np.uint8)
    y, x = np.mgrid[0:height, 0:width]
    v = ((x // 8 + y // 8) // 2 % 256).astype(np.uint8)
    image = np.stack([60 + v, 70 + v // 2, 50 + v], axis=2) + noise
    side, left = height // 4, n * 5 % width
    image[side:2 * side, left:left + side] = noise[side:2 * side, left:left + side] + np.array([220, 40, 60], np.uint8)
    return image.astype(np.uint8)


first, second = picture(0, 0), picture(3.3, -2.1)
points = np.array([(60 + 1160 * i / 19 - .5, 60 + 600 * j / 9 - .5) for j in range(10) for i in range(20)], np.float32)
criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)
best("calcOpticalFlowPyrLK, 200 points 21x21, 4 levels", lambda: cv2.calcOpticalFlowPyrLK(
    first, second, points.reshape(-1, 1, 2), None, winSize=(21, 21), maxLevel=3, criteria=criteria))
best("buildOpticalFlowPyramid, 4 levels", lambda: cv2.buildOpticalFlowPyramid(second, (21, 21), 3))
best("integral2", lambda: cv2.integral2(first))
for width, height in ((1280, 720), (768, 576)):
    frames = [frame(width, height, n) for n in range(0, 97, 4)]
    model, state = cv2.createBackgroundSubtractorMOG2(), {"n": 0}
    mask = model.apply(frames[0])

    def step():
        state["n"] += 1
        model.apply(frames[state["n"] % len(frames)], mask)

    for _ in range(300):
        step()
    best(f"BackgroundSubtractorMOG2 {width}x{height}", step, 100)
