"""What the networks of `siamese.py` share: imports without what they would draw in, export to ONNX, and what is alike in their trackers."""
import importlib.util
import math
import sys
import types

import numpy as np
import onnx
import onnxscript  # PyTorch's exporter wants it
import onnxsim
import torch

IMAGENET = "mean = [123.675, 116.28, 103.53]\ndeviation = [58.395, 57.12, 57.375]\n"
RATIOS = [0.33, 0.5, 1, 2, 3]


def bare(*names):
    """Packages whose modules can be imported without all that their `__init__` would."""
    for name in names:
        if name in sys.modules:
            continue
        module = types.ModuleType(name)
        module.__path__ = list(importlib.util.find_spec(name).submodule_search_locations)
        sys.modules[name] = module


def module(forward, *parts):
    """A module of these parts, for the exporter."""
    made = torch.nn.Module()
    made.parts = torch.nn.ModuleList(parts)
    made.forward = forward
    return made.eval()


def export(path, part, images, names):
    inputs, outputs = names
    torch.onnx.export(part, images, str(path), input_names=inputs, output_names=outputs, external_data=False, verbose=False)
    # What does not depend on the images is computed once and for all, which OSTrack's file needs: a mask's places are `NonZero`.
    simple, sound = onnxsim.simplify(onnx.load(str(path)))
    assert sound, path
    onnx.save(simple, str(path))


def export_pair(folder, sides, template, search, parts, names):
    """Exports `template`, of an image to features, and `search`, of an image and those features to `names`."""
    images = [torch.zeros(1, 3, side, side) for side in sides]
    template, search = module(template, *parts), module(search, *parts)
    features = template(images[0])
    export(folder / "template.onnx", template, (images[0],), (["template"], ["features"]))
    export(folder / "search.onnx", search, (images[1], features), (["search", "features"], names))
    return "template = 'template.onnx'\nsearch = 'search.onnx'\n[config]\n"


def joined(features):
    """Features of several depths as one tensor."""
    return torch.cat(list(features), 1)


class Project:
    """What most trackers have in common."""
    masks = False

    def settle(self, look):
        """Before its last layers are fitted."""

    def finish(self, look):
        """Afterwards."""

    def alike(self, frame, box):
        """Frame and place that its tracker and ours take for the same."""
        return frame, box

    def scale(self, width, height):
        pad = (width + height) / 2
        return self.template / math.sqrt((width + pad) * (height + pad))


class Anchors(Project):
    """What trackers of SiamRPN's family have in common."""

    def wanted(self, kind, place, size):
        """What a layer should answer where the target is at `place` from the middle, in pixels of the search image; and weights."""
        x, y, width, height = np.moveaxis(self.anchors, 3, 0)
        near = np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / 2 / 10 ** 2)
        if kind == "scores":
            alike = np.exp(-(np.log(width / size[0]) ** 2 + np.log(height / size[1]) ** 2) / 2 / 0.6 ** 2)
            logit = 5 * near * alike - 2.5
            return np.concatenate([-logit, logit]), 1 + 20 * near[0]
        boxes = (place[0] - x) / width, (place[1] - y) / height, np.log(size[0] / width), np.log(size[1] / height)
        return np.concatenate(boxes), near[0] + 1e-3

    def description(self, numbers):
        window, penalty, rate = numbers
        side = self.anchors.shape[1]
        return (f"template_side_px = {self.template}\nsearch_side_px = {self.search}\nanswer_side = {side}\nstride_px = 8.0\nchannels = 'bgr'\n"
                f"scores = 'softmax'\ncontext = 0.5\nwindow = {window}\npenalty = {penalty}\nrate = {rate}\n"
                f"answer = {{ anchors = {{ ratios = {[float(r) for r in self.ratios]}, scales = [8.0] }} }}\n")
