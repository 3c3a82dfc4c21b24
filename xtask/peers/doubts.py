#!/usr/bin/env python3
"""What a tracker says of its boxes, held against the truth: states, and the words for why a target is not tracked.

    doubts.py DATA... [--tracker NAME]      folders of sequences with truth (`frames.csv` beside images, or NAME.csv beside NAME.mp4)

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
    a = parser.parse_args()
    clips = [c for d in a.data for c in sorted(d.iterdir()) if (c / "frames.csv").exists() or c.suffix == ".mp4"]
    said, states = collections.Counter(), collections.Counter()
    for clip in clips:
        with tempfile.TemporaryDirectory() as out:
            program = [os.environ["PURSUIT"], "-q", "track", str(clip), "--tracker", a.tracker, "--no-video", "--format", "jsonl", "--out", out]
            subprocess.run(program, check=True, stdout=subprocess.DEVNULL)
            targets = dict(truth(clip))
            for line in open(pathlib.Path(out, "trajectory.jsonl")):
                record = json.loads(line)
                if record["frame"] in targets:
                    word = "tracking" if record["state"] == "tracking" else record["doubt"] or "none"
                    box = judged(record["box"], targets[record["frame"]])
                    said[box, word] += 1
                    states[box, record["state"]] += 1
    if not said:
        sys.exit("there are no annotated sequences")
    print(f"{a.tracker}, {len(clips)} sequences, frames")
    for words, counts in ((STATES, states), (WORDS, said)):
        print(f"{'box':8}" + "".join(f"{w:>10}" for w in words))
        for box in BOXES:
            print(f"{box:8}" + "".join(f"{counts[box, w]:10}" for w in words))
    right, absent = sum(said["right", w] for w in WORDS), sum(said["absent", w] for w in WORDS)
    wrong = sum(said[box, w] for box in ("near", "away") for w in WORDS)
    claimed = said["near", "tracking"] + said["away", "tracking"]
    print(f"right, not tracking: {1 - said['right', 'tracking'] / max(right, 1):.3f}; wrong, tracking: {claimed / max(wrong, 1):.3f}; "
          f"absent, tracking: {said['absent', 'tracking'] / max(absent, 1):.3f}")


main()
