"""What the extension holds; import it from pursuit."""

import os
from collections.abc import Iterable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Box = tuple[float, float, float, float]
Frame = NDArray[np.uint8] | NDArray[np.uint16] | str | os.PathLike[str]
State = Literal["tracking", "unsure", "occluded", "lost"]
Floats = NDArray[np.float64]
BatchClip = tuple[str, str, str | None, str]

__version__: str
DEFAULT_TRACKER: str
COCO: list[str]

class PursuitError(Exception):
    """Every error of this package."""

class UsageError(PursuitError):
    """A name, a parameter, a box or an option that cannot be."""

class InputError(PursuitError):
    """An input or a frame that cannot be read."""

class OutputError(PursuitError):
    """Results that cannot be written."""

class StateError(PursuitError):
    """A tracker that was not started, or saved bytes that are none."""

class ComputationError(PursuitError):
    """Arithmetic that came to no result."""


class Estimate:
    """What a tracker says about one target in one frame. Boxes are (left, top, width, height) in pixels."""

    @property
    def frame(self) -> int:
        """Number of the frame in the input, from 0."""
    @property
    def target(self) -> int:
        """Number of the target, from 1."""
    @property
    def time_s(self) -> float:
        """Time of the frame, seconds."""
    @property
    def box(self) -> Box:
        """Where the target is believed to be: left, top, width, height, pixels of the input."""
    @property
    def score(self) -> float:
        """The probability, 0 to 1, that the box overlaps the target by one half."""
    @property
    def state(self) -> State:
        """Whether it is seen (tracking), in sight but not certain (unsure), behind something (occluded), or searched for
        all over (lost).
        """
    @property
    def class_name(self) -> str | None:
        """What it is, where the detector names what it finds."""
    @property
    def doubt(self) -> Literal["covered", "changed", "confused", "gone"] | None:
        """Why it is not tracked: covered, changed, confused or gone; None while it is."""
    @property
    def prediction(self) -> Box | None:
        """The box that the motion model expected, before the frame was looked at."""
    @property
    def measurement(self) -> Box | None:
        """The box that was seen, believed or not."""
    @property
    def covariance(self) -> Floats | None:
        """4 x 4, of centre x, centre y, width, height, pixels squared."""
    @property
    def velocity(self) -> tuple[float, float] | None:
        """Of the centre, pixels a second."""
    @property
    def diagnostics(self) -> dict[str, float]:
        """The tracker's own figures by name, as trajectory.jsonl has them."""
    @property
    def update_ms(self) -> float | None:
        """What the update took, milliseconds."""

class Tracker:
    """Follows one target through frames given as arrays."""

    def __init__(
        self, name: str = "pursuit", *, fps: float = 30.0, channels: Literal["rgb", "bgr"] = "rgb", **parameters: Any
    ) -> None: ...
    @property
    def name(self) -> str:
        """Its name in the registry."""
    @property
    def parameters(self) -> dict[str, Any]:
        """Every parameter as it is set, by name; groups are dicts."""
    def init(
        self, frame: Frame, box: Iterable[float], *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> Estimate:
        """Starts on the target inside box = (left, top, width, height), pixels. depth: millimetres, (height, width), 0
        where there is none. Raises UsageError or InputError.
        """
    def update(
        self, frame: Frame, *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> Estimate:
        """Looks at the next frame. time_s: its time, later than the one before; without, 1 / fps later. Raises
        StateError before init, InputError for a frame of another size.
        """
    def forecast(self, seconds: float) -> tuple[Box, Floats | None, tuple[float, float] | None]:
        """Where the target will be: the box, its covariance (4 x 4) and its velocity (pixels a second)."""
    def change(self, **parameters: Any) -> None:
        """Sets parameters of the running tracker; the groups motion, policy and search can be changed."""
    def save(self) -> bytes:
        """Everything needed to go on later, as bytes; pickle and copy do the same."""
    @staticmethod
    def restore(saved: bytes) -> Tracker:
        """Goes on from what save() gave. Raises StateError for bytes that are none."""
    def __copy__(self) -> Tracker: ...
    def __deepcopy__(self, memo: Any) -> Tracker: ...

class MultiTracker:
    """Follows many targets through frames given as arrays."""

    def __init__(
        self,
        tracker: str | None = None,
        *,
        detector: str | None = None,
        fps: float = 30.0,
        channels: Literal["rgb", "bgr"] = "rgb",
        **parameters: Any,
    ) -> None: ...
    @property
    def targets(self) -> list[int]:
        """Numbers of the targets that are known, ascending."""
    def add(
        self, frame: Frame, box: Iterable[float], *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> int:
        """Follows the target inside box from this frame on; returns its number."""
    def remove(self, target: int) -> None:
        """Forgets a target."""
    def update(
        self, frame: Frame, *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> list[Estimate]:
        """Looks at the next frame: an Estimate of every target, in order of their numbers."""
    def forecast(self, target: int, seconds: float) -> Box:
        """The box of a target so many seconds ahead."""
    def save(self) -> bytes:
        """Everything needed to go on later, as bytes."""
    @staticmethod
    def restore(saved: bytes) -> MultiTracker:
        """Goes on from what save() gave."""

class Tracks:
    """What is known of every target after a frame: arrays of one row for each, in ascending order of ids."""

    TRACKING: int
    UNSURE: int
    OCCLUDED: int
    LOST: int
    @property
    def ids(self) -> NDArray[np.int64]:
        """Numbers of the targets, ascending."""
    @property
    def boxes(self) -> Floats:
        """Left, top, width, height, pixels, (targets, 4)."""
    @property
    def scores(self) -> Floats:
        """Probability, 0 to 1, that the box is right and still of that target."""
    @property
    def states(self) -> NDArray[np.int8]:
        """TRACKING, UNSURE, OCCLUDED or LOST."""
    @property
    def detections(self) -> NDArray[np.int64]:
        """Row of the detection that each target took; -1: none."""
    @property
    def class_ids(self) -> NDArray[np.int64]:
        """Class of each target as it was given; -1: none."""
    def __len__(self) -> int: ...

class Associator:
    """Makes tracks of the boxes that a detector of your own finds, frame by frame."""

    def __init__(
        self,
        *,
        size: tuple[int, int] | None = None,
        fps: float = 30.0,
        channels: Literal["rgb", "bgr"] = "rgb",
        preset: Literal["sort", "bytetrack", "ocsort", "botsort", "cbiou"] | None = None,
        device: Literal["cpu", "cuda", "tensorrt", "openvino", "coreml"] = "cpu",
        **parameters: Any,
    ) -> None: ...
    @property
    def targets(self) -> list[int]:
        """Numbers of the targets that are known, ascending."""
    def update(
        self,
        boxes: ArrayLike,
        scores: ArrayLike | None = None,
        classes: ArrayLike | None = None,
        embeddings: ArrayLike | None = None,
        *,
        corners: bool = False,
        time_s: float | None = None,
        frame: Frame | None = None,
    ) -> Tracks:
        """Takes the detections of the next frame: boxes (n, 4) as left, top, width, height, or with corners left, top,
        right, bottom; scores (n,), 0 to 1; classes (n,), whole numbers; embeddings (n, d). frame: the picture, by
        which the camera's motion is taken out where motion__camera says so. Raises UsageError or InputError, after
        which everything is as before.
        """
    def forecast(self, target: int, seconds: float) -> Box:
        """The box of a target so many seconds ahead."""
    def save(self) -> bytes:
        """Everything needed to go on later, as bytes."""
    @staticmethod
    def restore(saved: bytes) -> Associator:
        """Goes on from what save() gave."""

class Detector:
    """Finds targets without being told where to look."""

    def __init__(
        self, name: str, *, channels: Literal["rgb", "bgr"] = "rgb", fps: float = 30.0, **parameters: Any
    ) -> None: ...
    @property
    def name(self) -> str:
        """Its name in the registry."""
    def detect(
        self, frame: Frame, *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> list[tuple[Box, float]]:
        """What it finds in a frame: (box, confidence) each, the best first."""

class Clip:
    """The estimates of one input, frame by frame; what pursuit.track iterates over."""

    def __init__(
        self, frames: Iterable[Any] | None = None, *, depths: Iterable[Any] | None = None, channels: str = "rgb", **config: Any
    ) -> None: ...
    @property
    def frame_count(self) -> int | None:
        """How many frames there will be, where the input knows."""
    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames looked at, pixels."""
    @property
    def facts(self) -> str | None:
        """What run.json holds, as JSON; None before the end."""
    @property
    def pictures(self) -> tuple[list[tuple[int, bytes]], list[float]]:
        """Small pictures spread over what was followed so far, (frame, JPEG) each, and (left, top, x, y): where they
        lie in the input, and how many of its pixels one of theirs is.
        """
    def next(self) -> list[Estimate] | None:
        """The estimates of the next frame, in order of the targets' numbers; None after the last."""
    def stop(self) -> None:
        """Ends the run after the frame in hand; files are closed properly."""

def trackers() -> dict[str, str]:
    """Every tracker and its sentence."""

def detectors() -> dict[str, str]:
    """Every detector and its sentence."""

def parameters(name: str, *, detector: bool = False) -> list[dict[str, Any]]: ...
def evaluate(
    datasets: list[str | os.PathLike[str]],
    trackers: list[tuple[str, Any]],
    given: list[tuple[str, str | os.PathLike[str]]],
    out: str | os.PathLike[str],
    *,
    protocol: str,
    sequences: str | None,
    attributes: str | os.PathLike[str] | None,
    jobs: int,
    report: bool,
    against: str | os.PathLike[str] | None,
    build: str,
    started: str,
    channels: str,
    parameters: dict[str, Any],
) -> dict[str, Any]: ...
def reproduce(
    paper: str,
    *,
    out: str | os.PathLike[str] | None = None,
    seeds: int | None = None,
    dataset: str | os.PathLike[str] | None = None,
) -> dict[str, Any]: ...
def measure(
    path: str | os.PathLike[str],
    ruler: dict[str, Any],
    how: dict[str, Any],
    out: str | os.PathLike[str] | None,
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any], list[str]]: ...
def calibrate(
    path: str | os.PathLike[str], ruler: dict[str, Any], picture: list[int] | None, overwrite: bool
) -> None: ...
def crowd_scores(
    truth: list[tuple[int, int, float, float, float, float]],
    said: list[tuple[int, int, float, float, float, float]],
    threshold: float,
) -> dict[str, float]: ...
def batch_jobs(text: str, name: str, common: dict[str, Any]) -> list[BatchClip]: ...
def batch_clip(
    job: BatchClip, out: str | os.PathLike[str], fetched: dict[str, str]
) -> tuple[Literal["done", "earlier", "failed", "stopped"], str | None]: ...
def batch_finished(job: BatchClip, out: str | os.PathLike[str]) -> bool: ...
def batch_failed(job: BatchClip, error: str) -> str: ...
def batch_summary(ends: list[tuple[str, str | None]], clips: int, seconds: float) -> str: ...
def kalman_filter(
    z: Floats,
    f: Floats,
    q: Floats,
    b: Floats,
    h: Floats,
    r: Floats,
    x0: Floats,
    p0: Floats,
    predict_first: bool,
    turn: tuple[float, float, bool] | None,
) -> tuple[Floats, Floats, Floats]: ...
def smooth(means: Floats, covariances: Floats, f: Floats, q: Floats, b: Floats) -> tuple[Floats, Floats]: ...
def imm_filter(
    z: Floats,
    f: Floats,
    q: Floats,
    h: Floats,
    r: Floats,
    switching: Floats,
    probabilities: Floats,
    x0: Floats,
    p0: Floats,
) -> tuple[Floats, Floats, Floats, Floats]: ...
def particle_filter(
    z: Floats,
    f: Floats,
    q: Floats,
    h: Floats,
    r: Floats,
    x0: Floats,
    p0: Floats,
    particles: int,
    resampling: str,
    threshold: float,
    regularisation: float,
    seed: int,
) -> tuple[Floats, Floats, Floats]: ...
def assign(cost: Floats, unassigned: float) -> tuple[NDArray[np.int64], float]: ...
def associate(
    means: Floats,
    covariances: Floats,
    detections: Floats,
    probability: float,
    likelihood: tuple[float, float] | None,
) -> NDArray[np.int64]: ...
def joint_probabilities(
    means: Floats,
    covariances: Floats,
    detections: Floats,
    probability: float,
    detection_probability: float,
    clutter_density: float,
    most_events: int,
) -> Floats: ...
def constant(axes: int, order: int, dt_s: float, noise: str, size: float) -> tuple[Floats, Floats]: ...
def singer(axes: int, dt_s: float, rate_per_s: float, acceleration_variance: float) -> tuple[Floats, Floats]: ...
