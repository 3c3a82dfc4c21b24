"""Numbers of classes, as the toolkits ask for them."""

import numpy as np

from .._native import COCO, Tracks


def numbers(found, names=None):
    """The class of each estimate as a number, int (n,); -1 where none is known or `names` has it not.

    found: estimates of one frame, or Tracks, which have numbers already. names: the words in the order of their numbers, or a dict of number to word, as an
    Ultralytics model's `names`; without, the 80 of COCO. A word that is a whole number is that.
    """
    if isinstance(found, Tracks):
        return found.class_ids
    named = names.items() if hasattr(names, "items") else enumerate(COCO if names is None else names)
    known = {word: int(number) for number, word in named}

    def number(word):
        if word in known:
            return known[word]
        return int(word) if word is not None and word.isdecimal() else -1

    return np.array([number(e.class_name) for e in found], dtype=int)


def columns(found):
    """Left, top, width, height float32 (n, 4), scores float32 (n,) and targets int (n,) of estimates or Tracks."""
    if isinstance(found, Tracks):
        return found.boxes.astype(np.float32), found.scores.astype(np.float32), found.ids
    boxes = np.array([e.box for e in found], dtype=np.float32).reshape(-1, 4)
    return boxes, np.array([e.score for e in found], dtype=np.float32), np.array([e.target for e in found], dtype=int)
