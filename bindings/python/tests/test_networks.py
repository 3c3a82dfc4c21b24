"""Networks by file: the library comes from the package onnxruntime of the Python that runs."""

import warnings

import numpy as np
import pytest
from conftest import ROOT

import pursuit

pytest.importorskip("onnxruntime")

SQUARES = str(ROOT / "crates/inference/tests/fixtures/squares.onnx")


def frame():
    """A red square of 8 pixels and a blue one."""
    image = np.zeros((96, 128, 3), np.uint8)
    image[32:40, 16:24, 0] = 250
    image[72:80, 96:104, 2] = 250
    return image


def test_objects_are_found_and_followed():
    found = pursuit.Detector("objects", model=SQUARES).detect(frame())
    assert sorted(box for box, _ in found) == [(16.0, 32.0, 8.0, 8.0), (96.0, 72.0, 8.0, 8.0)]
    frames = np.stack([frame()] * 10)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rows = list(pursuit.track(frames, detect="objects", many=True, model=SQUARES, device="cpu", fps=2))
    last = {e.class_name: e.box for e in rows if e.frame == 9}
    assert last["red"] == pytest.approx((16, 32, 8, 8), abs=1) and last["blue"] == pytest.approx((96, 72, 8, 8), abs=1)


def test_a_device_that_the_library_lacks_is_a_warning():
    import onnxruntime

    lacks = {"CUDAExecutionProvider": "cuda", "CoreMLExecutionProvider": "coreml"}
    device = next(d for provider, d in lacks.items() if provider not in onnxruntime.get_available_providers())
    frames = np.stack([frame()] * 10)
    with pytest.warns(UserWarning, match="it runs on the processor"):
        rows = list(pursuit.track(frames, detect="objects", many=True, model=SQUARES, device=device, fps=2))
    assert {e.class_name for e in rows} == {"red", "blue"}
    with pytest.warns(UserWarning, match="nobody here runs a network by file"):
        list(pursuit.track(frames, box=(16, 32, 8, 8), tracker="kcf", device=device))
    with pytest.raises(pursuit.UsageError, match="tpu"):
        pursuit.track(frames, box=(16, 32, 8, 8), device="tpu")
    with pytest.warns(UserWarning, match="it runs on the processor"):
        pursuit.Detector("objects", model=SQUARES, runtime__device=device)
