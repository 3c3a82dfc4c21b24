#!/usr/bin/env python3
"""Points whose true places are known in pictures of real clips: the tracker `point` beside OpenCV's pyramidal Lucas-Kanade.

    points.py FOLDER... [--set KEY=VALUE]... [--fit | --there-and-back]

One picture of each annotated sequence in the folders is turned, stretched, moved, lit and blurred by known amounts over 75 frames, saved as JPEG with noise, while a strip of another one passes before it
from frame 20 on. Ten points of each are followed: five corners and five anywhere. A point is told right where it is `tracking`, in view, and within 8 pixels. --fit prints the weights of the score: those of each
folder, judged on the others, and those of all.

--there-and-back takes the clips themselves: up to 120 frames, then the same backward, so that a point must be where it was when the same picture comes again, and end where it began. Four corners of
each target are followed. "Apart": told both times, more than 8 pixels apart. "Outside": told outside of the target's box by more than a tenth of that and four pixels.
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
# Frames of a clip that are played there and back.
THERE = 120


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


def followed(folder, points, settings, out):
    """What `pursuit track` says of the points of a folder of pictures, row by row."""
    call = [os.environ["PURSUIT"], "-q", "track", str(folder), "--no-video", "--format", "jsonl", "--out", str(out), *(f"--point={x},{y}" for x, y in points), *(f"--set={s}" for s in settings)]
    subprocess.run(call, check=True, stdout=subprocess.DEVNULL)
    return map(json.loads, open(out / "trajectory.jsonl"))


def ours(folder, points, truth, settings, out):
    """Of each frame and point: the frame, whether it is in view, whether it is told, how far off it is, and the figures behind the score."""
    rows = []
    for row in followed(folder, points, settings, out):
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


def there_and_back(clip, settings, work):
    """Of four corners of a clip's target: rows, told, told outside of the box, told both times, of these apart, points, told in the end, of these elsewhere than at the start."""
    boxes, names = sequences.truth(clip)
    frames = sequences.pictures(clip, names, THERE)
    n, count = len(frames), np.zeros(8, int)
    folder = work / "there-and-back"
    folder.mkdir(parents=True)
    for k, frame in enumerate(frames + frames[-2::-1]):
        cv2.imwrite(str(folder / f"{k:05d}.jpg"), frame, [cv2.IMWRITE_JPEG_QUALITY, 95])
    box = lambda k: [float(v) for v in boxes[k]] if k < len(boxes) and boxes[k] and "" not in boxes[k] else None
    x, y, w, h = box(0)
    inner = np.zeros(frames[0].shape[:2], np.uint8)
    inner[max(0, int(y + .15 * h)):int(y + .85 * h) + 1, max(0, int(x + .15 * w)):int(x + .85 * w) + 1] = 255
    corners = cv2.goodFeaturesToTrack(cv2.cvtColor(frames[0], cv2.COLOR_BGR2GRAY), 4, .02, max(4, min(w, h) / 5), mask=inner)
    if corners is None:
        return count
    points = [tuple(map(float, p)) for p in corners.reshape(-1, 2) + .5]
    places = {}
    for row in followed(folder, points, settings, work / "out"):
        if row["state"] == "tracking":
            places[row["target"] - 1, row["frame"]] = np.array(row["box"][:2]) + np.array(row["box"][2:]) / 2
    for t, start in enumerate(points):
        for k in range(1, 2 * n - 2):
            again, here = min(k, 2 * n - 2 - k), places.get((t, k))
            count[0] += 1
            if here is None:
                continue
            count[1] += 1
            if now := box(again):
                low, size = np.array(now[:2]), np.array(now[2:])
                count[2] += np.any(here < low - .1 * size - 4) or np.any(here > low + 1.1 * size + 4)
            before = places.get((t, again)) if k >= n else None
            if before is not None:
                count[3:5] += 1, np.hypot(*(here - before)) > NEAR_PX
        last = places.get((t, 2 * n - 2))
        count[5:8] += 1, last is not None, last is not None and np.hypot(*(last - start)) > NEAR_PX
    return count


def turn_about(folders, settings):
    """Prints that for each folder, and for all."""
    counts = []
    for folder in folders:
        count = np.zeros(8, int)
        for clip in sequences.clips([folder]):
            with tempfile.TemporaryDirectory() as work:
                count += there_and_back(clip, settings, pathlib.Path(work))
        counts.append(count)
    for name, (rows, told, outside, both, apart, points, back, elsewhere) in zip([*folders, "all"], [*counts, sum(counts)]):
        print(f"{name:24} told {told / rows:.4f}, outside {outside} of {told}, apart {apart} of {both}, told in the end {back} of {points}, elsewhere {elsewhere}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--there-and-back", action="store_true")
    a = parser.parse_args()
    if a.there_and_back:
        return turn_about(a.folders, a.set)
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
