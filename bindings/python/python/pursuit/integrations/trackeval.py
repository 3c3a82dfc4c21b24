"""Many targets for TrackEval (pip install trackeval): results and truth in the layout of its MOT Challenge, and our own figures.

>>> import pursuit, trackeval  # doctest: +SKIP
>>> from pursuit.integrations.trackeval import export  # doctest: +SKIP
>>> track = pursuit.track("crowd.mp4", detect="motion", many=True)  # doctest: +SKIP
>>> config = export({"crowd": track}, "judged", truth={"crowd": "gt.txt"})  # doctest: +SKIP
>>> dataset = trackeval.datasets.MotChallenge2DBox(config)  # doctest: +SKIP
>>> metrics = [trackeval.metrics.HOTA(), trackeval.metrics.CLEAR(), trackeval.metrics.Identity()]  # doctest: +SKIP
>>> trackeval.Evaluator().evaluate([dataset], metrics)  # doctest: +SKIP
"""

import csv
import os
import pathlib

from .. import _native
from .._track import Track

#: Columns of a MOT Challenge file; frames, and the corners of boxes, are counted from 1.
_COLUMNS = 7
_STATES = ("tracking",)


def export(results, folder, *, tracker="pursuit", truth=None, benchmark="MOT15", split="train", states=_STATES):
    """Writes `FOLDER/trackers/BENCHMARK-SPLIT/TRACKER/data/SEQUENCE.txt` and, of the truth, `FOLDER/gt/BENCHMARK-SPLIT/SEQUENCE`
    with its list of sequences; returns the configuration, a dict, with which TrackEval's MotChallenge2DBox reads them.

    results: the folder of a batch, whose clips are the sequences; or a dict from the sequence's name to a Track, the estimates
    of one, the folder of a run, its trajectory.csv, or a MOT Challenge file. truth: a dict from the sequence's name to a MOT
    Challenge file (frame, id, left, top, width, height, whether it counts). states: of which states boxes are written, as
    `--format mot` does of those measured alone. The benchmark "MOT15" is the one of which TrackEval leaves out no classes.

    Raises InputError for files that cannot be read, UsageError for other results, OutputError for a folder that cannot be written.
    """
    sequences = {name: rows(result, states) for name, result in _sequences(results).items()}
    known = {name: _lines(path) for name, path in (truth or {}).items()}
    if not sequences:
        raise _native.UsageError("there are no results; name the folder of a batch, or a dict of sequences")
    if known and (missing := known.keys() ^ sequences.keys()):
        raise _native.UsageError(f"results and truth are not of the same sequences: {', '.join(sorted(missing))}")
    out, split_name = pathlib.Path(folder), f"{benchmark}-{split}"
    try:
        for name, found in sequences.items():
            text = "".join(f"{f + 1},{i},{x + 1:.3f},{y + 1:.3f},{w:.3f},{h:.3f},{s:.4f},-1,-1,-1\n" for f, i, x, y, w, h, s in found)
            _write(out / "trackers" / split_name / tracker / "data" / f"{name}.txt", text)
        for name, lines in known.items():
            place = out / "gt" / split_name / name
            length = max([int(line[0]) for line in lines] + [row[0] + 1 for row in sequences[name]], default=1)
            _write(place / "gt" / "gt.txt", "".join(",".join(line) + "\n" for line in lines))
            _write(place / "seqinfo.ini", f"[Sequence]\nname={name}\nseqLength={length}\n")
        _write(out / "gt" / "seqmaps" / f"{split_name}.txt", "".join(f"{name}\n" for name in ["name", *sequences]))
    except OSError as error:
        raise _native.OutputError(f"cannot write {error.filename}: {error.strerror}") from None
    return {
        "GT_FOLDER": str(out / "gt"),
        "TRACKERS_FOLDER": str(out / "trackers"),
        "BENCHMARK": benchmark,
        "SPLIT_TO_EVAL": split,
        "TRACKERS_TO_EVAL": [tracker],
    }


def scores(result, truth, *, threshold=0.5, states=_STATES):
    """HOTA, DetA, AssA, LocA, MOTA, MOTP, IDF1, IDR and IDP of one sequence, and the counts behind them, a dict.

    result: as of export. truth: a MOT Challenge file. threshold: the least overlap of a match, of CLEAR MOT and IDF1; HOTA has
    its own. Where TrackEval is given the same boxes it says the same.
    """
    counted = [line for line in _lines(truth) if len(line) < _COLUMNS or float(line[6]) != 0]
    true = [(int(f) - 1, int(i), float(x) - 1, float(y) - 1, float(w), float(h)) for f, i, x, y, w, h, *_ in counted]
    return _native.crowd_scores(true, [row[:6] for row in rows(result, states)], threshold)


def rows(result, states=_STATES):
    """(frame from 0, target, left, top, width, height, score) of every estimate of these states, boxes in pixels from 0."""
    if isinstance(result, (str, os.PathLike)):
        path = pathlib.Path(result)
        path = path / "trajectory.csv" if path.is_dir() else path
        if path.suffix != ".csv":
            read = (line[:_COLUMNS] if len(line) >= _COLUMNS else [*line, "1"] for line in _lines(path))
            return [(int(f) - 1, int(i), float(x) - 1, float(y) - 1, float(w), float(h), float(s)) for f, i, x, y, w, h, s in read]
        try:
            with path.open(newline="", encoding="utf-8") as file:
                table = [row for row in csv.DictReader(file) if row["state"] in states and row["x"]]
                numbers = [[float(row[k]) for k in ("x", "y", "w", "h", "score")] for row in table]
                return [(int(row["frame"]), int(row["target"]), *n) for row, n in zip(table, numbers)]
        except (OSError, KeyError, ValueError) as error:
            raise _native.InputError(f"{path} is no trajectory.csv that can be read: {error}") from None
    try:
        estimates = result.run().estimates if isinstance(result, Track) else result
        return [(e.frame, e.target, *e.box, e.score) for e in estimates if e.state in states]
    except (TypeError, AttributeError):
        raise _native.UsageError(f"a {type(result).__name__} holds no estimates; give a Track, a folder or a file") from None


def _sequences(results):
    if not isinstance(results, (str, os.PathLike)):
        return dict(results)
    clips = pathlib.Path(results) / "clips"
    found = sorted(clips.glob("*/trajectory.csv"))
    if not found:
        raise _native.InputError(f"{clips} holds no clip's trajectory.csv; name the folder of a batch")
    return {path.parent.name: path for path in found}


def _lines(path):
    try:
        with open(path, newline="", encoding="utf-8") as file:
            lines = [[cell.strip() for cell in line] for line in csv.reader(file) if line]
        for number, line in enumerate(lines, 1):
            if len(line) < 6:
                raise _native.InputError(f"{path}, line {number}: {len(line)} cells; a MOT Challenge file has frame,id,left,top,width,height,…")
            for cell in line[:_COLUMNS]:
                float(cell)
        return lines
    except (OSError, ValueError) as error:
        raise _native.InputError(f"{path} is no MOT Challenge file that can be read: {error}") from None


def _write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
