"""Estimates as supervision's detections (pip install supervision), for its annotators and zones."""

import numpy as np


def corners(estimates):
    """Boxes as left, top, right, bottom in pixels, float32 (n, 4)."""
    boxes = np.array([e.box for e in estimates], dtype=np.float32).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    return boxes


def to_detections(estimates, *, lost=False):
    """A supervision.Detections of the estimates of one frame: confidence is the score, tracker_id the target's number,
    data["class_name"] what a detector named, or nothing.

    lost: whether targets that are lost come too; their boxes are those believed last.
    """
    import supervision

    shown = [e for e in estimates if lost or e.state != "lost"]
    return supervision.Detections(
        xyxy=corners(shown),
        confidence=np.array([e.score for e in shown], dtype=np.float32),
        class_id=np.zeros(len(shown), dtype=int),
        tracker_id=np.array([e.target for e in shown], dtype=int),
        data={
            "state": np.array([e.state for e in shown], dtype=str),
            "class_name": np.array([e.class_name or "" for e in shown], dtype=str),
        },
    )


def from_detections(detections):
    """Boxes to start on, left, top, width, height in pixels, (n, 4), of a supervision.Detections."""
    boxes = np.asarray(detections.xyxy, dtype=float).reshape(-1, 4).copy()
    boxes[:, 2:] -= boxes[:, :2]
    return boxes
