"""Boxes of anybody's detector, as arrays, to tracks."""

import pickle
import threading
from types import SimpleNamespace

import numpy as np
import pursuit
import pytest
from conftest import moving_square

SIZE = (640, 480)


def walkers(frame, count=3):
    """Boxes of things that walk to the right, one below the other, as left, top, width, height."""
    return np.array([(20.0 + 3 * frame, 10 + 120 * k, 40, 90) for k in range(count)])


def follow(associator, frames=30, **more):
    return [associator.update(walkers(k), np.full(3, 0.9), **more) for k in range(frames)]


def test_boxes_become_tracks_with_the_index_taken():
    associator = pursuit.Associator(size=SIZE, fps=25)
    for k in range(30):
        order = np.roll(np.arange(3), k)
        tracks = associator.update(walkers(k)[order], [0.9, 0.8, 0.85], classes=order)
    assert len(tracks) == 3 and tracks.ids.tolist() == [1, 2, 3] == associator.targets
    assert tracks.ids.dtype == np.int64 and tracks.boxes.dtype == float and tracks.boxes.shape == (3, 4)
    assert (tracks.states == tracks.TRACKING).all() and ((tracks.scores > 0) & (tracks.scores <= 1)).all()
    # What is attached to a box is found by the index; the class goes along.
    np.testing.assert_array_equal(walkers(29)[order][tracks.detections], tracks.boxes)
    np.testing.assert_array_equal(order[tracks.detections], tracks.class_ids)
    # Without its box a target is coasted and has no index.
    tracks = associator.update(walkers(30)[1:], [0.9, 0.8])
    gone = tracks.detections < 0
    assert gone.sum() == 1 and tracks.states[gone].tolist() != [tracks.TRACKING] and (tracks.class_ids >= 0).all()
    assert np.abs(tracks.boxes[gone][0] - walkers(30)[0]).max() < 6
    assert associator.forecast(1, 1.0)[0] > tracks.boxes[0, 0] + 30


def test_corners_lists_and_other_types_are_the_same():
    plain = follow(pursuit.Associator(size=SIZE))
    others = pursuit.Associator(size=SIZE)
    for k, expected in enumerate(plain):
        boxes = walkers(k)
        boxes[:, 2:] += boxes[:, :2]
        given = (boxes.tolist(), np.asfortranarray(boxes), boxes.astype(np.int32))[k % 3]
        found = others.update(given, np.full(6, 0.9)[::2], corners=True)
        np.testing.assert_array_equal(found.boxes, expected.boxes)
        np.testing.assert_array_equal(found.ids, expected.ids)


def test_a_frame_without_boxes_is_a_frame():
    associator = pursuit.Associator()
    for nothing in ([], np.empty((0, 4)), np.empty((0, 4), dtype=np.float32)):
        tracks = associator.update(nothing, [], [], np.empty((0, 8)))
        assert len(tracks) == 0 and tracks.boxes.shape == (0, 4) and tracks.ids.shape == (0,)


def test_bad_arrays_are_refused_and_change_nothing():
    associator = pursuit.Associator(size=SIZE, fps=25)
    follow(associator, 10)
    before = associator.save()
    box = [[10.0, 10, 20, 20]]
    bad = [
        ((np.zeros((2, 5)),), "not (n, 4)"),
        ((np.zeros(4),), "not (n, 4)"),
        ((np.zeros((2, 2, 4)),), "not (n, 4)"),
        (([["a", "b", "c", "d"]],), "no array of numbers"),
        ((None,), "boxes"),
        ((box, [0.5, 0.5]), "scores has shape [2], not (1,)"),
        ((box, [[0.5]]), "scores has shape"),
        ((box, [1.5]), "outside of 0 to 1"),
        ((box, [np.nan]), "outside of 0 to 1"),
        (([[np.nan, 1, 2, 3]], [0.5]), "not a finite number"),
        (([[0, 0, np.inf, 3]], [0.5]), "not a finite number"),
        (([[1e300, 0, 1, 3]], [0.5]), "farther than"),
        ((box, [0.5], [0.5]), "whole numbers"),
        ((box, [0.5], [np.nan]), "whole numbers"),
        ((box, [0.5], [1, 2]), "classes has shape"),
        ((box, [0.5], None, np.zeros((2, 3))), "embeddings has 2 rows for 1 boxes"),
        ((box, [0.5], None, np.zeros(3)), "embeddings has shape"),
    ]
    for arguments, words in bad:
        with pytest.raises(pursuit.PursuitError) as error:
            associator.update(*arguments)
        assert words in str(error.value) and "\n" not in str(error.value), (arguments, str(error.value))
    for time_s in (0.1, np.nan, -1.0, np.inf):
        with pytest.raises(pursuit.PursuitError):
            associator.update(box, [0.5], time_s=time_s)
    assert associator.save() == before
    # No area, all alike, far outside: boxes all the same.
    for boxes in (np.zeros((50, 4)), np.full((50, 4), 7.0), np.full((50, 4), -1e6), [[1, 1, -5, -5]]):
        associator.update(boxes, np.full(len(boxes), 0.9))
    for wrong in ({"fps": 0}, {"fps": np.nan}, {"size": (0, 5)}, {"gait": 1}, {"association": "nearby"}, {"gate": -1}):
        with pytest.raises(pursuit.UsageError):
            pursuit.Associator(**wrong)
    with pytest.raises(pursuit.UsageError, match="cpu, cuda, tensorrt, openvino, coreml, not `abacus`"):
        pursuit.Associator(device="abacus")
    # Where no network tells looks apart there is nothing to hand over, here and after it was saved.
    elsewhere = pursuit.Associator(device="cuda")
    assert len(pursuit.Associator.restore(elsewhere.save()).targets) == 0


def test_parameters_name_models():
    associator = pursuit.Associator(association="buffered", birth="hits", birth__hits__hits=2)
    ids = [associator.update(walkers(k), [0.9] * 3).ids.tolist() for k in range(3)]
    assert ids == [[], [1, 2, 3], [1, 2, 3]]


def test_published_ways_are_taken_by_name():
    told = {}
    for name in ("sort", "bytetrack", "ocsort", "botsort", "cbiou"):
        associator = pursuit.Associator(preset=name, fps=30)
        told[name] = [associator.update(walkers(k), [0.9] * 3).ids.tolist() for k in range(6)]
        assert told[name][-1] == [1, 2, 3]
    # Each begins when its program does: in the first frame, or once a target was detected again and again.
    assert {name: next(k for k, ids in enumerate(all) if ids) for name, all in told.items()} == {"sort": 2, "bytetrack": 1, "ocsort": 1, "botsort": 0, "cbiou": 0}
    later = pursuit.Associator(preset="botsort", birth="hits", birth__at_start=0, birth__hits__hits=3, birth__hits__looks=3)
    assert later.update(walkers(0), [0.9] * 3).ids.tolist() == []
    with pytest.raises(pursuit.UsageError, match="botsort"):
        pursuit.Associator(preset="deep")


def test_embeddings_tell_neighbours_apart():
    red, blue = [1.0, 0.0], [0.0, 1.0]

    def swapped(embeddings):
        associator = pursuit.Associator(size=SIZE, fps=25)
        for _ in range(20):
            before = associator.update([[100, 100, 40, 90], [118, 100, 40, 90]], [0.9, 0.9], embeddings=embeddings)
        after = associator.update([[112, 100, 40, 90], [106, 100, 40, 90]], [0.9, 0.9], embeddings=embeddings)
        return before.detections.tolist() != after.detections.tolist()

    assert swapped(None) and not swapped([red, blue])
    assert swapped([[np.nan, 0.0], [np.nan, 1.0]]), "a row with NaN says nothing"


def test_colours_of_the_picture_tell_neighbours_apart():
    def picture(boxes):
        image = np.full((240, 320, 3), 90, np.uint8)
        for (left, top, width, height), color in zip(boxes, ([200, 30, 30], [30, 30, 200])):
            image[top : top + height, left : left + width] = color
        return image

    def swapped(**parameters):
        associator = pursuit.Associator(size=(320, 240), fps=25, **parameters)
        for _ in range(20):
            apart = [[100, 100, 30, 60], [131, 100, 30, 60]]
            before = associator.update(apart, [0.9, 0.9], frame=picture(apart))
        for _ in range(30):
            associator.update([], [], frame=picture([]))
        crossed = [[131, 100, 30, 60], [100, 100, 30, 60]]
        after = associator.update(crossed, [0.9, 0.9], frame=picture(crossed))
        return before.detections.tolist() != after.detections.tolist()

    assert swapped() and not swapped(embedding__model="colors")
    with pytest.raises(pursuit.PursuitError, match="names no network"):
        pursuit.Associator(embedding__model="network")


def test_a_frame_tells_the_camera_s_motion():
    images, _ = moving_square(frames=1, size=(240, 320))
    wide = np.tile(images[0], (2, 2))

    def last(frames):
        associator = pursuit.Associator(fps=25, motion__camera="phase")
        for k in range(12):
            # The camera turns by 6 px a frame, from frame 6 on: what stands still moves.
            shift = 6 * max(k - 5, 0)
            picture = np.ascontiguousarray(wide[40:280, 40 + shift : 360 + shift]) if frames else None
            seen = [[200 - shift, 100, 20, 40]] if k < 8 else []
            tracks = associator.update(seen, [0.9] * len(seen), frame=picture)
        return tracks.boxes[0, 0]

    assert abs(last(True) - (200 - 36)) < 8


def test_saved_and_pickled_it_goes_on_alike():
    associator = pursuit.Associator(size=SIZE, fps=25)
    follow(associator, 10)
    copies = [pursuit.Associator.restore(associator.save()), pickle.loads(pickle.dumps(associator))]
    expected = associator.update(walkers(10), [0.9] * 3)
    for copy in copies:
        found = copy.update(walkers(10), [0.9] * 3)
        assert found.ids.tolist() == expected.ids.tolist() and found.boxes.tolist() == expected.boxes.tolist()
    for bad in (b"", b"pursuit associator 1\n", associator.save()[:-3], b"x" * 100):
        with pytest.raises(pursuit.StateError):
            pursuit.Associator.restore(bad)
    assert repr(associator) == "Associator(size=(640, 480), fps=25)"


def test_threads_wait_for_one_another():
    associator, failures = pursuit.Associator(size=SIZE), []

    def work():
        try:
            for _ in range(50):
                associator.update(walkers(0), [0.9] * 3)
        except Exception as e:
            failures.append(e)

    threads = [threading.Thread(target=work) for _ in range(4)]
    [t.start() for t in threads]
    [t.join(60) for t in threads]
    assert not failures and associator.targets == [1, 2, 3]


def test_supervision_s_detections_keep_what_is_attached():
    supervision = pytest.importorskip("supervision")
    from pursuit.integrations.supervision import associate

    associator = pursuit.Associator(size=SIZE, fps=25)
    for k in range(10):
        boxes = walkers(k)
        boxes[:, 2:] += boxes[:, :2]
        masks = np.zeros((3, 8, 8), dtype=bool)
        masks[np.arange(3), np.arange(3)] = True
        given = supervision.Detections(
            boxes[::-1], masks, np.full(3, 0.9), np.array([2, 5, 7]), data={"name": np.array(["a", "b", "c"])}
        )
        found = associate(associator, given)
    assert found.tracker_id.tolist() == [1, 2, 3]
    by_box = np.argsort(-found.xyxy[:, 1])
    assert found.class_id[by_box].tolist() == [2, 5, 7] and found.data["name"][by_box].tolist() == ["a", "b", "c"]
    assert found.mask[by_box].argmax(axis=1)[:, 0].tolist() == [0, 1, 2]


def test_ultralytics_results_are_associated():
    from pursuit.integrations.ultralytics import Boxes, associate

    associator = pursuit.Associator(size=SIZE, fps=25)
    for k in range(10):
        boxes = walkers(k)
        boxes[:, 2:] += boxes[:, :2]
        result = SimpleNamespace(boxes=SimpleNamespace(xyxy=boxes, conf=np.full(3, 0.9), cls=np.array([2.0, 5, 7])))
        tracks = associate(associator, result)
    found = Boxes(tracks, (480, 640))
    assert found.cls.tolist() == np.array([2, 5, 7])[tracks.detections].tolist() and found.id.tolist() == [1, 2, 3]
    assert found.data.shape == (3, 7) and found.xywh[0, 2:].tolist() == [40, 90]


def test_class_ids_of_estimates_are_their_names_numbers():
    from pursuit.integrations.ultralytics import Boxes

    def estimate(word):
        return SimpleNamespace(box=(0, 0, 5, 5), score=0.5, target=1, state="tracking", class_name=word)

    found = [estimate(w) for w in ("person", "car", "17", "unicorn", None)]
    assert Boxes(found, (9, 9)).cls.tolist() == [0, 2, 17, -1, -1]
    assert Boxes(found, (9, 9), {4: "unicorn", 9: "car"}).cls.tolist() == [-1, 9, 17, 4, -1]
    pytest.importorskip("supervision")
    from pursuit.integrations.supervision import to_detections

    assert to_detections(found, names=["car", "person"]).class_id.tolist() == [1, 0, 17, -1, -1]
