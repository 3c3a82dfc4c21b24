"""Estimates as result boxes with the attributes that Ultralytics' have, so that code written for those reads ours."""

import numpy as np

from ._classes import columns, numbers


class Boxes:
    """Boxes of one frame: xyxy, xywh (centre and size), xyxyn, xywhn, conf, cls and id, numpy arrays of float32."""

    def __init__(self, estimates, shape, names=None):
        """estimates: of one frame, or Tracks of an Associator. shape: (height, width) of the frame in pixels. names: the classes in the order of their
        numbers, or a dict of number to name; without, the 80 of COCO. cls is -1 where there is none."""
        self.orig_shape = tuple(shape[:2])
        ltwh, self.conf, ids = columns(estimates)
        self.xyxy = np.concatenate([ltwh[:, :2], ltwh[:, :2] + ltwh[:, 2:]], axis=1)
        self.xywh = np.concatenate([ltwh[:, :2] + ltwh[:, 2:] / 2, ltwh[:, 2:]], axis=1)
        self.cls = numbers(estimates, names).astype(np.float32)
        self.id = ids.astype(np.float32)
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
    boxes = _numbers(getattr(result, "boxes", result).xyxy).reshape(-1, 4)
    boxes[:, 2:] -= boxes[:, :2]
    return boxes


def associate(associator, result, **more):
    """Tracks after the next frame, whose detections are an Ultralytics result or its boxes; `detections` of the Tracks says which of them each target is.

    associator: a pursuit.Associator. more: time_s, frame, embeddings, as its update takes them.
    """
    boxes = getattr(result, "boxes", result)
    return associator.update(_numbers(boxes.xyxy), _numbers(boxes.conf), _numbers(boxes.cls), corners=True, **more)


def _numbers(values):
    """An array or a tensor, wherever it is, as an array of its own."""
    return np.array(values.cpu() if hasattr(values, "cpu") else values, dtype=float)
