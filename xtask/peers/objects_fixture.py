#!/usr/bin/env python3
"""Makes crates/inference/tests/fixtures/squares.onnx: a detector of red and of blue squares on black, which fits a test.

One convolution of cells of 8 x 8 pixels: the box is the cell, its objectness the cell's mean of red and blue, its two classes the means of
red and of blue, all over 255; a cell relative to its grid, as YOLOX answers. Images may have any size.
    objects_fixture.py      needs numpy and onnx
"""
import pathlib

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

weights = np.zeros((7, 3, 8, 8), np.float32)
weights[4, 0], weights[4, 2], weights[5, 0], weights[6, 2] = (1 / (64 * 255),) * 4
bias = np.array([0.5, 0.5, 0, 0, 0, 0, 0], np.float32)
nodes = [
    helper.make_node("Conv", ["image", "weights", "bias"], ["cells"], kernel_shape=[8, 8], strides=[8, 8]),
    helper.make_node("Reshape", ["cells", "shape"], ["flat"]),
    helper.make_node("Transpose", ["flat"], ["boxes"], perm=[0, 2, 1]),
]
image = helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, "height", "width"])
boxes = helper.make_tensor_value_info("boxes", TensorProto.FLOAT, [1, "cells", 7])
constants = [numpy_helper.from_array(weights, "weights"), numpy_helper.from_array(bias, "bias"),
             numpy_helper.from_array(np.array([1, 7, -1], np.int64), "shape")]
model = helper.make_model(helper.make_graph(nodes, "squares", [image], [boxes], constants), opset_imports=[helper.make_opsetid("", 13)])
model.ir_version = 8
onnx.checker.check_model(model)
folder = pathlib.Path(__file__).resolve().parents[2] / "crates/inference/tests/fixtures"
onnx.save(model, str(folder / "squares.onnx"))
(folder / "squares.toml").write_text("""# Red and blue squares: see xtask/peers/objects_fixture.py.
classes = ["red", "blue"]
image_px = [128, 96]
channels = "rgb"
fill = 0
strides = [8]
""")
