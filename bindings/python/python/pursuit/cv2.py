"""OpenCV's tracker interface: replace cv2.TrackerKCF_create() by pursuit.cv2.TrackerPursuit_create()."""

from . import _native


class TrackerPursuit:
    """init(image, box), then update(image) -> (ok, box) and getTrackingScore(), on images as OpenCV reads them: uint8, BGR or grey.

    ok: whether the target was measured in this image. box: left, top, width, height in whole pixels, as OpenCV's own
    trackers give it; the last estimate, with fractions, is in `estimate`.
    """

    def __init__(self, name="pursuit", **parameters):
        self._tracker = _native.Tracker(name, channels="bgr", **parameters)
        self.estimate = None

    def init(self, image, boundingBox):
        """Starts on the target inside boundingBox = (left, top, width, height), pixels."""
        self.estimate = self._tracker.init(image, boundingBox)

    def update(self, image):
        """Looks at the next image: (ok, (left, top, width, height))."""
        self.estimate = self._tracker.update(image)
        return self.estimate.state == "tracking", tuple(round(v) for v in self.estimate.box)

    def getTrackingScore(self):
        """The probability, 0 to 1, that the last box overlaps the target by one half; 0 before the first image."""
        return 0.0 if self.estimate is None else self.estimate.score

    @classmethod
    def create(cls, name="pursuit", **parameters):
        """As TrackerPursuit_create."""
        return cls(name, **parameters)


def TrackerPursuit_create(name="pursuit", **parameters):
    """A tracker with OpenCV's interface; name and parameters as of pursuit.Tracker."""
    return TrackerPursuit(name, **parameters)
