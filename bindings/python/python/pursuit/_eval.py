"""`pursuit eval` and `pursuit reproduce` as functions."""

import datetime
import hashlib
import os

from . import _native


def _build():
    """The version and a digest of the extension: what another build left is run again."""
    with open(_native.__file__, "rb") as file:
        digest = hashlib.file_digest(file, "sha256") if hasattr(hashlib, "file_digest") else hashlib.sha256(file.read())
    return f"{_native.__version__}+python.{digest.hexdigest()[:16]}"


def eval(
    datasets,
    trackers=None,
    *,
    results=None,
    out="pursuit-out/eval",
    protocol="ope",
    sequences=None,
    attributes=None,
    jobs=1,
    report=True,
    against=None,
    channels="rgb",
    **parameters,
):
    """Measures trackers on annotated sequences; returns what results.json holds, a dict.

    datasets: a folder of sequences (OTB, VOT, GOT-10k, UAV123, TLD, Princeton, MOTChallenge, frames.csv), or a list of
    such. trackers: names; without, all of the registry, or none where results are given; and trackers of yours, in a list
    or, under names of your choice, in a dict: a class, or a function without arguments, that makes an object with

        init(frame, box)    frame: uint8 of (height, width) or (height, width, 3); box: left, top, width, height in pixels
        update(frame)       returns the box; or (ok, box); or (box, score); or an object with box, state and score, such as an
                            Estimate; or None where the target is not seen

    Trackers of yours are run anew at each call, and an exception ends one on its sequence. channels: "rgb" or "bgr", the
    order in which they are given colour. results: a dict of names with folders of trajectories made before, by any program:
    SEQUENCE.csv of pursuit, or result files of OTB, GOT-10k and VOT. attributes: a CSV file with attributes of the sequences.
    out: where boxes/, tables/, curves/, results.json and report.html are kept; a second call runs only what is missing.
    protocol: "ope", "long-term", "reset", "sre" or "tre". sequences: comma-separated patterns. jobs: sequences worked on at
    once. against: a results.json to compare with. parameters: KEY of every tracker of the registry, or through a dict:
    eval(…, **{"kcf.interpolation": 0.02}).

    Raises UsageError for names that there are not, InputError where there is nothing to evaluate.
    """
    datasets = [datasets] if isinstance(datasets, (str, os.PathLike)) else list(datasets)
    if trackers is None:
        trackers = [] if results else list(_native.trackers())
    if isinstance(trackers, str) or callable(trackers):
        trackers = [trackers]
    if not isinstance(trackers, dict):
        trackers = {tracker if isinstance(tracker, str) else tracker.__name__: tracker for tracker in trackers}
    return _native.evaluate(
        datasets,
        list(trackers.items()),
        list((results or {}).items()),
        out,
        protocol=protocol,
        sequences=sequences,
        attributes=attributes,
        jobs=jobs,
        report=report,
        against=against,
        build=_build(),
        started=datetime.datetime.now(datetime.timezone.utc).isoformat(),
        channels=channels,
        parameters=parameters,
    )


def reproduce(paper, *, out=None, seeds=None, dataset=None):
    """Runs a paper's experiment again; returns its figures beside ours, a dict.

    paper: "ball", "qu2010", "zhai2024", "zhu2014" or "gao2007". out: a folder for results and pictures. seeds: how many to
    average over. dataset: sequences with depth to compare on as well, of zhai2024 alone.
    """
    return _native.reproduce(paper, out=out, seeds=seeds, dataset=dataset)
