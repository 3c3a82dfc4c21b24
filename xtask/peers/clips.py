"""Annotated sequences: a folder with `frames.csv` beside images, or NAME.csv beside NAME.mp4."""
import csv
import pathlib

import cv2

cv2.setNumThreads(1)


def clips(folders):
    """The sequences in these folders."""
    found = (clip for folder in folders for clip in sorted(pathlib.Path(folder).iterdir()))
    is_one = lambda clip: (clip / "frames.csv").exists() or clip.suffix == ".mp4" and clip.with_suffix(".csv").exists()
    return [clip for clip in found if is_one(clip)]


def truth(clip):
    """The boxes of a sequence as they are written (blank where nobody says), `None` where the target is out of view, and the names of its images."""
    rows = list(csv.DictReader(open(clip / "frames.csv" if clip.is_dir() else clip.with_suffix(".csv"))))
    written = [[row[key].strip() for key in "xywh"] for row in rows]
    return [None if "nan" in box else box for box in written], [row.get("image") for row in rows]


def pictures(clip, names, count):
    """The first `count` pictures of a sequence."""
    if clip.is_dir():
        return [cv2.imread(str(clip / name)) for name in names[:count]]
    film, frames = cv2.VideoCapture(str(clip)), []
    while len(frames) < count:
        ok, frame = film.read()
        if not ok:
            break
        frames.append(frame)
    return frames


def write(folder, shown):
    """A sequence of pictures, each with its box as it was written, `None` where the target is out of view."""
    (folder / "img").mkdir(parents=True, exist_ok=True)
    with open(folder / "frames.csv", "w") as table:
        table.write("index,image,x,y,w,h\n")
        for k, (frame, box) in enumerate(shown):
            cv2.imwrite(str(folder / f"img/{k:05d}.jpg"), frame, [cv2.IMWRITE_JPEG_QUALITY, 95])
            table.write(",".join([str(k), f"img/{k:05d}.jpg", *(box or ["nan"] * 4)]) + "\n")
