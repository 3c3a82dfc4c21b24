#!/usr/bin/env python3
"""Annotated sequences into which another scene is cut, so that the target is away and comes back.

    cuts.py OUT DATA...      folders of sequences with truth (`frames.csv` beside images, or NAME.csv beside NAME.mp4)

Of each sequence its first 120 frames: sixty, then sixty of a sequence of another source, scaled to the same size, without the
target, then sixty more. Sequences with fewer than 50 frames, or whose target is out of view before the cut, are left out. For

    pursuit eval OUT --protocol long-term

which says how often a target that is not there was called `tracking`, and how many were found again.
"""
import pathlib
import sys

try:
    import cv2
    from clips import clips, pictures, truth, write
except ImportError as e:
    sys.exit(f"{e}: install xtask/peers/requirements.txt")

BEFORE, AWAY, AFTER = 60, 60, 60


def source(clip):
    return clip.name.split("_")[0]


def stranger(found, index):
    """A sequence of another source: half the list away, or the next after that."""
    others = (found[(index + len(found) // 2 + k) % len(found)] for k in range(1, len(found)))
    return next((other for other in others if source(other) != source(found[index])), None)


def away(clip, shape):
    frames = pictures(clip, truth(clip)[1], AWAY)
    while len(frames) < AWAY:
        frames += frames[::-1]
    return [cv2.resize(frame, shape, interpolation=cv2.INTER_AREA) for frame in frames[:AWAY]]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out, found = pathlib.Path(sys.argv[1]), clips(sys.argv[2:])
    made = 0
    for index, clip in enumerate(found):
        boxes, names = truth(clip)
        count = min(len(boxes), BEFORE + AFTER)
        half, other = count // 2, stranger(found, index)
        if count < 50 or other is None or None in boxes[:half + 5]:
            continue
        frames = pictures(clip, names, count)
        shown = [*zip(frames[:half], boxes), *((frame, None) for frame in away(other, frames[0].shape[1::-1])), *zip(frames[half:], boxes[half:])]
        write(out / clip.stem, shown)
        made += 1
    print(f"{made} sequences in {out}")


main()
