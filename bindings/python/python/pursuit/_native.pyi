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

class PursuitError(Exception): ...
class UsageError(PursuitError): ...
class InputError(PursuitError): ...
class OutputError(PursuitError): ...
class StateError(PursuitError): ...
class ComputationError(PursuitError): ...

class Estimate:
    """What a tracker says about one target in one frame. Boxes are (left, top, width, height) in pixels."""

    @property
    def frame(self) -> int: ...
    @property
    def target(self) -> int: ...
    @property
    def time_s(self) -> float: ...
    @property
    def box(self) -> Box: ...
    @property
    def score(self) -> float: ...
    @property
    def state(self) -> State: ...
    @property
    def class_name(self) -> str | None: ...
    @property
    def doubt(self) -> Literal["covered", "changed", "confused", "gone"] | None: ...
    @property
    def prediction(self) -> Box | None: ...
    @property
    def measurement(self) -> Box | None: ...
    @property
    def covariance(self) -> Floats | None: ...
    @property
    def velocity(self) -> tuple[float, float] | None: ...
    @property
    def diagnostics(self) -> dict[str, float]: ...
    @property
    def update_ms(self) -> float | None: ...

class Tracker:
    """Follows one target through frames given as arrays."""

    def __init__(
        self, name: str = "pursuit", *, fps: float = 30.0, channels: Literal["rgb", "bgr"] = "rgb", **parameters: Any
    ) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def parameters(self) -> dict[str, Any]: ...
    def init(
        self, frame: Frame, box: Iterable[float], *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> Estimate: ...
    def update(
        self, frame: Frame, *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> Estimate: ...
    def forecast(self, seconds: float) -> tuple[Box, Floats | None, tuple[float, float] | None]: ...
    def change(self, **parameters: Any) -> None: ...
    def save(self) -> bytes: ...
    @staticmethod
    def restore(saved: bytes) -> Tracker: ...
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
    def targets(self) -> list[int]: ...
    def add(
        self, frame: Frame, box: Iterable[float], *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> int: ...
    def remove(self, target: int) -> None: ...
    def update(
        self, frame: Frame, *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> list[Estimate]: ...
    def forecast(self, target: int, seconds: float) -> Box: ...
    def save(self) -> bytes: ...
    @staticmethod
    def restore(saved: bytes) -> MultiTracker: ...

class Tracks:
    """What is known of every target after a frame: arrays of one row for each, in ascending order of ids."""

    TRACKING: int
    UNSURE: int
    OCCLUDED: int
    LOST: int
    @property
    def ids(self) -> NDArray[np.int64]: ...
    @property
    def boxes(self) -> Floats: ...
    @property
    def scores(self) -> Floats: ...
    @property
    def states(self) -> NDArray[np.int8]: ...
    @property
    def detections(self) -> NDArray[np.int64]: ...
    @property
    def class_ids(self) -> NDArray[np.int64]: ...
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
        **parameters: Any,
    ) -> None: ...
    @property
    def targets(self) -> list[int]: ...
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
    ) -> Tracks: ...
    def forecast(self, target: int, seconds: float) -> Box: ...
    def save(self) -> bytes: ...
    @staticmethod
    def restore(saved: bytes) -> Associator: ...

class Detector:
    """Finds targets without being told where to look."""

    def __init__(
        self, name: str, *, channels: Literal["rgb", "bgr"] = "rgb", fps: float = 30.0, **parameters: Any
    ) -> None: ...
    @property
    def name(self) -> str: ...
    def detect(
        self, frame: Frame, *, time_s: float | None = None, depth: NDArray[np.uint16] | None = None
    ) -> list[tuple[Box, float]]: ...

class Clip:
    """The estimates of one input, frame by frame; what pursuit.track iterates over."""

    def __init__(
        self, frames: Iterable[Any] | None = None, *, depths: Iterable[Any] | None = None, channels: str = "rgb", **config: Any
    ) -> None: ...
    @property
    def frame_count(self) -> int | None: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def facts(self) -> str | None: ...
    @property
    def thumbnail(self) -> tuple[NDArray[np.uint8], tuple[float, float, float, float]] | None: ...
    def next(self) -> list[Estimate] | None: ...
    def stop(self) -> None: ...

def trackers() -> dict[str, str]: ...
def detectors() -> dict[str, str]: ...
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
