"""End-point errors and times of `pursuit flow --dense` beside OpenCV's DIS, on pairs with known flow made here, one thread.

    python3 -m pip install opencv-python-headless numpy
    python3 crates/vision/benches/dense_flow.py target/release/pursuit
"""
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

cv2.setNumThreads(1)
WIDTH, HEIGHT = 640, 480


def texture(seed):
    """Noise of five octaves, larger than a picture."""
    rng = np.random.default_rng(seed)
    size = (HEIGHT * 2, WIDTH * 2)
    total = np.zeros(size, np.float32)
    for octave in range(5):
        cells = (size[0] >> (octave + 2), size[1] >> (octave + 2))
        total += 2.0 ** octave * cv2.resize(rng.random(cells, np.float32), size[::-1], interpolation=cv2.INTER_CUBIC)
    return (total - total.min()) / (total.max() - total.min()) * 220 + 15


def view(image, u, v):
    """What a camera sees of `image` where its pixel (x, y) looks at (u, v), counted from the middle of both."""
    return cv2.remap(image, (u + WIDTH).astype(np.float32), (v + HEIGHT).astype(np.float32), cv2.INTER_CUBIC)


def similar(degrees, zoom, dx, dy):
    """Flow of a turn, a zoom and a shift about the middle; and where a pixel of the second picture comes from."""
    angle = np.deg2rad(degrees)
    c, s = np.cos(angle) * zoom, np.sin(angle) * zoom
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    x, y = x - WIDTH / 2, y - HEIGHT / 2
    flow = np.stack([c * x - s * y + dx - x, s * x + c * y + dy - y], axis=2)
    n = zoom * zoom
    back = ((c * (x - dx) + s * (y - dy)) / n, (-s * (x - dx) + c * (y - dy)) / n)
    return (x, y), flow, back


def pairs():
    ground, thing = texture(1), texture(2)
    for name, motion in [
        ("shift of 5.4, -3.3", (0, 1, 5.4, -3.3)),
        ("shift of 40, 22", (0, 1, 40, 22)),
        ("turn by 4 degrees", (4, 1, 0, 0)),
        ("zoom by 8 %", (0, 1.08, 0, 0)),
        ("all three", (-3, 0.95, 12, 6)),
    ]:
        at, flow, back = similar(*motion)
        yield name, view(ground, *at), view(ground, *back), flow
    # A square of 200 pixels before a ground that goes the other way.
    (x, y), flow, back = similar(0, 1, -4, 1)
    _, own, own_back = similar(0, 1, 11, 6)
    inside = lambda u, v: (np.abs(u) < 100) & (np.abs(v) < 100)
    first = np.where(inside(x, y), view(thing, x, y), view(ground, x, y))
    second = np.where(inside(*own_back), view(thing, *own_back), view(ground, *back))
    yield "two layers", first, second, np.where(inside(x, y)[..., None], own, flow)


def inner(flow):
    """Pixels that stay in the picture, eight from its border."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    x, y = x + flow[..., 0], y + flow[..., 1]
    mask = (x > 8) & (x < WIDTH - 8) & (y > 8) & (y < HEIGHT - 8)
    mask[:8], mask[-8:], mask[:, :8], mask[:, -8:] = False, False, False, False
    return mask


def error(found, truth, mask):
    return float(np.hypot(*np.moveaxis(found - truth, 2, 0))[mask].mean())


def ours(program, first, second, quality):
    with tempfile.TemporaryDirectory() as folder:
        frames, out = Path(folder, "frames"), Path(folder, "out")
        frames.mkdir()
        for name, image in (("0", first), ("1", second)):
            cv2.imwrite(str(frames / f"{name}.png"), image)
        call = [program, "--threads", "1", "flow", str(frames), "--dense", "--quality", quality, "--flo", "--json", "--out", str(out)]
        facts = json.loads(subprocess.run(call, check=True, capture_output=True).stdout)
        return cv2.readOpticalFlow(str(out / "flo/000000.flo")), facts["mean_ms"]


def opencv(first, second, preset):
    dis = cv2.DISOpticalFlow_create(preset)
    dis.calc(first, second, None)
    start = time.perf_counter()
    found = dis.calc(first, second, None)
    return found, 1e3 * (time.perf_counter() - start)


def main(program):
    presets = {"ultrafast": cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST, "fast": cv2.DISOPTICAL_FLOW_PRESET_FAST,
               "medium": cv2.DISOPTICAL_FLOW_PRESET_MEDIUM}
    for name, first, second, truth in pairs():
        first, second = (np.clip(image, 0, 255).astype(np.uint8) for image in (first, second))
        mask = inner(truth)
        print(f"{name}: still {error(0 * truth, truth, mask):.2f} px")
        for quality in ("fast", "usual", "fine", "full"):
            found, ms = ours(program, first, second, quality)
            print(f"    pursuit {quality:9} {error(found, truth, mask):.3f} px  {ms:.1f} ms")
        for preset, number in presets.items():
            found, ms = opencv(first, second, number)
            print(f"    OpenCV  {preset:9} {error(found, truth, mask):.3f} px  {ms:.1f} ms")


if __name__ == "__main__":
    main(sys.argv[1])
