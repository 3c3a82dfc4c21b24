"""Trackers of pursuit for the GOT-10k toolkit (pip install got10k).

>>> from got10k.experiments import ExperimentOTB  # doctest: +SKIP
>>> from pursuit.integrations.got10k import GOT10kTracker  # doctest: +SKIP
>>> ExperimentOTB("data/OTB", version="tb50").run(GOT10kTracker("kcf"))  # doctest: +SKIP
"""

import numpy as np
from got10k.trackers import Tracker

from .. import _native


class GOT10kTracker(Tracker):
    """One of pursuit's trackers as the toolkit wants it; name and parameters as of pursuit.Tracker.

    The toolkit hands over PIL images of RGB and boxes of left, top, width, height in pixels counted from 0.
    """

    def __init__(self, name="pursuit", **parameters):
        super().__init__(name=name, is_deterministic=True)
        self._tracker = _native.Tracker(name, **parameters)

    def init(self, image, box):
        """Starts on the target inside box in this image."""
        self._tracker.init(_pixels(image), box)

    def update(self, image):
        """Where the target is in the next image: left, top, width, height in pixels."""
        return np.array(self._tracker.update(_pixels(image)).box)


def _pixels(image):
    """The toolkit calls every image RGB; grey ones were grey before, and are the same again."""
    return np.asarray(image)
