#!/usr/bin/env python3
"""Networks of other projects, exported by PyTorch, followed by the projects' own trackers and by ours: the boxes are the same.

    siamese.py [NAME ...]      parts of the names of the networks below, all without any
needs, from PyPI: siamese.txt and, without what they want themselves, siamese-alone.txt

The projects' code is imported: that of `siamese_packages.py` from packages, that of `siamese_checkouts.py`, of which no package has it, from
clones in the folder that the environment's SIAMESE_CLONES names; those are passed over without it. Each network is built by the project's own
code, few planes wide where that lets it. Its weights are drawn from a seed, its normalisations measured on a clip that
`siamese_compare.py` makes, and its last layers fitted to that clip by least squares, so that the answer has a peak and boxes go with the
target.

Both see the same frames. "A step": the project's tracker stands where ours stood in the frame before. "Alone": each goes its own way.
Masks are compared pixel by pixel. Fails where a step is farther apart than that network's bound, or more than one pixel of a mask in a hundred is
another.
"""
import os
import pathlib
import sys
import tempfile
import warnings

warnings.filterwarnings("ignore")
try:
    import cv2
    import torch

    from siamese_checkouts import DaSiamRPN, LightTrack, NoClone, SiamFC
    from siamese_compare import SEED, clip, compare
    from siamese_packages import MMTracking, OSTrack, PySOT, SiamMask
except ImportError as e:
    sys.exit(f"{e}: install xtask/peers/siamese.txt")

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
    "siamfc-pytorch SiamFC (AlexNet)": SiamFC,
    "LightTrack-Mobile": LightTrack,
    "foolwood DaSiamRPN (AlexNet, up-channel)": DaSiamRPN,
}


def main():
    program = pathlib.Path(os.environ["EXAMPLES"]) / "siamese"
    frames, truth = clip()
    wrong = []
    for name, make in NETWORKS.items():
        if sys.argv[1:] and not any(part.lower() in name.lower() for part in sys.argv[1:]):
            continue
        torch.manual_seed(SEED)
        with tempfile.TemporaryDirectory() as folder, torch.no_grad():
            try:
                project = make()
            except NoClone as e:
                print(f"{name}: passed over: {e}", flush=True)
                continue
            if not compare(name, project, program, pathlib.Path(folder), frames, truth):
                wrong.append(name)
    if wrong:
        sys.exit(f"disagree on {', '.join(wrong)}")


cv2.setNumThreads(1)
torch.set_num_threads(1)
main()
