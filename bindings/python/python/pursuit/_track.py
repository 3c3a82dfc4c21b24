"""Whole inputs: a video, a folder of images, a camera, a scene, or frames that Python has."""

import base64
import json
import os

import numpy as np

from . import _native
from ._picture import png, with_box

#: The columns of trajectory.csv, in its order.
COLUMNS = (
    "frame time_s target state x y w h score pred_x pred_y pred_w pred_h meas_x meas_y meas_w meas_h update_ms".split()
)
_TYPES = {"frame": "i8", "target": "i8", "state": "U8"}
_NOTHING = (np.nan,) * 4


def _row(e):
    boxes = (*e.box, e.score, *(e.prediction or _NOTHING), *(e.measurement or _NOTHING))
    update = np.nan if e.update_ms is None else e.update_ms
    return (e.frame, e.time_s, e.target, e.state, *boxes, update)


class Track:
    """The estimates of one input: iterate over it once, or ask for the whole with run() or a to_ method.

    facts: what run.json holds, as a dict, once the end is reached.
    """

    def __init__(self, frames, name, clip=None):
        self._frames, self._clip, self._name = frames, clip, name
        self.estimates = []
        self.facts = None

    def __iter__(self):
        for estimates in self._frames:
            for estimate in estimates:
                self.estimates.append(estimate)
                yield estimate
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
        counts = dict.fromkeys(("tracking", "occluded", "lost"), 0)
        for e in self.run().estimates:
            counts[e.state] += 1
        return counts

    def _repr_html_(self):
        import html

        states = ", ".join(f"{count} {state}" for state, count in self.states().items())
        picture = ""
        thumbnail = self._clip.thumbnail if self._clip is not None else None
        if thumbnail is not None and self.estimates:
            image, scale = thumbnail
            image = with_box(image, [v / scale for v in self.estimates[0].box])
            picture = f'<img src="data:image/png;base64,{base64.b64encode(png(image)).decode()}"/><br/>'
        return f"<div>{picture}<b>{html.escape(self._name)}</b>: {len(self.estimates)} estimates, {states}</div>"

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
    many=False,
    depth=None,
    out=None,
    overwrite=False,
    video=None,
    plots=False,
    formats=(),
    start=None,
    end=None,
    stride=None,
    region=None,
    fps=None,
    channels="rgb",
    **parameters,
):
    """Follows a target, or several, through an input; returns a Track, an iterator of Estimate.

    input: a video, a folder of images, "camera:0", "rtsp://…", "scene:NAME?key=value"; or an array (frames, height, width)
    or (frames, height, width, 3), or any iterable of frames. box: (left, top, width, height) in pixels of the first frame,
    or a list of them; without, the truth that came with the input, or what `detect` finds. many: follow everything that the
    detector finds. depth: depth images that belong to the input. out: a folder for the files of `pursuit track`. start,
    end, stride: the frames to look at. region: the part of the picture to look at, left, top, width, height. fps: frames a
    second instead of the input's own times. channels: the order of colours in arrays, "rgb" or "bgr".
    parameters: of the tracker, see help(pursuit.trackers.NAME); detect__KEY of the detector.

    Raises UsageError, InputError or OutputError before the first frame, and InputError where an input breaks off.

    >>> import pursuit
    >>> pursuit.track("scene:drift?seed=7&duration=1", tracker="mosse").boxes().shape
    (30, 4)
    """
    if not isinstance(input, (str, os.PathLike)):
        refused = dict(detect=detect, many=many or None, out=out, depth=depth, region=region, stride=stride)
        given = [name for name, value in refused.items() if value is not None]
        if given:
            raise _native.UsageError(f"{', '.join(given)}: only of inputs that pursuit opens itself, not of arrays")
        return _of_arrays(input, box, tracker, fps or 30.0, channels, parameters)
    config = dict(
        input=os.fspath(input),
        boxes=_boxes(box) or None,
        tracker=tracker,
        detect=detect,
        many=True if many else None,
        depth=None if depth is None else os.fspath(depth),
        out=None if out is None else os.fspath(out),
        overwrite=True if overwrite else None,
        video=video,
        plots=True if plots else None,
        formats=list(formats) or None,
        region=None if region is None else [float(v) for v in region],
        to=end,
        stride=stride,
        fps=None if fps is None else float(fps),
        parameters=_models(tracker, parameters) or None,
    )
    config["from"] = start
    if out is None and (plots or formats or video):
        raise _native.UsageError("plots, formats and video are files: name a folder with out=")
    clip = _native.Clip(**config)
    return Track(_frames_of(clip), os.fspath(input), clip)


def _models(tracker, parameters):
    """A word given for a group names its model."""
    schema = _native.parameters(tracker or _native.DEFAULT_TRACKER)
    groups = {
        p["name"] for p in schema if p["type"] == "group" and any(q["name"] == "model" for q in p["parameters"])
    }
    return {f"{k}__model" if k in groups and isinstance(v, str) else k: v for k, v in parameters.items()}


def _of_arrays(frames, box, tracker, fps, channels, parameters):
    boxes = _boxes(box)
    if not boxes:
        raise _native.UsageError("nothing to track: give box=(left, top, width, height) in pixels of the first frame")
    name = tracker or _native.DEFAULT_TRACKER
    trackers = [_native.Tracker(name, fps=fps, channels=channels, **parameters) for _ in boxes]

    def follow():
        for index, frame in enumerate(frames):
            if index == 0:
                known = [t.init(frame, b) for t, b in zip(trackers, boxes)]
            else:
                known = [t.update(frame) for t in trackers]
            yield [e.of_target(number) for number, e in enumerate(known, 1)]

    return Track(follow(), "arrays")


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
