"""Estimates as supervision's detections (pip install supervision), for its annotators and zones, and its detections associated."""

import numpy as np

from ._classes import numbers


def corners(estimates):
    """Boxes as left, top, right, bottom in pixels, float32 (n, 4)."""
    boxes = np.array([e.box for e in estimates], dtype=np.float32).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    return boxes


def to_detections(estimates, *, lost=False, names=None):
    """A supervision.Detections of the estimates of one frame: confidence is the score, tracker_id the target's number,
    data["class_name"] what a detector named, or nothing, and class_id its number in `names`, -1 where there is none.

    lost: whether targets that are lost come too; their boxes are those believed last. names: the classes in the order of their numbers, or a dict of number
    to name; without, the 80 of COCO.
    """
    import supervision

    shown = [e for e in estimates if lost or e.state != "lost"]
    return supervision.Detections(
        xyxy=corners(shown),
        confidence=np.array([e.score for e in shown], dtype=np.float32),
        class_id=numbers(shown, names),
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


def associate(associator, detections, **more):
    """Those of `detections`, a supervision.Detections of the next frame, that are of a known target, with tracker_id: masks, data and all that is attached to
    them are kept, in the order of the targets' numbers.

    associator: a pursuit.Associator. more: time_s, frame, embeddings, as its update takes them.
    """
    tracks = associator.update(
        detections.xyxy, detections.confidence, detections.class_id, corners=True, **more
    )
    seen = tracks.detections >= 0
    found = detections[tracks.detections[seen]]
    found.tracker_id = tracks.ids[seen]
    return found
