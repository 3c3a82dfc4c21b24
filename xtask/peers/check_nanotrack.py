#!/usr/bin/env python3
"""NanoTrack v3 in onnxruntime, tracked by a numpy rendering of its released tracker, gives the boxes that ours gives.

    check_nanotrack.py [SEQUENCE ...]      names below ../shared/data/sot and sot2, all of a small choice without any

Both see the same decoded frames. With the weights rounded to half precision, as we ship them, the reference takes every step from our box of
the frame before: half of its answers must agree to .02 px and 95 % to .2 px (where two points of the answer are as good, either may be
taken). Left alone, the two part at such a point and may end elsewhere (UAV123_car16_1: AUC .52 or .66 by the processor), so AUC, ours and
theirs on their own way, is printed and not judged. Skips, saying so, where the footage or the networks are absent.
"""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared/data"
CHOICE = ["OTB_Couple", "OTB_David", "OTB_Deer", "VOT_bag", "OTB_MountainBike", "UAV123_car16_1"]


class Reference:
    """The released tracker's equations: see crates/inference/src/siamese."""

    def __init__(self, folder, rounded):
        options = ort.SessionOptions()
        options.intra_op_num_threads = 1
        options.log_severity_level = 3

        def session(file, free=False):
            return ort.InferenceSession(model(folder / file, free, rounded), options)

        self.backbone = session("nanotrack_backbone.onnx")
        self.template_backbone = session("nanotrack_backbone.onnx", free=True)
        self.head = session("nanotrack_head.onnx")
        hann = np.hanning(15)
        self.window = np.outer(hann, hann).ravel()
        axis = (np.arange(15) - 7) * 16.0
        self.x, self.y = (m.ravel() for m in np.meshgrid(axis, axis))

    def extent(self):
        context = 0.5 * self.size.sum()
        return math.sqrt((self.size[0] + context) * (self.size[1] + context))

    def crop(self, image, side, samples):
        side = round(side)
        left, top = (int(math.floor(c - (side + 1) / 2 + 0.5)) for c in self.center)
        height, width = image.shape[:2]
        pads = [max(0, -top), max(0, top + side - height), max(0, -left), max(0, left + side - width)]
        if any(pads):
            image = cv2.copyMakeBorder(image, *pads, cv2.BORDER_CONSTANT, value=[int(m) for m in self.mean])
        patch = image[top + pads[0]:top + pads[0] + side, left + pads[2]:left + pads[2] + side]
        if side != samples:
            patch = cv2.resize(patch, (samples, samples))
        return patch.transpose(2, 0, 1)[None].astype(np.float32)

    def start(self, image, box):
        self.center = np.array([box[0] + (box[2] - 1) / 2, box[1] + (box[3] - 1) / 2])
        self.size = np.array(box[2:], float)
        self.mean = image.mean(axis=(0, 1))
        self.template = self.template_backbone.run(None, {"input": self.crop(image, self.extent(), 127)})[0]

    def track(self, image):
        extent = self.extent()
        scale = 127 / extent
        search = self.crop(image, extent * (255 / 127), 255)
        features = self.backbone.run(None, {"input": search})[0]
        logits, d = self.head.run(None, {"input1": self.template, "input2": features})
        logits, d = logits.reshape(2, -1).astype(float), d.reshape(4, -1).astype(float)
        score = 1 / (1 + np.exp(logits[0] - logits[1]))
        w, h = d[0] + d[2], d[1] + d[3]
        cx, cy = self.x + (d[2] - d[0]) / 2, self.y + (d[3] - d[1]) / 2

        def padded(w, h):
            return np.sqrt((w + (w + h) / 2) * (h + (w + h) / 2))

        def change(r):
            return np.maximum(r, 1 / r)

        s = change(padded(w, h) / padded(*(self.size * scale)))
        r = change((self.size[0] / self.size[1]) / (w / h))
        penalty = np.exp(-(r * s - 1) * 0.138)
        best = np.argmax(penalty * score * (1 - 0.455) + self.window * 0.455)
        rate = penalty[best] * score[best] * 0.348
        size = self.size * (1 - rate) + np.array([w[best], h[best]]) / scale * rate
        height, width = image.shape[:2]
        center = self.center + np.array([cx[best], cy[best]]) / scale
        self.center = np.clip(center, 0, [width, height])
        self.size = np.clip(size, 10, np.maximum([width, height], 10))
        return [*(self.center - self.size / 2), *self.size]


def model(path, free, rounded):
    """The network, for images of any size if free (the export names the search image's), with weights rounded as we ship them."""
    network = onnx.load(str(path))
    for value in [*network.graph.input, *network.graph.output] if free else []:
        for d in value.type.tensor_type.shape.dim[2:]:
            d.dim_param = "side_of_" + value.name
    for initializer in network.graph.initializer if rounded else []:
        numbers = onnx.numpy_helper.to_array(initializer)
        if numbers.dtype == np.float32:
            numbers = numbers.astype(np.float16).astype(np.float32)
            initializer.CopyFrom(onnx.numpy_helper.from_array(numbers, initializer.name))
    return network.SerializeToString()


def sequence(name):
    for folder in ["sot", "sot2"]:
        video, images = DATA / folder / f"{name}.mp4", DATA / folder / name
        if video.exists():
            rows = list(csv.DictReader(open(video.with_suffix(".csv"))))
            capture = cv2.VideoCapture(str(video))
            frames = [capture.read()[1] for _ in rows]
        elif images.exists():
            rows = list(csv.DictReader(open(images / "frames.csv")))
            frames = [cv2.imread(str(images / row["image"])) for row in rows]
        else:
            continue
        return frames, np.array([[float(row[k]) for k in "xywh"] for row in rows])
    sys.exit(f"no sequence {name}")


def auc(boxes, truth):
    """Mean over 21 thresholds of the share of frames whose overlap exceeds it."""
    boxes, truth = np.array(boxes), np.array(truth)
    known = np.isfinite(truth).all(1)
    boxes, truth = boxes[known], truth[known]
    low, high = np.maximum(boxes[:, :2], truth[:, :2]), np.minimum(boxes[:, :2] + boxes[:, 2:], truth[:, :2] + truth[:, 2:])
    shared = np.clip(high - low, 0, None).prod(1)
    overlap = shared / (boxes[:, 2:].prod(1) + truth[:, 2:].prod(1) - shared)
    return np.mean([(overlap > t).mean() for t in np.linspace(0, 1, 21)])


def ours(program, frames, box):
    height, width = frames[0].shape[:2]
    process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    lines = []
    reader = threading.Thread(target=lambda: lines.extend(process.stdout))
    reader.start()
    process.stdin.write(f"{width} {height} {' '.join(map(repr, map(float, box)))}\n".encode())
    for frame in frames:
        process.stdin.write(np.ascontiguousarray(frame[:, :, ::-1]).tobytes())
    process.stdin.close()
    reader.join()
    if process.wait():
        sys.exit("our program failed")
    return [list(map(float, line.split()[:4])) for line in lines[:-1]], float(lines[-1])


def steps(reference, frames, box, boxes):
    """What the reference answers in each frame when it stands where we stood in the frame before."""
    reference.start(frames[0], box)
    answers = []
    for frame, (left, top, width, height) in zip(frames[1:], boxes):
        answers.append(reference.track(frame))
        reference.center, reference.size = np.array([left + width / 2, top + height / 2]), np.array([width, height])
    return answers


def main():
    models = DATA / "models/nanotrack_v3"
    if not models.exists():
        print("skipped: NanoTrack beside its released tracker, for want of ../shared/data")
        return
    program = pathlib.Path(os.environ["EXAMPLES"]) / "follow"
    peers = json.loads((DATA / "peers.json").read_text())["trackers"]
    wrong = []
    for name in sys.argv[1:] or CHOICE:
        frames, truth = sequence(name)
        first = int(np.argmax(np.isfinite(truth).all(1)))
        frames, truth = frames[first:], truth[first:]
        theirs, ms = {}, {}
        for rounded in [True, False]:
            reference = Reference(models, rounded)
            reference.start(frames[0], truth[0])
            start = time.perf_counter()
            theirs[rounded] = [reference.track(frame) for frame in frames[1:]]
            ms[rounded] = 1e3 * (time.perf_counter() - start) / max(1, len(frames) - 1)
        boxes, our_ms = ours(program, frames, truth[0])
        answers = steps(Reference(models, True), frames, truth[0], boxes)
        apart = np.sort(np.abs(np.array(boxes) - np.array(answers)).max(1))
        median, most = apart[len(apart) // 2], apart[int(0.95 * len(apart))]
        areas = [auc([truth[0], *b], truth) for b in (boxes, theirs[True], theirs[False])]
        stored = peers["NanoTrack v3 onnxruntime"]["sequences"].get(name, {}).get("auc", math.nan)
        print(f"{name:24s} one step apart: median {median:.4f} px, 95 % below {most:.4f}, most {apart[-1]:.2f}; AUC {areas[0]:.4f} ours,"
              f" {areas[1]:.4f} theirs, {areas[2]:.4f} released weights, {stored:.4f} stored; ms a frame {our_ms:.2f} ours, {ms[True]:.2f} theirs", flush=True)
        if not (median <= 0.02 and most <= 0.2):
            wrong.append(name)
    if wrong:
        sys.exit(f"disagree on {', '.join(wrong)}")


try:
    import cv2
    import numpy as np
    import onnx
    import onnxruntime as ort
except ImportError as e:
    sys.exit(f"{e}: install xtask/peers/requirements.txt")
cv2.setNumThreads(1)
main()
