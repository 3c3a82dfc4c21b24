"""Visual target tracking: predict, find, judge, follow, find again.

>>> import pursuit
>>> track = pursuit.track("scene:drift?seed=7&duration=1", tracker="mosse")
>>> [e.state for e in track][-1]
'tracking'

track          follow a target, or several, through a video, a folder of images, a camera or a scene
Tracker        one target, frame by frame, on numpy arrays; MultiTracker: many
Associator     tracks of the boxes that a detector of your own finds, on numpy arrays
Detector       find targets in frames; detect: in one frame or a whole input
trackers       every tracker by name; help(pursuit.trackers.kcf) shows its parameters
estimation     Kalman filters, IMM, particle filters, smoothers, association on arrays of N tracks x T steps
measure        a run in metres: velocity, acceleration, events, fits, each with its error; calibrate: keep the ruler
eval           measure trackers on annotated sequences; reproduce: run a paper's experiment again
cv2            OpenCV's tracker interface; integrations: got10k, VOT, TrackEval, supervision, Ultralytics
ray            pursuit.ray.batch: a manifest of clips on a cluster

Boxes are (left, top, width, height) in pixels; pixel (row i, column j) covers [j, j+1) x [i, i+1). Times are in seconds.
Every error is a PursuitError with one line that says what was wrong, where, and what would mend it.
"""

from . import estimation
from ._eval import eval, reproduce  # noqa: A004
from ._measure import Measured, calibrate, measure
from ._native import (
    Associator,
    ComputationError,
    Detector,
    Estimate,
    InputError,
    MultiTracker,
    OutputError,
    PursuitError,
    StateError,
    Tracker,
    Tracks,
    UsageError,
    __version__,
)
from ._registry import detectors, trackers
from ._track import Track, detect, track

__all__ = [
    "Associator",
    "ComputationError",
    "Detector",
    "Estimate",
    "InputError",
    "Measured",
    "MultiTracker",
    "OutputError",
    "PursuitError",
    "StateError",
    "Track",
    "Tracker",
    "Tracks",
    "UsageError",
    "__version__",
    "calibrate",
    "detect",
    "detectors",
    "estimation",
    "eval",
    "measure",
    "reproduce",
    "track",
    "trackers",
]


def __getattr__(name):
    # Modules that most programs do not need, or whose names are those of other packages.
    if name in ("cv2", "integrations", "ray"):
        import importlib

        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module 'pursuit' has no attribute {name!r}")
