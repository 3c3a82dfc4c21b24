"""The ROS 2 node of the examples, without ROS: what it does with images and boxes."""

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from conftest import overlap

ROOT = Path(__file__).parents[3]
NODE = ROOT / "examples" / "ros2" / "pursuit_node.py"
DETECTIONS = ROOT / "crates" / "pursuit" / "src" / "sinks" / "mcap" / "detection_array.msg"
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
    assert follower.update(images[5], 1.2) is None, "time does not go back"
    assert len({e.target for estimates in seen for e in estimates}) == 1
    assert overlap(seen[-1][0].box, boxes[-1]) > 0.5
    (detection,) = module.detections_of(seen[-1])
    assert detection["id"] == str(seen[-1][0].target) and detection["class_id"] == "target"
    follower.stop()
    assert follower.update(images[0], 9.0) == []


def test_the_last_box_is_followed_again(square):
    images, boxes = square
    follower = node().Follower("kcf")
    assert not follower.start()
    assert follower.start(boxes[0])
    follower.update(images[0], 0.0)
    follower.stop()
    assert follower.update(images[0], 0.1) == []
    assert follower.start()
    follower.update(images[0], 0.2)
    assert overlap(follower.update(images[1], 0.3)[0].box, boxes[1]) > 0.5


def test_a_recording_that_begins_anew_is_another(square):
    images, boxes = square
    follower = node().Follower("kcf")
    follower.start(boxes[0])
    follower.update(images[0], 100.0)
    assert follower.update(images[1], 100.1) != []
    assert follower.update(images[0], 50.0) == []


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


@pytest.fixture
def messages():
    """Messages of ROS 2 as rosbags makes them, `vision_msgs` by the text that our own recordings carry; a maker of each kind, whose
    fields are zero unless they are named, as those of ROS are."""
    typesys = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed")
    types = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    array = typesys.get_types_from_msg(DETECTIONS.read_text(), "vision_msgs/msg/Detection2DArray")
    types.register({name: fields for name, fields in array.items() if name not in types.types})

    def zero(field):
        kind, of = field
        name = kind.name
        if name == "NAME":
            return make(of)
        if name == "BASE":
            return {"string": "", "bool": False}.get(of[0], 0)
        return [] if name == "SEQUENCE" else np.zeros(of[1])

    def make(name, **given):
        fields = types.fielddefs[name][1]
        return types.types[name](**{field: given.get(field, None) or zero(kind) for field, kind in fields})

    return SimpleNamespace(types=types, make=make)


def of_rosbags(messages, image, encoding, at_s):
    stamp = messages.types.types["builtin_interfaces/msg/Time"](sec=int(at_s), nanosec=round(at_s % 1 * 1e9))
    header = messages.types.types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")
    height, width = image.shape[:2]
    return messages.types.types["sensor_msgs/msg/Image"](
        header=header,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=image.strides[0],
        data=image.reshape(-1).view(np.uint8),
    )


def through_cdr(messages, message):
    """The message as somebody else receives it."""
    name = message.__msgtype__
    return messages.types.deserialize_cdr(messages.types.serialize_cdr(message, name), name)


def test_images_of_rosbags_become_arrays(messages):
    module = node()
    image = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    received = through_cdr(messages, of_rosbags(messages, image, "bgr8", 1000.25))
    assert np.array_equal(module.image_to_array(received), image[:, :, ::-1])
    assert module.time_s(received.header) == 1000.25
    deep = np.array([[1, 300]], np.uint16)
    assert np.array_equal(module.image_to_array(through_cdr(messages, of_rosbags(messages, deep, "mono16", 1.0))), deep)


class StandIn:
    """As much of `rclpy.node.Node` as the node uses; the parameters are those of the class."""

    parameters = {}

    def __init__(self, name):
        self.name, self.listens, self.serves, self.said, self.errors = name, {}, {}, {}, []

    def declare_parameter(self, name, default):
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_subscription(self, kind, topic, callback, _quality):
        self.listens[topic] = (kind, callback)

    def create_service(self, _kind, name, callback):
        self.serves[name] = callback

    def create_publisher(self, _kind, topic, _depth):
        said = self.said.setdefault(topic, [])
        return SimpleNamespace(publish=said.append)

    def get_logger(self):
        return SimpleNamespace(error=lambda text, **_: self.errors.append(text))


@pytest.fixture
def ros(messages, monkeypatch):
    """The node's module as it is where there is ROS, with stand-ins for all of it."""

    def module(name, **members):
        made = ModuleType(name)
        vars(made).update(members)
        monkeypatch.setitem(sys.modules, name, made)

    def kinds(package, *names):
        def maker(name):
            return lambda **given: messages.make(f"{package}/msg/{name}", **given)

        module(package)
        module(f"{package}.msg", **{name: maker(name) for name in names})

    module("rclpy")
    module("rclpy.executors", ExternalShutdownException=KeyboardInterrupt)
    module("rclpy.node", Node=StandIn)
    quality = SimpleNamespace(KEEP_LAST=1, BEST_EFFORT=2)
    module("rclpy.qos", QoSHistoryPolicy=quality, QoSReliabilityPolicy=quality, QoSProfile=SimpleNamespace)
    module("std_srvs")
    module("std_srvs.srv", Trigger=object)
    kinds("sensor_msgs", "CompressedImage", "Image")
    kinds("std_msgs", "String")
    kinds("vision_msgs", "BoundingBox2D", "Detection2D", "Detection2DArray", "ObjectHypothesisWithPose")
    return node()


def test_the_node_publishes_what_others_read(ros, messages, square, monkeypatch):
    images, boxes = square
    monkeypatch.setattr(StandIn, "parameters", {"tracker": "kcf", "image": "/camera/image"})
    the_node = ros.PursuitNode()
    _, see = the_node.listens["/camera/image"]
    _, aim = the_node.listens["~/target"]
    box = messages.make("vision_msgs/msg/BoundingBox2D", size_x=24.0, size_y=24.0)
    box.center.position.x, box.center.position.y = boxes[0][0] + 12.0, boxes[0][1] + 12.0
    answer = lambda name: the_node.serves[name](None, SimpleNamespace(success=None, message=""))
    assert not answer("~/start").success, "no box was given yet"
    aim(box)
    for k, image in enumerate(images):
        see(of_rosbags(messages, image, "mono8", 1000 + k / 30))
    assert answer("~/stop").success and answer("~/start").success
    see(of_rosbags(messages, images[0], "hsv", 2000.0))
    assert "hsv" in the_node.errors[0]
    arrays, states = the_node.said["~/detections"], the_node.said["~/states"]
    assert len(arrays) == len(states) == len(images)
    received = [through_cdr(messages, array) for array in arrays[1:]]
    assert len({found.id for array in received for found in array.detections}) == 1
    last = received[-1].detections[0]
    assert last.header.stamp.sec == 1001 and last.results[0].hypothesis.class_id == "target"
    at = last.bbox
    left, top = at.center.position.x - at.size_x / 2, at.center.position.y - at.size_y / 2
    assert overlap((left, top, at.size_x, at.size_y), boxes[-1]) > 0.5
    assert json.loads(states[-1].data)["targets"][0]["state"] == "tracking"


def test_a_box_by_parameter_is_followed_at_once(ros, messages, square, monkeypatch):
    images, boxes = square
    monkeypatch.setattr(StandIn, "parameters", {"tracker": "kcf", "box": [float(v) for v in boxes[0]]})
    the_node = ros.PursuitNode()
    _, see = the_node.listens["image"]
    for k in range(2):
        see(of_rosbags(messages, images[k], "mono8", k / 30 + 1))
    assert len(the_node.said["~/detections"][1].detections) == 1
