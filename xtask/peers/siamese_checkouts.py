"""Trackers whose Python no package has, from clones of the projects: SiamFC (siamfc-pytorch), LightTrack, DaSiamRPN.

What is put in from outside is what a machine of today without a GPU lacks; no arithmetic of theirs is replaced.
"""
import importlib
import math
import os
import pathlib
import sys
import types

import numpy as np
import torch

from siamese_export import IMAGENET, RATIOS, Anchors, Project, bare, export_pair, module


class NoClone(Exception):
    """What is compared is not there."""


def clone(address, first):
    """The folder of the clone of that project, in which there must be `first`."""
    folder = pathlib.Path(os.environ.get("SIAMESE_CLONES", ""), address.rsplit("/")[-1])
    if "SIAMESE_CLONES" not in os.environ:
        raise NoClone(f"SIAMESE_CLONES names no folder with a clone of https://github.com/{address}")
    if not (folder / first).is_file():
        raise NoClone(f"{folder} is no clone of https://github.com/{address}: {first} is not there")
    return folder


def standing_in(name, **content):
    """Puts a module of this content in the place of one that is not there, or is not wanted."""
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(content)


def on_this_processor():
    """What is sent to a GPU stays."""
    torch.Tensor.cuda = lambda tensor, *_, **__: tensor


class SiamFC(Project):
    """SiamFC's AlexNet as wide as it is, three scales."""
    template, search, bound = 127, 255, 0.001

    def __init__(self):
        sys.path.insert(0, str(clone("huanglianghua/siamfc-pytorch", "siamfc/siamfc.py")))
        bare("siamfc")
        # Of learning.
        standing_in("siamfc.losses", BalancedLoss=lambda: None)
        standing_in("siamfc.datasets", Pair=None)
        standing_in("siamfc.transforms", SiamFCTransforms=None)
        self.tracker = importlib.import_module("siamfc.siamfc").TrackerSiamFC()
        # It ends learning in each frame, also while normalisations are measured: that is left to the network about it.
        self.tracker.net.eval = lambda: None
        self.network = module(None, self.tracker.net)

    def heads(self):
        return ()

    def settle(self, look):
        """What is correlated is whitened, each group of planes by itself: then nothing answers as the target does."""
        part, seen = self.tracker.net.backbone.conv5[0], []
        hook = part.register_forward_hook(lambda _, given, answer: seen.append(answer.transpose(0, 1).flatten(1).double()))
        look()
        hook.remove()
        for group, weight, bias in zip(torch.cat(seen, 1).chunk(part.groups), part.weight.chunk(part.groups), part.bias.chunk(part.groups)):
            squares, axes = torch.linalg.eigh(torch.cov(group))
            whiten = (axes * (squares + 1e-3 * squares.mean()).rsqrt()) @ axes.T
            weight.copy_((whiten @ weight.flatten(1).double()).view_as(weight))
            bias.copy_(whiten @ (bias.double() - group.mean(1)))

    def start(self, frame, box):
        # It counts columns and rows from one.
        self.tracker.init(frame, box + [1, 1, 0, 0])

    def about(self):
        height, width = self.tracker.target_sz
        return np.array([self.tracker.center[1] + 0.5 - width / 2, self.tracker.center[0] + 0.5 - height / 2, width, height])

    def place(self, box):
        left, top, width, height = box
        tracker = self.tracker
        tracker.center = np.array([top + (height - 1) / 2, left + (width - 1) / 2], np.float32)
        tracker.target_sz = np.array([height, width], np.float32)
        context = tracker.cfg.context * np.sum(tracker.target_sz)
        tracker.z_sz = np.sqrt(np.prod(tracker.target_sz + context))
        tracker.x_sz = tracker.z_sz * tracker.cfg.instance_sz / tracker.cfg.exemplar_sz

    def track(self, frame):
        return self.tracker.update(frame) - [1, 1, 0, 0]

    def write(self, folder):
        network, cfg = self.tracker.net, self.tracker.cfg
        search = lambda image, z: network.head(z, network.backbone(image))
        files = export_pair(folder, (self.template, self.search), network.backbone.forward, search, [network], ["response"])
        # A scale is penalised by exp(−k (step − 1)).
        penalty = -math.log(cfg.scale_penalty) / (cfg.scale_step - 1)
        return (f"{files}template_side_px = {self.template}\nsearch_side_px = {self.search}\nanswer_side = {cfg.response_sz}\n"
                f"stride_px = {float(cfg.total_stride)}\nchannels = 'rgb'\nscores = 'sigmoid'\ncontext = {cfg.context}\n"
                f"window = {cfg.window_influence}\npenalty = {penalty}\nrate = {cfg.scale_lr}\n"
                "template_shift_px = 0.5\nsearch_shift_px = 0.5\nties = 'even'\nfill = 'nearest-mean'\n"
                f"answer = {{ scores = {{ step = {cfg.scale_step}, scales = {cfg.scale_num}, enlarged = {cfg.response_up} }} }}\n")


class Stateful:
    """Trackers that keep what they know in a dictionary."""

    def about(self):
        return np.concatenate([self.state["target_pos"] - self.state["target_sz"] / 2, self.state["target_sz"]])

    def place(self, box):
        self.state.update(target_pos=box[:2] + box[2:] / 2, target_sz=box[2:].copy())


class LightTrack(Stateful, Project):
    """LightTrack-Mobile as it was found, for VOT, and told as `tracking/reproduce_vot2019.sh` tells it."""
    template, search, bound = 127, 256, 0.005
    # `back_04502514044521042540+cls_211000022+reg_100000111_ops_32`: choices in each stage, kernels of the two towers, and the stage and the
    # block that give the features.
    backbone = [0], [4, 5], [0, 2, 5, 1], [4, 0, 4, 4], [5, 2, 1, 0], [4, 2, 5, 4], [0]
    head = dict(cls=[2, [1, 1, 0, 0, 0, 0, 2, 2]], reg=[1, [0, 0, 0, 0, 0, 1, 1, 1]])
    features = 3, 2

    def __init__(self):
        sys.path.insert(0, str(clone("researchmm/LightTrack", "lib/tracker/lighttrack.py")))
        on_this_processor()
        bare("lib", "lib.tracker", "lib.utils", "lib.models", "lib.models.backbone", "lib.models.backbone.models")
        standing_in("torch._six", container_abcs=importlib.import_module("collections.abc"))
        standing_in("shapely.geometry", Polygon=None, box=None)
        sys.modules.setdefault("shapely", sys.modules["shapely.geometry"])
        sys.modules["lib.models.backbone.models"]._gen_childnet = importlib.import_module("lib.models.backbone.models.model")._gen_childnet
        parts = importlib.import_module("lib.models.submodels")
        # What `LightTrackM_Subnet` puts together, which asks a network of all networks for these numbers.
        numbers = types.SimpleNamespace(stage_idx=[1, 2, 3], in_c=[40, 80, 96], strides=[4, 8, 16, 16, 32], strides_use_new=[8, 16],
                                        num_kernel_corr=[256, 64])
        self.network = importlib.import_module("lib.models.super_model_DP").Super_model_DP_retrain()
        self.network.features = importlib.import_module("lib.models.backbone.childnet").build_subnet(self.backbone, ops=self.features)
        self.network.neck = parts.build_subnet_BN(self.features, numbers)
        self.network.feature_fusor = parts.build_subnet_feat_fusor(self.features, numbers, matrix=True, adj_channel=128)
        self.network.head = parts.build_subnet_head(self.head, channel_list=[128, 192, 256], kernel_list=[3, 5, 0], inchannels=128,
                                                    linear_reg=True, towernum=8)
        info = types.SimpleNamespace(stride=16, dataset="VOT2019")
        self.tracker = importlib.import_module("lib.tracker.lighttrack").Lighttrack(info, even=0)

    def heads(self):
        yield "scores", self.network.head.cls_perd.cls_pred
        yield "edges", self.network.head.reg_pred.bbox_pred

    def wanted(self, kind, place, size):
        points = np.arange(-8, 8) * 16.0
        x, y = np.meshgrid(points - place[0], points - place[1])
        near = np.exp(-(x ** 2 + y ** 2) / 2 / 16 ** 2)
        if kind == "scores":
            # Its head takes a tenth.
            return 10 * (8 * near[None] - 4), 1 + 20 * near
        return np.stack([x + size[0] / 2, y + size[1] / 2, size[0] / 2 - x, size[1] / 2 - y]) / 16, near + 1e-3

    def start(self, frame, box):
        self.state = self.tracker.init(frame, box[:2] + box[2:] / 2, box[2:].copy(), self.network)

    def track(self, frame):
        self.state = self.tracker.track(self.state, frame)
        return self.about()

    def write(self, folder):
        network, p = self.network, self.state["p"]

        def search(image, z):
            held = types.SimpleNamespace(zf=z, features=network.features, neck=network.neck, feature_fusor=network.feature_fusor, head=network.head)
            return type(network).track(held, image)

        files = export_pair(folder, (self.template, self.search), network.features.forward, search, [network], ["score", "edges"])
        return (f"{files}template_side_px = {self.template}\nsearch_side_px = {self.search}\nanswer_side = {p.score_size}\nstride_px = 16.0\n"
                f"channels = 'rgb'\n{IMAGENET}scores = 'sigmoid'\ncontext = {p.context_amount}\nwindow = {p.window_influence}\n"
                f"penalty = {p.penalty_k}\nrate = {p.lr}\nboxes = 'smoothed-twice'\nties = 'even'\n")


class Eighth:
    """What a number of planes is multiplied by."""

    def __rmul__(self, planes):
        return planes // 8


class Whole(int):
    """A whole number, divided as in Python 2."""
    __truediv__ = int.__floordiv__


def rounded(value):
    """As in Python 2."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


class DaSiamRPN(Stateful, Anchors):
    """DaSiamRPN's own network, an eighth as wide, with whole numbers divided and halves rounded as in Python 2, which it is for: in Python 3
    its anchors are half a stride elsewhere."""
    template, search, ratios, bound = 127, 271, RATIOS, 0.005

    def __init__(self):
        sys.path.insert(0, str(clone("foolwood/DaSiamRPN", "code/run_SiamRPN.py") / "code"))
        on_this_processor()
        sys.modules.pop("utils", None)
        self.code = importlib.import_module("run_SiamRPN")
        self.code.round = self.code.get_subwindow_tracking.__globals__["round"] = rounded
        make = self.code.generate_anchor
        self.code.generate_anchor = lambda stride, scales, ratios, side: make(stride, scales, ratios, Whole(side))
        self.network = importlib.import_module("net").SiamRPN(size=Eighth(), feature_out=32)

    @property
    def anchors(self):
        p = self.state["p"]
        return p.anchor.reshape(p.anchor_num, int(p.score_size), int(p.score_size), 4)

    def heads(self):
        yield "boxes", self.network.regress_adjust

    def settle(self, look):
        """Scores have no layer of their own: they are brought to a deviation of 1."""
        seen = []
        hook = self.network.register_forward_hook(lambda _, given, answer: seen.append(answer[1].std()))
        look()
        hook.remove()
        for numbers in self.network.conv_cls1.parameters():
            numbers.div_(torch.stack(seen).mean())

    def start(self, frame, box):
        self.state = self.code.SiamRPN_init(np.ascontiguousarray(frame[:, :, ::-1]), box[:2] + box[2:] / 2, box[2:].copy(), self.network)

    def track(self, frame):
        self.state = self.code.SiamRPN_track(self.state, np.ascontiguousarray(frame[:, :, ::-1]))
        return self.about()

    def write(self, folder):
        network, p = self.network, self.state["p"]
        shared = {name: getattr(network, name) for name in ("anchor", "feature_out", "featureExtract", "regress_adjust")}
        shared.update({name: getattr(network, name) for name in ("conv_r1", "conv_r2", "conv_cls1", "conv_cls2")})

        def template(image):
            held = types.SimpleNamespace(**shared)
            type(network).temple(held, image)
            return torch.cat([held.r1_kernel, held.cls1_kernel])

        def search(image, z):
            boxes, scores = z.split([4 * network.anchor, 2 * network.anchor])
            return type(network).forward(types.SimpleNamespace(**shared, r1_kernel=boxes, cls1_kernel=scores), image)

        files = export_pair(folder, (self.template, self.search), template, search, [network], ["boxes", "scores"])
        return files + self.description((p.window_influence, p.penalty_k, p.lr)) + "ties = 'away'\n"
