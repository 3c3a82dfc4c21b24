#!/usr/bin/env python3
"""What onnxruntime answers with LightFC and VitTrack: the fixtures of crates/inference/tests/written_out.rs.

    network_fixtures.py FOLDER_OF_THE_MODELS [--check]

The folder has a folder `lightfc` and a folder `vittrack` with the ONNX files that crates/inference/weights/*/ORIGIN.md name. Images are
made by a formula, so that only answers are stored, as little-endian single precision: for each of two searches the score, the size and
the offset of 16 × 16 points (256 + 512 + 512 numbers).
"""
import pathlib
import sys

import numpy as np
import onnxruntime as ort

FIXTURES = pathlib.Path(__file__).resolve().parents[2] / "crates/inference/tests/fixtures"
MEAN = np.array([.485, .456, .406], np.float32)[:, None, None]
DEVIATION = np.array([.229, .224, .225], np.float32)[:, None, None]
SHIFTS = (0, 40)


def image(side, shift):
    """Rings and stripes of several scales in three channels; shift moves the origin."""
    y, x = np.meshgrid(np.arange(side) + shift, np.arange(side) + shift, indexing="ij")
    dx, dy = x - 128, y - 128
    planes = [(dx * dx + dy * dy) // 24 % 256, (3 * dx * dx + dx * dy) // 96 % 256, (2 * dx + 5 * dy + dy * dy // 16) % 256]
    return ((np.stack(planes).astype(np.float32) / np.float32(255) - MEAN) / DEVIATION)[None]


def session(path):
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 3
    return ort.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def lightfc(folder):
    backbone, head = session(folder / "lightfc_backbone.onnx"), session(folder / "lightfc_head.onnx")
    z = backbone.run(None, {"image": image(128, 64)})[0]
    for shift in SHIFTS:
        x = backbone.run(None, {"image": image(256, shift)})[0]
        yield from head.run(["score", "size", "offset"], {"z": z, "x": x})


def vittrack(folder):
    network = session(folder / "object_tracking_vittrack_2023sep.onnx")
    for shift in SHIFTS:
        yield from network.run(["output1", "output2", "output3"], {"template": image(128, 64), "search": image(256, shift)})


def main():
    models = pathlib.Path(sys.argv[1])
    for network in (lightfc, vittrack):
        name = network.__name__
        numbers = np.concatenate([o.ravel() for o in network(models / name)]).astype("<f4")
        print(f"{name}: best scores {numbers[:256].max():.4f}, {numbers[1280:1536].max():.4f}")
        fixture = FIXTURES / f"{name}.bin"
        if "--check" in sys.argv:
            worst = np.max(np.abs(np.frombuffer(fixture.read_bytes(), "<f4") - numbers))
            if not worst < 1e-4:
                sys.exit(f"the fixture of {name} differs by {worst:.3g}")
        else:
            fixture.write_bytes(numbers.tobytes())


main()
