#!/usr/bin/env python3
"""An independent decoder (ffmpeg) plays our overlay videos: every frame, at its time, and after the program was killed.

Reads the path of the program from the environment variable PURSUIT.
"""
import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import imageio_ffmpeg
import numpy as np

FFMPEG = imageio_ffmpeg.get_ffmpeg_exe()
PURSUIT = os.environ["PURSUIT"]


def frames(video, width, height):
    """All frames as an array [n, height, width, 3]; ffmpeg must find nothing to complain about."""
    command = [FFMPEG, "-v", "error", "-i", video, "-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    if done.stderr:
        sys.exit(f"ffmpeg complains about {video}: {done.stderr.decode()}")
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3)


def rows(folder):
    with open(folder / "trajectory.csv", newline="") as file:
        return list(csv.DictReader(file))


def whole_run(folder):
    track = [PURSUIT, "track", "scene:table-tennis", "--tracker", "ball", "--to", "60", "--out", folder]
    subprocess.run(track, check=True, capture_output=True)
    trajectory, video = rows(folder), frames(folder / "overlay.mp4", 640, 480)
    if not len(trajectory) == len(video) == 61:
        sys.exit(f"{len(trajectory)} rows but {len(video)} frames; 61 of each were expected")
    # The measured box is drawn in green where the trajectory says it is.
    row = next(r for r in trajectory[30:] if r["state"] == "tracking")
    x, y, w, h = (float(row[f"meas_{k}"]) for k in "xywh")
    edge = video[int(row["frame"]), int(y + h / 2) - 2 : int(y + h / 2) + 3, int(x) - 3 : int(x) + 4].astype(int)
    if not ((edge[..., 1] > edge[..., 0] + 25) & (edge[..., 1] > edge[..., 2] + 25)).any() and not (edge.min(axis=-1) > 200).any():
        sys.exit(f"neither green nor white at the left edge of the measured box of frame {row['frame']}")
    print("overlay.mp4: 61 frames, each box where the trajectory says")


def killed_run(folder):
    track = [PURSUIT, "track", "scene:table-tennis?duration=600", "--tracker", "ball", "--out", folder]
    process = subprocess.Popen(track, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline:
        if (folder / "trajectory.csv").exists() and len((folder / "trajectory.csv").read_text().splitlines()) > 150:
            break
        time.sleep(0.05)
    process.kill()
    process.wait()
    done, video = len(rows(folder)), frames(folder / "overlay.mp4", 640, 480)
    # A fragment lasts a second (30 frames), the queue holds a few more.
    if not done - 60 <= len(video) <= done:
        sys.exit(f"killed after {done} frames; the video has {len(video)}")
    print(f"overlay.mp4: {len(video)} of {done} frames play after the program was killed")


with tempfile.TemporaryDirectory() as place:
    for name, check in (("whole", whole_run), ("killed", killed_run)):
        (pathlib.Path(place) / name).mkdir()
        check(pathlib.Path(place) / name)
