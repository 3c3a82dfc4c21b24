#!/usr/bin/env python3
"""Points whose true places are known in pictures of real clips: the tracker `point` beside OpenCV's pyramidal Lucas-Kanade.

    points.py FOLDER... [--set KEY=VALUE]... [--fit]

One picture of each annotated sequence in the folders is turned, stretched, moved, lit and blurred by known amounts over 75 frames, saved as JPEG with noise, while a strip of another one passes before it
from frame 20 on. Ten points of each are followed: five corners and five anywhere. A point is told right where it is `tracking`, in view, and within 8 pixels. --fit prints the weights of the score: those of each
folder, judged on the others, and those of all.
"""
import argparse
import json
import os
import pathlib
import subprocess
import tempfile

import clips as sequences
import cv2
import numpy as np

FRAMES, FROM, NEAR_PX, WINDOW = 75, 20, 8, (21, 21)


def chosen(grey, random):
    """Five corners and five other points, in continuous pixels."""
    height, width = grey.shape
    inside = lambda x, y: .15 * width < x < .85 * width and .15 * height < y < .85 * height
    corners = cv2.goodFeaturesToTrack(grey, 40, .02, 15)
    points = [tuple(map(float, p)) for p in (corners if corners is not None else np.empty((0, 1, 2))).reshape(-1, 2) if inside(*p)]
    random.shuffle(points)
    points = points[:5]
    while len(points) < 10:
        x, y = random.uniform(.15 * width, .85 * width), random.uniform(.15 * height, .85 * height)
        # A user points at something: of plain places one in ten.
        if grey[int(max(0, y - 15)):int(y + 16), int(max(0, x - 15)):int(x + 16)].std() > 8 or random.random() < .1:
            points.append((x, y))
    return points


def film(folder, picture, other, seed):
    """Writes a clip; the points, and for each frame where each is and whether it is in view."""
    random = np.random.default_rng(seed)
    height, width = picture.shape[:2]
    points = chosen(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), random)
    turn, stretch, shift = random.uniform(0, 25), random.uniform(0, .3), random.uniform(5, 40)
    phases, speeds = random.uniform(0, 2 * np.pi, 5), random.uniform(.5, 2, 5)
    noise, quality, light, blur = random.uniform(1, 5), int(random.uniform(40, 90)), random.uniform(0, .25), random.uniform(0, 1.5)
    wave = lambda k, i: np.sin(phases[i] + speeds[i] * 2 * np.pi * k / FRAMES) - np.sin(phases[i])
    strip, truth = int(.2 * width), []
    folder.mkdir(parents=True)
    for k in range(FRAMES):
        matrix = cv2.getRotationMatrix2D((width / 2, height / 2), turn * wave(k, 0), np.exp(stretch * wave(k, 1)))
        matrix[:, 2] += shift * wave(k, 2), .5 * shift * wave(k, 3)
        frame = cv2.warpAffine(picture, matrix, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        left = int((k - FROM) * width / 30) - strip
        left, right = (max(0, left), min(width, left + strip)) if k >= FROM else (0, 0)
        if right > left:
            frame[:, left:right] = other[:, left:right]
        frame = frame.astype(np.float32) * (1 + light * wave(k, 4) / 2)
        if blur > .5:
            frame = cv2.GaussianBlur(frame, (0, 0), blur)
        frame += random.normal(0, noise, frame.shape)
        cv2.imwrite(str(folder / f"{k:05d}.jpg"), np.clip(frame, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])
        places = [matrix @ (x, y, 1) for x, y in points]
        in_view = lambda x, y: 0 <= x < width and 0 <= y < height and not left <= x < right
        # OpenCV counts from the middle of the first pixel, we from its corner.
        truth.append([(x + .5, y + .5, in_view(x, y)) for x, y in places])
    return [(x + .5, y + .5) for x, y in points], truth


def ours(folder, points, truth, settings, out):
    """Of each frame and point: the frame, whether it is in view, whether it is told, how far off it is, and the figures behind the score."""
    call = [os.environ["PURSUIT"], "-q", "track", str(folder), "--no-video", "--format", "jsonl", "--out", str(out), *(f"--point={x},{y}" for x, y in points), *(f"--set={s}" for s in settings)]
    subprocess.run(call, check=True, stdout=subprocess.DEVNULL)
    rows = []
    for row in map(json.loads, open(out / "trajectory.jsonl")):
        if row["frame"] == 0:
            continue
        x, y, in_view = truth[row["frame"]][row["target"] - 1]
        off = lambda box: float(np.hypot(box[0] + box[2] / 2 - x, box[1] + box[3] / 2 - y)) if box else None
        rows.append((row["frame"], in_view, row["state"] == "tracking", off(row["box"]), off(row["measurement"]), row["diagnostics"]))
    return rows


def opencv(folder, points, truth):
    """The same of Lucas-Kanade, there and back within a pixel."""
    rows, alive = [], np.ones(len(points), bool)
    at, before = np.array(points, np.float32).reshape(-1, 1, 2) - .5, None
    for k in range(FRAMES):
        now = cv2.imread(str(folder / f"{k:05d}.jpg"), cv2.IMREAD_GRAYSCALE)
        if before is not None:
            there, found, _ = cv2.calcOpticalFlowPyrLK(before, now, at, None, winSize=WINDOW, maxLevel=3)
            back, again, _ = cv2.calcOpticalFlowPyrLK(now, before, there, None, winSize=WINDOW, maxLevel=3)
            alive &= (found.ravel() == 1) & (again.ravel() == 1) & (np.linalg.norm((back - at).reshape(-1, 2), axis=1) < 1)
            at = there
            for t, (x, y, in_view) in enumerate(truth[k]):
                rows.append((k, in_view, bool(alive[t]), float(np.hypot(at[t, 0, 0] + .5 - x, at[t, 0, 1] + .5 - y)), None, None))
        before = now
    return rows


def say(name, rows):
    told = [r for r in rows if r[2]]
    right = [r[3] for r in told if r[1] and r[3] <= NEAR_PX]
    hidden = [r[2] for r in rows if not r[1]]
    share = lambda part, of: f"{part / of:.4f}" if of else "-"
    errors = f"{np.median(right):.3f} {np.percentile(right, 95):.3f}" if right else "-"
    print(f"{name:24} in view told right {share(len(right), sum(r[1] for r in rows))}  told wrong {share(len(told) - len(right), len(told))}  hidden told {share(sum(hidden), len(hidden))}  px {errors}")


def figures(rows):
    """What the score is made of, and whether the place was right."""
    z = lambda c: np.arctanh(np.clip(c, -.999, .999))
    seen = [(z(f["likeness"]), z(f["usual"]), z(f["likeness"]) - z(f["rival"]), float(f["margin"] > 0), f["margin"], in_view and off <= NEAR_PX) for _, in_view, _, _, off, f in rows if off is not None and "likeness" in f]
    return np.array(seen)


def fitted(data):
    """Constant and weights of a logistic regression, by Newton's steps."""
    x, y, w = np.c_[np.ones(len(data)), data[:, :-1]], data[:, -1], np.zeros(data.shape[1])
    for _ in range(100):
        p = 1 / (1 + np.exp(-x @ w))
        w += np.linalg.solve((x * (p * (1 - p))[:, None]).T @ x + .01 * np.eye(x.shape[1]), x.T @ (y - p) - .01 * np.r_[0, w[1:]])
    return w


def judged(name, weights, data):
    told = np.c_[np.ones(len(data)), data[:, :-1]] @ weights > 0
    print(f"{name:24} {np.round(weights, 2)}  above one half {told.mean():.3f}, wrong of that {1 - data[told, -1].mean():.4f}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--fit", action="store_true")
    a = parser.parse_args()
    pictures = []
    for folder in a.folders:
        for clip in sequences.clips([folder]):
            frames = sequences.pictures(clip, sequences.truth(clip)[1], 21)
            width = frames[-1].shape[1]
            size = min(1, 640 / width)
            pictures.append((folder, cv2.resize(frames[-1], None, fx=size, fy=size, interpolation=cv2.INTER_AREA)))
    own, other, by_folder = [], [], {folder: [] for folder in a.folders}
    with tempfile.TemporaryDirectory() as work:
        for seed, (folder, picture) in enumerate(pictures):
            clip, size = pathlib.Path(work) / f"clip{seed}", picture.shape[1::-1]
            passing = cv2.resize(pictures[(seed + 7) % len(pictures)][1], size)
            points, truth = film(clip, picture, passing, seed)
            rows = ours(clip, points, truth, a.set, pathlib.Path(work) / f"out{seed}")
            by_folder[folder] += rows
            own += rows
            other += opencv(clip, points, truth)
    for name, rows in (("point", own), ("OpenCV", other)):
        say(name, rows)
        say(f"{name}, before the strip", [r for r in rows if r[0] < FROM])
        say(f"{name}, after the strip", [r for r in rows if r[0] >= FROM + 42])
    if a.fit:
        for folder in a.folders if len(a.folders) > 1 else []:
            judged(folder, fitted(figures(by_folder[folder])), figures([r for f in a.folders if f != folder for r in by_folder[f]]))
        judged("all", fitted(figures(own)), figures(own))


main()
