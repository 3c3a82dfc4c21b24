"""Whole inputs: a video, a folder of images, a camera, a scene, or frames that Python has."""

import html
import json
import os

import numpy as np

from . import _native
from ._picture import scrubber
from ._progress import watched

#: The columns of trajectory.csv, in its order.
COLUMNS = (
    "frame time_s target state x y w h score pred_x pred_y pred_w pred_h meas_x meas_y meas_w meas_h update_ms "
    "class doubt"
).split()
_TYPES = {"frame": "i8", "target": "i8", "state": "U8", "class": "U64", "doubt": "U8"}
_NOTHING = (np.nan,) * 4


def _row(e):
    boxes = (*e.box, e.score, *(e.prediction or _NOTHING), *(e.measurement or _NOTHING))
    update = np.nan if e.update_ms is None else e.update_ms
    return (e.frame, e.time_s, e.target, e.state, *boxes, update, e.class_name or "", e.doubt or "")


class Track:
    """The estimates of one input: iterate over it, or ask for the whole with run() or a to_ method. Who iterates again begins with
    the first.

    facts: what run.json holds, as a dict, once the end is reached.
    """

    def __init__(self, frames, name, clip=None, progress=False):
        self._frames, self._clip, self._name = iter(frames), clip, name
        if progress:
            self._frames = iter(watched(self._frames, clip.frame_count if clip is not None else None, name))
        self.estimates = []
        self.facts = None

    def __iter__(self):
        # list() asks for the length in between, which follows the input to its end.
        told = 0
        while True:
            yield from self.estimates[told:]
            told = len(self.estimates)
            estimates = next(self._frames, None)
            if estimates is None:
                break
            self.estimates.extend(estimates)
        if self._clip is not None and self.facts is None and self._clip.facts is not None:
            self.facts = json.loads(self._clip.facts)

    def run(self):
        """Follows the input to its end; returns this."""
        for _ in self:
            pass
        return self

    def stop(self):
        """Ends the run after the frame in hand; what was found stays."""
        if self._clip is not None:
            self._clip.stop()
        self._frames = iter(())

    def __len__(self):
        return len(self.run().estimates)

    def to_numpy(self):
        """A structured array, a row for every frame and target, with the columns of trajectory.csv; NaN is an empty cell."""
        rows = [_row(e) for e in self.run().estimates]
        return np.array(rows, dtype=[(name, _TYPES.get(name, "f8")) for name in COLUMNS])

    def boxes(self):
        """Left, top, width, height in pixels, (rows, 4)."""
        return np.array([e.box for e in self.run().estimates], dtype=float).reshape(-1, 4)

    def to_pandas(self):
        """A pandas.DataFrame with the columns of trajectory.csv."""
        import pandas

        return pandas.DataFrame({name: column for name, column in self._columns()})

    def to_polars(self):
        """A polars.DataFrame with the columns of trajectory.csv; nulls where nothing is known."""
        import polars

        return polars.DataFrame({name: column for name, column in self._columns()}).fill_nan(None)

    def _columns(self):
        table = self.to_numpy()
        return [(name, table[name].copy()) for name in COLUMNS]

    def plot(self, axes=None):
        """Draws centre, size and score against time with matplotlib; returns the axes, an array of three."""
        from matplotlib import pyplot

        table = self.to_numpy()
        if axes is None:
            _, axes = pyplot.subplots(3, sharex=True, figsize=(8, 6))
        for target in np.unique(table["target"]):
            rows = table[table["target"] == target]
            time = rows["time_s"]
            axes[0].plot(time, rows["x"] + rows["w"] / 2, label=f"x of {target}")
            axes[0].plot(time, rows["y"] + rows["h"] / 2, label=f"y of {target}")
            axes[1].plot(time, rows["w"], label=f"width of {target}")
            axes[1].plot(time, rows["h"], label=f"height of {target}")
            axes[2].plot(time, rows["score"], label=f"score of {target}")
        for axis, label in zip(axes, ("centre, px", "size, px", "score")):
            axis.set_ylabel(label)
            axis.legend(loc="upper right", fontsize="small")
        axes[2].set_xlabel("time, s")
        return axes

    def states(self):
        """How many frames ended in each state, a dict."""
        counts = dict.fromkeys(("tracking", "unsure", "occluded", "lost"), 0)
        for e in self.run().estimates:
            counts[e.state] += 1
        return counts

    def _repr_html_(self):
        states = ", ".join(f"{count} {state}" for state, count in self.states().items())
        pictures = scrubber(*self._clip.pictures, self.estimates) if self._clip is not None else ""
        return f"<div>{pictures}<b>{html.escape(self._name)}</b>: {len(self.estimates)} estimates, {states}</div>"

    def __repr__(self):
        return f"<pursuit.Track of {self._name!r}: {len(self.estimates)} estimates so far>"


def _frames_of(clip):
    while (estimates := clip.next()) is not None:
        yield estimates


def _boxes(box):
    if box is None:
        return []
    flat = np.asarray(box, dtype=float)
    if flat.ndim == 1:
        flat = flat[None]
    if flat.ndim != 2 or flat.shape[1] != 4:
        raise _native.UsageError("box is (left, top, width, height) in pixels, or a list of such")
    return flat.tolist()


def track(
    input,
    box=None,
    *,
    tracker=None,
    detect=None,
    device=None,
    many=False,
    depth=None,
    depth_options=None,
    out=None,
    overwrite=False,
    resume=False,
    video=None,
    overlay=None,
    plots=False,
    formats=(),
    publish=None,
    publish_options=None,
    start=None,
    end=None,
    stride=None,
    region=None,
    resize=None,
    fps=None,
    channels="rgb",
    progress=False,
    **parameters,
):
    """Follows a target, or several, through an input; returns a Track, an iterator of Estimate.

    input: a video, a folder of images, "camera:0", "rtsp://…", "scene:NAME?key=value"; or an array (frames, height, width)
    or (frames, height, width, 3), or any iterable of frames, which is asked for a frame when the one before is done with.
    box: (left, top, width, height) in pixels of the first frame, or a list of them; without, the truth that came with the
    input, or what `detect` finds. device: what networks by file run on, "cpu", "cuda", "tensorrt", "openvino" or "coreml"; where
    onnxruntime's library cannot hand them there they run on the processor, with a warning. many: follow everything that the
    detector finds. depth: depth images that belong to the
    input, by name; of arrays also an iterable of uint16 (height, width) in millimetres. depth_options: how those named are
    read, a dict. out: a folder for the files of `pursuit track`; resume: go on with the interrupted run in it. video: whether
    there is an overlay; overlay: "full" or "minimal". publish: a broker; publish_options: how, a dict. start, end, stride: the
    frames to look at. region: the part of the picture to look at, left, top, width, height; resize: its size, a factor or
    (columns, rows). Boxes are always in pixels of the whole input. fps: frames a second instead of the input's own times, of
    arrays 30 without. channels: the order of colours in arrays, "rgb" or "bgr". progress: say how far it has come, by tqdm where that
    is installed, else in a line on standard error.
    parameters: of the tracker, see help(pursuit.trackers.NAME); detect__KEY of the detector, many__KEY and acquire__KEY of
    how its targets are told apart and made sure of.

    Raises UsageError, InputError or OutputError before the first frame, and InputError where an input breaks off. What an
    iterable raises ends the run, whose files are closed, and is raised.

    >>> import pursuit
    >>> pursuit.track("scene:drift?seed=7&duration=1", tracker="mosse").boxes().shape
    (30, 4)
    """
    is_path = isinstance(input, (str, os.PathLike))
    depth_is_path = isinstance(depth, (str, os.PathLike))
    config = dict(
        boxes=_boxes(box) or None,
        tracker=tracker,
        detect=detect,
        device=device,
        many=many or None,
        depth=os.fspath(depth) if depth_is_path else None,
        depth_options=depth_options,
        out=None if out is None else os.fspath(out),
        overwrite=overwrite or None,
        resume=resume or None,
        video=video,
        overlay=overlay,
        plots=plots or None,
        formats=list(formats) or None,
        publish=publish,
        publish_options=publish_options,
        to=end,
        stride=stride,
        region=None if region is None else [float(v) for v in region],
        resize=_size(resize),
        fps=None if fps is None else float(fps),
        parameters=_models(tracker, parameters) or None,
    )
    config["from"] = start
    if out is None and (plots or formats or video or overlay or resume):
        raise _native.UsageError("plots, formats, video, overlay and resume are of files: name a folder with out=")
    if is_path:
        if depth is not None and not depth_is_path:
            raise _native.UsageError("depth arrays belong to frames given as arrays; of an input, name the depth")
        name = os.fspath(input)
        clip = _native.Clip(input=name, **config)
    else:
        name = "arrays"
        if out is not None and not hasattr(input, "__len__"):
            # The overlay is drawn while the next frame is made, and a generator may use the memory of a frame again.
            input = (np.array(frame) if isinstance(frame, np.ndarray) else frame for frame in input)
        clip = _native.Clip(input, depths=None if depth_is_path else depth, channels=channels, **config)
    return Track(_frames_of(clip), name, clip, progress)


def _size(resize):
    """As the command takes it: a factor, or columns and rows."""
    if resize is None or isinstance(resize, str):
        return resize
    if np.ndim(resize) == 0:
        return repr(float(resize))
    columns, rows = resize
    return f"{int(columns)}x{int(rows)}"


def _models(tracker, parameters):
    """A word given for a group names its model."""
    schema = _native.parameters(tracker or _native.DEFAULT_TRACKER)
    groups = {
        p["name"] for p in schema if p["type"] == "group" and any(q["name"] == "model" for q in p["parameters"])
    }
    return {f"{k}__model" if k in groups and isinstance(v, str) else k: v for k, v in parameters.items()}


def detect(input, detector="motion", *, channels="rgb", **parameters):
    """What a detector finds: in one frame a list of (box, confidence), in an iterable of frames an iterator of such lists.

    input: a frame, uint8 (height, width) or (height, width, 3), or uint16 (height, width); or any iterable of frames (an
    array of four dimensions too). detector: one of pursuit.detectors. Boxes are left, top, width, height in pixels, the
    best first.
    """
    found = _native.Detector(detector, channels=channels, **parameters)
    if isinstance(input, np.ndarray) and (input.ndim == 2 or (input.ndim == 3 and input.shape[2] in (1, 3))):
        return found.detect(input)
    return (found.detect(frame) for frame in input)
