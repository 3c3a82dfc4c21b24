"""One target and many, on arrays."""

import copy
import pickle
import threading

import numpy as np
import pursuit
import pytest
from conftest import moving_square, overlap


def follow(tracker, images, box):
    return [tracker.init(images[0], box), *(tracker.update(image) for image in images[1:])]


@pytest.mark.parametrize("name", ["pursuit", "kcf", "mosse", "dsst"])
def test_a_target_is_followed(name, square):
    images, boxes = square
    estimates = follow(pursuit.Tracker(name), images, boxes[0])
    assert all(overlap(e.box, b) > 0.5 for e, b in zip(estimates, boxes))
    assert [e.frame for e in estimates] == list(range(40))
    assert estimates[-1].time_s == pytest.approx(39 / 30)
    assert estimates[-1].state == "tracking" and estimates[-1].doubt is None and 0 <= estimates[-1].score <= 1
    assert estimates[-1].covariance.shape == (4, 4)
    # `kcf` sees this square to a pixel, a quarter of its cell, and the velocity of a single frame follows that.
    velocities = [e.velocity for e in estimates[20:]]
    assert np.mean(velocities, axis=0) == pytest.approx((60, 30), abs=10)


def test_a_target_that_is_not_there_is_said_to_be_gone(square):
    images, boxes = square
    tracker = pursuit.Tracker("kcf")
    follow(tracker, images, boxes[0])
    nothing = np.full_like(images[0], 90)
    last = [tracker.update(nothing) for _ in range(120)][-1]
    assert (last.state, last.doubt) == ("lost", "gone")


def test_what_is_followed_in_doubt_is_unsure(square):
    images, boxes = square
    doubting = pursuit.Tracker("kcf", policy={"occluded_below": 1.0, "seen_from": 1.0})
    estimates = follow(doubting, images[:10], boxes[0])
    assert [e.state for e in estimates[1:]] == ["unsure"] * 9
    assert all(e.measurement is not None and overlap(e.box, b) > 0.5 for e, b in zip(estimates, boxes))


def test_layouts_give_the_same_answer():
    images, boxes = moving_square(color=True)
    images = [np.ascontiguousarray(i) for i in images]
    for k, image in enumerate(images):  # some colour, so that orders differ
        image[..., 0] = np.roll(image[..., 0], k % 3, axis=0)
    plain = [e.box for e in follow(pursuit.Tracker("kcf"), images, boxes[0])]
    wide = [np.zeros((130, 200, 3), np.uint8) for _ in images]
    for w, image in zip(wide, images):
        w[5:125, 9:169] = image
    views = [w[5:125, 9:169] for w in wide]
    layouts = {
        "a view with a stride": (views, "rgb"),
        "rows of another order": ([np.asfortranarray(i) for i in images], "rgb"),
        "bgr": ([np.ascontiguousarray(i[..., ::-1]) for i in images], "bgr"),
        "bgr by negative strides": ([np.ascontiguousarray(i[..., ::-1])[..., ::-1] for i in images], "rgb"),
        "upside down twice": ([np.ascontiguousarray(i[::-1])[::-1] for i in images], "rgb"),
    }
    for what, (frames, channels) in layouts.items():
        found = [e.box for e in follow(pursuit.Tracker("kcf", channels=channels), frames, boxes[0])]
        assert found == plain, what


def test_grey_of_sixteen_bits_and_depth_are_taken(square):
    images, boxes = square
    deep = [i.astype(np.uint16) * 200 for i in images]
    assert overlap(follow(pursuit.Tracker("kcf"), deep, boxes[0])[-1].box, boxes[-1]) > 0.5
    tracker = pursuit.Tracker("depth-occlusion")
    depth = [np.full(i.shape, 3000, np.uint16) for i in images]
    for d, (x, y, w, h) in zip(depth, boxes):
        d[y : y + h, x : x + w] = 1500
    tracker.init(images[0], boxes[0], depth=depth[0])
    last = [tracker.update(i, depth=d) for i, d in zip(images[1:], depth[1:])][-1]
    assert overlap(last.box, boxes[-1]) > 0.5


def test_nothing_of_a_frame_is_kept(square):
    images, boxes = square
    reused = images[0].copy()
    kept, tracker = pursuit.Tracker("median-flow"), pursuit.Tracker("median-flow")
    expected = [e.box for e in follow(kept, images, boxes[0])]
    found = [tracker.init(reused, boxes[0]).box]
    for image in images[1:]:
        reused[:] = image  # what a camera does with its buffer
        found.append(tracker.update(reused).box)
    assert found == expected


def test_copies_pickles_and_saved_bytes_go_on_alike(square):
    images, boxes = square
    tracker = pursuit.Tracker("kcf", motion="imm", fps=25)
    follow(tracker, images[:20], boxes[0])
    others = [
        copy.copy(tracker),
        copy.deepcopy(tracker),
        pickle.loads(pickle.dumps(tracker)),
        pursuit.Tracker.restore(tracker.save()),
    ]
    for image in images[20:]:
        expected = tracker.update(image)
        for other in others:
            found = other.update(image)
            assert (found.box, found.frame, found.time_s) == (expected.box, expected.frame, expected.time_s)
    fresh = pickle.loads(pickle.dumps(pursuit.Tracker("kcf")))
    with pytest.raises(pursuit.StateError, match="init"):
        fresh.update(images[0])


def test_parameters_are_the_registry_s(square):
    tracker = pursuit.Tracker("kcf", motion="imm", policy={"model": "always"}, search__model="near")
    groups = tracker.parameters
    assert groups["motion"]["model"] == "imm" and groups["policy"]["model"] == "always"
    for name in pursuit.trackers:
        assert pursuit.trackers[name].name == name
        document = pursuit.trackers[name].__doc__
        for parameter in pursuit.trackers[name].parameters:
            assert parameter["name"] in document
    assert pursuit.trackers.kcf_fixed().name == "kcf-fixed"
    assert "kcf_fixed" in dir(pursuit.trackers)
    import inspect

    signature = inspect.signature(pursuit.trackers.kcf)
    assert all(p.default is not inspect.Parameter.empty for p in signature.parameters.values() if p.name != "more")


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda i: pursuit.Tracker("kfc"), pursuit.UsageError, "no tracker called `kfc`; there are: pursuit"),
        (lambda i: pursuit.Tracker("kcf", sigma=3), pursuit.UsageError, "`sigma` of `kcf`: there is no such parameter"),
        (lambda i: pursuit.Tracker("kcf", motion="im"), pursuit.UsageError, "expected one of"),
        (lambda i: pursuit.Tracker("kcf", fps=0), pursuit.UsageError, "fps is 0"),
        (lambda i: pursuit.Tracker("kcf", channels="hsv"), pursuit.UsageError, "rgb"),
        (lambda i: pursuit.Tracker("kcf").init(i, (1, 2, 3)), pursuit.UsageError, "four numbers"),
        (lambda i: pursuit.Tracker("kcf").init(i, (1, 2, 0, 3)), pursuit.UsageError, "is empty"),
        (lambda i: pursuit.Tracker("kcf").init(i, (500, 2, 9, 9)), pursuit.UsageError, "outside the frame"),
        (lambda i: pursuit.Tracker("kcf").init(i, (float("nan"), 2, 9, 9)), pursuit.UsageError, "finite"),
        (lambda i: pursuit.Tracker("kcf").init(i / 2, (1, 2, 9, 9)), pursuit.InputError, "float64"),
        (lambda i: pursuit.Tracker("kcf").init(i[:0], (1, 2, 9, 9)), pursuit.InputError, "empty"),
        (lambda i: pursuit.Tracker("kcf").init(3, (1, 2, 9, 9)), pursuit.InputError, "int"),
        (lambda i: pursuit.Tracker("kcf").init("no/such.png", (1, 2, 9, 9)), pursuit.InputError, "such.png"),
        (lambda i: pursuit.Tracker("kcf").update(i), pursuit.StateError, "init"),
        (lambda i: pursuit.Tracker("kcf").init(i, (9, 9, 9, 9), depth=i), pursuit.InputError, "millimetres"),
        (lambda i: pursuit.Tracker("kcf").init(i, (9, 9, 9, 9), time_s=float("inf")), pursuit.UsageError, "time_s"),
        (lambda i: pursuit.Tracker("ball").init(i, (9, 9, 9, 9)), pursuit.InputError, "colour"),
        (lambda i: pursuit.Tracker.restore(b"something"), pursuit.StateError, "no saved tracker"),
        (lambda i: pursuit.MultiTracker(detector="balls"), pursuit.UsageError, "no detector called"),
        (lambda i: pursuit.MultiTracker().remove(4), pursuit.UsageError, "no target 4"),
    ],
)
def test_errors_are_exceptions_of_one_line(make, error, words, square):
    with pytest.raises(error) as raised:
        make(square[0][0])
    assert issubclass(error, pursuit.PursuitError)
    assert words in str(raised.value) and "\n" not in str(raised.value)


def test_a_frame_of_another_size_is_refused_and_the_tracker_goes_on(square):
    images, boxes = square
    tracker = pursuit.Tracker("kcf")
    tracker.init(images[0], boxes[0])
    with pytest.raises(pursuit.InputError, match="frame 1 is .* started on"):
        tracker.update(images[1][:50])
    assert tracker.update(images[1]).frame == 1


def test_damaged_states_are_refused(square):
    images, boxes = square
    tracker = pursuit.Tracker("kcf")
    follow(tracker, images[:3], boxes[0])
    saved = tracker.save()
    for cut in range(0, len(saved), max(1, len(saved) // 40)):
        with pytest.raises(pursuit.PursuitError):
            pursuit.Tracker.restore(saved[:cut])


def test_many_targets(square):
    images, boxes = square
    targets = pursuit.MultiTracker("kcf")
    first = targets.add(images[0], boxes[0])
    second = targets.add(images[0], (100, 80, 20, 20))
    assert (first, second, targets.targets) == (1, 2, [1, 2])
    for image, box in zip(images[1:20], boxes[1:20]):
        known = targets.update(image)
        assert [e.target for e in known] == [1, 2] and overlap(known[0].box, box) > 0.5
    again = pickle.loads(pickle.dumps(targets))
    assert [e.box for e in again.update(images[20])] == [e.box for e in targets.update(images[20])]
    targets.remove(second)
    assert [e.target for e in targets.update(images[21])] == [1]


def test_times_of_any_origin_are_taken(square):
    images, boxes = square
    # Steps of 1/32 s are exact about both origins, so that the answers are equal to the last bit.
    plain, epoch = (pursuit.MultiTracker("kcf", fps=32) for _ in range(2))
    plain.add(images[0], boxes[0])
    epoch.add(images[0], boxes[0], time_s=2.0**30)
    for k, image in enumerate(images[1:20], 1):
        (a,), (b,) = plain.update(image), epoch.update(image, time_s=2.0**30 + k / 32)
        assert (a.time_s, b.time_s) == (k / 32, 2.0**30 + k / 32)
        assert a.box == b.box and a.velocity == b.velocity
    # A target added later begins at the time of the frame, not at that of its number.
    epoch.add(images[19], (100, 80, 20, 20))
    assert epoch.update(images[20])[1].velocity is not None
    assert epoch.update(images[21])[0].time_s == 2.0**30 + 21 / 32


def test_what_moves_is_found_and_followed():
    images, boxes = moving_square(frames=60, step=(1, 1))
    targets = pursuit.MultiTracker(detector="motion")
    known = [targets.update(image) for image in images]
    assert known[-1] and overlap(known[-1][0].box, boxes[-1]) > 0.3
    found = list(pursuit.detect(images, "motion"))
    assert len(found) == 60 and found[-1] and overlap(found[-1][0][0], boxes[-1]) > 0.3
    assert pursuit.detect(images[0], "motion") == []


def test_a_call_while_another_thread_is_in_the_tracker_waits(square):
    images, boxes = square
    tracker = pursuit.Tracker("pursuit")
    tracker.init(images[0], boxes[0])
    seen, failures = [], []

    def work():
        try:
            for image in images[1:10]:
                seen.append(tracker.update(image).frame)
        except Exception as e:
            failures.append(e)

    threads = [threading.Thread(target=work) for _ in range(4)]
    [t.start() for t in threads]
    [t.join(60) for t in threads]
    assert not failures and sorted(seen) == list(range(1, 37))


def test_opencv_s_interface(square):
    images, boxes = square
    tracker = pursuit.cv2.TrackerPursuit.create("kcf")
    assert tracker.getTrackingScore() == 0.0
    tracker.init(images[0], boxes[0])
    for image, box in zip(images[1:], boxes[1:]):
        ok, found = tracker.update(image)
        assert ok is True and overlap(found, box) > 0.5 and all(isinstance(v, int) for v in found)
        assert tracker.getTrackingScore() == tracker.estimate.score > 0.4


def test_adapters(square):
    from types import SimpleNamespace

    from pursuit.integrations.ultralytics import Boxes, boxes_of

    images, boxes = square
    estimate = pursuit.Tracker("kcf").init(images[0], boxes[0])
    found = Boxes([estimate], images[0].shape)
    x, y, w, h = boxes[0]
    assert found.xyxy.tolist() == [[x, y, x + w, y + h]] and found.xywh.tolist() == [[x + w / 2, y + h / 2, w, h]]
    assert found.xyxyn[0, 2] == pytest.approx((x + w) / 160) and found.data.shape == (1, 7) and len(found) == 1
    assert boxes_of(SimpleNamespace(boxes=found)).tolist() == [[x, y, w, h]]
    supervision = pytest.importorskip("supervision")
    from pursuit.integrations.supervision import from_detections, to_detections

    detections = to_detections([estimate])
    assert isinstance(detections, supervision.Detections) and detections.tracker_id.tolist() == [1]
    assert from_detections(detections).tolist() == [[x, y, w, h]]
