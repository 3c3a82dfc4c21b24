#!/usr/bin/env python3
"""A ROS 2 node that follows targets: images in, `vision_msgs/Detection2DArray` with stable ids and their states out.

    ros2 run … or: python3 pursuit_node.py --ros-args -p image:=/camera/image_raw -p tracker:=pursuit

topics
    image (parameter `image`)    sensor_msgs/Image, or sensor_msgs/CompressedImage with parameter `compressed` true; the newest wins
    ~/target                     vision_msgs/BoundingBox2D: the box to follow from the next image on, in its pixels
    ~/detections                 vision_msgs/Detection2DArray: targets that are believed to be in the picture
    ~/states                     std_msgs/String: JSON with the state of every target, lost ones too
services
    ~/start                      std_srvs/Trigger: follow the last box that was given, from the next image on
    ~/stop                       std_srvs/Trigger: follow nothing
parameters
    image, compressed, tracker, detector (follow all that it finds), box ([left, top, width, height] as decimals: follow this from the
    first image on)

Needs the Python package of pursuit, numpy and, for compressed images, OpenCV. Everything down to `main` works without ROS.
"""
import json

import numpy as np

try:
    import rclpy
    from rclpy.executors import ExternalShutdownException
    from rclpy.node import Node
    from rclpy.qos import QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy
    from sensor_msgs.msg import CompressedImage, Image
    from std_msgs.msg import String
    from std_srvs.srv import Trigger
    from vision_msgs.msg import BoundingBox2D, Detection2D, Detection2DArray, ObjectHypothesisWithPose
except ImportError as missing:
    rclpy, MISSING = None, missing

CHANNELS = {"rgb8": (3, [0, 1, 2]), "bgr8": (3, [2, 1, 0]), "rgba8": (4, [0, 1, 2]), "bgra8": (4, [2, 1, 0])}
GREY = {"mono8": np.uint8, "8UC1": np.uint8, "mono16": np.uint16, "16UC1": np.uint16}


def image_to_array(message):
    """A `sensor_msgs/Image` as rows of RGB or grey, or a `CompressedImage` as rows of RGB."""
    if not hasattr(message, "encoding"):
        import cv2

        image = cv2.imdecode(np.frombuffer(bytes(message.data), np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise ValueError(f"the compressed image ({message.format}) cannot be decoded")
        return np.ascontiguousarray(image[:, :, ::-1])
    height, width, step = message.height, message.width, message.step
    data = np.frombuffer(bytes(message.data), np.uint8)
    if message.encoding in CHANNELS:
        count, order = CHANNELS[message.encoding]
    elif message.encoding in GREY:
        count, order = np.dtype(GREY[message.encoding]).itemsize, None
    else:
        known = ", ".join([*CHANNELS, *GREY])
        raise ValueError(f"images of the encoding {message.encoding} are not read; publish one of {known}")
    if step < width * count or len(data) < (height - 1) * step + width * count:
        raise ValueError(f"{width}x{height} pixels of {message.encoding} do not fit into {len(data)} bytes")
    # The last row need not be filled up.
    rows = np.concatenate([data, np.zeros(max(0, height * step - len(data)), np.uint8)])[: height * step]
    rows = rows.reshape(height, step)[:, : width * count]
    if order is not None:
        return np.ascontiguousarray(rows.reshape(height, width, count)[:, :, order])
    kind = np.dtype(GREY[message.encoding]).newbyteorder(">" if message.is_bigendian else "<")
    return np.ascontiguousarray(rows).view(kind).astype(GREY[message.encoding])


def time_s(header):
    """The time of a header, seconds."""
    return header.stamp.sec + 1e-9 * header.stamp.nanosec


def detections_of(estimates):
    """What a `Detection2DArray` holds, as dictionaries: one for each target that is believed to be in the picture."""
    return [
        {
            "id": str(e.target),
            "class_id": e.class_name or "target",
            "score": float(e.score),
            "center": (e.box[0] + e.box[2] / 2, e.box[1] + e.box[3] / 2),
            "size": (e.box[2], e.box[3]),
        }
        for e in estimates
        if e.state != "lost"
    ]


def states_of(estimates, at_s):
    """The state of every target as JSON; a box only where the target is believed to be."""
    box = lambda e: None if e.state == "lost" else [float(v) for v in e.box]
    one = lambda e: {"id": str(e.target), "state": e.state, "doubt": e.doubt, "score": float(e.score), "box": box(e)}
    return json.dumps({"time_s": at_s, "targets": [one(e) for e in estimates]})


class Follower:
    """What the node does, without ROS: follows the box that it is given, or all that a detector finds."""

    def __init__(self, tracker="pursuit", detector=None):
        self.tracker, self.detector, self.last_box = tracker, detector, None
        self.stop()

    def stop(self):
        """Follows nothing, until it is given a box; with a detector, what that finds."""
        import pursuit

        self.targets = pursuit.MultiTracker(None if self.detector else self.tracker, detector=self.detector)
        self.wanted = self.target = self.last_s = None

    def start(self, box=None):
        """Follows this box (left, top, width, height) from the next image on, or else the last one given; whether there is one."""
        self.last_box = self.last_box if box is None else [float(v) for v in box]
        self.wanted = self.last_box
        return self.wanted is not None

    def update(self, image, at_s):
        """What is known of every target in this image.

        Images whose time does not grow are left out. When it goes back by more than a second, another recording plays: what was
        followed is not in it."""
        if self.last_s is not None and at_s <= self.last_s:
            if self.last_s - at_s <= 1:
                return None
            wanted = self.wanted
            self.stop()
            self.wanted = wanted
        self.last_s = at_s
        found = self.targets.update(image, time_s=at_s)
        if self.wanted is None:
            return found
        box, self.wanted = self.wanted, None
        if self.target is not None:
            self.targets.remove(self.target)
        self.target = self.targets.add(image, box, time_s=at_s)
        return [e for e in found if e.target != self.target]


if rclpy is not None:

    class PursuitNode(Node):
        """The node."""

        def __init__(self):
            super().__init__("pursuit")
            get = lambda name, default: self.declare_parameter(name, default).value
            compressed = get("compressed", False)
            self.follower = Follower(get("tracker", "pursuit"), get("detector", "") or None)
            box = get("box", [0.0])
            if len(box) == 4:
                self.follower.start(box)
            # Of images that come while one is looked at, the newest is taken up next.
            newest = QoSProfile(
                depth=1, history=QoSHistoryPolicy.KEEP_LAST, reliability=QoSReliabilityPolicy.BEST_EFFORT
            )
            kind = CompressedImage if compressed else Image
            self.create_subscription(kind, get("image", "image"), self.see, newest)
            self.create_subscription(BoundingBox2D, "~/target", self.aim, 10)
            self.create_service(Trigger, "~/start", self.start)
            self.create_service(Trigger, "~/stop", self.stop)
            self.detections = self.create_publisher(Detection2DArray, "~/detections", 10)
            self.states = self.create_publisher(String, "~/states", 10)

        def aim(self, box):
            x, y = box.center.position.x, box.center.position.y
            self.follower.start((x - box.size_x / 2, y - box.size_y / 2, box.size_x, box.size_y))

        def start(self, _request, response):
            response.success = self.follower.start()
            response.message = "the last box is followed" if response.success else "no box was given; publish one to ~/target"
            return response

        def stop(self, _request, response):
            self.follower.stop()
            response.success, response.message = True, "nothing is followed"
            return response

        def see(self, message):
            at_s = time_s(message.header)
            try:
                estimates = self.follower.update(image_to_array(message), at_s)
            except ValueError as error:
                self.get_logger().error(str(error), throttle_duration_sec=5.0)
                return
            if estimates is None:
                return
            array = Detection2DArray(header=message.header)
            for found in detections_of(estimates):
                hypothesis = ObjectHypothesisWithPose()
                hypothesis.hypothesis.class_id, hypothesis.hypothesis.score = found["class_id"], found["score"]
                detection = Detection2D(header=message.header, id=found["id"], results=[hypothesis])
                detection.bbox.center.position.x, detection.bbox.center.position.y = found["center"]
                detection.bbox.size_x, detection.bbox.size_y = found["size"]
                array.detections.append(detection)
            self.detections.publish(array)
            self.states.publish(String(data=states_of(estimates, at_s)))


def main():
    if rclpy is None:
        raise SystemExit(f"this needs ROS 2 with vision_msgs: {MISSING}")
    rclpy.init()
    node = PursuitNode()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()


if __name__ == "__main__":
    main()
