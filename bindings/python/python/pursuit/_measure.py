"""`pursuit measure` and `pursuit calibrate` as functions."""

import os

import numpy as np

from . import _native


def _text(value):
    """Numbers as the command line takes them, separated by commas; texts and paths as they are."""
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return ",".join(repr(float(v)) for v in value)


def _ruler(scale, target_size, plane, origin, axis, angle, y_down, camera, true_fps, click_error):
    return {
        "scale": _text(scale),
        "target_size": target_size,
        "plane": list(plane),
        "origin": _text(origin),
        "axis": _text(axis),
        "angle_deg": None if angle is None else float(angle),
        "y_down": bool(y_down) or None,
        "camera": _text(camera),
        "true_fps": None if true_fps is None else float(true_fps),
        "click_error_px": None if click_error is None else float(click_error),
    }


class Measured:
    """What was measured of a run.

    columns: the columns of measure.csv by name, arrays (words: lists); NaN where nothing is said. events: those of
    measure-events.csv. facts: what measure.json holds, a dict. files: what was written.
    """

    def __init__(self, facts, columns, events, files):
        self.facts, self.columns, self.events, self.files = facts, columns, events, files

    def __getitem__(self, name):
        """A column."""
        return self.columns[name]

    def fit(self, name, index=0):
        """A parameter of a fit with its standard deviation: (value, error)."""
        for parameter in self.facts["fits"][index]["parameters"]:
            if parameter["name"] == name:
                return parameter["value"], parameter["error"]
        names = ", ".join(p["name"] for p in self.facts["fits"][index]["parameters"])
        raise KeyError(f"the fit has no {name}; it has {names}")

    def to_pandas(self):
        """A pandas.DataFrame with the columns of measure.csv."""
        import pandas

        return pandas.DataFrame(self.columns)

    def to_polars(self):
        """A polars.DataFrame with the columns of measure.csv; nulls where nothing is said."""
        import polars

        return polars.DataFrame({name: np.asarray(column) for name, column in self.columns.items()}).fill_nan(None)

    def __repr__(self):
        rows = len(self.columns["frame"])
        return f"<Measured: {rows} rows, {len(self.facts['targets'])} targets, {len(self.facts['events'])} events>"


def measure(
    run,
    *,
    calibration=None,
    scale=None,
    target_size=None,
    plane=(),
    origin=None,
    axis=None,
    angle=None,
    y_down=False,
    camera=None,
    true_fps=None,
    click_error=None,
    method=None,
    window=None,
    bounces=True,
    point=None,
    unsure=False,
    unit=None,
    fits=(),
    lines=(),
    zones=(),
    between=(),
    out=None,
    formats=(),
    plots=True,
):
    """Measures a run in metres, as `pursuit measure` does; returns a Measured.

    run: its folder, or its trajectory.csv or .jsonl. calibration: a calibration.toml; without one that in the run's folder or
    beside its input. The ruler may be said here: scale "100,400,600,400=0.50m", target_size "7cm", plane ["412,300=0,2.4m",
    …], origin and axis (x, y) in pixels, angle in degrees, camera a file of OpenCV's, true_fps of slow motion, click_error in
    pixels. method: "smoother", "savitzky-golay" or "differences". point: "center", "bottom" or "top" of the box. fits:
    ["parabola", "sine:x@0.5-2"]. lines, zones: ["goal=2,0,2,1.5"] in the unit of the results. between: ["1,2"]. out: a folder
    for the files, with formats ("jsonl", "parquet", "xlsx") and plots; without it nothing is written.

    Raises UsageError for a ruler that nothing can be measured with, or a run of which nothing can be said.
    """
    ruler = _ruler(scale, target_size, plane, origin, axis, angle, y_down, camera, true_fps, click_error)
    how = {
        "calibration": _text(calibration),
        "method": method,
        "window": window,
        "bounces": None if bounces else False,
        "point": point,
        "unsure": bool(unsure) or None,
        "unit": unit,
        "fits": list(fits),
        "lines": list(lines),
        "zones": list(zones),
        "between": list(between),
        "formats": list(formats),
        "plots": None if plots else False,
    }
    return Measured(*_native.measure(run, ruler, how, out))


def calibrate(
    path,
    *,
    picture=None,
    scale=None,
    target_size=None,
    plane=(),
    origin=None,
    axis=None,
    angle=None,
    y_down=False,
    camera=None,
    true_fps=None,
    click_error=None,
    overwrite=False,
):
    """Writes a calibration.toml; one that is there is replaced only with overwrite=True.

    picture: width and height of the pictures that the pixels are of; runs on others are then refused. The ruler is said as for
    measure.
    """
    ruler = _ruler(scale, target_size, plane, origin, axis, angle, y_down, camera, true_fps, click_error)
    _native.calibrate(path, ruler, None if picture is None else list(picture), overwrite)
