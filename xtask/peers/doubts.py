#!/usr/bin/env python3
"""What a tracker says of its boxes, held against the truth: states, and the words for why a target is not tracked.

    doubts.py DATA... [--tracker NAME] [--set KEY=VALUE ...] [--cuts FILE]

DATA are folders of sequences with truth (`frames.csv` beside images, or NAME.csv beside NAME.mp4). A table of cuts (`sequence,first,last`:
`absences.csv` beside this file has spans in which targets go away, and some in which they stay) leaves but those sequences, each
started on its true box in the first frame that is named and has one.

A box is right where it overlaps the target by one half, near by one tenth, else away; absent where there is no target.
"""
import argparse
import collections
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

BOXES = ("right", "near", "away", "absent")
WORDS = ("tracking", "covered", "changed", "confused", "gone", "none")
STATES = ("tracking", "unsure", "occluded", "lost")


def truth(clip):
    """The boxes of a sequence by frame, None where the target is out of view."""
    for row in csv.DictReader(open(clip / "frames.csv" if clip.is_dir() else clip.with_suffix(".csv"))):
        written = [row[key].strip() for key in "xywh"]
        yield int(row["index"]), None if any(v in ("", "nan") for v in written) else [float(v) for v in written]


def overlap(a, b):
    w = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    h = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    shared = max(w, 0.0) * max(h, 0.0)
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)


def judged(box, target):
    if target is None:
        return "absent"
    shared = overlap(box, target) if box else 0.0
    return "right" if shared >= 0.5 else "near" if shared >= 0.1 else "away"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", nargs="+", type=pathlib.Path)
    parser.add_argument("--tracker", default="pursuit")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--cuts", type=pathlib.Path, metavar="FILE")
    a = parser.parse_args()
    clips = [c for d in a.data for c in sorted(d.iterdir()) if (c / "frames.csv").exists() or c.suffix == ".mp4"]
    cuts = None
    if a.cuts:
        cuts = {row["sequence"]: (int(row["first"]), int(row["last"])) for row in csv.DictReader(open(a.cuts))}
        clips = [c for c in clips if c.stem in cuts]
    said, states, folders = collections.Counter(), collections.Counter(), collections.Counter()
    for clip in clips:
        targets = dict(truth(clip))
        with tempfile.TemporaryDirectory() as out:
            program = [os.environ["PURSUIT"], "-q", "track", str(clip), "--tracker", a.tracker, "--no-video", "--format", "jsonl", "--out", out]
            program += [word for s in a.set for word in ("--set", s)]
            start = None
            if cuts:
                first, last = cuts[clip.stem]
                start = next(f for f in sorted(targets) if f >= first and targets[f])
                program += ["--from", str(start), "--to", str(last), "--box", ",".join(map(str, targets[start]))]
            subprocess.run(program, check=True, stdout=subprocess.DEVNULL)
            for line in open(pathlib.Path(out, "trajectory.jsonl")):
                record = json.loads(line)
                # The frame that the box was given in says nothing.
                if record["frame"] in targets and record["frame"] != start:
                    word = "tracking" if record["state"] == "tracking" else record["doubt"] or "none"
                    box = judged(record["box"] if record["state"] != "lost" else None, targets[record["frame"]])
                    said[box, word] += 1
                    states[box, record["state"]] += 1
                    folders[clip.parent.name, box, record["state"] == "tracking"] += 1
    if not said:
        sys.exit("there are no annotated sequences")
    print(f"{a.tracker}, {len(clips)} sequences, frames")
    for words, counts in ((STATES, states), (WORDS, said)):
        print(f"{'box':8}" + "".join(f"{w:>10}" for w in words))
        for box in BOXES:
            print(f"{box:8}" + "".join(f"{counts[box, w]:10}" for w in words))
    for folder in sorted({f for f, _, _ in folders}) + [None]:
        count = lambda boxes, told: sum(n for (f, box, t), n in folders.items() if box in boxes and t in told and folder in (f, None))
        told = {word: count(boxes, (True,)) / max(count(boxes, (True, False)), 1) for word, boxes in
                (("right", ("right",)), ("wrong", ("near", "away")), ("absent", ("absent",)))}
        shown = count(("right", "near", "away"), (True, False))
        print(f"{folder or 'all'}: right, not tracking: {1 - told['right']:.3f}; wrong, tracking: {told['wrong']:.3f}; "
              f"absent, tracking: {told['absent']:.3f}; right of all that are in view: {count(('right',), (True, False)) / max(shown, 1):.3f}")


main()
