#!/usr/bin/env python3
"""Annotated sequences run backward, from the middle on, and from the middle back: other targets to start from, and other ways to go.

    turns.py OUT DATA...      folders of sequences with truth (`frames.csv` beside images, or NAME.csv beside NAME.mp4)

They lie in OUT/backward, OUT/later and OUT/earlier. Each begins where the target is first in view; those of fewer than twenty
frames are left out. For `pursuit eval OUT/backward`, `cargo xtask tune OUT/backward` and so on.
"""
import pathlib
import sys

try:
    from clips import clips, pictures, truth, write
except ImportError as e:
    sys.exit(f"{e}: install xtask/peers/requirements.txt")

LEAST = 20


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out, made = pathlib.Path(sys.argv[1]), 0
    for clip in clips(sys.argv[2:]):
        boxes, names = truth(clip)
        shown = list(zip(pictures(clip, names, len(boxes)), boxes))
        half = len(shown) // 2
        for turn, part in [("backward", shown[::-1]), ("later", shown[half:]), ("earlier", shown[half::-1])]:
            while part and not all(part[0][1] or [""]):
                part = part[1:]
            if len(part) >= LEAST:
                write(out / turn / clip.stem, part)
                made += 1
    print(f"{made} sequences in {out}")


main()
