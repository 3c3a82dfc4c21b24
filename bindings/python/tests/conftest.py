"""What the tests share: made-up footage, the command, optional packages."""

import os
import pathlib

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]


def moving_square(frames=40, size=(120, 160), side=24, step=(2, 1), color=False):
    """Frames with a bright textured square that moves, and its true boxes."""
    generator = np.random.default_rng(7)
    backdrop = generator.integers(40, 90, size, dtype=np.uint8)
    texture = generator.integers(150, 255, (side, side), dtype=np.uint8)
    images, boxes = [], []
    for k in range(frames):
        x, y = 20 + step[0] * k, 30 + step[1] * k
        image = backdrop.copy()
        image[y : y + side, x : x + side] = texture
        images.append(np.repeat(image[..., None], 3, axis=2) if color else image)
        boxes.append((x, y, side, side))
    return images, boxes


@pytest.fixture
def square():
    return moving_square()


@pytest.fixture(scope="session")
def command():
    """The command `pursuit` of the same build, or a skip."""
    path = os.environ.get("PURSUIT")
    if not path or not os.access(path, os.X_OK):
        pytest.skip("PURSUIT names no command to compare with")
    return path


def overlap(a, b):
    """Intersection over union of two boxes, left, top, width, height."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(width, 0) * max(height, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)
