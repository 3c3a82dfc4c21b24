#!/usr/bin/env python3
"""Annotated sequences into which another scene is cut, so that the target is away and comes back.

    cuts.py OUT DATA...      folders of sequences with truth (`frames.csv` beside images, or NAME.csv beside NAME.mp4)

Of each sequence its first 120 frames: sixty, then sixty of a sequence of another source, scaled to the same size, without the
target, then sixty more. Sequences with fewer than 50 frames, or whose target is out of view before the cut, are left out. For

    pursuit eval OUT --protocol long-term

which says how often a target that is not there was called `tracking`, and how many were found again.
"""
import csv
import pathlib
import sys

BEFORE, AWAY, AFTER = 60, 60, 60


def truth(clip):
    """The boxes of a sequence as they are written, `None` where the target is out of view, and the names of its images."""
    rows = list(csv.DictReader(open(clip / "frames.csv" if clip.is_dir() else clip.with_suffix(".csv"))))
    written = [[row[key].strip() for key in "xywh"] for row in rows]
    return [None if any(v in ("", "nan") for v in box) else box for box in written], [row.get("image") for row in rows]


def pictures(clip, names, count):
    if clip.is_dir():
        return [cv2.imread(str(clip / name)) for name in names[:count]]
    film, frames = cv2.VideoCapture(str(clip)), []
    while len(frames) < count:
        ok, frame = film.read()
        if not ok:
            break
        frames.append(frame)
    return frames


def source(clip):
    return clip.name.split("_")[0]


def stranger(clips, index):
    """A sequence of another source: half the list away, or the next after that."""
    others = (clips[(index + len(clips) // 2 + k) % len(clips)] for k in range(1, len(clips)))
    return next((other for other in others if source(other) != source(clips[index])), None)


def away(clip, shape):
    frames = pictures(clip, truth(clip)[1], AWAY)
    while len(frames) < AWAY:
        frames += frames[::-1]
    return [cv2.resize(frame, shape, interpolation=cv2.INTER_AREA) for frame in frames[:AWAY]]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out, folders = pathlib.Path(sys.argv[1]), map(pathlib.Path, sys.argv[2:])
    clips = [clip for folder in folders for clip in sorted(folder.iterdir()) if (clip / "frames.csv").exists() or clip.suffix == ".mp4"]
    made = 0
    for index, clip in enumerate(clips):
        boxes, names = truth(clip)
        count = min(len(boxes), BEFORE + AFTER)
        half, other = count // 2, stranger(clips, index)
        if count < 50 or other is None or None in boxes[:half + 5]:
            continue
        frames = pictures(clip, names, count)
        shown = [*zip(frames[:half], boxes), *((frame, None) for frame in away(other, frames[0].shape[1::-1])), *zip(frames[half:], boxes[half:])]
        folder = out / clip.stem
        (folder / "img").mkdir(parents=True, exist_ok=True)
        with open(folder / "frames.csv", "w") as table:
            table.write("index,image,x,y,w,h\n")
            for k, (frame, box) in enumerate(shown):
                cv2.imwrite(str(folder / f"img/{k:05d}.jpg"), frame, [cv2.IMWRITE_JPEG_QUALITY, 95])
                table.write(",".join([str(k), f"img/{k:05d}.jpg", *(box or ["nan"] * 4)]) + "\n")
        made += 1
    print(f"{made} sequences in {out}")


try:
    import cv2
except ImportError as e:
    sys.exit(f"{e}: install xtask/peers/requirements.txt")
cv2.setNumThreads(1)
main()
