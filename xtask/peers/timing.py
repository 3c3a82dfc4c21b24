"""What the comparisons of speed share: OpenCV's trackers, overlaps, means."""
import json, math, os, subprocess, sys, time

import cv2
import numpy as np

OURS = os.environ.get('PURSUIT', '')


def opencv(name):
    """A tracker of OpenCV as shipped, and its name in our tables."""
    make = {'csrt': cv2.TrackerCSRT_create, 'kcf': cv2.TrackerKCF_create}
    legacy = getattr(cv2, 'legacy', None)
    if legacy is not None:
        make['mosse'] = legacy.TrackerMOSSE_create
    return make[name]()


def whole(box):
    return tuple(int(round(v)) for v in box)


def update(tracker, image):
    """(whether it says that it sees the target, the box)"""
    try:
        return tracker.update(image)
    except cv2.error:
        return False, (0, 0, 0, 0)


def overlap(a, b):
    """Intersection over union of boxes x, y, w, h in the last axis."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    low, high = np.maximum(a[..., :2], b[..., :2]), np.minimum(a[..., :2] + a[..., 2:], b[..., :2] + b[..., 2:])
    shared = np.prod(np.clip(high - low, 0, None), axis=-1)
    union = a[..., 2] * a[..., 3] + b[..., 2] * b[..., 3] - shared
    return np.where(union > 0, shared / np.maximum(union, 1e-9), 0.0)


def geometric(values):
    return math.exp(sum(math.log(v) for v in values) / len(values))


def ours(*arguments):
    """What our program prints as JSON."""
    if not os.path.exists(OURS):
        sys.exit('the variable PURSUIT must name our program: run this through `cargo xtask peers`')
    done = subprocess.run([OURS, *arguments], stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)
