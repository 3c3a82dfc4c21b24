#!/usr/bin/env python3
"""What onnxruntime answers with NanoTrack v3: the fixture of crates/inference/tests/nanotrack.rs.

    nanotrack_fixture.py FOLDER_OF_THE_ONNX_FILES [--check]

Images are made by a formula, so that only answers are stored, as little-endian single precision: 2 × 15 × 15 logits and
4 × 15 × 15 distances with the released weights, then the same with the weights rounded to half precision (what the project
ships), so that rounding of the weights and errors of our layers are told apart.
"""
import pathlib
import sys

import numpy as np
import onnx
import onnxruntime as ort
from onnx import numpy_helper

FIXTURE = pathlib.Path(__file__).resolve().parents[2] / "crates/inference/tests/fixtures/nanotrack_v3.bin"


def image(side, shift):
    """Rings and stripes of several scales in three channels; shift moves the origin."""
    y, x = np.meshgrid(np.arange(side) + shift, np.arange(side) + shift, indexing="ij")
    dx, dy = x - 128, y - 128
    planes = [(dx * dx + dy * dy) // 24 % 256, (3 * dx * dx + dx * dy) // 96 % 256, (2 * dx + 5 * dy + dy * dy // 16) % 256]
    return np.stack(planes).astype(np.float32)[None]


def session(path, half):
    model = onnx.load(str(path))
    if half:
        for initializer in model.graph.initializer:
            numbers = numpy_helper.to_array(initializer)
            if numbers.dtype == np.float32:
                rounded = numbers.astype(np.float16).astype(np.float32)
                initializer.CopyFrom(numpy_helper.from_array(rounded, initializer.name))
    # The exported shapes are those of the search image; the template is smaller.
    for value in [*model.graph.input, *model.graph.output]:
        if "backbone" in path.name:
            for d in value.type.tensor_type.shape.dim[2:]:
                d.dim_param = "side_of_" + value.name
    options = ort.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 3
    return ort.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])


def answers(folder, half):
    backbone = session(folder / "nanotrack_backbone.onnx", half)
    head = session(folder / "nanotrack_head.onnx", half)
    z = backbone.run(None, {"input": image(127, 64)})[0]
    x = backbone.run(None, {"input": image(255, 0)})[0]
    return np.concatenate([o.ravel() for o in head.run(None, {"input1": z, "input2": x})])


def main():
    folder = pathlib.Path(sys.argv[1])
    released, halved = answers(folder, False), answers(folder, True)
    print(f"rounding the weights moves logits by at most {np.abs(released - halved)[:450].max():.4f},"
          f" distances by {np.abs(released - halved)[450:].max():.4f} px")
    numbers = np.concatenate([released, halved]).astype("<f4")
    if "--check" in sys.argv:
        stored = np.frombuffer(FIXTURE.read_bytes(), "<f4")
        worst = np.max(np.abs(stored - numbers) / np.maximum(1, np.abs(numbers)))
        if not worst < 1e-4:
            sys.exit(f"the fixture differs by {worst:.3g}")
    else:
        FIXTURE.write_bytes(numbers.tobytes())


main()
