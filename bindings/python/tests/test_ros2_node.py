"""The ROS 2 node of the examples, without ROS: what it does with images and boxes."""

import importlib.util
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import overlap

NODE = Path(__file__).parents[3] / "examples" / "ros2" / "pursuit_node.py"
pytestmark = pytest.mark.skipif(not NODE.exists(), reason="the examples are not beside these tests")


def node():
    spec = importlib.util.spec_from_file_location("pursuit_node", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def message(image, encoding, step=None):
    height, width = image.shape[:2]
    step = step or image.strides[0]
    return SimpleNamespace(
        height=height, width=width, step=step, encoding=encoding, is_bigendian=0, data=image.tobytes()
    )


def test_images_become_arrays():
    to_array = node().image_to_array
    image = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    assert np.array_equal(to_array(message(image, "rgb8")), image)
    assert np.array_equal(to_array(message(np.ascontiguousarray(image[:, :, ::-1]), "bgr8")), image)
    deep = np.arange(6, dtype=np.uint16).reshape(2, 3)
    assert np.array_equal(to_array(message(deep, "mono16")), deep)
    padded = np.zeros((2, 8), np.uint8)
    padded[:, :3] = [[1, 2, 3], [4, 5, 6]]
    wide = SimpleNamespace(height=2, width=3, step=8, encoding="mono8", is_bigendian=0, data=padded.tobytes()[:11])
    assert np.array_equal(to_array(wide), [[1, 2, 3], [4, 5, 6]])
    for wrong in (message(image, "bayer_rggb16"), message(image, "rgb8", step=3)):
        with pytest.raises(ValueError):
            to_array(wrong)


def test_a_box_given_is_followed_under_an_id_that_stays(square):
    module = node()
    images, boxes = square
    follower = module.Follower("kcf")
    assert follower.update(images[0], 0.0) == []
    follower.start(boxes[1])
    follower.update(images[1], 1 / 30)
    seen = [follower.update(image, k / 30) for k, image in enumerate(images) if k > 1]
    assert follower.update(images[5], 0.1) is None, "time does not go back"
    assert len({e.target for estimates in seen for e in estimates}) == 1
    assert overlap(seen[-1][0].box, boxes[-1]) > 0.5
    (detection,) = module.detections_of(seen[-1])
    assert detection["id"] == str(seen[-1][0].target) and detection["class_id"] == "target"
    follower.stop()
    assert follower.update(images[0], 9.0) == []


def test_lost_targets_have_a_state_and_no_box(square):
    module = node()
    images, boxes = square
    follower = module.Follower("kcf")
    follower.start(boxes[0])
    for k, image in enumerate(images):
        follower.update(image, k / 30)
    nothing = np.full_like(images[0], 90)
    last = [follower.update(nothing, (40 + k) / 30) for k in range(120)][-1]
    assert module.detections_of(last) == []
    (target,) = json.loads(module.states_of(last, 1.0))["targets"]
    assert target["state"] == "lost" and target["box"] is None
