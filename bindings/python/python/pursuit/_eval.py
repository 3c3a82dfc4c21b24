"""`pursuit eval` and `pursuit reproduce` as functions."""

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
    out="pursuit-out/eval",
    protocol="ope",
    sequences=None,
    jobs=1,
    report=True,
    against=None,
    **parameters,
):
    """Measures trackers on annotated sequences; returns what results.json holds, a dict.

    datasets: a folder of sequences (OTB, VOT, GOT-10k, UAV123, TLD, Princeton, MOTChallenge, frames.csv), or a list of
    such. trackers: names; all without. out: where boxes/, results.json and report.html are kept; a second call runs only
    what is missing. protocol: "ope", "long-term" or "reset". sequences: comma-separated patterns. jobs: sequences worked on
    at once. parameters: KEY of every tracker, or through a dict: eval(…, **{"kcf.interpolation": 0.02}).

    Raises UsageError for names that there are not, InputError where there is nothing to evaluate.
    """
    datasets = [datasets] if isinstance(datasets, (str, os.PathLike)) else list(datasets)
    names = list(_native.trackers()) if trackers is None else [trackers] if isinstance(trackers, str) else list(trackers)
    return _native.evaluate(
        datasets,
        names,
        out,
        protocol=protocol,
        sequences=sequences,
        jobs=jobs,
        report=report,
        against=against,
        build=_build(),
        parameters=parameters,
    )


def reproduce(paper, *, out=None, seeds=None, dataset=None):
    """Runs a paper's experiment again; returns its figures beside ours, a dict.

    paper: "ball", "qu2010", "zhai2024", "zhu2014" or "gao2007". out: a folder for results and pictures. seeds: how many to
    average over. dataset: sequences with depth to compare on as well, of zhai2024 alone.
    """
    return _native.reproduce(paper, out=out, seeds=seeds, dataset=dataset)
