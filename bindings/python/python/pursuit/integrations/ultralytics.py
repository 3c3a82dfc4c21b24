"""Estimates as result boxes with the attributes that Ultralytics' have, so that code written for those reads ours."""

import numpy as np


class Boxes:
    """Boxes of one frame: xyxy, xywh (centre and size), xyxyn, xywhn, conf, cls and id, numpy arrays of float32."""

    def __init__(self, estimates, shape):
        """estimates: of one frame. shape: (height, width) of the frame in pixels."""
        self.orig_shape = tuple(shape[:2])
        ltwh = np.array([e.box for e in estimates], dtype=np.float32).reshape(-1, 4)
        self.xyxy = np.concatenate([ltwh[:, :2], ltwh[:, :2] + ltwh[:, 2:]], axis=1)
        self.xywh = np.concatenate([ltwh[:, :2] + ltwh[:, 2:] / 2, ltwh[:, 2:]], axis=1)
        self.conf = np.array([e.score for e in estimates], dtype=np.float32)
        self.cls = np.zeros(len(ltwh), dtype=np.float32)
        self.id = np.array([e.target for e in estimates], dtype=np.float32)
        self.is_track = True

    @property
    def data(self):
        """Left, top, right, bottom, id, confidence and class, (n, 7)."""
        return np.column_stack([self.xyxy, self.id, self.conf, self.cls]).astype(np.float32)

    @property
    def xyxyn(self):
        """xyxy as fractions of width and height."""
        height, width = self.orig_shape
        return self.xyxy / np.array([width, height, width, height], dtype=np.float32)

    @property
    def xywhn(self):
        """xywh as fractions of width and height."""
        height, width = self.orig_shape
        return self.xywh / np.array([width, height, width, height], dtype=np.float32)

    def __len__(self):
        return len(self.xyxy)


def boxes_of(result):
    """Boxes to start on, left, top, width, height in pixels, (n, 4), of an Ultralytics result or its boxes."""
    boxes = getattr(result, "boxes", result).xyxy
    boxes = np.array(boxes.cpu() if hasattr(boxes, "cpu") else boxes, dtype=float).reshape(-1, 4)
    boxes[:, 2:] -= boxes[:, :2]
    return boxes
